//! Position registers: what a program puts into them, as far as it is known, and what moves make of them.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::beside::Place;
use super::{Machine, Missing, NoPose, ProgramError};
use crate::expression::Elements;
use crate::orientation::pose;
use crate::program::Coordinates;
use crate::scan::bracket;

/// What stands in the bracket of `PR[…]` without comment, and what follows it.
fn register(text: &str) -> Option<(&str, &str)> {
    let text = text.trim();
    let name = text.get(..2).filter(|n| n.eq_ignore_ascii_case("PR"))?;
    let (inner, rest) = bracket(&text[name.len()..])?;
    Some((inner.split(':').next()?, rest.trim()))
}

/// The elements of a pose.
fn elements(pose: &Pose) -> Elements {
    let [x, y, z] = pose.position.to_array();
    let [w, p, r] = pose.wpr().to_array().map(f64::to_degrees);
    [x, y, z, w, p, r].map(Some)
}

impl Machine<'_> {
    /// `PR[1]=…` and `PR[1,3]=…`: what is not known afterwards is forgotten.
    pub(super) fn set_position(&mut self, text: &str) {
        let sides = text
            .split_once('=')
            .map(|(left, right)| (register(left), right.trim()));
        let Some((Some((inner, "")), right)) = sides else {
            self.forget_positions();
            return;
        };
        if let Some((number, element)) = inner.split_once(',') {
            let place = self.memory.index(number).zip(self.memory.index(element));
            let value = self.memory.number(right);
            match place {
                // of joints this is one, not a coordinate
                Some((number, _)) if self.may_hold_joints(number) => {
                    self.as_told.remove(&number);
                    self.no_places.insert(number);
                }
                Some((number, element @ 1..=6)) => {
                    let all = self.memory.positions.entry(number).or_default();
                    all[element as usize - 1] = value;
                }
                _ => self.forget_positions(),
            }
            return;
        }
        let Some(number) = self.memory.index(inner) else {
            self.forget_positions();
            return;
        };
        let copied = register(right).and_then(|(inner, rest)| {
            let told = *self.as_told.get(&self.memory.index(inner)?)?;
            // joints are none after sums
            (rest.is_empty() || self.settings.positions.get(&told)?.joints.is_none())
                .then_some(told)
        });
        match copied {
            Some(told) => drop(self.as_told.insert(number, told)),
            None => drop(self.as_told.remove(&number)),
        }
        if let Some(all) = self.elements(right) {
            self.memory.positions.insert(number, all);
            self.no_places.remove(&number);
        } else {
            self.memory.positions.remove(&number);
            self.no_places.insert(number);
        }
    }

    /// Any of them may be another.
    fn forget_positions(&mut self) {
        self.memory.positions.clear();
        self.as_told.clear();
    }

    /// Whether a register holds joints, or was set to what may be some.
    fn may_hold_joints(&self, number: u32) -> bool {
        if self.no_places.contains(&number) {
            return true;
        }
        let told = self.as_told.get(&number);
        let told = told.and_then(|told| self.settings.positions.get(told));
        told.is_some_and(|told| told.joints.is_some())
    }

    /// Where `PR[1]` leads, in the frames that are selected; what is missing where it is not known here.
    pub(super) fn register_place(
        &mut self,
        text: &str,
    ) -> Result<Result<Place, Missing>, ProgramError> {
        let number = register(text).filter(|(_, rest)| rest.is_empty());
        let number = number.and_then(|(inner, _)| self.memory.index(inner));
        let of_told = number.and_then(|n| self.as_told.get(&n)).copied();
        let told = of_told.and_then(|n| self.settings.positions.get(&n));
        if told.is_some_and(|told| told.joints.is_some()) {
            let pose = of_told.and_then(|n| self.settings.register_poses.get(&n));
            let pose = pose.copied().unwrap_or(Err(NoPose::NoRobot));
            let named = |why| Missing::JointPosition(text.to_owned(), why);
            return Ok(pose.map(|pose| Place::bare(pose, true)).map_err(named));
        }
        let Some(pose) = self.register_pose(text) else {
            let name = text.trim_end_matches('?').to_owned();
            let untold = number.map_or_else(Vec::new, |n| self.untold_of(&format!("PR[{n}]")));
            return Ok(Err(if untold.iter().all(|u| *u == name) {
                Missing::Position(name)
            } else {
                Missing::Register { name, untold }
            }));
        };
        if let Some(frames) = told.map(|told| told.frames) {
            self.in_frames(text, frames)?;
        }
        Ok(Ok(Place::bare(pose, false)))
    }

    /// `PR[2]`, sums and differences of them, `P[3]`, `LPOS`.
    fn elements(&self, text: &str) -> Option<Elements> {
        if text.eq_ignore_ascii_case("LPOS") {
            return self.here.as_ref().map(elements);
        }
        if let Some((inner, rest)) = register(text) {
            let mut sum = *self.memory.positions.get(&self.memory.index(inner)?)?;
            let mut rest = rest;
            while !rest.is_empty() {
                let sign = match rest.as_bytes()[0] {
                    b'+' => 1.0,
                    b'-' => -1.0,
                    _ => return None,
                };
                let (inner, after) = register(&rest[1..])?;
                let more = self.memory.positions.get(&self.memory.index(inner)?)?;
                for (a, b) in sum.iter_mut().zip(more) {
                    *a = a.zip(*b).map(|(a, b)| a + sign * b);
                }
                rest = after;
            }
            return Some(sum);
        }
        let rest = text.strip_prefix(['P', 'p'])?;
        let (inner, rest) = bracket(rest)?;
        let index = self.memory.index(inner.split(':').next()?)?;
        let position = self.tables[self.at.0].get(&index)?;
        let group = position.robot()?;
        // a position counts in its own frames
        let own = |taught: Option<u32>, selected| taught.is_none() || taught == selected;
        let same = own(group.frame, self.frames.0) && own(group.tool, self.frames.1);
        match &group.coordinates {
            Coordinates::Cartesian {
                xyz: [x, y, z],
                wpr_degrees: [w, p, r],
                ..
            } if rest.trim().is_empty() && same => Some([x, y, z, w, p, r].map(|v| Some(*v))),
            _ => None,
        }
    }

    /// Where `PR[1]` leads, where all of it is known.
    pub(super) fn register_pose(&self, text: &str) -> Option<Pose> {
        let (inner, "") = register(text)? else {
            return None;
        };
        let all = self.memory.positions.get(&self.memory.index(inner)?)?;
        let [x, y, z, w, p, r] = *all;
        Some(pose(DVec3::new(x?, y?, z?), [w?, p?, r?]))
    }

    /// By how much `Offset,PR[1]` moves a target, mm, where it does not turn it.
    pub(super) fn offset(&self, word: &str) -> Option<DVec3> {
        let (name, rest) = word.split_once(',')?;
        let (inner, "") = register(rest).filter(|_| name.trim().eq_ignore_ascii_case("Offset"))?
        else {
            return None;
        };
        let [x, y, z, w, p, r] = *self.memory.positions.get(&self.memory.index(inner)?)?;
        let turns = [w?, p?, r?] != [0.0; 3];
        (!turns).then_some(DVec3::new(x?, y?, z?))
    }
}
