//! The pre-filter.

use meltpath_control::Complex64;
use meltpath_scan_head::axis::prefilter::{Kernel, PreFilter, Running};

const PERIOD: f64 = 1e-6;

fn filter() -> PreFilter {
    PreFilter {
        speed_limit: 1000f64.to_radians(),
        first: 400e-6,
        second: Kernel::Box(250e-6),
    }
}

/// AC-12 (M): a step of 10° at 1000 °/s: speed, acceleration, jerk, end, no overshoot.
#[test]
fn lpbf_ac12_a_step_has_bounded_speed_acceleration_and_jerk() {
    let mut running = Running::new(&filter(), PERIOD, 0.0).unwrap();
    let y: Vec<f64> = (0..12_000)
        .map(|_| running.step(10f64.to_radians()).to_degrees())
        .collect();
    let slope = |v: &[f64]| {
        v.windows(2)
            .map(|w| (w[1] - w[0]) / PERIOD)
            .collect::<Vec<_>>()
    };
    let top = |v: &[f64]| v.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    let speed = slope(&y);
    let acceleration = slope(&speed);
    let jerk = slope(&acceleration);
    assert!((top(&speed) / 1000.0 - 1.0).abs() < 1e-3, "{}", top(&speed));
    assert!(
        (top(&acceleration) / 2.5e6 - 1.0).abs() < 1e-3,
        "{}",
        top(&acceleration)
    );
    assert!((top(&jerk) / 1.0e10 - 1.0).abs() < 1e-2, "{}", top(&jerk));
    let end = y.iter().position(|v| (v - 10.0).abs() < 1e-9).unwrap();
    assert!((end as f64 * PERIOD / 10.65e-3 - 1.0).abs() < 1e-3, "{end}");
    assert!(y.iter().all(|v| *v <= 10.0 + 1e-9));
}

/// AC-13 (M): a ramp lags by (T_a + T_j)/2 = 325 µs, within a sample.
#[test]
fn lpbf_ac13_a_ramp_lags_half_of_both_lengths() {
    assert!((filter().lag() - 325e-6).abs() < 1e-12);
    let mut running = Running::new(&filter(), PERIOD, 0.0).unwrap();
    let speed = 5.0;
    let mut lag = 0.0;
    for k in 1..5000 {
        let x = speed * f64::from(k) * PERIOD;
        lag = (x - running.step(x)) / speed;
    }
    // sampled averages of n values lag by (n − 1)/2 samples: one sample less in all
    assert!((lag - 325e-6).abs() <= PERIOD * (1.0 + 1e-9), "{lag}");
}

/// AC-14 (M part): no gain at 1/T_a and 1/T_j, of the continuous kernels and of the sampled filter.
#[test]
fn lpbf_ac14_zeros_of_the_averages() {
    for f in [1.0 / 400e-6, 1.0 / 250e-6, 3.0 / 400e-6] {
        let gain = filter()
            .response(Complex64::new(0.0, std::f64::consts::TAU * f))
            .norm();
        assert!(20.0 * gain.max(1e-30).log10() < -100.0, "{f}: {gain}");
        let mut running = Running::new(&filter(), PERIOD, 0.0).unwrap();
        let mut sum = Complex64::default();
        let n = 40_000;
        for k in 0..n {
            let phase = std::f64::consts::TAU * f * f64::from(k) * PERIOD;
            let y = running.step(1e-3 * phase.cos());
            if k >= n / 2 {
                sum += y * Complex64::from_polar(1.0, -phase);
            }
        }
        let gain = 2.0 * sum.norm() / f64::from(n / 2) / 1e-3;
        assert!(20.0 * gain.max(1e-30).log10() < -100.0, "{f}: {gain}");
    }
}

/// AC-15 (M): gains of the three kernels at the damped pole of a mode at 4 kHz.
#[test]
fn lpbf_ac15_damped_jerk_kernels() {
    let omega = std::f64::consts::TAU * 4000.0;
    let at = |kernel: Kernel, damping: f64| {
        let pole = Complex64::new(-damping * omega, omega * (1.0 - damping * damping).sqrt());
        kernel.response(pole).norm()
    };
    for (damping, boxed, linear) in [(0.015, 1.57e-2, 2.36e-4), (0.05, 5.9e-2, 2.9e-3)] {
        let length = Kernel::DampedJerk { omega, damping }.length();
        let b = at(Kernel::Box(length), damping);
        assert!((b / boxed - 1.0).abs() < 1e-2, "box {b}");
        let l = at(Kernel::DampedJerk { omega, damping }, damping);
        // the source gives two digits for the second
        assert!((l / linear - 1.0).abs() < 2e-2, "linear {l}");
        assert!(at(Kernel::Exponential { omega, damping }, damping) < 1e-12);
    }
    // the linear kernel with an exact zero at the pole, as the source prints it
    let damped = Kernel::DampedJerk {
        omega,
        damping: 0.05,
    };
    let exact = Kernel::Linear {
        length: 1.00253 * damped.length(),
        slope: 0.27164,
    };
    // six digits are printed
    let gain = at(exact, 0.05);
    assert!(gain < 5e-5, "{gain}");
}
