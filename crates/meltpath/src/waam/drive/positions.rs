//! Ends of moves, and what the positions of programs say of them: where, how the arm stands, and how the torch is turned.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_programs::program::{
    Axis, Coordinates, Instruction, MotionKind, Position, PositionRef,
};
use meltpath_programs::{Dialect, Program};
use meltpath_robot::cell::{Cell, External, Stance, Values};
use meltpath_robot::command::Kind;
use meltpath_robot::posture::End;

use crate::waam::program::Commands;

/// An end of a move.
pub(in crate::waam) struct Reached {
    /// The move; nothing for the start.
    pub(in crate::waam) command: Option<u32>,
    pub(in crate::waam) end: End,
    pub(in crate::waam) tip: Pose,
    pub(in crate::waam) joints: [f64; 6],
    pub(in crate::waam) external: External,
}

/// Where the positions of programs stand in their tables.
pub(in crate::waam) struct Positions(Vec<BTreeMap<u32, usize>>);

impl Positions {
    pub(in crate::waam) fn of(programs: &[Program]) -> Self {
        let table = |p: &Program| {
            p.positions
                .iter()
                .zip(0..)
                .map(|(p, i)| (p.index, i))
                .collect()
        };
        Positions(programs.iter().map(table).collect())
    }

    /// The position at the end of a move.
    pub(in crate::waam) fn at<'a>(
        &self,
        programs: &'a mut [Program],
        moves: &Commands,
        reached: &Reached,
    ) -> Option<&'a mut Position> {
        let (program, line) = match reached.command {
            Some(command) => *moves.line_of_command.get(command as usize)?,
            None => moves.start_line,
        };
        let table = self.0.get(program as usize)?;
        let program = programs.get_mut(program as usize)?;
        let instruction = program.instructions.get((line as usize).checked_sub(1)?)?;
        let Instruction::Motion(motion) = instruction else {
            return None;
        };
        let reference = match (reached.end, &motion.kind) {
            (End::Target, _) => &motion.target,
            (End::Via, MotionKind::Circular { via }) => via,
            (End::Via, _) => return None,
        };
        let PositionRef::Point { index, .. } = reference else {
            return None;
        };
        program.positions.get_mut(*table.get(index)?)
    }
}

/// How the arm stands, where the dialect has its maker's words.
pub(in crate::waam) fn stance(cell: &Cell, dialect: Dialect, joints: [f64; 6]) -> Option<Stance> {
    let stance = cell.stance(joints)?;
    let spoken = match stance {
        Stance::Fanuc(_) => Dialect::FanucLs,
        Stance::Kuka { .. } => Dialect::Krl,
        Stance::Abb(_) => Dialect::Rapid,
        Stance::Joints(_) => Dialect::UrScript,
        Stance::Yaskawa(_) => Dialect::Inform,
        Stance::Staubli(_) => Dialect::Val3,
    };
    (spoken == dialect).then_some(stance)
}

/// How the arm stands, as a position says; `reached` with the wire's tip there, and with track and positioner.
pub(in crate::waam) fn written_stance(
    position: &mut Position,
    cell: &Cell,
    (tip, external): (Pose, External),
) -> Option<Stance> {
    match of_robot(position)? {
        Coordinates::Cartesian { config, .. } => Stance::read(cell.maker, config),
        Coordinates::Joint(axes) => {
            let (shown, _) = Axis::of_arm(axes)?;
            let joints = cell.arm.joints(shown.map(f64::to_radians));
            let flange = cell.base_from_flange(tip, &Values::of(joints, external));
            // a move may shift its target: then only the way of the arm is said
            if cell.arm.holds(flange, joints) {
                Some(Stance::Joints(shown))
            } else {
                cell.stance(joints)
            }
        }
        Coordinates::Unread(_) => None,
    }
}

/// The robot's coordinates of a position.
pub(super) fn of_robot(position: &mut Position) -> Option<&mut Coordinates> {
    let robot = position.groups.iter_mut().find(|g| g.number == 1)?;
    Some(&mut robot.coordinates)
}

/// Writes rotation and configuration into a position.
pub(super) fn hold_so(coordinates: &mut Coordinates, stance: Option<Stance>, tip: Pose) {
    let said = stance.map(|s| s.to_string());
    if let Coordinates::Cartesian {
        config,
        wpr_degrees: wpr,
        ..
    } = coordinates
    {
        *wpr = tip.wpr().to_array().map(f64::to_degrees);
        *config = said.unwrap_or_else(|| std::mem::take(config));
    }
}

/// How joint moves end, as the program says.
pub(in crate::waam) fn named(
    positions: &Positions,
    programs: &mut [Program],
    moves: &Commands,
    cell: &Cell,
) -> BTreeMap<Option<u32>, Stance> {
    let mut named = BTreeMap::new();
    let joint = moves
        .commands
        .iter()
        .filter(|c| matches!(c.kind, Kind::Joint(_)));
    let start = (None, moves.start);
    let rest = cell.at_rest().external();
    let ends = joint.map(|c| {
        (
            Some(c.id),
            Pose {
                position: c.target,
                orientation: c.orientation,
            },
        )
    });
    for (command, tip) in std::iter::once(start).chain(ends) {
        let external = moves.external.as_ref().map_or(rest, |a| a.at(command));
        let reached = Reached {
            command,
            end: End::Target,
            tip,
            joints: [0.0; 6],
            external,
        };
        let written = positions.at(programs, moves, &reached);
        if let Some(stance) = written.and_then(|c| written_stance(c, cell, (tip, external))) {
            named.insert(command, stance);
        }
    }
    named
}

/// Whether a command is a joint move.
pub(super) fn joint_move(moves: &Commands, command: Option<u32>) -> bool {
    let command = command.and_then(|c| moves.commands.get(c as usize));
    command.is_some_and(|c| matches!(c.kind, Kind::Joint(_)))
}

/// How the arm stands at the start and at the ends of joint moves: as the program says, and as it was chosen where the program has no words for it.
pub(super) fn stands(
    named: &BTreeMap<Option<u32>, Stance>,
    moves: &Commands,
) -> BTreeMap<Option<u32>, Stance> {
    let mut stands = moves.stands.clone();
    stands.extend(named.iter().map(|(command, stance)| (*command, *stance)));
    stands
}
