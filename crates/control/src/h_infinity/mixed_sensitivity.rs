//! The weighted loop of a servo: reference and input disturbance in, weighted tracking error and command out.
//!
//! Rasoanarivo 2020, figs 3.2–3.3, eqs 3.17–3.26: templates on S, KS, SG and T.

use super::error::SynthesisError;
use super::plant::GeneralizedPlant;
use super::weights::Template;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;

/// ε = r − y, u = K ε, y = G (u + W3 d); errors W1 ε and W2 u.
///
/// At level γ the loop keeps |S| < γ |W1⁻¹|, |KS| < γ |W2⁻¹|, |SG| < γ |W1⁻¹ W3⁻¹| and |T| < γ |W2⁻¹ W3⁻¹|.
#[derive(Debug, Clone)]
pub struct MixedSensitivity {
    plant: StateSpace,
    sensitivity: Option<StateSpace>,
    command: Option<StateSpace>,
    disturbance: Option<StateSpace>,
    fault: Option<SynthesisError>,
}

impl MixedSensitivity {
    /// For the plant from commands to measured outputs.
    pub fn new(plant: StateSpace) -> Self {
        MixedSensitivity {
            plant,
            sensitivity: None,
            command: None,
            disturbance: None,
            fault: None,
        }
    }

    /// W1, by its template on the sensitivity of every output: bandwidth, precision, modulus margin.
    #[must_use]
    pub fn sensitivity(mut self, template: Template) -> Self {
        self.sensitivity = self.spread(template, self.plant.outputs());
        self
    }

    /// W2, by its template on every command per reference: what the actuator may do.
    #[must_use]
    pub fn command(mut self, template: Template) -> Self {
        self.command = self.spread(template, self.plant.inputs());
        self
    }

    /// W3, which shapes the disturbance at the plant's input: stiffness at low frequency, roll-off of T at high.
    #[must_use]
    pub fn disturbance(mut self, template: Template) -> Self {
        self.disturbance = self.spread(template, self.plant.inputs());
        self
    }

    fn spread(&mut self, template: Template, channels: usize) -> Option<StateSpace> {
        let one = match template.to_state_space() {
            Ok(one) => one,
            Err(error) => {
                self.fault = Some(error.into());
                return None;
            }
        };
        let mut all = one.clone();
        for _ in 1..channels {
            match all.beside(&one) {
                Ok(next) => all = next,
                Err(error) => self.fault = Some(error.into()),
            }
        }
        Some(all)
    }

    /// The generalised plant: disturbances (r, d), commands u, errors (W1 ε, W2 u), measurements ε. A weight that was not
    /// given drops its channel.
    ///
    /// # Errors
    /// [`SynthesisError::System`] for a weight that overflows, [`SynthesisError::Channels`] without any error weight.
    pub fn assemble(&self) -> Result<GeneralizedPlant, SynthesisError> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        let g = &self.plant;
        let (p, m) = (g.outputs(), g.inputs());
        let domain = g.domain;
        // inputs r, d, u: the shaped disturbance first
        let shaped = match &self.disturbance {
            Some(w3) => StateSpace::constant(Matrix::identity(p), domain)
                .beside(w3)?
                .beside(&StateSpace::constant(Matrix::identity(m), domain))?,
            None => StateSpace::constant(Matrix::identity(p + m), domain),
        };
        let with_disturbance = self.disturbance.is_some();
        // r, [b,] u → r, u, (b + u)
        let width = if with_disturbance { p + 2 * m } else { p + m };
        let split = Matrix::from_fn(p + 2 * m, width, |i, j| {
            let command = width - m;
            let hit = if i < p {
                j == i
            } else if i < p + m {
                j == command + (i - p)
            } else {
                let k = i - p - m;
                j == command + k || (with_disturbance && j == p + k)
            };
            f64::from(u8::from(hit))
        });
        let through = StateSpace::constant(Matrix::identity(p + m), domain).beside(g)?;
        // r, u, y → ε, u
        let error = Matrix::from_fn(p + m, p + m + p, |i, j| {
            if i < p {
                f64::from(i8::from(j == i) - i8::from(j == p + m + i))
            } else {
                f64::from(u8::from(j == i))
            }
        });
        let core = shaped
            .then_gain(&split)?
            .then(&through)?
            .then_gain(&error)?;
        // ε, u → ε twice, u
        let rows = [self.sensitivity.as_ref(), self.command.as_ref()];
        let counts = [p, m];
        let mut weights: Option<StateSpace> = None;
        let mut kept = Vec::new();
        for (k, weight) in rows.into_iter().enumerate() {
            if let Some(w) = weight {
                let start = if k == 0 { 0 } else { p };
                kept.extend(start..start + counts[k]);
                weights = Some(match weights {
                    None => w.clone(),
                    Some(before) => before.beside(w)?,
                });
            }
        }
        let errors = kept.len();
        let outputs = StateSpace::constant(Matrix::identity(p), domain);
        let outputs = match weights {
            Some(w) => w.beside(&outputs)?,
            None => outputs,
        };
        let copy = Matrix::from_fn(errors + p, p + m, |i, j| {
            let source = if i < errors { kept[i] } else { i - errors };
            f64::from(u8::from(j == source))
        });
        GeneralizedPlant::new(core.then_gain(&copy)?.then(&outputs)?, m, p)
    }
}
