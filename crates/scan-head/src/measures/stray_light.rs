//! Light where no mark is: what the lit spot goes farther than the spot's diameter from any mark that is or was commanded just before.

use meltpath_geometry::math::DVec2;

use crate::measures::dark_way::Stretch;

/// Light far from all marks, while a run streams.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StrayLight {
    /// All of it, mm.
    pub length: f64,
    /// The longest stretch.
    pub longest: Stretch,
    /// The stretch now.
    now: Stretch,
}

impl StrayLight {
    /// The spot goes on, lit, far from all marks.
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

    /// The light goes off, or comes near a mark.
    pub(super) fn ends(&mut self) {
        self.now.length = 0.0;
    }
}
