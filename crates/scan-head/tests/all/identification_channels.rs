//! What identification says of channels: exchanged ones are named, dry friction never passes for one.

use meltpath_control::prbs::Prbs;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::Galvanometer;
use meltpath_scan_head::axis::plant::Plant;
use meltpath_scan_head::identification::error::IdentificationError;
use meltpath_scan_head::identification::motor::identify;
use meltpath_scan_head::identification::record::{BenchRecord, Excitation, Method};

use super::reference;

const PERIOD: f64 = 50e-6;
const SAMPLES: usize = 3 * 8191;

/// Current and angle under a voltage, from rest.
fn driven(motor: &Galvanometer, voltage: &[f64]) -> [Vec<f64>; 3] {
    let mut plant = Plant::<5>::new(motor, &[PERIOD], 0.0).unwrap();
    let (mut current, mut angle) = (Vec::new(), Vec::new());
    for &u in voltage {
        current.push(plant.current());
        angle.push(plant.angle());
        plant.advance(0, u, 0.0);
    }
    [voltage.to_vec(), current, angle]
}

fn identified(columns: &[Vec<f64>; 3]) -> Result<f64, IdentificationError> {
    let record = BenchRecord {
        period: PERIOD,
        voltage: &columns[0],
        current: &columns[1],
        angle: &columns[2],
    };
    let found = identify(&record, Excitation::Voltage, &Method::default())?;
    Ok(found.motor.torque_constant)
}

/// Voltages of 1 V: binary at the sampling rate and slower, and a sweep up to 1 kHz.
fn signals() -> Vec<(String, Vec<f64>)> {
    let mut signals: Vec<(String, Vec<f64>)> = [1, 16, 64]
        .into_iter()
        .map(|hold| {
            (
                format!("binary, held {hold} samples"),
                Prbs::new(13).unwrap().signal(1.0, hold, SAMPLES),
            )
        })
        .collect();
    let span = SAMPLES as f64 * PERIOD;
    let sweep = (0..SAMPLES).map(|k| {
        let t = k as f64 * PERIOD;
        (std::f64::consts::TAU * (2.0 * t + 0.5 * 1000.0 / span * t * t)).sin()
    });
    signals.push(("sweep".to_owned(), sweep.collect()));
    signals
}

/// Levels of the reference motor's dry friction (Coulomb 3e-5 N·m), static friction from the same to four times as much.
fn frictions() -> Vec<(String, Friction)> {
    let mut all = Vec::new();
    for level in [1.0, 3.0, 10.0] {
        let coulomb = level * 3e-5;
        all.push((
            format!("Coulomb × {level}"),
            Friction::Coulomb {
                coulomb,
                bias: 0.2 * coulomb,
            },
        ));
        for over in [1.0, 3.0] {
            let stiction = over * coulomb;
            all.push((
                format!("Coulomb × {level}, static × {}", 1.0 + over),
                Friction::Karnopp {
                    coulomb,
                    stiction,
                    rest: 1e-3,
                },
            ));
        }
        all.push((
            format!("bristles × {level}"),
            Friction::LuGre {
                coulomb,
                stiction: 1.3 * coulomb,
                stribeck: 0.5,
                stiffness: 0.02 * level,
                damping: 2e-6 * level,
            },
        ));
    }
    all
}

#[test]
fn dry_friction_never_passes_for_a_wrong_channel() {
    let (mut tried, mut identified_ones) = (0, 0);
    for (kind, friction) in frictions() {
        let motor = Galvanometer {
            friction,
            ..reference::motor()
        };
        for (name, signal) in signals() {
            for amplitude in [0.03, 0.1, 2.0] {
                let voltage: Vec<f64> = signal.iter().map(|v| amplitude * v).collect();
                tried += 1;
                match identified(&driven(&motor, &voltage)) {
                    Ok(kc) => {
                        identified_ones += 1;
                        let off = kc / motor.torque_constant - 1.0;
                        // the torque of 2 V is a hundred times the reference motor's friction
                        let strong = amplitude > 1.0 && name.starts_with("binary");
                        assert!(!strong || off.abs() < 0.06, "{kind}, {name}: {off}");
                    }
                    Err(e) => assert!(
                        matches!(
                            e,
                            IdentificationError::Unsure { .. } | IdentificationError::Fit(_)
                        ),
                        "{kind}, {name}, {amplitude} V: {e}"
                    ),
                }
            }
        }
    }
    println!("{identified_ones} of {tried} records hold a motor, the others too little motion");
    // 81 of 144
    assert!(2 * identified_ones > tried, "{identified_ones} of {tried}");
}

#[test]
fn exchanged_channels_are_named_with_and_without_friction() {
    let signals = signals();
    for (kind, friction) in [("none".to_owned(), Friction::None)]
        .into_iter()
        .chain(frictions())
    {
        let motor = Galvanometer {
            friction,
            ..reference::motor()
        };
        for (name, signal) in &signals {
            let columns = driven(&motor, signal);
            for (a, b, names) in [
                (0, 1, "the voltage and the current are exchanged"),
                (0, 2, "the voltage and the angle are exchanged"),
                (1, 2, "the current and the angle are exchanged"),
            ] {
                let mut columns = columns.clone();
                columns.swap(a, b);
                let error = identified(&columns).unwrap_err().to_string();
                println!("{kind}, {name}: {error}");
                assert!(error.starts_with(names), "{kind}, {name}: {names}? {error}");
            }
        }
    }
}
