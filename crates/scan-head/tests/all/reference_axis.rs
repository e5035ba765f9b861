//! The two-axis reference motor (docs/theory/sources.md, reference heads) with the thesis' gains (table 2.1).
#![allow(dead_code, reason = "each test file uses its part")]

use meltpath_numerics::swarm::Swarm;
use meltpath_scan_head::axis::chain::{Axis, Encoder};
use meltpath_scan_head::axis::control::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, Limits, SpeedSource,
};
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::axis::galvanometer::{Galvanometer, Mode};
use meltpath_scan_head::axis::prefilter::{Kernel, PreFilter};

/// The motor, friction included.
pub(crate) fn motor() -> Galvanometer {
    let (kc, j) = (6.17e-3, 4.530_873_193_067_997_5e-8);
    Galvanometer {
        resistance: 2.79,
        inductance: 180e-6,
        torque_constant: kc,
        back_emf: kc,
        inertia: j,
        viscous: 3e-6,
        modes: vec![Mode {
            omega: std::f64::consts::TAU * 4000.0,
            damping: 0.015,
            gain: 0.3 * kc / j,
        }],
        friction: Friction::Coulomb {
            coulomb: 3e-5,
            bias: 5e-6,
        },
        felt: 0.0,
    }
}

/// A swarm of this size.
pub(crate) fn swarm(particles: usize, iterations: usize) -> Swarm {
    Swarm {
        particles,
        iterations,
        ..Swarm::default()
    }
}

/// Full feed-forward of the reference motor.
pub(crate) fn feed_forward() -> FeedForward {
    let motor = motor();
    FeedForward {
        speed: 1.0,
        current: 1.0,
        filter: 50e-6,
        inertia_over_torque: motor.inertia / motor.torque_constant,
    }
}

/// First row of table 2.1: after the frequency synthesis.
pub(crate) fn synthesised() -> CascadeGains {
    CascadeGains {
        current: CurrentGains {
            gain: 1.91,
            integral_time: 7e-5,
        },
        speed_gain: 7.48e-4,
        speed_integral_time: 0.04,
        position_gain: 32.0,
        position_derivative_time: 0.1,
        feed_forward: feed_forward(),
        unit: AngleUnit::Degree,
    }
}

/// Second row of table 2.1: after the swarm.
pub(crate) fn refined() -> CascadeGains {
    CascadeGains {
        current: CurrentGains {
            gain: 2.15,
            integral_time: 8e-5,
        },
        speed_gain: 7.08e-4,
        speed_integral_time: 0.005,
        position_gain: 24.0,
        position_derivative_time: 0.09,
        ..synthesised()
    }
}

/// T_a = 400 µs and T_j = 250 µs, on the mode.
pub(crate) fn prefilter() -> PreFilter {
    PreFilter {
        speed_limit: 8000f64.to_radians(),
        first: 400e-6,
        second: Kernel::Box(250e-6),
    }
}

/// The axis with a controller.
pub(crate) fn axis(controller: Controller, prefilter: Option<PreFilter>) -> Axis {
    Axis {
        motor: motor(),
        controller,
        speed: SpeedSource::Rotor,
        limits: Limits {
            voltage: 48.0,
            current: 20.0,
        },
        prefilter,
        encoder: Encoder::default(),
        delay: 0.0,
        travel: 20f64.to_radians(),
    }
}
