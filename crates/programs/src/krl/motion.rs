//! Moves of a routine: where they lead, how fast, how they end, and what they say of themselves alone.

use super::data::coordinates;
use super::list::{List, capital};
use super::parse::{Routine, Verb};
use super::with::parts;
use crate::held::Holds;
use crate::modal::{Own, Said, Sets};
use crate::program::{
    BY_DISTANCE, Instruction, MotionInstruction, MotionKind, PositionRef, Speed, Termination,
};
use crate::said_frames::Which;

/// The speed of a move along a path where no line has set one.
const NOT_SET: &str = "$VEL.CP, which no line sets,";
/// That of a joint move.
const NO_SHARE: &str = "BAS(#VEL_PTP,…), which no line says,";

impl Routine<'_> {
    /// A position in front of `text`, and what follows it.
    fn position<'t>(
        &mut self,
        text: &'t str,
        own: (Option<u32>, Option<u32>),
        list: &List,
    ) -> Option<(PositionRef, &'t str)> {
        let text = text.trim_start();
        if text.starts_with('{') {
            let end = text.find('}')? + 1;
            let place = coordinates(&text[..end])?;
            let place = self.in_part(place);
            return Some((self.out.place(place, (None, None)), &text[end..]));
        }
        let end = text
            .find(|c: char| c.is_whitespace() || c == ',')
            .unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        let variable = capital(name);
        let frames = list.frames.get(&format!(
            "F{}",
            variable.strip_prefix('X').unwrap_or(&variable)
        ));
        // an entry that is set to several places is none that a position keeps to, nor is one that the move does not go in
        let kept = |which, n: Option<u32>, own: Option<u32>| {
            let several = |n: u32| self.tables.is_several((which, n));
            n.filter(|n| !several(*n) && own.is_none_or(|own| own == *n))
        };
        let (base, tool) = frames.copied().unwrap_or_default();
        let frames = (
            kept(Which::User, base.filter(|_| !self.direct.0), own.0),
            kept(Which::Tool, tool.filter(|_| !self.direct.1), own.1),
        );
        let short = name.strip_prefix(['X', 'x']);
        let listed = list.positions.get(&variable).cloned();
        let listed = listed.map(|place| self.in_part(place));
        // a place that is used with the torch on the robot and with the part on it is two
        let now = self.holds.unwrap_or(Holds::Torch);
        let first = *self.used.entry(variable.clone()).or_insert(now);
        let other = |short: &&str| !list.positions.contains_key(&capital(short));
        let mut key = short.filter(other).unwrap_or(name).to_owned();
        if first != now {
            key += "_HELD";
            while list.positions.contains_key(&format!("X{}", capital(&key))) {
                key.push('_');
            }
        }
        let known = self.out.named(&key, frames, || listed);
        Some((
            known.unwrap_or_else(|| PositionRef::Unresolved(name.to_owned())),
            rest,
        ))
    }

    pub(super) fn motion(&mut self, verb: Verb, text: &str, list: &List) -> Option<()> {
        let parts = parts(text);
        let (own, unknown) = self.own(&parts.clauses, verb, list)?;
        let (mut target, mut rest) = self.position(parts.text, own.frames, list)?;
        let kind = match verb {
            Verb::Joint => MotionKind::Joint,
            Verb::Straight => MotionKind::Linear,
            Verb::Round => {
                let via = target;
                let to = rest.trim_start().strip_prefix(',')?;
                (target, rest) = self.position(to, own.frames, list)?;
                MotionKind::Circular { via }
            }
        };
        let ending = rest.split_whitespace().next().or(parts.ending);
        let distance = match own.distance {
            Said::As(distance) => distance,
            Said::No => self.distance,
        };
        let termination = match ending.map(capital).as_deref() {
            None => Termination::Fine,
            Some(BY_DISTANCE) => Termination::rounded(distance),
            Some(word @ ("C_PTP" | "C_VEL" | "C_ORI" | "C_SPL")) => {
                Termination::Other(word.to_owned())
            }
            // an angle, a relative or other word
            Some(_) => return None,
        };
        let speed = if kind == MotionKind::Joint {
            let share = own.joints.or(self.joint_speed);
            share.map_or_else(|| Speed::Other(NO_SHARE.to_owned()), Speed::share)
        } else {
            let weld = self.weld.as_ref().map(|weld| weld.speed);
            let set = own.speed.as_ref().or(self.speed.as_ref());
            set.map_or_else(
                || Speed::Other(NOT_SET.to_owned()),
                |set| Speed::set(set, weld),
            )
        };
        let acceleration = match &own.acceleration {
            Said::As(own) => own.clone(),
            Said::No => self.acceleration.clone(),
        };
        let switches = self.form.is_some();
        let switched = self.arc(list);
        if own != Own::default() {
            let at = self.out.program.instructions.len();
            self.out.program.modal.own.insert(at, own);
        }
        self.out.push(Instruction::Motion(MotionInstruction {
            arc: switched.at_end,
            extra: unknown,
            acceleration,
            ..MotionInstruction::plain(kind, target, speed, termination)
        }));
        self.out.unsaid(switched.unsaid);
        let stands = (switched.stands > 0.0).then_some(Instruction::Wait(switched.stands));
        for more in stands.into_iter().chain(switched.last) {
            self.out.push(more);
        }
        if switches {
            self.says(Sets::Weld(self.weld.as_ref().map(|weld| weld.speed)));
            self.swing();
        }
        Some(())
    }

    /// The weave of the weld data that are on holds for the moves to come.
    fn swing(&mut self) {
        let weave = self.weld.as_ref().and_then(|weld| weld.weave.as_ref());
        let weave = weave.and_then(|weave| weave.as_ref().ok()).copied();
        if weave == self.weave {
            // programs that were called may have left it otherwise
            self.says(Sets::Weave(weave));
        } else {
            self.weave = weave;
            self.out.push(Instruction::Weave(weave));
        }
    }
}
