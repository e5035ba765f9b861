//! Filter times and dwells from a log, by least squares over all of its samples that are not held back.
//!
//! Unknown are the sum of the filters, the square of their difference, a dwell for each smoothing, when each stretch begins and where the
//! frame of the log lies. Steps are those of Gauss and Newton, halved until what is left falls; the begins of stretches are eliminated
//! first, so that a log may have many.

use meltpath_base::{Cancelled, Observer};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_numerics::Matrix;
use meltpath_numerics::least_squares::{LeastSquaresError, Regression};

use super::align::{Aligned, Piece};
use super::driven::{DrivenPath, End, Stretch};
use super::frame::Freedom;
use super::log::Log;
use super::model::{Law, STEP, Trace, trace};
use crate::interpolation::fir::MotionError;

/// Why nothing was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentificationError {
    /// The path cannot be driven.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// Stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The least squares.
    #[error("the log does not tell the controller's filters and dwells: {0}")]
    Undetermined(LeastSquaresError),
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    /// The controller.
    pub law: Law,
    /// Standard deviations of the sum (s), of the spread (s²) and of each dwell (s).
    pub sigma: Vec<f64>,
    /// Covariance of sum and spread, s³.
    pub shared: f64,
    /// When each stretch begins, s of the log.
    pub begins: Vec<f64>,
    /// The path's frame from the log's.
    pub frame: Pose,
    /// Root mean square of what is left of one component, mm, freedoms taken off.
    pub rms: f64,
    /// By how much the variance of what was found is raised, as what is left of neighbouring samples is alike.
    pub alike: f64,
    /// Samples that were fitted.
    pub samples: usize,
    /// Steps taken.
    pub steps: usize,
}

/// How sure a filter is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filters {
    /// T_1 and T_2, s.
    pub value: [f64; 2],
    /// Standard deviation of each, s.
    pub sigma: [f64; 2],
    /// Whether the log tells them from one another: from their mean, and from each being half of the sum.
    pub apart: Apart,
}

/// Whether two filters can be told from each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Apart {
    /// They differ by what the log tells.
    Told,
    /// They may as well be equal: their sum is known better than each.
    Open,
}

impl Fitted {
    /// The filters, with what is known of each.
    pub fn filters(&self) -> Filters {
        let [sum_sigma, spread_sigma] = [self.sigma[0], self.sigma[1]];
        let value = self.law.filters();
        let spread = self.law.spread.max(0.0);
        if spread > 2.0 * spread_sigma {
            let root = spread.sqrt();
            // T = (S ± √q) / 2
            let of = |sign: f64| {
                let squares = sum_sigma.powi(2)
                    + spread_sigma.powi(2) / (4.0 * spread)
                    + sign * self.shared / root;
                0.5 * squares.max(0.0).sqrt()
            };
            return Filters {
                value,
                sigma: [of(1.0), of(-1.0)],
                apart: Apart::Told,
            };
        }
        // the difference lies between nothing and the root of what the spread may be
        let most = (spread + 2.0 * spread_sigma).sqrt();
        let sigma = (0.5 * sum_sigma).hypot(0.25 * most);
        Filters {
            value,
            sigma: [sigma; 2],
            apart: Apart::Open,
        }
    }
}

/// The state of the search.
#[derive(Clone)]
struct State {
    law: Law,
    begins: Vec<f64>,
    frame: Pose,
    cost: f64,
}

struct Problem<'a> {
    path: &'a DrivenPath,
    log: &'a Log,
    pieces: &'a [Piece],
    freedom: Freedom,
    used: &'a dyn Fn(usize) -> bool,
    /// About which the frame turns, mm.
    centre: DVec3,
}

/// Sums of filters that the search begins with, s.
const SUMS: [f64; 8] = [0.03, 0.06, 0.1, 0.15, 0.22, 0.32, 0.48, 0.7];
/// Steps at the most.
const STEPS: usize = 60;

/// Fits the model to the samples of a log for which `used` answers.
///
/// # Errors
/// [`IdentificationError`].
pub fn identify(
    log: &Log,
    path: &DrivenPath,
    aligned: &Aligned,
    freedom: Freedom,
    used: &dyn Fn(usize) -> bool,
    observer: &dyn Observer,
) -> Result<Fitted, IdentificationError> {
    let mut sum = DVec3::ZERO;
    let mut count = 0.0;
    for stretch in &path.stretches {
        for command in &stretch.commands {
            sum += command.target;
            count += 1.0;
        }
    }
    let problem = Problem {
        path,
        log,
        pieces: &aligned.pieces,
        freedom,
        used,
        centre: sum / f64::max(count, 1.0),
    };
    let mut state: Option<State> = None;
    for sum in SUMS {
        observer.check()?;
        let law = first(path, sum);
        let begins = path.stretches.iter().zip(&aligned.pieces);
        let begins = begins.map(|(s, p)| begin(s, p, &law)).collect();
        let mut start = State {
            law,
            begins,
            frame: aligned.frame,
            cost: f64::INFINITY,
        };
        start.cost = problem.cost(&start)?;
        // begins and frame first: what they leave tells how good the filters are
        for _ in 0..2 {
            let held = vec![false; 2 + path.smoothings.len()];
            start = problem.step(start, &held)?.0;
        }
        if state.as_ref().is_none_or(|s| start.cost < s.cost) {
            state = Some(start);
        }
    }
    let Some(mut state) = state else {
        let none = LeastSquaresError::Start;
        return Err(IdentificationError::Undetermined(none));
    };
    let mut steps = 0;
    let mut free = vec![true; 2 + path.smoothings.len()];
    while steps < STEPS {
        observer.check()?;
        steps += 1;
        let (next, bound) = problem.step(state.clone(), &free)?;
        let better = next.cost < state.cost * (1.0 - 1e-9);
        if better {
            state = next;
        }
        let held = free.iter().zip(&bound).any(|(free, bound)| *free && *bound);
        for (free, bound) in free.iter_mut().zip(&bound) {
            *free &= !bound;
        }
        if !better && !held {
            // what was held at a bound is let go once more
            if free.iter().all(|f| *f) || steps + 1 >= STEPS {
                break;
            }
            let (next, _) = problem.step(state.clone(), &vec![true; free.len()])?;
            if next.cost >= state.cost * (1.0 - 1e-9) {
                break;
            }
            state = next;
            free.fill(true);
        }
    }
    problem.finish(state, steps)
}

/// A law to begin with.
fn first(path: &DrivenPath, sum: f64) -> Law {
    let dwell = |smoothing: &f64| 0.8 * sum * (1.0 - smoothing.clamp(0.0, 1.0)).powi(2);
    Law {
        sum,
        spread: (0.3 * sum).powi(2),
        dwells: path.smoothings.iter().map(dwell).collect(),
    }
    .held()
}

/// When a stretch begins, by when the middle of its longest move is passed.
fn begin(stretch: &Stretch, piece: &Piece, law: &Law) -> f64 {
    let before = stretch.ends.iter().take(piece.longest);
    let dwells: f64 = before
        .map(|end| match *end {
            End::Corner {
                smoothing, share, ..
            } => share * law.dwells[smoothing],
            End::Through | End::Stop => 0.0,
        })
        .sum();
    piece.middle - piece.nominal - dwells - 0.5 * law.sum
}

impl Problem<'_> {
    /// What is left of a sample: where the model has the tool, less where the log has it.
    fn left(&self, trace: &Trace, state: &State, k: usize, sample: usize) -> DVec3 {
        let time = self.log.times[sample] - state.begins[k];
        trace.at(time) - state.frame.point(self.log.places[sample])
    }

    fn cost(&self, state: &State) -> Result<f64, IdentificationError> {
        let mut cost = 0.0;
        for (k, (stretch, piece)) in self.path.stretches.iter().zip(self.pieces).enumerate() {
            let trace = trace(stretch, &state.law)?;
            let samples = piece.samples.clone().filter(|i| (self.used)(*i));
            cost += samples
                .map(|i| self.left(&trace, state, k, i).length_squared())
                .sum::<f64>();
        }
        Ok(cost)
    }

    /// Regressions of each stretch, its begin first, and of all that they share; which of the law's values are free.
    fn system(
        &self,
        state: &State,
        free: &[bool],
    ) -> Result<(Vec<Matrix>, Regression), IdentificationError> {
        let values: Vec<usize> = (0..free.len()).filter(|v| free[*v]).collect();
        let rigid = match self.freedom {
            Freedom::Same => 0,
            Freedom::Rigid => 6,
        };
        let shared = values.len() + rigid;
        let mut all = Regression::new(shared);
        let mut triangles = Vec::with_capacity(self.pieces.len());
        for (k, (stretch, piece)) in self.path.stretches.iter().zip(self.pieces).enumerate() {
            let base = trace(stretch, &state.law)?;
            let mut slopes = Vec::with_capacity(values.len());
            for v in &values {
                let unused = |end: &End| !matches!(end, End::Corner { smoothing, .. } if *smoothing + 2 == *v);
                if *v >= 2 && stretch.ends.iter().all(unused) {
                    slopes.push(None);
                } else {
                    slopes.push(Some(moved(stretch, &state.law, *v)?));
                }
            }
            let mut own = Regression::new(1 + shared);
            for i in piece.samples.clone().filter(|i| (self.used)(*i)) {
                let time = self.log.times[i] - state.begins[k];
                let left = self.left(&base, state, k, i);
                let velocity = base.velocity(time);
                let arm = state.frame.point(self.log.places[i]) - self.centre;
                let by_law: Vec<DVec3> = slopes
                    .iter()
                    .map(|s| s.as_ref().map_or(DVec3::ZERO, |s| s.at(time)))
                    .collect();
                for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                    let law = by_law.iter().map(|d| d.dot(axis));
                    let turns = [DVec3::X, DVec3::Y, DVec3::Z].map(|e| -e.cross(arm).dot(axis));
                    let moves = [DVec3::X, DVec3::Y, DVec3::Z].map(|e| -e.dot(axis));
                    let frame = turns.into_iter().chain(moves).take(rigid);
                    let row = std::iter::once(-velocity.dot(axis)).chain(law).chain(frame);
                    own.push(row, -left.dot(axis));
                }
            }
            let triangle = own.triangle();
            for row in 1..triangle.rows() {
                let entries = (1..=shared).map(|c| triangle[(row, c)]);
                all.push(entries, triangle[(row, shared + 1)]);
            }
            triangles.push(triangle);
        }
        Ok((triangles, all))
    }

    /// A step that leaves less, and which values it would carry beyond their bounds.
    fn step(&self, state: State, free: &[bool]) -> Result<(State, Vec<bool>), IdentificationError> {
        let (triangles, all) = self.system(&state, free)?;
        let solution = all.solve().map_err(IdentificationError::Undetermined)?;
        let mut share = 1.0;
        let mut bound = vec![false; free.len()];
        for _ in 0..12 {
            let (next, beyond) = self.stepped(&state, &triangles, &solution.values, free, share);
            if share >= 1.0 {
                bound = beyond;
            }
            let cost = self.cost(&next)?;
            if cost < state.cost {
                return Ok((State { cost, ..next }, bound));
            }
            share *= 0.4;
        }
        Ok((state, bound))
    }

    /// The state a share of a step on.
    fn stepped(
        &self,
        state: &State,
        triangles: &[Matrix],
        values: &[f64],
        free: &[bool],
        share: f64,
    ) -> (State, Vec<bool>) {
        let mut next = state.clone();
        let mut used = 0;
        for (v, _) in free.iter().enumerate().filter(|(_, free)| **free) {
            let change = share * values[used];
            used += 1;
            match v {
                0 => next.law.sum += change.clamp(-0.3 * state.law.sum, 0.5 * state.law.sum),
                1 => next.law.spread += change,
                n => next.law.dwells[n - 2] += change,
            }
        }
        let asked = next.law.clone();
        next.law = next.law.held();
        let beyond = (0..free.len())
            .map(|v| {
                free[v]
                    && match v {
                        0 => asked.sum != next.law.sum,
                        1 => asked.spread != next.law.spread,
                        n => asked.dwells[n - 2] != next.law.dwells[n - 2],
                    }
            })
            .collect();
        for (begin, triangle) in next.begins.iter_mut().zip(triangles) {
            let pivot = triangle[(0, 0)];
            if pivot.abs() > 0.0 {
                let rest: f64 = values
                    .iter()
                    .enumerate()
                    .map(|(c, v)| triangle[(0, c + 1)] * v)
                    .sum();
                *begin += share * (triangle[(0, values.len() + 1)] - rest) / pivot;
            }
        }
        if let Some(&[a, b, c, x, y, z]) = values.get(used..used + 6).and_then(|v| v.first_chunk())
        {
            let turn = DQuat::from_scaled_axis(share * DVec3::new(a, b, c));
            let about = Pose {
                position: self.centre - turn * self.centre + share * DVec3::new(x, y, z),
                orientation: turn,
            };
            next.frame = about.then(state.frame);
        }
        (next, beyond)
    }

    /// How sure everything is.
    fn finish(&self, state: State, steps: usize) -> Result<Fitted, IdentificationError> {
        let free = vec![true; 2 + state.law.dwells.len()];
        let (triangles, all) = self.system(&state, &free)?;
        let solution = all.solve().map_err(IdentificationError::Undetermined)?;
        let mut samples = 0_usize;
        let (mut square, mut alike) = (
            0.0,
            Alike {
                products: [0.0; 40],
                square: 0.0,
            },
        );
        for (k, (stretch, piece)) in self.path.stretches.iter().zip(self.pieces).enumerate() {
            let trace = trace(stretch, &state.law)?;
            let mut row = Vec::new();
            for i in piece.samples.clone().filter(|i| (self.used)(*i)) {
                let left = self.left(&trace, &state, k, i);
                square += left.length_squared();
                samples += 1;
                row.push(left);
            }
            alike.add(&row);
        }
        let unknowns = solution.values.len() + triangles.len();
        let freedom = (3 * samples).saturating_sub(unknowns).max(1);
        let variance = square / freedom as f64;
        let alike = alike.factor();
        let spread = |i: usize, j: usize| solution.spread[(i, j)] * variance * alike;
        Ok(Fitted {
            sigma: (0..free.len()).map(|i| spread(i, i).sqrt()).collect(),
            shared: spread(0, 1),
            law: state.law,
            begins: state.begins,
            frame: state.frame,
            rms: variance.sqrt(),
            alike,
            samples,
            steps,
        })
    }
}

/// Traces with one value of the law moved, and by how much: up and, where it may fall, down.
fn moved(stretch: &Stretch, law: &Law, which: usize) -> Result<Slope, MotionError> {
    let step = match which {
        0 => 2.0 * STEP,
        1 => 0.02 * law.sum * law.sum,
        _ => STEP,
    };
    let value = |law: &Law| match which {
        0 => law.sum,
        1 => law.spread,
        n => law.dwells[n - 2],
    };
    let by = |change: f64| {
        let mut moved = law.clone();
        match which {
            0 => moved.sum += change,
            1 => moved.spread += change,
            n => moved.dwells[n - 2] += change,
        }
        moved.held()
    };
    let (up, down) = (by(step), by(-step));
    let width = value(&up) - value(&down);
    Ok(Slope {
        up: trace(stretch, &up)?,
        down: trace(stretch, &down)?,
        width: width.max(1e-12),
    })
}

/// How a trace changes with a value.
struct Slope {
    up: Trace,
    down: Trace,
    width: f64,
}

impl Slope {
    fn at(&self, time: f64) -> DVec3 {
        (self.up.at(time) - self.down.at(time)) / self.width
    }
}

/// How alike what is left of neighbouring samples is.
struct Alike {
    products: [f64; 40],
    square: f64,
}

impl Alike {
    fn add(&mut self, left: &[DVec3]) {
        self.square += left.iter().map(|v| v.length_squared()).sum::<f64>();
        for (lag, product) in self.products.iter_mut().enumerate() {
            let pairs = left.iter().zip(left.iter().skip(lag + 1));
            *product += pairs.map(|(a, b)| a.dot(*b)).sum::<f64>();
        }
    }

    /// One and twice the correlations, as far as they stand out.
    fn factor(&self) -> f64 {
        const STANDS_OUT: f64 = 0.05;
        let shares = self.products.iter().map(|p| p / self.square.max(1e-300));
        1.0 + 2.0 * shares.take_while(|s| *s > STANDS_OUT).sum::<f64>()
    }
}
