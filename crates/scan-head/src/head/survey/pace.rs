//! Marks that cannot run as they are commanded: the clock of the head makes them slower, or an axis does not turn so fast.

use meltpath_geometry::math::DVec3;

use crate::head::head_axis::HeadAxis;
use crate::head::ready::ReadyHead;

/// A mark runs as commanded if it is slower, or commanded faster than it can run, by no more than this share. Ours.
const ALIKE: f64 = 0.05;

/// A mark on its way into the figures.
pub(super) struct Mark {
    pub(super) layer: u32,
    pub(super) ends: [DVec3; 2],
    /// mm.
    pub(super) length: f64,
    /// mm/s.
    pub(super) speed: f64,
}

/// Marks that run otherwise than commanded.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Paces {
    /// Contours that are slower, by more than a twentieth, as each takes whole samples.
    pub slowed_contours: OffPace,
    /// Lines of fills that are.
    pub slowed_fills: OffPace,
    /// Faster than an axis of the head turns.
    pub too_fast: OffPace,
}

/// Marks of one kind, and the one that is farthest from what is commanded.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OffPace {
    /// Their number.
    pub marks: u64,
    /// Their length, mm.
    pub length: f64,
    /// Number of the layer of the worst.
    pub layer: u32,
    /// Where it starts, mm.
    pub at: DVec3,
    /// Its commanded speed, mm/s.
    pub commanded: f64,
    /// The speed at which it runs, or at which its axis lets it run, mm/s.
    pub possible: f64,
}

impl OffPace {
    /// By how much the worst is commanded faster than it runs, as a share; 1 where none is.
    pub fn ratio(&self) -> f64 {
        if self.marks == 0 {
            1.0
        } else {
            self.commanded / self.possible
        }
    }

    pub(super) fn extend(&mut self, mark: Option<OffPace>) {
        let Some(mark) = mark else { return };
        let (marks, length) = (self.marks + 1, self.length + mark.length);
        if mark.ratio() > self.ratio() {
            *self = mark;
        }
        (self.marks, self.length) = (marks, length);
    }
}

impl Mark {
    fn runs_at(&self, possible: f64) -> OffPace {
        OffPace {
            marks: 1,
            length: self.length,
            layer: self.layer,
            at: self.ends[0],
            commanded: self.speed,
            possible,
        }
    }
}

/// A mark of so many samples of `period` s that is clearly slower than commanded.
pub(super) fn too_slow(mark: &Mark, samples: u64, period: f64) -> Option<OffPace> {
    let real = mark.length / (samples.max(1) as f64 * period);
    (mark.length > 0.0 && mark.speed > (1.0 + ALIKE) * real).then(|| mark.runs_at(real))
}

/// A mark that a mirror would have to follow faster than its data sheet lets it turn.
pub(super) fn too_fast(mark: &Mark, head: &ReadyHead) -> Option<OffPace> {
    let limits = head.head().mirrors.each_ref().map(HeadAxis::top_speed);
    if limits == [None; 2] || mark.length == 0.0 {
        return None;
    }
    let [from, to] = mark.ends.map(|p| head.angles(p).truncate());
    let turned = (to - from).abs().to_array();
    let time = mark.length / mark.speed;
    let share = turned
        .iter()
        .zip(limits)
        .filter_map(|(t, limit)| Some(t / time / limit?));
    let worst = share.fold(0.0, f64::max);
    // angles and lengths do not go quite alike over the field
    (worst > 1.0 + ALIKE).then(|| mark.runs_at(mark.speed / worst))
}
