//! How far from level a part lies by the frames that its programs tell in numbers, where no robot's file places it.

use std::collections::BTreeSet;

use meltpath_base::{Check, Status};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::frame_text::shown;
use meltpath_programs::held::Holds;
use meltpath_programs::{Control, Dialect, Program};

use crate::waam::settings::Settings;

/// Beads are measured on tables as level as this, rad: 1°.
pub(super) const LEVEL: f64 = 0.0175;

/// A part, or a torch that stands, that lies aslope if the robot stands upright.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::waam) struct Slope {
    /// From level, or from upright, rad.
    angle: f64,
    /// What says so.
    reason: String,
}

/// The steepest of the frames that moves are made in; nothing where a robot's file places the part, no program tells its frames, or all lie level.
pub(in crate::waam) fn slope(
    programs: &[Program],
    controls: &[Control],
    settings: &Settings,
) -> Option<Slope> {
    if settings.robot.is_some() {
        return None;
    }
    let used: BTreeSet<(u32, (u32, u32), bool)> = controls
        .iter()
        .map(|c| (c.program, c.frames, c.holds == Some(Holds::Part)))
        .collect();
    let slopes = used.into_iter().filter_map(|(program, frames, part)| {
        let program = programs.get(program as usize)?;
        let said = &program.said_frames;
        let (frame, tool) = (said.user.get(&frames.0), said.tool.get(&frames.1));
        let (what, pose, angle) = if part {
            // where its torch stands a KUKA's base is the torch
            let torch = if program.dialect == Dialect::Krl { frame } else { tool }?;
            let from_up = up(torch).angle_between(DVec3::Z);
            ("the torch that stands", torch, from_up.min(std::f64::consts::PI - from_up))
        } else {
            let part = frame?;
            ("the part", part, up(part).angle_between(DVec3::Z))
        };
        (angle > LEVEL).then(|| Slope {
            angle,
            reason: format!(
                "program {} has {what} at {} in the frame of the robot: {:.1} deg from level if the robot stands upright, which no file of a robot says; beads were measured level",
                program.name,
                shown(program.dialect, pose),
                angle.to_degrees()
            ),
        })
    });
    slopes.max_by(|a, b| a.angle.total_cmp(&b.angle))
}

fn up(frame: &Pose) -> DVec3 {
    frame.orientation * DVec3::Z
}

impl Slope {
    /// What says so.
    pub(super) fn reason(&self) -> &str {
        &self.reason
    }

    /// From level, or from upright, rad.
    pub(super) fn angle(&self) -> f64 {
        self.angle
    }

    /// A check of a lean, which hangs on how the robot stands: a fail stays one.
    pub(in crate::waam) fn undecided(&self, check: Check) -> Check {
        match check.status {
            Status::Pass => Check {
                status: Status::CannotSay,
                ..check
            }
            .because(&self.reason)
            .remedy(REMEDY),
            _ => check.because(&self.reason),
        }
    }
}

/// What to do about it.
pub(super) const REMEDY: &str =
    "name the robot, whose file says how it stands and where the part lies (machine.robot)";
