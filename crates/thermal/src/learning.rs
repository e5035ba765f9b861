//! Iterative learning: a path is drawn again and again, each time with more heat where it was too cold and less where it was
//! too hot.
//!
//! Beyond the thesis (specification ebm, section 2.14.3). What a voxel lacks is put down to the piece of the path on which the
//! beam was when that voxel was hottest: where lines lie close that is often the line after the one that crosses it.

use meltpath_base::{Observer, Quiet};

use crate::beam::BeamPath;
use crate::grid::Field;
use crate::lever::Lever;
use crate::material::{CELSIUS, Material};
use crate::peaks::{Draw, Peaks};
use crate::speed::SpeedProfile;
use crate::strategy::StrategyError;

/// How learning goes on.
#[derive(Debug, Clone, PartialEq)]
pub struct Learning {
    /// Highest temperature wanted, K.
    pub aim: f64,
    /// Rounds at most.
    pub rounds: u32,
    /// Relative change of the factor per relative excess of temperature, 0.3 to 1.
    pub gain: f64,
    /// Least and greatest factor.
    pub bounds: [f64; 2],
    /// Length of the intervals of one factor, mm.
    pub length: f64,
    /// What the factors change.
    pub lever: Lever,
    /// The only factors that may be used; any where there are none.
    pub levels: Vec<f64>,
    /// How often along the path the machine can change them.
    pub freedom: Freedom,
}

/// How often along a path a machine can change its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Freedom {
    /// As often as wanted.
    Continuous,
    /// From one straight piece of the path to the next: controllers of 2016 (Béraud 2016, section 3.3.2.2).
    PerLine,
}

/// What learning found.
#[derive(Debug, Clone)]
pub struct Learned {
    /// The best factors.
    pub profile: SpeedProfile,
    /// The path with them.
    pub path: BeamPath,
    /// Highest temperatures it leads to, K.
    pub highest: Field,
    /// Score of each round, the first with the path as it was.
    pub scores: Vec<f64>,
}

/// Draws the path again and again, and keeps the round with the best `score`. Only voxels of the top plane whose centres are
/// `judged` teach; `first` are the factors to begin with, 1 everywhere if there are none.
///
/// # Errors
/// [`StrategyError`], cancellation included.
#[expect(
    clippy::too_many_arguments,
    reason = "what to draw, how to judge it, how to go on"
)]
pub fn learn(
    simulate: &mut Draw<'_>,
    material: &Material,
    path: &BeamPath,
    learning: &Learning,
    first: Option<SpeedProfile>,
    judged: &dyn Fn([f64; 2]) -> bool,
    score: &dyn Fn(&Field) -> f64,
    observer: &dyn Observer,
) -> Result<Learned, StrategyError> {
    let refused = || StrategyError::Aim {
        celsius: learning.aim - CELSIUS,
    };
    if learning.aim <= material.liquidus {
        return Err(refused());
    }
    observer.stage("learn from drawings", u64::from(learning.rounds) + 1);
    let mut wanted = first.unwrap_or_else(|| SpeedProfile::of(path, learning.length));
    let mut best: Option<(f64, Learned)> = None;
    let mut scores = Vec::new();
    for round in 0..=learning.rounds {
        let free = match learning.freedom {
            Freedom::Continuous => wanted.clone(),
            Freedom::PerLine => wanted.by_line(path),
        };
        let profile = free.snapped(&learning.levels);
        let drawn = learning.lever.apply(&profile, path)?;
        let peaks = simulate(&drawn, &Quiet(observer))?;
        let reached = score(&peaks.highest);
        scores.push(reached);
        let times = learning.lever.times(&profile, path.begin());
        let excess = excess(&peaks, &times, learning.aim, material.start, judged);
        if best.as_ref().is_none_or(|(most, _)| reached > *most) {
            let learned = Learned {
                profile,
                path: drawn,
                highest: peaks.highest,
                scores: Vec::new(),
            };
            best = Some((reached, learned));
        }
        observer.advance(1);
        if round < learning.rounds {
            for (factor, excess) in wanted.factors_mut().iter_mut().zip(excess) {
                // a piece that no judged voxel speaks of stays as it is
                let next = *factor * (1.0 + learning.gain * excess.unwrap_or(0.0)).max(0.3);
                *factor = next.clamp(learning.bounds[0], learning.bounds[1]);
            }
        }
    }
    best.map(|(_, learned)| Learned { scores, ..learned })
        .ok_or_else(refused)
}

/// Weights of a voxel for the piece that made it hottest, the pieces beside it, and those beside them: they share the pool.
const WEIGHTS: [f64; 3] = [1.0, 0.6, 0.2];

/// Relative excess of the highest temperature over the aim, mean over the voxels that each interval made hottest.
fn excess(
    peaks: &Peaks,
    times: &[f64],
    aim: f64,
    ambient: f64,
    judged: &dyn Fn([f64; 2]) -> bool,
) -> Vec<Option<f64>> {
    let intervals = times.len().saturating_sub(1);
    let mut sums = vec![[0.0; 2]; intervals];
    let grid = &peaks.highest.grid;
    let top = grid.planes() - 1;
    let nx = grid.cells[0];
    for (column, when) in peaks.when.iter().enumerate().filter(|(_, w)| !w.is_nan()) {
        let centre = grid.centre(column % nx, column / nx, top);
        if intervals == 0 || !judged([centre.x, centre.y]) {
            continue;
        }
        let found = peaks.highest.at(column % nx, column / nx, top);
        let value = (found - aim) / (aim - ambient);
        let piece = times
            .partition_point(|t| t <= when)
            .saturating_sub(1)
            .min(intervals - 1);
        let first = piece.saturating_sub(2);
        for (n, sum) in sums.iter_mut().enumerate().take(piece + 3).skip(first) {
            let weight = WEIGHTS[n.abs_diff(piece)];
            sum[0] += weight * value;
            sum[1] += weight;
        }
    }
    sums.iter()
        .map(|[sum, weight]| (*weight > 0.0).then(|| sum / weight))
        .collect()
}
