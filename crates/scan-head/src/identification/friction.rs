//! Friction of an axis from ramps at constant speed.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.5 (eq. 2.22). How far it is off is ours: by the noise within each ramp, by what is left between
//! them (Student's distribution), and by what a law that bends with the speed would make of them.

use crate::identification::error::IdentificationError;
use meltpath_numerics::least_squares::{LeastSquaresError, Regression, Solution};
use meltpath_numerics::student::within;

/// A steady ramp: speed (rad/s) and mean current (A).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyRamp {
    /// Speed, signed, rad/s.
    pub speed: f64,
    /// Mean current while the speed is constant, A.
    pub current: f64,
    /// Standard deviation that the noise within the ramps leaves of this mean, A; nothing where it is not known.
    pub sigma: Option<f64>,
}

/// Torque at constant speed: Kc·ī = B ω + T_P + T_C sgn ω (eq. 2.22).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampFriction {
    /// B, N·m·s/rad, and its deviation; none is told (not a number) by fewer than three speeds in a direction.
    pub viscous: [f64; 2],
    /// T_P, N·m, the same in both directions, and its deviation.
    pub bias: [f64; 2],
    /// T_C, N·m, and its deviation.
    pub coulomb: [f64; 2],
    /// Standard deviation of the residual torques, N·m.
    pub rms: f64,
    /// The same with viscous friction alone, N·m: what the dry terms bring.
    pub rms_viscous_only: f64,
    /// What is left of the ramps over what the noise within them explains: about 1 where the law holds and nothing drifts from
    /// ramp to ramp. Nothing where that noise is not known.
    pub over_noise: Option<f64>,
    /// How many speeds there are forward and backward.
    pub speeds: [usize; 2],
}

/// Speeds in each direction from which on deviations are told: with two a bend of the law and a drift are not seen.
pub const SPEEDS: usize = 3;

/// Speeds are one that differ by less than this share.
const ALIKE: f64 = 0.05;

/// Half of the reach, in estimated deviations, that holds what two deviations of a normal distribution hold: by what few `freedom` tell.
/// Readers of a deviation take two for its range.
pub(crate) fn student(freedom: usize) -> f64 {
    const WITHIN_TWO: f64 = 0.954_499_736_103_641_6;
    0.5 * within(WITHIN_TWO, freedom)
}

/// Friction from ramps at many speeds in both directions.
///
/// # Errors
/// [`IdentificationError::Ramps`], [`IdentificationError::Fit`].
pub fn friction_of_ramps(
    ramps: &[SteadyRamp],
    torque_constant: f64,
) -> Result<RampFriction, IdentificationError> {
    let count = |way: fn(f64) -> bool| ramps.iter().filter(|r| way(r.speed)).count();
    let (forward, backward) = (count(|s| s > 0.0), count(|s| s < 0.0));
    if forward < 2 || backward < 2 {
        return Err(IdentificationError::Ramps { forward, backward });
    }
    let scales = Scales::of(ramps, torque_constant);
    let law = scales.fit(ramps, &[Term::Speed, Term::Constant, Term::Sign])?;
    let wet = scales.fit(ramps, &[Term::Speed])?;
    let curved = scales.fit(
        ramps,
        &[Term::Speed, Term::Constant, Term::Sign, Term::Square],
    );
    let over_noise = scales.noise.as_ref().map(|_| law.variance.sqrt());
    let freedom = ramps.len() - 3;
    let speeds = [1.0, -1.0].map(|way| distinct(ramps, way));
    let told = speeds.iter().all(|n| *n >= SPEEDS);
    let sigma = |i: usize| {
        // where the law bends as the ramps let it, its slope and its torque at rest are those of the bent one
        let bent = curved
            .as_ref()
            .map_or(0.0, |c| (c.values[i] - law.values[i]).abs());
        scales.sigma(&law, i, freedom).max(bent)
    };
    let both = |i: usize, unit: f64| {
        let sigma = if told { unit * sigma(i) } else { f64::NAN };
        [unit * law.values[i], sigma]
    };
    Ok(RampFriction {
        viscous: both(0, scales.most / scales.fastest),
        bias: both(1, scales.most),
        coulomb: both(2, scales.most),
        rms: scales.rms(ramps, &law),
        rms_viscous_only: scales.rms(ramps, &wet),
        over_noise,
        speeds,
    })
}

/// How many speeds there are in a direction.
fn distinct(ramps: &[SteadyRamp], way: f64) -> usize {
    let mut speeds: Vec<f64> = ramps.iter().map(|r| way * r.speed).collect();
    speeds.retain(|s| *s > 0.0);
    speeds.sort_by(f64::total_cmp);
    speeds.dedup_by(|a, b| *a - *b < ALIKE * *b);
    speeds.len()
}

/// A term of the torque at constant speed.
#[derive(Clone, Copy)]
enum Term {
    Speed,
    Constant,
    Sign,
    /// ω|ω|.
    Square,
}

/// What makes all unknowns of the order of one: torques over the greatest torque, speeds over the greatest speed; and each ramp's weight.
struct Scales {
    torque_constant: f64,
    most: f64,
    fastest: f64,
    /// Deviations of the ramps' torques over the greatest torque, where each is known.
    noise: Option<Vec<f64>>,
}

impl Scales {
    fn of(ramps: &[SteadyRamp], torque_constant: f64) -> Self {
        let greatest =
            |of: fn(&SteadyRamp) -> f64| ramps.iter().map(|r| of(r).abs()).fold(1e-300, f64::max);
        let most = torque_constant.abs() * greatest(|r| r.current);
        let sigma = |r: &SteadyRamp| Some(torque_constant.abs() * r.sigma? / most);
        let noise: Option<Vec<f64>> = ramps.iter().map(sigma).collect();
        Scales {
            torque_constant,
            most,
            fastest: greatest(|r| r.speed),
            // a current that is the same number throughout tells no noise
            noise: noise.filter(|noise| noise.iter().all(|sigma| *sigma > 1e-12)),
        }
    }

    fn row(&self, ramp: &SteadyRamp, terms: &[Term]) -> Vec<f64> {
        let speed = ramp.speed / self.fastest;
        let of = |term: &Term| match term {
            Term::Speed => speed,
            Term::Constant => 1.0,
            Term::Sign => speed.signum(),
            Term::Square => speed * speed.abs(),
        };
        terms.iter().map(of).collect()
    }

    fn torque(&self, ramp: &SteadyRamp) -> f64 {
        self.torque_constant * ramp.current / self.most
    }

    /// Least squares, each ramp weighed by its noise.
    fn fit(&self, ramps: &[SteadyRamp], terms: &[Term]) -> Result<Solution, LeastSquaresError> {
        let mut fit = Regression::new(terms.len());
        for (k, ramp) in ramps.iter().enumerate() {
            let weight = self.noise.as_ref().map_or(1.0, |noise| 1.0 / noise[k]);
            let row = self.row(ramp, terms).into_iter().map(|x| weight * x);
            fit.push(row, weight * self.torque(ramp));
        }
        fit.solve()
    }

    /// A deviation, of which two hold as many values as two of a normal distribution do: by the noise within the ramps, and no less than
    /// by what is left between them.
    fn sigma(&self, found: &Solution, i: usize, freedom: usize) -> f64 {
        let left = student(freedom) * found.variance.sqrt();
        let over = self.noise.as_ref().map_or(left, |_| left.max(1.0));
        found.spread[(i, i)].sqrt() * over
    }

    /// Standard deviation of what a fit leaves, N·m.
    fn rms(&self, ramps: &[SteadyRamp], found: &Solution) -> f64 {
        let terms = [Term::Speed, Term::Constant, Term::Sign];
        let terms = &terms[..found.values.len()];
        let left = |r: &SteadyRamp| {
            let told: f64 = self
                .row(r, terms)
                .iter()
                .zip(&found.values)
                .map(|(x, v)| x * v)
                .sum();
            (told - self.torque(r)).powi(2)
        };
        let freedom = ramps.len() - found.values.len();
        self.most * (ramps.iter().map(left).sum::<f64>() / freedom.max(1) as f64).sqrt()
    }
}
