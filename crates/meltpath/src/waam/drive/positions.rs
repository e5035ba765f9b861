//! Ends of moves, and where the positions of programs for them stand in their tables.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_programs::Program;
use meltpath_programs::program::{Instruction, MotionKind, Position, PositionRef};
use meltpath_robot::cell::External;
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
