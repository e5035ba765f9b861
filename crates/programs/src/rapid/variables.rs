//! What statements of RAPID do to variables.

use std::collections::{BTreeMap, BTreeSet};

use super::data;
use super::declared::{Declared, displaced};
use super::harmless;
use super::statements::Statement;
use crate::expression::{Quotient, Spelling};
use crate::orientation::quaternion_of;
use crate::program::Coordinates;
use crate::scan::{before_last_word, finite, identifier, is_variable, strip_word};
use crate::unrolled::{Language, Place, Step, unrolled};

/// Instructions that shape metal, or may, and set no variable.
const SHAPES: [&str; 26] = [
    "MOVEL",
    "MOVEJ",
    "MOVEC",
    "MOVEABSJ",
    "ARCLSTART",
    "ARCL",
    "ARCLEND",
    "ARCCSTART",
    "ARCC",
    "ARCCEND",
    "WAITTIME",
    "WAITROB",
    "PDISPOFF",
    "EOFFSOFF",
    "STARTMOVE",
    "STOPMOVE",
    "PATHRESOL",
    "PATHACCLIM",
    "SPEEDREFRESH",
    "ACCSET",
    "VELSET",
    "SET",
    "SETAO",
    "SETGO",
    "RETURN",
    "EXIT",
];

/// Whether an instruction sets no variable, but for what its arguments name to be set.
fn sets_none(word: &str) -> bool {
    let all = SHAPES.iter().chain(&harmless::ACTS).chain(&harmless::WAITS);
    all.into_iter().any(|w| *w == word)
}

/// The numbers of a `robtarget`.
const NUMBERS: [&str; 17] = [
    ".trans.x",
    ".trans.y",
    ".trans.z",
    ".rot.q1",
    ".rot.q2",
    ".rot.q3",
    ".rot.q4",
    ".robconf.cf1",
    ".robconf.cf4",
    ".robconf.cf6",
    ".robconf.cfx",
    ".extax.eax_a",
    ".extax.eax_b",
    ".extax.eax_c",
    ".extax.eax_d",
    ".extax.eax_e",
    ".extax.eax_f",
];

/// RAPID, with what a module declares.
struct Rapid<'a>(&'a Declared);

impl Language for Rapid<'_> {
    fn step<'t>(&self, text: &'t str) -> Step<'t> {
        if text.starts_with('!') {
            return Step::Acts;
        }
        if let Some((name, value)) = text.split_once(":=")
            && is_variable(name.trim())
        {
            return Step::Set(name.trim(), value.trim());
        }
        let (word, rest) = identifier(text);
        let rest = rest.trim();
        let word = word.to_ascii_uppercase();
        match word.as_str() {
            "VAR" | "PERS" | "CONST" => return declares(rest).unwrap_or(Step::Calls),
            "FOR" => return counts(rest).unwrap_or(Step::Opens),
            "WHILE" => return before_last_word(rest, "DO").map_or(Step::Opens, Step::While),
            "IF" => return before_last_word(rest, "THEN").map_or(Step::Calls, Step::If),
            "ELSEIF" => return before_last_word(rest, "THEN").map_or(Step::Opens, Step::ElseIf),
            "ELSE" => return Step::Else,
            "TEST" => return Step::Opens,
            "GOTO" => return Step::Jumps,
            "ENDFOR" | "ENDWHILE" | "ENDIF" | "ENDTEST" => return Step::End,
            "INCR" if is_variable(rest) => return Step::Add(rest, "1"),
            "DECR" if is_variable(rest) => return Step::Add(rest, "-1"),
            "ADD" => {
                if let Some((name, by)) =
                    rest.split_once(',').filter(|(n, _)| is_variable(n.trim()))
                {
                    return Step::Add(name.trim(), by);
                }
            }
            _ => {}
        }
        // waits may tell in a variable whether their time ran out
        let sets = rest.to_ascii_uppercase().contains("FLAG:=");
        if sets_none(&word) && !sets {
            return Step::Acts;
        }
        Step::Calls
    }

    fn place(&self, text: &str) -> Option<Place> {
        displaced(text, self.0)
            .or_else(|| data::target(&data::value(text)?))
            .and_then(|p| numbers(&p))
    }

    fn written(&self, place: &[(&'static str, f64)]) -> String {
        let all: Vec<String> = place.iter().map(|(_, v)| v.to_string()).collect();
        let part = |range: std::ops::Range<usize>| {
            format!("[{}]", all.get(range).unwrap_or_default().join(","))
        };
        format!(
            "[{},{},{},{}]",
            part(0..3),
            part(3..7),
            part(7..11),
            part(11..17)
        )
    }

    fn declared(&self, name: &str) -> Option<Place> {
        self.0
            .targets
            .get(&name.to_ascii_lowercase())
            .and_then(numbers)
    }

    fn truths(&self) -> BTreeSet<String> {
        self.0.truths()
    }

    fn spelling(&self) -> Spelling {
        Spelling::AnyCase
    }

    fn quotient(&self) -> Quotient {
        Quotient::Fraction
    }
}

/// What stands before and behind a word.
fn round<'t>(text: &'t str, word: &str) -> Option<(&'t str, &'t str)> {
    let upper = text.to_ascii_uppercase();
    let at = upper.find(&format!(" {word} "))?;
    Some((text[..at].trim(), text[at + word.len() + 2..].trim()))
}

/// `i FROM 1 TO 10 STEP 2 DO`
fn counts(text: &str) -> Option<Step<'_>> {
    let (name, range) = round(before_last_word(text, "DO")?, "FROM")?;
    let (from, to) = round(range, "TO")?;
    let (to, by) = round(to, "STEP").map_or((to, None), |(to, by)| (to, Some(by)));
    is_variable(name).then_some(Step::For(name, [from, to], by))
}

/// `num h:=2`, which is 0 where nothing is said, or `robtarget p:=…`.
fn declares(text: &str) -> Option<Step<'_>> {
    let number = strip_word(text, "num");
    let truth = strip_word(text, "bool");
    let rest = number.or(truth).or_else(|| strip_word(text, "robtarget"))?;
    let (name, value) = match rest.split_once(":=") {
        Some((name, value)) => (name.trim(), Some(value.trim())),
        None if truth.is_some() => (rest.trim(), Some("FALSE")),
        None => (rest.trim(), number.map(|_| "0")),
    };
    is_variable(name).then_some(Step::Declare(name, value))
}

/// A plain truth value, as a number.
fn truth_of(text: &str) -> Option<f64> {
    let is = |word: &str| text.trim().eq_ignore_ascii_case(word);
    is("TRUE").then_some(1.0).or(is("FALSE").then_some(0.0))
}

/// The numbers of a target.
fn numbers(place: &Coordinates) -> Option<Place> {
    let Coordinates::Cartesian {
        config,
        xyz,
        wpr_degrees,
        external,
    } = place
    else {
        return None;
    };
    let mut all = [*xyz].concat();
    all.extend(quaternion_of(*wpr_degrees));
    all.extend(config.split(',').filter_map(finite));
    all.extend("abcdef".chars().map(|letter| {
        let axis = external.iter().find(|a| a.name == format!("eax_{letter}"));
        axis.map_or(data::NO_AXIS, |a| a.value)
    }));
    (all.len() == NUMBERS.len()).then(|| NUMBERS.into_iter().zip(all).collect())
}

/// The statements of a routine with `head` as they run.
pub(super) fn run_through(
    known: &Declared,
    constants: &BTreeMap<String, f64>,
    (head, body): (&str, &[Statement]),
) -> Vec<Statement> {
    // a parameter hides a constant of its name
    let mut constants = constants.clone();
    let words = head.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
    for word in words {
        constants.remove(&word.to_ascii_lowercase());
    }
    // and so do data of the routine's own
    constants.retain(|name, _| !known.own.contains_key(name));
    let body = body.iter().map(|s| (s.line, s.text.clone())).collect();
    let all = unrolled(&Rapid(known), &constants, body).into_iter();
    all.map(|(line, text)| Statement { line, text }).collect()
}

/// The numbers that the statements of a module outside its routines declare and that none at all sets.
pub(super) fn constants<'s>(
    known: &BTreeMap<String, f64>,
    outside: impl Iterator<Item = &'s Statement>,
    all: &[Statement],
) -> BTreeMap<String, f64> {
    let mut constants = known.clone();
    let sets = |name: &str| {
        all.iter()
            .any(|s| match Rapid(&Declared::default()).step(&s.text) {
                Step::Set(other, _) | Step::Add(other, _) => other.eq_ignore_ascii_case(name),
                // what is handed over may be set there
                Step::Calls => {
                    let mut words = s
                        .text
                        .split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
                    !s.text.contains(":=") && words.any(|w| w.eq_ignore_ascii_case(name))
                }
                _ => false,
            })
    };
    for statement in outside {
        let rest = ["LOCAL", "TASK"]
            .iter()
            .find_map(|w| strip_word(&statement.text, w));
        let (word, rest) = identifier(rest.unwrap_or(&statement.text).trim_start());
        let truth = strip_word(rest.trim(), "bool").is_some();
        let word = word.to_ascii_uppercase();
        let holds = matches!(word.as_str(), "VAR" | "PERS") || (truth && word == "CONST");
        if !holds {
            continue;
        }
        if let Some(Step::Declare(name, Some(value))) = declares(rest.trim())
            && let Some(value) = finite(value).or_else(|| truth_of(value).filter(|_| truth))
            && !sets(name)
        {
            constants.insert(name.to_ascii_lowercase(), value);
        }
    }
    constants
}
