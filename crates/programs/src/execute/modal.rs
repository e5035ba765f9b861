//! What lines have set for the moves to come while programs run that call each other: speed, acceleration, rounded corners.

use std::borrow::Cow;

use super::{Machine, ProgramError};
use crate::modal::{Orientation, Own, Said, Sets};
use crate::program::{BY_DISTANCE, MotionInstruction, MotionKind, Speed, Termination};

impl Machine<'_> {
    /// Takes in what the lines in front of an instruction set.
    pub(super) fn take_in(&mut self, program: usize, at: usize) {
        let programs = self.programs;
        for set in programs[program].modal.sets.get(&at).into_iter().flatten() {
            self.set_to(set);
        }
    }

    /// Takes in what a line sets for the moves to come.
    pub(super) fn set_to(&mut self, set: &Sets) {
        match set {
            Sets::Speed(speed) => self.now.speed = Some(speed.clone()),
            Sets::Joints(share) => self.now.joints = Some(*share),
            Sets::Acceleration(said) => self.now.acceleration = Said::As(said.clone()),
            Sets::Distance(distance) => self.now.distance = Said::As(*distance),
            Sets::Orientation(orientation) => self.now.orientation = *orientation,
            Sets::Round(round) => self.now.round = *round,
            Sets::Turning(which, limit) => {
                if let Some(held) = self.now.turning.get_mut(*which) {
                    *held = Some(*limit);
                }
            }
            Sets::Usual if self.now.orientation == Orientation::Kept => {
                self.now.orientation = Orientation::Free;
            }
            Sets::Usual => {}
            Sets::Weld(speed) => self.now.weld = *speed,
            Sets::Weave(Some(weave)) => self.swing(Some(*weave)),
            Sets::Weave(None) => self.weave = None,
        }
    }

    /// Makes a move as it is by what was set before, and by what it says of itself alone.
    pub(super) fn move_as_set(&mut self, motion: &MotionInstruction) -> Result<(), ProgramError> {
        let (program, at) = self.at;
        let own = self.programs[program].modal.own.get(&at);
        let as_set = self.as_set(motion, own);
        let (frame, tool) = own.map(|own| own.frames).unwrap_or_default();
        let before = self.frames;
        self.frames = (frame.or(before.0), tool.or(before.1));
        let turned = (self.now.orientation, self.now.round);
        self.now.orientation = own.and_then(|own| own.orientation).unwrap_or(turned.0);
        self.now.round = own.and_then(|own| own.round).unwrap_or(turned.1);
        self.motion(&as_set)?;
        (self.now.orientation, self.now.round) = turned;
        if frame.is_some() {
            self.frames.0 = before.0;
        }
        if tool.is_some() {
            self.frames.1 = before.1;
        }
        Ok(())
    }

    fn as_set<'m>(
        &self,
        motion: &'m MotionInstruction,
        own: Option<&Own>,
    ) -> Cow<'m, MotionInstruction> {
        let now = &self.now;
        let speed = if motion.kind == MotionKind::Joint {
            let share = own.and_then(|own| own.joints).or(now.joints);
            share.map(Speed::share)
        } else {
            let set = own.and_then(|own| own.speed.as_ref());
            set.or(now.speed.as_ref())
                .map(|set| Speed::set(set, now.weld))
        };
        let nothing = Own::default();
        let own = own.unwrap_or(&nothing);
        let by_distance = match &motion.termination {
            Termination::Blend(_) => true,
            Termination::Other(word) => word == BY_DISTANCE,
            _ => false,
        };
        let acceleration = match own.acceleration.or(&now.acceleration) {
            Said::As(acceleration) => acceleration,
            Said::No => &motion.acceleration,
        };
        let ends = match own.distance.or(&now.distance) {
            Said::As(distance) if by_distance => Termination::rounded(*distance),
            _ => motion.termination.clone(),
        };
        let speed = speed.unwrap_or_else(|| motion.speed.clone());
        let limits = now.turning.into_iter().flatten();
        let turns = limits.fold(motion.turns, |least, limit| {
            Some(least.map_or(limit, |least| least.min(limit)))
        });
        let same = turns == motion.turns
            && speed == motion.speed
            && *acceleration == motion.acceleration
            && ends == motion.termination;
        if same {
            return Cow::Borrowed(motion);
        }
        Cow::Owned(MotionInstruction {
            turns,
            speed,
            acceleration: acceleration.clone(),
            termination: ends,
            ..motion.clone()
        })
    }
}
