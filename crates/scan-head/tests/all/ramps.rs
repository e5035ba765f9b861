//! Friction of simulated ramps: how often it lies beyond two stated deviations, and what gives a false law away.

use meltpath_numerics::random::Random;
use meltpath_scan_head::identification::friction::{RampFriction, friction_of_ramps};
use meltpath_scan_head::identification::ramps::steady_ramps;

const PERIOD: f64 = 50e-6;
const KC: f64 = 5e-3;
/// B, T_P, T_C.
const TRUE: [f64; 3] = [4e-6, 2e-6, 2.5e-5];

/// What is wrong with a bench: torque over ω|ω| (N·m·s²/rad²), and what the ammeter's zero drifts by during the record (A).
#[derive(Clone, Copy, Default)]
struct Wrong {
    bend: f64,
    drift: f64,
}

/// Ramps up and down at some speeds (deg/s), with noise of 0.8 mA and an encoder of 20 bits.
fn friction(speeds: &[f64], wrong: Wrong, seed: u64) -> RampFriction {
    let mut random = Random::new(seed);
    let held = 900;
    let speeds: Vec<f64> = speeds
        .iter()
        .flat_map(|s| [s.to_radians(), -s.to_radians()])
        .flat_map(|s| [vec![0.0; 200], vec![s; held]].concat())
        .collect();
    let count = 40f64.to_radians() / 2f64.powi(20);
    let mut at = 0.0;
    let (mut angle, mut current) = (Vec::new(), Vec::new());
    for (k, s) in speeds.iter().enumerate() {
        let sign = if *s == 0.0 { 0.0 } else { s.signum() };
        let torque = TRUE[0] * s + TRUE[1] * sign.abs() + TRUE[2] * sign + wrong.bend * s * s.abs();
        let drift = wrong.drift * k as f64 / speeds.len() as f64;
        current.push(torque / KC + drift + 0.8e-3 * random.normal());
        angle.push((f64::round(at / count)) * count);
        at += s * PERIOD;
    }
    let ramps = steady_ramps(&angle, &current, PERIOD).unwrap();
    friction_of_ramps(&ramps, KC).unwrap()
}

fn off(found: &RampFriction) -> [f64; 3] {
    let figures = [found.viscous, found.bias, found.coulomb];
    std::array::from_fn(|i| (figures[i][0] - TRUE[i]).abs() / figures[i][1])
}

/// Two deviations hold 95 of a hundred, also where few ramps are left to tell them, and what friction leaves is that of the noise.
#[test]
fn two_deviations_hold_the_friction_of_nearly_all_records() {
    for speeds in [
        &[10.0, 60.0, 300.0][..],
        &[8.0, 20.0, 50.0, 120.0, 250.0, 500.0],
    ] {
        let (mut beyond, mut odd) = ([0; 3], 0);
        let seeds = 100;
        for seed in 0..seeds {
            let found = friction(speeds, Wrong::default(), seed);
            for (beyond, off) in beyond.iter_mut().zip(off(&found)) {
                *beyond += u32::from(off > 2.0);
            }
            odd += u32::from(found.over_noise.unwrap() > 2.0);
        }
        println!(
            "{} speeds: {beyond:?} of {seeds} beyond two deviations, {odd} odd",
            speeds.len()
        );
        assert!(
            beyond.iter().all(|n| *n <= 9) && odd <= 2,
            "{beyond:?} {odd}"
        );
    }
}

/// With two speeds each way nothing tells a bend or a drift: no deviation.
#[test]
fn two_speeds_tell_no_deviation() {
    let found = friction(&[10.0, 300.0], Wrong::default(), 1);
    assert!(off(&found).iter().all(|off| off.is_nan()), "{found:?}");
    assert!((found.coulomb[0] / TRUE[2] - 1.0).abs() < 0.1);
}

/// A bend of the law, and an ammeter whose zero drifts, leave more than the noise within the ramps.
#[test]
fn what_no_friction_explains_shows_between_ramps() {
    let speeds = [5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0];
    for seed in 0..5 {
        for wrong in [
            Wrong {
                bend: 3e-7,
                drift: 0.0,
            },
            Wrong {
                bend: 0.0,
                drift: 2e-3,
            },
        ] {
            let found = friction(&speeds, wrong, seed);
            assert!(found.over_noise.unwrap() > 3.0, "{found:?}");
        }
    }
}
