//! External axes along beads: whether they move the part is known of a positioner and of a track that are told.

use super::beside::Place;
use super::effect::coordinated;
use super::{Machine, Missing};
use crate::program::{Dialect, MotionInstruction};

impl Machine<'_> {
    /// Tells a bead along which axes move of which it is not known how they move the part.
    pub(super) fn tell_axes(&mut self, motion: &MotionInstruction, target: &Place) {
        let word = motion.extra.iter().any(|w| coordinated(w));
        let still = !target.further.is_empty() && target.further.iter().all(|v| *v == 0.0);
        let before = self.turned.replace(target.further.clone());
        let came_with = self.stands_at(target);
        if self.arc.is_none() {
            return;
        }
        if target.turns {
            // without the word each group goes its own way
            let apart = self.programs[self.at.0].dialect.tells_stations_apart();
            if apart && !word && before.is_some_and(|b| b != target.further) {
                self.gap(Missing::Coordinated);
            }
            return;
        }
        if word && !still {
            self.gap(Missing::Coordinated);
        }
        let Some((came_with, said)) = came_with else {
            return;
        };
        let first = self.bead_axes.get_or_insert_with(|| said.clone());
        if !same_axes(first, &said) || came_with.is_some_and(|before| !same_axes(&before, &said)) {
            self.gap(Missing::ExternalAxes);
        }
    }

    /// Where the external axes stood before a move, where that is known, and where they stand behind it; nothing where it does not tell them. Axes that
    /// are not listed stand at zero; but where none is, no dialect but KUKA's says where they stand.
    fn stands_at(&mut self, target: &Place) -> Option<(Option<Vec<f64>>, Vec<f64>)> {
        let said = target.own.get(target.slides..).unwrap_or_default();
        let zeros = self.programs[self.at.0].dialect == Dialect::Krl;
        let none = self.axes.as_ref().is_none_or(Vec::is_empty);
        let tells = target.tells_axes && (zeros || none || !said.is_empty());
        if !tells {
            return None;
        }
        let before = self.axes.replace(said.to_vec());
        Some((before, said.to_vec()))
    }
}

/// Whether axes stand at the same places; those that are not listed at zero.
fn same_axes(a: &[f64], b: &[f64]) -> bool {
    let at = |axes: &[f64], i: usize| axes.get(i).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).all(|i| at(a, i) == at(b, i))
}
