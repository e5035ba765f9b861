//! KM0, the periodic health test of an axis: the angle signal of its second stage, the analysis of its steps and ramps, the
//! friction behind the ramps, and a rating against the first accepted test.
//!
//! Source: Rasoanarivo 2020, § 2.4, fig. 2.57-2.60. Limits of the rating: ours (docs/theory/sources.md). The first stage
//! (R, L, J, constants and modes) is an identification, [`crate::health::bench`]; its results come in as values.

use serde::{Deserialize, Serialize};

use crate::axis::chain::{Axis, AxisRecord};
use crate::axis::galvanometer::{AxisError, positive};

/// A change of angle by which a step's response is said to have begun, rad (10⁻⁴ deg).
const START: f64 = 1e-4 * std::f64::consts::PI / 180.0;
/// Half the band of the response time.
const BAND: f64 = 0.05;

/// The second stage's signal: steps, then ramps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Km0Signal {
    /// Amplitudes of the steps, rad; each is done up and down.
    pub steps: Vec<f64>,
    /// Slope of the steps, rad/s: large steps reach it, small ones do not.
    pub step_speed: f64,
    /// Speeds of the ramps, rad/s; each is done up and down.
    pub ramps: Vec<f64>,
    /// Angle covered by a ramp, at most, rad.
    pub ramp_amplitude: f64,
    /// Longest ramp, s: slow ones cover less.
    pub ramp_time: f64,
    /// Rest after each step and ramp, s.
    pub rest: f64,
}

/// What a piece of the signal is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Piece {
    Step { from: f64, to: f64 },
    Ramp { speed: f64 },
}

/// The sampled signal and where its pieces lie.
#[derive(Debug, Clone, PartialEq)]
pub struct Km0Samples {
    /// Set-points, rad.
    pub set_points: Vec<f64>,
    pieces: Vec<(Piece, std::ops::Range<usize>)>,
    period: f64,
}

/// One step, up or down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Set-point amplitude, deg; negative when falling.
    pub amplitude_deg: f64,
    /// Instant from which the axis is at rest, s after the step begins.
    pub steady_from: f64,
    /// Mean response from then on, deg.
    pub steady_deg: f64,
    /// Time for the response to change by 10⁻⁴ deg, s.
    pub start_delay: f64,
    /// Overshoot, % of the change.
    pub overshoot: f64,
    /// Time to enter the ±5 % band for good, s.
    pub response_time: f64,
    /// Set-point − steady response, deg.
    pub static_error_deg: f64,
}

/// One ramp, up or down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RampRecord {
    /// Programmed speed, deg/s; negative when falling.
    pub speed_deg: f64,
    /// Mean speed of the second half, deg/s.
    pub steady_speed_deg: f64,
    /// Angle covered, deg.
    pub amplitude_deg: f64,
    /// Set-point − response at the end of the ramp, deg.
    pub lag_deg: f64,
    /// Time for the speed to enter ±5 % of the steady one, s.
    pub speed_response_time: f64,
    /// Mean current of the second half, A.
    pub current: f64,
    /// Kc times that current, N·m.
    pub torque: f64,
}

/// Friction fitted to the ramps: T = B ω + T_P + T_C sgn ω (eq. 2.22).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrictionFit {
    /// B, N·m·s/rad.
    pub viscous: f64,
    /// T_P, N·m.
    pub bias: f64,
    /// T_C, N·m.
    pub coulomb: f64,
    /// RMS of what is left, N·m.
    pub residual: f64,
    /// RMS left by B alone, N·m.
    pub residual_viscous: f64,
}

/// What the second stage found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Km0Stage2 {
    /// The steps, in order.
    pub steps: Vec<StepRecord>,
    /// The ramps, in order.
    pub ramps: Vec<RampRecord>,
    /// The friction.
    pub friction: FrictionFit,
}

impl Km0Signal {
    /// A signal for an axis: steps of 18 deg halved down to 1/8 deg and ramps at ten speeds, within the travel and the
    /// speed limit.
    pub fn for_axis(axis: &Axis) -> Self {
        let largest = 0.8 * axis.travel;
        let fastest = axis
            .prefilter
            .as_ref()
            .map_or(30.0, |p| p.speed_limit)
            .min(30.0);
        Km0Signal {
            steps: (0..8).map(|k| largest / f64::from(1 << k)).collect(),
            step_speed: fastest,
            ramps: (1..=10)
                .map(|k| fastest * (f64::from(k) / 10.0).powi(2))
                .collect(),
            ramp_amplitude: largest,
            ramp_time: 0.25,
            rest: 0.1,
        }
    }

    /// The signal sampled at `period` s, from and to 0.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn samples(&self, period: f64) -> Result<Km0Samples, AxisError> {
        positive("the sample period", period)?;
        positive("the slope of the steps", self.step_speed)?;
        positive("the amplitude of the ramps", self.ramp_amplitude)?;
        positive("the longest ramp", self.ramp_time)?;
        positive("the rest", self.rest)?;
        let mut samples = Km0Samples {
            set_points: vec![0.0],
            pieces: Vec::new(),
            period,
        };
        let rest = (self.rest / period).ceil() as usize;
        samples.hold(rest);
        for &amplitude in &self.steps {
            positive("a step", amplitude)?;
            for to in [amplitude, 0.0] {
                let (from, begin) = (samples.last(), samples.set_points.len());
                samples.slope(to, self.step_speed);
                samples.hold(rest);
                samples.close(Piece::Step { from, to }, begin);
            }
        }
        for &speed in &self.ramps {
            positive("the speed of a ramp", speed)?;
            let reach = 0.5 * self.ramp_amplitude.min(speed * self.ramp_time);
            samples.slope(-reach, 0.2 * self.step_speed);
            samples.hold(rest);
            for (to, sign) in [(reach, 1.0), (-reach, -1.0)] {
                let begin = samples.set_points.len();
                samples.slope(to, speed);
                samples.close(
                    Piece::Ramp {
                        speed: sign * speed,
                    },
                    begin,
                );
                samples.hold(rest);
            }
        }
        samples.slope(0.0, 0.2 * self.step_speed);
        samples.hold(rest);
        Ok(samples)
    }
}

impl Km0Samples {
    fn last(&self) -> f64 {
        self.set_points.last().copied().unwrap_or(0.0)
    }

    fn hold(&mut self, count: usize) {
        let last = self.last();
        self.set_points.extend(std::iter::repeat_n(last, count));
    }

    fn slope(&mut self, to: f64, speed: f64) {
        let from = self.last();
        let count = ((to - from).abs() / (speed * self.period)).ceil() as usize;
        self.set_points
            .extend((1..=count).map(|k| from + (to - from) * k as f64 / count as f64));
    }

    fn close(&mut self, piece: Piece, begin: usize) {
        self.pieces.push((piece, begin..self.set_points.len()));
    }

    /// Where the record of this signal begins in a longer one whose set-points (rad) were recorded too: both leave 0 together.
    ///
    /// # Errors
    /// [`AxisError::Parameter`] where the set-points are not those of this signal.
    pub fn align(&self, set_points: &[f64]) -> Result<usize, AxisError> {
        /// Set-points may be rounded by the recorder, rad.
        const ROUNDED: f64 = 2e-4;
        let leaves = |s: &[f64]| s.iter().position(|v| v.abs() > ROUNDED);
        let (Some(there), Some(here)) = (leaves(set_points), leaves(&self.set_points)) else {
            return Err(AxisError::Parameter {
                what: "the largest recorded set-point",
                value: 0.0,
                wanted: "above 0.01 deg: was the health signal played, and in which unit?",
            });
        };
        let begin = there.saturating_sub(here);
        let worst = set_points[begin..]
            .iter()
            .zip(&self.set_points)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        // a sample of shift on the steepest slope
        let slope = self
            .set_points
            .windows(2)
            .map(|w| (w[1] - w[0]).abs())
            .fold(0.0, f64::max);
        if worst > ROUNDED + 2.0 * slope {
            return Err(AxisError::Parameter {
                what: "the largest difference, deg, of the recorded set-points to the health signal",
                value: worst.to_degrees(),
                wanted: "none: play the signal written for this head and axis, at its sample period",
            });
        }
        Ok(begin)
    }

    /// Analyses a record of this signal. `torque_constant` N·m/A is that of the first stage.
    ///
    /// # Errors
    /// [`AxisError::Parameter`] where the record is shorter than the signal or has no ramp to fit.
    pub fn analyse(
        &self,
        record: &AxisRecord,
        torque_constant: f64,
    ) -> Result<Km0Stage2, AxisError> {
        if record.angle.len() < self.set_points.len()
            || record.current.len() < self.set_points.len()
        {
            return Err(AxisError::Parameter {
                what: "the number of samples of the record",
                value: record.angle.len().min(record.current.len()) as f64,
                wanted: "at least that of the signal: is the sample period the same?",
            });
        }
        let (mut steps, mut ramps) = (Vec::new(), Vec::new());
        for (piece, range) in &self.pieces {
            let angle = &record.angle[range.clone()];
            match *piece {
                Piece::Step { from, to } => {
                    let initial = record.angle[range.start - 1];
                    steps.push(self.step(angle, from, to, initial));
                }
                Piece::Ramp { speed } => {
                    let current = &record.current[range.clone()];
                    let asked = &self.set_points[range.clone()];
                    ramps.push(self.ramp(angle, current, asked, speed, torque_constant));
                }
            }
        }
        let friction = fit_friction(&ramps)?;
        Ok(Km0Stage2 {
            steps,
            ramps,
            friction,
        })
    }

    fn step(&self, angle: &[f64], from: f64, to: f64, initial: f64) -> StepRecord {
        let n = angle.len();
        let tail = &angle[n - n / 4..];
        let steady = tail.iter().sum::<f64>() / tail.len() as f64;
        let change = steady - initial;
        let sign = if to >= from { 1.0 } else { -1.0 };
        let peak = angle.iter().fold(f64::MIN, |a, v| a.max(sign * v)) * sign;
        let begun = angle
            .iter()
            .position(|v| (v - initial).abs() > START)
            .unwrap_or(n);
        let outside = angle
            .iter()
            .rposition(|v| (v - steady).abs() > BAND * change.abs());
        StepRecord {
            amplitude_deg: (to - from).to_degrees(),
            steady_from: (n - n / 4) as f64 * self.period,
            steady_deg: steady.to_degrees(),
            start_delay: begun as f64 * self.period,
            overshoot: (100.0 * (peak - steady) / change).max(0.0),
            response_time: outside.map_or(0, |k| k + 1) as f64 * self.period,
            static_error_deg: (to - steady).to_degrees(),
        }
    }

    fn ramp(
        &self,
        angle: &[f64],
        current: &[f64],
        asked: &[f64],
        speed: f64,
        kc: f64,
    ) -> RampRecord {
        let n = angle.len();
        let half = n / 2;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let end = n - 1;
        let steady = (angle[end] - angle[half]) / ((end - half).max(1) as f64 * self.period);
        // the slope over a few samples: differences of single ones are noise
        let span = (n / 50).clamp(1, 20);
        let slope = |k: usize| (angle[k] - angle[k - span]) / (span as f64 * self.period);
        let outside = (span..half)
            .rev()
            .find(|&k| (slope(k) - steady).abs() > BAND * steady.abs());
        let current = mean(&current[half..]);
        RampRecord {
            speed_deg: speed.to_degrees(),
            steady_speed_deg: steady.to_degrees(),
            amplitude_deg: (asked[end] - asked[0]).to_degrees(),
            lag_deg: (asked[end] - angle[end]).to_degrees(),
            speed_response_time: outside.map_or(0, |k| k + 1) as f64 * self.period,
            current,
            torque: kc * current,
        }
    }
}

/// Fits T = B ω + T_P + T_C sgn ω to ramps by least squares.
///
/// # Errors
/// [`AxisError::Parameter`] where there are fewer than four ramps or not in both directions.
pub fn fit_friction(ramps: &[RampRecord]) -> Result<FrictionFit, AxisError> {
    let up = ramps.iter().filter(|r| r.speed_deg > 0.0).count();
    let down = ramps.iter().filter(|r| r.speed_deg < 0.0).count();
    if up < 2 || down < 2 {
        return Err(AxisError::Parameter {
            what: "the number of ramps in one direction",
            value: up.min(down) as f64,
            wanted: "2 or more, at different speeds",
        });
    }
    // each direction is a line T = B ω + c; together: a common slope and two intercepts c = T_P ± T_C
    let point = |r: &RampRecord| (r.steady_speed_deg.to_radians(), r.torque);
    let means = |positive: bool| {
        let side = || {
            ramps
                .iter()
                .filter(move |r| (r.speed_deg > 0.0) == positive)
                .map(point)
        };
        let n = side().count() as f64;
        let (sx, sy) = side().fold((0.0, 0.0), |a, p| (a.0 + p.0, a.1 + p.1));
        (sx / n, sy / n)
    };
    let (above, below) = (means(true), means(false));
    let (mut xx, mut xy, mut all_xx, mut all_xy) = (0.0, 0.0, 0.0, 0.0);
    for r in ramps {
        let (x, y) = point(r);
        let (mx, my) = if r.speed_deg > 0.0 { above } else { below };
        xx += (x - mx) * (x - mx);
        xy += (x - mx) * (y - my);
        all_xx += x * x;
        all_xy += x * y;
    }
    if !(xx > 0.0 && xx.is_finite()) {
        return Err(AxisError::Parameter {
            what: "the spread of the ramps' speeds",
            value: xx,
            wanted: "above zero",
        });
    }
    let viscous = xy / xx;
    let (c_up, c_down) = (above.1 - viscous * above.0, below.1 - viscous * below.0);
    let (bias, coulomb) = (0.5 * (c_up + c_down), 0.5 * (c_up - c_down));
    let alone = all_xy / all_xx;
    let rms = |model: &dyn Fn(f64) -> f64| {
        let sum: f64 = ramps
            .iter()
            .map(|r| (point(r).1 - model(point(r).0)).powi(2))
            .sum();
        (sum / ramps.len() as f64).sqrt()
    };
    Ok(FrictionFit {
        viscous,
        bias,
        coulomb,
        residual: rms(&|w| viscous * w + bias + coulomb * w.signum()),
        residual_viscous: rms(&|w| alone * w),
    })
}

/// How an axis is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rating {
    /// Good.
    Good,
    /// To be watched.
    Watch,
    /// Intervention needed.
    Intervene,
}

/// What a test of an axis found, both stages.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Km0Record {
    /// Machine, head and axis, as the owner names them.
    pub axis: String,
    /// When, as ISO 8601 with zone: written by the caller.
    pub time: String,
    /// Ambient or drive temperature, °C, where known.
    pub temperature: Option<f64>,
    /// Resistance, Ω.
    pub resistance: f64,
    /// Inductance, H.
    pub inductance: f64,
    /// Torque constant, N·m/A.
    pub torque_constant: f64,
    /// Inertia, kg·m².
    pub inertia: f64,
    /// Frequencies of the modes, Hz.
    pub modes: Vec<f64>,
    /// Root mean square of the first stage's fit residuals (complex logarithm), where it was an identification.
    #[serde(default)]
    pub fit_residual: Option<f64>,
    /// The second stage.
    pub stage2: Km0Stage2,
}

/// A quantity that drifted, and what it may mean.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Drift {
    /// Which quantity.
    pub quantity: String,
    /// In the reference test.
    pub reference: f64,
    /// Now.
    pub now: f64,
    /// Relative change.
    pub change: f64,
    /// The part of it that counts: its size, or its growth alone where shrinking is no fault.
    pub size: f64,
    /// From which size on it is to be watched, and from which on to intervene.
    pub limits: (f64, f64),
    /// Its rating.
    pub rating: Rating,
    /// The likely fault.
    pub fault: &'static str,
    /// What to do.
    pub action: &'static str,
}

/// Rates a test against the first accepted one: every quantity with its change, the worst first. The axis' rating is that of
/// the first entry.
pub fn rate(reference: &Km0Record, now: &Km0Record) -> Vec<Drift> {
    let mut drifts = Vec::new();
    let mut add =
        |quantity: &str, a: f64, b: f64, limits: (f64, f64), grows: Grows, fault, action| {
            let change = if a == 0.0 { 0.0 } else { (b - a) / a.abs() };
            let size = match grows {
                Grows::Either => change.abs(),
                Grows::Worse => change.max(0.0),
            };
            let rating = if size < limits.0 {
                Rating::Good
            } else if size < limits.1 {
                Rating::Watch
            } else {
                Rating::Intervene
            };
            drifts.push(Drift {
                quantity: quantity.to_owned(),
                reference: a,
                now: b,
                change,
                size,
                limits,
                rating,
                fault,
                action,
            });
        };
    let driver = "check the coil, its connections and the driver board";
    add(
        "resistance",
        reference.resistance,
        now.resistance,
        (0.10, 0.25),
        Grows::Either,
        "overheating, for instance by an oscillation on a changed mode, or a bad contact",
        driver,
    );
    add(
        "inductance",
        reference.inductance,
        now.inductance,
        (0.10, 0.25),
        Grows::Either,
        "short-circuited turns",
        driver,
    );
    add(
        "torque constant",
        reference.torque_constant,
        now.torque_constant,
        (0.10, 0.25),
        Grows::Either,
        "a demagnetised rotor",
        "check for overheating; replace the galvanometer",
    );
    add(
        "inertia",
        reference.inertia,
        now.inertia,
        (0.03, 0.08),
        Grows::Either,
        "a mirror that is loose, dirty or replaced by another",
        "check the mirror and its mount",
    );
    for (k, (a, b)) in reference.modes.iter().zip(&now.modes).enumerate() {
        add(
            &format!("mode {}", k + 1),
            *a,
            *b,
            (0.03, 0.08),
            Grows::Either,
            "a loose or cracked mirror mount, or a worn bearing",
            "check the mount; the pre-filter and the notch no longer fit the mode",
        );
    }
    let (f, g) = (&reference.stage2.friction, &now.stage2.friction);
    let bearing = (
        "degraded lubrication of the bearings",
        "exercise the axis over its travel; replace the bearings if it stays",
    );
    add(
        "Coulomb torque",
        f.coulomb,
        g.coulomb,
        (0.25, 0.60),
        Grows::Worse,
        bearing.0,
        bearing.1,
    );
    add(
        "viscous coefficient",
        f.viscous,
        g.viscous,
        (0.25, 0.60),
        Grows::Worse,
        bearing.0,
        bearing.1,
    );
    let lag = |r: &Km0Record| {
        r.stage2
            .ramps
            .iter()
            .map(|x| x.lag_deg.abs())
            .fold(0.0, f64::max)
    };
    add(
        "largest lag",
        lag(reference),
        lag(now),
        (0.25, 0.60),
        Grows::Worse,
        "changed gains or pre-filter, or a tired driver",
        "compare the controller's settings with the reference",
    );
    let mean = |r: &Km0Record, of: &dyn Fn(&StepRecord) -> f64| {
        r.stage2.steps.iter().map(of).sum::<f64>() / r.stage2.steps.len().max(1) as f64
    };
    // overshoot in points of the change: a share of a share near zero says nothing
    let over = |r: &Km0Record| 100.0 + mean(r, &|s| s.overshoot);
    add(
        "overshoot",
        over(reference),
        over(now),
        (0.20, 0.50),
        Grows::Worse,
        "less damping: inertia, mode or gains changed",
        "identify the axis again and tune it",
    );
    add(
        "response time",
        mean(reference, &|s| s.response_time),
        mean(now, &|s| s.response_time),
        (0.20, 0.50),
        Grows::Worse,
        "more friction or weaker drive",
        "see the friction and the resistance",
    );
    drifts.sort_by(|a, b| {
        b.rating
            .cmp(&a.rating)
            .then(b.change.abs().total_cmp(&a.change.abs()))
    });
    drifts
}

/// In which direction a change counts.
#[derive(Clone, Copy)]
enum Grows {
    /// Both.
    Either,
    /// Only growth.
    Worse,
}
