//! Models of a galvanometer alone.

use meltpath_control::{Complex64, frequency};
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::{Galvanometer, Mode};
use meltpath_scan_head::axis::plant::Plant;

use super::chain::{Chain, Load};
use super::reference::motor;

fn chain(loads: &[Load]) -> Chain {
    Chain {
        torque_constant: 6.17e-3,
        rotor_inertia: 3e-8,
        rotor_viscous: 0.0,
        loads: loads.to_vec(),
    }
}

fn load(inertia: f64, stiffness: f64) -> Load {
    Load {
        inertia,
        viscous: 0.0,
        stiffness,
    }
}

/// AC-02 (M): eq. 2.6 with a = k/J_l (not the printed one, erratum 2) is the two-mass shaft of eq. 2.1.
#[test]
fn lpbf_ac02_single_mode_is_the_two_mass_shaft() {
    let (kc, jr, jl, k) = (6.17e-3, 3e-8, 1.5e-8, 12.0);
    let shaft = chain(&[load(jl, k)]).speed_over_current().unwrap();
    let a = k / jl;
    let omega = (k * (jr + jl) / (jr * jl)).sqrt();
    assert!((a - omega * omega * jr / (jr + jl)).abs() < 1e-12 * a);
    for f in frequency::logarithmic(1.0, 1e5, 200) {
        let s = Complex64::new(0.0, std::f64::consts::TAU * f);
        let traced = shaft.at(s) / s;
        let off = |angle: Complex64| (angle / traced - 1.0).norm();
        // (s² + a J_l/J_r)(s² + a) − a² J_l/J_r multiplied out; as printed it cancels down to 1e-9 at 1 Hz
        let expanded = kc / jr * (s * s + a) / (s * s * (s * s + a * (1.0 + jl / jr)));
        assert!(off(expanded) < 1e-10, "{f}: {}", off(expanded));
        let printed =
            kc / jr * (s * s + a) / ((s * s + a * jl / jr) * (s * s + a) - a * a * jl / jr);
        let goal = if f > 30.0 { 1e-10 } else { 1e-8 };
        assert!(off(printed) < goal, "{f}: {}", off(printed));
    }
}

/// AC-03 (M): degrees of ω_r/i for 1, 2 and 3 loads; the modal split gives the chain back when nothing is damped.
#[test]
fn lpbf_ac03_chain_degrees_and_modal_split() {
    let all = [load(1.5e-8, 12.0), load(0.6e-8, 20.0), load(0.3e-8, 9.0)];
    for n in 1..=3 {
        let chain = chain(&all[..n]);
        let transfer = chain.speed_over_current().unwrap();
        assert_eq!(transfer.numerator.degree(), 2 * n);
        assert_eq!(transfer.denominator.degree(), 2 * n + 1);
        let (inertia, viscous, modes) = chain.modal().unwrap();
        assert_eq!(modes.len(), n);
        assert!(modes.iter().all(|m| m.gain > 0.0), "collocated: {modes:?}");
        let mut split = motor();
        split.inertia = inertia;
        split.viscous = viscous;
        split.torque_constant = chain.torque_constant;
        split.modes.clone_from(&modes);
        for f in frequency::logarithmic(1.0, 5e4, 150) {
            let s = Complex64::new(0.0, std::f64::consts::TAU * f);
            let ratio = split.speed_over_current(s) / transfer.at(s);
            assert!((ratio - 1.0).norm() < 1e-6, "{n} loads, {f} Hz: {ratio}");
        }
        if n == 1 {
            let (jr, jl) = (chain.rotor_inertia, all[0].inertia);
            let expected = chain.torque_constant * jl / (jr * (jr + jl));
            assert!((modes[0].gain / expected - 1.0).abs() < 1e-9);
            assert!(modes[0].damping.abs() < 1e-9);
        }
    }
}

/// Gain of θ/U (dB) at `f` Hz, from the simulated steady oscillation.
fn simulated_gain(friction: Friction, modes: Vec<Mode>, f: f64, amplitude: f64) -> f64 {
    let mut motor = motor();
    motor.friction = friction;
    motor.modes = modes;
    let period = 5e-6;
    let cycles = 12.0;
    let n = (cycles / f / period) as usize;
    let mut angles = Vec::with_capacity(n);
    let mut drive = |plant: &mut dyn FnMut(f64) -> f64| {
        for k in 0..n {
            let t = k as f64 * period;
            angles.push(plant(amplitude * (std::f64::consts::TAU * f * t).cos()));
        }
    };
    if motor.modes.is_empty() {
        let mut plant = Plant::<3>::new(&motor, &[period], 0.0).unwrap();
        drive(&mut |u| {
            plant.advance(0, u, 0.0);
            plant.angle()
        });
    } else {
        let mut plant = Plant::<5>::new(&motor, &[period], 0.0).unwrap();
        drive(&mut |u| {
            plant.advance(0, u, 0.0);
            plant.angle()
        });
    }
    // the last four cycles without mean
    let from = n - (4.0 / f / period) as usize;
    let tail = &angles[from..];
    let mean = tail.iter().sum::<f64>() / tail.len() as f64;
    let mut sum = Complex64::default();
    for (k, a) in tail.iter().enumerate() {
        let phase = std::f64::consts::TAU * f * (from + k) as f64 * period;
        sum += (a - mean) * Complex64::from_polar(1.0, -phase);
    }
    20.0 * (2.0 * sum.norm() / tail.len() as f64 / amplitude).log10()
}

/// Angle over voltage, rad/V, friction limited to the viscous one.
fn angle_over_voltage(motor: &Galvanometer, s: Complex64) -> Complex64 {
    motor.current_over_voltage(s) * motor.speed_over_current(s) / s
}

/// AC-04 (T): friction lowers the gain of θ/U at low frequency, modes add a peak above 1 kHz, the mid-band is the base model's.
#[test]
fn lpbf_ac04_friction_acts_low_modes_act_high() {
    let enriched = motor();
    let base = |f: f64| {
        let mut m = motor();
        m.modes.clear();
        20.0 * angle_over_voltage(&m, Complex64::new(0.0, std::f64::consts::TAU * f))
            .norm()
            .log10()
    };
    // the excitation of the reference runs, ±0.5 V; half of it for the low end
    let low = simulated_gain(enriched.friction, enriched.modes.clone(), 5.0, 0.1);
    assert!(
        low < base(5.0) - 1.0,
        "5 Hz: {low} dB with friction, {} dB without",
        base(5.0)
    );
    let middle = simulated_gain(enriched.friction, enriched.modes.clone(), 300.0, 2.0);
    assert!(
        (middle - base(300.0)).abs() < 0.5,
        "300 Hz: {middle} dB against {}",
        base(300.0)
    );
    let linear = |f: f64| {
        20.0 * angle_over_voltage(&enriched, Complex64::new(0.0, std::f64::consts::TAU * f))
            .norm()
            .log10()
    };
    let peak = frequency::logarithmic(1e3, 1e4, 400)
        .into_iter()
        .map(|f| (linear(f) - base(f), f))
        .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
    assert!(peak.0 > 10.0 && peak.1 > 1000.0, "{peak:?}");
}

#[test]
fn wrong_parameters_are_named() {
    let mut bad = motor();
    bad.inductance = -1.0;
    let error = Plant::<5>::new(&bad, &[1e-5], 0.0).unwrap_err();
    assert!(error.to_string().contains("inductance"), "{error}");
    let mut many = motor();
    many.modes = vec![many.modes[0]; 4];
    assert!(matches!(
        many.check(),
        Err(AxisError::Modes { modes: 4, .. })
    ));
}
