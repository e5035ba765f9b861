//! The cascade of an axis in frequency: each loop with its margins, the complete transfer, and what each action brings.
//!
//! Source: Rasoanarivo 2020, § 2.2.2, eq. 2.28-2.33: base motor with modes, friction limited to the viscous one. Regulators are
//! continuous here; [`crate::axis::control`] runs them sample by sample.

use meltpath_control::margins::{MarginAt, Margins, bandwidth};
use meltpath_control::{Complex64, Matrix, StateSpace, SystemError, frequency};
use serde::{Deserialize, Serialize};

use crate::axis::control::{CascadeGains, CurrentGains};
use crate::axis::galvanometer::Galvanometer;
use crate::axis::prefilter::PreFilter;

/// One of the nested loops, from the inside out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loop {
    /// Voltage acts on current.
    Current,
    /// Current set-point acts on speed.
    Speed,
    /// Speed set-point acts on angle.
    Position,
}

impl Loop {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Loop::Current => "Current",
            Loop::Speed => "Speed",
            Loop::Position => "Position",
        }
    }
}

/// How much of the axis stands between set-point and angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Actions<'a> {
    /// The three feedback loops alone.
    Feedback,
    /// With feed-forward of speed and current.
    FeedForward,
    /// With feed-forward behind the pre-filter.
    PreFiltered(&'a PreFilter),
}

/// Figures of an open loop.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LoopFigures {
    /// First crossing of unit gain, rad/s, and the phase margin there, rad.
    pub crossover: MarginAt,
    /// All margins; a mode may make the gain cross one again.
    pub margins: Margins,
}

/// A motor with the gains of its cascade, in frequency. Responses are at a complex pulsation `s`, rad/s; angles count in the
/// unit of the gains.
#[derive(Debug, Clone, Copy)]
pub struct ServoModel<'a> {
    motor: &'a Galvanometer,
    gains: &'a CascadeGains,
}

/// K (1 + 1/(T s)); an infinite T leaves the gain.
pub(super) fn proportional_integral(gain: f64, time: f64, s: Complex64) -> Complex64 {
    gain * (1.0 + time.recip() / s)
}

/// 1 + T s/(1 + T s/100).
pub(super) fn lead(time: f64, s: Complex64) -> Complex64 {
    1.0 + time * s / (1.0 + time / 100.0 * s)
}

/// The closed current loop, set-point to current.
pub(super) fn current_loop(motor: &Galvanometer, gains: &CurrentGains, s: Complex64) -> Complex64 {
    let open =
        proportional_integral(gains.gain, gains.integral_time, s) * motor.current_over_voltage(s);
    open / (1.0 + open)
}

impl<'a> ServoModel<'a> {
    /// The cascade round a motor.
    pub fn new(motor: &'a Galvanometer, gains: &'a CascadeGains) -> Self {
        ServoModel { motor, gains }
    }

    /// Speed over current in the controller's unit (eq. 2.29).
    fn speed_over_current(&self, s: Complex64) -> Complex64 {
        self.motor.speed_over_current(s) * self.gains.unit.per_radian()
    }

    fn speed_regulator(&self, s: Complex64) -> Complex64 {
        proportional_integral(self.gains.speed_gain, self.gains.speed_integral_time, s)
    }

    fn position_regulator(&self, s: Complex64) -> Complex64 {
        self.gains.position_gain * lead(self.gains.position_derivative_time, s)
    }

    /// The open loop of one regulator with its inner loops closed.
    ///
    /// ```
    /// use meltpath_scan_head::servo::model::{Loop, ServoModel};
    /// use meltpath_scan_head::servo::synthesis::{tune, Targets};
    /// # use meltpath_scan_head::axis::galvanometer::{Galvanometer, Mode};
    /// # let (kc, j) = (6.17e-3, 4.530_873_193e-8);
    /// # let motor = Galvanometer { resistance: 2.79, inductance: 180e-6, torque_constant: kc, back_emf: kc, inertia: j,
    /// #     viscous: 3e-6, friction: Default::default(), felt: 0.0,
    /// #     modes: vec![Mode { omega: 25_132.74, damping: 0.015, gain: 0.3 * kc / j }] };
    /// let gains = tune(&motor, &Targets::default(), 50e-6).unwrap().gains;
    /// let open = ServoModel::new(&motor, &gains).open(Loop::Position, meltpath_control::Complex64::new(0.0, 3000.0));
    /// assert!((open.norm() - 1.0).abs() < 1e-9);
    /// ```
    pub fn open(&self, which: Loop, s: Complex64) -> Complex64 {
        match which {
            Loop::Current => {
                let current = self.gains.current;
                proportional_integral(current.gain, current.integral_time, s)
                    * self.motor.current_over_voltage(s)
            }
            Loop::Speed => {
                self.speed_regulator(s) * self.closed(Loop::Current, s) * self.speed_over_current(s)
            }
            Loop::Position => self.position_regulator(s) * self.closed(Loop::Speed, s) / s,
        }
    }

    /// A closed loop, feedback alone: H_i/iref, H_ω/ωref or θ/θref.
    pub fn closed(&self, which: Loop, s: Complex64) -> Complex64 {
        let open = self.open(which, s);
        open / (1.0 + open)
    }

    /// Angle over set-point (eq. 2.32-2.33).
    pub fn complete(&self, actions: Actions, s: Complex64) -> Complex64 {
        let speed = self.closed(Loop::Speed, s);
        let back = self.position_regulator(s) * speed;
        let forward = match actions {
            Actions::Feedback => Complex64::default(),
            Actions::FeedForward | Actions::PreFiltered(_) => {
                let ff = &self.gains.feed_forward;
                let derivative = s / (1.0 + ff.filter * s);
                let inner = self.closed(Loop::Current, s) * self.speed_over_current(s);
                let into_current = inner / (1.0 + self.speed_regulator(s) * inner);
                let inertia = ff.inertia_over_torque / self.gains.unit.per_radian();
                ff.speed * derivative * speed
                    + ff.current * inertia * derivative * derivative * into_current
            }
        };
        let filter = match actions {
            Actions::PreFiltered(filter) => filter.response(s),
            _ => Complex64::new(1.0, 0.0),
        };
        filter * (back + forward) / (s + back)
    }

    /// Angle over a disturbing torque that is told as current (in the gains' unit, per A), feedback alone: how soft the axis is.
    pub fn compliance(&self, s: Complex64) -> Complex64 {
        let speed = self.speed_over_current(s) / (1.0 + self.open(Loop::Speed, s));
        speed / (s * (1.0 + self.open(Loop::Position, s)))
    }

    /// The largest compliance at any frequency, in the gains' unit per A.
    pub fn softest(&self) -> f64 {
        let at = |w: f64| self.compliance(Complex64::new(0.0, w)).norm();
        self.grid().into_iter().map(at).fold(0.0, f64::max)
    }

    /// Frequencies (rad/s) that resolve the loops of this motor.
    pub fn grid(&self) -> Vec<f64> {
        grid_for(self.motor)
    }

    /// Crossover and margins of a loop; none where its gain never crosses one.
    pub fn figures(&self, which: Loop) -> Option<LoopFigures> {
        let margins = Margins::of(|w| self.open(which, Complex64::new(0.0, w)), &self.grid());
        Some(LoopFigures {
            crossover: *margins.phase.first()?,
            margins,
        })
    }

    /// The pulsation (rad/s) from which the complete transfer stays 3 dB below one at first; none where it never falls.
    pub fn bandwidth(&self, actions: Actions) -> Option<f64> {
        let mut grid = self.grid();
        // gains are read against one, which the transfer is at rest
        grid.insert(0, 0.0);
        bandwidth(
            |w| {
                if w == 0.0 {
                    Complex64::new(1.0, 0.0)
                } else {
                    self.complete(actions, Complex64::new(0.0, w))
                }
            },
            &grid,
        )
    }

    /// The whole feedback with feed-forward as a linear system: set-point to angle (both in the gains' unit), current (A)
    /// and voltage (V). Its poles decide on stability.
    ///
    /// # Errors
    /// [`SystemError`] where a parameter is not finite.
    pub fn closed_loop(&self) -> Result<StateSpace, SystemError> {
        self.system(Loop::Position)?.select(&[0, 1, 2], &[0])
    }

    /// One loop closed with those inside it, as a linear system: its set-point to what it controls, current (A), speed or angle
    /// (in the gains' unit). The position loop has its feed-forward.
    ///
    /// # Errors
    /// [`SystemError`] where a parameter is not finite.
    pub fn loop_system(&self, which: Loop) -> Result<StateSpace, SystemError> {
        let output = match which {
            Loop::Current => 1,
            Loop::Speed => 3,
            Loop::Position => 0,
        };
        self.system(which)?.select(&[output], &[0])
    }

    /// Set-point of a loop to angle, current, voltage, speed.
    fn system(&self, entry: Loop) -> Result<StateSpace, SystemError> {
        let plant = self.motor.linear()?;
        let n = plant.order();
        let g = self.gains;
        let unit = g.unit.per_radian();
        let ff = &g.feed_forward;
        let tau = ff.filter;
        let lead_filter = g.position_derivative_time / 100.0;
        let inertia = ff.inertia_over_torque / unit;
        let through = |filter: f64, change: f64| if filter > 0.0 { change / filter } else { 0.0 };
        // states after the motor's: current integral, speed integral, lead filter, two feed-forward filters
        let regulators = match entry {
            Loop::Current => 1,
            Loop::Speed => 2,
            Loop::Position => 5,
        };
        let law = |x: &[f64], reference: f64| -> (Vec<f64>, [f64; 4]) {
            let dot = |row: usize| -> f64 { (0..n).map(|k| plant.c[(row, k)] * x[k]).sum() };
            let own = |k: usize| x.get(n + k).copied().unwrap_or(0.0);
            let (current, angle, speed) = (dot(0), dot(1) * unit, dot(2) * unit);
            let error = reference - angle;
            let error_slope = through(lead_filter, error - own(2));
            let slope = through(tau, reference - own(3));
            let bend = through(tau, slope - own(4));
            let wanted_speed = match entry {
                Loop::Position => {
                    g.position_gain * (error + g.position_derivative_time * error_slope)
                        + ff.speed * slope
                }
                _ => reference,
            };
            let speed_error = wanted_speed - speed;
            let fed = match entry {
                Loop::Position => ff.current * inertia * bend,
                _ => 0.0,
            };
            let wanted_current = match entry {
                Loop::Current => reference,
                _ => g.speed_gain * (speed_error + own(1) / g.speed_integral_time) + fed,
            };
            let current_error = wanted_current - current;
            let voltage = g.current.gain * (current_error + own(0) / g.current.integral_time);
            let mut rate: Vec<f64> = (0..n)
                .map(|i| {
                    let own: f64 = (0..n).map(|k| plant.a[(i, k)] * x[k]).sum();
                    own + plant.b[(i, 0)] * voltage
                })
                .collect();
            let rates = [current_error, speed_error, error_slope, slope, bend];
            rate.extend(&rates[..regulators]);
            (rate, [angle, current, voltage, speed])
        };
        // a linear law is known by what it does to the unit vectors
        let size = n + regulators;
        let columns: Vec<(Vec<f64>, [f64; 4])> = (0..=size)
            .map(|j| {
                let x: Vec<f64> = (0..size).map(|i| f64::from(u8::from(i == j))).collect();
                law(&x, f64::from(u8::from(j == size)))
            })
            .collect();
        StateSpace::continuous(
            Matrix::from_fn(size, size, |i, j| columns[j].0[i]),
            Matrix::from_fn(size, 1, |i, _| columns[size].0[i]),
            Matrix::from_fn(4, size, |i, j| columns[j].1[i]),
            Matrix::from_fn(4, 1, |i, _| columns[size].1[i]),
        )
    }
}

/// Frequencies (rad/s) from 1 to 10⁶ that resolve the modes of a motor.
pub(super) fn grid_for(motor: &Galvanometer) -> Vec<f64> {
    let mut grid = frequency::logarithmic(1.0, 1e6, 1200);
    for mode in &motor.modes {
        grid.extend(frequency::logarithmic(
            0.9 * mode.omega,
            1.1 * mode.omega,
            400,
        ));
    }
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::galvanometer::example;

    /// A peak is 2ξω wide: on either side of it frequencies lie nearer than that, for modes damped by a tenth of a percent.
    #[test]
    fn the_grid_resolves_modes_on_both_sides() {
        let omega = 25_000.0;
        let mut motor = example();
        motor.modes[0].omega = omega;
        motor.modes[0].damping = 1e-3;
        let grid = grid_for(&motor);
        assert!((grid[0] - 1.0).abs() < 1e-9 && (grid[grid.len() - 1] / 1e6 - 1.0).abs() < 1e-9);
        for pair in grid.windows(2) {
            assert!(pair[0] < pair[1]);
            if pair[0] > 0.901 * omega && pair[1] < 1.099 * omega {
                assert!(pair[1] - pair[0] < 2e-3 * omega, "{pair:?}");
            }
        }
    }
}
