//! One axis of the head, streaming: pre-filter, controller, drive and galvanometer, from angle set-points to angles.
//!
//! Source: Rasoanarivo 2020, fig. 2.1, 2.26. At each sample the encoder is read, the law gives a voltage, and the
//! galvanometer moves to the next sample under it; a loop delay lets the voltage act late by any time.

use std::collections::VecDeque;

use meltpath_numerics::random::Random;
use serde::{Deserialize, Serialize};

use crate::axis::control::{Cascade, Controller, Law, Limits, Measured, Sampled, SpeedSource};
use crate::axis::error::{AxisError, not_negative, positive};
use crate::axis::friction::Friction;
use crate::axis::galvanometer::{Galvanometer, MOST_MODES};
use crate::axis::plant::Plant;
use crate::axis::prefilter::{self, PreFilter};

/// The step after which swinging is looked at, over the travel: far from the drive's limits.
const SMALL_STEP: f64 = 1e-6;
/// For how long, s.
const SWINGING: f64 = 0.2;
/// Swings below this share of the step have settled.
const SETTLED: f64 = 1e-3;
/// Both where the controller runs in whole numbers: what is smaller is lost in their rounding, and about the end they keep wandering by a few
/// of them, as a stable loop does.
const OF_WORDS: [f64; 2] = [1e-2, 1e-2];

/// The angle sensor.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Encoder {
    /// Smallest step, rad; 0 for none.
    pub resolution: f64,
    /// Standard deviation of white noise at each sample, rad.
    pub noise: f64,
}

impl Encoder {
    /// What it reads of an angle, rad.
    pub(crate) fn read(&self, angle: f64, random: &mut Random) -> f64 {
        let noisy = if self.noise > 0.0 {
            angle + self.noise * random.normal()
        } else {
            angle
        };
        if self.resolution > 0.0 {
            (noisy / self.resolution).round() * self.resolution
        } else {
            noisy
        }
    }
}

/// An axis: motor, drive, control, sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The motor with its load.
    pub motor: Galvanometer,
    /// The control law.
    pub controller: Controller,
    /// Where the speed loop gets its speed from.
    pub speed: SpeedSource,
    /// Limits of the drive.
    pub limits: Limits,
    /// The pre-filter; without it set-points go straight to the controller.
    pub prefilter: Option<PreFilter>,
    /// The sensor.
    pub encoder: Encoder,
    /// Time from the reading of the sensor to the voltage, s.
    pub delay: f64,
    /// Mechanical travel to either side, rad.
    pub travel: f64,
}

/// What an axis did, one entry a sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AxisRecord {
    /// Set-point after the pre-filter, rad.
    pub reference: Vec<f64>,
    /// Rotor angle at the sample, rad.
    pub angle: Vec<f64>,
    /// Current at the sample, A.
    pub current: Vec<f64>,
    /// Voltage asked from the sample on, V.
    pub voltage: Vec<f64>,
}

impl AxisRecord {
    pub(super) fn resize(&mut self, n: usize) {
        for column in [
            &mut self.reference,
            &mut self.angle,
            &mut self.current,
            &mut self.voltage,
        ] {
            column.resize(n, 0.0);
        }
    }
}

/// What runs behind a [`RunningAxis`].
pub(super) trait Runs: Send {
    fn block(&mut self, set_points: &[f64], record: &mut AxisRecord);
}

/// Control and motor without the pre-filter.
struct Loop<const N: usize, L: Law> {
    plant: Plant<N>,
    law: L,
    encoder: Encoder,
    random: Random,
    voltage: f64,
    /// Voltages on their way, oldest first; the first acts now.
    late: VecDeque<f64>,
    /// Whether a sample has a first part under the voltage before.
    split: bool,
    before: f64,
}

impl<const N: usize, L: Law> Runs for Loop<N, L> {
    fn block(&mut self, set_points: &[f64], record: &mut AxisRecord) {
        record.resize(set_points.len());
        let plain = self.encoder.noise == 0.0 && self.encoder.resolution == 0.0;
        for (k, &reference) in set_points.iter().enumerate() {
            let angle = self.plant.angle();
            let current = self.plant.current();
            let measured = Measured {
                current,
                angle: if plain {
                    angle
                } else {
                    self.encoder.read(angle, &mut self.random)
                },
                speed: self.plant.speed(),
            };
            let voltage = self
                .law
                .step(reference, measured)
                .clamp(-self.voltage, self.voltage);
            record.reference[k] = reference;
            record.angle[k] = angle;
            record.current[k] = current;
            record.voltage[k] = voltage;
            self.act(voltage);
        }
    }
}

impl<const N: usize, L: Law> Loop<N, L> {
    #[inline]
    fn act(&mut self, voltage: f64) {
        let now = if self.late.is_empty() {
            voltage
        } else {
            self.late.push_back(voltage);
            self.late.pop_front().unwrap_or(voltage)
        };
        if self.split {
            self.plant.advance(0, self.before, 0.0);
            self.plant.advance(1, now, 0.0);
            self.before = now;
        } else {
            self.plant.advance(0, now, 0.0);
        }
    }
}

/// An axis that runs.
pub struct RunningAxis {
    prefilter: Option<prefilter::Running>,
    inner: Box<dyn Runs>,
    filtered: Vec<f64>,
    period: f64,
    travel: f64,
    samples: u64,
}

impl Axis {
    /// Checks every part.
    ///
    /// # Errors
    /// [`AxisError`].
    pub fn check(&self) -> Result<(), AxisError> {
        self.motor.check()?;
        if let Some(filter) = &self.prefilter {
            filter.check()?;
        }
        not_negative("the encoder's resolution", self.encoder.resolution)?;
        not_negative("the encoder's noise", self.encoder.noise)?;
        not_negative("the loop delay", self.delay)?;
        positive("the travel", self.travel)
    }

    /// Refuses an axis whose loop is unstable, as its swinging after a small step tells: without dry friction, which holds small
    /// swings, and without the encoder's steps and noise, which keep them up.
    ///
    /// # Errors
    /// [`AxisError::Oscillates`], [`AxisError::RanAway`]; [`AxisError`] as [`Axis::start`].
    pub fn check_stable(&self, period: f64) -> Result<(), AxisError> {
        let mut smooth = self.clone();
        smooth.motor.friction = Friction::None;
        smooth.encoder = Encoder::default();
        let [share, settled] = if self.controller.rounds_signals() {
            OF_WORDS
        } else {
            [SMALL_STEP, SETTLED]
        };
        let step = share * self.travel;
        let samples = (SWINGING / period).ceil() as usize;
        let angle = smooth
            .start(period, 0.0, 1)?
            .record(&vec![step; samples])?
            .angle;
        let swing = |from: usize, to: usize| {
            let piece = angle.get(from..to).unwrap_or_default();
            let (low, high) = piece
                .iter()
                .fold((f64::MAX, f64::MIN), |(l, h), a| (l.min(*a), h.max(*a)));
            (high - low, 0.5 * (low + high))
        };
        let (before, _) = swing(samples / 4, samples / 2);
        let (after, middle) = swing(samples - samples / 4, samples);
        if after > settled * step && (after > before || after > 10.0 * step) {
            let last = angle.get(samples - samples / 4..).unwrap_or_default();
            let turns = last
                .windows(2)
                .filter(|w| (w[0] < middle) != (w[1] < middle))
                .count();
            return Err(AxisError::Oscillates {
                frequency: 0.5 * turns as f64 / (last.len() as f64 * period),
            });
        }
        Ok(())
    }

    /// The axis at rest at `angle` rad, sampled every `period` s; `seed` is that of the sensor's noise.
    ///
    /// # Errors
    /// [`AxisError`] where a part is unsound or does not suit the period.
    pub fn start(&self, period: f64, angle: f64, seed: u64) -> Result<RunningAxis, AxisError> {
        self.check()?;
        positive("the sample period", period)?;
        let inner = match self.motor.modes.len() {
            0 => self.law::<3>(period, angle, seed),
            1 => self.law::<5>(period, angle, seed),
            2 => self.law::<7>(period, angle, seed),
            3 => self.law::<9>(period, angle, seed),
            modes => Err(AxisError::Modes {
                modes,
                most: MOST_MODES,
            }),
        }?;
        Ok(RunningAxis {
            prefilter: self
                .prefilter
                .as_ref()
                .map(|p| prefilter::Running::new(p, period, angle))
                .transpose()?,
            inner,
            filtered: Vec::new(),
            period,
            travel: self.travel,
            samples: 0,
        })
    }

    fn law<const N: usize>(
        &self,
        period: f64,
        angle: f64,
        seed: u64,
    ) -> Result<Box<dyn Runs>, AxisError> {
        match &self.controller {
            Controller::Cascade(gains) => {
                let law = Cascade::new(gains, self.speed, self.limits, period, angle)?;
                self.closed::<N, _>(law, period, angle, seed)
            }
            Controller::Sampled(controller) => {
                let law = Sampled::new(controller, self.limits, period, angle)?;
                self.closed::<N, _>(law, period, angle, seed)
            }
        }
    }

    fn closed<const N: usize, L: Law + 'static>(
        &self,
        law: L,
        period: f64,
        angle: f64,
        seed: u64,
    ) -> Result<Box<dyn Runs>, AxisError> {
        let whole = (self.delay / period + 1e-9).floor();
        let rest = self.delay - whole * period;
        let split = rest > 1e-6 * period;
        let lengths = if split {
            vec![rest, period - rest]
        } else {
            vec![period]
        };
        Ok(Box::new(Loop::<N, L> {
            plant: Plant::new(&self.motor, &lengths, angle)?,
            law,
            encoder: self.encoder,
            random: Random::new(seed),
            voltage: self.limits.voltage,
            late: std::iter::repeat_n(0.0, whole as usize).collect(),
            split,
            before: 0.0,
        }))
    }
}

impl RunningAxis {
    /// An axis without a pre-filter of ours.
    pub(super) fn alone(inner: Box<dyn Runs>, period: f64, travel: f64) -> Self {
        RunningAxis {
            prefilter: None,
            inner,
            filtered: Vec::new(),
            period,
            travel,
            samples: 0,
        }
    }

    /// Takes the next set-points (rad) and replaces `record` by what the axis did.
    ///
    /// # Errors
    /// [`AxisError::RanAway`] where the angle left three times the travel.
    pub fn block(&mut self, set_points: &[f64], record: &mut AxisRecord) -> Result<(), AxisError> {
        if let Some(filter) = &mut self.prefilter {
            self.filtered.clear();
            self.filtered
                .extend(set_points.iter().map(|&s| filter.step(s)));
            self.inner.block(&self.filtered, record);
        } else {
            self.inner.block(set_points, record);
        }
        let bound = 3.0 * self.travel;
        if let Some(at) = record
            .angle
            .iter()
            .position(|a| a.is_nan() || a.abs() > bound)
        {
            return Err(AxisError::RanAway {
                time: (self.samples + at as u64) as f64 * self.period,
                angle_deg: record.angle[at].to_degrees(),
                travel_deg: self.travel.to_degrees(),
            });
        }
        self.samples += set_points.len() as u64;
        Ok(())
    }

    /// All of a short record at once.
    ///
    /// # Errors
    /// As [`RunningAxis::block`].
    pub fn record(mut self, set_points: &[f64]) -> Result<AxisRecord, AxisError> {
        let mut record = AxisRecord::default();
        self.block(set_points, &mut record)?;
        Ok(record)
    }
}
