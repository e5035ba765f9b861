//! Motors found in time from records of another simulator: Runge–Kutta steps of a microsecond, turns of the rotor bisected.

use std::time::Instant;

use meltpath_control::prbs::Prbs;
use meltpath_numerics::random::Random;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::{Galvanometer, Mode};
use meltpath_scan_head::identification::joint::{Joint, joint};
use meltpath_scan_head::identification::modes::{ModeSearch, identify_modes};
use meltpath_scan_head::identification::prediction::predict;
use meltpath_scan_head::identification::record::{BenchRecord, Excitation, Method};

use super::reference;

/// Current, rotor's rigid speed and angle, (q, q') of the mode, bristle.
type State = [f64; 6];

/// How friction goes with speed.
#[derive(Clone, Copy)]
enum Law {
    /// Coulomb torque and bias of the motor.
    Coulomb,
    /// Bristles (LuGre) round the motor's Coulomb torque.
    Bristles,
}

/// A rotor and a load on an elastic shaft.
#[derive(Clone, Copy)]
struct Shaft {
    /// The rotor's share of the inertia.
    rotor: f64,
    /// N·m/rad and N·m·s/rad.
    stiffness: f64,
    damping: f64,
    /// Shares of the viscous damping at rotor and load.
    bearings: [f64; 2],
}

/// Speed within which the friction of a rotor on a shaft turns round, rad/s.
const STEEP: f64 = 0.05;

/// A bench with one galvanometer.
struct Bench {
    motor: Galvanometer,
    law: Law,
    /// Rotor and load as two inertias on a shaft, in place of the motor's mode.
    shaft: Option<Shaft>,
    period: f64,
    /// Substeps a sample, and substeps by which current and angle come late.
    substeps: usize,
    late: [usize; 2],
    /// Deviations of current and angle, step of the encoder.
    noise: [f64; 3],
}

impl Bench {
    fn coulomb(&self) -> [f64; 2] {
        match self.motor.friction {
            Friction::Coulomb { coulomb, bias } => [coulomb, bias],
            _ => [0.0, 0.0],
        }
    }

    fn speed(&self, x: &State) -> f64 {
        if self.shaft.is_some() {
            x[1]
        } else {
            x[1] + x[4]
        }
    }

    fn angle(&self, x: &State) -> f64 {
        if self.shaft.is_some() {
            x[2]
        } else {
            x[2] + x[3]
        }
    }

    /// The mode's acceleration.
    fn modal(&self, x: &State) -> f64 {
        self.motor.modes.first().map_or(0.0, |m| {
            m.gain * x[0] - 2.0 * m.damping * m.omega * x[4] - m.omega * m.omega * x[3]
        })
    }

    /// Rates; `way` is that of the sliding rotor, 0 where it sticks.
    fn rates(&self, x: &State, u: f64, way: f64) -> State {
        let m = &self.motor;
        let speed = self.speed(x);
        let current = (u - m.resistance * x[0] - m.back_emf * speed) / m.inductance;
        let drive = m.torque_constant * x[0] - m.viscous * x[1];
        if let Some(Shaft {
            rotor,
            stiffness,
            damping,
            bearings,
        }) = self.shaft
        {
            // x: current, rotor's speed and angle, load's angle and speed
            let (one, two) = (rotor * m.inertia, (1.0 - rotor) * m.inertia);
            let shaft = stiffness * (x[2] - x[3]) + damping * (x[1] - x[4]);
            let torque = m.torque_constant * x[0];
            let [held, holds] = bearings.map(|share| share * m.viscous);
            let load = (shaft - holds * x[4]) / two;
            // friction that rises steeply round standstill, at the rotor
            let [coulomb, bias] = self.coulomb();
            let dry = bias + coulomb * (x[1] / STEEP).tanh();
            return [
                current,
                (torque - held * x[1] - dry - shaft) / one,
                x[1],
                x[4],
                load,
                0.0,
            ];
        }
        let modal = self.modal(x);
        let [coulomb, bias] = self.coulomb();
        let (rigid, bristle) = match self.law {
            Law::Coulomb if way == 0.0 => (-modal, 0.0),
            Law::Coulomb => ((drive - bias - way * coulomb) / m.inertia, 0.0),
            Law::Bristles => {
                let (friction, bristle) = self.bristles(x);
                ((drive - friction) / m.inertia, bristle)
            }
        };
        [current, rigid, x[1], x[4], modal, bristle]
    }

    /// Torque of the bristles and the rate at which they bend.
    fn bristles(&self, x: &State) -> (f64, f64) {
        let [coulomb, bias] = self.coulomb();
        let (stiffness, damping, stribeck) = (0.5, 5e-6, 0.5);
        let speed = self.speed(x);
        let level = coulomb * (1.0 + 0.3 * (-(speed / stribeck).powi(2)).exp());
        let rate = speed - stiffness * speed.abs() * x[5] / level;
        (bias + stiffness * x[5] + damping * rate, rate)
    }

    fn runge_kutta(&self, x: &State, u: f64, way: f64, h: f64) -> State {
        let add = |k: &State, s: f64| -> State { std::array::from_fn(|i| x[i] + s * k[i]) };
        let a = self.rates(x, u, way);
        let b = self.rates(&add(&a, 0.5 * h), u, way);
        let c = self.rates(&add(&b, 0.5 * h), u, way);
        let d = self.rates(&add(&c, h), u, way);
        std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
    }

    /// Which way a rotor at rest goes.
    fn lets_go(&self, x: &State) -> f64 {
        let m = &self.motor;
        let [coulomb, bias] = self.coulomb();
        let net = m.torque_constant * x[0] - m.viscous * x[1] + m.inertia * self.modal(x) - bias;
        if net.abs() > coulomb {
            net.signum()
        } else {
            0.0
        }
    }

    fn advance(&self, x: &mut State, way: &mut f64, u: f64, mut h: f64) {
        if matches!(self.law, Law::Bristles) || self.shaft.is_some() || self.coulomb()[0] == 0.0 {
            *x = self.runge_kutta(x, u, 1.0, h);
            return;
        }
        for _ in 0..6 {
            if *way == 0.0 {
                *x = self.runge_kutta(x, u, 0.0, h);
                *way = self.lets_go(x);
                return;
            }
            let next = self.runge_kutta(x, u, *way, h);
            if *way * self.speed(&next) >= 0.0 {
                *x = next;
                return;
            }
            let (mut low, mut high) = (0.0, h);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if *way * self.speed(&self.runge_kutta(x, u, *way, middle)) < 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            *x = self.runge_kutta(x, u, *way, high);
            h -= high;
            x[1] = -x[4];
            *way = self.lets_go(x);
        }
    }

    /// Voltage, current, angle from rest; the rotor's speed and friction's torque.
    fn record(&self, voltage: Vec<f64>, random: &mut Random) -> ([Vec<f64>; 3], Vec<[f64; 2]>) {
        let h = self.period / self.substeps as f64;
        let (mut x, mut way) = ([0.0; 6], 0.0);
        let [mut current, mut angle] = [Vec::new(), Vec::new()];
        let (mut now, mut friction) = (Vec::new(), Vec::new());
        let [mut i, mut a] = [Vec::new(), Vec::new()];
        for &u in &voltage {
            now.push(current.len());
            friction.push([self.speed(&x), self.bristles(&x).0]);
            for _ in 0..self.substeps {
                current.push(x[0]);
                angle.push(self.angle(&x));
                self.advance(&mut x, &mut way, u, h);
            }
        }
        let [deviation, jitter, step] = self.noise;
        for at in now {
            i.push(current[at.saturating_sub(self.late[0])] + deviation * random.normal());
            let read = angle[at.saturating_sub(self.late[1])] + jitter * random.normal();
            a.push(if step > 0.0 {
                (read / step).round() * step
            } else {
                read
            });
        }
        ([voltage, i, a], friction)
    }
}

/// A binary voltage of about a tenth of a millisecond a bit.
fn voltage(period: f64, amplitude: f64, seconds: f64) -> Vec<f64> {
    let clock = (1e-4 / period).round() as usize;
    Prbs::new(15)
        .unwrap()
        .signal(amplitude, clock, (seconds / period) as usize)
}

fn found(columns: &[Vec<f64>; 3], period: f64) -> Joint {
    found_of(columns, period, ModeSearch::default())
}

/// The motor of a record whose responses are searched for modes in this way.
fn found_of(columns: &[Vec<f64>; 3], period: f64, search: ModeSearch) -> Joint {
    let record = record(columns, period);
    let begin = Instant::now();
    let method = Method::at(period);
    let first = identify_modes(&record, Excitation::Voltage, &method, &search).unwrap();
    println!("responses {:.2} s", begin.elapsed().as_secs_f64());
    joint(&record, &first).unwrap()
}

fn record(columns: &[Vec<f64>; 3], period: f64) -> BenchRecord<'_> {
    BenchRecord {
        period,
        voltage: &columns[0],
        current: &columns[1],
        angle: &columns[2],
    }
}

/// The largest relative error of a two-load motor's parameters, and the largest in stated deviations.
fn two_loads(friction: Friction, period: f64, seconds: f64, volts: f64) -> ([f64; 2], Joint) {
    // bearings that hold each body by its inertia leave rigid turning and mode apart, as the model has them
    let bearings = [0.75, 0.25];
    let rotor = 0.75;
    let plain = Galvanometer {
        friction: Friction::None,
        modes: vec![],
        ..reference::motor()
    };
    let [one, two] = [rotor, 1.0 - rotor].map(|s| s * plain.inertia);
    let (omega, damping) = (std::f64::consts::TAU * 4000.0, 0.015);
    let stiffness = omega * omega * one * two / plain.inertia;
    let shaft = Shaft {
        rotor,
        stiffness,
        damping: 2.0 * damping * stiffness / omega,
        bearings,
    };
    // what the bearings' forces do in the shape of the mode
    let [held, holds] = bearings.map(|share| share * plain.viscous);
    let damping = damping + (held * two / one + holds * one / two) / (2.0 * omega * plain.inertia);
    let bench = Bench {
        shaft: Some(shaft),
        motor: Galvanometer {
            friction,
            ..plain.clone()
        },
        law: Law::Coulomb,
        period,
        substeps: (period / 1e-6).round() as usize,
        late: [0, 0],
        noise: [0.0; 3],
    };
    let (columns, _) = bench.record(voltage(bench.period, volts, seconds), &mut Random::new(1));
    let joint = found(&columns, bench.period);
    let (m, mode) = (&joint.motor, joint.motor.modes[0]);
    let off = [
        ("R", m.resistance, plain.resistance),
        ("L", m.inductance, plain.inductance),
        ("Kc", m.torque_constant, plain.torque_constant),
        ("J", m.inertia, plain.inertia),
        ("B", m.viscous, plain.viscous),
        ("frequency", mode.omega, omega),
        ("damping", mode.damping, damping),
        ("gain", mode.gain * m.inertia / m.torque_constant, two / one),
    ]
    .map(|(what, value, wanted)| {
        println!("{what} off by {:.5} %", 100.0 * (value / wanted - 1.0));
        (value / wanted - 1.0).abs()
    });
    let sigma = joint.sigma.iter().chain(&joint.mode_sigma[0]);
    let stated = off.iter().zip(sigma).map(|(off, sigma)| off / sigma);
    let largest = [
        off.iter().copied().fold(0.0, f64::max),
        stated.fold(0.0, f64::max),
    ];
    (largest, joint)
}

#[test]
fn a_rotor_with_its_load_on_a_shaft_is_found_to_five_parts_in_a_hundred_thousand() {
    let ([off, _], joint) = two_loads(Friction::None, 20e-6, 1.7, 0.8);
    assert!(off < 5e-5, "{off}");
    assert!(joint.coulomb.is_none() && joint.delays.iter().all(|d| d[0].abs() < 1e-9));
}

/// Dry friction acts on the rotor, where the motor's torque does, and shakes the mode as that does; it does not pass for damping.
#[test]
fn friction_at_the_rotor_does_not_pass_for_damping_of_the_mode() {
    let friction = Friction::Coulomb {
        coulomb: 3e-5,
        bias: 0.0,
    };
    let ([off, stated], joint) = two_loads(friction, 50e-6, 0.5, 0.8);
    // what is left is no white noise: the deviations are those of pieces
    assert!(off < 5e-4 && stated < 4.0, "{off} {stated}");
    let [felt, sigma] = joint.felt.unwrap();
    assert!(
        (felt - 1.0).abs() < 3.0 * sigma && sigma < 0.01,
        "{felt} ± {sigma}"
    );
    let [coulomb, sigma] = joint.coulomb.unwrap();
    assert!((coulomb / 3e-5 - 1.0).abs() < 1e-3, "{coulomb}");
    assert!(sigma < 1e-3 * coulomb, "{sigma}");
    for [delay, sigma] in joint.delays {
        assert!(delay.abs() < 1e-8 && sigma < 1e-8, "{delay} ± {sigma}");
    }
}

/// A bench of its own: motor within 30 % of the reference, friction, delays, noise, an encoder of 18 bits on 40°.
fn own(seed: u64, law: Law) -> (Bench, Random) {
    let mut random = Random::new(seed);
    let reference = reference::motor();
    let mut near = |value: f64| value * random.between(0.75, 1.3);
    let (kc, inertia) = (near(reference.torque_constant), near(reference.inertia));
    let mut motor = Galvanometer {
        resistance: near(reference.resistance),
        inductance: near(reference.inductance),
        torque_constant: kc,
        back_emf: kc,
        inertia,
        viscous: near(reference.viscous),
        modes: vec![Mode {
            omega: near(std::f64::consts::TAU * 3600.0),
            damping: near(0.015),
            gain: near(0.3) * kc / inertia,
        }],
        friction: Friction::Coulomb {
            coulomb: near(3e-5),
            bias: 0.0,
        },
        felt: 0.0,
    };
    if let Friction::Coulomb { bias, .. } = &mut motor.friction {
        *bias = random.between(-1e-5, 1e-5);
    }
    let [period, micro] =
        [[50e-6, 50.0], [20e-6, 20.0], [1.0 / 93_750.0, 10.0]][(seed % 3) as usize];
    let late = [0.3, 1.2].map(|most| random.between(0.0, most * micro) as usize);
    let step = 40f64.to_radians() / f64::from(1 << 18);
    let bench = Bench {
        motor,
        law,
        shaft: None,
        period,
        substeps: micro as usize,
        late,
        noise: [5e-4, 5e-6, step],
    };
    (bench, random)
}

/// Length of the records with friction, noise and delays, s.
const SECONDS: f64 = 0.5;

const NAMES: [&str; 13] = [
    "R",
    "L",
    "Kc",
    "J",
    "B",
    "frequency",
    "damping",
    "gain",
    "Coulomb",
    "bias",
    "delay of current",
    "delay of angle",
    "share of friction that the mode feels",
];

/// Errors over stated deviations, and stated deviations over the values; `None` where the mode was not found.
fn trial(seed: u64) -> Option<[[f64; 2]; 13]> {
    let (bench, mut random) = own(seed, Law::Coulomb);
    let (columns, _) = bench.record(voltage(bench.period, 0.8, SECONDS), &mut random);
    let start = Instant::now();
    let joint = found(&columns, bench.period);
    println!(
        "{seed}: {:.0} kHz, {:.2} s, {} modes, over noise {:.3?}, settled {}",
        1e-3 / bench.period,
        start.elapsed().as_secs_f64(),
        joint.motor.modes.len(),
        joint.over_noise(),
        joint.settled
    );
    for peak in &joint.refused {
        println!(
            "{seed}: {:.0} Hz, {:.2} times: {}",
            peak.frequency, peak.ratio, peak.why
        );
    }
    // what is left is noise in every one, mode or not
    assert!(joint.holds(), "{seed}: {:?}", joint.over_noise());
    if joint.motor.modes.is_empty() {
        return None;
    }
    let ratio = |m: &Galvanometer| m.modes[0].gain * m.inertia / m.torque_constant;
    let values = |m: &Galvanometer| {
        [
            m.resistance,
            m.inductance,
            m.torque_constant,
            m.inertia,
            m.viscous,
            m.modes[0].omega,
            m.modes[0].damping,
            ratio(m),
        ]
    };
    let (got, wanted) = (values(&joint.motor), values(&bench.motor));
    let [coulomb, bias] = bench.coulomb();
    let h = bench.period / bench.substeps as f64;
    let rows = std::array::from_fn(|k| {
        let (off, sigma, size) = match k {
            0..5 => ((got[k] / wanted[k]).ln(), joint.sigma[k], 1.0),
            5..8 => ((got[k] / wanted[k]).ln(), joint.mode_sigma[0][k - 5], 1.0),
            8 => (
                joint.coulomb.unwrap()[0] - coulomb,
                joint.coulomb.unwrap()[1],
                coulomb,
            ),
            9 => (joint.bias[0] - bias, joint.bias[1], coulomb),
            10 | 11 => {
                let [delay, sigma] = joint.delays[k - 10];
                (delay - h * bench.late[k - 10] as f64, sigma, bench.period)
            }
            // the bench's mode is driven by the current alone
            _ => {
                let [felt, sigma] = joint.felt.unwrap();
                (felt, sigma, 1.0)
            }
        };
        [off / sigma, sigma / size]
    });
    println!("{seed}: off, stated {rows:.6?}");
    Some(rows)
}

/// Of each sampling frequency three; 14 is one whose mode feels nothing of friction, though a fit can stay where it does; in the
/// responses of 146 a peak of noise once took the mode with it; one piece of 147 was once caught among friction's turns.
/// `MELTPATH_RECORDS=200` takes the records 0 to 199 instead, `50..60` the records 50 to 59: the gate of docs/validation.md, an hour.
fn seeds() -> Vec<u64> {
    match std::env::var("MELTPATH_RECORDS") {
        Ok(wanted) => {
            let (from, to) = wanted.split_once("..").unwrap_or(("0", &wanted));
            (from.parse().unwrap()..to.parse().unwrap()).collect()
        }
        Err(_) => vec![0, 1, 2, 3, 4, 8, 9, 10, 14, 146, 147],
    }
}

#[test]
#[ignore = "minutes on a busy core"]
fn records_of_another_simulator_give_their_motors_within_the_stated_deviations() {
    let all: Vec<_> = seeds().into_iter().map(trial).collect();
    let trials: Vec<_> = all.iter().flatten().collect();
    let count = trials.len() as f64;
    println!("{} of {} records with their mode", trials.len(), all.len());
    assert_eq!(trials.len(), all.len());
    for (k, name) in NAMES.iter().enumerate() {
        let of = |f: &dyn Fn([f64; 2]) -> f64| trials.iter().map(|t| f(t[k])).sum::<f64>() / count;
        let within = of(&|[off, _]| f64::from(off.abs() < 2.0));
        let rms = of(&|[off, _]| off * off).sqrt();
        let far = trials.iter().map(|t| t[k][0].abs()).fold(0.0, f64::max);
        let stated = of(&|[_, sigma]| sigma);
        println!(
            "{name}: {within:.3} within two deviations, rms {rms:.2}, farthest {far:.2}, stated {:.3} %",
            100.0 * stated
        );
        assert!(stated < 0.1, "{name}");
        if count < 100.0 {
            assert!(far < 4.0, "{name}");
        } else {
            assert!(
                (0.9..=0.99).contains(&within) && (0.7..=1.4).contains(&rms.recip()),
                "{name}"
            );
        }
    }
}

/// A mode that the responses did not show is found in what the fit without it leaves of the angle.
#[test]
fn a_mode_is_found_in_what_is_left() {
    let (bench, mut random) = own(0, Law::Coulomb);
    let (columns, _) = bench.record(voltage(bench.period, 0.8, SECONDS), &mut random);
    let none = ModeSearch {
        most: 0,
        ..ModeSearch::default()
    };
    let joint = found_of(&columns, bench.period, none);
    let [(found, sigma)] = [(joint.motor.modes[0], joint.mode_sigma[0])];
    let wanted = bench.motor.modes[0];
    for (found, wanted, sigma) in [
        (found.omega, wanted.omega, sigma[0]),
        (found.damping, wanted.damping, sigma[1]),
    ] {
        let off = (found / wanted).ln() / sigma;
        assert!(off.abs() < 4.0 && sigma < 0.01, "{off} {sigma}");
    }
    assert!(
        joint.motor.modes.len() == 1 && joint.holds(),
        "{:?}",
        joint.over_noise()
    );
}

#[test]
#[ignore = "minutes on a busy core"]
fn under_another_law_the_torque_of_an_unused_record_is_predicted() {
    for seed in 10..11 {
        let (bench, mut random) = own(seed, Law::Bristles);
        let (columns, _) = bench.record(voltage(bench.period, 0.8, SECONDS), &mut random);
        let joint = found(&columns, bench.period);
        let [coulomb, bias] = [joint.coulomb.unwrap()[0], joint.bias[0]];
        let backwards = voltage(bench.period, -0.6, 0.5);
        let (unused, friction) = bench.record(backwards, &mut random);
        let (mut left, mut whole) = (0.0, 0.0);
        for [speed, torque] in friction {
            let told = joint.motor.viscous * speed + bias + coulomb * speed.signum();
            let acts = bench.motor.viscous * speed + torque;
            left += (told - acts).powi(2);
            whole += acts.powi(2);
        }
        let left = f64::sqrt(left / whole);
        let delays = joint.delays.map(|d| d[0]);
        let seen = predict(&joint.motor, delays, &record(&unused, bench.period), 0).unwrap();
        println!(
            "{seed}: friction's torque within {:.1} % of its rms, Coulomb {:?} of {:?}, current {:.4}, angle {:.4}",
            100.0 * left,
            joint.coulomb,
            bench.coulomb(),
            seen.current.fit,
            seen.angle.fit
        );
        println!(
            "J off by {:.2} ± {:.2} %",
            100.0 * (joint.motor.inertia / bench.motor.inertia - 1.0),
            100.0 * joint.sigma[3]
        );
        assert!(left < 0.4 && seen.angle.fit > 0.9, "{left}");
        // the friction that best fits leaves more than noise: that deviations promise nothing is told
        assert!(!joint.holds(), "{:?}", joint.over_noise());
    }
}
