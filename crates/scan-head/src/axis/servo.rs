//! A mirror's axis known by its data sheet alone: how far it lags behind a ramp, how fast it speeds up, how fast it turns.
//!
//! Source: ours. At each sample the axis accelerates by ω²(r − θ) − 2ωθ̇ with ω = 2/τ until the next: critically damped, so that it
//! neither overshoots nor waits, and behind a steady ramp by the tracking delay τ, exactly. Acceleration and speed are cut at
//! the data sheet's, and speed at what still stops within what is left, `√(2 a d)`: where the acceleration's limit would let it overshoot
//! it brakes in time. Faster than `2 a τ` it lags behind a ramp by `v²/(2 a)` therefore. Valid for drives whose lag does not depend on what is marked; friction, modes, drift and noise, which data sheets do not tell, are
//! left out: contours come out better than they are where these matter. Drives that look ahead along the path lag otherwise.

use crate::axis::chain::{AxisRecord, RunningAxis, Runs};
use crate::axis::error::{AxisError, not_negative, positive};

/// Fewest samples of a tracking delay for which the law is that of continuous time within some percent.
const FEWEST: f64 = 4.0;
/// For how long a step is followed at the most, in tracking delays.
const LONGEST_STEP: f64 = 2e3;

/// An axis as its data sheet tells it. Angles are those of the mirror.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// Tracking delay: by how much the mirror lags behind a steady ramp, s.
    pub tracking_delay: f64,
    /// Greatest acceleration, rad/s²; infinite for none.
    pub acceleration: f64,
    /// Greatest speed, rad/s.
    pub speed_limit: f64,
    /// Smallest step of set-points, rad; 0 for none.
    pub resolution: f64,
    /// Travel to either side, rad.
    pub travel: f64,
}

/// A servo on its way.
struct Moving {
    servo: Servo,
    period: f64,
    angle: f64,
    speed: f64,
}

impl Moving {
    #[inline]
    fn step(&mut self, set_point: f64) {
        let Servo {
            tracking_delay,
            acceleration,
            speed_limit,
            ..
        } = self.servo;
        let omega = 2.0 / tracking_delay;
        let wanted = omega * (omega * (set_point - self.angle) - 2.0 * self.speed);
        let before = self.speed;
        let after = before + self.period * wanted.clamp(-acceleration, acceleration);
        let after = self.in_time(set_point - self.angle, after);
        self.speed = after.clamp(-speed_limit, speed_limit);
        self.angle += 0.5 * self.period * (before + self.speed);
    }
}

impl Moving {
    /// The speed after a sample, from which the axis can still stop before it has gone what is left, as far as its acceleration allows.
    #[inline]
    fn in_time(&self, left: f64, after: f64) -> f64 {
        let (most, period) = (self.servo.acceleration, self.period);
        let way = left.signum();
        if !most.is_finite() || way * after <= 0.0 {
            return after;
        }
        // with the speed v after the sample: left − period (before + v)/2 = v²/(2 most)
        let before = way * self.speed;
        let free = (left.abs() - 0.5 * period * before).max(0.0);
        let stops = most * ((0.25 * period * period + 2.0 * free / most).sqrt() - 0.5 * period);
        way * (way * after).min(stops.max(before - most * period))
    }
}

impl Runs for Moving {
    fn block(&mut self, set_points: &[f64], record: &mut AxisRecord) {
        record.resize(set_points.len());
        let step = self.servo.resolution;
        for (k, &given) in set_points.iter().enumerate() {
            let set_point = if step > 0.0 {
                (given / step).round() * step
            } else {
                given
            };
            record.reference[k] = set_point;
            record.angle[k] = self.angle;
            self.step(set_point);
        }
    }
}

impl Servo {
    /// Checks every figure.
    ///
    /// # Errors
    /// [`AxisError::Parameter`].
    pub fn check(&self) -> Result<(), AxisError> {
        positive("the tracking delay", self.tracking_delay)?;
        if self.acceleration.is_nan() || self.acceleration <= 0.0 {
            positive("the greatest acceleration", self.acceleration)?;
        }
        positive("the greatest speed", self.speed_limit)?;
        not_negative("the step of set-points", self.resolution)?;
        positive("the travel", self.travel)
    }

    /// The axis at rest at `angle` rad, sampled every `period` s.
    ///
    /// # Errors
    /// [`AxisError::Parameter`]; also for a tracking delay below four sample periods.
    pub fn start(&self, period: f64, angle: f64) -> Result<RunningAxis, AxisError> {
        self.check()?;
        positive("the sample period", period)?;
        if self.tracking_delay < FEWEST * period {
            return Err(AxisError::Parameter {
                what: "the tracking delay",
                value: self.tracking_delay,
                wanted: "at least four sample periods (s): a data sheet's clock is that of the set-points, often 10 µs",
            });
        }
        let moving = Moving {
            servo: *self,
            period,
            angle,
            speed: 0.0,
        };
        Ok(RunningAxis::alone(Box::new(moving), period, self.travel))
    }

    /// Time in which a step of the set-point by `size` rad settles within `tolerance` rad, s; infinite where that takes too long.
    ///
    /// # Errors
    /// As [`Servo::start`].
    pub fn settling(&self, size: f64, tolerance: f64, period: f64) -> Result<f64, AxisError> {
        self.start(period, 0.0)?;
        let mut moving = Moving {
            servo: Servo {
                resolution: 0.0,
                ..*self
            },
            period,
            angle: 0.0,
            speed: 0.0,
        };
        let most = (LONGEST_STEP * self.tracking_delay / period) as usize;
        let mut settled = 0;
        for k in 1..=most {
            moving.step(size);
            if (moving.angle - size).abs() > tolerance {
                settled = k;
            } else if k > 2 * settled + 100 {
                return Ok(settled as f64 * period);
            }
        }
        Ok(f64::INFINITY)
    }

    /// The same axis with the acceleration at which a step of `size` rad settles within `tolerance` rad in `time` s; `None` where the tracking
    /// delay and the speed alone take longer.
    ///
    /// # Errors
    /// As [`Servo::start`].
    pub fn with_step(
        self,
        size: f64,
        tolerance: f64,
        time: f64,
        period: f64,
    ) -> Result<Option<Self>, AxisError> {
        let settles = |acceleration: f64| -> Result<bool, AxisError> {
            let servo = Servo {
                acceleration,
                ..self
            };
            Ok(servo.settling(size, tolerance, period)? <= time)
        };
        if !settles(f64::INFINITY)? {
            return Ok(None);
        }
        // a step cannot be made with less, nor is more than a sample's worth ever asked
        let mut low = size / (time * time);
        let mut high = size / (period * period);
        while high > 1.001 * low {
            let middle = (low * high).sqrt();
            if settles(middle)? {
                high = middle;
            } else {
                low = middle;
            }
        }
        Ok(Some(Servo {
            acceleration: high,
            ..self
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 1e-5;

    fn servo() -> Servo {
        Servo {
            tracking_delay: 250e-6,
            acceleration: f64::INFINITY,
            speed_limit: 100.0,
            resolution: 0.0,
            travel: 0.2,
        }
    }

    #[test]
    fn it_lags_by_its_tracking_delay_behind_a_ramp() {
        let ramp: Vec<f64> = (0..2000).map(|k| 5.0 * PERIOD * f64::from(k)).collect();
        let record = servo().start(PERIOD, 0.0).unwrap().record(&ramp).unwrap();
        let behind = (ramp[1999] - record.angle[1999]) / 5.0;
        assert!((behind - 250e-6).abs() < 1e-9, "{behind}");
    }

    /// Critically damped: 1 − (1 + ωt) e^(−ωt), whatever the limits that are not met.
    #[test]
    fn a_small_step_is_that_of_continuous_time() {
        let record = servo().start(PERIOD, 0.0).unwrap();
        let record = record.record(&[1e-3; 200]).unwrap();
        for (k, angle) in record.angle.iter().enumerate() {
            let u = 8000.0 * PERIOD * k as f64;
            let wanted = 1e-3 * (1.0 - (1.0 + u) * (-u).exp());
            assert!((angle - wanted).abs() < 4e-5, "{k}: {angle} for {wanted}");
        }
        assert!(record.angle.iter().all(|a| *a < 1e-3 * (1.0 + 1e-9)));
    }

    #[test]
    fn limits_are_kept() {
        let limited = Servo {
            acceleration: 2e4,
            speed_limit: 10.0,
            ..servo()
        };
        let steps = vec![0.1; 4000];
        let record = limited.start(PERIOD, 0.0).unwrap().record(&steps).unwrap();
        let speeds: Vec<f64> = record
            .angle
            .windows(2)
            .map(|w| (w[1] - w[0]) / PERIOD)
            .collect();
        let fastest = speeds.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let hardest = speeds
            .windows(2)
            .fold(0.0_f64, |a, w| a.max((w[1] - w[0]).abs() / PERIOD));
        assert!((9.99..=10.0 + 1e-9).contains(&fastest), "{fastest}");
        assert!((1.9e4..=2e4 * (1.0 + 1e-6)).contains(&hardest), "{hardest}");
        assert!((record.angle[3999] - 0.1).abs() < 1e-6);
    }

    /// What stops within an acceleration does not overshoot: neither a step, nor a ramp that ends at speed.
    #[test]
    fn it_brakes_in_time() {
        for (acceleration, speed) in [(2e4, 10.0), (2e4, 100.0), (1e5, 30.0), (5e3, 30.0)] {
            let limited = Servo {
                acceleration,
                speed_limit: speed,
                ..servo()
            };
            let end = 0.1;
            let ramp: Vec<f64> = (0..6000)
                .map(|k| (speed * PERIOD * f64::from(k)).min(end))
                .collect();
            for set_points in [vec![end; 6000], ramp] {
                let record = limited.start(PERIOD, 0.0).unwrap();
                let record = record.record(&set_points).unwrap();
                let most = record.angle.iter().fold(0.0_f64, |a, b| a.max(*b));
                // a tenth of a micrometre behind an objective of 330 mm: the sampling is that of the set-points
                assert!(most < end + 3e-7, "{acceleration} {speed}: {most}");
                assert!((record.angle[5999] - end).abs() < 1e-6);
            }
        }
    }

    /// The acceleration that a data sheet's step tells makes that step.
    #[test]
    fn steps_of_data_sheets_give_the_acceleration() {
        let (size, tolerance, time) = (0.03, 3e-4, 2.5e-3);
        let found = servo().with_step(size, tolerance, time, PERIOD).unwrap();
        let found = found.unwrap();
        let settled = found.settling(size, tolerance, PERIOD).unwrap();
        assert!(settled <= time && settled > 0.9 * time, "{settled}");
        let quicker = Servo {
            acceleration: 2.0 * found.acceleration,
            ..found
        };
        assert!(quicker.settling(size, tolerance, PERIOD).unwrap() < settled);
        // quicker than the delay allows
        assert_eq!(
            servo().with_step(size, tolerance, 3e-4, PERIOD).unwrap(),
            None
        );
    }

    #[test]
    fn set_points_have_steps() {
        let coarse = Servo {
            resolution: 1e-3,
            ..servo()
        };
        let record = coarse.start(PERIOD, 0.0).unwrap();
        let record = record.record(&vec![0.0104; 2000]).unwrap();
        assert!((record.angle[1999] - 0.010).abs() < 1e-9);
    }

    #[test]
    fn figures_without_sense_are_refused() {
        let broken = [
            Servo {
                tracking_delay: 0.0,
                ..servo()
            },
            Servo {
                tracking_delay: 3e-5,
                ..servo()
            },
            Servo {
                acceleration: -1.0,
                ..servo()
            },
            Servo {
                acceleration: f64::NAN,
                ..servo()
            },
            Servo {
                speed_limit: f64::NAN,
                ..servo()
            },
            Servo {
                resolution: -1.0,
                ..servo()
            },
            Servo {
                travel: 0.0,
                ..servo()
            },
        ];
        for servo in broken {
            assert!(servo.start(PERIOD, 0.0).is_err(), "{servo:?}");
        }
    }
}
