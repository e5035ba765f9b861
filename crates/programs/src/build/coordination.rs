//! Track and positioner that move with the arm: what the cell has to say of them, and how positions are told with them. Where both are
//! told the track is the first axis.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Pass, Toolpath};

use super::error::BuildError;
use super::steps::{MOST_TURNING, Steps};
use crate::cell::CellProgramming;
use crate::inform::Pulses;
use crate::orientation::pose;
use crate::positioner::{Line, Positioner, UserFrame, turned};
use crate::program::{Axis, Coordinates, Dialect, Position};
use crate::track::Track;

/// What moves with the arm.
#[derive(Debug)]
pub(super) struct Coordination<'a> {
    pub(super) track: Option<&'a Track>,
    pub(super) positioner: Option<&'a Positioner>,
    /// The axes, where positions are told in a frame that does not turn with the part.
    lines: Option<Vec<Line>>,
    pub(super) steps: Steps,
}

impl<'a> Coordination<'a> {
    /// What moves that a toolpath asks for; nothing where it leaves external axes free.
    ///
    /// # Errors
    /// [`BuildError`] where the cell does not say what the controller needs, or no words for it are written.
    pub(super) fn of(
        toolpath: &Toolpath,
        cell: &'a CellProgramming,
        dialect: Dialect,
    ) -> Result<Option<Self>, BuildError> {
        let said = |p: &Pass<'_>| {
            (0..p.points.len())
                .map(|i| p.external(i).flatten().count())
                .max()
        };
        match toolpath.passes().filter_map(|p| said(&p)).max() {
            None | Some(0) => Ok(None),
            Some(most) => Self::of_axes(most, cell, dialect).map(Some),
        }
    }

    /// How `most` axes beside the arm are told.
    fn of_axes(
        most: usize,
        cell: &'a CellProgramming,
        dialect: Dialect,
    ) -> Result<Self, BuildError> {
        let track = cell.track.as_ref();
        if let Some(track) = track {
            check_track(track, cell, dialect)?;
        }
        let positioner = cell.positioner.as_ref();
        if positioner.is_none() && most > usize::from(track.is_some()) {
            return Err(missing(
                dialect,
                "which positioner's external axis turns the part",
                "positioner",
            ));
        }
        let lines = positioner.map(|p| lines(p, cell, dialect)).transpose()?;
        Ok(Coordination {
            track,
            positioner,
            lines: lines.flatten(),
            steps: Steps::of(cell, dialect),
        })
    }

    /// How many axes carry the arm, before those that turn the part.
    pub(super) fn slides(&self) -> usize {
        usize::from(self.track.is_some())
    }

    /// How many axes there are.
    pub(super) fn count(&self) -> usize {
        self.slides() + self.positioner.map_or(0, |p| p.axes.len())
    }

    /// Position, mm, and W, P, R, deg, as the program tells a point of the part where the axes stand so, mm and deg.
    pub(super) fn told(&self, position: DVec3, wpr: [f64; 3], axes: &[f64]) -> (DVec3, [f64; 3]) {
        let Some(lines) = &self.lines else {
            return (position, wpr);
        };
        let turning = axes.iter().skip(self.slides());
        let angles: Vec<f64> = turning.map(|a| a.to_radians()).collect();
        let told = turned(lines, &angles, pose(position, wpr));
        (told.position, told.wpr().to_array().map(f64::to_degrees))
    }
}

/// Whether the cell has the words for programs that tell `most` axes beside the arm: known before anything is planned.
///
/// # Errors
/// [`BuildError`] with the key that is missing, or why the dialect has no such words.
pub fn check_axes(most: usize, cell: &CellProgramming, dialect: Dialect) -> Result<(), BuildError> {
    Coordination::of_axes(most, cell, dialect).map(drop)
}

fn missing(dialect: Dialect, what: &'static str, key: &'static str) -> BuildError {
    BuildError::Cell {
        what,
        dialect: dialect.name(),
        key,
    }
}

/// Whether a controller is told the track in words that are known.
fn check_track(track: &Track, cell: &CellProgramming, dialect: Dialect) -> Result<(), BuildError> {
    let refused = |why| Err(BuildError::Track(dialect.name(), why));
    match dialect {
        _ if track.slides() == 0 => {
            refused("its user frame rides along with the arm (program.track.user_frame)")
        }
        Dialect::Rapid if track.unit.is_none() => Err(missing(
            dialect,
            "the mechanical unit of the track",
            "track.unit",
        )),
        Dialect::Inform if Pulses::of(cell).of_base().is_none() => Err(missing(
            dialect,
            "the pulses a millimetre of the base axis",
            "track.pulses_per_millimetre",
        )),
        Dialect::FanucLs | Dialect::Krl | Dialect::Rapid | Dialect::Inform => Ok(()),
        Dialect::UrScript => refused("its moves say where the arm's joints go, and nothing else"),
        Dialect::Val3 => refused("its points say where the arm goes, and nothing else"),
    }
}

/// The axes of a positioner where positions are told in a frame that does not turn with the part.
fn lines(
    positioner: &Positioner,
    cell: &CellProgramming,
    dialect: Dialect,
) -> Result<Option<Vec<Line>>, BuildError> {
    if !(1..=MOST_TURNING).contains(&positioner.axes.len()) {
        return Err(missing(
            dialect,
            "one to three axes of the positioner",
            "positioner.axis",
        ));
    }
    match dialect {
        Dialect::Inform if Pulses::of(cell).of_station().is_none() => Err(missing(
            dialect,
            "the pulses a degree of each axis of the positioner",
            "positioner.axis.pulses_per_degree",
        )),
        Dialect::FanucLs | Dialect::Inform => match *positioner.user_frame {
            Some(UserFrame::Part) if dialect == Dialect::Inform => Err(missing(
                dialect,
                "that the table turns in the user frame, which stands there,",
                "positioner.user_frame = \"base\"",
            )),
            Some(UserFrame::Part) => Ok(None),
            Some(UserFrame::Base) => positioner.lines().map(Some).ok_or_else(|| {
                missing(
                    dialect,
                    "where the axes of the positioner lie in the user frame",
                    "positioner.axis.origin and direction",
                )
            }),
            None => Err(missing(
                dialect,
                "whether the user frame turns with the part",
                "positioner.user_frame",
            )),
        },
        Dialect::Rapid if positioner.unit.is_none() => Err(missing(
            dialect,
            "the mechanical unit that turns the part",
            "positioner.unit",
        )),
        Dialect::Krl | Dialect::Rapid => Ok(None),
        Dialect::UrScript | Dialect::Val3 => Err(BuildError::Positioner(dialect.name())),
    }
}

/// Tells a position of a coordinated program anew: a pose of the part where the track, mm, and the positioner's axes stand so, rad.
/// Orientation and axes get the digits of a file of the cell in this dialect.
pub fn tell(
    position: &mut Position,
    tip: Pose,
    (track, axes): (Option<f64>, &[f64]),
    (cell, dialect): (&CellProgramming, Dialect),
) {
    let positioner = cell.positioner.as_ref();
    let steps = Steps::of(cell, dialect);
    let degrees = steps.turning(axes);
    let told = |into: &mut [Axis], values: &[f64]| {
        for (axis, value) in into.iter_mut().zip(values) {
            axis.value = *value;
        }
    };
    // FANUC and Yaskawa tell those that turn the part as a group of their own
    let mut apart = false;
    for group in &mut position.groups {
        if let (true, Coordinates::Joint(axes)) = (
            positioner.is_some_and(|p| group.number == *p.group),
            &mut group.coordinates,
        ) {
            told(axes, &degrees);
            apart = true;
        }
    }
    let stands = positioner.filter(|p| apart && *p.user_frame == Some(UserFrame::Base));
    let lines = stands.and_then(Positioner::lines);
    let angles: Vec<f64> = degrees.iter().map(|a| a.to_radians()).collect();
    let pose = lines.map_or(tip, |lines| turned(&lines, &angles, tip));
    let robot = position.groups.iter_mut().find(|g| g.number == 1);
    if let Some(Coordinates::Cartesian {
        xyz,
        wpr_degrees,
        external,
        ..
    }) = robot.map(|g| &mut g.coordinates)
    {
        *xyz = pose.position.to_array();
        *wpr_degrees = pose.wpr().to_array().map(f64::to_degrees);
        let track: Vec<f64> = track.map(|t| steps.track(t)).into_iter().collect();
        told(external, &[track, degrees].concat());
    }
}
