//! Straight stretches of a command.

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::MotionBlock;

/// One straight stretch of a command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// When it begins, s.
    pub time: f64,
    /// How long it takes, s; 0 for a jump at once.
    pub takes: f64,
    /// Where it begins, mm.
    pub from: DVec2,
    /// Where it ends, mm.
    pub to: DVec2,
    /// Power, W.
    pub power: f64,
    /// Spot, mm.
    pub spot: f64,
}

impl Stretch {
    /// Whether the beam heats on it.
    pub fn is_lit(&self) -> bool {
        self.power > 0.0 && self.takes > 0.0
    }

    /// When it ends, s.
    pub(crate) fn end(&self) -> f64 {
        self.time + self.takes
    }

    /// mm/s.
    pub(crate) fn velocity(&self) -> DVec2 {
        (self.to - self.from) / self.takes
    }

    /// Nearest distance to the line, mm.
    pub(crate) fn distance(&self, at: DVec2) -> f64 {
        let along = self.to - self.from;
        let share = (at - self.from).dot(along) / along.length_squared();
        let share = if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            0.0
        };
        at.distance(self.from + share * along)
    }
}

/// The stretches of a motion.
pub fn stretches(motion: &MotionBlock) -> Vec<Stretch> {
    let column = |values: &[f64], n: usize| values.get(n).copied().unwrap_or_default();
    (1..motion.len())
        .map(|n| Stretch {
            time: motion.time(n - 1),
            takes: motion.time(n) - motion.time(n - 1),
            from: motion.position[n - 1].truncate(),
            to: motion.position[n].truncate(),
            power: column(&motion.power, n),
            spot: column(&motion.spot, n),
        })
        .collect()
}
