//! Light where no mark is: what the lit spot goes farther than the spot's diameter from any mark that is or was commanded just before, or
//! over one against it or at the speed of a jump.

use meltpath_geometry::math::DVec2;

use crate::measures::dark_way::Stretch;
use crate::measures::segment::distance_to_segment;

/// Light draws marks that are or were commanded at most this long before, s: longer than any lag and off-delay.
pub const WINDOW: f64 = 4e-3;

/// How many times as fast as its mark a spot may run that draws it: one that comes back from beyond a mark's beginning is faster for a while.
const FASTEST: f64 = 4.0;

/// A mark that light may be drawing: from where to where, mm, and its speed, mm/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drawing {
    pub(super) ends: [DVec2; 2],
    pub(super) speed: f64,
}

impl Drawing {
    /// Whether a spot that goes so from sample to sample, a `period` s apart, draws it: it comes within `aside` mm of it, and neither runs against
    /// it, as a jump back over the last line does, nor crosses it as fast as a jump. The one definition of light that draws: the judge and the
    /// tuning of delays go by it.
    pub(super) fn is_drawn(&self, [from, to]: [DVec2; 2], aside: f64, period: f64) -> bool {
        let [a, b] = self.ends;
        let step = to - from;
        distance_to_segment(to, a, b) <= aside
            && step.dot(b - a) >= 0.0
            && step.length() <= FASTEST * self.speed * period
    }
}

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
