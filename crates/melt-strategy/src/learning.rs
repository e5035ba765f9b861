//! Iterative learning: a path is drawn again and again, each time with more heat where it was too cold and less where it was
//! too hot.
//!
//! Beyond the thesis (docs/theory/sources.md). What a voxel lacks is put down to the piece of the path on which the
//! beam was when that voxel was hottest: where lines lie close that is often the line after the one that crosses it.

use meltpath_base::{Observer, Quiet};

use crate::error::StrategyError;
use crate::lever::Lever;
use crate::peaks::{Draw, Peaks};
use crate::speed::SpeedProfile;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::{CELSIUS, Material};

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
    learning.lever.check(path)?;
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
        let pieces = Pieces::new(&learning.lever, &profile, path);
        let excess = excess(&peaks, &pieces, learning.aim, material.start, judged);
        // of equal rounds the later one: where none reaches the window at all it has come nearest
        if best.as_ref().is_none_or(|(most, _)| reached >= *most) {
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

/// The pieces of a path as it is drawn.
struct Pieces {
    /// When each begins, and the last one ends, s.
    times: Vec<f64>,
    /// Whether the beam is on.
    on: Vec<bool>,
    /// Which run each belongs to: the beam moves along a run without a jump, and a spot is a run of its own. None where the lever
    /// changes nothing.
    runs: Vec<Option<usize>>,
    /// Where the middle of each lies, mm.
    middles: Vec<[f64; 2]>,
}

impl Pieces {
    fn new(lever: &Lever, profile: &SpeedProfile, path: &BeamPath) -> Self {
        let mut pieces = Pieces {
            times: lever.times(profile, path),
            on: Vec::new(),
            runs: Vec::new(),
            middles: Vec::new(),
        };
        let mut run = 0;
        let mut end: Option<[f64; 2]> = None;
        for (from, to, _) in profile.intervals() {
            let (begun, midway) = (path.at(from), path.at(0.5 * (from + to)));
            let way = [midway.x - begun.x, midway.y - begun.y];
            let moves = begun.is_on() && way != [0.0, 0.0];
            let goes_on = end.is_some_and(|e| (e[0] - begun.x).hypot(e[1] - begun.y) < 1e-6);
            if !(moves && goes_on) {
                run += 1;
            }
            end = moves.then(|| [midway.x + way[0], midway.y + way[1]]);
            pieces.on.push(begun.is_on());
            pieces.middles.push([midway.x, midway.y]);
            pieces.runs.push(lever.acts(path, from, to).then_some(run));
        }
        pieces
    }

    /// The piece that heated `place` most when it was hottest at `time`: the last one before that with the beam on, or one before
    /// it on the same run that passed nearer. What is hottest lies behind the beam.
    fn heating(&self, place: [f64; 2], time: f64) -> Option<usize> {
        let after = self.times.partition_point(|t| *t <= time);
        let mut piece = (0..after.min(self.on.len())).rev().find(|n| self.on[*n])?;
        let far = |n: usize| {
            let [dx, dy] = [0, 1].map(|a| self.middles[n][a] - place[a]);
            dx * dx + dy * dy
        };
        while piece > 0 && self.runs[piece - 1] == self.runs[piece] && far(piece - 1) < far(piece) {
            piece -= 1;
        }
        Some(piece)
    }

    /// Pieces that no judged place speaks of do as the nearest one on their run that is spoken of: the ends of lines that
    /// overrun the contour.
    fn filled(&self, found: &[Option<f64>]) -> Vec<Option<f64>> {
        let mut filled = found.to_vec();
        let follow = |filled: &mut Vec<Option<f64>>, n: usize, other: usize| {
            if filled[n].is_none() && self.runs[n].is_some() && self.runs[n] == self.runs[other] {
                filled[n] = filled[other];
            }
        };
        for n in 1..filled.len() {
            follow(&mut filled, n, n - 1);
        }
        for n in (1..filled.len()).rev() {
            follow(&mut filled, n - 1, n);
        }
        filled
    }

    /// The pieces that answer for what `piece` heats, with their weights; none where the lever changes nothing.
    fn answering(&self, piece: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let first = piece.saturating_sub(WEIGHTS.len() - 1);
        let last = (piece + WEIGHTS.len()).min(self.runs.len());
        (first..last)
            .filter(move |n| self.runs[piece].is_some() && self.runs[*n] == self.runs[piece])
            .map(move |n| (n, WEIGHTS[n.abs_diff(piece)]))
    }
}

/// Relative excess of the highest temperature over the aim, mean over the voxels that each interval made hottest.
fn excess(
    peaks: &Peaks,
    pieces: &Pieces,
    aim: f64,
    ambient: f64,
    judged: &dyn Fn([f64; 2]) -> bool,
) -> Vec<Option<f64>> {
    let mut sums = vec![[0.0; 2]; pieces.runs.len()];
    let grid = &peaks.highest.grid;
    let top = grid.planes() - 1;
    let nx = grid.cells[0];
    for (column, when) in peaks.when.iter().enumerate().filter(|(_, w)| !w.is_nan()) {
        let centre = grid.centre(column % nx, column / nx, top);
        let place = [centre.x, centre.y];
        if !judged(place) {
            continue;
        }
        let Some(piece) = pieces.heating(place, *when) else {
            continue;
        };
        let found = peaks.highest.at(column % nx, column / nx, top);
        let value = (found - aim) / (aim - ambient);
        for (n, weight) in pieces.answering(piece) {
            sums[n][0] += weight * value;
            sums[n][1] += weight;
        }
    }
    let found: Vec<Option<f64>> = sums
        .iter()
        .map(|[sum, weight]| (*weight > 0.0).then(|| sum / weight))
        .collect();
    pieces.filled(&found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lever::tests::at;

    /// Lines answer along themselves, not across a jump; a spot answers for itself; heat after switching off is the last piece's.
    #[test]
    fn pieces_answer_for_what_they_heat() {
        let path = BeamPath::new(vec![
            at(0.0, 0.0, true),
            at(2.0, 2.0, false),
            at(3.0, 5.0, true),
            at(5.0, 7.0, true),
            at(5.0, 7.0, true),
            at(6.0, 7.0, true),
            at(6.0, 9.0, true),
            at(7.0, 9.0, false),
        ])
        .unwrap();
        let profile = SpeedProfile::of(&path, 1.0);
        let of = |lever: &Lever, time: f64| {
            let pieces = Pieces::new(lever, &profile, &path);
            let here = path.at(time);
            let piece = pieces.heating([here.x, here.y], time).unwrap();
            pieces.answering(piece).map(|(n, _)| n).collect::<Vec<_>>()
        };
        assert_eq!(of(&Lever::Speed, 1.5), [0, 1]);
        assert_eq!(of(&Lever::Speed, 2.5), [0, 1]);
        assert_eq!(of(&Lever::Power, 3.5), [3, 4]);
        assert_eq!(of(&Lever::Power, 5.5), [5]);
        assert_eq!(of(&Lever::Dwell, 6.5), [6]);
        assert!(of(&Lever::Dwell, 3.5).is_empty());
        let pieces = Pieces::new(&Lever::Speed, &profile, &path);
        // the second piece passes behind the beam, and the first nearer still
        assert_eq!(
            [1.4, 0.6].map(|x| pieces.heating([x, 0.0], 2.0)),
            [Some(1), Some(0)]
        );
        let all = [Some(0.1), Some(0.1), None, Some(0.2), Some(0.2), None, None];
        let (back, forth) = (
            [None, Some(0.1), None, None, Some(0.2), None, None],
            [Some(0.1), None, None, Some(0.2), None, None, None],
        );
        assert_eq!(pieces.filled(&back), all);
        assert_eq!(pieces.filled(&forth), all);
    }
}
