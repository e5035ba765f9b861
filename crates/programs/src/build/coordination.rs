//! A positioner that moves with the arm: what the cell has to say of it, and how positions are told with it.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Pass, Toolpath};

use super::error::BuildError;
use crate::cell::CellProgramming;
use crate::orientation::pose;
use crate::positioner::{Line, Positioner, UserFrame, turned};
use crate::program::{Axis, Coordinates, Dialect, Position};

/// Most axes of a positioner.
pub(super) const MOST_AXES: usize = 3;
/// Axes are written and read in steps of this, deg.
const STEP: f64 = 1e-3;

/// How a positioner moves with the arm.
#[derive(Debug)]
pub(super) struct Coordination<'a> {
    pub(super) positioner: &'a Positioner,
    /// The axes, where positions are told in a frame that does not turn with the part.
    lines: Option<Vec<Line>>,
}

impl<'a> Coordination<'a> {
    /// How the positioner moves that a toolpath asks for; nothing where it leaves external axes free.
    ///
    /// # Errors
    /// [`BuildError`] where the cell does not say what the controller needs, or no words for it are written.
    pub(super) fn of(
        toolpath: &Toolpath,
        cell: &'a CellProgramming,
        dialect: Dialect,
    ) -> Result<Option<Self>, BuildError> {
        let says =
            |p: &Pass<'_>| (0..p.points.len()).any(|i| p.external(i).flatten().next().is_some());
        if !toolpath.passes().any(|p| says(&p)) {
            return Ok(None);
        }
        let missing = |what, key| BuildError::Cell {
            what,
            dialect: dialect.name(),
            key,
        };
        let positioner = cell.positioner.as_ref();
        let positioner = positioner.ok_or_else(|| {
            missing(
                "which positioner's external axis turns the part",
                "positioner",
            )
        })?;
        if !(1..=MOST_AXES).contains(&positioner.axes.len()) {
            return Err(missing(
                "one to three axes of the positioner",
                "positioner.axis",
            ));
        }
        let mut lines = None;
        match dialect {
            Dialect::FanucLs => match *positioner.user_frame {
                Some(UserFrame::Part) => {}
                Some(UserFrame::Base) => {
                    let told = positioner.lines();
                    lines = Some(told.ok_or_else(|| {
                        missing(
                            "where the axes of the positioner lie in the user frame",
                            "positioner.axis.origin and direction",
                        )
                    })?);
                }
                None => {
                    return Err(missing(
                        "whether the user frame turns with the part",
                        "positioner.user_frame",
                    ));
                }
            },
            Dialect::Rapid if positioner.unit.is_none() => {
                return Err(missing(
                    "the mechanical unit that turns the part",
                    "positioner.unit",
                ));
            }
            Dialect::Krl | Dialect::Rapid => {}
            Dialect::UrScript | Dialect::Inform | Dialect::Val3 => {
                return Err(BuildError::Positioner(dialect.name()));
            }
        }
        Ok(Some(Coordination { positioner, lines }))
    }

    /// How many axes there are.
    pub(super) fn count(&self) -> usize {
        self.positioner.axes.len()
    }

    /// Position, mm, and W, P, R, deg, as the program tells a point of the part where the axes stand so, deg.
    pub(super) fn told(&self, position: DVec3, wpr: [f64; 3], axes: &[f64]) -> (DVec3, [f64; 3]) {
        let Some(lines) = &self.lines else {
            return (position, wpr);
        };
        let angles: Vec<f64> = axes.iter().map(|a| a.to_radians()).collect();
        let told = turned(lines, &angles, pose(position, wpr));
        (told.position, told.wpr().to_array().map(f64::to_degrees))
    }
}

/// Tells a position of a coordinated program anew: a pose of the part where the positioner's axes stand so, rad. Orientation and axes
/// get the digits of a file.
pub fn tell(position: &mut Position, tip: Pose, axes: &[f64], positioner: &Positioner) {
    let degrees: Vec<f64> = axes.iter().map(|a| stepped(a.to_degrees())).collect();
    let told = |into: &mut [Axis]| {
        for (axis, value) in into.iter_mut().zip(&degrees) {
            axis.value = *value;
        }
    };
    // a FANUC tells them as a group of their own
    let mut apart = false;
    for group in &mut position.groups {
        if let (true, Coordinates::Joint(axes)) =
            (group.number == *positioner.group, &mut group.coordinates)
        {
            told(axes);
            apart = true;
        }
    }
    let stands = *positioner.user_frame == Some(UserFrame::Base);
    let lines = positioner.lines().filter(|_| apart && stands);
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
        told(external);
    }
}

/// The external axes at a point of a pass, deg; zeros where it says none.
pub(super) fn axes_at(pass: &Pass<'_>, i: usize) -> [f64; MOST_AXES] {
    let mut axes = [0.0; MOST_AXES];
    for (axis, said) in axes.iter_mut().zip(pass.external(i)) {
        *axis = stepped(said.unwrap_or(0.0).to_degrees());
    }
    axes
}

/// Halfway between two places of the axes.
pub(super) fn halfway(a: [f64; MOST_AXES], b: [f64; MOST_AXES]) -> [f64; MOST_AXES] {
    std::array::from_fn(|i| stepped(0.5 * (a[i] + b[i])))
}

fn stepped(degrees: f64) -> f64 {
    (degrees / STEP).round() * STEP
}
