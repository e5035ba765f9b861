//! The tables of a head's axes: motor, drive, gains, pre-filter.

use crate::axis::chain::{Axis, Encoder};
use crate::axis::control::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, Limits, SpeedSource,
};
use crate::axis::friction::Drag;
use crate::axis::galvanometer::Galvanometer;
use crate::axis::prefilter::{Kernel, PreFilter};
use crate::files::figure::{
    BackEmf, CurrentGain, Inductance, Inertia, Rate, Resistance, SpeedGain, Torque, TorqueConstant,
    Viscous,
};
use crate::files::friction::{FrictionKeys, FrictionTable};
use crate::files::motor::{ModeTable, mode};
use meltpath_base::settings::{Ranged, Sourced};
use meltpath_base::{Angle, AngularSpeed, Current, Pure, Time, Voltage, table};

table! {
    /// An axis: motor, drive, gains of its cascade, pre-filter.
    pub struct AxisTable {
        /// Resistance of the coil.
        resistance: Sourced<Resistance> where positive => required;
        /// Inductance of the coil.
        inductance: Sourced<Inductance> where positive => required;
        /// Torque per current.
        torque_constant: Sourced<TorqueConstant> where positive => required;
        /// Voltage per speed.
        back_emf: Sourced<BackEmf> where not_negative => required;
        /// Inertia of rotor and mirror.
        inertia: Sourced<Inertia> where positive => required;
        /// Viscous friction.
        viscous: Ranged<Viscous> where not_negative => required;
        /// Coulomb friction.
        coulomb: Ranged<Torque> where not_negative => required;
        /// T_P of eq. 2.22 (Rasoanarivo 2020); zero with another law in `friction`.
        bias: Ranged<Torque> => required;
        /// Friction beyond the printed law of `coulomb` and `bias`.
        friction: FrictionTable => none("the printed law");
        /// Share of friction that the modes feel: 1 where it acts on the rotor, 0 where it is spread as the inertia is.
        friction_felt: Sourced<Pure> where within(0.0, 1.0) => none("0: it acts on the rigid body, as in Rasoanarivo 2020, fig. 2.20");
        /// What the motor leaves of the record that it was identified from, over the record's noise: about 1 where it explains it. Beyond 1.1 no verdict on it is a promise.
        misfit: Sourced<Pure> where not_negative => none("not judged");
        /// Modes of the flexible shaft.
        mode: Vec<ModeTable> => default([], "a rigid shaft");
        /// Gain of the current loop.
        current_gain: Sourced<CurrentGain> => required;
        /// Integral time of the current loop.
        current_integral_time: Sourced<Time> where positive => required;
        /// Gain of the speed loop.
        speed_gain: Sourced<SpeedGain> => required;
        /// Integral time of the speed loop.
        speed_integral_time: Sourced<Time> where positive => required;
        /// Gain of the position loop.
        position_gain: Sourced<Rate> => required;
        /// Derivative time of the position loop.
        position_derivative_time: Sourced<Time> where not_negative => required;
        /// Share of the set speed that is fed forward.
        feed_forward_speed: Sourced<Pure> => required;
        /// Share of the set current that is fed forward.
        feed_forward_current: Sourced<Pure> => required;
        /// Filter of what is fed forward.
        feed_forward_filter: Sourced<Time> where not_negative => required;
        /// Filter of the derivative that gives the speed.
        speed_filter: Sourced<Time> where positive => none("the speed is the rotor's");
        /// Greatest voltage of the drive.
        supply: Sourced<Voltage> where positive => required;
        /// Greatest current of the drive.
        peak_current: Sourced<Current> where positive => required;
        /// Greatest angle to either side.
        travel: Sourced<Angle> where positive => required;
        /// Greatest speed of set-points.
        speed_limit: Sourced<AngularSpeed> where positive => required;
        /// Duration of the pre-filter's first average.
        first_filter: Sourced<Time> where not_negative => required;
        /// Duration of the pre-filter's second average.
        second_filter: Sourced<Time> where not_negative => required;
        /// Step of the encoder; zero for none.
        encoder_resolution: Sourced<Angle> where not_negative => required;
        /// Standard deviation of the encoder's noise.
        encoder_noise: Sourced<Angle> where not_negative => required;
        /// Delay of the loop.
        loop_delay: Sourced<Time> where not_negative => required;
        /// Times of the first maximum of each loop's step response, for `meltpath tune`.
        tuning: TuningTable => none("those of the tuning file");
    }

    /// Times of the first maximum of each loop's step response.
    pub struct TuningTable {
        /// Of the current loop.
        current: Sourced<Time> where positive => required;
        /// Of the speed loop.
        speed: Sourced<Time> where positive => required;
        /// Of the position loop.
        position: Sourced<Time> where positive => required;
    }
}

impl AxisTable {
    /// What says how the axis is held.
    pub(super) fn friction_keys(&self) -> FrictionKeys<'_> {
        FrictionKeys {
            viscous: &self.viscous,
            coulomb: &self.coulomb,
            bias: &self.bias,
            law: &self.friction,
        }
    }
}

/// Times of current, speed and position, s.
pub(super) fn tuning(axis: &AxisTable) -> Option<[f64; 3]> {
    let t = axis.tuning.as_ref()?;
    Some([t.current.0, t.speed.0, t.position.0])
}

pub(super) fn read_axis(t: &AxisTable) -> Axis {
    let kc = t.torque_constant.0;
    let inertia = t.inertia.0;
    let Drag { dry, viscous } = t.friction_keys().drag();
    let speed = match &*t.speed_filter {
        None => SpeedSource::Rotor,
        Some(filter) => SpeedSource::Derivative { filter: filter.0 },
    };
    Axis {
        motor: Galvanometer {
            resistance: t.resistance.0,
            inductance: t.inductance.0,
            torque_constant: kc,
            back_emf: t.back_emf.0,
            inertia,
            viscous,
            modes: t.mode.iter().map(|m| mode(m, kc / inertia)).collect(),
            friction: dry,
            felt: t.friction_felt.as_ref().map_or(0.0, |felt| felt.0),
        },
        controller: Controller::Cascade(CascadeGains {
            current: CurrentGains {
                gain: t.current_gain.0,
                integral_time: t.current_integral_time.0,
            },
            speed_gain: t.speed_gain.0,
            speed_integral_time: t.speed_integral_time.0,
            position_gain: t.position_gain.0,
            position_derivative_time: t.position_derivative_time.0,
            feed_forward: FeedForward {
                speed: t.feed_forward_speed.0,
                current: t.feed_forward_current.0,
                filter: t.feed_forward_filter.0,
                inertia_over_torque: inertia / kc,
            },
            unit: AngleUnit::Degree,
        }),
        speed,
        limits: Limits {
            voltage: t.supply.0,
            current: t.peak_current.0,
        },
        prefilter: Some(PreFilter {
            speed_limit: t.speed_limit.0,
            first: t.first_filter.0,
            second: Kernel::Box(t.second_filter.0),
        }),
        encoder: Encoder {
            resolution: t.encoder_resolution.0,
            noise: t.encoder_noise.0,
        },
        delay: t.loop_delay.0,
        travel: t.travel.0,
    }
}
