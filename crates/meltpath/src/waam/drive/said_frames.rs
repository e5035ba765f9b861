//! Where a program says in numbers that part and wire tip lie, against the robot that is checked.

use std::collections::BTreeSet;

use meltpath_base::{Check, Status};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::frame_text::shown;
use meltpath_programs::held::Holds;
use meltpath_programs::{Control, Dialect, Program};
use meltpath_robot::cell::{Cell, Values};

use crate::waam::maker::reads;
use crate::waam::program::by_joints::{holds, standing};
use crate::waam::settings::Settings;

/// Places that differ by no more are one: mm, and rad. Programs are written to 1 µm and 0.0001°.
pub(super) const SAME: (f64, f64) = (0.1, 0.01 / 180.0 * std::f64::consts::PI);

/// A place of a program that is not that of the robot's file.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::waam) struct Elsewhere {
    /// What differs, and by how much.
    pub(super) reason: String,
    /// What to write where.
    pub(super) remedy: String,
}

impl Elsewhere {
    /// The same of a program that is delivered beside the one that is judged.
    pub(super) fn of_program(&self, dialect: Dialect) -> Self {
        Elsewhere {
            reason: format!("of the program for {}: {}", dialect.name(), self.reason),
            remedy: self.remedy.clone(),
        }
    }
}

/// What is compared.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Frame {
    Part,
    WireTip,
}

/// Under which number a program says it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Said {
    User(u32),
    Tool(u32),
}

/// The part frames and tools of programs that lie elsewhere than in the robot's file, of those that moves are made in.
pub(in crate::waam) fn elsewhere(
    programs: &[Program],
    controls: &[Control],
    settings: &Settings,
) -> Vec<Elsewhere> {
    let Some(cell) = &settings.robot else {
        return Vec::new();
    };
    if let Some(otherwise) = held_otherwise(programs, controls, cell) {
        return vec![otherwise];
    }
    // where its torch stands a KUKA's base is the torch, and its tool the part
    let turned = |program: u32| {
        let program = programs.get(program as usize);
        holds(cell) == Holds::Part && program.is_some_and(|p| p.dialect == Dialect::Krl)
    };
    let used: BTreeSet<(u32, Frame, Said)> = controls
        .iter()
        .filter(|c| c.holds.is_none_or(Holds::is_sound))
        .flat_map(|c| {
            let (part, tip) = match (turned(c.program), c.frames) {
                (true, (frame, tool)) => (Said::Tool(tool), Said::User(frame)),
                (false, (frame, tool)) => (Said::User(frame), Said::Tool(tool)),
            };
            [
                (c.program, Frame::Part, part),
                (c.program, Frame::WireTip, tip),
            ]
        })
        .collect();
    let differs = |(program, frame, said): (u32, Frame, Said)| {
        let program = programs.get(program as usize)?;
        let said = match said {
            Said::User(number) => program.said_frames.user.get(&number),
            Said::Tool(number) => program.said_frames.tool.get(&number),
        }?;
        let known = reads(cell.maker, program.dialect);
        let checked = checked(frame, cell, settings).filter(|_| known)?;
        differing((frame, holds(cell)), program.dialect, [said, &checked])
    };
    used.into_iter().filter_map(differs).collect()
}

/// Programs that make the robot hold something else than it does in its file.
fn held_otherwise(programs: &[Program], controls: &[Control], cell: &Cell) -> Option<Elsewhere> {
    let file = holds(cell);
    controls.iter().find_map(|control| {
        let program = programs.get(control.program as usize)?;
        let says = control.holds.filter(|says| says.is_sound() && *says != file)?;
        if !reads(cell.maker, program.dialect) {
            return None;
        }
        let words = match program.dialect {
            Dialect::Krl => match says {
                Holds::Part => "$IPO_MODE is #TCP",
                _ => "$IPO_MODE is #BASE, or not set",
            },
            Dialect::Val3 => "tools in tHeld, points in fTorch",
            _ => "robhold of its tooldata and wobjdata",
        };
        let line = program.line_of(control.line);
        Some(Elsewhere {
            reason: format!(
                "the arm was checked with {file} on the robot, and by program {}, line {line}, it holds {says} ({words})",
                program.name
            ),
            remedy: "write what is so into both: arrangement of the robot's file, and what the program says the robot holds".to_owned(),
        })
    })
}

/// Where the robot's file has it: the part in the arm's base, the wire tip in the flange, and where the robot holds the part that in the
/// flange, the wire tip in the world; nothing where that moves.
fn checked(frame: Frame, cell: &Cell, settings: &Settings) -> Option<Pose> {
    // heights of the program count from the plate's
    let below = Pose::at(-DVec3::Z * settings.plate_height.unwrap_or(0.0));
    if let Some(standing) = standing(cell) {
        return Some(match frame {
            Frame::WireTip => standing.world_from_torch,
            Frame::Part => standing.flange_from_part.then(below),
        });
    }
    match frame {
        Frame::WireTip => Some(cell.carrier_from_torch.then(cell.torch_from_wire_tip)),
        // the frame goes with the table, or the base with the track
        Frame::Part if cell.positioner.is_some() || cell.track.is_some() => None,
        Frame::Part => {
            let frames = cell.frames(&Values::default());
            let part = frames.base.inverse().then(frames.part);
            Some(part.then(below))
        }
    }
}

/// How far two places lie apart, mm, and how they are turned, rad.
fn between(a: &Pose, b: &Pose) -> [f64; 2] {
    [
        a.position.distance(b.position),
        a.orientation.angle_between(b.orientation),
    ]
}

/// Whether two places are one.
pub(in crate::waam) fn same(a: &Pose, b: &Pose) -> bool {
    let [apart, turned] = between(a, b);
    apart <= SAME.0 && turned <= SAME.1
}

fn differing(
    (frame, holds): (Frame, Holds),
    dialect: Dialect,
    [said, checked]: [&Pose; 2],
) -> Option<Elsewhere> {
    if same(said, checked) {
        return None;
    }
    let [apart, turned] = between(said, checked);
    let (what, where_from, of_file) = match (frame, holds) {
        (Frame::Part, Holds::Part) => (
            "the part",
            "the flange",
            "[part] of the robot's file, machine.place of the job",
        ),
        (Frame::WireTip, Holds::Part) => {
            ("the wire tip", "the world", "[torch] of the robot's file")
        }
        (Frame::Part, _) => (
            "the part",
            "the arm's base",
            "[table] of the robot's file, machine.place of the job",
        ),
        (Frame::WireTip, _) => ("the wire tip", "the flange", "[torch] of the robot's file"),
    };
    let [said, checked] = [said, checked].map(|pose| shown(dialect, pose));
    let key = match (dialect, frame) {
        (Dialect::Val3, Frame::Part) => {
            "program.val3.part_position and part_angles of the cell file"
        }
        (Dialect::Val3, Frame::WireTip) => {
            "program.val3.tool_position and tool_angles of the cell file"
        }
        (Dialect::UrScript, Frame::Part) => "program.script.part of the cell file",
        (Dialect::UrScript, Frame::WireTip) => "set_tcp of the program",
        (Dialect::Rapid, Frame::Part) => "the wobjdata",
        (_, Frame::Part) => "the user frame",
        (Dialect::Rapid, Frame::WireTip) => "the tooldata",
        (_, Frame::WireTip) => "the tool",
    };
    Some(Elsewhere {
        reason: format!(
            "the arm was checked elsewhere than the program makes it stand: by the program {what} is at {said} in {where_from}, by the robot's file at {checked}, {apart:.1} mm and {:.2} deg apart",
            turned.to_degrees()
        ),
        remedy: format!("measure which is right, and write it into both: {key}; {of_file}"),
    })
}

/// Nothing is decided of an arm that was checked elsewhere than the program makes it stand.
pub(in crate::waam) fn undecided(check: Check, elsewhere: &[Elsewhere]) -> Check {
    let [first, ..] = elsewhere else {
        return check;
    };
    if check.status == Status::NotChecked {
        return check;
    }
    let undecided = Check {
        status: Status::CannotSay,
        reason: String::new(),
        ..check.clone()
    };
    let told = elsewhere.iter().map(|e| e.reason.as_str());
    let told = told.chain((!check.reason.is_empty()).then_some(check.reason.as_str()));
    told.fold(undecided, Check::because)
        .remedy(first.remedy.clone())
}
