//! Moves in several frames that a program says in numbers: all are told in those of its first bead.

use meltpath_geometry::Pose;

use super::{Executed, ExecutedKind, ExecutedMotion, FramesAt, Machine};
use crate::held::Holds;
use crate::program::{Coordinates, Instruction, PositionRef};

impl Machine<'_> {
    /// Whether one program says in numbers where both user frames lie.
    pub(super) fn lie_known(&self, [a, b]: [FramesAt; 2]) -> bool {
        let said = &self.programs[a.0].said_frames.user;
        a.0 == b.0
            && self.torch_moves(a.0)
            && [a, b]
                .iter()
                .all(|(_, frames)| said.contains_key(&frames.0))
    }

    /// Whether a program never says that the robot holds anything but the torch: where the torch stands, frames lie to each other otherwise.
    fn torch_moves(&self, program: usize) -> bool {
        let said = &self.said_holds[program];
        said.iter().all(|(_, holds)| *holds == Holds::Torch)
    }

    /// Tells the moves of the program of the first bead in that bead's frames, where it says in numbers how theirs lie to these.
    pub(super) fn tell_in_frames_of_beads(&mut self) {
        let Some((_, (program, frames))) = self.bead_frames else {
            return;
        };
        if !self.torch_moves(program) {
            return;
        }
        let mut executed = std::mem::take(&mut self.executed);
        for step in &mut executed {
            let Executed::Motion(m) = step else { continue };
            let other = m.program as usize == program && m.frames != frames;
            if other && !self.leads_to_joints(m) {
                self.tell_in(m, frames);
            }
        }
        self.executed = executed;
    }

    /// Whether a move's position is given by joints: it is told in the frame of beads already.
    fn leads_to_joints(&self, m: &ExecutedMotion) -> bool {
        let at = (m.line as usize).checked_sub(1);
        let program = &self.programs[m.program as usize];
        let Some(Instruction::Motion(motion)) = at.and_then(|at| program.instructions.get(at))
        else {
            return false;
        };
        let PositionRef::Point { index, .. } = &motion.target else {
            return false;
        };
        let position = self.tables[m.program as usize].get(index);
        let robot = position.and_then(|p| p.robot());
        robot.is_some_and(|g| matches!(g.coordinates, Coordinates::Joint(_)))
    }

    /// Tells a move in other frames, where its program says how they lie. With another tool that is so for joint moves alone: a straight way
    /// of one tip is none of another.
    fn tell_in(&self, m: &mut ExecutedMotion, frames: (u32, u32)) {
        let said = &self.programs[m.program as usize].said_frames;
        let (Some(from), Some(to)) = (said.user.get(&m.frames.0), said.user.get(&frames.0)) else {
            return;
        };
        let tools = [m.frames.1, frames.1].map(|tool| said.tool.get(&tool));
        let tip = match tools {
            _ if m.frames.1 == frames.1 => Pose::IDENTITY,
            [Some(from), Some(to)] if m.kind == ExecutedKind::Joint => from.inverse().then(*to),
            _ => return,
        };
        let shift = to.inverse().then(*from);
        m.target = shift.then(m.target).then(tip);
        if let ExecutedKind::Circular { via } = &mut m.kind {
            *via = shift.point(*via);
        }
        m.frames = frames;
    }
}
