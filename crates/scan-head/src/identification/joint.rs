//! The motor that a record tells in time: inertia, damping, dry friction, modes and the channels' delays together.
//!
//! Source: L. Ljung, "System Identification: Theory for the User", 2nd ed., §§ 7.2-7.4, 9.4-9.5; which parameters a record determines is decided by their deviations.

use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, MOST_MODES, Mode};
use crate::identification::begins::freed;
use crate::identification::error::IdentificationError;
use crate::identification::estimate::{Estimate, Parameter, RIGID};
use crate::identification::modes::{KNOWN, ModeSearch};
use crate::identification::motor::{Identified, known};
use crate::identification::noise::{stands_out, white};
use crate::identification::record::BenchRecord;
use crate::identification::refine::{COARSE, Cut, FINE, ROUGH, Settled, settle};
use crate::identification::refusal::{Refusal, RefusedPeak};
use meltpath_numerics::least_squares::LeastSquaresError;

/// Dry friction is told where it is this many deviations above nothing.
const TOLD: f64 = 3.0;
/// Where its search begins, over the motor's torque.
const FIRST_COULOMB: f64 = 0.05;
/// What is left stands this far above its noise at most where a model holds a record. Measured on simulated records: 0.98 to 1.02 where
/// it does; 6 to 12 under bristles, 1.6 to 2.4 with five times the noise, 1.15 to 1.33 with ten times, the inductance up to seven stated
/// deviations off. With twenty times the noise it is 1.01 to 1.13, and the inductance still up to six off: that is not seen.
pub const FAR: f64 = 1.1;
/// How far beside a fit another begins, of the logarithms of inertia and pulsations: many stated deviations, and far within a peak.
const BESIDE: f64 = 1e-3;
/// Damping, and gain over Kc/J, where the search for a mode begins that the responses did not show.
const FIRST_MODE: [f64; 2] = [0.02, 0.1];
/// Share of what is left beside noise that may stay where such a mode is one.
const EXPLAINED: f64 = 0.5;

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
    /// is spread as the inertia is. Nothing without modes or dry friction.
    pub felt: Option<[f64; 2]>,
    /// Whether the search settled; else the ground was rough, as under friction that does not turn at once or with hardly any noise, and
    /// the deviations may be too small.
    pub settled: bool,
    /// By how much current and angle are read late against the voltage, each with its deviation, s.
    pub delays: [[f64; 2]; 2],
    /// What the ammeter reads where no current flows, and its deviation, A.
    pub zero: [f64; 2],
    /// The state in which the record begins.
    pub(super) begin: Vec<f64>,
    /// Root mean square of what is left of current (A) and angle (rad).
    pub rms: [f64; 2],
    /// White noise in it; nothing where the record is too short to tell.
    pub noise: [Option<f64>; 2],
}

/// Fits all parameters to a record in time, beginning at what its responses gave. Modes that they did not show are looked for in what the
/// fit leaves of the angle.
///
/// # Errors
/// [`IdentificationError`].
pub fn joint(record: &BenchRecord<'_>, start: &Identified) -> Result<Joint, IdentificationError> {
    let mut refused = start.refused.clone();
    let mut motor = start.motor.clone();
    let mut found = loop {
        let (k, why) = match fitted(record, &begun(record, &motor)) {
            Ok(found) => break found,
            Err(Doubt::Mode(k, why)) => (k, why),
            Err(Doubt::Other(error)) => return Err(error),
        };
        let mode = motor.modes.remove(k);
        refused.push(refused_mode(&motor, mode, why));
    };
    while let Some(mode) = missed(&found.0, record.period)? {
        let mut motor = found.0.estimate.motor.clone();
        let place = motor.modes.partition_point(|m| m.omega < mode.omega);
        motor.modes.insert(place, mode);
        match fitted(record, &begun(record, &motor)) {
            Ok(more) if explains(&found.0, &more.0)? => found = more,
            Err(Doubt::Mode(k, why)) if k == place => {
                refused.push(refused_mode(&motor, mode, why));
                break;
            }
            _ => break,
        }
    }
    let (settled, free) = found;
    let found = Joint::new(&settled, &free, refused)?;
    known(found.sigma)?;
    Ok(found)
}

/// Where the fit of a motor in time begins.
fn begun(record: &BenchRecord<'_>, motor: &Galvanometer) -> Estimate {
    let torque = record.current.iter().map(|i| i * i).sum::<f64>();
    let torque = motor.torque_constant * (torque / record.current.len().max(1) as f64).sqrt();
    Estimate {
        motor: Galvanometer {
            felt: 1.0,
            ..motor.clone()
        },
        coulomb: FIRST_COULOMB * torque,
        bias: 0.0,
        delays: [0.0; 2],
        zero: 0.0,
    }
}

fn refused_mode(motor: &Galvanometer, mode: Mode, why: Refusal) -> RefusedPeak {
    RefusedPeak {
        frequency: mode.omega / std::f64::consts::TAU,
        ratio: mode.gain * motor.inertia / motor.torque_constant / (2.0 * mode.damping),
        why,
    }
}

/// A mode that may be what a fit leaves of the angle, where that is far above its noise.
fn missed(settled: &Settled, period: f64) -> Result<Option<Mode>, IdentificationError> {
    let motor = &settled.estimate.motor;
    let [_, angle] = noise(settled)?;
    if motor.modes.len() >= MOST_MODES || angle.is_none_or(|noise| settled.rms[1] <= FAR * noise) {
        return Ok(None);
    }
    let taken: Vec<f64> = motor.modes.iter().map(|m| m.omega).collect();
    let from = std::f64::consts::TAU * ModeSearch::default().from;
    let [_, left] = &settled.left;
    let found = stands_out(left, period, from, &taken)?;
    let [damping, share] = FIRST_MODE;
    Ok(found.map(|omega| Mode {
        omega,
        damping,
        gain: share * motor.torque_constant / motor.inertia,
    }))
}

/// Whether a fit explains most of what another leaves of the angle beside its noise: one with a mode more that only bends to friction
/// does not.
fn explains(before: &Settled, after: &Settled) -> Result<bool, IdentificationError> {
    let [_, angle] = noise(before)?;
    let beside = |s: &Settled| s.rms[1].powi(2) - angle.unwrap_or(0.0).powi(2);
    Ok(after.cost < before.cost && beside(after) < EXPLAINED * beside(before))
}

/// White noise in what a fit leaves of current (A) and angle (rad).
fn noise(settled: &Settled) -> Result<[Option<f64>; 2], IdentificationError> {
    let of = |c: usize| -> Result<Option<f64>, IdentificationError> {
        let noise = white(&settled.left[c])?;
        Ok(noise.map(|noise| noise.max(settled.rounding[c])))
    };
    Ok([of(0)?, of(1)?])
}

/// Why a fit does not stand.
enum Doubt {
    /// The record does not tell this mode well enough.
    Mode(usize, Refusal),
    Other(IdentificationError),
}

/// Refuses the mode of which a fit tells the least, where that is too little.
fn modes_known(settled: &Settled, free: &[Parameter]) -> Result<(), Doubt> {
    let of_modes = free
        .iter()
        .zip(&settled.sigma)
        .filter_map(|(p, s)| match p {
            Parameter::Mode(k, _) => Some((*k, *s)),
            _ => None,
        });
    match of_modes.max_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((k, sigma)) if sigma > KNOWN => Err(Doubt::Mode(k, Refusal::Unsure { sigma })),
        _ => Ok(()),
    }
}

/// The fit with dry friction, or without where the record does not tell it.
fn fitted(record: &BenchRecord<'_>, begin: &Estimate) -> Result<(Settled, Vec<Parameter>), Doubt> {
    let mut free = RIGID.to_vec();
    free.extend([
        Parameter::Bias,
        Parameter::Zero,
        Parameter::Delay(0),
        Parameter::Delay(1),
        Parameter::Coulomb,
    ]);
    for k in 0..begin.motor.modes.len() {
        free.extend([0, 1, 2].map(|which| Parameter::Mode(k, which)));
    }
    let mut nearly = free.clone();
    let near = match determined(record, COARSE, (begin, &[]), &mut nearly) {
        Ok(settled) => {
            // a mode rings out within such a piece: longer ones tell no more of it
            modes_known(&settled, &nearly)?;
            settled.estimate
        }
        Err(_) => begin.clone(),
    };
    let mut settled = determined(record, FINE, (&near, &[]), &mut free)?;
    if !begin.motor.modes.is_empty() {
        let mut more = free.clone();
        more.push(Parameter::Felt);
        // from both ends: a fit that begins far off can stay there
        let mut spread = settled.estimate.clone();
        spread.motor.felt = 0.0;
        let other = determined(record, ROUGH, (&spread, &settled.begins), &mut more.clone());
        let mut best = determined(
            record,
            FINE,
            (&settled.estimate, &settled.begins),
            &mut more,
        )?;
        if let Ok(other) = other
            && other.cost < best.cost
        {
            more.clone_from(&free);
            more.push(Parameter::Felt);
            best = determined(record, FINE, (&other.estimate, &other.begins), &mut more)?;
        }
        (settled, free) = (best, more);
    }
    modes_known(&settled, &free)?;
    if free.contains(&Parameter::Coulomb) {
        settled = from_both_sides(record, settled, &free);
        settled = unless_caught(record, settled, &free);
    }
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
    let settled = determined(record, FINE, (&without, &settled.begins), &mut free)?;
    Ok((settled, free))
}

/// The best of a fit and of two that begin on either side of where it ended. Friction's turns make the ground rough: a search from the
/// responses can stay some deviations before the lowest place.
fn from_both_sides(record: &BenchRecord<'_>, mut best: Settled, free: &[Parameter]) -> Settled {
    let middle = best.estimate.clone();
    for by in [BESIDE, -BESIDE] {
        let mut side = middle.moved(Parameter::Inertia, by, best.units);
        for k in 0..middle.motor.modes.len() {
            side = side.moved(Parameter::Mode(k, 0), by, best.units);
        }
        // pieces begin where they seem to, not where the search left them
        let mut same = free.to_vec();
        match determined(record, FINE, (&side, &[]), &mut same) {
            Ok(other) if same == free && other.cost < best.cost => best = other,
            _ => {}
        }
    }
    best
}

/// The same fit, pieces that friction's turns caught begun anew where the piece before ends, if that leads lower: one of 24 pieces takes
/// all parameters along.
fn unless_caught(record: &BenchRecord<'_>, settled: Settled, free: &[Parameter]) -> Settled {
    let begins = match settled.estimate.motor.modes.len() {
        0 => freed::<3>(record, FINE, &settled),
        1 => freed::<5>(record, FINE, &settled),
        2 => freed::<7>(record, FINE, &settled),
        _ => freed::<9>(record, FINE, &settled),
    };
    let Ok(Some(begins)) = begins else {
        return settled;
    };
    let mut same = free.to_vec();
    match determined(record, FINE, (&settled.estimate, &begins), &mut same) {
        Ok(other) if same == free && other.cost < settled.cost => other,
        _ => settled,
    }
}

/// The fit of those free parameters that the record determines; the others stay where they are, dry friction at none.
fn determined(
    record: &BenchRecord<'_>,
    cut: Cut,
    (begin, begins): (&Estimate, &[Vec<f64>]),
    free: &mut Vec<Parameter>,
) -> Result<Settled, Doubt> {
    let mut begin = begin.clone();
    loop {
        let index = match driven(record, cut, (&begin, begins), free) {
            Err(IdentificationError::Fit(LeastSquaresError::Undetermined { index })) => index,
            other => return other.map_err(Doubt::Other),
        };
        match free.get(index) {
            Some(Parameter::Mode(k, _)) => {
                return Err(Doubt::Mode(*k, Refusal::Undetermined));
            }
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
    cut: Cut,
    begin: (&Estimate, &[Vec<f64>]),
    free: &[Parameter],
) -> Result<Settled, IdentificationError> {
    match begin.0.motor.modes.len() {
        0 => settle::<3>(record, cut, begin, free),
        1 => settle::<5>(record, cut, begin, free),
        2 => settle::<7>(record, cut, begin, free),
        _ => settle::<9>(record, cut, begin, free),
    }
}

impl Joint {
    /// What is left of current and angle over its noise: about 1 where the model holds the record; nothing where the noise is not told.
    pub fn over_noise(&self) -> [Option<f64>; 2] {
        [0, 1].map(|c| self.noise[c].map(|noise| self.rms[c] / noise))
    }

    /// Whether what is left is hardly more than noise. Else the model lacks something (a mode, another law of friction, what the noise has
    /// beside white), and the deviations promise nothing.
    pub fn holds(&self) -> bool {
        let near = |over: Option<f64>| over.is_some_and(|over| over <= FAR);
        self.over_noise().into_iter().all(near)
    }

    /// Whether the ammeter reads a current that does not flow.
    pub fn reads_beside(&self) -> bool {
        self.zero[0].abs() > TOLD * self.zero[1]
    }

    fn new(
        settled: &Settled,
        free: &[Parameter],
        refused: Vec<RefusedPeak>,
    ) -> Result<Self, IdentificationError> {
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
        let felt = free.contains(&Parameter::Felt);
        let felt = felt.then(|| [e.motor.felt, sigma(Parameter::Felt)]);
        let told = dry || bias[0].abs() > TOLD * bias[1];
        Ok(Joint {
            motor: Galvanometer {
                friction: if told {
                    Friction::Coulomb {
                        coulomb: e.coulomb,
                        bias: e.bias,
                    }
                } else {
                    Friction::None
                },
                felt: felt.map_or(0.0, |felt| felt[0]),
                ..e.motor.clone()
            },
            sigma: RIGID.map(sigma),
            mode_sigma: (0..e.motor.modes.len())
                .map(|k| [0, 1, 2].map(|which| sigma(Parameter::Mode(k, which))))
                .collect(),
            refused,
            coulomb: dry.then(|| [e.coulomb, sigma(Parameter::Coulomb)]),
            bias,
            felt,
            settled: settled.smooth,
            delays: [0, 1].map(|c| [e.delays[c], sigma(Parameter::Delay(c))]),
            zero: [e.zero, sigma(Parameter::Zero)],
            begin: settled.begins.first().cloned().unwrap_or_default(),
            rms: settled.rms,
            noise: noise(settled)?,
        })
    }
}
