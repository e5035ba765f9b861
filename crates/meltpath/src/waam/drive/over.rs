//! Where no way of the arm holds a whole program: on which travels it goes over to another one, and the programs with joint moves there.
//!
//! Between two beads the arm goes up, over and down again. Where it must change its way, the move over is a joint move: both its ends are raised
//! until it keeps clear of what stands around, as far as a height does.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::Observer;
use meltpath_programs::Program;
use meltpath_programs::program::{
    Coordinates, Instruction, MotionInstruction, MotionKind, Termination,
};
use meltpath_robot::command::{Kind, Source};
use meltpath_robot::posture::{Change, NotHeld, Task, changes};

use crate::waam::program::Commands;

/// How much higher the ends of such a move lie than those of other travels, mm, one after the other until it keeps clear.
pub(in crate::waam) const LIFTS: [f64; 5] = [0.0, 50.0, 100.0, 200.0, 400.0];

/// The travels on which the arm goes over to another way.
///
/// # Errors
/// [`NotHeld`] where no way holds a stretch between two of them.
pub(in crate::waam) fn in_the_air(
    task: &Task<'_>,
    moves: &Commands,
    observer: &dyn Observer,
) -> Result<Vec<Change>, NotHeld> {
    changes(task, &travels(moves), observer)
}

/// Of each way between two beads the move that goes over: the one that stays highest, and of those the longest.
pub(in crate::waam) fn travels(moves: &Commands) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    let mut here = moves.start.position;
    let places = moves.commands.iter().map(|command| {
        let from = here;
        if !matches!(command.kind, Kind::Wait { .. }) {
            here = command.target;
        }
        (from, command)
    });
    let all: Vec<_> = places.collect();
    let burns = |source: Source| matches!(source, Source::On { .. });
    for between in all.chunk_by(|a, b| burns(a.1.source) == burns(b.1.source)) {
        // the first leaves a bead, the last goes down to one
        let [_, inner @ .., _] = between else {
            continue;
        };
        let lines = inner
            .iter()
            .filter(|(_, c)| c.source == Source::Off && c.kind == Kind::Line);
        let highest = lines.max_by(|a, b| {
            let low = |m: &(_, _)| lowest(m);
            low(a).total_cmp(&low(b)).then(way(a).total_cmp(&way(b)))
        });
        found.extend(highest.map(|(_, c)| c.id));
    }
    found
}

type Move<'a> = (meltpath_geometry::math::DVec3, &'a meltpath_robot::Command);

/// Height of the lower end of a move, mm.
fn lowest((from, command): &Move<'_>) -> f64 {
    from.z.min(command.target.z)
}

fn way((from, command): &Move<'_>) -> f64 {
    from.distance(command.target)
}

/// Makes joint moves of travels, their ends `lift` mm higher; `false` where the programs have none to learn its speed from.
pub(in crate::waam) fn write(
    programs: &mut [Program],
    moves: &Commands,
    changes: &[Change],
    lift: f64,
) -> bool {
    let Some(example) = programs.iter().find_map(joint_move) else {
        return false;
    };
    let tables: Vec<BTreeMap<u32, usize>> = programs.iter().map(table).collect();
    for change in changes {
        let at = change.command as usize;
        let line = |i: usize| moves.line_of_command.get(i).copied();
        // the move before leads up to where this one begins, and stops there
        if let Some(place) = at.checked_sub(1).and_then(line)
            && let Some(motion) = motion(programs, place)
            && motion.arc.is_none()
        {
            motion.termination = Termination::Fine;
            raise(programs, &tables, place, lift);
        }
        let Some(place) = line(at) else { continue };
        if let Some(motion) = motion(programs, place) {
            motion.kind = MotionKind::Joint;
            motion.speed = example.speed;
            motion.termination = example.termination.clone();
            motion.extra.clear();
        }
        raise(programs, &tables, place, lift);
    }
    true
}

/// The first joint move of a program.
fn joint_move(program: &Program) -> Option<MotionInstruction> {
    let motions = program.instructions.iter().filter_map(|i| match i {
        Instruction::Motion(motion) => Some(motion),
        _ => None,
    });
    let mut joint = motions.filter(|m| m.kind == MotionKind::Joint);
    joint.next().cloned()
}

fn table(program: &Program) -> BTreeMap<u32, usize> {
    let positions = program.positions.iter().zip(0..);
    positions.map(|(p, i)| (p.index, i)).collect()
}

/// The move at a place: program, from 0, and instruction, from 1.
fn motion(programs: &mut [Program], (program, line): (u32, u32)) -> Option<&mut MotionInstruction> {
    let program = programs.get_mut(program as usize)?;
    let instruction = program
        .instructions
        .get_mut((line as usize).checked_sub(1)?)?;
    match instruction {
        Instruction::Motion(motion) => Some(motion),
        _ => None,
    }
}

/// Raises the position that a move goes to.
fn raise(
    programs: &mut [Program],
    tables: &[BTreeMap<u32, usize>],
    place: (u32, u32),
    lift: f64,
) -> Option<()> {
    let meltpath_programs::program::PositionRef::Point { index, .. } =
        motion(programs, place)?.target
    else {
        return None;
    };
    let number = tables.get(place.0 as usize)?.get(&index)?;
    let program = programs.get_mut(place.0 as usize)?;
    let groups = &mut program.positions.get_mut(*number)?.groups;
    if let Coordinates::Cartesian { xyz, .. } = &mut groups.first_mut()?.coordinates {
        xyz[2] += lift;
    }
    Some(())
}
