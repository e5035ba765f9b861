//! The position data of a job: from text and to text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::program::{Axis, Coordinates};
use crate::scan::{numbers, strip_prefix};
use crate::written::fixed;

/// What the controller calls the axes of the robot.
const AXES: [&str; 6] = ["S", "L", "U", "R", "B", "T"];

/// A position with the frames it was taught in.
pub(super) type Entry = (Coordinates, (Option<u32>, Option<u32>));

/// What the lines before a position say of it.
#[derive(Debug, Default)]
pub(super) struct Table {
    user: u32,
    tool: u32,
    kind: String,
    config: String,
    entries: BTreeMap<String, Entry>,
}

/// `C00012` as `C12`: the same position, however many zeros are written.
fn key(name: &str) -> Option<String> {
    let digits = name.find(|c: char| c.is_ascii_digit())?;
    let (letters, number) = name.split_at(digits);
    let number: u32 = number.parse().ok()?;
    let letters = letters.to_ascii_uppercase();
    matches!(letters.as_str(), "C" | "P").then(|| format!("{letters}{number}"))
}

impl Table {
    /// Takes in a line of the position data; whether it is known here.
    pub(super) fn line(&mut self, line: &str) -> bool {
        let said = |word: &str| strip_prefix(line, word).map(str::trim);
        if let Some(number) = said("///USER ").map(str::parse) {
            self.user = number.unwrap_or(0);
            return number_read(line);
        }
        if let Some(number) = said("///TOOL ").map(str::parse) {
            self.tool = number.unwrap_or(0);
            return number_read(line);
        }
        if let Some(kind) = said("///POSTYPE ") {
            self.kind = kind.to_ascii_uppercase();
            return matches!(self.kind.as_str(), "USER" | "BASE" | "ROBOT" | "PULSE");
        }
        if let Some(config) = said("///RCONF ") {
            let first: Vec<&str> = config.split(',').map(str::trim).take(6).collect();
            self.config = first.join(",");
            return true;
        }
        let known = ["///NPOS", "///RECTAN", "///PULSE"];
        if known.iter().any(|w| strip_prefix(line, w).is_some()) {
            return true;
        }
        let Some((name, values)) = line.split_once('=') else {
            return false;
        };
        let entry = numbers(values).and_then(|v| self.coordinates(&v));
        match (key(name.trim()), entry) {
            (Some(key), Some(coordinates)) => {
                let user = if self.kind == "USER" { self.user } else { 0 };
                let frames = (Some(user), Some(self.tool));
                self.entries.insert(key, (coordinates, frames));
                true
            }
            _ => false,
        }
    }

    fn coordinates(&self, values: &[f64]) -> Option<Coordinates> {
        if self.kind == "PULSE" {
            let axis = |(name, value): (&&str, &f64)| Axis {
                name: (*name).to_owned(),
                value: *value,
                unit: "pulse".to_owned(),
            };
            let axes: Vec<Axis> = AXES.iter().zip(values).map(axis).collect();
            return (axes.len() == AXES.len()).then_some(Coordinates::Joint(axes));
        }
        let cartesian = matches!(self.kind.as_str(), "USER" | "BASE" | "ROBOT");
        match values.get(..6)? {
            [x, y, z, w, p, r] if cartesian => Some(Coordinates::Cartesian {
                config: self.config.clone(),
                xyz: [*x, *y, *z],
                // about the fixed x, then y, then z
                wpr_degrees: [*w, *p, *r],
                external: Vec::new(),
            }),
            _ => None,
        }
    }

    /// The position that a move names.
    pub(super) fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.get(&key(name)?)
    }
}

fn number_read(line: &str) -> bool {
    line.rsplit(' ')
        .next()
        .is_some_and(|n| n.parse::<u32>().is_ok())
}

/// The position data while a job is written: one entry for each use.
#[derive(Debug, Default)]
pub(super) struct Written {
    text: String,
    count: usize,
    /// What the lines so far have set.
    set: Vec<String>,
}

impl Written {
    /// Adds a position; its name, or nothing for one that has no words.
    pub(super) fn add(&mut self, (coordinates, frames): &Entry) -> Option<String> {
        let (user, tool) = (frames.0.unwrap_or(0), frames.1.unwrap_or(0));
        let tool = format!("///TOOL {tool}");
        let (head, value) = match coordinates {
            Coordinates::Cartesian {
                config,
                xyz,
                wpr_degrees,
                external,
            } if external.is_empty() && config.split(',').count() == 6 => {
                let kind = if user == 0 { "BASE" } else { "USER" };
                let values = xyz
                    .map(|v| fixed(v, 3))
                    .into_iter()
                    .chain(wpr_degrees.map(|v| fixed(v, 4)));
                let head = vec![
                    format!("///USER {user}"),
                    tool,
                    format!("///POSTYPE {kind}"),
                    "///RECTAN".to_owned(),
                    format!("///RCONF {config},0,0"),
                ];
                (head, values.collect::<Vec<_>>())
            }
            Coordinates::Joint(axes) if axes.iter().all(|a| a.unit == "pulse") => {
                let head = vec![tool, "///POSTYPE PULSE".to_owned(), "///PULSE".to_owned()];
                (head, axes.iter().map(|a| fixed(a.value, 0)).collect())
            }
            _ => return None,
        };
        // one line that changes is enough, but a change of type sets all anew
        let kind = |lines: &[String]| lines.iter().find(|l| l.starts_with("///POSTYPE")).cloned();
        let anew = kind(&head) != kind(&self.set);
        for line in &head {
            let zero = line == "///USER 0";
            if (anew || !self.set.contains(line)) && !zero {
                // writing to a String cannot fail
                let _ = writeln!(self.text, "{line}");
            }
        }
        self.set = head;
        let name = format!("C{:05}", self.count);
        let _ = writeln!(self.text, "{name}={}", value.join(","));
        self.count += 1;
        Some(name)
    }

    /// The section.
    pub(super) fn section(&self) -> String {
        format!("//POS\n///NPOS {},0,0,0,0,0\n{}", self.count, self.text)
    }
}
