//! What is not TOML, told by what people meant: a decimal comma, a unit without quotes.

use std::ops::Range;

use super::Problem;

/// A problem of the file's form; where the line holds a number with a comma or a unit, with what to write.
pub(super) fn problem(text: &str, message: &str, span: Option<Range<usize>>) -> Problem {
    let told = Problem::new(message).at(span.clone());
    match span.and_then(|span| meant(text, span.start)) {
        Some((place, fix)) => Problem {
            fix: Some(fix.clone()),
            ..told.at(place).help(format!("write {fix}"))
        },
        None => told,
    }
}

/// The value on the line of `byte` that begins like a number and is none: its place, and what to write.
fn meant(text: &str, byte: usize) -> Option<(Range<usize>, String)> {
    let begin = text.get(..byte)?.rfind('\n').map_or(0, |at| at + 1);
    let line = text.get(begin..)?.lines().next()?;
    let code = line.split('#').next()?;
    let from = begin + code.find('=')? + 1;
    let value = text.get(from..begin + code.len())?;
    let written = value.trim();
    let number = written.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if !number || written.contains(['"', '\'', '[', '{']) {
        return None;
    }
    let start = from + (value.len() - value.trim_start().len());
    let place = start..start + written.len();
    let pointed = written.replacen(',', ".", 1);
    if pointed.parse::<f64>().is_ok() {
        return (pointed != written).then_some((place, pointed));
    }
    Some((place, format!("\"{pointed}\"")))
}
