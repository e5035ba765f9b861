//! Friction and the health test.

use meltpath_numerics::random::Random;
use meltpath_scan_head::axis::chain::Axis;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::health::analysis::Km0Stage2;
use meltpath_scan_head::health::bench::{
    Km0Stage1, first_stage, simulate_first_stage, simulate_second_stage,
};
use meltpath_scan_head::health::friction::FrictionFit;
use meltpath_scan_head::health::rating::{Km0Record, Rating, rate};
use meltpath_scan_head::health::records::RampRecord;
use meltpath_scan_head::health::signal::Km0Signal;
use meltpath_scan_head::identification::error::IdentificationError;
use meltpath_scan_head::identification::record::Excitation;

use super::reference::two_axis;

const PERIOD: f64 = 50e-6;

fn axis() -> Axis {
    two_axis().mirrors[1].motor().unwrap().clone()
}

fn stage2(axis: &Axis) -> Km0Stage2 {
    let samples = Km0Signal::for_axis(&self::axis()).samples(PERIOD).unwrap();
    let record = simulate_second_stage(axis, &samples, PERIOD).unwrap();
    samples
        .analyse(&record, axis.motor.torque_constant)
        .unwrap()
}

fn record(axis: &Axis) -> Km0Record {
    let m = &axis.motor;
    Km0Record {
        axis: "demo/two-axis/Y".to_owned(),
        time: "2026-01-01T08:00:00Z".to_owned(),
        temperature: None,
        resistance: m.resistance,
        inductance: m.inductance,
        torque_constant: m.torque_constant,
        inertia: m.inertia,
        modes: m
            .modes
            .iter()
            .map(|m| m.omega / std::f64::consts::TAU)
            .collect(),
        scatter: None,
        fitted_modes: None,
        fit_residual: None,
        stage2: stage2(axis),
    }
}

/// Both stages as a bench would run them: the first finds motor and mode from the binary sequence.
fn both_stages(axis: &Axis) -> Km0Record {
    let first = first_stage(
        &simulate_first_stage(axis, PERIOD).unwrap().record(),
        Excitation::Voltage,
    )
    .unwrap();
    println!("{first:?}");
    // the width of the peak at −3 dB, within windows that tell 2.4 Hz apart
    for (found, mode) in first.modes.iter().zip(&axis.motor.modes) {
        assert!(
            (found.damping / mode.damping - 1.0).abs() < 0.2,
            "{found:?}"
        );
    }
    first.record(stage2(axis))
}

/// AC-35 (T) with the first stage identified: each change raises its own alarm, and no other quantity of the first stage does.
#[test]
fn lpbf_ac35_drift_through_both_stages() {
    let reference = both_stages(&axis());
    assert_eq!(reference.modes.len(), 1, "{:?}", reference.modes);
    assert!(
        (reference.modes[0] / 4000.0 - 1.0).abs() < 0.01,
        "{:?}",
        reference.modes
    );
    for (quantity, change) in [
        (
            "resistance",
            &(|a: &mut Axis| a.motor.resistance *= 1.3) as &dyn Fn(&mut Axis),
        ),
        ("mode 1", &|a| a.motor.modes[0].omega *= 0.9),
        ("torque constant", &|a| {
            a.motor.torque_constant *= 0.7;
            a.motor.back_emf *= 0.7;
            a.motor.modes[0].gain *= 0.7;
        }),
        ("inertia", &|a| {
            a.motor.inertia *= 1.15;
            a.motor.modes[0].gain /= 1.15;
        }),
        ("Coulomb torque", &|a| {
            if let Friction::Coulomb { coulomb, .. } = &mut a.motor.friction {
                *coulomb *= 2.0;
            }
        }),
    ] {
        let mut axis = axis();
        change(&mut axis);
        let drifts = rate(&reference, &both_stages(&axis), &[]);
        for d in &drifts {
            println!("{quantity}: {} {:+.3} {:?}", d.quantity, d.change, d.rating);
        }
        let alarm = drifts.iter().find(|d| d.quantity == quantity).unwrap();
        assert_eq!(alarm.rating, Rating::Intervene, "{alarm:?}");
        for other in [
            "resistance",
            "inductance",
            "torque constant",
            "inertia",
            "mode 1",
        ] {
            let d = drifts.iter().find(|d| d.quantity == other).unwrap();
            assert!(other == quantity || d.rating != Rating::Intervene, "{d:?}");
        }
    }
}

/// A recorded set-point says where the test begins, and whether it was this test.
#[test]
fn the_signal_is_found_in_a_longer_record() {
    let samples = Km0Signal::for_axis(&axis()).samples(PERIOD).unwrap();
    let mut longer = vec![0.0; 1234];
    longer.extend(&samples.set_points);
    assert_eq!(samples.align(&longer).unwrap(), 1234);
    let other: Vec<f64> = longer.iter().map(|v| 0.5 * v).collect();
    assert!(samples.align(&other).is_err());
    assert!(samples.align(&vec![0.0; 50_000]).is_err());
}

/// AC-05, AC-06 (T, M): static + Coulomb + viscous against viscous alone; exact on ramps without noise.
#[test]
fn lpbf_ac05_ac06_friction_from_ramps() {
    let (b, tp, tc) = (3e-6, 5e-6, 3e-5);
    let exact: Vec<RampRecord> = (1..=6)
        .flat_map(|k| [f64::from(k) * 40.0, f64::from(k) * -40.0])
        .map(|speed_deg: f64| {
            let w = speed_deg.to_radians();
            RampRecord {
                speed_deg,
                steady_speed_deg: speed_deg,
                amplitude_deg: 10.0,
                lag_deg: 0.0,
                speed_response_time: 0.0,
                current: 0.0,
                torque: b * w + tp + tc * w.signum(),
            }
        })
        .collect();
    let fit = FrictionFit::of(&exact).unwrap();
    for (ours, given) in [(fit.viscous, b), (fit.bias, tp), (fit.coulomb, tc)] {
        assert!((ours / given - 1.0).abs() < 1e-6, "{fit:?}");
    }
    // AC-05 on simulated ramps
    let found = stage2(&axis()).friction;
    println!("{found:?}");
    assert!(found.residual_viscous > 3.0 * found.residual);
    assert!(found.coulomb > 0.0);
    assert!(matches!(
        FrictionFit::of(&exact[..1]),
        Err(IdentificationError::Ramps { .. })
    ));
}

/// AC-34 (T): T_C, T_P and B within 5 %; every record of steps and ramps, up and down.
#[test]
fn lpbf_ac34_second_stage_returns_friction_and_every_record() {
    let axis = axis();
    let found = stage2(&axis);
    let Friction::Coulomb { coulomb, bias } = axis.motor.friction else {
        panic!("Coulomb friction")
    };
    for (ours, given) in [
        (found.friction.viscous, axis.motor.viscous),
        (found.friction.bias, bias),
        (found.friction.coulomb, coulomb),
    ] {
        assert!((ours / given - 1.0).abs() < 0.05, "{:?}", found.friction);
    }
    assert_eq!(found.steps.len(), 16);
    assert_eq!(found.ramps.len(), 20);
    for pair in found.steps.chunks(2) {
        assert!(pair[0].amplitude_deg > 0.0 && pair[1].amplitude_deg < 0.0);
        for s in pair {
            assert!(s.static_error_deg.abs() < 0.02, "{s:?}");
            assert!(
                s.response_time > s.start_delay && s.start_delay > 0.0,
                "{s:?}"
            );
            assert!(s.overshoot < 60.0, "{s:?}");
        }
    }
    for r in &found.ramps {
        assert!(
            (r.steady_speed_deg / r.speed_deg - 1.0).abs() < 0.05,
            "{r:?}"
        );
        assert!(r.lag_deg * r.speed_deg > 0.0, "{r:?}");
    }
}

/// AC-35 (T): doubled Coulomb torque, R + 30 %, mode − 10 % raise their alarms; an unchanged axis raises none.
#[test]
fn lpbf_ac35_drift_raises_the_right_alarm() {
    let reference = record(&axis());
    let same = rate(&reference, &record(&axis()), &[]);
    assert!(
        same.iter().all(|d| d.rating == Rating::Good),
        "{:?}",
        same[0]
    );
    let changed = |change: &dyn Fn(&mut Axis)| {
        let mut axis = axis();
        change(&mut axis);
        rate(&reference, &record(&axis), &[])
    };
    let worn = changed(&|a| {
        if let Friction::Coulomb { coulomb, .. } = &mut a.motor.friction {
            *coulomb *= 2.0;
        }
    });
    let hot = changed(&|a| a.motor.resistance *= 1.3);
    let loose = changed(&|a| a.motor.modes[0].omega *= 0.9);
    for (drifts, quantity) in [
        (worn, "Coulomb torque"),
        (hot, "resistance"),
        (loose, "mode 1"),
    ] {
        let alarm = drifts.iter().find(|d| d.quantity == quantity).unwrap();
        assert_eq!(alarm.rating, Rating::Intervene, "{alarm:?}");
        assert!(!alarm.fault.is_empty() && !alarm.action.is_empty());
    }
}

/// AC-36 (T): lag rises with speed, linearly at high speed; friction torque is not zero at the origin and rises.
#[test]
fn lpbf_ac36_lag_and_friction_against_speed() {
    let found = stage2(&axis());
    let up: Vec<&RampRecord> = found.ramps.iter().filter(|r| r.speed_deg > 0.0).collect();
    for pair in up.windows(2) {
        assert!(pair[1].lag_deg > pair[0].lag_deg, "{pair:?}");
        assert!(pair[1].torque > pair[0].torque, "{pair:?}");
    }
    let [.., a, b, c] = up.as_slice() else {
        panic!("ten ramps")
    };
    let slope =
        |p: &RampRecord, q: &RampRecord| (q.lag_deg - p.lag_deg) / (q.speed_deg - p.speed_deg);
    assert!(
        (slope(a, b) / slope(b, c) - 1.0).abs() < 0.1,
        "{} {}",
        slope(a, b),
        slope(b, c)
    );
    assert!(found.friction.bias + found.friction.coulomb > 1e-5);
}

/// What the bench records of the first stage is what the axis' encoder reads: with its noise, in its steps.
#[test]
fn the_first_stage_is_read_by_the_encoder() {
    let clean = simulate_first_stage(&axis(), PERIOD).unwrap();
    let mut coarse = axis();
    (coarse.encoder.noise, coarse.encoder.resolution) = (3e-6, 1e-6);
    let read = simulate_first_stage(&coarse, PERIOD).unwrap();
    assert_eq!(
        (&read.voltage, &read.current),
        (&clean.voltage, &clean.current)
    );
    let off = read
        .angle
        .iter()
        .zip(&clean.angle)
        .map(|(a, b)| (a - b).powi(2));
    let rms = (off.sum::<f64>() / clean.angle.len() as f64).sqrt();
    assert!((rms / 3e-6 - 1.0).abs() < 0.02, "{rms}");
    let steps = read.angle.iter().map(|a| a / 1e-6);
    assert!(steps.clone().all(|s| (s - s.round()).abs() < 1e-6));
}

/// Inertia is told only as well as both tests tell it: beside a mode that the fit lacks, beside friction that changed, and beside noise it
/// cannot be said whether a mirror is loose; a change beyond all of that is a fault.
#[test]
fn inertia_is_told_only_as_well_as_the_tests_tell_it() {
    let sure = Km0Record {
        scatter: Some([1e-3; 4]),
        ..record(&axis())
    };
    let grown = |by: f64| Km0Record {
        inertia: by * sure.inertia,
        ..sure.clone()
    };
    let worn = |coulomb: f64, inertia: f64| {
        let mut worn = grown(inertia);
        worn.stage2.friction.coulomb *= coulomb;
        worn
    };
    let without = |mut test: Km0Record| {
        test.fitted_modes = Some(Vec::new());
        test
    };
    let noisy = |test: Km0Record| Km0Record {
        scatter: Some([0.03; 4]),
        ..test
    };
    let (fault, watch, good) = (Rating::Intervene, Rating::Watch, Rating::Good);
    for (what, now, rating, told) in [
        ("loose", grown(1.13), fault, true),
        ("as it was", sure.clone(), good, true),
        ("no mode", without(grown(1.13)), watch, false),
        ("no mode, as it was", without(sure.clone()), good, false),
        ("worn", worn(1.5, 1.06), watch, false),
        ("worn and loose", worn(1.4, 1.2), fault, true),
        ("hardly worn", worn(1.05, 1.005), good, true),
        ("noise", noisy(grown(1.06)), watch, false),
        ("far beyond noise", noisy(grown(1.3)), fault, true),
        (
            "nothing known",
            Km0Record {
                scatter: Some([1.0; 4]),
                ..sure.clone()
            },
            good,
            false,
        ),
    ] {
        let drifts = rate(&sure, &now, &[4000.0]);
        let drift = drifts.iter().find(|d| d.quantity == "inertia").unwrap();
        assert_eq!(
            (drift.rating, drift.doubt.is_none()),
            (rating, told),
            "{what}: {drift:?}"
        );
    }
}

/// What the parts of a noisy record tell of its scatter is that of other records.
#[test]
fn the_scatter_of_a_first_stage_is_that_of_its_noise() {
    let axis = axis();
    let clean = simulate_first_stage(&axis, PERIOD).unwrap();
    let found: Vec<_> = (0..6)
        .map(|seed| {
            let mut random = Random::new(seed);
            let mut noisy = clean.clone();
            for i in &mut noisy.current {
                *i += 2e-3 * random.normal();
            }
            for a in &mut noisy.angle {
                *a += 5e-6 * random.normal();
            }
            first_stage(&noisy.record(), Excitation::Voltage).unwrap()
        })
        .collect();
    let of = |f: &Km0Stage1| {
        [
            f.motor.resistance,
            f.motor.inductance,
            f.motor.torque_constant,
            f.motor.inertia,
        ]
    };
    for k in 0..4 {
        let values: Vec<f64> = found.iter().map(|f| of(f)[k].ln()).collect();
        let mean = values.iter().sum::<f64>() / 6.0;
        let true_one = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 5.0).sqrt();
        let told: Vec<f64> = found.iter().map(|f| f.scatter[k]).collect();
        let mean = told.iter().sum::<f64>() / 6.0;
        println!("{k}: {true_one:.2e} by six records, {told:?}");
        assert!(
            (0.7..5.0).contains(&(mean / true_one)),
            "{k}: {true_one} {told:?}"
        );
    }
}
