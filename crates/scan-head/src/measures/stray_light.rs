//! Light where no mark is: what the lit spot goes farther than the spot's diameter from any mark that is or was commanded just before, or
//! over one against it or at the speed of a jump.

use meltpath_geometry::math::DVec2;

use crate::measures::dark_way::Stretch;

/// Light that draws no mark, while a run streams.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StrayLight {
    /// All of it, mm.
    pub length: f64,
    /// What of it lies on marks that the spot does not run along: that of jumps, mm.
    pub jumped: f64,
    /// All that the spot goes in light, mm.
    pub lit: f64,
    /// The longest stretch.
    pub longest: Stretch,
    /// The stretch now.
    now: Stretch,
}

impl StrayLight {
    /// The share of the way in light that is one of jumps over marks.
    pub fn jumped_share(&self) -> f64 {
        if self.lit > 0.0 {
            self.jumped / self.lit
        } else {
            0.0
        }
    }

    /// The spot goes on, lit, over marks that it does not run along.
    pub(super) fn jumps(&mut self, way: [DVec2; 2], layer: u32) {
        self.jumped += way[0].distance(way[1]);
        self.goes(way, layer);
    }

    /// The spot goes on, lit, where no mark is drawn.
    pub(super) fn goes(&mut self, [from, to]: [DVec2; 2], layer: u32) {
        if self.now.length == 0.0 {
            (self.now.from, self.now.layer) = (from, layer);
        }
        let way = from.distance(to);
        self.length += way;
        self.now.length += way;
        if self.now.length > self.longest.length {
            self.longest = self.now;
        }
    }

    /// The light goes off, or comes to a mark.
    pub(super) fn ends(&mut self) {
        self.now.length = 0.0;
    }
}
