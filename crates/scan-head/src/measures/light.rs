//! The power in the spot at each sample: that of the mark whose light is on, and how far the spot moved.

use crate::head::block::HeadBlock;
use crate::head::power::PowerLaw;
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Role;

/// Power and speed of the mark whose light is on: after its end the off-delay goes on at its power.
#[derive(Debug, Clone, Copy, Default)]
pub struct Light {
    /// Power of the mark, W.
    pub power: f64,
    /// Speed of the mark as commanded, mm/s; 0 before the first one.
    pub speed: f64,
    last: Option<DVec2>,
    /// What the mark is.
    pub kind: Option<Role>,
}

impl Light {
    /// At the next sample: the power in it, W, and how far the spot moved, mm.
    pub fn step(&mut self, law: PowerLaw, block: &HeadBlock, k: usize) -> (f64, f64) {
        let vector = block.vector(k).map(|(layer, i)| layer.job.vectors[i]);
        if let Some(v) = vector.filter(|v| v.kind.deposits()) {
            (self.power, self.speed, self.kind) = (v.power, v.speed, Some(v.kind));
        }
        let moved = self.last.map_or(0.0, |l| l.distance(block.hit[k]));
        self.last = Some(block.hit[k]);
        let power = if self.speed > 0.0 {
            law.power(self.power, self.speed, moved / block.period)
        } else {
            0.0
        };
        (power * block.lit[k], moved)
    }
}
