//! What seam data do at the begin and at the end of a bead.

use super::declared::Declared;
use super::parse::Routine;
use super::verbs::Stage;
use crate::program::{ArcAction, ArcWord, Instruction, Unsaid};

/// What a move of the arc comes to with its seam data.
#[derive(Default)]
pub(super) struct Phases {
    /// What the arc does at its end.
    pub(super) at_end: Option<ArcWord>,
    /// What follows there.
    pub(super) more: Vec<Instruction>,
    /// What the data do that is not simulated, or the controller alone knows.
    pub(super) unsaid: Vec<Unsaid>,
}

impl Routine {
    /// The begin or the end of a bead with the seam data that its move names. An end stands on the crater with the values of the data's fill arc.
    ///
    /// Data that the module does not declare are the controller's.
    pub(super) fn phases(
        &mut self,
        (stage, seam): (Option<Stage>, Option<&str>),
        arc: Option<ArcWord>,
        known: &Declared,
    ) -> Phases {
        let seam = seam.unwrap_or_default();
        let said = known.seams.get(&seam.to_ascii_lowercase());
        match stage {
            Some(Stage::Goes) | None => Phases {
                at_end: arc,
                ..Phases::default()
            },
            Some(Stage::Start) => {
                self.seam = Some(seam.to_owned());
                let begin = said.map_or(&[][..], |said| &said.begin);
                let told = begin
                    .iter()
                    .map(|part| Unsaid::Phase(format!("{part} of {seam}")));
                Phases {
                    at_end: arc,
                    more: Vec::new(),
                    unsaid: told.collect(),
                }
            }
            Some(Stage::End) => self.end(seam, arc, known),
        }
    }

    fn end(&mut self, seam: &str, arc: Option<ArcWord>, known: &Declared) -> Phases {
        let struck = self.seam.take();
        let said = |name: &str| known.seams.get(&name.to_ascii_lowercase());
        let changes = |other: &str| {
            said(other)
                .zip(said(seam))
                .is_some_and(|(a, b)| a.fill != b.fill)
        };
        let other = struck.filter(|other| changes(other));
        let mut unsaid: Vec<Unsaid> = other
            .map(|other| {
                Unsaid::Phase(format!(
                    "it is struck with {other} and ends with {seam}, and their craters differ"
                ))
            })
            .into_iter()
            .collect();
        let Some(said) = said(seam) else {
            unsaid.push(Unsaid::Crater(seam.to_owned()));
            return Phases {
                at_end: arc,
                more: Vec::new(),
                unsaid,
            };
        };
        let (time, values) = &said.fill;
        if *time <= 0.0 {
            return Phases {
                at_end: arc,
                more: Vec::new(),
                unsaid,
            };
        }
        let same = arc.as_ref().is_some_and(|on| on.arguments == *values);
        Phases {
            at_end: (!same).then(|| ArcWord::new(ArcAction::Start, values.clone())),
            more: std::iter::once(Instruction::Wait(*time))
                .chain(arc.map(Instruction::Arc))
                .collect(),
            unsaid,
        }
    }
}
