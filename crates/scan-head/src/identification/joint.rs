//! The motor that a record tells in time: inertia, damping, dry friction, modes and the channels' delays together.
//!
//! Source: L. Ljung, "System Identification: Theory for the User", 2nd ed., §§ 7.2-7.4, 9.4-9.5; which parameters a record determines is decided by their deviations.

use crate::axis::friction::Friction;
use crate::axis::galvanometer::Galvanometer;
use crate::identification::error::IdentificationError;
use crate::identification::estimate::{Estimate, Parameter, RIGID};
use crate::identification::modes::KNOWN;
use crate::identification::motor::{Identified, known};
use crate::identification::record::BenchRecord;
use crate::identification::refine::{PIECE, SHORT_PIECE, Settled, settle};
use crate::identification::refusal::{Refusal, RefusedPeak};
use meltpath_numerics::least_squares::LeastSquaresError;

/// Dry friction is told where it is this many deviations above nothing.
const TOLD: f64 = 3.0;
/// Where its search begins, over the motor's torque.
const FIRST_COULOMB: f64 = 0.05;

/// A motor fitted to a record in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// R, L, Kc = Ke, J, B, modes, and dry friction where the record tells it.
    pub motor: Galvanometer,
    /// One standard deviation of R, L, Kc, J, B, relative; infinite where the record does not determine it.
    pub sigma: [f64; 5],
    /// The same of pulsation, damping and gain (over Kc/J) of each mode.
    pub mode_sigma: Vec<[f64; 3]>,
    /// Peaks that were not taken for modes, or that the record does not determine.
    pub refused: Vec<RefusedPeak>,
    /// Coulomb torque and its deviation, N·m; nothing where the record does not tell it from none.
    pub coulomb: Option<[f64; 2]>,
    /// Torque that is the same in both directions, and its deviation, N·m.
    pub bias: [f64; 2],
    /// Share of both that the modes feel, and its deviation: 1 where friction acts on the rotor, as the motor's torque does; 0 where it
    /// is spread as the inertia is, which is how an axis is simulated. Nothing without modes or dry friction.
    pub felt: Option<[f64; 2]>,
    /// By how much current and angle are read late against the voltage, each with its deviation, s.
    pub delays: [[f64; 2]; 2],
    /// Root mean square of what is left of current (A) and angle (rad).
    pub rms: [f64; 2],
}

/// Fits all parameters to a record in time, beginning at what its responses gave.
///
/// # Errors
/// [`IdentificationError`].
pub fn joint(record: &BenchRecord<'_>, start: &Identified) -> Result<Joint, IdentificationError> {
    let mut refused = start.refused.clone();
    let mut motor = start.motor.clone();
    let torque = record.current.iter().map(|i| i * i).sum::<f64>();
    let torque = motor.torque_constant * (torque / record.current.len().max(1) as f64).sqrt();
    loop {
        let begin = Estimate {
            motor: motor.clone(),
            coulomb: FIRST_COULOMB * torque,
            bias: 0.0,
            felt: 1.0,
            delays: [0.0; 2],
        };
        let doubtful = match fitted(record, &begin) {
            Ok((settled, free)) => {
                let found = Joint::new(&settled, &free, refused.clone());
                let worst = found
                    .mode_sigma
                    .iter()
                    .map(|s| s.iter().copied().fold(0.0, f64::max))
                    .enumerate()
                    .max_by(|a, b| a.1.total_cmp(&b.1))
                    .filter(|(_, sigma)| *sigma > KNOWN);
                let Some((k, sigma)) = worst else {
                    known(found.sigma)?;
                    return Ok(found);
                };
                (k, Refusal::Unsure { sigma })
            }
            Err(Doubt::Mode(k)) => (k, Refusal::Undetermined),
            Err(Doubt::Other(error)) => return Err(error),
        };
        let (k, why) = doubtful;
        let mode = motor.modes.remove(k);
        refused.push(RefusedPeak {
            frequency: mode.omega / std::f64::consts::TAU,
            ratio: mode.gain * motor.inertia / motor.torque_constant / (2.0 * mode.damping),
            why,
        });
    }
}

/// Why a fit does not stand.
enum Doubt {
    /// The record does not determine this mode.
    Mode(usize),
    Other(IdentificationError),
}

/// The fit with dry friction, or without where the record does not tell it.
fn fitted(record: &BenchRecord<'_>, begin: &Estimate) -> Result<(Settled, Vec<Parameter>), Doubt> {
    let mut free = RIGID.to_vec();
    free.extend([
        Parameter::Bias,
        Parameter::Delay(0),
        Parameter::Delay(1),
        Parameter::Coulomb,
    ]);
    if !begin.motor.modes.is_empty() {
        free.push(Parameter::Felt);
    }
    for k in 0..begin.motor.modes.len() {
        free.extend([0, 1, 2].map(|which| Parameter::Mode(k, which)));
    }
    let near = determined(record, SHORT_PIECE, begin, &mut free.clone());
    let near = near.map_or(begin.clone(), |settled| settled.estimate);
    let settled = determined(record, PIECE, &near, &mut free)?;
    let Some(dry) = free.iter().position(|p| *p == Parameter::Coulomb) else {
        return Ok((settled, free));
    };
    let sigma = settled.sigma.get(dry).copied().unwrap_or(f64::INFINITY);
    if settled.estimate.coulomb > TOLD * sigma * settled.units.torque {
        return Ok((settled, free));
    }
    free.retain(|p| !matches!(p, Parameter::Coulomb | Parameter::Felt));
    let without = Estimate {
        coulomb: 0.0,
        ..settled.estimate
    };
    let settled = determined(record, PIECE, &without, &mut free)?;
    Ok((settled, free))
}

/// The fit of those free parameters that the record determines; the others stay where they are, dry friction at none.
fn determined(
    record: &BenchRecord<'_>,
    piece: f64,
    begin: &Estimate,
    free: &mut Vec<Parameter>,
) -> Result<Settled, Doubt> {
    let mut begin = begin.clone();
    loop {
        let index = match driven(record, piece, &begin, free) {
            Err(IdentificationError::Fit(LeastSquaresError::Undetermined { index })) => index,
            other => return other.map_err(Doubt::Other),
        };
        match free.get(index) {
            Some(Parameter::Mode(k, _)) => return Err(Doubt::Mode(*k)),
            Some(Parameter::Resistance | Parameter::TorqueConstant | Parameter::Inertia) | None => {
                let error = LeastSquaresError::Undetermined { index };
                return Err(Doubt::Other(error.into()));
            }
            Some(&parameter) => {
                if parameter == Parameter::Coulomb {
                    begin.coulomb = 0.0;
                    free.retain(|p| *p != Parameter::Felt);
                }
                free.retain(|p| *p != parameter);
            }
        }
    }
}

/// The fit of a motor with as many modes as the estimate has.
fn driven(
    record: &BenchRecord<'_>,
    piece: f64,
    begin: &Estimate,
    free: &[Parameter],
) -> Result<Settled, IdentificationError> {
    match begin.motor.modes.len() {
        0 => settle::<3>(record, piece, begin, free),
        1 => settle::<5>(record, piece, begin, free),
        2 => settle::<7>(record, piece, begin, free),
        _ => settle::<9>(record, piece, begin, free),
    }
}

impl Joint {
    fn new(settled: &Settled, free: &[Parameter], refused: Vec<RefusedPeak>) -> Self {
        let sigma = |wanted: Parameter| {
            let at = free.iter().position(|p| *p == wanted);
            let sigma = at.and_then(|k| settled.sigma.get(k)).copied();
            sigma.map_or(f64::INFINITY, |s| {
                s * wanted.unit(settled.units).unwrap_or(1.0)
            })
        };
        let e = &settled.estimate;
        let dry = free.contains(&Parameter::Coulomb);
        let bias = [e.bias, sigma(Parameter::Bias)];
        let told = dry || bias[0].abs() > TOLD * bias[1];
        Joint {
            motor: Galvanometer {
                friction: if told {
                    Friction::Coulomb {
                        coulomb: e.coulomb,
                        bias: e.bias,
                    }
                } else {
                    Friction::None
                },
                ..e.motor.clone()
            },
            sigma: RIGID.map(sigma),
            mode_sigma: (0..e.motor.modes.len())
                .map(|k| [0, 1, 2].map(|which| sigma(Parameter::Mode(k, which))))
                .collect(),
            refused,
            coulomb: dry.then(|| [e.coulomb, sigma(Parameter::Coulomb)]),
            bias,
            felt: free
                .contains(&Parameter::Felt)
                .then(|| [e.felt, sigma(Parameter::Felt)]),
            delays: [0, 1].map(|c| [e.delays[c], sigma(Parameter::Delay(c))]),
            rms: settled.rms,
        }
    }
}
