//! Heat laid down along a path, remembered in ever coarser pieces as it spreads, so that the cost of a temperature does
//! not grow with the length of the path.
//!
//! Young heat is kept in quanta. Heat of age `A·2^ℓ` has spread to `s = √(σ² + 2 α A 2^ℓ)`: quanta that were laid down
//! within an eighth of that age and within a cell of `0.8 s` become one Gaussian with their sum, centre, variances and mean
//! time. What is lost are covariance and higher moments; `Lump::doubt` bounds their leading terms.

use std::collections::VecDeque;

/// Quanta per age: a piece spans an eighth of its age.
pub(crate) const PER_AGE: f64 = 8.0;
/// Cell size in spreads.
const CELL: f64 = 0.8;

/// A Gaussian deposit of heat on the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Lump {
    /// Heat, J.
    pub(crate) heat: f64,
    /// Mean time, s.
    pub(crate) time: f64,
    /// Centre, mm.
    pub(crate) centre: [f64; 2],
    /// Variances when laid down, mm².
    pub(crate) variance: [f64; 2],
    /// Variances of what was merged into it, a part of `variance`, mm²; and of its time, s².
    merged: [f64; 2],
    merged_time: f64,
    covariance: f64,
}

impl Lump {
    pub(crate) fn new(heat: f64, time: f64, centre: [f64; 2], variance: f64) -> Self {
        Lump {
            heat,
            time,
            centre,
            variance: [variance; 2],
            ..Lump::default()
        }
    }

    /// The two together: heat, centre, mean time and variances are kept.
    pub(crate) fn with(&self, other: &Lump) -> Lump {
        let heat = self.heat + other.heat;
        if heat == 0.0 {
            return *self;
        }
        let (a, b) = (self.heat / heat, other.heat / heat);
        let ab = a * b;
        let apart = [
            other.centre[0] - self.centre[0],
            other.centre[1] - self.centre[1],
        ];
        let between = apart.map(|d| ab * d * d);
        let mean = |x: f64, y: f64| a * x + b * y;
        let both = |x: [f64; 2], y: [f64; 2]| {
            [mean(x[0], y[0]) + between[0], mean(x[1], y[1]) + between[1]]
        };
        Lump {
            heat,
            time: mean(self.time, other.time),
            centre: [
                mean(self.centre[0], other.centre[0]),
                mean(self.centre[1], other.centre[1]),
            ],
            variance: both(self.variance, other.variance),
            merged: both(self.merged, other.merged),
            merged_time: mean(self.merged_time, other.merged_time)
                + ab * (other.time - self.time).powi(2),
            covariance: mean(self.covariance, other.covariance) + ab * apart[0] * apart[1],
        }
    }

    /// Bound on the share of this lump's largest contribution that its neglected moments may make up at age `age`, with
    /// `spread = 2 α age`: covariance, third and fourth moments in the plane (within a cell), second in time, each where
    /// it is largest.
    pub(crate) fn doubt(&self, age: f64, spread: f64, cell: f64) -> f64 {
        let s = [0, 1].map(|a| (self.variance[a] + spread).sqrt());
        let half = 0.5 * cell;
        let mut share = self.covariance.abs() / (s[0] * s[1]) * (-1.0_f64).exp();
        for (axis, s) in s.into_iter().enumerate() {
            let merged = self.merged[axis];
            // sup |H₃ φ|/φ(0) = 1.38, sup |H₄ φ|/φ(0) = 3; a cell of half width w has |μ₃| ≤ w μ₂, μ₄ ≤ w² μ₂
            share += 1.38 / 6.0 * half * merged / s.powi(3)
                + 3.0 / 24.0 * half * half * merged / s.powi(4);
        }
        share + 15.0 / 8.0 * self.merged_time / (age * age)
    }
}

/// How a history is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Memory {
    /// Old heat in coarser pieces: flat cost.
    #[default]
    Folded,
    /// Every quantum for ever: the cost grows with the path; the yardstick for the other.
    Full,
}

#[derive(Debug, Clone, Default)]
struct Level {
    lumps: VecDeque<Lump>,
    /// Pieces of the span that is being filled.
    open: Vec<([i64; 2], Lump)>,
    span: i64,
}

/// The heat laid down so far.
#[derive(Debug, Clone)]
pub(crate) struct History {
    memory: Memory,
    /// Age at which heat enters, s.
    pub(crate) youngest: f64,
    diffusivity: f64,
    variance: f64,
    levels: Vec<Level>,
}

impl History {
    /// An empty history of quanta that are at least `youngest` seconds old, under a beam of `variance` mm².
    pub(crate) fn new(memory: Memory, youngest: f64, diffusivity: f64, variance: f64) -> Self {
        History {
            memory,
            youngest,
            diffusivity,
            variance,
            levels: vec![Level::default()],
        }
    }

    fn age(&self, level: usize) -> f64 {
        self.youngest * (level as f64).exp2()
    }

    /// Size of the cells of a level, mm; 0 for the quanta themselves.
    fn cell(&self, level: usize) -> f64 {
        if level == 0 {
            return 0.0;
        }
        CELL * (self.variance + 2.0 * self.diffusivity * self.age(level)).sqrt()
    }

    /// Adds the next quantum; quanta come in the order of their times.
    pub(crate) fn push(&mut self, quantum: Lump) {
        self.levels[0].lumps.push_back(quantum);
    }

    /// Folds what has become old enough at time `now`.
    pub(crate) fn fold(&mut self, now: f64) {
        if self.memory == Memory::Full {
            return;
        }
        let mut level = 0;
        while level < self.levels.len() {
            let oldest = self.age(level + 1);
            let duration = oldest / PER_AGE;
            let cell = self.cell(level + 1);
            while self.levels[level]
                .lumps
                .front()
                .is_some_and(|l| now - l.time > oldest)
            {
                let Some(lump) = self.levels[level].lumps.pop_front() else {
                    break;
                };
                if self.levels.len() == level + 1 {
                    self.levels.push(Level::default());
                }
                let next = &mut self.levels[level + 1];
                let span = (lump.time / duration).floor() as i64;
                if span != next.span {
                    next.close();
                    next.span = span;
                }
                let place = lump.centre.map(|c| (c / cell).floor() as i64);
                match next.open.iter_mut().find(|(p, _)| *p == place) {
                    Some((_, sum)) => *sum = sum.with(&lump),
                    None => next.open.push((place, lump)),
                }
            }
            level += 1;
        }
    }

    /// Calls `see` with every lump and the cell size it was merged in.
    pub(crate) fn each(&self, mut see: impl FnMut(&Lump, f64)) {
        for (n, level) in self.levels.iter().enumerate() {
            let cell = self.cell(n);
            level.lumps.iter().for_each(|l| see(l, cell));
            level.open.iter().for_each(|(_, l)| see(l, cell));
        }
    }

    /// Number of lumps kept.
    pub(crate) fn len(&self) -> usize {
        self.levels
            .iter()
            .map(|l| l.lumps.len() + l.open.len())
            .sum()
    }
}

impl Level {
    fn close(&mut self) {
        // in the order of their times, so that the oldest leaves first
        self.open.sort_by(|a, b| a.1.time.total_cmp(&b.1.time));
        self.lumps.extend(self.open.drain(..).map(|(_, l)| l));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Two lumps in one cell made one: what their moments leave out is bounded by the doubt, and a lump alone leaves out nothing.
    #[test]
    fn what_merged_lumps_leave_out_is_doubted() {
        let (cell, spread, age) = (0.1, 0.02, 0.01);
        let at = |centre: [f64; 2]| Lump::new(1.0, 0.0, centre, 0.01);
        assert_eq!(at([0.02, 0.03]).doubt(age, spread, cell), 0.0);
        let lumps = [at([0.0, 0.0]), at([0.07, 0.05])];
        let both = lumps[0].with(&lumps[1]);
        let warms = |l: &Lump, place: [f64; 2]| {
            let each = [0, 1].map(|a| {
                let variance = l.variance[a] + spread;
                (-(place[a] - l.centre[a]).powi(2) / (2.0 * variance)).exp() / variance.sqrt()
            });
            l.heat * each[0] * each[1]
        };
        let grid =
            (-20..40).flat_map(|i| (-20..40).map(move |j| [i, j].map(|n| 0.01 * f64::from(n))));
        let wrong = grid
            .map(|p| (warms(&lumps[0], p) + warms(&lumps[1], p) - warms(&both, p)).abs())
            .fold(0.0, f64::max)
            / warms(&both, both.centre);
        let doubt = both.doubt(age, spread, cell);
        assert!((0.3..1.0).contains(&(wrong / doubt)), "{wrong} {doubt}");
    }

    proptest! {
        #[test]
        fn folding_keeps_heat_centre_and_spread(steps in prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64, 0.0..1.0_f64), 10..400)) {
            let make = |memory| {
                let mut history = History::new(memory, 8e-4, 8.0, 0.01);
                let (mut x, mut y) = (0.0, 0.0);
                for (n, (dx, dy, heat)) in steps.iter().enumerate() {
                    (x, y) = (x + 0.1 * dx, y + 0.1 * dy);
                    history.push(Lump::new(*heat, n as f64 * 1e-4, [x, y], 0.01));
                    history.fold(n as f64 * 1e-4 + 8e-4);
                }
                let mut sums = [0.0; 6];
                history.each(|l, _| {
                    let moments = [1.0, l.time, l.centre[0], l.centre[1],
                        l.centre[0].powi(2) + l.variance[0], l.centre[1].powi(2) + l.variance[1]];
                    sums.iter_mut().zip(moments).for_each(|(s, m)| *s += l.heat * m);
                });
                sums
            };
            for (a, b) in make(Memory::Folded).iter().zip(make(Memory::Full)) {
                prop_assert!((a - b).abs() < 1e-9 * (1.0 + b.abs()));
            }
        }
    }
}
