//! Positions that programs of others tell in the robot's own frame: the robot's file says where the part lies in it, and they are told in the part's frame.

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::frame_text::shown;
use meltpath_programs::held::Holds;
use meltpath_programs::program::Coordinates;
use meltpath_programs::shared_frames::{own_frames, tell_in_part};
use meltpath_programs::{Dialect, Program};
use meltpath_robot::cell::{Cell, Maker};

use crate::waam::drive::said_frames::same;
use crate::waam::program::by_joints::{counts_as, holds};
use crate::waam::settings::Settings;

/// Tells the moves of programs that lie in the robot's own frame in that of the part, as far as it is known how these lie to each other, and notes it.
pub(in crate::waam) fn settle(programs: &mut [Program], settings: &Settings, reporter: &Reporter) {
    let Some(cell) = &settings.robot else {
        return;
    };
    let Some(part) = part(cell, settings) else {
        return;
    };
    let mut told = None;
    for program in programs {
        let (Some(own), Some(name)) = (own(cell, program.dialect), name(program, settings)) else {
            continue;
        };
        let numbers = own_frames(program);
        let said = program.said_frames.user.iter();
        let mut others = said.filter(|(n, _)| !numbers.contains(n));
        // frames that it tells elsewhere lie to its own as it says
        if !others.all(|(_, pose)| same(pose, &part)) || moves_axes(program) {
            continue;
        }
        for number in numbers {
            tell_in_part(program, number, &name, [part, own]);
            told.get_or_insert((program.dialect, own));
        }
    }
    if let Some((dialect, own)) = told {
        note(dialect, [own, part], reporter);
    }
}

/// Where the robot's own frame was taken to lie.
fn note(dialect: Dialect, [own, part]: [Pose; 2], reporter: &Reporter) {
    let height = own.position.z;
    let above = if height > 0.0 {
        format!(", {height:.1} mm above the arm's base")
    } else {
        ", in the arm's base".to_owned()
    };
    let lies = own.inverse().then(part);
    reporter.warn(
        "own-frame",
        format!(
            "positions in the robot's own frame{above}, are told in the part's, which lies at {} in it by the robot's file",
            shown(dialect, &lies)
        ),
        "measure where the part lies, and write it into the robot's file ([table]) or the job (machine.place)",
    );
}

/// Where the part lies in the arm's base while track and positioner rest; nothing where a track carries the arm, or the robot holds the part.
fn part(cell: &Cell, settings: &Settings) -> Option<Pose> {
    let stands = cell.track.is_none() && holds(cell) == Holds::Torch;
    stands.then(|| {
        let frames = cell.frames(&cell.at_rest());
        // heights of the program count from the plate's
        let below = Pose::at(-DVec3::Z * settings.plate_height.unwrap_or(0.0));
        frames.base.inverse().then(frames.part).then(below)
    })
}

/// Where the controller's own frame lies in the arm's base, which stands on the floor: there for KUKA ($ROBROOT), ABB and Universal Robots; on the first axis at the
/// height of the second for FANUC (as ROS-Industrial's `base` of its arms). Of others it is not known here.
fn own(cell: &Cell, dialect: Dialect) -> Option<Pose> {
    if !counts_as(cell.maker, dialect) {
        return None;
    }
    match cell.maker {
        Maker::Kuka | Maker::Abb | Maker::Universal => Some(Pose::IDENTITY),
        Maker::Fanuc => {
            let second = *cell.arm.chain.frames(&[]).get(1)?;
            Some(Pose::at(DVec3::Z * second.position.z))
        }
        Maker::Yaskawa | Maker::Staubli | Maker::Other => None,
    }
}

/// What the cell file calls the part's frame; nothing where that is the robot's own.
fn name(program: &Program, settings: &Settings) -> Option<String> {
    let words = &settings.cell.program;
    match program.dialect {
        Dialect::FanucLs | Dialect::Krl | Dialect::Inform => {
            (*words.user_frame != 0).then(|| words.user_frame.to_string())
        }
        Dialect::Rapid => {
            let object = words.rapid.as_ref()?.work_object.to_lowercase();
            (object != "wobj0").then_some(object)
        }
        Dialect::UrScript | Dialect::Val3 => Some("part".to_owned()),
    }
}

/// Whether an external axis stands elsewhere than at zero: the part may lie elsewhere then.
fn moves_axes(program: &Program) -> bool {
    let groups = program.positions.iter().flat_map(|p| &p.groups);
    let mut axes = groups.flat_map(|g| match &g.coordinates {
        Coordinates::Cartesian { external, .. } => &external[..],
        Coordinates::Joint(axes) if g.number == 1 => axes.get(6..).unwrap_or_default(),
        Coordinates::Joint(axes) => &axes[..],
        Coordinates::Unread(_) => &[],
    });
    axes.any(|axis| axis.value != 0.0)
}
