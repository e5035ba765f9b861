//! The first stage of the health test KM0: motor and flexible modes from a record under a binary sequence; and the simulated bench
//! on which both stages run.
//!
//! Source: Rasoanarivo 2020, § 2.2.1 and 2.4; modes from the crests of the measured response over that of the rigid motor
//! (docs/theory/sources.md). Validity: modes between 1 kHz and 0.45 of the sampling frequency that stand out of the rigid response.

use std::f64::consts::TAU;

use meltpath_control::Complex64;
use meltpath_control::prbs::Prbs;
use meltpath_control::welch::{Welch, estimate};
use meltpath_numerics::random::Random;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::axis::chain::{Axis, AxisRecord};
use crate::axis::error::AxisError;
use crate::axis::galvanometer::{Galvanometer, MOST_MODES};
use crate::axis::plant::Plant;
use crate::health::signal::Km0Samples;
use crate::identification::error::IdentificationError;
use crate::identification::friction::student;
use crate::identification::modes::{ModeSearch, again, identify_modes};
use crate::identification::motor::Identified;
use crate::identification::record::{BenchRecord, Excitation, Method};

/// Length of the windows, s: 2.4 Hz are told apart.
const WINDOW: f64 = 0.4096;
/// Windows of the motor's fit are this many times shorter: it is soon done. They do not see viscous damping, which the ramps tell.
const COARSER: usize = 4;
/// Periods of the sequence; the first settles and is left out.
const PERIODS: usize = 8;
/// Lowest frequency of a mode, Hz.
const LOWEST_MODE: f64 = 1000.0;
/// Highest frequency of a mode over the sampling frequency.
const HIGHEST_MODE: f64 = 0.45;
/// Whether the first stage at a sample period (s) looks for modes at a frequency, Hz.
pub fn looked_for(frequency: f64, period: f64) -> bool {
    (LOWEST_MODE..HIGHEST_MODE / period).contains(&frequency)
}

/// A crest is a mode where it stands this far over its surroundings.
const CREST: f64 = 2.0;
/// Surroundings of a crest: from 1/`AROUND` to `AROUND` times its frequency.
const AROUND: f64 = 1.25;
/// Estimates below this coherence are noise.
const COHERENT: f64 = 0.5;

/// A flexible mode found in a record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FoundMode {
    /// Frequency of the crest, Hz.
    pub frequency: f64,
    /// Damping from its width at −3 dB.
    pub damping: f64,
}

/// What the first stage found.
#[derive(Debug, Clone, PartialEq)]
pub struct Km0Stage1 {
    /// R, L, Kc = Ke, J, B, fitted together with the modes that the responses show.
    pub motor: Galvanometer,
    /// Relative standard deviation of R, L, Kc, J, B.
    pub sigma: [f64; 5],
    /// How far noise lets R, L, Kc, J of such a record scatter, relative: one standard deviation, by the parts of the record. What a law
    /// that is not the motor's makes of all records alike is in `sigma`, not here.
    pub scatter: [f64; 4],
    /// Root mean square of the complex logarithmic residuals of the fit.
    pub residual: f64,
    /// The modes, lowest first.
    pub modes: Vec<FoundMode>,
}

/// Samples in a window at a sample period.
fn window(period: f64) -> usize {
    ((WINDOW / period).log2().round().exp2() as usize).clamp(256, 1 << 20)
}

/// The first stage's voltage: a binary sequence of ±`amplitude` V, one step a sample.
///
/// # Errors
/// [`AxisError::Parameter`].
pub fn sequence(period: f64, amplitude: f64) -> Result<Vec<f64>, AxisError> {
    let stages = (window(period) as f64).log2().round() as usize;
    let wrong = AxisError::Parameter {
        what: "the sample period",
        value: period,
        wanted: "such that a window of 0.4 s has 2^8 to 2^18 samples",
    };
    let sequence = Prbs::new(stages).map_err(|_| wrong)?;
    Ok(sequence.signal(amplitude, 1, PERIODS * sequence.period()))
}

/// The first stage on a record.
///
/// # Errors
/// [`IdentificationError`].
pub fn first_stage(
    record: &BenchRecord<'_>,
    excitation: Excitation<'_>,
) -> Result<Km0Stage1, IdentificationError> {
    let method = Method {
        welch: Welch::hann(window(record.period).min(record.voltage.len() / 3)),
        ..Method::default()
    };
    // without its modes in the fit the motor takes their motion for a greater inertia
    let fit = Method {
        welch: Welch::hann((method.welch.length / COARSER).max(64)),
        ..method
    };
    let found = identify_modes(record, excitation, &fit, &ModeSearch::default())?;
    let scatter = scatter(&found, record, excitation, &fit);
    let rigid = Galvanometer {
        modes: Vec::new(),
        ..found.motor.clone()
    };
    let modes = modes(record, &rigid, &method)?;
    Ok(Km0Stage1 {
        motor: found.motor,
        sigma: found.sigma,
        scatter,
        residual: found.rms,
        modes,
    })
}

/// Parts of a record whose scatter tells that of the whole.
const PARTS: usize = 4;

/// As far as a figure scatters of which nothing is known: a history holds no infinite numbers.
const UNKNOWN: f64 = 1.0;

/// How far noise lets R, L, Kc, J scatter, relative; [`UNKNOWN`] where a part of the record gives no motor.
fn scatter(
    found: &Identified,
    record: &BenchRecord<'_>,
    excitation: Excitation<'_>,
    method: &Method,
) -> [f64; 4] {
    let length = record.voltage.len() / PARTS;
    let search = ModeSearch::default();
    let part = |k: usize| {
        let part = k * length..(k + 1) * length;
        let excitation = match excitation {
            Excitation::Voltage => Excitation::Voltage,
            Excitation::SetPoint(s) => Excitation::SetPoint(&s[part.clone()]),
        };
        let record = BenchRecord {
            period: record.period,
            voltage: &record.voltage[part.clone()],
            current: &record.current[part.clone()],
            angle: &record.angle[part],
        };
        let m = again(found, &record, excitation, method, &search)?;
        Ok([m.resistance, m.inductance, m.torque_constant, m.inertia].map(f64::ln))
    };
    let parts: Result<Vec<[f64; 4]>, IdentificationError> =
        (0..PARTS).into_par_iter().map(part).collect();
    let Ok(parts) = parts else {
        return [UNKNOWN; 4];
    };
    let n = PARTS as f64;
    std::array::from_fn(|i| {
        let mean = parts.iter().map(|p| p[i]).sum::<f64>() / n;
        let squares: f64 = parts.iter().map(|p| (p[i] - mean).powi(2)).sum();
        // nor is anything known where that is not a number
        (student(PARTS - 1) * (squares / (n - 1.0) / n).sqrt()).min(UNKNOWN)
    })
}

/// Crests of the measured response over that of the rigid motor.
fn modes(
    record: &BenchRecord<'_>,
    motor: &Galvanometer,
    method: &Method,
) -> Result<Vec<FoundMode>, IdentificationError> {
    let e = estimate(record.current, record.angle, record.period, &method.welch)?;
    let ratio: Vec<(f64, f64)> = (0..e.omega.len())
        .filter(|&k| {
            let f = e.omega[k] / TAU;
            looked_for(f, record.period) && e.coherence[k] > COHERENT
        })
        .map(|k| {
            let s = Complex64::new(0.0, e.omega[k]);
            let rigid = (motor.speed_over_current(s) / s).norm();
            (e.omega[k] / TAU, e.response[k].norm() / rigid)
        })
        .collect();
    let mut found: Vec<(f64, FoundMode)> = Vec::new();
    for k in 1..ratio.len().saturating_sub(1) {
        let (f, height) = ratio[k];
        if height < ratio[k - 1].1 || height < ratio[k + 1].1 {
            continue;
        }
        let near = |r: &&(f64, f64)| r.0 > f / AROUND && r.0 < f * AROUND;
        let mut around: Vec<f64> = ratio.iter().filter(near).map(|r| r.1).collect();
        around.sort_by(f64::total_cmp);
        let level = around[around.len() / 2];
        let highest_near = around[around.len() - 1];
        if height < CREST * level || height < highest_near {
            continue;
        }
        let edge = height / std::f64::consts::SQRT_2;
        let below = ratio[..k].iter().rev().find(|r| r.1 < edge);
        let above = ratio[k..].iter().find(|r| r.1 < edge);
        let width = match (below, above) {
            (Some(a), Some(b)) => b.0 - a.0,
            _ => continue,
        };
        let mode = FoundMode {
            frequency: crest(&ratio[k - 1..=k + 1]),
            damping: 0.5 * width / f,
        };
        found.push((height / level, mode));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(MOST_MODES);
    let mut modes: Vec<FoundMode> = found.into_iter().map(|(_, m)| m).collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    Ok(modes)
}

/// The top of the parabola through three points of the logarithm.
fn crest(three: &[(f64, f64)]) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|i| three[i].1.ln());
    let bend = a - 2.0 * b + c;
    let shift = if bend < 0.0 {
        0.5 * (a - c) / bend
    } else {
        0.0
    };
    three[1].0 + shift.clamp(-1.0, 1.0) * 0.5 * (three[2].0 - three[0].0)
}

/// Columns of a simulated first stage, the sequence's first period left out: voltage, current, angle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BenchColumns {
    /// Time between samples, s.
    pub period: f64,
    /// V.
    pub voltage: Vec<f64>,
    /// A.
    pub current: Vec<f64>,
    /// rad.
    pub angle: Vec<f64>,
}

impl BenchColumns {
    /// As a record.
    pub fn record(&self) -> BenchRecord<'_> {
        BenchRecord {
            period: self.period,
            voltage: &self.voltage,
            current: &self.current,
            angle: &self.angle,
        }
    }
}

/// Seed of the encoder's noise on the simulated bench.
const SEED: u64 = 1;

/// The amplitude that is tried first, V; halved while the motor leaves its travel.
const AMPLITUDE: f64 = 0.5;

/// Drives the axis' motor with the binary sequence in open loop, as far as its travel allows; its encoder reads the angles.
///
/// # Errors
/// [`AxisError`].
pub fn simulate_first_stage(axis: &Axis, period: f64) -> Result<BenchColumns, AxisError> {
    let mut amplitude = AMPLITUDE;
    loop {
        let voltage = sequence(period, amplitude)?;
        let columns = match axis.motor.modes.len() {
            0 => drive::<3>(axis, period, &voltage)?,
            1 => drive::<5>(axis, period, &voltage)?,
            2 => drive::<7>(axis, period, &voltage)?,
            _ => drive::<{ 3 + 2 * MOST_MODES }>(axis, period, &voltage)?,
        };
        let far = columns.angle.iter().any(|a| a.abs() > axis.travel);
        if !far || amplitude < 0.02 {
            return Ok(columns);
        }
        amplitude *= 0.5;
    }
}

/// Share of its travel that a motor may go under a sequence that is to be played on it: another one drifts farther.
const BORNE: f64 = 0.7;
/// The least amplitude of a sequence, V.
const LEAST: f64 = 0.02;

/// A first stage that an axis bears, or that none does.
#[derive(Debug, Clone, PartialEq)]
pub enum Harmless {
    /// Voltages, V.
    Sequence(Vec<f64>),
    /// Under the smallest voltages too its motor goes so far, rad.
    Never(f64),
}

/// The first stage's sequence for an axis, of the greatest amplitude (V) up to `amplitude`, less a fifth as often as needed, under which the
/// axis' motor stays within its travel with the friction and the bias torque that its head's file tells.
///
/// # Errors
/// [`AxisError`].
pub fn harmless(axis: &Axis, period: f64, amplitude: f64) -> Result<Harmless, AxisError> {
    let (mut amplitude, mut least) = (amplitude, f64::INFINITY);
    while amplitude >= LEAST {
        let voltage = sequence(period, amplitude)?;
        let farthest = match axis.motor.modes.len() {
            0 => farthest::<3>(axis, period, &voltage)?,
            1 => farthest::<5>(axis, period, &voltage)?,
            2 => farthest::<7>(axis, period, &voltage)?,
            _ => farthest::<{ 3 + 2 * MOST_MODES }>(axis, period, &voltage)?,
        };
        if farthest <= BORNE * axis.travel {
            return Ok(Harmless::Sequence(voltage));
        }
        least = least.min(farthest);
        amplitude *= 0.8;
    }
    Ok(Harmless::Never(least))
}

/// The largest angle of an axis' motor under voltages from rest at the middle of its travel, rad.
fn farthest<const N: usize>(axis: &Axis, period: f64, voltage: &[f64]) -> Result<f64, AxisError> {
    let mut plant = Plant::<N>::new(&axis.motor, &[period], 0.0)?;
    let mut farthest = 0.0_f64;
    for &u in voltage {
        plant.advance(0, u, 0.0);
        farthest = farthest.max(plant.angle().abs());
    }
    Ok(farthest)
}

fn drive<const N: usize>(
    axis: &Axis,
    period: f64,
    voltage: &[f64],
) -> Result<BenchColumns, AxisError> {
    let skipped = voltage.len() / PERIODS;
    let mut plant = Plant::<N>::new(&axis.motor, &[period], 0.0)?;
    let mut random = Random::new(SEED);
    let mut columns = BenchColumns {
        period,
        ..BenchColumns::default()
    };
    for (k, &u) in voltage.iter().enumerate() {
        if k >= skipped {
            columns.voltage.push(u);
            columns.current.push(plant.current());
            columns
                .angle
                .push(axis.encoder.read(plant.angle(), &mut random));
        }
        plant.advance(0, u, 0.0);
    }
    Ok(columns)
}

/// The second stage on the simulated axis.
///
/// # Errors
/// [`AxisError`].
pub fn simulate_second_stage(
    axis: &Axis,
    signal: &Km0Samples,
    period: f64,
) -> Result<AxisRecord, AxisError> {
    axis.start(period, 0.0, SEED)?.record(&signal.set_points)
}
