//! What comments say of weld schedules: `Schedule 2 WFS 8.00 m/min`. They count from where they stand on, and only where nothing
//! contradicts them: a schedule belongs to its weld procedure, and has one wire feed.

use std::collections::{BTreeMap, BTreeSet};

use super::effect::told_schedule;
use crate::program::{ArcAction, ArcStyle, ArcValue, ArcWord, CommentMark, Instruction, Program};

/// mm/s in one m/min.
const M_PER_MIN: f64 = 1000.0 / 60.0;

/// What comments of programs say of schedules.
#[derive(Debug, Default)]
pub(super) struct Comments {
    /// The wire feeds, mm/s, of those that came so far.
    heard: BTreeMap<u32, f64>,
    /// Schedules of which two comments say two feeds, with both in words.
    contradicted: BTreeMap<u32, String>,
    /// The weld procedures that the programs use.
    procedures: BTreeSet<u32>,
}

/// A comment: its program, its line, the wire feed that it says, mm/s.
struct Said<'p> {
    program: &'p Program,
    line: u32,
    feed: f64,
}

impl Said<'_> {
    /// In words, beside another comment.
    fn words(&self, beside: &Said<'_>) -> String {
        let feed = self.feed / M_PER_MIN;
        let digits = (feed * 1e6).round() / 1e6;
        let line = self.line;
        if std::ptr::eq(self.program, beside.program) {
            format!("line {line} says {digits} m/min")
        } else {
            format!("line {line} of {} says {digits} m/min", self.program.name)
        }
    }
}

/// Whether the values are a procedure and a schedule, whatever others of as many values mean in the cell: two whole numbers of a `Weld Start`.
pub(super) fn calls_both((style, values): (ArcStyle, &[&str]), told: &[ArcValue]) -> bool {
    style == ArcStyle::Weld
        && values.len() == 2
        && values.iter().all(|v| !v.contains('.'))
        && told.first() != Some(&ArcValue::Procedure)
}

/// The weld procedure that a start of the arc names, as it is written; `meanings` are those of the values in its brackets.
pub(super) fn procedure<'w>(word: &'w ArcWord, meanings: &[ArcValue]) -> Option<&'w str> {
    let values: Vec<&str> = word.arguments.split(',').map(str::trim).collect();
    let place = if calls_both((word.style, &values), meanings) {
        Some(0)
    } else if !meanings.is_empty() && meanings.len() == values.len() {
        meanings.iter().position(|m| *m == ArcValue::Procedure)
    } else {
        (word.style == ArcStyle::Weld && values.len() == 2).then_some(0)
    };
    let begins = word.action == ArcAction::Start;
    values.get(place.filter(|_| begins)?).copied()
}

impl Comments {
    /// What is to be known of all programs before the first is executed: which comments contradict each other, whenever they come, and
    /// which procedures there are.
    pub(super) fn of(programs: &[Program], meanings: &[ArcValue]) -> Comments {
        let mut first: BTreeMap<u32, Said<'_>> = BTreeMap::new();
        let mut comments = Comments::default();
        let instructions = programs.iter().flat_map(|program| {
            let counted = (1..).zip(&program.instructions);
            counted.map(move |(at, instruction)| (program, at, instruction))
        });
        for (program, at, instruction) in instructions {
            let word = match instruction {
                Instruction::Arc(word) => Some(word),
                Instruction::Motion(motion) => motion.arc.as_ref(),
                _ => None,
            };
            let named = word.and_then(|word| procedure(word, meanings));
            let number = named.and_then(|named| named.parse::<u32>().ok());
            comments.procedures.extend(number);
            let Instruction::Comment {
                mark: CommentMark::Remark,
                text,
            } = instruction
            else {
                continue;
            };
            let Some((schedule, feed)) = told_schedule(text) else {
                continue;
            };
            let line = program.line_of(at);
            let said = Said {
                program,
                line,
                feed,
            };
            match first.get(&schedule) {
                Some(other) if other.feed != feed => {
                    let both = format!(
                        "of schedule {schedule}, {} and {}",
                        other.words(&said),
                        said.words(other)
                    );
                    comments.contradicted.entry(schedule).or_insert(both);
                }
                Some(_) => {}
                None => drop(first.insert(schedule, said)),
            }
        }
        comments
    }

    /// A weld procedure is used of which only the execution knows the number.
    pub(super) fn uses(&mut self, procedure: Option<u32>) {
        self.procedures.extend(procedure);
    }

    /// A comment is come to.
    pub(super) fn hear(&mut self, text: &str) {
        if let Some((number, feed)) = told_schedule(text) {
            self.heard.entry(number).or_insert(feed);
        }
    }

    /// The wire feed, mm/s, of a schedule of a procedure; `None` where no comment came that says it.
    ///
    /// # Errors
    /// Why what they say does not tell it, in words.
    pub(super) fn feed(&self, procedure: Option<u32>, number: u32) -> Result<Option<f64>, String> {
        if let Some(both) = self.contradicted.get(&number) {
            return Err(both.clone());
        }
        let heard = self.heard.get(&number).copied();
        let others = self.procedures.iter().any(|p| Some(*p) != procedure);
        if heard.is_some() && procedure.is_some() && others {
            let used: Vec<String> = self.procedures.iter().map(u32::to_string).collect();
            return Err(format!(
                "the comment on schedule {number} names no weld procedure, and the program uses procedures {}",
                used.join(" and ")
            ));
        }
        Ok(heard)
    }
}
