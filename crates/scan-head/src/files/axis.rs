//! The tables of a head's axes: motor, drive, gains, pre-filter.

use crate::axis::chain::{Axis, Encoder};
use crate::axis::control::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, Limits, SpeedSource,
};
use crate::axis::friction::Friction;
use crate::axis::galvanometer::Galvanometer;
use crate::axis::prefilter::{Kernel, PreFilter};
use crate::files::figure::{
    ANGLE, ANGULAR_SPEED, BACK_EMF, CURRENT, CURRENT_GAIN, Figure, HeadFileError, INDUCTANCE,
    INERTIA, NONE, RATE, RESISTANCE, Reading, SPEED_GAIN, STIFFNESS, TIME, TORQUE, TORQUE_CONSTANT,
    VISCOUS, VOLTAGE, read,
};
use crate::files::motor::{ModeTable, mode};
use serde::Deserialize;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AxisTable {
    resistance: Figure,
    inductance: Figure,
    torque_constant: Figure,
    back_emf: Figure,
    inertia: Figure,
    viscous: Figure,
    coulomb: Figure,
    bias: Figure,
    friction: Option<FrictionTable>,
    #[serde(default)]
    mode: Vec<ModeTable>,
    current_gain: Figure,
    current_integral_time: Figure,
    speed_gain: Figure,
    speed_integral_time: Figure,
    position_gain: Figure,
    position_derivative_time: Figure,
    feed_forward_speed: Figure,
    feed_forward_current: Figure,
    feed_forward_filter: Figure,
    speed_filter: Option<Figure>,
    supply: Figure,
    peak_current: Figure,
    travel: Figure,
    speed_limit: Figure,
    first_filter: Figure,
    second_filter: Figure,
    encoder_resolution: Figure,
    encoder_noise: Figure,
    loop_delay: Figure,
    tuning: Option<TuningTable>,
}

/// Friction beyond the printed law of `coulomb` and `bias`, which is zero then.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case", tag = "kind")]
enum FrictionTable {
    /// T_P as stiction: at rest up to T_C + T_P.
    Karnopp { stiction: Figure, rest: Figure },
    /// Bristles.
    Lugre {
        stiction: Figure,
        stribeck: Figure,
        stiffness: Figure,
        damping: Figure,
    },
}

/// Times of the first maximum of each loop's step response.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TuningTable {
    current: Figure,
    speed: Figure,
    position: Figure,
}

pub(super) fn tuning(name: &str, axis: &AxisTable) -> Result<Option<[f64; 3]>, HeadFileError> {
    let Some(t) = &axis.tuning else {
        return Ok(None);
    };
    let r = Reading { table: name };
    Ok(Some([
        read!(r, t, current, TIME),
        read!(r, t, speed, TIME),
        read!(r, t, position, TIME),
    ]))
}

fn friction(r: &Reading, t: &AxisTable) -> Result<Friction, HeadFileError> {
    let coulomb = read!(r, t, coulomb, TORQUE);
    let bias = read!(r, t, bias, TORQUE);
    if t.friction.is_some() && bias != 0.0 {
        return Err(HeadFileError::Form(format!(
            "{}.bias is of the Coulomb law alone: write 0 N·m there, or leave out [{}.friction]",
            r.table, r.table
        )));
    }
    Ok(match &t.friction {
        None => Friction::Coulomb { coulomb, bias },
        Some(FrictionTable::Karnopp { stiction, rest }) => Friction::Karnopp {
            coulomb,
            stiction: r.get("friction.stiction", stiction, TORQUE)?,
            rest: r.get("friction.rest", rest, ANGULAR_SPEED)?,
        },
        Some(FrictionTable::Lugre {
            stiction,
            stribeck,
            stiffness,
            damping,
        }) => Friction::LuGre {
            coulomb,
            stiction: r.get("friction.stiction", stiction, TORQUE)?,
            stribeck: r.get("friction.stribeck", stribeck, ANGULAR_SPEED)?,
            stiffness: r.get("friction.stiffness", stiffness, STIFFNESS)?,
            damping: r.get("friction.damping", damping, VISCOUS)?,
        },
    })
}

pub(super) fn read_axis(name: &str, t: &AxisTable) -> Result<Axis, HeadFileError> {
    let r = Reading { table: name };
    let kc = read!(r, t, torque_constant, TORQUE_CONSTANT);
    let inertia = read!(r, t, inertia, INERTIA);
    let mut modes = Vec::with_capacity(t.mode.len());
    for m in &t.mode {
        modes.push(mode(&r, m, kc / inertia)?);
    }
    let speed = match &t.speed_filter {
        None => SpeedSource::Rotor,
        Some(filter) => SpeedSource::Derivative {
            filter: r.get("speed_filter", filter, TIME)?,
        },
    };
    Ok(Axis {
        motor: Galvanometer {
            resistance: read!(r, t, resistance, RESISTANCE),
            inductance: read!(r, t, inductance, INDUCTANCE),
            torque_constant: kc,
            back_emf: read!(r, t, back_emf, BACK_EMF),
            inertia,
            viscous: read!(r, t, viscous, VISCOUS),
            modes,
            friction: friction(&r, t)?,
        },
        controller: Controller::Cascade(CascadeGains {
            current: CurrentGains {
                gain: read!(r, t, current_gain, CURRENT_GAIN),
                integral_time: read!(r, t, current_integral_time, TIME),
            },
            speed_gain: read!(r, t, speed_gain, SPEED_GAIN),
            speed_integral_time: read!(r, t, speed_integral_time, TIME),
            position_gain: read!(r, t, position_gain, RATE),
            position_derivative_time: read!(r, t, position_derivative_time, TIME),
            feed_forward: FeedForward {
                speed: read!(r, t, feed_forward_speed, NONE),
                current: read!(r, t, feed_forward_current, NONE),
                filter: read!(r, t, feed_forward_filter, TIME),
                inertia_over_torque: inertia / kc,
            },
            unit: AngleUnit::Degree,
        }),
        speed,
        limits: Limits {
            voltage: read!(r, t, supply, VOLTAGE),
            current: read!(r, t, peak_current, CURRENT),
        },
        prefilter: Some(PreFilter {
            speed_limit: read!(r, t, speed_limit, ANGULAR_SPEED),
            first: read!(r, t, first_filter, TIME),
            second: Kernel::Box(read!(r, t, second_filter, TIME)),
        }),
        encoder: Encoder {
            resolution: read!(r, t, encoder_resolution, ANGLE),
            noise: read!(r, t, encoder_noise, ANGLE),
        },
        delay: read!(r, t, loop_delay, TIME),
        travel: read!(r, t, travel, ANGLE),
    })
}
