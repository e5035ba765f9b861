//! Outputs that lead to the welding source: what the cell tells of them.

use super::{Machine, Missing, Source, ToldOutput};

impl Machine<'_> {
    /// `GO[2]=3`: the source is set as the cell tells it; a gap where it does not.
    pub(super) fn set_output(&mut self, text: &str) {
        let sides = text.split_once('=');
        let target = sides.and_then(|(left, _)| self.memory.reference(left));
        let value = sides.and_then(|(_, right)| self.memory.number(right));
        match target {
            Some((name, number)) => self.output(&name, Some(number), value, text),
            None => self.gap(Missing::Output(text.to_owned())),
        }
    }

    /// `SetGO goJob, 3`, with the name in any letters.
    pub(super) fn set_named_output(&mut self, text: &str) {
        let (_, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let (name, value) = rest.rsplit_once(',').unwrap_or((rest, ""));
        // \SDelay and the like come before the name
        let name = name.rsplit(',').next().unwrap_or(name).trim();
        let value = self.memory.number(value);
        self.output(&name.to_ascii_uppercase(), None, value, text);
    }

    /// An output is set to a value, where that is known.
    fn output(&mut self, name: &str, number: Option<u32>, value: Option<f64>, text: &str) {
        let settings = self.settings;
        let entries = settings.outputs.iter();
        let its: Vec<&ToldOutput> = entries
            .filter(|o| o.name == name && o.number == number)
            .collect();
        let of = |wanted: Option<f64>| its.iter().filter(move |o| o.value == wanted);
        let wanted = value.filter(|_| of(value).next().is_some());
        let named = of(wanted).next();
        // two entries that say two things say nothing
        let named = named.filter(|told| of(wanted).all(|o| o.schedule == told.schedule));
        // of a value that is not known the entries that name one may be meant
        let open = value.is_none() && its.iter().any(|o| o.value.is_some());
        let Some(told) = named.filter(|_| !open) else {
            self.gap(Missing::Output(text.to_owned()));
            return;
        };
        let Some(schedule) = told.schedule else {
            self.note("line-passed-over", super::effect::first_word(text));
            return;
        };
        let Some(set) = self.scheduled(None, schedule).0 else {
            self.gap(Missing::Schedule(text.to_owned()));
            return;
        };
        self.close_arcs();
        self.by_output = Some((text.to_owned(), set));
        if let Some((_, source)) = &mut self.arc {
            *source = Source {
                wire_feed: Some(set.wire_feed),
                speed: set.speed,
            };
        }
    }
}
