//! Position registers: what a program puts into them, as far as it is known, and what moves make of them.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::Machine;
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
            self.memory.positions.clear();
            return;
        };
        if let Some((number, element)) = inner.split_once(',') {
            let place = self.memory.index(number).zip(self.memory.index(element));
            let value = self.memory.number(right);
            match place {
                Some((number, element @ 1..=6)) => {
                    let all = self.memory.positions.entry(number).or_default();
                    all[element as usize - 1] = value;
                }
                _ => self.memory.positions.clear(),
            }
            return;
        }
        let Some(number) = self.memory.index(inner) else {
            self.memory.positions.clear();
            return;
        };
        match self.elements(right) {
            Some(all) => drop(self.memory.positions.insert(number, all)),
            None => drop(self.memory.positions.remove(&number)),
        }
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
