//! Lines that say the same in other words, and the outputs that lines set: a Universal Robot's and a Yaskawa's.
//!
//! Universal Robots' script manual: `set_digital_out` is the old name of `set_standard_digital_out`; its outputs 8 and 9 are the tool's 0 and 1,
//! and the other way of counting them, that of the controller's data exchange, has 8 to 15 for the configurable ones and 16, 17 for the tool's.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use crate::program::Dialect;
use crate::scan::{arguments, strip_word, tidy};

/// A Universal Robot's outputs in one row: standard, configurable, the tool's.
const STANDARD: RangeInclusive<u32> = 0..=7;
const CONFIGURABLE: RangeInclusive<u32> = 8..=15;
const TOOL: RangeInclusive<u32> = 16..=17;
/// How `set_digital_out` counts the tool's, by the manual.
const TOOL_IN_OLD: RangeInclusive<u32> = 8..=9;

/// A line as it is compared: without its remark, white space that says nothing, and old names of functions.
pub(crate) fn plain(dialect: Dialect, line: &str) -> Cow<'_, str> {
    match dialect {
        Dialect::UrScript => {
            let line = closed_up(line, "#");
            Cow::Owned(renamed(&line).unwrap_or(line))
        }
        Dialect::Val3 => Cow::Owned(closed_up(line, "//")),
        Dialect::Inform => Cow::Owned(tidy(line)),
        Dialect::FanucLs | Dialect::Krl | Dialect::Rapid => Cow::Borrowed(line.trim()),
    }
}

/// A line without what stands behind `mark`, and without white space outside quotes.
fn closed_up(line: &str, mark: &str) -> String {
    let mut quoted = false;
    let mut text = String::with_capacity(line.len());
    for (at, c) in line.char_indices() {
        quoted ^= c == '"';
        if !quoted && line[at..].starts_with(mark) {
            break;
        }
        if quoted || !c.is_whitespace() {
            text.push(c);
        }
    }
    text
}

/// A call of a script under its present name, its arguments at their places; nothing for any other line.
fn renamed(line: &str) -> Option<String> {
    let (name, inner) = line.split_once('(')?;
    let mut all: Vec<&str> = arguments(inner.strip_suffix(')')?);
    let [n, value] = all.get_mut(..)? else {
        return None;
    };
    (*n, *value) = in_order(n, value)?;
    let number = n.parse().ok();
    let (name, n) = match (name, number) {
        ("set_digital_out", Some(n)) if STANDARD.contains(&n) => ("set_standard_digital_out", n),
        ("set_digital_out", Some(n)) if TOOL_IN_OLD.contains(&n) => {
            ("set_tool_digital_out", n - TOOL_IN_OLD.start())
        }
        ("set_analog_out", Some(n)) => ("set_standard_analog_out", n),
        (name, Some(n)) => (name, n),
        (_, None) => return None,
    };
    Some(format!("{name}({n},{value})"))
}

/// Two arguments in the order of their places, `n` and the value, where they may be told by their names.
fn in_order<'a>(first: &'a str, second: &'a str) -> Option<(&'a str, &'a str)> {
    let named = |text: &'a str| text.split_once('=');
    Some(match (named(first), named(second)) {
        (None, None) => (first, second),
        (None, Some((_, value))) => (first, value),
        (Some(("n", n)), Some((_, value))) | (Some((_, value)), Some(("n", n))) => (n, value),
        _ => return None,
    })
}

/// Digital outputs that a line may set; in one row for a Universal Robot, by their numbers for a Yaskawa.
pub(crate) fn outputs(dialect: Dialect, line: &str) -> Vec<RangeInclusive<u32>> {
    match dialect {
        Dialect::UrScript => of_script(&closed_up(line, "#")),
        Dialect::Inform => of_job(line),
        // what sets one there is told as a line that is not known, or no line of the cell file names it
        Dialect::FanucLs | Dialect::Krl | Dialect::Rapid | Dialect::Val3 => Vec::new(),
    }
}

fn of_script(line: &str) -> Vec<RangeInclusive<u32>> {
    let Some((name, inner)) = line.split_once('(') else {
        return Vec::new();
    };
    let all = arguments(inner.strip_suffix(')').unwrap_or(inner));
    let number = || {
        let [first, second] = all[..] else {
            return None;
        };
        in_order(first, second)?.0.parse::<u32>().ok()
    };
    let of = |row: RangeInclusive<u32>| match number() {
        Some(n) => vec![row.start() + n..=row.start() + n],
        None => vec![row],
    };
    match name {
        "set_digital_out" => match number() {
            Some(n) if TOOL_IN_OLD.contains(&n) => {
                let of_tool = TOOL.start() + n - TOOL_IN_OLD.start();
                vec![n..=n, of_tool..=of_tool]
            }
            Some(n) => vec![n..=n],
            None => vec![*STANDARD.start()..=*TOOL.end()],
        },
        "set_standard_digital_out" => of(STANDARD),
        "set_configurable_digital_out" => of(CONFIGURABLE),
        "set_tool_digital_out" => of(TOOL),
        _ => Vec::new(),
    }
}

/// `DOUT OT#(3) ON`, `PULSE OT#(3)`; `OG#(1)` are outputs 1 to 8, `OGH#(1)` 1 to 4.
fn of_job(line: &str) -> Vec<RangeInclusive<u32>> {
    let Some(rest) = ["DOUT", "PULSE"].iter().find_map(|w| strip_word(line, w)) else {
        return Vec::new();
    };
    let rest = rest.trim().to_ascii_uppercase();
    let group = [("OT#(", 1), ("OGH#(", 4), ("OG#(", 8)];
    let found = group.iter().find_map(|(word, size)| {
        let (number, _) = rest.strip_prefix(word)?.split_once(')')?;
        let number: u32 = number
            .trim()
            .parse()
            .ok()
            .filter(|n| (1..=9999).contains(n))?;
        Some((number - 1) * size + 1..=number * size)
    });
    vec![found.unwrap_or(1..=u32::MAX)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_has_one_plain_form() {
        let same = |a: &str, b: &str| {
            assert_eq!(
                plain(Dialect::UrScript, a),
                plain(Dialect::UrScript, b),
                "{a}"
            );
        };
        same(
            "set_digital_out(0, False)",
            "set_standard_digital_out( 0,False ) # off",
        );
        same(
            "set_digital_out(9,True)",
            "set_tool_digital_out(b=True, n=1)",
        );
        same("set_analog_out(1, {2})", "set_standard_analog_out(1,{2})");
        let outputs = |line| outputs(Dialect::UrScript, line);
        assert_eq!(outputs("set_digital_out(8, True)"), [8..=8, 16..=16]);
        assert_eq!(outputs("set_configurable_digital_out(0, True)"), [8..=8]);
        assert_eq!(outputs("set_digital_out(n, True)"), [0..=17]);
        assert!(outputs("set_analog_out(0, 1)").is_empty());
    }
}
