//! A generalised plant in the scaling in which the formulas are written: time in units of a typical pole, states of equal
//! weight, D12 = [0; I] and D21 = [0 I].

use super::error::{Assumption, SynthesisError};
use super::plant::GeneralizedPlant;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{DenseError, Factored, Singular};

/// Rank decisions on D12 and D21, relative to their largest singular value.
const RANK: f64 = 1e-10;

/// The scaled problem and the way back.
#[derive(Debug, Clone)]
pub(super) struct Normalised {
    pub a: Matrix,
    pub b1: Matrix,
    pub b2: Matrix,
    pub c1: Matrix,
    pub c2: Matrix,
    pub d11: Matrix,
    /// Unit of time: the scaled plant's 1 is this many rad/s.
    pub unit: f64,
    /// True commands from scaled ones.
    commands: Matrix,
    /// Scaled measurements from true ones.
    measurements: Matrix,
    /// Direct term from true commands to true measurements.
    d22: Matrix,
}

impl Normalised {
    pub(super) fn new(plant: &GeneralizedPlant) -> Result<Self, SynthesisError> {
        let unit = time_unit(plant.system())?;
        let plant = plant.with_system(plant.system().slowed(unit).balanced_scaling());
        let (d12, d21) = (plant.d12(), plant.d21());
        let (p1, m2) = (d12.rows(), d12.columns());
        let (p2, m1) = (d21.rows(), d21.columns());
        let cost = Singular::new(&d12)?;
        if p1 < m2 || cost.rank(RANK) < m2 {
            return Err(SynthesisError::Assumption(Assumption::CommandCost {
                command: weightiest(&cost.right, m2 - 1),
            }));
        }
        let noise = Singular::new(&d21)?;
        if m1 < p2 || noise.rank(RANK) < p2 {
            return Err(SynthesisError::Assumption(Assumption::MeasurementNoise {
                measurement: weightiest(&noise.left, p2 - 1),
            }));
        }
        // errors turned so that commands appear on the last ones, each with gain one
        let errors = Matrix::from_fn(p1, p1, |i, j| cost.left[(i, (j + m2) % p1)]);
        let commands = &cost.right * Matrix::diagonal(&inverses(&cost.values[..m2]));
        let disturbances = Matrix::from_fn(m1, m1, |i, j| noise.right[(i, (j + p2) % m1)]);
        let measurements =
            Matrix::diagonal(&inverses(&noise.values[..p2])) * noise.left.transpose();
        Ok(Normalised {
            a: plant.system().a.clone(),
            b1: plant.b1() * &disturbances,
            b2: plant.b2() * &commands,
            c1: errors.transpose() * plant.c1(),
            c2: &measurements * plant.c2(),
            d11: errors.transpose() * plant.d11() * &disturbances,
            unit,
            commands,
            measurements,
            d22: plant.d22(),
        })
    }

    pub(super) fn order(&self) -> usize {
        self.a.rows()
    }

    /// Disturbances, commands, errors, measurements.
    pub(super) fn sizes(&self) -> (usize, usize, usize, usize) {
        (
            self.b1.columns(),
            self.b2.columns(),
            self.c1.rows(),
            self.c2.rows(),
        )
    }

    /// The same problem in the state T⁻¹ x.
    pub(super) fn in_state(&self, t: &Matrix) -> Result<Self, DenseError> {
        let f = Factored::new(t)?;
        Ok(Normalised {
            a: f.solve(&(&self.a * t)),
            b1: f.solve(&self.b1),
            b2: f.solve(&self.b2),
            c1: &self.c1 * t,
            c2: &self.c2 * t,
            ..self.clone()
        })
    }

    /// A controller of the scaled problem in true commands, measurements and time.
    pub(super) fn restored(&self, k: StateSpace) -> Result<StateSpace, SynthesisError> {
        let true_channels = StateSpace {
            b: &k.b * &self.measurements,
            c: &self.commands * &k.c,
            d: &self.commands * &k.d * &self.measurements,
            ..k
        };
        let looped = if self.d22.largest() == 0.0 {
            true_channels
        } else {
            // the formulas know the measurement without the commands' direct part
            true_channels.feedback(&StateSpace::constant(self.d22.clone(), k.domain))?
        };
        Ok(looped.slowed(1.0 / self.unit).balanced_scaling())
    }
}

/// Geometric mean of the poles that are not at the origin (rad/s).
fn time_unit(system: &StateSpace) -> Result<f64, DenseError> {
    let poles = meltpath_numerics::dense::eigenvalues(&system.a)?;
    let largest = poles.iter().map(|p| p.norm()).fold(0.0, f64::max);
    let logs: Vec<f64> = poles
        .iter()
        .map(|p| p.norm())
        .filter(|&r| r > 1e-12 * largest)
        .map(f64::ln)
        .collect();
    if logs.is_empty() {
        return Ok(1.0);
    }
    // a power of two: scaling rounds nothing
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    Ok((mean / std::f64::consts::LN_2).round().exp2())
}

fn inverses(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| 1.0 / v).collect()
}

/// The channel with the largest share in a column.
fn weightiest(vectors: &Matrix, column: usize) -> usize {
    (0..vectors.rows())
        .max_by(|&i, &j| {
            vectors[(i, column)]
                .abs()
                .total_cmp(&vectors[(j, column)].abs())
        })
        .unwrap_or(0)
}
