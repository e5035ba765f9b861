//! Motors found again from simulated bench records.

use meltpath_control::prbs::Prbs;
use meltpath_control::welch::Welch;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::axis::plant::Plant;
use meltpath_scan_head::identification::error::IdentificationError;
use meltpath_scan_head::identification::friction::{SteadyRamp, friction_of_ramps};
use meltpath_scan_head::identification::modes::{ModeSearch, identify_modes};
use meltpath_scan_head::identification::motor::{Identified, identify};
use meltpath_scan_head::identification::prediction::predict;
use meltpath_scan_head::identification::ramps::steady_ramps;
use meltpath_scan_head::identification::record::{BenchRecord, Excitation, Method};
use meltpath_scan_head::identification::refusal::Refusal;
use meltpath_scan_head::identification::responses::responses;
use meltpath_scan_head::identification::transfers::{Transfers, motor_of};
use meltpath_scan_head::servo::compare::run;
use proptest::prelude::*;

use super::reference;

const PERIOD: f64 = 50e-6;

/// Voltage, current, angle of `motor` from rest under a binary sequence of `amplitude` V and 13 stages.
fn from_rest(motor: &Galvanometer, amplitude: f64, periods: usize) -> [Vec<f64>; 3] {
    let sequence = Prbs::new(13).unwrap();
    let voltage = sequence.signal(amplitude, 1, periods * sequence.period());
    let mut plant = Plant::<5>::new(motor, &[PERIOD], 0.0).unwrap();
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for &u in &voltage {
        for (column, value) in columns.iter_mut().zip([u, plant.current(), plant.angle()]) {
            column.push(value);
        }
        plant.advance(0, u, 0.0);
    }
    columns
}

/// The same without the first period.
fn bench(motor: &Galvanometer, amplitude: f64, periods: usize) -> [Vec<f64>; 3] {
    let period = Prbs::new(13).unwrap().period();
    from_rest(motor, amplitude, periods).map(|c| c[period..].to_vec())
}

fn record(columns: &[Vec<f64>; 3]) -> BenchRecord<'_> {
    BenchRecord {
        period: PERIOD,
        voltage: &columns[0],
        current: &columns[1],
        angle: &columns[2],
    }
}

/// R, L, Kc, J, B over those of `true_one`, less one.
fn off(found: &Galvanometer, true_one: &Galvanometer) -> [f64; 5] {
    let of = |m: &Galvanometer| {
        [
            m.resistance,
            m.inductance,
            m.torque_constant,
            m.inertia,
            m.viscous,
        ]
    };
    let (a, b) = (of(found), of(true_one));
    std::array::from_fn(|i| a[i] / b[i] - 1.0)
}

/// The reference motor without dry friction.
fn smooth() -> Galvanometer {
    Galvanometer {
        friction: Friction::None,
        ..reference::motor()
    }
}

#[test]
fn lpbf_ac09_direct_identification_of_the_reference_motor() {
    let motor = smooth();
    let columns = bench(&motor, 0.5, 12);
    let found = identify(&record(&columns), Excitation::Voltage, &Method::default()).unwrap();
    let off = off(&found.motor, &motor);
    println!(
        "R, L, Kc, J, B off by {off:.4?}, deviations {:.4?}, rms {:.4}",
        found.sigma, found.rms
    );
    for (error, most) in off.into_iter().zip([0.02, 0.08, 0.02, 0.02, 0.05]) {
        assert!(error.abs() < most, "{off:?}");
    }
    // a record that it has not seen, from rest: another amplitude, reversed
    let unseen = from_rest(&motor, -0.3, 2);
    let quality = predict(&found.motor, [0.0; 2], &record(&unseen), 0).unwrap();
    println!(
        "prediction: current {:.4}, angle {:.4}",
        quality.current.fit, quality.angle.fit
    );
    assert!(quality.current.fit > 0.9, "{:?}", quality.current);
    assert!(quality.angle.fit > 0.9, "{:?}", quality.angle);
}

fn with_modes(columns: &[Vec<f64>; 3], method: &Method) -> Identified {
    let search = ModeSearch::default();
    identify_modes(&record(columns), Excitation::Voltage, method, &search).unwrap()
}

/// An encoder on the load sees the mode with a negative gain, which no motor here has: that is what is said of it.
#[test]
fn a_mode_that_is_seen_beyond_its_spring_is_told() {
    let mut motor = smooth();
    motor.modes[0].gain = -motor.modes[0].gain;
    let frequency = motor.modes[0].omega / std::f64::consts::TAU;
    let found = with_modes(&bench(&motor, 0.5, 6), &Method::default());
    let told = found.refused.iter();
    let told: Vec<_> = told.filter(|p| p.why == Refusal::Opposed).collect();
    assert!(
        told.iter()
            .any(|p| (p.frequency / frequency - 1.0).abs() < 0.05),
        "{:?}",
        found.refused
    );
}

#[test]
fn flexible_modes_are_found_with_all_parameters() {
    let motor = smooth();
    let columns = bench(&motor, 0.5, 12);
    let method = Method::default();
    let found = with_modes(&columns, &method);
    println!(
        "R, L, Kc, J, B off by {:.5?}; modes {:?} ± {:?}, rms {:.4}",
        off(&found.motor, &motor),
        found.motor.modes,
        found.mode_sigma,
        found.rms
    );
    assert_eq!(found.motor.modes.len(), 1);
    let (got, wanted) = (found.motor.modes[0], motor.modes[0]);
    assert!((got.omega / wanted.omega - 1.0).abs() < 2e-3);
    assert!((got.damping / wanted.damping - 1.0).abs() < 0.1);
    assert!((got.gain / wanted.gain - 1.0).abs() < 0.1);
    // a whole model leaves nothing for the rigid parameters to make up for
    for (error, most) in off(&found.motor, &motor)
        .into_iter()
        .zip([0.01, 0.02, 0.02, 0.02, 0.05])
    {
        assert!(error.abs() < most);
    }
    let unseen = from_rest(&motor, -0.3, 2);
    let rigid = identify(&record(&columns), Excitation::Voltage, &method).unwrap();
    let with = predict(&found.motor, [0.0; 2], &record(&unseen), 0).unwrap();
    let without = predict(&rigid.motor, [0.0; 2], &record(&unseen), 0).unwrap();
    println!(
        "unseen current: {:.4} rigid, {:.4} with the mode",
        without.current.fit, with.current.fit
    );
    assert!(with.current.rms < 0.5 * without.current.rms);
    // a rigid motor has none
    let rigid = Galvanometer {
        modes: Vec::new(),
        ..motor
    };
    let sequence = Prbs::new(13).unwrap();
    let voltage = sequence.signal(0.5, 1, 6 * sequence.period());
    let mut plant = Plant::<3>::new(&rigid, &[PERIOD], 0.0).unwrap();
    let mut columns = [voltage, Vec::new(), Vec::new()];
    for k in 0..columns[0].len() {
        let (i, a) = (plant.current(), plant.angle());
        columns[1].push(i);
        columns[2].push(a);
        plant.advance(0, columns[0][k], 0.0);
    }
    let found = with_modes(&columns, &method);
    assert!(found.motor.modes.is_empty(), "{:?}", found.motor.modes);
}

/// AC-11 (R): Hann estimate of θ/i, 5 Hz to 1 kHz, median absolute error.
#[test]
fn lpbf_ac11_estimate_of_angle_over_current() {
    let motor = smooth();
    let columns = bench(&motor, 0.5, 12);
    let method = Method {
        band: [5.0, 1000.0],
        ..Method::default()
    };
    let (angle, _) = responses(&record(&columns), Excitation::Voltage, &method).unwrap();
    let mut errors: Vec<f64> = angle
        .iter()
        .map(|p| {
            let s = meltpath_control::Complex64::new(0.0, p.omega);
            let model = motor.speed_over_current(s) / s;
            (20.0 * (p.response / model).norm().log10()).abs()
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    println!("median error {median:.4} dB");
    assert!(median < 0.05, "{median} dB");
}

/// AC-10 (T): the same parameters through the closed loop of the three-axis head, set-point excited; what reaches the motor is weaker at
/// high frequency than in the direct case.
#[test]
fn lpbf_ac10_indirect_identification_through_the_closed_loop() {
    let head = reference::three_axis();
    let mut axis = head.mirrors[0].motor().unwrap().clone();
    axis.motor.friction = Friction::None;
    let sequence = Prbs::new(15).unwrap();
    let count = 12 * sequence.period();
    let set_points = sequence.signal(0.2f64.to_radians(), 1, count);
    let done = run(&axis, &set_points, head.period, 1).unwrap();
    let first = sequence.period();
    let closed = BenchRecord {
        period: head.period,
        voltage: &done.voltage[first..],
        current: &done.current[first..],
        angle: &done.angle[first..],
    };
    let excitation = Excitation::SetPoint(&set_points[first..]);
    // whole periods of the sequence: nothing leaks
    let method = Method {
        welch: Welch::periods(first),
        ..Method::default()
    };
    for (name, method) in [
        ("Hann", &Method::at(head.period)),
        ("whole periods", &method),
    ] {
        let found = identify(&closed, excitation, method).unwrap();
        println!(
            "closed loop, {name}: R, L, Kc, J, B off by {:.4?}, deviations {:.4?}",
            off(&found.motor, &axis.motor),
            found.sigma
        );
    }
    let found = identify(&closed, excitation, &method).unwrap();
    for error in off(&found.motor, &axis.motor) {
        assert!(error.abs() < 0.1, "{error}");
    }
    let modes = identify_modes(&closed, excitation, &method, &ModeSearch::default()).unwrap();
    println!("modes {:?} of {:?}", modes.motor.modes, axis.motor.modes);
    // the share of the voltage's power from 10 kHz on: a binary voltage spreads evenly, the closed loop does not
    let share = |signal: &[f64]| {
        let n = signal.len();
        let rough: f64 = (2..n)
            .map(|k| (signal[k] - 2.0 * signal[k - 1] + signal[k - 2]).powi(2))
            .sum();
        let power: f64 = signal.iter().map(|v| v * v).sum();
        rough / power
    };
    let direct = sequence.signal(1.0, 1, count);
    println!(
        "second differences over power: {:.4} closed, {:.4} direct",
        share(closed.voltage),
        share(&direct)
    );
    assert!(share(closed.voltage) < 0.3 * share(&direct));
    // and a record that it has not seen: another amplitude and sequence
    let other = Prbs::new(13).unwrap();
    let drawn = other.signal(-0.1f64.to_radians(), 3, 3 * 3 * other.period());
    let unseen = run(&axis, &drawn, head.period, 1).unwrap();
    let quality = predict(
        &modes.motor,
        [0.0; 2],
        &BenchRecord {
            period: head.period,
            voltage: &unseen.voltage,
            current: &unseen.current,
            angle: &unseen.angle,
        },
        0,
    )
    .unwrap();
    println!(
        "unseen: current {:.4}, angle {:.4}",
        quality.current.fit, quality.angle.fit
    );
    assert!(quality.current.fit > 0.8, "{:?}", quality.current);
}

#[test]
fn lpbf_ac06_friction_from_ramps_without_noise() {
    let (kc, b, tp, tc) = (6.17e-3, 3e-6, 5e-6, 3e-5);
    let ramps: Vec<SteadyRamp> = [-8.0, -4.0, -1.0, -0.2, 0.2, 1.0, 4.0, 8.0]
        .map(|speed: f64| SteadyRamp {
            speed,
            current: (b * speed + tp + tc * speed.signum()) / kc,
            sigma: None,
        })
        .to_vec();
    let found = friction_of_ramps(&ramps, kc).unwrap();
    for (value, wanted) in [
        (found.viscous[0], b),
        (found.bias[0], tp),
        (found.coulomb[0], tc),
    ] {
        assert!((value / wanted - 1.0).abs() < 1e-6, "{found:?}");
    }
    let one_way = friction_of_ramps(&ramps[4..], kc).unwrap_err();
    assert!(matches!(
        one_way,
        IdentificationError::Ramps { backward: 0, .. }
    ));
}

#[test]
fn lpbf_ac05_dry_friction_fits_ramps_that_viscous_alone_does_not() {
    // ramps of the reference motor, held at their speed by an ideal speed loop: the current is read in its steady part
    let motor = reference::motor();
    let kc = motor.torque_constant;
    let ramps: Vec<SteadyRamp> = [-500.0, -200.0, -50.0, -10.0, 10.0, 50.0, 200.0, 500.0]
        .map(|degrees: f64| {
            let speed = degrees.to_radians();
            SteadyRamp {
                speed,
                current: steady_current(&motor, speed),
                sigma: None,
            }
        })
        .to_vec();
    let found = friction_of_ramps(&ramps, kc).unwrap();
    assert!(found.rms_viscous_only > 3.0 * found.rms, "{found:?}");
    // the torque does not vanish with the speed
    assert!(found.coulomb[0] > 10.0 * found.coulomb[1], "{found:?}");
    assert!(
        (found.viscous[0] / motor.viscous - 1.0).abs() < 0.05,
        "{found:?}"
    );
}

/// Current at constant speed under a stiff integral speed loop, mean of the last quarter.
fn steady_current(motor: &Galvanometer, speed: f64) -> f64 {
    let mut plant = Plant::<5>::new(motor, &[PERIOD], 0.0).unwrap();
    let (mut integral, mut sum, n) = (0.0, 0.0, 40_000);
    for k in 0..n {
        let error = speed - plant.speed();
        integral += 0.5 * error * PERIOD;
        let voltage = motor.back_emf * speed + 2e-3 * error + integral;
        plant.advance(0, voltage, 0.0);
        if 4 * k >= 3 * n {
            sum += plant.current();
        }
    }
    sum / f64::from(n / 4)
}

#[test]
fn what_no_motor_does_is_named() {
    let motor = smooth();
    let [u, i, a] = bench(&motor, 0.5, 4);
    let short = BenchRecord {
        angle: &a[1..],
        period: PERIOD,
        voltage: &u,
        current: &i,
    };
    let error = identify(&short, Excitation::Voltage, &Method::default()).unwrap_err();
    assert!(error.to_string().contains("the angle"), "{error}");
    let narrow = Method {
        band: [5.0, 6.0],
        ..Method::default()
    };
    let error = identify(&record(&[u, i, a]), Excitation::Voltage, &narrow).unwrap_err();
    assert!(matches!(error, IdentificationError::Band { .. }), "{error}");
}

/// The two transfers of a motor (eqs. 2.8, 2.9), its modes and dry friction left out; none where the electric and mechanical
/// poles of current over voltage are complex, or without viscous damping.
fn transfers_of(motor: &Galvanometer) -> Option<Transfers> {
    let tau1 = motor.inertia / motor.viscous;
    let gain = 1.0 / (motor.resistance + motor.torque_constant * motor.back_emf / motor.viscous);
    let sum = gain * (motor.resistance * tau1 + motor.inductance);
    let product = gain * motor.inductance * tau1;
    let root = (sum * sum - 4.0 * product).sqrt();
    let slow = 0.5 * (sum + root);
    let found = Transfers {
        angle_gain: motor.torque_constant / motor.viscous,
        mechanical: tau1,
        current_gain: gain,
        // the product, not the difference, gives the fast lag without cancellation
        lags: [slow, product / slow],
    };
    (root.is_finite() && tau1.is_finite()).then_some(found)
}

proptest! {
    #[test]
    fn lpbf_ac01_parameters_from_transfers(r in 0.5f64..5.0, l in 5e-5f64..5e-4, k in 2e-3f64..2e-2, j in 2e-8f64..4e-7, b in 1e-6f64..2e-5) {
        let motor = Galvanometer {
            resistance: r,
            inductance: l,
            torque_constant: k,
            back_emf: k,
            inertia: j,
            viscous: b,
            modes: vec![],
            friction: Friction::None,
            felt: 0.0,
        };
        let Some(transfers) = transfers_of(&motor) else {
            // complex poles
            return Ok(());
        };
        let again = motor_of(&transfers).unwrap();
        for error in off(&again, &motor) {
            prop_assert!(error.abs() < 1e-9, "{error}");
        }
    }
}

/// The motor and its modes from a record whose angles are multiples of `step` rad.
fn on_encoder(motor: &Galvanometer, step: f64) -> Identified {
    let mut columns = bench(motor, 0.5, 12);
    for angle in &mut columns[2] {
        *angle = (*angle / step).round() * step;
    }
    with_modes(&columns, &Method::default())
}

#[test]
fn a_coarse_encoder_makes_no_mode_near_half_the_sampling_rate() {
    let motor = smooth();
    for step in [1e-4f64, 1e-3, 3e-3] {
        let found = on_encoder(&motor, step.to_radians());
        println!("{step}: {:?} {:?}", found.motor.modes, found.refused);
        assert_eq!(found.motor.modes.len(), 1, "{:?}", found.motor.modes);
        let (got, wanted) = (found.motor.modes[0], motor.modes[0]);
        assert!((got.omega / wanted.omega - 1.0).abs() < 2e-3);
        assert!(!found.refused.is_empty());
        for peak in &found.refused {
            assert!(
                peak.ratio > 2.0 && peak.why.to_string().contains("record")
                    || peak.why.to_string().contains("excite"),
                "{peak:?}"
            );
        }
    }
}

#[test]
fn reversed_and_exchanged_channels_are_named() {
    let motor = smooth();
    let columns = bench(&motor, 0.5, 8);
    let refused = |change: &dyn Fn(&mut [Vec<f64>; 3])| {
        let mut columns = columns.clone();
        change(&mut columns);
        identify(&record(&columns), Excitation::Voltage, &Method::default())
            .unwrap_err()
            .to_string()
    };
    for (k, name) in ["the voltage", "the current", "the angle"]
        .into_iter()
        .enumerate()
    {
        let error = refused(&|c| c[k].iter_mut().for_each(|v| *v = -*v));
        assert!(
            error.starts_with(name) && error.contains("negative `scale`"),
            "{error}"
        );
    }
    let error = refused(&|c| c.swap(1, 2));
    assert!(
        error.contains("the current and the angle are exchanged"),
        "{error}"
    );
}

#[test]
fn ramps_of_a_record_give_the_friction_of_the_motor() {
    let axis = reference::two_axis().mirrors[1].motor().unwrap().clone();
    let motor = axis.motor.clone();
    let Friction::Coulomb { coulomb, bias } = motor.friction else {
        unreachable!("the reference motor has dry friction")
    };
    // up and down at six speeds, with rests between
    let mut set_points = vec![(-15f64).to_radians(); 2000];
    for speed in [20.0f64, 50.0, 100.0, 200.0, 400.0, 800.0] {
        let reach = 30f64.to_radians().min(0.25 * speed.to_radians());
        let step = speed.to_radians() * PERIOD;
        for sign in [1.0, -1.0] {
            let from = *set_points.last().unwrap();
            let n = (reach / step) as usize;
            set_points.extend((1..=n).map(|k| from + sign * step * k as f64));
            let end = *set_points.last().unwrap();
            set_points.extend(vec![end; 600]);
        }
    }
    let driven = run(&axis, &set_points, PERIOD, 1).unwrap();
    let ramps = steady_ramps(&driven.angle, &driven.current, PERIOD).unwrap();
    let found = friction_of_ramps(&ramps, motor.torque_constant).unwrap();
    println!("{} ramps: {found:?}", ramps.len());
    assert!(ramps.len() >= 8, "{ramps:?}");
    for (what, [value, sigma], wanted, within) in [
        ("B", found.viscous, motor.viscous, 0.1),
        ("T_C", found.coulomb, coulomb, 0.1),
        ("T_P", found.bias, bias, 0.2),
    ] {
        assert!(
            (value / wanted - 1.0).abs() < within,
            "{what} {value} ± {sigma}, {wanted}"
        );
    }
    assert!(found.rms < 0.1 * found.rms_viscous_only);
}
