//! Lines of logic of a FANUC, in their parts: conditions, choices, loops, jumps.

use super::effect::first_word;
use crate::scan::before_last_word;

/// A line of logic in its parts.
pub(super) enum Logic<'a> {
    /// `IF condition,action`
    If(&'a str, &'a str),
    /// `IF (condition) THEN`
    Then(&'a str),
    Else,
    EndIf,
    /// `FOR register=from TO to`
    For(&'a str),
    EndFor,
    While(&'a str),
    EndWhile,
    /// `SELECT value=case,action`
    Select(&'a str),
    /// `=case,action` or `ELSE,action` of a choice.
    Case,
    /// `JMP LBL[value]`
    Jump(&'a str),
}

/// A line of logic; `None` for any other line.
pub(super) fn logic(text: &str) -> Option<Logic<'_>> {
    let word = first_word(text);
    let rest = text.get(word.len()..)?.trim();
    Some(match word.as_str() {
        "IF" => {
            if let Some(condition) = before_last_word(rest, "THEN") {
                Logic::Then(condition)
            } else {
                let (condition, action) = parts(rest)?;
                Logic::If(condition, action)
            }
        }
        "ELSE" if rest.starts_with(',') => Logic::Case,
        "ELSE" => Logic::Else,
        "ENDIF" => Logic::EndIf,
        "FOR" => Logic::For(rest),
        "ENDFOR" => Logic::EndFor,
        "WHILE" => Logic::While(before_last_word(rest, "DO").unwrap_or(rest)),
        "ENDWHILE" => Logic::EndWhile,
        "SELECT" => Logic::Select(rest),
        "=" => Logic::Case,
        "JMP" => Logic::Jump(rest),
        _ => return None,
    })
}

/// Whether a line is one of logic.
pub(super) fn is_logic(text: &str) -> bool {
    logic(text).is_some()
}

/// Of a line of logic: what decides, what is executed then, and what a loop counts with.
pub(super) fn deciding(text: &str) -> (&str, Option<&str>, Option<&str>) {
    match logic(text) {
        Some(Logic::If(condition, action)) => (condition, Some(action), None),
        Some(Logic::Then(condition) | Logic::While(condition)) => (condition, None, None),
        Some(Logic::For(rest)) => match rest.split_once('=') {
            Some((register, bounds)) => (bounds, None, Some(register)),
            None => (rest, None, None),
        },
        Some(Logic::Select(rest)) => parts(rest).map_or((rest, None, None), with_action),
        Some(Logic::Case) => {
            let case = text.trim_start_matches('=');
            parts(case).map_or((case, None, None), with_action)
        }
        Some(Logic::Jump(label)) => (label, None, None),
        Some(Logic::Else | Logic::EndIf | Logic::EndFor | Logic::EndWhile) | None => {
            ("", None, None)
        }
    }
}

fn with_action<'t>(
    (condition, action): (&'t str, &'t str),
) -> (&'t str, Option<&'t str>, Option<&'t str>) {
    (condition, Some(action), None)
}

/// What stands before and after the first comma outside brackets; where there is none, after the parenthesis that opens the text.
pub(super) fn parts(text: &str) -> Option<(&str, &str)> {
    let mut depth = 0_i32;
    let mut closed = None;
    for (i, c) in text.char_indices() {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            ',' if depth == 0 => return Some((text[..i].trim(), text[i + 1..].trim())),
            _ => {}
        }
        if c == ')' && depth == 0 && closed.is_none() && text.starts_with('(') {
            closed = Some(i + 1);
        }
    }
    let at = closed?;
    let (condition, action) = (text[..at].trim(), text[at..].trim());
    (!action.is_empty()).then_some((condition, action))
}

/// Whether a line begins or ends a block.
pub(super) fn opens(text: &str) -> (i32, bool) {
    match logic(text) {
        Some(Logic::Then(_) | Logic::For(_) | Logic::While(_)) => (1, false),
        Some(Logic::EndIf | Logic::EndFor | Logic::EndWhile) => (-1, false),
        Some(Logic::Else) => (0, true),
        _ => (0, false),
    }
}

/// What stands in the bracket of `LBL[…]`.
pub(super) fn strip_label(text: &str) -> Option<&str> {
    let rest = text.get(..3).filter(|l| l.eq_ignore_ascii_case("LBL"))?;
    crate::scan::bracket(&text[rest.len()..]).map(|(inner, _)| inner)
}
