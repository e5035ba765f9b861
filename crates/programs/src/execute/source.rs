//! What arc words set the source to, and weave words the torch: what their numbers mean is told by the cell, or stands in the program
//! with its units.

use meltpath_toolpath::{Weave, WeaveShape};

use super::comments::{calls_both, procedure};
use super::{ArcValue, Machine, Missing, ProgramError, Source, WeldSettings};
use crate::program::{ArcAction, ArcStyle, ArcWord, Dialect};
use crate::scan::{bracket, number, strip_prefix};

/// Frequencies, Hz, amplitudes, mm, and dwells, s, that robots weave with.
const FREQUENCIES: std::ops::RangeInclusive<f64> = 0.1..=20.0;
const AMPLITUDES: std::ops::RangeInclusive<f64> = 0.01..=50.0;
const DWELLS: std::ops::RangeInclusive<f64> = 0.0..=10.0;
/// Faster than any source feeds wire, mm/s.
const FASTEST_FEED: f64 = 1e4;

/// What the values of an arc word set.
#[derive(Debug, Clone, Default)]
pub(super) struct Set {
    /// The schedule that they call, where it is known.
    pub(super) schedule: Option<WeldSettings>,
    /// Why comments do not tell it, where they speak of it.
    unclear: Option<String>,
    /// The wire feed that they say themselves, mm/s.
    feed: Option<f64>,
}

impl Set {
    /// The source as it is set.
    pub(super) fn source(&self) -> Source {
        Source {
            wire_feed: self.feed.or(self.schedule.map(|s| s.wire_feed)),
            speed: self.schedule.and_then(|s| s.speed),
        }
    }
}

impl Machine<'_> {
    /// Switches the arc.
    pub(super) fn switch(&mut self, word: &ArcWord) -> Result<(), ProgramError> {
        match word.action {
            ArcAction::Start => {
                let same = |(on, _): &(String, Source)| *on == word.arguments;
                if self.by_output.is_none() && self.arc.as_ref().is_some_and(same) {
                    // the values that burn are set again
                    return Ok(());
                }
                let used = procedure(word, &self.settings.arc_values);
                self.comments.uses(used.and_then(|p| self.memory.index(p)));
                let values: Vec<&str> = word.arguments.split(',').map(str::trim).collect();
                let set = self.set_by(word.style, &values);
                let mut source = set.source();
                if let Some((line, called)) = &self.by_output {
                    let line = line.clone();
                    let by_output = Source {
                        wire_feed: Some(called.wire_feed),
                        speed: called.speed,
                    };
                    if source.wire_feed.is_some() && source != by_output {
                        let why = format!("{line} has set the source to another schedule before");
                        self.gap(Missing::ScheduleSaid(word.to_string(), why));
                    }
                    source = by_output;
                }
                if source.wire_feed.is_none() {
                    // behind a name whose value the controller alone knows stands a mark
                    let word = word.to_string().replace('?', "");
                    self.gap(match set.unclear {
                        Some(why) => Missing::ScheduleSaid(word, why),
                        None => Missing::Schedule(word),
                    });
                }
                self.arc = Some((word.arguments.clone(), source));
            }
            ArcAction::End => {
                if self.arc.is_some() {
                    self.fill_crater(word)?;
                }
                if self.arc.take().is_none() {
                    self.gap(Missing::ArcOff);
                }
            }
        }
        Ok(())
    }

    /// What the values of an arc word set, as far as it is known.
    pub(super) fn set_by(&self, style: ArcStyle, values: &[&str]) -> Set {
        let told = &self.settings.arc_values;
        // a template may have places for the first values alone
        let fewer = matches!(
            self.programs[self.at.0].dialect,
            Dialect::UrScript | Dialect::Inform | Dialect::Val3
        );
        let (mut procedure, mut schedule, mut feed) = (None, None, None);
        let mut called = None;
        match *values {
            _ if !told.is_empty()
                && !calls_both((style, values), told)
                && (told.len() == values.len() || (fewer && values.len() < told.len())) =>
            {
                for (value, meaning) in values.iter().zip(told) {
                    match meaning {
                        ArcValue::Procedure => match self.memory.index(value) {
                            None => return Set::default(),
                            known => procedure = known,
                        },
                        ArcValue::Schedule => {
                            schedule = self.memory.index(value);
                            called = schedule.and_then(|s| self.settings.called.get(&s));
                        }
                        ArcValue::Other => {}
                        feeds => feed = self.memory.number(value).map(|v| v * feeds.feed()),
                    }
                }
            }
            [number] => schedule = self.memory.index(number),
            [first, second] if style == ArcStyle::Weld => {
                procedure = self.memory.index(first);
                schedule = self.memory.index(second);
                if procedure.is_none() {
                    return Set::default();
                }
            }
            _ => {}
        }
        let (set, unclear) = match (called, schedule) {
            (Some(known), _) => (*known, None),
            (None, Some(number)) => self.scheduled(procedure, number),
            (None, None) => (None, None),
        };
        Set {
            schedule: set,
            unclear,
            feed: feed.filter(|f| *f > 0.0 && *f <= FASTEST_FEED),
        }
    }

    /// What a schedule of a procedure sets: as the cell's table has it, else as comments say it; and why they do not.
    pub(super) fn scheduled(
        &self,
        procedure: Option<u32>,
        number: u32,
    ) -> (Option<WeldSettings>, Option<String>) {
        let table = &self.settings.schedules;
        let listed = table.get(&(procedure, number));
        if let Some(listed) = listed.or_else(|| table.get(&(None, number))) {
            return (Some(*listed), None);
        }
        match self.comments.feed(procedure, number) {
            Ok(feed) => {
                let told = |wire_feed| WeldSettings {
                    wire_feed,
                    speed: None,
                    crater: None,
                };
                (feed.map(told), None)
            }
            Err(why) => (None, Some(why)),
        }
    }

    /// Begins a weave, where it is known what it is.
    pub(super) fn begin_weave(&mut self, text: &str) {
        let weave = match self.programs[self.at.0].dialect {
            Dialect::Inform => self.condition_weave(text),
            _ => self.told_weave(text),
        };
        self.swing(weave);
    }

    /// Begins a weave; a gap where it is not known, or is none that robots make.
    pub(super) fn swing(&mut self, weave: Option<Weave>) {
        let beyond = weave.filter(|w| !is_sound(w));
        self.weave = weave.filter(is_sound).map(|weave| {
            let known = self.weaves.iter().position(|w| *w == weave);
            let index = known.unwrap_or_else(|| {
                self.weaves.push(weave);
                self.weaves.len() - 1
            });
            index as u32 + 1
        });
        if self.weave.is_none() {
            self.gap(beyond.map_or(Missing::Weave, |w| Missing::WeaveBeyond(beyond_words(&w))));
        }
    }

    /// `WVON WEV#(1)` by the cell's table.
    fn condition_weave(&self, text: &str) -> Option<Weave> {
        let rest = strip_prefix(text, "WVON")?.trim();
        let inner = strip_prefix(rest, "WEV#(")?.strip_suffix(')')?;
        let number: u32 = inner.trim().parse().ok()?;
        self.settings.weaves.get(&number).copied()
    }

    /// `Weave Sine[1]` and `Weave[1]` by the cell's table; `Weave Sine[2.0Hz,3.0mm,0.1s,0.1s]` as it says itself: frequency,
    /// amplitude, dwell on the right, dwell on the left.
    fn told_weave(&self, text: &str) -> Option<Weave> {
        let rest = text.get("Weave".len()..)?;
        let (name, inner) = rest.split_at(rest.find('[')?);
        let (inner, _) = bracket(inner)?;
        let shape = match name.trim().to_ascii_lowercase().as_str() {
            "" => None,
            "sine" => Some(WeaveShape::Sine),
            "triangle" => Some(WeaveShape::Triangle),
            "circle" => Some(WeaveShape::Circle),
            _ => return None,
        };
        let values: Vec<&str> = inner.split(',').map(str::trim).collect();
        if let [number] = values[..] {
            let listed = *self.settings.weaves.get(&self.memory.index(number)?)?;
            return shape.is_none_or(|s| s == listed.shape).then_some(listed);
        }
        let [frequency, amplitude, right, left] = values[..] else {
            return None;
        };
        let read = |text: &str, units: &[&str]| {
            let (value, unit) = number(text)?;
            let known = units.iter().any(|u| u.eq_ignore_ascii_case(unit.trim()));
            known.then_some(value)
        };
        let seconds = ["s", "sec"];
        Some(Weave {
            shape: shape?,
            frequency: read(frequency, &["Hz"])?,
            amplitude: read(amplitude, &["mm"])?,
            dwell: [read(left, &seconds)?, read(right, &seconds)?],
        })
    }
}

/// The numbers of a weave that no robot makes, and those that robots make.
fn beyond_words(weave: &Weave) -> String {
    let [left, right] = weave.dwell;
    format!(
        "{} Hz, {} mm, dwells {right} and {left} s, where robots weave at {} to {} Hz, {} to {} mm to a side, with dwells of {} to {} s",
        weave.frequency,
        weave.amplitude,
        FREQUENCIES.start(),
        FREQUENCIES.end(),
        AMPLITUDES.start(),
        AMPLITUDES.end(),
        DWELLS.start(),
        DWELLS.end()
    )
}

/// Whether robots weave so.
fn is_sound(weave: &Weave) -> bool {
    FREQUENCIES.contains(&weave.frequency)
        && AMPLITUDES.contains(&weave.amplitude)
        && weave.dwell.iter().all(|d| DWELLS.contains(d))
}
