//! The galvanometer in time: the linear part exact under held voltage and torque, friction in closed form.
//!
//! Source of the states: Rasoanarivo 2020, fig. 2.20 (not legible: rebuilt). Over a step the voltage is held and so is the
//! friction torque T. The rotor speed at the end of the step is linear in T, so the one torque T* that would bring the rotor
//! to rest is known; Coulomb's law then says T = T* clamped to its sliding values (J. J. Moreau's time stepping). Where the
//! rotor slides through the whole step T is constant and the step is exact whatever its length; only where it turns round or
//! starts is the step cut into pieces of at most [`LONGEST_PIECE`].

use meltpath_control::discretise::{Hold, discretise};

use crate::axis::error::{AxisError, positive};
use crate::axis::friction::Friction;
use crate::axis::galvanometer::Galvanometer;

/// The longest piece of a step in which the rotor turns round, s.
pub const LONGEST_PIECE: f64 = 2e-6;

/// A step of one length: x⁺ = Φ x + Γ_u U + Γ_t T.
#[derive(Debug, Clone)]
struct Step<const N: usize> {
    /// Columns of Φ.
    phi: [[f64; N]; N],
    voltage: [f64; N],
    torque: [f64; N],
    /// Rotor speed lost at the end of the step per N·m of friction, rad/s.
    braking: f64,
    length: f64,
}

impl<const N: usize> Step<N> {
    fn new(motor: &Galvanometer, length: f64) -> Result<Self, AxisError> {
        let sampled = discretise(&motor.linear()?, length, Hold::Zero)?;
        let column = |m: &meltpath_control::Matrix, j: usize| -> [f64; N] {
            std::array::from_fn(|i| m[(i, j)])
        };
        let torque = column(&sampled.b, 1);
        Ok(Step {
            phi: std::array::from_fn(|j| column(&sampled.a, j)),
            voltage: column(&sampled.b, 0),
            torque,
            braking: -speed(&torque),
            length,
        })
    }

    /// The state at the end of the step with torque `t`.
    #[inline]
    fn end(&self, x: &[f64; N], u: f64, t: f64) -> [f64; N] {
        let mut out: [f64; N] = std::array::from_fn(|r| self.voltage[r] * u + self.torque[r] * t);
        for (column, xc) in self.phi.iter().zip(x) {
            for (o, p) in out.iter_mut().zip(column) {
                *o += p * xc;
            }
        }
        out
    }

    #[inline]
    fn add_torque(&self, x: &mut [f64; N], t: f64) {
        for (x, gain) in x.iter_mut().zip(&self.torque) {
            *x += gain * t;
        }
    }
}

/// Rotor speed: rigid part and modes.
#[inline]
fn speed<const N: usize>(x: &[f64; N]) -> f64 {
    let mut sum = x[1];
    let mut j = 4;
    while j < N {
        sum += x[j];
        j += 2;
    }
    sum
}

/// A galvanometer that runs; `N` = 3 + twice the number of modes.
#[derive(Debug, Clone)]
pub struct Plant<const N: usize> {
    state: [f64; N],
    friction: Friction,
    /// For each step length: the whole step, a piece of it, and how many pieces.
    steps: Vec<(Step<N>, Step<N>, usize)>,
    bristle: f64,
    resting: bool,
}

impl<const N: usize> Plant<N> {
    /// At rest at `angle` rad, to be advanced by steps of the given `lengths`, s.
    ///
    /// # Errors
    /// [`AxisError`] where the motor, a length or the number of modes does not suit.
    pub fn new(motor: &Galvanometer, lengths: &[f64], angle: f64) -> Result<Self, AxisError> {
        motor.check()?;
        if N != 3 + 2 * motor.modes.len() {
            return Err(AxisError::Modes {
                modes: motor.modes.len(),
                most: N.saturating_sub(3) / 2,
            });
        }
        let mut steps = Vec::with_capacity(lengths.len());
        for &length in lengths {
            positive("the step", length)?;
            let pieces = (length / LONGEST_PIECE).ceil().max(1.0) as usize;
            steps.push((
                Step::new(motor, length)?,
                Step::new(motor, length / pieces as f64)?,
                pieces,
            ));
        }
        let mut state = [0.0; N];
        state[2] = angle;
        Ok(Plant {
            state,
            friction: motor.friction,
            steps,
            bristle: 0.0,
            resting: true,
        })
    }

    /// Current, A.
    #[inline]
    pub fn current(&self) -> f64 {
        self.state[0]
    }

    /// Rotor angle, rad.
    #[inline]
    pub fn angle(&self) -> f64 {
        let mut sum = self.state[2];
        let mut j = 3;
        while j < N {
            sum += self.state[j];
            j += 2;
        }
        sum
    }

    /// Rotor speed, rad/s.
    #[inline]
    pub fn speed(&self) -> f64 {
        speed(&self.state)
    }

    /// Advances by step length number `which` under `voltage` V and an outer torque of `disturbance` N·m that opposes
    /// positive motion.
    #[inline]
    pub fn advance(&mut self, which: usize, voltage: f64, disturbance: f64) {
        let (whole, piece, pieces) = &self.steps[which];
        match self.friction {
            Friction::None => self.state = whole.end(&self.state, voltage, disturbance),
            Friction::Coulomb { coulomb, bias } => {
                let before = speed(&self.state);
                let mut next = whole.end(&self.state, voltage, disturbance + bias);
                let stopping = speed(&next) / whole.braking;
                let torque = stopping.clamp(-coulomb, coulomb);
                let slides = torque != stopping;
                // slides all through in one direction, or rests all through
                if (slides && before * torque > 0.0) || (!slides && self.resting) {
                    whole.add_torque(&mut next, torque);
                    self.state = next;
                    self.resting = !slides;
                    return;
                }
                let mut x = self.state;
                let mut resting = false;
                for _ in 0..*pieces {
                    x = piece.end(&x, voltage, disturbance + bias);
                    let stopping = speed(&x) / piece.braking;
                    let torque = stopping.clamp(-coulomb, coulomb);
                    piece.add_torque(&mut x, torque);
                    resting = torque == stopping;
                }
                self.state = x;
                self.resting = resting;
            }
            Friction::Karnopp {
                coulomb,
                stiction,
                rest,
            } => {
                let mut x = self.state;
                for _ in 0..*pieces {
                    let at_rest = speed(&x).abs() < rest;
                    x = piece.end(&x, voltage, disturbance);
                    let stopping = speed(&x) / piece.braking;
                    let torque = if at_rest && stopping.abs() <= coulomb + stiction {
                        stopping
                    } else {
                        stopping.clamp(-coulomb, coulomb)
                    };
                    piece.add_torque(&mut x, torque);
                }
                self.state = x;
            }
            Friction::LuGre {
                coulomb,
                stiction,
                stribeck,
                stiffness,
                damping,
            } => {
                let h = piece.length;
                let mut x = self.state;
                let mut z = self.bristle;
                for _ in 0..*pieces {
                    let omega = speed(&x);
                    let ratio = omega / stribeck;
                    let level = coulomb + (stiction - coulomb) * (-ratio * ratio).exp();
                    // implicit in z, so that a fast slide settles at z = g/σ0 whatever the step
                    let after = (z + h * omega) / (1.0 + h * stiffness * omega.abs() / level);
                    let torque = stiffness * after + damping * (after - z) / h;
                    z = after;
                    x = piece.end(&x, voltage, disturbance + torque);
                }
                self.state = x;
                self.bristle = z;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::galvanometer::example;
    use super::*;

    fn motor(friction: Friction) -> Galvanometer {
        Galvanometer {
            friction,
            ..example()
        }
    }

    /// Fine semi-implicit Euler with the sign function smoothed below 1 mrad/s.
    fn fine(motor: &Galvanometer, voltage: impl Fn(f64) -> f64, end: f64) -> (f64, f64) {
        let Friction::Coulomb { coulomb, bias } = motor.friction else {
            panic!("for Coulomb friction")
        };
        let h = 2e-8;
        let m = motor.modes[0];
        let (mut i, mut w, mut th, mut q, mut v) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let mut t = 0.0;
        while t < end {
            let speed: f64 = w + v;
            let sign = (speed / 1e-3).clamp(-1.0, 1.0);
            i +=
                h * (voltage(t) - motor.resistance * i - motor.back_emf * speed) / motor.inductance;
            let dry = bias + coulomb * sign;
            w += h * (motor.torque_constant * i - motor.viscous * w - dry) / motor.inertia;
            let felt = motor.felt * m.gain * dry / motor.torque_constant;
            v += h * (m.gain * i - felt - 2.0 * m.damping * m.omega * v - m.omega * m.omega * q);
            th += h * w;
            q += h * v;
            t += h;
        }
        (th + q, w + v)
    }

    #[test]
    fn coulomb_steps_agree_with_fine_integration() {
        for felt in [0.0, 1.0] {
            let motor = Galvanometer {
                felt,
                ..motor(Friction::Coulomb {
                    coulomb: 3e-5,
                    bias: 5e-6,
                })
            };
            agrees_with_fine_integration(&motor);
        }
    }

    fn agrees_with_fine_integration(motor: &Galvanometer) {
        let voltage = |t: f64| 0.4 * (t * 700.0).sin();
        let period = 50e-6;
        let mut plant = Plant::<5>::new(motor, &[period], 0.0).unwrap();
        let held = |t: f64| voltage(((t + 1e-9) / period).floor() * period);
        let mut k = 0;
        for end in [2e-3, 5e-3, 10e-3] {
            while f64::from(k) * period < end - 1e-9 {
                plant.advance(0, voltage(f64::from(k) * period), 0.0);
                k += 1;
            }
            let (angle, speed) = fine(motor, held, end);
            assert!(
                (plant.angle() - angle).abs() < 2e-5,
                "{} {angle}",
                plant.angle()
            );
            assert!(
                (plant.speed() - speed).abs() < 3e-2,
                "{} {speed}",
                plant.speed()
            );
        }
    }

    #[test]
    fn friction_holds_below_its_level_and_lets_go_above() {
        for friction in [
            Friction::Coulomb {
                coulomb: 3e-5,
                bias: 0.0,
            },
            Friction::Karnopp {
                coulomb: 3e-5,
                stiction: 1e-5,
                rest: 1e-3,
            },
            Friction::LuGre {
                coulomb: 3e-5,
                stiction: 3.9e-5,
                stribeck: 0.5,
                stiffness: 0.02,
                damping: 2e-6,
            },
        ] {
            let motor = motor(friction);
            let run = |voltage: f64| {
                let mut plant = Plant::<5>::new(&motor, &[10e-6], 0.1).unwrap();
                for _ in 0..5000 {
                    plant.advance(0, voltage, 0.0);
                }
                (plant.angle() - 0.1, plant.speed())
            };
            // torque Kc U/R at rest: 2.2e-5 and 6.6e-5 N·m
            let (held, speed) = run(0.01);
            assert!(
                held.abs() < 4e-3 && speed.abs() < 1e-3,
                "{friction:?} {held} {speed}"
            );
            let (moved, speed) = run(0.03);
            assert!(moved > 0.01 && speed > 0.5, "{friction:?} {moved} {speed}");
        }
    }

    /// The current rises to what friction holds in a third of the step: the rotor rests until then, and slides from then on.
    #[test]
    fn a_rotor_breaks_away_within_a_step_as_it_does_in_short_ones() {
        let motor = motor(Friction::Coulomb {
            coulomb: 3e-5,
            bias: 0.0,
        });
        let moved = |length: f64, steps: u32| {
            let mut plant = Plant::<5>::new(&motor, &[length], 0.0).unwrap();
            for _ in 0..steps {
                plant.advance(0, 0.06, 0.0);
            }
            (plant.angle(), plant.speed())
        };
        let ((angle, speed), (a, s)) = (moved(50e-6, 1), moved(0.5e-6, 100));
        assert!(a > 0.0 && (angle / a - 1.0).abs() < 0.05, "{angle} {a}");
        assert!((speed / s - 1.0).abs() < 0.05, "{speed} {s}");
    }

    #[test]
    fn two_half_steps_are_one_step() {
        let motor = motor(Friction::None);
        let mut one = Plant::<5>::new(&motor, &[20e-6], 0.0).unwrap();
        let mut two = Plant::<5>::new(&motor, &[10e-6], 0.0).unwrap();
        for k in 0..200 {
            let u = f64::from(k % 7) - 3.0;
            one.advance(0, u, 1e-5);
            two.advance(0, u, 1e-5);
            two.advance(0, u, 1e-5);
        }
        assert!((one.angle() - two.angle()).abs() < 1e-12 * one.angle().abs().max(1.0));
    }
}
