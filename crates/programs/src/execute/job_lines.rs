//! Lines of logic of a Yaskawa's jobs, in their parts, and its variables by their names.

use super::effect::first_word;
use crate::scan::strip_word;

/// Lines of logic begin so.
pub(super) const WORDS: [&str; 11] = [
    "SET", "ADD", "SUB", "MUL", "DIV", "INC", "DEC", "CLEAR", "GETARG", "JUMP", "SFTOF",
];

/// Whether a line is one of logic that is followed.
pub(super) fn is_inform_logic(text: &str) -> bool {
    text.starts_with('*') || WORDS.contains(&&*first_word(text)) || conditional(text).is_some()
}

/// What a `CALL` or a `RET` does under a condition.
pub(super) fn conditional(text: &str) -> Option<(&str, &str)> {
    let (action, condition) = behind_if(text)?;
    let acts = ["CALL", "RET"]
        .iter()
        .any(|w| strip_word(action, w).is_some());
    acts.then_some((action, condition))
}

/// What stands before and behind ` IF `.
pub(super) fn behind_if(text: &str) -> Option<(&str, &str)> {
    let at = text.to_ascii_uppercase().find(" IF ")?;
    Some((text[..at].trim(), text[at + 4..].trim()))
}

/// The name of a variable without leading zeros, in small letters: `b12` of `B012`, `lb0` of `LB000`.
pub(super) fn variable(text: &str) -> Option<String> {
    let upper = text.trim().to_ascii_uppercase();
    let digits = upper.find(|c: char| c.is_ascii_digit())?;
    let (kind, number) = upper.split_at(digits);
    let known = ["B", "I", "D", "R", "LB", "LI", "LD", "LR"].contains(&kind);
    let number: u32 = number.parse().ok().filter(|_| known)?;
    Some(format!("{}{number}", kind.to_ascii_lowercase()))
}

/// A text with its variables named so.
pub(super) fn canonical(text: &str) -> String {
    let mut out = String::new();
    let mut word = String::new();
    for c in text.chars().chain(['\0']) {
        if c.is_ascii_alphanumeric() || c == '_' {
            word.push(c);
            continue;
        }
        out += &variable(&word).unwrap_or_else(|| word.clone());
        word.clear();
        out.extend((c != '\0').then_some(c));
    }
    out
}

/// A value as a variable holds it; nothing where it does not fit, or is rounded.
pub(super) fn held(name: &str, value: f64) -> Option<f64> {
    let whole = |low: f64, high: f64| {
        (value.fract() == 0.0 && (low..=high).contains(&value)).then_some(value)
    };
    match name.trim_start_matches('l').as_bytes().first()? {
        b'b' => whole(0.0, 255.0),
        b'i' => whole(-32_768.0, 32_767.0),
        b'd' => whole(-2_147_483_648.0, 2_147_483_647.0),
        _ => Some(value),
    }
}
