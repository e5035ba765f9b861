//! The tool along a stretch by filter times and dwells under trial: the motion of jobs, between whole milliseconds in proportion.

use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::MotionBlock;

use super::driven::{End, Stretch};
use crate::controller::Controller;
use crate::interpolation::fir::{MotionError, simulate_dwelling};

/// Time between samples of the model, s. Filters last whole numbers of it; between these positions are taken in proportion, which at
/// 12.5 mm/s and filters of 100 ms is exact to a nanometre.
pub const STEP: f64 = 1e-3;

/// What describes a controller, under trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    /// T_1 + T_2, s.
    pub sum: f64,
    /// (T_1 - T_2)², s²: positions depend on it smoothly, also where both are equal.
    pub spread: f64,
    /// The dwell of each smoothing of the path, s.
    pub dwells: Vec<f64>,
}

impl Law {
    /// T_1 and T_2, s.
    pub fn filters(&self) -> [f64; 2] {
        let half = 0.5 * self.spread.max(0.0).sqrt();
        [0.5 * self.sum + half, 0.5 * self.sum - half]
    }

    /// The same within what a model can run: no filter shorter than a step, no dwell below nothing or longer than a stop.
    pub(super) fn held(mut self) -> Law {
        self.sum = self.sum.clamp(4.0 * STEP, 3.0);
        self.spread = self.spread.clamp(0.0, (self.sum - 2.0 * STEP).powi(2));
        for dwell in &mut self.dwells {
            *dwell = dwell.clamp(0.0, self.sum);
        }
        self
    }
}

/// The tool along a stretch, every [`STEP`], from the moment at which the program begins it.
#[derive(Debug, Clone)]
pub struct Trace {
    places: Vec<DVec3>,
    /// When it passes the end of each command, s.
    pub passages: Vec<f64>,
}

impl Trace {
    /// Where the tool is at a time, mm: at rest before and after.
    pub fn at(&self, time: f64) -> DVec3 {
        let last = self.places.len().saturating_sub(1);
        let x = (time / STEP).clamp(0.0, last as f64);
        let i = (x as usize).min(last);
        let next = (i + 1).min(last);
        self.places[i].lerp(self.places[next], x - i as f64)
    }

    /// How fast it goes at a time, mm/s.
    pub fn velocity(&self, time: f64) -> DVec3 {
        (self.at(time + STEP) - self.at(time - STEP)) / (2.0 * STEP)
    }

    /// How long it takes, s.
    pub fn duration(&self) -> f64 {
        self.places.len().saturating_sub(1) as f64 * STEP
    }
}

/// The tool along a stretch.
///
/// # Errors
/// [`MotionError`] where a command cannot be executed.
pub fn trace(stretch: &Stretch, law: &Law) -> Result<Trace, MotionError> {
    let [first, second] = law.filters().map(|t| {
        let n = (t / STEP).floor().max(1.0);
        (n, (t / STEP - n).clamp(0.0, 1.0))
    });
    let mut traces: Vec<(f64, Trace)> = Vec::with_capacity(4);
    for (n1, w1) in [(first.0, 1.0 - first.1), (first.0 + 1.0, first.1)] {
        for (n2, w2) in [(second.0, 1.0 - second.1), (second.0 + 1.0, second.1)] {
            if w1 * w2 > 0.0 {
                traces.push((w1 * w2, whole(stretch, law, [n1 * STEP, n2 * STEP])?));
            }
        }
    }
    if traces.len() == 1 {
        // the weight is one
        return Ok(traces.swap_remove(0).1);
    }
    let longest = traces.iter().map(|t| t.1.places.len()).max().unwrap_or(0);
    let place = |i: usize| {
        let at = |t: &Trace| t.places[i.min(t.places.len() - 1)];
        traces.iter().map(|(w, t)| at(t) * *w).sum()
    };
    let passages = (0..stretch.commands.len())
        .map(|k| traces.iter().map(|(w, t)| w * t.passages[k]).sum())
        .collect();
    Ok(Trace {
        places: (0..longest).map(place).collect(),
        passages,
    })
}

/// The tool by filters that last whole numbers of steps.
fn whole(stretch: &Stretch, law: &Law, [t1, t2]: [f64; 2]) -> Result<Trace, MotionError> {
    let mut controller = Controller::without_corners();
    controller.period.value.value.0 = STEP;
    controller.t1.value.value.0 = t1;
    controller.t2.value.value.0 = t2;
    let dwell = |end: &End| match *end {
        End::Through => 0.0,
        End::Corner {
            smoothing, share, ..
        } => share * law.dwells.get(smoothing).copied().unwrap_or(0.0),
        End::Stop => t1 + t2,
    };
    let dwells: Vec<f64> = stretch.ends.iter().map(dwell).collect();
    let mut blocks: Vec<MotionBlock> = Vec::new();
    let summary = simulate_dwelling(
        stretch.start,
        &stretch.commands,
        &dwells,
        &controller,
        STEP,
        &Silent,
        &mut blocks,
    )?;
    Ok(Trace {
        places: blocks.into_iter().flat_map(|b| b.position).collect(),
        passages: summary.commands.iter().map(|c| c.end).collect(),
    })
}
