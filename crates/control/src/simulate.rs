//! Sampled systems run in time: sample by sample for streams, or over a whole record.

use crate::SystemError;
use crate::discretise::{Hold, discretise};
use crate::domain::Domain;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;

/// A sampled system with its state, fed one sample at a time without allocating.
///
/// ```
/// use meltpath_control::{simulate::Running, TransferFunction};
/// let average = TransferFunction::sampled([0.5, 0.5], [1.0, 0.0], 1e-3).unwrap().to_state_space().unwrap();
/// let mut running = Running::new(&average).unwrap();
/// let mut y = [0.0];
/// let out: Vec<f64> = [1.0, 1.0, 3.0].iter().map(|&u| { running.step(&[u], &mut y); y[0] }).collect();
/// assert_eq!(out, [0.5, 1.0, 2.0]);
/// ```
#[derive(Debug, Clone)]
pub struct Running {
    states: usize,
    inputs: usize,
    /// Rows of [A B] then of [C D], in reading order.
    rows: Vec<f64>,
    state: Vec<f64>,
    next: Vec<f64>,
}

impl Running {
    /// At rest.
    ///
    /// # Errors
    /// [`SystemError::Domains`] when the system is continuous.
    pub fn new(system: &StateSpace) -> Result<Self, SystemError> {
        if system.domain == Domain::Continuous {
            return Err(SystemError::Domains {
                one: system.domain,
                two: Domain::Sampled { period: f64::NAN },
            });
        }
        let all = Matrix::blocks([[&system.a, &system.b], [&system.c, &system.d]]);
        Ok(Running {
            states: system.order(),
            inputs: system.inputs(),
            rows: all.entries().to_vec(),
            state: vec![0.0; system.order()],
            next: vec![0.0; system.order()],
        })
    }

    /// Writes the outputs for this sample's inputs and moves on by one sample. `output` holds as many values as the system
    /// has outputs.
    pub fn step(&mut self, input: &[f64], output: &mut [f64]) {
        let width = self.states + self.inputs;
        let combine = |row: &[f64], state: &[f64]| {
            let (a, b) = row.split_at(state.len());
            let mut sum = 0.0;
            for (x, k) in state.iter().zip(a) {
                sum += k * x;
            }
            for (u, k) in input.iter().zip(b) {
                sum += k * u;
            }
            sum
        };
        for (i, y) in output.iter_mut().enumerate() {
            let start = (self.states + i) * width;
            *y = combine(&self.rows[start..start + width], &self.state);
        }
        for (i, x) in self.next.iter_mut().enumerate() {
            *x = combine(&self.rows[i * width..(i + 1) * width], &self.state);
        }
        std::mem::swap(&mut self.state, &mut self.next);
    }
}

/// The outputs (one row a sample) of a sampled system at rest for a record of inputs (one row a sample).
///
/// # Errors
/// [`SystemError::Domains`] when continuous, [`SystemError::Widths`] when the record has the wrong number of columns.
pub fn simulate(system: &StateSpace, inputs: &Matrix) -> Result<Matrix, SystemError> {
    if inputs.columns() != system.inputs() {
        return Err(SystemError::Widths {
            what: "simulation (columns of the input record)",
            one: inputs.columns(),
            two: system.inputs(),
        });
    }
    let mut running = Running::new(system)?;
    let mut out = Matrix::zeros(inputs.rows(), system.outputs());
    for k in 0..inputs.rows() {
        running.step(inputs.row_slice(k), out.row_slice_mut(k));
    }
    Ok(out)
}

/// Unit step on input `input` of a continuous system, `count` samples at `period` (s): one row a sample.
///
/// # Errors
/// As [`simulate`] and [`discretise`].
pub fn step_response(
    system: &StateSpace,
    input: usize,
    period: f64,
    count: usize,
) -> Result<Matrix, SystemError> {
    let all: Vec<usize> = (0..system.outputs()).collect();
    let one = system.select(&all, &[input])?;
    let sampled = match one.domain {
        Domain::Continuous => discretise(&one, period, Hold::Zero)?,
        Domain::Sampled { .. } => one,
    };
    simulate(&sampled, &Matrix::from_fn(count, 1, |_, _| 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TransferFunction;

    #[test]
    fn step_of_a_lag() {
        let lag = TransferFunction::new([2.0], [0.1, 1.0])
            .unwrap()
            .to_state_space()
            .unwrap();
        let y = step_response(&lag, 0, 0.01, 50).unwrap();
        for k in 0..50 {
            assert!((y[(k, 0)] - 2.0 * (1.0 - (-0.1 * k as f64).exp())).abs() < 1e-14);
        }
    }
}
