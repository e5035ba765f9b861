//! The table of a head whose axes are known by their data sheet.

use crate::axis::servo::Servo;
use crate::files::figure::SpotAcceleration;
use crate::optics::geometry::Geometry;
use meltpath_base::settings::{Problem, Problems, Sourced};
use meltpath_base::{Length, Speed, Time, table};
use meltpath_geometry::math::DVec2;

table! {
    /// Both axes by their data sheet: speeds and accelerations are those of the spot in the field's centre.
    pub struct ServoTable {
        /// Tracking delay ("tracking error"): by how much the spot lags behind a steady line.
        tracking_delay: Sourced<Time> where positive => required;
        /// Greatest speed of the spot: that of the quickest jumps.
        top_speed: Sourced<Speed> where positive => required;
        /// Greatest acceleration of the spot.
        acceleration: Sourced<SpotAcceleration> where positive => none("that of the step, where it is told; else any");
        /// A step told by the data sheet: how far.
        step_length: Sourced<Length> where positive => none("no step is told");
        /// The same step: in which time it settles within a thousandth of the field.
        step_time: Sourced<Time> where positive => none("no step is told");
        /// What the data sheet leaves out of the spot's place (friction, dither, repeatability, drift), as one standard deviation.
        left_out: Sourced<Length> where positive => none("not known: contours and fills that come out well cannot be said");
        /// Bits of a set-point over the field.
        bits: usize where within(8.0, 32.0) => none("set-points as fine as numbers are");
    }
}

/// How far beyond the field the mirrors travel.
const BEYOND: f64 = 1.1;
/// The share of the field within which a data sheet's step has settled.
const SETTLED: f64 = 1e-3;

/// The dotted names of figures that decide where the spot is and are a guess by their own source.
pub(super) fn guesses(table: &ServoTable) -> Option<String> {
    let left_out = table.left_out.as_ref()?;
    let guess = left_out.source.to_lowercase().contains("guess");
    guess.then(|| table.left_out.name.clone())
}

/// The axes X and Y of a head with this geometry and half a field, mm, sampled every `period` s.
pub(super) fn read_servos(
    table: &ServoTable,
    geometry: &Geometry,
    half_field: f64,
    period: f64,
) -> Result<[Servo; 2], Problems> {
    let stuck = |e: &dyn std::fmt::Display| Problem::new(e.to_string());
    geometry.check().map_err(|e| stuck(&e))?;
    let travel = geometry
        .inverse(DVec2::splat(half_field))
        .map_err(|e| stuck(&e))?
        .abs()
        * BEYOND;
    let levers = geometry.jacobian(DVec2::ZERO);
    let [x, y] = [
        (levers.x_axis.length(), travel.x),
        (levers.y_axis.length(), travel.y),
    ]
    .map(|(lever, travel)| servo(table, [lever, travel], half_field, period));
    Ok([x?, y?])
}

/// One axis that moves the spot by `lever` mm per rad.
fn servo(
    table: &ServoTable,
    [lever, travel]: [f64; 2],
    half_field: f64,
    period: f64,
) -> Result<Servo, Problem> {
    let delay = &table.tracking_delay;
    let plain = Servo {
        tracking_delay: delay.0,
        acceleration: f64::INFINITY,
        speed_limit: table.top_speed.0 / lever,
        resolution: table
            .bits
            .map_or(0.0, |bits| 2.0 * half_field / lever / (bits as f64).exp2()),
        travel,
    };
    plain
        .start(period, 0.0)
        .map_err(|e| delay.problem(e.to_string()))?;
    let told = match (&*table.step_length, &*table.step_time) {
        (Some(length), Some(time)) => Some((length.0, time.0)),
        (None, None) => None,
        _ => {
            let one = if table.step_length.is_some() {
                table.step_length.problem("a step needs its time, too")
            } else {
                table.step_time.problem("a step needs its length, too")
            };
            return Err(one.help("write both step_length and step_time, or neither"));
        }
    };
    match (&*table.acceleration, told) {
        (Some(_), Some(_)) => Err(table
            .acceleration
            .problem("the acceleration is told twice: by itself and by a step")
            .help("leave out acceleration, or step_length and step_time")),
        (Some(acceleration), None) => Ok(Servo {
            acceleration: acceleration.0 / lever,
            ..plain
        }),
        (None, None) => Ok(plain),
        (None, Some((length, time))) => {
            let tolerance = 2.0 * half_field * SETTLED / lever;
            let found = plain.with_step(length / lever, tolerance, time, period);
            found
                .map_err(|e| delay.problem(e.to_string()))?
                .ok_or_else(|| {
                    let alone = plain.settling(length / lever, tolerance, period);
                    table
                        .step_time
                        .problem(format!(
                            "{:.0} mm in {:.0} µs: the tracking delay and the top speed alone take {:.0} µs",
                            length,
                            1e6 * time,
                            1e6 * alone.unwrap_or(f64::INFINITY)
                        ))
                        .help("a longer step_time, a shorter tracking_delay or a greater top_speed: read the data sheet again")
                })
        }
    }
}
