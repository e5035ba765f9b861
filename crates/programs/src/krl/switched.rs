//! What ArcTech does with the arc at the end of a move, by the weld data that its call names.

use super::arc::{Crater, Form, FormLine, FormPart, WeldData, form_line};
use super::list::List;
use super::parse::Routine;
use crate::program::{ArcAction, ArcWord, Instruction, Unsaid};

/// What the arc does at the end of a move.
#[derive(Default)]
pub(super) struct Switched {
    /// Its word.
    pub(super) at_end: Option<ArcWord>,
    /// How long it stands then, s.
    pub(super) stands: f64,
    /// What ends it after that.
    pub(super) last: Option<Instruction>,
    /// What the data say beside.
    pub(super) unsaid: Vec<Unsaid>,
}

impl Routine<'_> {
    /// A line that calls ArcTech: nothing where it is none of the inline forms, or stands where none has it.
    pub(super) fn calls_arc(&mut self, line: &str) -> Option<()> {
        let FormLine { form, part, data } = form_line(line)?;
        match part {
            FormPart::Trigger => self.triggers.push((form, data, line.to_owned())),
            FormPart::Before => {
                self.keep_triggers(Some((form, &data)));
                self.form = Some((form, data));
            }
            FormPart::After => {
                let own = self.after.take();
                own.filter(|own| *own == (form, data))?;
            }
        }
        Some(())
    }

    /// Keeps the triggers that are not of the form whose call they stand before: what they do to the arc is not known.
    fn keep_triggers(&mut self, own: Option<(Form, &str)>) {
        for (form, data, text) in std::mem::take(&mut self.triggers) {
            if own != Some((form, &data)) {
                self.out.keep(&text);
            }
        }
    }

    /// What the arc does at the end of the move being read.
    pub(super) fn arc(&mut self, list: &List) -> Switched {
        self.keep_triggers(None);
        self.after.clone_from(&self.form);
        let Some((form, name)) = self.form.take() else {
            return Switched::default();
        };
        let before = self.weld.take();
        let said = list.advanced.get(&name).cloned().unwrap_or_default();
        let phase = |words: Vec<String>| {
            let told = words.into_iter().map(|w| format!("{w} of {name}"));
            told.map(Unsaid::Phase).collect::<Vec<_>>()
        };
        if form == Form::Off {
            let unsaid = phase(said.off);
            return ends(list.craters.get(&name), (before, &name), unsaid);
        }
        let mut unsaid = phase(said.on);
        unsaid.extend(list.modes.get(&name).cloned().map(Unsaid::Mode));
        let Some(weld) = list.welds.get(&name) else {
            // the weld goes on with data that nobody gave
            return Switched {
                at_end: Some(ArcWord::new(ArcAction::Start, name)),
                unsaid,
                ..Switched::default()
            };
        };
        self.weld = Some(weld.clone());
        if let Some(Err(pattern)) = &weld.weave {
            self.out.keep(&format!("Weave {pattern}"));
        }
        let goes_on = form == Form::Switch && before.is_some_and(|b| b.arguments == weld.arguments);
        Switched {
            at_end: (!goes_on).then(|| ArcWord::new(ArcAction::Start, weld.arguments.clone())),
            stands: if form == Form::On { weld.stands } else { 0.0 },
            last: None,
            unsaid,
        }
    }
}

/// The arc ends by the data `name`, whose crater may be known: it stands with the values of that.
fn ends(
    crater: Option<&Crater>,
    (before, name): (Option<WeldData>, &str),
    mut unsaid: Vec<Unsaid>,
) -> Switched {
    let on = before.map_or_else(String::new, |weld| weld.arguments);
    let ends = ArcWord::new(ArcAction::End, on.clone());
    let Some(crater) = crater.filter(|crater| crater.stands > 0.0) else {
        let known = crater.is_some();
        unsaid.extend((!known).then(|| Unsaid::Crater(name.to_owned())));
        return Switched {
            at_end: Some(ends),
            unsaid,
            ..Switched::default()
        };
    };
    let other = crater.arguments != on;
    Switched {
        at_end: other.then(|| ArcWord::new(ArcAction::Start, crater.arguments.clone())),
        stands: crater.stands,
        // the arc that ends stands first
        last: Some(Instruction::Arc(ends)),
        unsaid,
    }
}
