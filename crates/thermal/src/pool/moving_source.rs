//! The semi-analytic engine: temperature under a beam that moves along any path on a body with constant properties, at a
//! cost that does not grow with the path.
//!
//! Theory: superposition of spreading Gaussians (Carslaw and Jaeger 1959, chapter X; Eagar and Tsai 1983 for the moving
//! Gaussian). The last moments of the path are integrated by Gauss-Legendre in the root of the age, older heat comes
//! from [`crate::pool::history`]. No phase change: choose effective properties, or use the reference solver.

use meltpath_geometry::math::DVec3;

use crate::beam::{Beam, BeamPath};
use crate::material::medium::{Medium, MediumError};
use crate::pool::MeltPool;
use crate::pool::history::{History, Lump, Memory, PER_AGE};
use crate::pool::sheet::{Node, Sheet, Smooth, Sums};
use crate::solver::source::Depth;
use meltpath_numerics::vector::Level;

/// Why the engine refused.
#[derive(Debug, thiserror::Error)]
pub enum MovingSourceError {
    /// The medium.
    #[error(transparent)]
    Medium(#[from] MediumError),
    /// The path runs backwards.
    #[error("the engine is at {now} s and cannot go back to {asked} s: make a new one")]
    Backwards {
        /// Where it is, s.
        now: f64,
        /// Where it should go, s.
        asked: f64,
    },
    /// The pool grows without end.
    #[error(
        "at {time:.6} s the pool is larger than {size:.1} mm: the body is molten throughout; check power and properties"
    )]
    Endless {
        /// When, s.
        time: f64,
        /// Size reached, mm.
        size: f64,
    },
}

/// The engine: a path, a beam, a medium, and the heat laid down so far.
#[derive(Debug, Clone)]
pub struct MovingSource {
    medium: Medium,
    path: BeamPath,
    beam: Beam,
    history: History,
    quantum: f64,
    /// Quanta fed to the history.
    fed: u64,
    now: f64,
    /// Nodes of the last moments at `now`.
    near: Vec<Node>,
    box_guess: [f64; 4],
    level: Level,
}

/// A melt pool measured by the engine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Its size.
    pub pool: MeltPool,
    /// Lumps of history that were summed.
    pub lumps: usize,
}

/// Nodes and weights of 8-point Gauss-Legendre on (−1, 1), positive half.
const GAUSS: [[f64; 2]; 4] = [
    [0.183_434_642_495_649_8, 0.362_683_783_378_362],
    [0.525_532_409_916_329, 0.313_706_645_877_887_3],
    [0.796_666_477_413_626_7, 0.222_381_034_453_374_5],
    [0.960_289_856_497_536_3, 0.101_228_536_290_376_3],
];

/// Variance of the half Gaussian with the mean depth of a law, mm².
pub(crate) fn depth_variance(depth: Depth) -> f64 {
    let mean = match depth {
        Depth::Surface => 0.0,
        Depth::Falling { penetration } => penetration / 3.0,
        Depth::Even { depth } => 0.5 * depth,
    };
    mean * mean * std::f64::consts::FRAC_PI_2
}

impl MovingSource {
    /// An engine at the beginning of `path`.
    ///
    /// # Errors
    /// [`MovingSourceError`].
    pub fn new(
        medium: Medium,
        path: BeamPath,
        beam: Beam,
        memory: Memory,
    ) -> Result<Self, MovingSourceError> {
        medium.check()?;
        let mut diameter = f64::INFINITY;
        let mut speed = 0.0_f64;
        for pair in path.points().windows(2).filter(|w| w[0].is_on()) {
            diameter = diameter.min(pair[0].spot);
            let dt = pair[1].time - pair[0].time;
            if dt > 0.0 {
                speed = speed.max((pair[1].x - pair[0].x).hypot(pair[1].y - pair[0].y) / dt);
            }
        }
        if !diameter.is_finite() {
            diameter = 1.0;
        }
        let sigma = diameter / 4.0;
        // a quantum is short beside the beam, and an eighth of the age at which it is first used is long beside spreading
        let spreading = sigma * sigma / (2.0 * medium.diffusivity) / PER_AGE;
        let quantum = if speed > 0.0 {
            spreading.min(0.7 * sigma / speed)
        } else {
            spreading
        };
        Ok(MovingSource {
            history: History::new(memory, PER_AGE * quantum, medium.diffusivity, sigma * sigma),
            now: path.begin(),
            medium,
            path,
            beam,
            quantum,
            fed: 0,
            near: Vec::new(),
            box_guess: [4.0 * sigma; 4],
            level: Level::widest(),
        })
    }

    /// Time, s.
    pub fn now(&self) -> f64 {
        self.now
    }

    /// Lumps of history kept.
    pub fn lumps(&self) -> usize {
        self.history.len()
    }

    fn depth_variance(&self) -> f64 {
        depth_variance(self.beam.depth)
    }

    /// Goes on to `time`, s.
    ///
    /// # Errors
    /// [`MovingSourceError::Backwards`].
    pub fn advance(&mut self, time: f64) -> Result<(), MovingSourceError> {
        if time < self.now {
            return Err(MovingSourceError::Backwards {
                now: self.now,
                asked: time,
            });
        }
        let begin = self.path.begin();
        let age = self.history.youngest;
        loop {
            let from = begin + self.fed as f64 * self.quantum;
            let to = from + self.quantum;
            if to > time - age || from >= self.path.end() {
                break;
            }
            for (a, b) in self.pieces(from, to) {
                let middle = 0.5 * (a + b);
                let spot = self.beam.spot(&self.path.at(middle));
                if spot.power > 0.0 {
                    let sigma = spot.diameter / 4.0;
                    self.history.push(Lump::new(
                        spot.power * (b - a),
                        middle,
                        spot.centre,
                        sigma * sigma,
                    ));
                }
            }
            self.fed += 1;
            if self.fed.is_multiple_of(8) {
                self.history.fold(to + age);
            }
        }
        self.now = time;
        self.history.fold(time);
        self.near = self.last_moments();
        Ok(())
    }

    /// The interval cut at the points of the path.
    fn pieces(&self, from: f64, to: f64) -> Vec<(f64, f64)> {
        let points = self.path.points();
        let first = points.partition_point(|p| p.time <= from);
        let mut cuts = vec![from];
        cuts.extend(
            points[first..]
                .iter()
                .map(|p| p.time)
                .take_while(|t| *t < to),
        );
        cuts.push(to);
        cuts.windows(2)
            .map(|w| (w[0], w[1]))
            .filter(|(a, b)| b > a)
            .collect()
    }

    fn last_moments(&self) -> Vec<Node> {
        let from = (self.path.begin() + self.fed as f64 * self.quantum).min(self.now);
        let depth = self.depth_variance();
        let whole = (self.now - from).sqrt();
        let mut nodes = Vec::with_capacity(64);
        for (a, b) in self.pieces(from, self.now) {
            let (u0, u1) = ((self.now - b).max(0.0).sqrt(), (self.now - a).sqrt());
            let panels = (4.0 * (u1 - u0) / whole).ceil().max(1.0);
            let half = 0.5 * (u1 - u0) / panels;
            for panel in 0..panels as usize {
                let middle = u0 + half * (2 * panel + 1) as f64;
                for [x, w] in GAUSS {
                    for x in [-x, x] {
                        let u = middle + half * x;
                        let age = u * u;
                        let spot = self.beam.spot(&self.path.at(self.now - age));
                        let spread = 2.0 * self.medium.diffusivity * age;
                        let variance = (spot.diameter / 4.0).powi(2) + spread;
                        nodes.push(Node {
                            weight: spot.power * w * half * 2.0 * u / self.medium.heat_capacity(),
                            centre: spot.centre,
                            variance: [variance; 2],
                            depth_variance: depth + spread,
                        });
                    }
                }
            }
        }
        nodes
    }

    fn node(&self, lump: &Lump, depth_variance: f64) -> Node {
        let spread = 2.0 * self.medium.diffusivity * (self.now - lump.time);
        Node {
            weight: lump.heat / self.medium.heat_capacity(),
            centre: lump.centre,
            variance: lump.variance.map(|v| v + spread),
            depth_variance: depth_variance + spread,
        }
    }

    /// Temperature at a point at or below the build plane (`z ≤ 0`), K.
    pub fn temperature(&self, point: DVec3) -> f64 {
        let at = |n: &Node| {
            let (dx, dy) = (point.x - n.centre[0], point.y - n.centre[1]);
            let flat = (-0.5 * (dx * dx / n.variance[0] + dy * dy / n.variance[1])).exp()
                / (2.0 * std::f64::consts::PI * (n.variance[0] * n.variance[1]).sqrt());
            n.weight * flat * self.medium.along_depth(-point.z, n.depth_variance)
        };
        let mut rise: f64 = self.near.iter().map(at).sum();
        let depth = self.depth_variance();
        self.history.each(|l, _| rise += at(&self.node(l, depth)));
        self.medium.ambient + rise
    }

    /// Bound on the error of temperatures from folded history, K: leading neglected moments, each where it is largest.
    pub fn doubt(&self) -> f64 {
        let depth = self.depth_variance();
        let mut sum = 0.0;
        self.history.each(|l, cell| {
            if cell > 0.0 {
                let n = self.node(l, depth);
                let age = self.now - l.time;
                let largest = n.weight * self.medium.along_depth(0.0, n.depth_variance)
                    / (2.0 * std::f64::consts::PI * (n.variance[0] * n.variance[1]).sqrt());
                sum += largest * l.doubt(age, 2.0 * self.medium.diffusivity * age, cell);
            }
        });
        sum
    }

    /// Size of the pool above `liquidus` K round the beam, along and across the direction of travel; the region measured
    /// grows until its border is solid.
    ///
    /// # Errors
    /// [`MovingSourceError::Endless`].
    pub fn measure(&mut self, liquidus: f64) -> Result<Measured, MovingSourceError> {
        let here = self.path.at(self.now.min(self.path.end()));
        let before = self
            .path
            .at((self.now - self.quantum).max(self.path.begin()));
        let travel = [here.x - before.x, here.y - before.y];
        let norm = travel[0].hypot(travel[1]);
        let [ux, uy] = if norm > 0.0 {
            travel.map(|c| c / norm)
        } else {
            [1.0, 0.0]
        };
        let mut tight = false;
        loop {
            let sheet = Sheet::new([here.x, here.y], [ux, uy], self.box_guess);
            let sums = self.sums(&sheet);
            let (pool, reach, touched) = sheet.measure(&sums, self.medium.ambient, liquidus);
            if touched.contains(&true) {
                for (size, _) in self.box_guess.iter_mut().zip(touched).filter(|(_, t)| *t) {
                    *size *= 1.6;
                }
                let size = self.box_guess.into_iter().fold(0.0, f64::max);
                if size > 1e3 {
                    return Err(MovingSourceError::Endless {
                        time: self.now,
                        size,
                    });
                }
                continue;
            }
            if pool.cells > 0 {
                // the resolution follows the pool: the box is little larger than it
                let mut loose = false;
                for (size, reach) in self.box_guess.iter_mut().zip(reach) {
                    let wanted = 1.25 * reach.max(0.02 * pool.length.max(pool.width));
                    loose |= *size > 1.4 * wanted;
                    *size = wanted;
                }
                if loose && !tight {
                    tight = true;
                    continue;
                }
            }
            return Ok(Measured {
                pool,
                lumps: self.history.len(),
            });
        }
    }

    /// The region in which the last measured pool lay, round `centre` and along `direction` (of length 1), with its
    /// horizontal plane at `depth` mm below the build plane, and the rises of temperature there.
    pub(crate) fn plane(&self, centre: [f64; 2], direction: [f64; 2], depth: f64) -> (Sheet, Sums) {
        let sheet = Sheet::new(centre, direction, self.box_guess).at_depth(depth);
        let sums = self.sums(&sheet);
        (sheet, sums)
    }

    /// The path.
    pub fn path(&self) -> &BeamPath {
        &self.path
    }

    /// The body's properties.
    pub fn medium(&self) -> &Medium {
        &self.medium
    }

    /// Rises of temperature on the nodes of the sheet's two planes: the horizontal one and the one below the path.
    fn sums(&self, sheet: &Sheet) -> Sums {
        let depth = self.depth_variance();
        let mut smooth = Smooth::new(sheet);
        let mut wide = Vec::new();
        let mut narrow = self.near.clone();
        self.history.each(|l, _| {
            let node = self.node(l, depth);
            if smooth.can_take(&node) {
                wide.push(node);
            } else {
                narrow.push(node);
            }
        });
        let mut sums = Sums::new();
        sums.superpose(sheet, &narrow, &self.medium, self.level);
        smooth.superpose(&wide, &self.medium, self.level);
        smooth.spread_over(sheet, &mut sums);
        sums
    }
}
