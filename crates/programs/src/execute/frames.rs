//! Moves in several frames that a program says in numbers: all are told in those of its first bead.

use meltpath_geometry::Pose;

use super::path::{Came, FramesAt};
use super::{Executed, ExecutedKind, ExecutedMotion, Machine, Missing};
use crate::held::Holds;
use crate::program::{Coordinates, Instruction, PositionRef};

impl Machine<'_> {
    /// Tells a move of a bead that goes from other frames than it leads to: what lies between is one way only where both are known to be one.
    pub(super) fn look_at_start(&mut self, frames: (u32, u32)) {
        let now = (self.at.0, frames);
        let (from, by_joints) = match self.came {
            Came::Unknown => return self.gap(Missing::Begins),
            Came::Joints | Came::Told => return,
            Came::ByJoints(from) => (from, true),
            Came::Along(from) => (from, false),
        };
        if from == now {
            return;
        }
        let [before, here] = [from, now].map(|at| self.programs[at.0].frame_names(at.1));
        if before != here && !self.is_told_alike([from, now], by_joints) {
            self.gap(Missing::Across(before, here));
        }
    }

    /// Tells a round move whose point on the way is in other frames than its end.
    pub(super) fn look_at_via(&mut self, of_via: (Option<u32>, Option<u32>)) {
        let all = [of_via, self.frames].map(|(frame, tool)| frame.zip(tool));
        if let [Some(via), Some(end)] = all
            && via != end
        {
            let [via, end] = [via, end].map(|at| self.programs[self.at.0].frame_names(at));
            self.gap(Missing::Across(via, end));
        }
    }

    /// Whether the end of a move and that of the next are told in the frames of the first bead both.
    fn is_told_alike(&self, [from, now]: [FramesAt; 2], by_joints: bool) -> bool {
        let Some((_, first)) = self.bead_frames else {
            return false;
        };
        let tools = &self.programs[now.0].said_frames.tool;
        let known = [from, now].iter().all(|at| tools.contains_key(&at.1.1));
        let same_tip = from.1.1 == now.1.1 || (by_joints && known);
        same_tip && self.lie_known([from, now]) && self.lie_known([first, now])
    }

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
