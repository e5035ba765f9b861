//! Particle swarm optimisation, classic and perturbed, for costs without a gradient.
//!
//! Rasoanarivo 2020, annex B (B.1–B.4); the perturbed rule, in which the best particle searches a box whose size follows its
//! success, is the guaranteed-convergence rule of F. van den Bergh, A. Engelbrecht (2002).

use meltpath_base::Observer;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::random::Random;

/// One unknown: its bounds and how it is explored.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// How steps are measured.
    pub scale: Scale,
}

/// How steps of an unknown are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// By difference.
    Linear,
    /// By ratio: gains and time constants.
    Logarithmic,
}

impl Range {
    /// Between two bounds, by difference.
    pub fn linear(low: f64, high: f64) -> Self {
        Range {
            low,
            high,
            scale: Scale::Linear,
        }
    }

    /// Between two positive bounds, by ratio.
    pub fn logarithmic(low: f64, high: f64) -> Self {
        Range {
            low,
            high,
            scale: Scale::Logarithmic,
        }
    }

    fn value(&self, share: f64) -> f64 {
        match self.scale {
            Scale::Linear => self.low + (self.high - self.low) * share,
            Scale::Logarithmic => self.low * (self.high / self.low).powf(share),
        }
    }

    /// Where a value lies between the bounds, 0 at the lower and 1 at the upper one, as the unknown is explored.
    ///
    /// ```
    /// use meltpath_numerics::swarm::Range;
    /// assert!((Range::logarithmic(1.0, 100.0).share(10.0) - 0.5).abs() < 1e-12);
    /// ```
    pub fn share(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        }
    }

    fn sound(&self) -> bool {
        let ordered = self.low.is_finite() && self.high.is_finite() && self.low < self.high;
        ordered && (self.scale == Scale::Linear || self.low > 0.0)
    }
}

/// Who tells a particle where the best place is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Neighbourhood {
    /// All particles.
    Global,
    /// The particle itself and `reach` on each side in a ring.
    Ring {
        /// Particles on each side.
        reach: usize,
    },
}

/// How the best particle moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Rule {
    /// As all others.
    Classic,
    /// Round the best place, in a box that grows with success and shrinks with failure.
    Perturbed(Radius),
}

/// The size of the best particle's box, as a share of each range, and its history of success.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Radius {
    /// Half the side of the box.
    pub value: f64,
    /// The box doubles while more than this many improvements came in a row.
    pub successes: u32,
    /// The box halves while more than this many failures came in a row.
    pub failures: u32,
    #[serde(skip)]
    run: i64,
}

impl Radius {
    /// Starts at `value`; the thesis doubles after more than 15 improvements and halves after more than 5 failures.
    pub fn new(value: f64) -> Self {
        Radius {
            value,
            successes: 15,
            failures: 5,
            run: 0,
        }
    }

    /// Takes note of one iteration (B.4): a success ends a run of failures and the other way round.
    ///
    /// ```
    /// use meltpath_numerics::swarm::Radius;
    /// let mut r = Radius::new(0.1);
    /// for _ in 0..16 { r.note(true); }
    /// assert_eq!(r.value, 0.2);
    /// ```
    pub fn note(&mut self, improved: bool) {
        self.run = match (improved, self.run >= 0) {
            (true, true) => self.run + 1,
            (true, false) => 1,
            (false, false) => self.run - 1,
            (false, true) => -1,
        };
        if self.run > i64::from(self.successes) {
            self.value *= 2.0;
        } else if -self.run > i64::from(self.failures) {
            self.value *= 0.5;
        }
    }
}

/// A swarm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Swarm {
    /// Number of particles.
    pub particles: usize,
    /// Number of moves of each.
    pub iterations: usize,
    /// Share of the velocity kept.
    pub inertia: f64,
    /// Largest pull towards the particle's own best place.
    pub own: f64,
    /// Largest pull towards the neighbourhood's best place.
    pub others: f64,
    /// Who counts as neighbour.
    pub neighbourhood: Neighbourhood,
    /// How the best particle moves.
    pub rule: Rule,
    /// Seed of the random stream.
    pub seed: u64,
}

impl Default for Swarm {
    /// 30 particles, 300 iterations, constriction coefficients of Clerc and Kennedy, perturbed rule.
    fn default() -> Self {
        Swarm {
            particles: 30,
            iterations: 300,
            inertia: 0.7298,
            own: 1.4962,
            others: 1.4962,
            neighbourhood: Neighbourhood::Global,
            rule: Rule::Perturbed(Radius::new(0.1)),
            seed: 1,
        }
    }
}

/// The best place found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Optimum {
    /// The unknowns.
    pub values: Vec<f64>,
    /// Their cost.
    pub cost: f64,
    /// The best cost after each iteration, the start first.
    pub history: Vec<f64>,
    /// Costs computed.
    pub evaluations: usize,
}

/// Why a swarm does not start or stops.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SwarmError {
    /// A range is empty or, in logarithm, not positive.
    #[error(
        "the range of unknown {index} (counted from 0), {low} to {high}, is empty or not positive where its logarithm is taken"
    )]
    Range {
        /// Which unknown.
        index: usize,
        /// Its lower bound.
        low: f64,
        /// Its upper bound.
        high: f64,
    },
    /// Too few particles, or no unknown.
    #[error(
        "a swarm of {particles} particles cannot search {unknowns} unknowns: at least 2 particles and 1 unknown are needed"
    )]
    Empty {
        /// Number of particles.
        particles: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The starting point has the wrong length.
    #[error("the starting point has {given} values for {unknowns} unknowns")]
    Start {
        /// Values given.
        given: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// No place with a finite cost was met.
    #[error("the cost was infinite or not a number everywhere it was computed")]
    NoFiniteCost,
    /// Stopped by the person who started it.
    #[error(transparent)]
    Cancelled(#[from] meltpath_base::Cancelled),
}

struct Particle {
    place: Vec<f64>,
    velocity: Vec<f64>,
    best: Vec<f64>,
    best_cost: f64,
}

/// Searches the box of `ranges` for the lowest `cost`. One particle starts at `start` if given (clamped to the box). Costs
/// of one iteration are computed in parallel; the result does not depend on the number of threads. A cost that is not a
/// number counts as infinite.
///
/// # Errors
/// [`SwarmError`].
///
/// ```
/// use meltpath_base::Silent;
/// use meltpath_numerics::swarm::{minimise, Range, Swarm};
/// let valley = |x: &[f64]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
/// let found = minimise(valley, &[Range::linear(-2.0, 2.0); 2], None, &Swarm::default(), &Silent).unwrap();
/// assert!(found.cost < 1e-6);
/// ```
pub fn minimise(
    cost: impl Fn(&[f64]) -> f64 + Sync,
    ranges: &[Range],
    start: Option<&[f64]>,
    swarm: &Swarm,
    observer: &dyn Observer,
) -> Result<Optimum, SwarmError> {
    if swarm.particles < 2 || ranges.is_empty() {
        return Err(SwarmError::Empty {
            particles: swarm.particles,
            unknowns: ranges.len(),
        });
    }
    if let Some(index) = ranges.iter().position(|r| !r.sound()) {
        return Err(SwarmError::Range {
            index,
            low: ranges[index].low,
            high: ranges[index].high,
        });
    }
    if let Some(s) = start
        && s.len() != ranges.len()
    {
        return Err(SwarmError::Start {
            given: s.len(),
            unknowns: ranges.len(),
        });
    }
    let mut random = Random::new(swarm.seed);
    let mut flock = scatter(ranges, start, swarm.particles, &mut random);
    let values = |place: &[f64]| -> Vec<f64> {
        place.iter().zip(ranges).map(|(&s, r)| r.value(s)).collect()
    };
    let costs = |flock: &[Particle]| -> Vec<f64> {
        flock
            .par_iter()
            .map(|p| {
                let c = cost(&values(&p.place));
                if c.is_nan() { f64::INFINITY } else { c }
            })
            .collect()
    };
    observer.stage("swarm", swarm.iterations as u64);
    let first = costs(&flock);
    for (p, c) in flock.iter_mut().zip(first) {
        p.best_cost = c;
    }
    let mut rule = swarm.rule;
    let mut history = vec![flock[leader(&flock)].best_cost];
    for _ in 0..swarm.iterations {
        observer.check()?;
        let lead = leader(&flock);
        let targets: Vec<usize> = (0..flock.len())
            .map(|i| match swarm.neighbourhood {
                Neighbourhood::Global => lead,
                Neighbourhood::Ring { reach } => local_leader(&flock, i, reach),
            })
            .collect();
        let places: Vec<Vec<f64>> = flock.iter().map(|p| p.best.clone()).collect();
        for (i, p) in flock.iter_mut().enumerate() {
            for (d, &goal) in places[targets[i]].iter().enumerate() {
                let pull = match rule {
                    Rule::Perturbed(radius) if i == lead => {
                        goal - p.place[d] + radius.value * (1.0 - 2.0 * random.unit())
                    }
                    _ => {
                        let own = swarm.own * random.unit() * (p.best[d] - p.place[d]);
                        own + swarm.others * random.unit() * (goal - p.place[d])
                    }
                };
                let velocity = swarm.inertia * p.velocity[d] + pull;
                let wanted = p.place[d] + velocity;
                p.place[d] = wanted.clamp(0.0, 1.0);
                // a particle stopped by a wall does not keep pushing against it
                p.velocity[d] = if p.place[d] == wanted { velocity } else { 0.0 };
            }
        }
        let after = costs(&flock);
        for (p, c) in flock.iter_mut().zip(after) {
            if c < p.best_cost {
                p.best_cost = c;
                p.best.clone_from(&p.place);
            }
        }
        let best = flock[leader(&flock)].best_cost;
        if let Rule::Perturbed(radius) = &mut rule {
            radius.note(best < history[history.len() - 1]);
        }
        history.push(best);
        observer.advance(1);
    }
    // what was stopped in its last round
    observer.check()?;
    let best = &flock[leader(&flock)];
    if !best.best_cost.is_finite() {
        return Err(SwarmError::NoFiniteCost);
    }
    Ok(Optimum {
        values: values(&best.best),
        cost: best.best_cost,
        evaluations: swarm.particles * (swarm.iterations + 1),
        history,
    })
}

fn scatter(
    ranges: &[Range],
    start: Option<&[f64]>,
    particles: usize,
    random: &mut Random,
) -> Vec<Particle> {
    (0..particles)
        .map(|i| {
            let place: Vec<f64> = match start {
                Some(s) if i == 0 => ranges
                    .iter()
                    .zip(s)
                    .map(|(r, &v)| r.share(v).clamp(0.0, 1.0))
                    .collect(),
                _ => ranges.iter().map(|_| random.unit()).collect(),
            };
            let velocity = ranges.iter().map(|_| 0.5 * (random.unit() - 0.5)).collect();
            Particle {
                best: place.clone(),
                place,
                velocity,
                best_cost: f64::INFINITY,
            }
        })
        .collect()
}

fn leader(flock: &[Particle]) -> usize {
    (1..flock.len()).fold(0, |best, i| {
        if flock[i].best_cost < flock[best].best_cost {
            i
        } else {
            best
        }
    })
}

fn local_leader(flock: &[Particle], of: usize, reach: usize) -> usize {
    let n = flock.len();
    let reach = reach.min(n / 2);
    (0..=2 * reach)
        .map(|k| (of + n + k - reach) % n)
        .fold(of, |best, i| {
            if flock[i].best_cost < flock[best].best_cost {
                i
            } else {
                best
            }
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_base::Silent;

    fn sphere(x: &[f64]) -> f64 {
        x.iter().map(|v| (v - 0.3).powi(2)).sum()
    }

    /// The best within reach to either side, round the end of the flock; itself where none is better.
    #[test]
    fn neighbours_lead_round_the_end() {
        let costs = [3.0, 9.0, 8.0, 7.0, 6.0, 5.0, 4.0];
        let flock = costs.map(|best_cost| Particle {
            place: Vec::new(),
            velocity: Vec::new(),
            best: Vec::new(),
            best_cost,
        });
        let leaders = |reach: usize| -> Vec<usize> {
            (0..7).map(|of| local_leader(&flock, of, reach)).collect()
        };
        assert_eq!(leaders(0), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(leaders(1), [0, 0, 3, 4, 5, 6, 0]);
        assert_eq!(leaders(2), [0, 0, 0, 5, 6, 0, 0]);
        assert_eq!(leaders(9), [0; 7]);
    }

    #[test]
    fn lpbf_ac21_perturbed_swarm() {
        let mut r = Radius::new(0.1);
        for k in 1..=15 {
            r.note(true);
            assert_eq!(r.value, 0.1, "after {k}");
        }
        r.note(true);
        assert_eq!(r.value, 0.2);
        for _ in 0..5 {
            r.note(false);
        }
        assert_eq!(r.value, 0.2);
        r.note(false);
        assert_eq!(r.value, 0.1);
        r.note(true);
        for _ in 0..5 {
            r.note(false);
        }
        assert_eq!(r.value, 0.1, "a success ends the run of failures");
        let swarm = Swarm {
            iterations: 500,
            ..Swarm::default()
        };
        let found = minimise(
            sphere,
            &[Range::linear(-5.0, 5.0); 8],
            None,
            &swarm,
            &Silent,
        )
        .unwrap();
        assert!(found.cost < 1e-10, "{}", found.cost);
        assert!(found.history.windows(2).all(|w| w[1] <= w[0]));
    }

    #[test]
    fn a_share_of_a_range_is_where_the_value_lies() {
        let ranges = [Range::linear(2.0, 6.0), Range::logarithmic(2.0, 32.0)];
        for (range, quarter) in ranges.iter().zip([3.0, 4.0]) {
            assert!((range.share(quarter) - 0.25).abs() < 1e-15);
            assert!((range.value(0.25) - quarter).abs() < 1e-15);
            assert_eq!((range.value(0.0), range.value(1.0)), (2.0, range.high));
        }
    }

    #[test]
    fn same_result_on_any_thread_count() {
        let run = |threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
                .install(|| {
                    minimise(
                        sphere,
                        &[Range::linear(-5.0, 5.0); 4],
                        None,
                        &Swarm {
                            iterations: 40,
                            ..Swarm::default()
                        },
                        &Silent,
                    )
                    .unwrap()
                })
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn classic_rings_and_logarithms() {
        let swarm = Swarm {
            rule: Rule::Classic,
            neighbourhood: Neighbourhood::Ring { reach: 2 },
            ..Swarm::default()
        };
        let cost = |x: &[f64]| (x[0] / 1e-4).ln().powi(2) + (x[1] - 2.0).powi(2);
        let ranges = [Range::logarithmic(1e-7, 1.0), Range::linear(0.0, 3.0)];
        let found = minimise(cost, &ranges, Some(&[1.0, 1.0]), &swarm, &Silent).unwrap();
        assert!(
            (found.values[0] / 1e-4 - 1.0).abs() < 1e-3 && (found.values[1] - 2.0).abs() < 1e-3
        );
    }

    #[test]
    fn refusals() {
        let bad = minimise(
            sphere,
            &[Range::logarithmic(0.0, 1.0)],
            None,
            &Swarm::default(),
            &Silent,
        );
        assert!(matches!(bad, Err(SwarmError::Range { index: 0, .. })));
        let nan = minimise(
            |_| f64::NAN,
            &[Range::linear(0.0, 1.0)],
            None,
            &Swarm {
                iterations: 3,
                ..Swarm::default()
            },
            &Silent,
        );
        assert_eq!(nan, Err(SwarmError::NoFiniteCost));
    }
}
