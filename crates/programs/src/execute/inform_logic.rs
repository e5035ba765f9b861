//! Variables, labels and jumps of a Yaskawa's jobs, as far as their values are known: `SET`, `ADD`, `SUB`, `MUL`, `DIV`, `INC`, `DEC`, `JUMP`, `CALL … IF`.
//!
//! `B`, `I`, `D` and `R` hold for all jobs, `LB`, `LI`, `LD` and `LR` for the one that runs. What does not fit a variable's kind is not known.

use std::collections::BTreeMap;

use super::effect::first_word;
use super::flow::Flow;
use super::job_lines::{WORDS, behind_if, canonical, conditional, held, variable};
use super::{Machine, Missing, ProgramError};
use crate::program::Instruction;
use crate::scan::{strip_prefix, strip_word};

impl Machine<'_> {
    /// What a line of logic of a job does; nothing where it is none.
    pub(super) fn job_logic(&mut self, text: &str) -> Result<Option<Flow>, ProgramError> {
        if text.starts_with('*') {
            return Ok(Some(Flow::Next));
        }
        if let Some((action, condition)) = conditional(text) {
            let holds = self.memory.condition(&canonical(condition));
            return Ok(Some(match holds {
                Some(false) => Flow::Next,
                Some(true) if strip_word(action, "RET").is_some() => Flow::Return,
                Some(true) => {
                    match strip_word(action, "CALL").and_then(|r| strip_prefix(r.trim(), "JOB:")) {
                        Some(name) => self.call(name.trim(), "")?,
                        None => self.undecided(text),
                    }
                }
                None => self.undecided(text),
            }));
        }
        let word = first_word(text);
        if !WORDS.contains(&&*word) {
            return Ok(None);
        }
        let rest = text.get(word.len()..).unwrap_or_default().trim();
        match word.as_str() {
            "JUMP" => return Ok(Some(self.job_jump(text, rest))),
            // a shift that is on was told where it began
            "SFTOF" => {}
            "CLEAR"
                if ["STACK", "ALL"]
                    .iter()
                    .any(|w| strip_word(rest, w).is_some()) => {}
            _ => {
                let (target, operand) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
                // places and texts are not followed
                let Some(name) = variable(target) else {
                    return Ok(None);
                };
                self.reckon(&word, name, operand.trim());
            }
        }
        self.note("line-passed-over", word);
        Ok(Some(Flow::Next))
    }

    /// Sets a variable, or forgets it.
    fn reckon(&mut self, word: &str, name: String, operand: &str) {
        let operand = strip_word(operand, "EXPRESS").unwrap_or(operand);
        let before = self.memory.names.value(&name);
        let by = self.memory.number(&canonical(operand));
        let pair = before.zip(by);
        let value = match word {
            "SET" => by,
            "ADD" => pair.map(|(a, b)| a + b),
            "SUB" => pair.map(|(a, b)| a - b),
            "MUL" => pair.map(|(a, b)| a * b),
            "DIV" => pair.filter(|(_, b)| *b != 0.0).map(|(a, b)| a / b),
            "INC" => before.map(|a| a + 1.0),
            "DEC" => before.map(|a| a - 1.0),
            "CLEAR" => return self.clear(&name, by),
            // an argument of the call, which is not followed
            _ => None,
        };
        let values = &mut self.memory.names.values;
        match value.and_then(|value| held(&name, value)) {
            Some(value) => drop(values.insert(name, value)),
            None => drop(values.remove(&name)),
        }
    }

    /// `CLEAR B000 3`: so many variables are zero from one on; all of which the number is not known are forgotten.
    fn clear(&mut self, name: &str, count: Option<f64>) {
        let digits = name
            .find(|c: char| c.is_ascii_digit())
            .unwrap_or(name.len());
        let (kind, first) = name.split_at(digits);
        let first: u32 = first.parse().unwrap_or(0);
        let values = &mut self.memory.names.values;
        match count.filter(|n| n.fract() == 0.0 && (0.0..1e4).contains(n)) {
            Some(count) => {
                values.extend((0..count as u32).map(|i| (format!("{kind}{}", first + i), 0.0)));
            }
            None => values.retain(|key, _| {
                let rest = key.strip_prefix(kind);
                !rest.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
            }),
        }
    }

    /// `JUMP *NAME`, `JUMP LABEL: B099`, each perhaps with `IF`.
    fn job_jump(&mut self, text: &str, rest: &str) -> Flow {
        let (target, holds) = match behind_if(rest) {
            Some((target, condition)) => (target, self.memory.condition(&canonical(condition))),
            None => (rest, Some(true)),
        };
        if holds == Some(false) {
            return Flow::Next;
        }
        let label = match strip_prefix(target, "LABEL:") {
            Some(value) => {
                let number = self.memory.index(&canonical(value));
                number.map(|n| format!("*{n}"))
            }
            None => target.starts_with('*').then(|| target.to_owned()),
        };
        let instructions = &self.programs[self.at.0].instructions;
        let is_label = |i: &Instruction, label: &str| matches!(i, Instruction::Raw(t) if t.eq_ignore_ascii_case(label));
        let to = label.and_then(|label| instructions.iter().position(|i| is_label(i, &label)));
        match to.filter(|to| holds == Some(true) && (*to > self.at.1 || !self.astray)) {
            Some(to) => Flow::To(to),
            None => self.undecided(text),
        }
    }

    /// A jump or a call of which it is not known whether it is made, or where it leads: told, and passed over.
    fn undecided(&mut self, text: &str) -> Flow {
        self.astray = true;
        self.gap(Missing::Jump(text.to_owned()));
        Flow::Next
    }

    /// Forgets what an unknown line may set: all that other jobs see, and what it names.
    pub(super) fn forget_variables(&mut self, text: &str) {
        let named = canonical(text);
        let part = |c: char| !(c.is_ascii_alphanumeric() || c == '_');
        let named: Vec<&str> = named.split(part).collect();
        let values = &mut self.memory.names.values;
        values.retain(|key, _| key.starts_with('l') && !named.contains(&key.as_str()));
    }

    /// Takes the variables of the job that runs, while another one does.
    pub(super) fn own_variables(&mut self) -> BTreeMap<String, f64> {
        let values = std::mem::take(&mut self.memory.names.values);
        let (own, all) = values
            .into_iter()
            .partition(|(key, _)| key.starts_with('l'));
        self.memory.names.values = all;
        own
    }

    /// Gives them back.
    pub(super) fn own_again(&mut self, own: BTreeMap<String, f64>) {
        let values = &mut self.memory.names.values;
        values.retain(|key, _| !key.starts_with('l'));
        values.extend(own);
    }
}
