//! What statements of a script do to variables.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::words::ScriptWords;
use crate::expression::{Memory, Names, Quotient, Spelling};
use crate::orientation::{pose, rotation_vector_of, wpr_of_rotation_vector};
use crate::scan::{self, called, first_word, identifier, strip_word};
use crate::unrolled::{Language, Place, Step};

/// Functions that set no variable.
const ACTS: [&str; 22] = [
    "movel",
    "movej",
    "movep",
    "movec",
    "sleep",
    "sync",
    "halt",
    "set_tcp",
    "set_payload",
    "set_digital_out",
    "set_standard_digital_out",
    "set_configurable_digital_out",
    "set_tool_digital_out",
    "set_analog_out",
    "set_standard_analog_out",
    "textmsg",
    "popup",
    "return",
    "stopl",
    "stopj",
    "set_gravity",
    "set_target_payload",
];

/// The numbers of a pose.
const NUMBERS: [&str; 6] = ["[0]", "[1]", "[2]", "[3]", "[4]", "[5]"];

/// Script, with the words of the cell: what they name is no variable here.
pub(super) struct Script<'w>(pub(super) Option<&'w ScriptWords>);

impl Language for Script<'_> {
    fn step<'t>(&self, text: &'t str) -> Step<'t> {
        let text = text.split('#').next().unwrap_or_default().trim();
        if text.is_empty() {
            return Step::Acts;
        }
        let block = text.strip_suffix(':').map(str::trim);
        let (word, _) = identifier(text);
        match (word, block) {
            ("while", Some(head)) => return Step::While(condition(head, "while")),
            ("if", Some(head)) => return Step::If(condition(head, "if")),
            ("elif", Some(head)) => return Step::ElseIf(condition(head, "elif")),
            ("else", Some(_)) => return Step::Else,
            (_, Some(_)) => return Step::Opens,
            ("end", _) => return Step::End,
            ("break", _) => return Step::Leave,
            ("continue", _) => return Step::Again,
            _ => {}
        }
        if self.is_arc(text) {
            return Step::Acts;
        }
        let (own, said) = match (strip_word(text, "local"), strip_word(text, "global")) {
            (Some(rest), _) => (true, rest.trim()),
            (_, Some(rest)) => (false, rest.trim()),
            _ => (true, text),
        };
        if let Some((name, value)) = said.split_once('=') {
            let (name, value) = (name.trim(), value.trim());
            let (plain, index) = identifier(name);
            let indexed = index.strip_prefix('[').and_then(|i| i.strip_suffix(']'));
            let starts = plain.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
            if starts && !value.starts_with('=') {
                match (index, indexed) {
                    ("", _) if own => return Step::Declare(name, Some(value)),
                    ("", _) | (_, Some("0" | "1" | "2" | "3" | "4" | "5")) => {
                        return Step::Set(name, value);
                    }
                    _ => {}
                }
            }
        }
        if ACTS.contains(&first_word_of_call(text)) {
            return Step::Acts;
        }
        Step::Calls
    }

    fn place(&self, text: &str) -> Option<Place> {
        if let Some(all) = called(text, "pose_trans") {
            let [a, b] = all[..] else { return None };
            let both = pose_of(a)?.then(pose_of(b)?);
            let turned = rotation_vector_of(both.wpr().to_array().map(f64::to_degrees));
            let at = (both.position / 1000.0).to_array();
            return Some(
                NUMBERS
                    .into_iter()
                    .zip(at.into_iter().chain(turned))
                    .collect(),
            );
        }
        Some(NUMBERS.into_iter().zip(pose_numbers(text)?).collect())
    }

    fn written(&self, place: &[(&'static str, f64)]) -> String {
        let all: Vec<String> = place.iter().map(|(_, value)| value.to_string()).collect();
        format!("p[{}]", all.join(","))
    }

    fn declared(&self, _: &str) -> Option<Place> {
        None
    }

    fn spelling(&self) -> Spelling {
        Spelling::Exact
    }

    fn quotient(&self) -> Quotient {
        Quotient::Unknown
    }
}

impl Script<'_> {
    /// Whether a line sets what lines of the arc set, or calls what they call: that sets no variable here.
    fn is_arc(&self, text: &str) -> bool {
        let Some(words) = self.0 else { return false };
        // a variable that is set, or a function that is called
        let name = |line: &str| {
            line.split(['=', '('])
                .next()
                .unwrap_or_default()
                .trim()
                .to_owned()
        };
        let lines = words.arc_start.iter().chain(words.arc_end.iter());
        let mut own = lines.map(|line| name(line));
        own.any(|own| own == name(text))
    }
}

fn condition<'t>(head: &'t str, word: &str) -> &'t str {
    head.strip_prefix(word).unwrap_or(head).trim()
}

/// The name in front of the parenthesis, or the only word.
fn first_word_of_call(text: &str) -> &str {
    let name = text.split('(').next().unwrap_or_default().trim();
    if name.is_empty() {
        first_word(text)
    } else {
        name
    }
}

/// A pose `p[…]` in m and rad; nothing where it is none.
pub(super) fn pose_of(text: &str) -> Option<Pose> {
    let [x, y, z, a, b, c] = numbers(text.strip_prefix('p')?)?;
    let at = DVec3::new(x, y, z) * 1000.0;
    Some(pose(at, wpr_of_rotation_vector([a, b, c])?))
}

/// The numbers of a list in brackets, sums and products of numbers among them.
pub(super) fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let inner = text.strip_prefix('[')?.strip_suffix(']')?;
    let none = Memory {
        names: Names {
            spelling: Spelling::Exact,
            quotient: Quotient::Unknown,
            ..Names::default()
        },
        ..Memory::default()
    };
    let all = scan::arguments(inner).into_iter();
    let all: Option<Vec<f64>> = all
        .map(|v| scan::finite(v).or_else(|| none.number(v).filter(|v| v.is_finite())))
        .collect();
    all?.try_into().ok()
}

/// The numbers of `p[…]`, or of the sum of one and another that does not turn, `pose_add(p[…],p[…])`.
pub(super) fn pose_numbers(text: &str) -> Option<[f64; 6]> {
    let Some(all) = called(text, "pose_add") else {
        return numbers(text.trim().strip_prefix('p')?);
    };
    let [a, b] = all[..] else { return None };
    let (mut sum, by) = (pose_numbers(a)?, pose_numbers(b)?);
    let turns = by[3..].iter().any(|v| *v != 0.0);
    (0..3).for_each(|i| sum[i] += by[i]);
    (!turns).then_some(sum)
}
