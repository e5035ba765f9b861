//! What statements of KRL do to variables.

use std::collections::BTreeMap;

use super::data::coordinates;
use super::list::{List, capital};
use crate::expression::{Quotient, Spelling};
use crate::program::Coordinates;
use crate::scan::{before_last_word, finite, identifier, is_variable, strip_word, uncommented};
use crate::unrolled::{Language, Place, Step};

/// Words of lines that set no variable, beside assignments to the controller's own.
const ACTS: [&str; 17] = [
    "PTP",
    "SPTP",
    "LIN",
    "SLIN",
    "CIRC",
    "SCIRC",
    "WAIT",
    "BAS",
    "TRIGGER",
    "ARCMAINNG",
    "RETURN",
    "HALT",
    "CONTINUE",
    "END",
    "DEF",
    "FDAT_ACT",
    "LDAT_ACT",
];

/// The numbers of a position that are told by letters.
const PLACE: [(&str, &str); 6] = [
    (".X", "X"),
    (".Y", "Y"),
    (".Z", "Z"),
    (".A", "A"),
    (".B", "B"),
    (".C", "C"),
];
const STANCE: [(&str, &str); 2] = [(".S", "S"), (".T", "T")];
const AXES: [(&str, &str); 6] = [
    (".E1", "E1"),
    (".E2", "E2"),
    (".E3", "E3"),
    (".E4", "E4"),
    (".E5", "E5"),
    (".E6", "E6"),
];

/// KRL, with what the data list says.
pub(super) struct Krl<'a>(pub(super) &'a List);

impl Language for Krl<'_> {
    fn step<'t>(&self, text: &'t str) -> Step<'t> {
        if text.starts_with(';')
            || text.starts_with('&')
            || text.is_empty()
            || text.starts_with('$')
        {
            return Step::Acts;
        }
        let text = uncommented(text);
        if let Some((name, value)) = text.split_once('=')
            && is_variable(name.trim())
            && !ACTS.contains(&name.trim().to_ascii_uppercase().as_str())
        {
            return Step::Set(name.trim(), value.trim());
        }
        let (word, rest) = identifier(text);
        let rest = rest.trim();
        let word = word.to_ascii_uppercase();
        match word.as_str() {
            "DECL" | "INT" | "REAL" | "POS" | "E6POS" | "FRAME" => {
                return declares(text).unwrap_or(Step::Calls);
            }
            "FOR" => return counts(rest).unwrap_or(Step::Opens),
            "WHILE" => return Step::While(rest),
            "REPEAT" => return Step::Repeat,
            "UNTIL" => return Step::Until(rest),
            "LOOP" => return Step::Loop,
            "EXIT" => return Step::Leave,
            "IF" => return before_last_word(rest, "THEN").map_or(Step::Opens, Step::If),
            "ELSE" => return Step::Else,
            "SWITCH" => return Step::Opens,
            "GOTO" => return Step::Jumps,
            "ENDFOR" | "ENDWHILE" | "ENDLOOP" | "ENDIF" | "ENDSWITCH" => return Step::End,
            _ => {}
        }
        if ACTS.contains(&word.as_str()) {
            return Step::Acts;
        }
        Step::Calls
    }

    fn place(&self, text: &str) -> Option<Place> {
        numbers(&coordinates(text)?)
    }

    fn written(&self, place: &[(&'static str, f64)]) -> String {
        let all = place
            .iter()
            .map(|(name, value)| format!("{} {value}", &name[1..]));
        format!("{{{}}}", all.collect::<Vec<_>>().join(","))
    }

    fn declared(&self, name: &str) -> Option<Place> {
        numbers(self.0.positions.get(&capital(name))?)
    }

    fn spelling(&self) -> Spelling {
        Spelling::AnyCase
    }

    fn quotient(&self) -> Quotient {
        Quotient::Unknown
    }
}

/// `i=1 TO 10 STEP 2`
fn counts(text: &str) -> Option<Step<'_>> {
    let (name, range) = text.split_once('=')?;
    let upper = range.to_ascii_uppercase();
    let at = upper.find(" TO ")?;
    let (from, to) = (&range[..at], &range[at + 4..]);
    let (to, by) = match upper[at + 4..].find(" STEP ") {
        Some(step) => (&to[..step], &to[step + 6..]),
        None => (to, "1"),
    };
    is_variable(name.trim()).then_some(Step::For(name.trim(), [from, to], Some(by)))
}

/// `DECL INT i,j`, `REAL h=2.2`, `E6POS XP`.
fn declares(text: &str) -> Option<Step<'_>> {
    let rest = strip_word(text, "DECL").unwrap_or(text).trim_start();
    let rest = strip_word(rest, "GLOBAL").unwrap_or(rest).trim_start();
    let whole = strip_word(rest, "INT");
    let kinds = ["REAL", "POS", "E6POS", "FRAME"];
    let other = || kinds.iter().find_map(|kind| strip_word(rest, kind));
    let rest = whole.or_else(other)?.trim();
    let (names, value) = match rest.split_once('=') {
        Some((name, value)) => (name.trim(), Some(value.trim())),
        None => (rest, None),
    };
    let all = names.split(',').map(str::trim).all(is_variable);
    all.then_some(match whole {
        Some(_) => Step::DeclareWhole(names, value),
        None => Step::Declare(names, value),
    })
}

fn numbers(place: &Coordinates) -> Option<Place> {
    let Coordinates::Cartesian {
        config,
        xyz,
        wpr_degrees: [c, b, a],
        external,
    } = place
    else {
        return None;
    };
    let values = [xyz[0], xyz[1], xyz[2], *a, *b, *c];
    let mut all: Place = PLACE
        .iter()
        .map(|(suffix, _)| *suffix)
        .zip(values)
        .collect();
    for (suffix, name) in STANCE {
        let said = config
            .split(',')
            .find_map(|part| finite(strip_word(part.trim(), name)?));
        all.extend(said.map(|value| (suffix, value)));
    }
    for (suffix, name) in AXES {
        let axis = external.iter().find(|axis| axis.name == name);
        all.extend(axis.map(|axis| (suffix, axis.value)));
    }
    Some(all)
}

/// The numbers that the data list declares and that no line of the source sets.
pub(super) fn constants(list: &List, code: &[&str]) -> BTreeMap<String, f64> {
    let krl = Krl(list);
    let steps = || code.iter().map(|line| (line, krl.step(line)));
    let sets = |name: &str| {
        steps().any(|(line, step)| match step {
            Step::Declare(others, _) | Step::DeclareWhole(others, _) => others
                .split(',')
                .any(|o| o.trim().eq_ignore_ascii_case(name)),
            Step::Set(other, _) | Step::For(other, ..) => other.eq_ignore_ascii_case(name),
            Step::Calls => {
                let mut words = line.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
                words.any(|w| w.eq_ignore_ascii_case(name))
            }
            _ => false,
        })
    };
    let declared = list
        .rest
        .iter()
        .filter_map(|(_, line)| match declares(uncommented(line)) {
            Some(Step::Declare(name, Some(value)) | Step::DeclareWhole(name, Some(value))) => {
                Some((name.to_ascii_lowercase(), finite(value)?))
            }
            _ => None,
        });
    declared.filter(|(name, _)| !sets(name)).collect()
}
