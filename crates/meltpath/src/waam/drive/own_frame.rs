//! Positions that programs of others tell in the robot's own frame: the robot's file says where the part lies in it, and they are told in the part's frame.

use std::collections::BTreeSet;

use meltpath_base::Reporter;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::frame_text::shown;
use meltpath_programs::held::Holds;
use meltpath_programs::program::Coordinates;
use meltpath_programs::shared_frames::{is_own, own_frames, tell_in_named, tell_in_part};
use meltpath_programs::{Dialect, Program};
use meltpath_robot::cell::{Cell, Maker};

use crate::waam::drive::said_frames::same;
use crate::waam::maker::reads;
use crate::waam::program::by_joints::holds;
use crate::waam::settings::Settings;

/// Tells the moves of programs that lie in the robot's own frame in that of the part, as far as it is known how these lie to each other, and notes it.
pub(in crate::waam) fn settle(programs: &mut [Program], settings: &Settings, reporter: &Reporter) {
    let Some(cell) = &settings.robot else {
        return;
    };
    let Some(part) = part(cell, settings) else {
        return;
    };
    // what one program selects stays so in those that it calls
    let shared: BTreeSet<u32> = programs
        .iter()
        .filter(|p| p.dialect == Dialect::Krl)
        .flat_map(own_frames)
        .collect();
    let mut told = None;
    for program in programs {
        let (Some(own), Some(name)) = (own(cell, program.dialect), name(program, settings)) else {
            continue;
        };
        let mut numbers: BTreeSet<u32> = own_frames(program).into_iter().collect();
        if program.dialect == Dialect::Krl {
            numbers.extend(shared.iter().filter(|n| is_own(program, **n)));
        }
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

/// Tells the moves of programs in the frame that the cell file calls the part's, as far as they say in numbers how theirs lie to it: the part lies there, in
/// whichever frame the first bead is.
pub(in crate::waam) fn tell_in_cells(programs: &mut [Program], settings: &Settings) {
    for program in programs {
        if let Some(name) = name(program, settings) {
            tell_in_named(program, &name);
        }
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
    if !reads(cell.maker, dialect) {
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

/// Whether a user frame of a program is the robot's own, and another one than the cell file's of the part.
pub(in crate::waam) fn beside_part(program: &Program, number: u32, settings: &Settings) -> bool {
    is_own(program, number) && name(program, settings).is_some()
}

/// What the cell file calls the part's frame; nothing where that is the robot's own.
fn name(program: &Program, settings: &Settings) -> Option<String> {
    let words = &settings.cell.program;
    match program.dialect {
        Dialect::FanucLs | Dialect::Krl | Dialect::Inform => {
            (*words.user_frame != 0).then(|| words.user_frame.to_string())
        }
        Dialect::Rapid => {
            let words = words.rapid.as_ref();
            let object = words.map_or_else(|| OF_PART.to_owned(), |w| w.work_object.to_lowercase());
            (object != "wobj0").then_some(object)
        }
        Dialect::UrScript => {
            let words = words.script.as_ref();
            let base = words.is_some_and(|w| at_base(&w.part));
            (!base).then(|| OF_PART.to_owned())
        }
        Dialect::Val3 => Some(OF_PART.to_owned()),
    }
}

/// What a part's frame is called that the cell file does not name.
const OF_PART: &str = "part";

/// Whether a pose of a script is that of the base: `p[0,0,0,0,0,0]`.
fn at_base(pose: &str) -> bool {
    let inner = pose.trim().strip_prefix("p[");
    let inner = inner.and_then(|p| p.strip_suffix(']'));
    let zero = |v: &str| v.trim().parse::<f64>() == Ok(0.0);
    inner.is_some_and(|all| all.split(',').all(zero))
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
