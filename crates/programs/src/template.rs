//! Lines with places for values, `{1}` to `{9}`: filled in, and recognised again. By such lines a cell says what switches its arc.

use std::ops::RangeInclusive;

use crate::program::{ArcAction, ArcWord, Dialect};
use crate::scan::first_word;
use crate::spelling::{outputs, plain};
use crate::written::NoWords;

/// The lines that switch a cell's arc.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ArcLines<'a> {
    /// Whose lines they are.
    pub(crate) dialect: Dialect,
    /// Strike it.
    pub(crate) start: &'a [String],
    /// Set it anew while it burns.
    pub(crate) set: &'a [String],
    /// End it.
    pub(crate) end: &'a [String],
}

/// What is told of an arc word that does not fill the lines, and what to do.
pub(crate) const UNFILLED: NoWords = (
    "an arc word with fewer values than the template has places",
    "list a value for each place ({1}, {2}, …) in the cell's [[program.schedule]]",
);

impl ArcLines<'_> {
    /// The lines for a word; nothing where a value is missing.
    pub(crate) fn filled(&self, word: &ArcWord, burns: bool) -> Option<Vec<String>> {
        let values: Vec<&str> = word.arguments.split(',').map(str::trim).collect();
        let template = match (word.action, burns) {
            (ArcAction::Start, false) => self.start,
            (ArcAction::Start, true) => self.set,
            (ArcAction::End, _) => self.end,
        };
        filled(template, &values)
    }

    /// The word that `lines` begin with, and how many of them it takes; `on` is what the arc burns with.
    pub(crate) fn read(&self, lines: &[&str], on: &mut Option<String>) -> Option<(usize, ArcWord)> {
        let first = if on.is_some() {
            [self.set, self.start]
        } else {
            [self.start, self.set]
        };
        for template in first {
            if let Some(values) = self.recognised(template, lines) {
                let arguments = values.join(",");
                *on = Some(arguments.clone());
                return Some((template.len(), ArcWord::new(ArcAction::Start, arguments)));
            }
        }
        let values = self.recognised(self.end, lines)?;
        let arguments = on.take().unwrap_or_else(|| values.join(","));
        Some((self.end.len(), ArcWord::new(ArcAction::End, arguments)))
    }

    /// Whether a line that is none of them may set an output that one of them sets.
    pub(crate) fn touches(&self, line: &str) -> bool {
        let set = outputs(self.dialect, line);
        let mut own = [self.start, self.set, self.end].into_iter().flatten();
        let meets = |a: &RangeInclusive<u32>, b: &RangeInclusive<u32>| {
            a.start() <= b.end() && b.start() <= a.end()
        };
        own.any(|wanted| {
            let own = outputs(self.dialect, wanted);
            own.iter().any(|a| set.iter().any(|b| meets(a, b)))
        })
    }

    /// How many of `lines` begin as the arc's do before one that goes on otherwise with the word that it begins with, that one included.
    pub(crate) fn broken(&self, lines: &[&str]) -> Option<usize> {
        [self.start, self.set, self.end]
            .into_iter()
            .find_map(|template| {
                let mut values = vec![String::new(); places(template)];
                let mut pairs = template.iter().zip(lines);
                let same = pairs.position(|(wanted, line)| {
                    self.recognised_line(wanted, line, &mut values).is_none()
                })?;
                let [wanted, line] = [template.get(same)?.trim(), lines.get(same)?.trim()];
                (same > 0 && first_word(wanted) == first_word(line)).then_some(same + 1)
            })
    }

    /// The values in the places of the template that `lines` begin with; nothing where they do not.
    fn recognised(&self, template: &[String], lines: &[&str]) -> Option<Vec<String>> {
        let mut values = vec![String::new(); places(template)];
        if template.is_empty() || lines.len() < template.len() {
            return None;
        }
        for (wanted, line) in template.iter().zip(lines) {
            self.recognised_line(wanted, line, &mut values)?;
        }
        Some(values)
    }

    fn recognised_line(&self, wanted: &str, line: &str, values: &mut [String]) -> Option<()> {
        let [wanted, line] = [wanted, line].map(|text| plain(self.dialect, text));
        recognised_line(&wanted, &line, values)
    }
}

/// The lines of a template with values in their places; nothing where a value is missing.
fn filled(template: &[String], values: &[&str]) -> Option<Vec<String>> {
    template
        .iter()
        .map(|line| filled_line(line, values))
        .collect()
}

fn filled_line(line: &str, values: &[&str]) -> Option<String> {
    let mut text = String::new();
    for piece in pieces(line) {
        match piece {
            Piece::Text(part) => text += part,
            Piece::Place(n) => text += values.get(n - 1)?,
        }
    }
    Some(text)
}

#[derive(Debug, PartialEq)]
enum Piece<'a> {
    Text(&'a str),
    /// Its number, from 1.
    Place(usize),
}

fn pieces(line: &str) -> Vec<Piece<'_>> {
    let mut all = Vec::new();
    let mut rest = line;
    while let Some(at) = rest.find('{') {
        let place = rest
            .get(at + 1..at + 3)
            .and_then(|p| p.strip_suffix('}')?.parse().ok());
        let Some(n @ 1..=9) = place else {
            let (head, after) = rest.split_at(at + 1);
            all.push(Piece::Text(head));
            rest = after;
            continue;
        };
        all.push(Piece::Text(&rest[..at]));
        all.push(Piece::Place(n));
        rest = &rest[at + 3..];
    }
    all.push(Piece::Text(rest));
    all
}

/// How many values a template has places for.
fn places(template: &[String]) -> usize {
    let all = template.iter().flat_map(|line| pieces(line));
    let numbers = all.map(|p| match p {
        Piece::Place(n) => n,
        Piece::Text(_) => 0,
    });
    numbers.max().unwrap_or(0)
}

fn recognised_line(wanted: &str, line: &str, values: &mut [String]) -> Option<()> {
    let mut rest = line;
    let mut open: Option<usize> = None;
    for piece in pieces(wanted) {
        match piece {
            Piece::Place(n) => open = Some(n),
            Piece::Text(part) => {
                let Some(n) = open.take() else {
                    rest = rest.strip_prefix(part)?;
                    continue;
                };
                // up to what follows the place, or to the end of the line
                let at = if part.is_empty() {
                    rest.len()
                } else {
                    rest.find(part)?
                };
                let value = rest[..at].trim();
                value.parse::<f64>().ok().filter(|v| v.is_finite())?;
                value.clone_into(values.get_mut(n - 1)?);
                rest = &rest[at + part.len()..];
            }
        }
    }
    rest.is_empty().then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_filled_in_is_recognised() {
        let template = [
            "set_job({1})".to_owned(),
            "set_analog_out(0, {2})".to_owned(),
        ];
        let lines = filled(&template, &["5", "0.75"]).unwrap();
        assert_eq!(lines, ["set_job(5)", "set_analog_out(0, 0.75)"]);
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let arc = ArcLines {
            dialect: Dialect::UrScript,
            start: &template,
            set: &[],
            end: &[],
        };
        assert_eq!(arc.recognised(&template, &lines).unwrap(), ["5", "0.75"]);
        let other = ["set_job(x)", "set_analog_out(0, 1)"];
        assert_eq!(arc.recognised(&template, &other), None);
        assert_eq!(arc.recognised(&template, &["set_job(1)"]), None);
        assert_eq!(filled(&template, &["5"]), None);
    }

    #[test]
    fn outputs_of_the_arc_are_known_by_any_name() {
        fn arc(dialect: Dialect, start: &str, line: &str) -> bool {
            let arc = ArcLines {
                dialect,
                start: &[start.to_owned()],
                set: &[],
                end: &[],
            };
            arc.touches(line)
        }
        let job = |line| arc(Dialect::Inform, "DOUT OT#(12) ON", line);
        assert!(job("DOUT OT#(12) OFF") && job("PULSE OT#(12) T=0.5") && job("DOUT OG#(2) B001"));
        assert!(!job("DOUT OT#(13) ON") && !job("DOUT OG#(1) B001"));
        // 8 is the tool's 0 or the configurable 0, as one counts
        let old = "set_digital_out(8, False)";
        for of in ["tool", "configurable"] {
            let start = format!("set_{of}_digital_out(0, True)");
            assert!(arc(Dialect::UrScript, &start, old), "{of}");
        }
    }
}
