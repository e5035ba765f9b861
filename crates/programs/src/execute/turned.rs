//! How the tool is turned along moves by a path that lead it otherwise than from how it is turned at the begin to what is taught at the end: it keeps
//! its turn (KUKA's `#CONSTANT`), or the controller leads the wrist (`#JOINT`, `Wjnt`, `SingArea\Wrist`) or turns it with the path.

use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};

use super::beside::Place;
use super::effect::first_word;
use super::path::Came;
use super::{Executed, Machine, Missing};
use crate::held::Holds;
use crate::modal::{Orientation, Round};
use crate::program::{Dialect, MotionInstruction, MotionKind};

/// Orientations that are nearer are one, °: programs write their three angles to a thousandth.
const SAME: f64 = 0.01;
/// Beside a line by no more is on it, mm: as far as frames of a program and those that are checked may lie apart.
const BESIDE: f64 = 0.1;

impl Machine<'_> {
    /// Turns the tool at the end of a move as the controller does, and tells where that is not followed.
    pub(super) fn turn(&mut self, motion: &MotionInstruction, end: &mut Place, frames: (u32, u32)) {
        if motion.kind == MotionKind::Joint {
            return;
        }
        let circle = matches!(motion.kind, MotionKind::Circular { .. });
        let along = turned_along(motion, circle.then_some(self.now.round));
        if let Some(why) = along {
            return self.gap(Missing::Turned(why));
        }
        let by_word = motion.extra.iter().any(|word| first_word(word) == "WJNT");
        let led = match self.now.orientation {
            Orientation::Taught if by_word => Orientation::Free,
            set => set,
        };
        if led == Orientation::Taught {
            return;
        }
        let begin = self.turned_at_begin(frames);
        let word = match self.programs[self.at.0].dialect {
            Dialect::Krl => "$ORI_TYPE",
            Dialect::Rapid => "SingArea",
            _ => "Wjnt",
        };
        let turned = |begin: DQuat| begin.angle_between(end.pose.orientation).to_degrees();
        match (led, begin) {
            (Orientation::Kept, Some(begin)) => end.pose.orientation = begin,
            (Orientation::Kept, None) => self.gap(Missing::Turned(word.to_owned())),
            (_, Some(begin)) if turned(begin) <= SAME => {}
            // where the robot comes from no program says
            _ if self.came == Came::Unknown && self.last_move().is_none() => {}
            _ if self.arc.is_some() => self.gap(Missing::Turns(word.to_owned())),
            _ => self.leaves_out(Missing::Turns(word.to_owned())),
        }
    }

    /// Tells a move along which the torch leaves the line over a part that is led to it point by point: by no more than a quarter of its length
    /// times the angle by which the part turns.
    pub(super) fn look_at_bend(
        &mut self,
        motion: &MotionInstruction,
        (end, via): (&Place, Option<DVec3>),
        frames: (u32, u32),
    ) {
        let leads_points = self.programs[self.at.0].dialect == Dialect::Val3;
        if !leads_points || motion.kind == MotionKind::Joint || end.by_joints {
            return;
        }
        let (Some(Holds::Part), Some(turned), Some(begin)) = (
            self.holds_here(),
            self.turned_at_begin(frames),
            self.last_target(),
        ) else {
            return;
        };
        let to = end.pose.position;
        let via = via.unwrap_or(to);
        let length = begin.position.distance(via) + via.distance(to);
        let angle = turned.angle_between(end.pose.orientation);
        if 0.25 * length * angle <= BESIDE {
            return;
        }
        let how = format!("by {:.1} deg over {length:.1} mm", angle.to_degrees());
        if self.arc.is_some() {
            self.gap(Missing::Bends(how));
        } else {
            self.leaves_out(Missing::Bends(how));
        }
    }

    /// How the tool is turned where a move begins that leads through these frames; nothing where that is not known in them.
    fn turned_at_begin(&self, frames: (u32, u32)) -> Option<DQuat> {
        let here = (self.at.0, frames);
        let known = match self.came {
            Came::ByJoints(at) | Came::Along(at) => at == here,
            // told in the frames of beads
            Came::Joints => self.bead_frames.as_ref().is_none_or(|(_, at)| *at == here),
            Came::Unknown | Came::Told => false,
        };
        self.last_move().filter(|_| known)
    }

    /// How the tool is turned at the end of the last move.
    fn last_move(&self) -> Option<DQuat> {
        self.last_target().map(|pose| pose.orientation)
    }

    /// Where the last move led to.
    fn last_target(&self) -> Option<Pose> {
        let mut before = self.executed.iter().rev();
        before.find_map(|step| match step {
            Executed::Motion(m) => Some(m.target),
            Executed::Wait { .. } => None,
        })
    }
}

/// What turns the tool with the path of a circle.
fn turned_along(motion: &MotionInstruction, round: Option<Round>) -> Option<String> {
    let mode = motion.extra.iter().find(|word| first_word(word) == "MODE");
    let by_path = round == Some(Round::Path);
    mode.cloned()
        .or_else(|| by_path.then(|| "$CIRC_TYPE".to_owned()))
}
