//! Where the axes stand that are not the arm's: external ones of its own group, and those of further groups.

use meltpath_geometry::Pose;

use super::ExecutionSettings;
use crate::krl;
use crate::positioner::Turning;
use crate::program::{Axis, Coordinates, Dialect, Position, Program};

/// Where a position lies.
pub(super) struct Place {
    pub(super) pose: Pose,
    /// External axes of the robot's group, mm or rad.
    pub(super) own: Vec<f64>,
    /// How many of them, from the first on, carry the arm alone.
    pub(super) slides: usize,
    /// Axes of further groups, mm or rad.
    pub(super) further: Vec<f64>,
    /// The positioner is known, and the pose is that in the part.
    pub(super) turns: bool,
    /// It is given by joints: whatever frames are selected.
    pub(super) by_joints: bool,
    /// It tells its external axes, be it that it has none.
    pub(super) tells_axes: bool,
}

impl Place {
    /// A place that tells no external axes.
    pub(super) fn bare(pose: Pose, by_joints: bool) -> Self {
        Place {
            pose,
            own: Vec::new(),
            slides: 0,
            further: Vec::new(),
            turns: false,
            by_joints,
            tells_axes: false,
        }
    }
}

/// Axes beside the arm's joints at a position.
pub(super) struct Beside {
    /// External axes of the robot's group, mm or rad.
    pub(super) own: Vec<f64>,
    /// How many of them, from the first on, carry the arm alone.
    pub(super) slides: usize,
    /// Axes of further groups, mm or rad.
    pub(super) further: Vec<f64>,
    /// Those of them that turn the part, rad.
    pub(super) angles: Option<Vec<f64>>,
    /// The external axes of the robot's group are those that turn the part.
    pub(super) carried: bool,
    /// Further groups that stand elsewhere than at zero, and nobody says what they move.
    pub(super) unknown: Vec<u32>,
}

impl Beside {
    /// At a position of a program.
    pub(super) fn of(settings: &ExecutionSettings, program: &Program, position: &Position) -> Self {
        let turning = turning(settings, program);
        let (mut further, mut angles, mut unknown) = (Vec::new(), None, Vec::new());
        for other in position.groups.iter().filter(|g| g.number != 1) {
            let axes: Vec<f64> = match &other.coordinates {
                Coordinates::Joint(axes) => axes.iter().map(value).collect(),
                Coordinates::Cartesian { .. } | Coordinates::Unread(_) => Vec::new(),
            };
            let is_its = |t: &Turning| (t.group, t.count) == (other.number, axes.len());
            if turning.is_some_and(is_its) {
                angles = Some(axes.clone());
            } else if moved_away(&other.coordinates) {
                unknown.push(other.number);
            }
            further.extend(axes);
        }
        let external = match position.robot().map(|g| &g.coordinates) {
            Some(Coordinates::Cartesian { external, .. }) => &external[..],
            Some(Coordinates::Joint(axes)) => axes.get(6..).unwrap_or_default(),
            Some(Coordinates::Unread(_)) | None => &[],
        };
        let external = there(settings, turning, external);
        let apart = program.dialect.tells_stations_apart();
        let slides = settings.slides.min(external.len());
        let carried = !apart && turning.is_some_and(|t| slides + t.count == external.len());
        let known = settings.turning.get(&external.len());
        let turns = |axis: usize| {
            axis >= slides && (carried || known.is_some_and(|k| k.get(axis) == Some(&true)))
        };
        let own = external.iter().enumerate().map(|(axis, said)| {
            if said.unit.is_empty() && turns(axis) {
                said.value.to_radians()
            } else {
                value(said)
            }
        });
        let own = own.collect();
        Beside {
            own,
            slides,
            further,
            angles,
            carried,
            unknown,
        }
    }
}

impl ExecutionSettings {
    /// Where the external axes stand at a position of a program, mm or rad: those of the robot's group, then those of further groups.
    pub fn external_axes(&self, program: &Program, position: &Position) -> Vec<f64> {
        let beside = Beside::of(self, program, position);
        [beside.own, beside.further].concat()
    }
}

/// What turns the part, as far as it is known in a program.
pub(super) fn turning<'a>(
    settings: &'a ExecutionSettings,
    program: &Program,
) -> Option<&'a Turning> {
    let known = |t: &&Turning| match program.dialect {
        Dialect::FanucLs => t.told,
        Dialect::Krl => krl::is_coupled_to(program, t.machine),
        Dialect::Rapid => true,
        // its user frame stands, whatever turns
        Dialect::Inform => t.told && t.lines.is_some(),
        Dialect::UrScript | Dialect::Val3 => false,
    };
    settings.positioner.as_ref().filter(known)
}

/// The external axes that there are: inline forms list six, the others at zero.
fn there<'a>(
    settings: &ExecutionSettings,
    turning: Option<&Turning>,
    listed: &'a [Axis],
) -> &'a [Axis] {
    let known = settings.turning.keys().copied();
    let told = settings.slides + turning.map_or(0, |t| t.count);
    let most = known.chain((told > 0).then_some(told)).max();
    match most.and_then(|count| listed.split_at_checked(count)) {
        Some((there, others)) if others.iter().all(|a| a.value == 0.0) => there,
        _ => listed,
    }
}

/// Where an axis stands, mm or rad.
fn value(axis: &Axis) -> f64 {
    if axis.unit.eq_ignore_ascii_case("deg") {
        axis.value.to_radians()
    } else {
        axis.value
    }
}

/// Whether the axes of a further group stand elsewhere than at zero.
fn moved_away(coordinates: &Coordinates) -> bool {
    match coordinates {
        Coordinates::Joint(axes) => axes.iter().any(|a| a.value != 0.0),
        Coordinates::Cartesian { .. } | Coordinates::Unread(_) => true,
    }
}
