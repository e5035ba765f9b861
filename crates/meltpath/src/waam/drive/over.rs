//! Where no way of the arm holds a whole program: on which travels it goes over to another one, and the programs with joint moves there.
//!
//! Between two beads the arm goes up, over and down again. Where it must change its way, the move over is a joint move: both its ends are raised
//! until it keeps clear of what stands around, as far as a height does.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use meltpath_base::Observer;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::Program;
use meltpath_programs::program::{
    Coordinates, Instruction, MotionInstruction, MotionKind, Termination,
};
use meltpath_robot::command::{Kind, Source};
use meltpath_robot::posture::{Change, NotHeld, Task, changes, turned_back};

use crate::waam::program::Commands;

/// How much higher the ends of such a move lie than those of other travels, mm, one after the other until it keeps clear.
pub(in crate::waam) const LIFTS: [f64; 5] = [0.0, 50.0, 100.0, 200.0, 400.0];

/// A torch that turns farther between two beads points in another direction; one that leans farther stands on a flank, rad.
const TURN: f64 = std::f64::consts::FRAC_PI_4;

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

/// The travels on which a positioner that is free turns back, so that the torch can stand upright along the beads.
///
/// # Errors
/// [`NotHeld`] where no way holds the program.
pub(in crate::waam) fn turned_back_in_the_air(
    task: &Task<'_>,
    moves: &Commands,
    observer: &dyn Observer,
) -> Result<Vec<Change>, NotHeld> {
    turned_back(task, &travels(moves), observer)
}

/// Of each way between two beads the move that goes over: the one that stays highest, and of those the longest.
pub(in crate::waam) fn travels(moves: &Commands) -> BTreeSet<u32> {
    let all = from_places(moves);
    between_beads(&all).map(|between| between.over).collect()
}

/// A way between two beads.
pub(in crate::waam) struct Between {
    /// The move that goes over.
    pub(in crate::waam) over: u32,
    /// Its first move, and its last.
    pub(in crate::waam) moves: RangeInclusive<u32>,
    /// How far the torch turns to another direction, rad.
    turn: f64,
}

/// More such ways than this are those of fronts over one part, not between parts: every one would have to be looked for and to keep clear.
const FEW: usize = 8;

/// The ways between beads whose torches point in other directions, where they are few: a table that is free turns the part over meanwhile.
pub(in crate::waam) fn turns(moves: &Commands) -> Vec<Between> {
    let all = from_places(moves);
    let other = between_beads(&all).filter(|between| between.turn > TURN);
    let found: Vec<Between> = other.collect();
    if found.len() > FEW { Vec::new() } else { found }
}

/// Moves, each with where it begins.
fn from_places(moves: &Commands) -> Vec<Move<'_>> {
    let mut here = moves.start;
    let places = moves.commands.iter().map(|command| {
        let from = here;
        if !matches!(command.kind, Kind::Wait { .. }) {
            here = end(command);
        }
        (from, command)
    });
    places.collect()
}

fn between_beads<'a>(all: &'a [Move<'a>]) -> impl Iterator<Item = Between> + 'a {
    let burns = |source: Source| matches!(source, Source::On { .. });
    let stretches = all.chunk_by(move |a, b| burns(a.1.source) == burns(b.1.source));
    stretches.filter_map(|between| {
        // the first leaves a bead, the last goes down to one
        let [first, inner @ .., last] = between else {
            return None;
        };
        let lines = inner
            .iter()
            .filter(|(_, c)| c.source == Source::Off && c.kind == Kind::Line);
        let highest = lines.max_by(|a, b| {
            let low = |m: &(_, _)| lowest(m);
            low(a).total_cmp(&low(b)).then(way(a).total_cmp(&way(b)))
        });
        let axes = [first.0, end(last.1)].map(Pose::tool_axis);
        highest.map(|(_, over)| Between {
            over: over.id,
            moves: first.1.id..=last.1.id,
            turn: axes[0].angle_between(axes[1]),
        })
    })
}

type Move<'a> = (Pose, &'a meltpath_robot::Command);

/// Where a move ends.
fn end(command: &meltpath_robot::Command) -> Pose {
    Pose {
        position: command.target,
        orientation: command.orientation,
    }
}

/// Height of the lower end of a move, mm.
fn lowest((from, command): &Move<'_>) -> f64 {
    from.position.z.min(command.target.z)
}

fn way((from, command): &Move<'_>) -> f64 {
    from.position.distance(command.target)
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
            motion.speed.clone_from(&example.speed);
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

/// Raises the position that a move goes to, or draws it back along a torch that leans far.
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
    let coordinates = &mut groups.first_mut()?.coordinates;
    if let Coordinates::Cartesian {
        xyz, wpr_degrees, ..
    } = coordinates
    {
        let wpr = DVec3::from_array(wpr_degrees.map(f64::to_radians));
        let axis = Pose::from_wpr(DVec3::ZERO, wpr).tool_axis();
        // beside a flank the way up may lead through what stands above
        let out = if axis.z < TURN.cos() { axis } else { DVec3::Z };
        for (x, out) in xyz.iter_mut().zip(out.to_array()) {
            *x += lift * out;
        }
    }
    Some(())
}
