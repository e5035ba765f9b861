//! The motor under a held voltage, exact between samples: dry friction turns where the speed does, not at the next sample.
//!
//! Sliding and sticking are linear with constant inputs, so a step without an event is one product with the matrix exponential. Where
//! the rotor stops, turns round or lets go, the step is written as a power series in time and the instant is its root.

use meltpath_control::discretise::{Hold, discretise};
use meltpath_control::{Matrix, StateSpace};

use crate::axis::error::AxisError;
use crate::axis::friction::Friction;
use crate::axis::galvanometer::Galvanometer;

/// Latest that a channel may be read after the motor's time, samples.
pub(super) const LATEST: usize = 16;
/// Terms of the power series over one step: enough for modes up to half the sampling frequency.
const TERMS: usize = 26;
/// Terms of a power series below this share of its largest are rounding.
const ROUNDING: f64 = 1e-19;
/// Stops, turns and starts followed within one step.
const EVENTS: usize = 8;
/// Points of a step at which a change of sign is looked for where one may be.
const GRID: usize = 16;

/// `M` values linear in the state, the voltage and the friction torque: weights of all of them by each, as a processor takes them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Linear<const N: usize, const M: usize> {
    pub(super) state: [[f64; M]; N],
    pub(super) voltage: [f64; M],
    pub(super) torque: [f64; M],
}

impl<const N: usize, const M: usize> Linear<N, M> {
    #[inline(always)]
    fn of(&self, x: &[f64; N], u: f64, t: f64) -> [f64; M] {
        let mut out = [0.0; M];
        for (column, x) in self.state.iter().zip(x) {
            add(&mut out, column, *x);
        }
        add(&mut out, &self.voltage, u);
        add(&mut out, &self.torque, t);
        out
    }

    /// Weighed sums of these values, one of each row of weights.
    fn sums<const S: usize>(&self, weights: &[[f64; M]; S]) -> Linear<N, S> {
        let of = |column: &[f64; M]| weights.each_ref().map(|row| dot(row, column));
        Linear {
            state: self.state.each_ref().map(of),
            voltage: of(&self.voltage),
            torque: of(&self.torque),
        }
    }

    /// Puts a value of another in the place of one of these.
    fn put(&mut self, place: usize, other: &Linear<N, 1>) {
        for (column, [weight]) in self.state.iter_mut().zip(other.state) {
            column[place] = weight;
        }
        self.voltage[place] = other.voltage[0];
        self.torque[place] = other.torque[0];
    }
}

#[inline(always)]
fn add<const M: usize>(out: &mut [f64; M], column: &[f64; M], by: f64) {
    for (out, weight) in out.iter_mut().zip(column) {
        *out += weight * by;
    }
}

/// The motor while it slides, or while it sticks.
#[derive(Debug, Clone)]
pub(super) struct Regime<const N: usize> {
    /// Rates of the state, per second.
    rates: Linear<N, N>,
    /// The state after a whole step.
    pub(super) whole: Linear<N, N>,
    /// What decides on an event, in the middle of a step; current and angle at their instants of the step.
    pub(super) seen: Linear<N, 3>,
    /// Power series of what decides on an event, in the step's share.
    watched: Linear<N, TERMS>,
}

/// A state space with inputs voltage and torque.
fn linear<const N: usize>(a: &Matrix, b: &Matrix) -> Linear<N, N> {
    Linear {
        state: std::array::from_fn(|j| std::array::from_fn(|i| a[(i, j)])),
        voltage: std::array::from_fn(|i| b[(i, 0)]),
        torque: std::array::from_fn(|i| b[(i, 1)]),
    }
}

impl<const N: usize> Regime<N> {
    fn new(
        a: Matrix,
        b: Matrix,
        period: f64,
        watch: &[f64; N],
        read: &[([f64; N], f64); 2],
    ) -> Result<Self, AxisError> {
        let rates = linear(&a, &b);
        let outputs = Matrix::zeros(1, N);
        let motor = StateSpace::continuous(a, b, outputs, Matrix::zeros(1, 2))?;
        let after = |share: f64| -> Result<Linear<N, N>, AxisError> {
            let held = discretise(&motor, share * period, Hold::Zero)?;
            Ok(linear(&held.a, &held.b))
        };
        let at = |weights: &[f64; N], share: f64| -> Result<Linear<N, 1>, AxisError> {
            if share > 0.0 {
                return Ok(after(share)?.sums(&[*weights]));
            }
            Ok(Linear {
                state: weights.map(|weight| [weight]),
                voltage: [0.0],
                torque: [0.0],
            })
        };
        let mut seen = Linear {
            state: [[0.0; 3]; N],
            voltage: [0.0; 3],
            torque: [0.0; 3],
        };
        seen.put(0, &at(watch, 0.5)?);
        seen.put(1, &at(&read[0].0, read[0].1)?);
        seen.put(2, &at(&read[1].0, read[1].1)?);
        Ok(Regime {
            watched: rates.series(watch, period),
            rates,
            whole: after(1.0)?,
            seen,
        })
    }
}

impl<const N: usize> Linear<N, N> {
    /// The power series over a step of a weighed sum of states that have these rates.
    fn series(&self, weights: &[f64; N], period: f64) -> Linear<N, TERMS> {
        let mut out = Linear {
            state: [[0.0; TERMS]; N],
            voltage: [0.0; TERMS],
            torque: [0.0; TERMS],
        };
        let mut term = *weights;
        for k in 0..TERMS {
            for (column, weight) in out.state.iter_mut().zip(&term) {
                column[k] = *weight;
            }
            if k + 1 < TERMS {
                let share = period / (k + 1) as f64;
                let rates = self.sums(&[term.map(|weight| share * weight)]);
                [out.voltage[k + 1]] = rates.voltage;
                [out.torque[k + 1]] = rates.torque;
                term = rates.state.map(|[weight]| weight);
            }
        }
        out
    }
}

/// When the channels of a record are read after the motor's time, s: current, then angle.
pub(super) type Delays = [f64; 2];

/// A motor that is driven by records; `N` = 3 + twice the number of modes.
#[derive(Debug, Clone)]
pub(super) struct Drive<const N: usize> {
    period: f64,
    pub(super) coulomb: f64,
    pub(super) bias: f64,
    slide: Regime<N>,
    stick: Option<Regime<N>>,
    /// Weights of the rotor's speed, and of the torque that would hold it.
    speed: [f64; N],
    hold: [f64; N],
    /// Weights of current and angle; samples by which they come late, and the share of the step at which they are read.
    channels: [([f64; N], usize, f64); 2],
    /// What the ammeter reads where no current flows, A.
    pub(super) zero: f64,
}

#[inline]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl<const N: usize> Drive<N> {
    /// A motor whose record is sampled every `period` s.
    pub(super) fn new(
        motor: &Galvanometer,
        delays: Delays,
        period: f64,
    ) -> Result<Self, AxisError> {
        let (coulomb, bias) = match motor.friction {
            Friction::None => (0.0, 0.0),
            Friction::Coulomb { coulomb, bias } => (coulomb, bias),
            Friction::Karnopp { .. } | Friction::LuGre { .. } => return Err(AxisError::Law),
        };
        let linear = motor.linear()?;
        let speed: [f64; N] = std::array::from_fn(|j| f64::from(j == 1 || j > 3 && j % 2 == 0));
        let angle: [f64; N] = std::array::from_fn(|j| f64::from(j == 2 || j > 2 && j % 2 == 1));
        let current: [f64; N] = std::array::from_fn(|j| f64::from(j == 0));
        // the modes' accelerations, that the rigid part makes up for while the rotor stands still
        let modal: [f64; N] =
            std::array::from_fn(|j| (4..N).step_by(2).map(|i| linear.a[(i, j)]).sum());
        // the rotor's acceleration by a torque on it
        let gives: f64 =
            -(linear.b[(1, 1)] + (4..N).step_by(2).map(|i| linear.b[(i, 1)]).sum::<f64>());
        let hold: [f64; N] = std::array::from_fn(|j| (linear.a[(1, j)] + modal[j]) / gives);
        let channels = [(current, delays[0]), (angle, delays[1])].map(|(weights, delay)| {
            let late = (delay / period).ceil().clamp(0.0, LATEST as f64);
            (
                weights,
                late as usize,
                (late - delay / period).clamp(0.0, 1.0),
            )
        });
        let read = channels.map(|(weights, _, share)| (weights, share));
        let slide = Regime::new(linear.a.clone(), linear.b.clone(), period, &speed, &read)?;
        let stick = if coulomb > 0.0 {
            let (mut a, mut b) = (linear.a, linear.b);
            for i in (1..N).filter(|i| *i == 1 || *i > 2 && i % 2 == 0) {
                for (j, hold) in hold.iter().enumerate() {
                    a[(i, j)] += b[(i, 1)] * hold;
                }
                b[(i, 1)] = 0.0;
            }
            Some(Regime::new(a, b, period, &hold, &read)?)
        } else {
            None
        };
        Ok(Drive {
            period,
            coulomb,
            bias,
            slide,
            stick,
            speed,
            hold,
            channels,
            zero: 0.0,
        })
    }

    /// The same, its current read by an ammeter that shows `zero` A where none flows.
    pub(super) fn read_from(self, zero: f64) -> Self {
        Drive { zero, ..self }
    }

    /// Which way the motor begins to go in a state; where it stays its speed is put to zero.
    pub(super) fn begins(&self, x: &mut [f64; N]) -> f64 {
        match dot(&self.speed, x) {
            _ if !self.turns() => 1.0,
            0.0 => self.way(x),
            speed => speed.signum(),
        }
    }

    /// Whether friction's torque turns with the speed.
    pub(super) fn turns(&self) -> bool {
        self.stick.is_some()
    }

    /// Samples by which a channel comes late.
    pub(super) fn late(&self, channel: usize) -> usize {
        self.channels[channel].1
    }

    /// What moves the rotor that way (0: nothing does), and friction's torque.
    pub(super) fn regime(&self, way: f64) -> (&Regime<N>, f64) {
        match &self.stick {
            Some(stick) if way == 0.0 => (stick, 0.0),
            Some(_) => (&self.slide, self.bias + way * self.coulomb),
            None => (&self.slide, self.bias),
        }
    }

    /// What ends a regime: speed, or the torque that holds.
    pub(super) fn watched(&self, way: f64) -> &[f64; N] {
        if way == 0.0 { &self.hold } else { &self.speed }
    }

    /// Below zero once the rotor has turned, or what holds it does not suffice.
    #[inline]
    fn margin(&self, way: f64, watched: f64) -> f64 {
        if way == 0.0 {
            self.coulomb - (watched - self.bias).abs()
        } else {
            way * watched
        }
    }

    /// Which way a rotor at rest goes; where it stays its speed is put to zero.
    fn way(&self, x: &mut [f64; N]) -> f64 {
        let net = dot(&self.hold, x) - self.bias;
        if net.abs() > self.coulomb {
            return net.signum();
        }
        x[1] -= dot(&self.speed, x);
        0.0
    }

    /// A step with stops, turns or starts: the readings of the channels, the way at its end; nothing where none comes.
    pub(super) fn eventful(
        &self,
        x: &mut [f64; N],
        u: f64,
        mut way: f64,
    ) -> Option<([f64; 2], f64)> {
        let (regime, torque) = self.regime(way);
        let watched = regime.watched.of(x, u, torque);
        let mut first = Some(self.first_below(way, &watched, 1.0)?);
        let mut read = [f64::NAN; 2];
        let mut begin = 0.0;
        for event in 0..=EVENTS {
            let (regime, torque) = self.regime(way);
            let series = self.series(regime, x, u, torque);
            let left = 1.0 - begin;
            let end = first.take().or_else(|| {
                let watched = self.watched(way);
                let mut told = [0.0; TERMS];
                for (told, term) in told.iter_mut().zip(&series) {
                    *told = dot(watched, term);
                }
                (event < EVENTS).then(|| self.first_below(way, &told, left))?
            });
            let until = end.unwrap_or(left);
            let shares = self.channels.each_ref().map(|(_, _, share)| *share);
            let [first_read, second_read, after] =
                values(&series, [shares[0] - begin, shares[1] - begin, until]);
            for (k, state) in [first_read, second_read].iter().enumerate() {
                if shares[k] >= begin && shares[k] <= begin + until {
                    read[k] = dot(&self.channels[k].0, state);
                }
            }
            *x = after;
            begin += until;
            if end.is_none() {
                break;
            }
            way = if way == 0.0 {
                (dot(&self.hold, x) - self.bias).signum()
            } else {
                self.way(x)
            };
        }
        Some((read, way))
    }

    /// The first share up to `left` at which the margin of what is watched, a power series, falls below zero.
    fn first_below(&self, way: f64, watched: &[f64], left: f64) -> Option<f64> {
        // terms beyond these are rounding
        let largest = watched
            .iter()
            .fold(0.0, |most: f64, term| most.max(term.abs()));
        let last = watched
            .iter()
            .rposition(|term| term.abs() > ROUNDING * largest);
        let watched = &watched[..last.map_or(1, |last| last + 1)];
        let margins = on_grid(watched, left).map(|value| self.margin(way, value));
        let after = margins.iter().position(|margin| *margin < 0.0)?;
        let (mut low, mut high) = (grid(after, left), grid(after + 1, left));
        let before = match after {
            0 => self.margin(way, watched[0]),
            after => margins[after - 1],
        };
        // from the chord Newton's steps where they stay between, halves where they do not
        let chord = low + (high - low) * before / (before - margins[after]);
        let mut at = if chord > low && chord < high {
            chord
        } else {
            high
        };
        for _ in 0..60 {
            let [value, slope] = sloped(watched, at);
            let margin = self.margin(way, value);
            if margin < 0.0 {
                high = at;
            } else {
                low = at;
            }
            let falls = match way {
                0.0 => -(value - self.bias).signum() * slope,
                way => way * slope,
            };
            let newton = at - margin / falls;
            let is_newton = newton > low && newton < high;
            let next = if is_newton {
                newton
            } else {
                0.5 * (low + high)
            };
            let step = (next - at).abs();
            at = next;
            // what is left after a step of Newton's is of the order of its square
            if step <= if is_newton { 1e-9 } else { 1e-14 } {
                break;
            }
        }
        Some(at)
    }

    /// The state over a step as a power series in its share, as far as its terms are no rounding.
    fn series(&self, regime: &Regime<N>, x: &[f64; N], u: f64, torque: f64) -> Vec<[f64; N]> {
        let mut terms = Vec::with_capacity(TERMS);
        terms.push(*x);
        let mut largest = x.map(f64::abs);
        let (mut term, mut inputs) = (*x, (u, torque));
        for k in 1..TERMS {
            let share = self.period / k as f64;
            term = regime
                .rates
                .of(&term, inputs.0, inputs.1)
                .map(|rate| share * rate);
            inputs = (0.0, 0.0);
            terms.push(term);
            let mut is_rounding = true;
            for (largest, term) in largest.iter_mut().zip(&term) {
                *largest = largest.max(term.abs());
                is_rounding &= term.abs() <= ROUNDING * *largest;
            }
            if is_rounding {
                break;
            }
        }
        terms
    }
}

/// A power series at shares of the step: side by side, as each waits for its own last term.
fn values<const N: usize, const M: usize>(series: &[[f64; N]], at: [f64; M]) -> [[f64; N]; M] {
    let mut out = [[0.0; N]; M];
    for term in series.iter().rev() {
        for (out, at) in out.iter_mut().zip(&at) {
            for (o, c) in out.iter_mut().zip(term) {
                *o = *o * at + c;
            }
        }
    }
    out
}

/// A scalar power series and its slope at a share of the step.
#[inline]
fn sloped(series: &[f64], at: f64) -> [f64; 2] {
    let (mut out, mut slope) = (0.0, 0.0);
    for term in series.iter().rev() {
        slope = slope * at + out;
        out = out * at + term;
    }
    [out, slope]
}

/// A scalar power series at the points of a grid up to a share of the step.
fn on_grid(series: &[f64], left: f64) -> [f64; GRID] {
    let at: [f64; GRID] = std::array::from_fn(|k| grid(k + 1, left));
    let mut out = [0.0; GRID];
    for term in series.iter().rev() {
        for (o, at) in out.iter_mut().zip(&at) {
            *o = *o * at + term;
        }
    }
    out
}

fn grid(k: usize, left: f64) -> f64 {
    left * k as f64 / GRID as f64
}
