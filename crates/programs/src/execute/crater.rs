//! What a program lays in the crater where it ends the arc: the torch stands for a time, with the feed that the word sets. And what data say of the
//! begin and the end of a bead beside the words of its moves.

use super::source::Set;
use super::{Machine, Missing, ProgramError};
use crate::program::{ArcStyle, ArcWord, Dialect, Unsaid};
use crate::scan::number;

/// Units of times in the brackets of arc words.
const SECONDS: [&str; 2] = ["s", "sec"];

/// The time, s, that a value of an arc word says by its unit.
fn told_time(value: &str) -> Option<f64> {
    let (time, unit) = number(value)?;
    let known = SECONDS.iter().any(|u| u.eq_ignore_ascii_case(unit.trim()));
    (known && time >= 0.0).then_some(time)
}

impl Machine<'_> {
    /// Fills the crater with what an `Arc End` says, while the arc still burns: a time with its unit and values as those of `Arc Start`
    /// (`Arc End[1,7.0,18.5,0.5s]`), or a schedule whose time the cell's table has. A gap where it is not known how much metal that is.
    ///
    /// Parsers of other dialects tell the time that they know as a wait, and what they do not know as [`Unsaid`].
    pub(super) fn fill_crater(&mut self, word: &ArcWord) -> Result<(), ProgramError> {
        if self.programs[self.at.0].dialect != Dialect::FanucLs {
            return self.fill_unsaid(word);
        }
        let mut values: Vec<&str> = word.arguments.split(',').map(str::trim).collect();
        if let Some(at) = values.iter().position(|v| told_time(v).is_some()) {
            let time = told_time(values.remove(at)).unwrap_or(0.0);
            return self.stand_on_crater(word, time, &self.set_by(word.style, &values));
        }
        let set = self.set_by(word.style, &values);
        let bare = match word.style {
            ArcStyle::Arc => 1,
            ArcStyle::Weld => 2,
        };
        let meant = values.len() == bare || values.len() == self.settings.arc_values.len();
        let unlisted = set.schedule.is_none() && !self.settings.schedules.is_empty();
        if !meant || unlisted {
            self.gap(Missing::Crater(word.to_string()));
            return Ok(());
        }
        match set.schedule.map(|schedule| schedule.crater) {
            Some(Some(time)) => return self.stand_on_crater(word, time, &set),
            // one that a comment tells is the program's own, and those who wrote it say no crater
            Some(None) if !self.is_listed(&set) => {}
            Some(None) | None => self.note("crater-not-told", word.to_string()),
        }
        Ok(())
    }

    /// Fills the crater as far as it is known of an end of the arc whose data the program does not hold: the schedule that burns may have a time.
    fn fill_unsaid(&mut self, word: &ArcWord) -> Result<(), ProgramError> {
        for unsaid in self.unsaid() {
            match unsaid {
                Unsaid::Crater(ends_by) => {
                    let values: Vec<&str> = word.arguments.split(',').map(str::trim).collect();
                    let set = self.set_by(word.style, &values);
                    match set.schedule.and_then(|schedule| schedule.crater) {
                        Some(time) => self.stand_on_crater(word, time, &set)?,
                        None => self.note("crater-not-told", ends_by),
                    }
                }
                Unsaid::CraterFeed(words) => self.gap(Missing::CraterFeed(words)),
                Unsaid::Phase(_) | Unsaid::PlainMove(_) | Unsaid::Mode(_) => {}
            }
        }
        Ok(())
    }

    /// Tells what data say of a bead's begin or end that is not simulated.
    pub(super) fn tell_phases(&mut self) {
        for unsaid in self.unsaid() {
            match unsaid {
                Unsaid::Phase(said) => self.gap(Missing::Phase(said)),
                Unsaid::PlainMove(word) => self.gap(Missing::PlainMove(word)),
                Unsaid::Mode(mode) => self.gap(Missing::Mode(mode)),
                Unsaid::Crater(_) | Unsaid::CraterFeed(_) => {}
            }
        }
    }

    /// What the instruction that is executed does beside its own words.
    fn unsaid(&self) -> Vec<Unsaid> {
        let all = &self.programs[self.at.0].unsaid;
        all.get(&self.at.1).cloned().unwrap_or_default()
    }

    /// Whether the cell's table has the schedule.
    fn is_listed(&self, set: &Set) -> bool {
        let mut listed = self.settings.schedules.values();
        set.schedule.is_some_and(|s| listed.any(|l| *l == s))
    }

    /// Stands for `time` s with the arc on.
    fn stand_on_crater(
        &mut self,
        word: &ArcWord,
        time: f64,
        set: &Set,
    ) -> Result<(), ProgramError> {
        if time <= 0.0 {
            return Ok(());
        }
        let source = set.source();
        if source.wire_feed.is_none() {
            self.gap(Missing::Crater(word.to_string()));
            return Ok(());
        }
        if let Some((_, on)) = &mut self.arc {
            *on = source;
        }
        self.wait(time)
    }
}
