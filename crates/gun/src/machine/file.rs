//! Guns as data files: every figure with its source. A key that is left out says that nobody knows.

use meltpath_base::settings::{self, Problem, Problems, Sourced};
use meltpath_base::{Frequency, Pure, Ratio, Speed, Time, quantity, table};

use super::{Between, Change, Machine, Points};

quantity!(
    /// A power, W inside.
    Power, "power", "W",
    [("W", 1.0), ("kW", 1e3)]
);
quantity!(
    /// How fast a current changes, A/s inside.
    CurrentSlew, "slew of a current", "A/s",
    [("A/s", 1.0), ("mA/ms", 1.0), ("mA/µs", 1e3), ("mA/us", 1e3)]
);

table! {
    /// An electron gun: what it can do, and how fast. Leave out what nobody knows: the verdict says where it matters.
    pub struct GunFile {
        /// Version of the file's layout.
        schema: u32 where within(1.0, 1.0) => required;
        /// Name in words.
        name: String => required;
        /// Who says what no figure below says itself.
        source: String => required;
        /// Least power of the beam.
        least_power: Sourced<Power> where not_negative => none("unknown");
        /// Greatest power of the beam.
        greatest_power: Sourced<Power> where positive => none("unknown");
        /// The beam current.
        current: CurrentTable => default({}, "nothing is known");
        /// The deflection.
        deflection: DeflectionTable => default({}, "nothing is known");
        /// Points, on which the beam rests.
        points: PointsTable => default({}, "nothing is known");
        /// How much wider the spot is than its focus calibration says, by increasing power.
        spot: Vec<SpotTable> => default([], "as calibrated at every power");
    }

    /// The beam current.
    pub struct CurrentTable {
        /// Where it can change.
        change: Change => none("unknown");
        /// How fast it goes at most.
        slew: Sourced<CurrentSlew> where positive => none("unknown");
        /// Bandwidth with which it nears its set value.
        bandwidth: Sourced<Frequency> where positive => none("unknown");
        /// What the beam does on its way from one stretch to the next.
        between: Between => none("unknown");
    }

    /// The deflection.
    pub struct DeflectionTable {
        /// Where the speed can change.
        speed: Change => none("unknown");
        /// How far in time the beam is behind its command on a straight line.
        lag: Sourced<Time> where up_to(1.0) => none("unknown");
        /// Damping: below 1 the beam overshoots.
        damping: Sourced<Pure> where within(0.05, 20.0) => none("1: nothing overshoots");
        /// Greatest speed.
        greatest_speed: Sourced<Speed> where positive => none("unknown");
        /// From the order to jump until the beam is on again.
        jump: Sourced<Time> where up_to(1.0) => none("unknown");
    }

    /// Points, on which the beam rests.
    pub struct PointsTable {
        /// Whether the gun rests on points for a set time.
        rest: Points => none("unknown");
        /// Least time on a point.
        least_dwell: Sourced<Time> where not_negative => none("unknown");
    }

    /// How wide the spot is at a power.
    pub struct SpotTable {
        /// The power.
        power: Sourced<Power> where not_negative => required;
        /// Its width, as a share of what the focus calibration says.
        width: Sourced<Ratio> where positive => required;
    }
}

/// What a file says.
///
/// # Errors
/// Everything wrong with it, each with its place.
///
/// ```
/// let text = "schema = 1\nname = \"mine\"\nsource = \"its log of 2026\"\n\
///     [deflection]\nlag = { value = \"20 µs\", source = \"step of 1 mm, its log\" }\n";
/// let gun = meltpath_gun::machine::parse(text).unwrap();
/// assert!((gun.lag.unwrap() - 20e-6).abs() < 1e-12 && gun.jump.is_none());
/// ```
pub fn parse(text: &str) -> Result<Machine, Problems> {
    let file = settings::parse(text, wrong)?;
    let (current, deflection, points) = (&file.current, &file.deflection, &file.points);
    Ok(Machine {
        name: file.name.value.clone(),
        source: file.source.value.clone(),
        least_power: file.least_power.as_ref().map(|v| v.value.0),
        greatest_power: file.greatest_power.as_ref().map(|v| v.value.0),
        current: current.change.value,
        slew: current.slew.as_ref().map(|v| v.value.0),
        settling: current.bandwidth.as_ref().map(|v| 1.0 / v.value.0),
        between: current.between.value,
        speed: deflection.speed.value,
        lag: deflection.lag.as_ref().map(|v| v.value.0),
        damping: deflection.damping.as_ref().map_or(1.0, |v| v.value.0),
        greatest_speed: deflection.greatest_speed.as_ref().map(|v| v.value.0),
        jump: deflection.jump.as_ref().map(|v| v.value.0),
        points: points.rest.value,
        least_dwell: points.least_dwell.as_ref().map(|v| v.value.0),
        widening: widening(&file),
    })
}

fn widening(file: &GunFile) -> Vec<[f64; 2]> {
    let rows = file.spot.iter();
    rows.map(|row| [row.power.value.value.0, row.width.value.value.0])
        .collect()
}

/// What a single key cannot tell.
fn wrong(file: &GunFile) -> Vec<Problem> {
    let mut problems = Vec::new();
    if let (Some(least), Some(greatest)) = (&*file.least_power, &*file.greatest_power)
        && least.value > greatest.value
    {
        let message = format!(
            "the greatest power, {}, is below the least, {}",
            greatest.value, least.value
        );
        problems.push(file.greatest_power.problem(message));
    }
    if widening(file).windows(2).any(|w| w[0][0] >= w[1][0]) {
        problems.push(file.spot.problem("write [[spot]] by increasing power"));
    }
    problems
}
