//! The position data of a job: from text and to text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::pulses::{Pulses, base_at};
use crate::program::{Axis, Coordinates};
use crate::scan::{numbers, strip_prefix};
use crate::written::fixed;

/// What the controller calls the axes of the robot.
const AXES: [&str; 6] = ["S", "L", "U", "R", "B", "T"];

/// User and tool frame that a position was taught in.
type Frames = (Option<u32>, Option<u32>);

/// A position with the frames it was taught in. The base axis, mm, is among the external axes of its coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) coordinates: Coordinates,
    pub(super) frames: Frames,
    /// The axes of the station, deg; none where nobody says where it stands.
    pub(super) station: Vec<Axis>,
}

/// What a move calls its target: one position for the arm, one for the base axis, one for the station.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    pub(super) robot: String,
    pub(super) base: Option<String>,
    pub(super) station: Option<String>,
}

/// What the lines before a position say of it.
#[derive(Debug, Default)]
pub(super) struct Table {
    user: u32,
    tool: u32,
    kind: String,
    config: String,
    robots: BTreeMap<String, (Coordinates, Frames)>,
    /// Base axes, mm, and stations, deg.
    axes: BTreeMap<String, Vec<Axis>>,
    pulses: Pulses,
}

/// Which group a position is of.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Of {
    Robot,
    Base,
    Station,
}

/// `C00012` as `C12`: the same position, however many zeros are written.
fn key(name: &str) -> Option<(Of, String)> {
    let digits = name.find(|c: char| c.is_ascii_digit())?;
    let (letters, number) = name.split_at(digits);
    let number: u32 = number.parse().ok()?;
    let letters = letters.to_ascii_uppercase();
    let of = match letters.as_str() {
        "C" | "P" => Of::Robot,
        "BC" | "BP" => Of::Base,
        "EC" | "EX" => Of::Station,
        _ => return None,
    };
    Some((of, format!("{letters}{number}")))
}

/// The group that a word names a position of; nothing where it names none.
pub(super) fn names(word: &str) -> Option<Of> {
    key(word).map(|(of, _)| of)
}

impl Table {
    /// Empty; axes beside the arm are told in these pulses.
    pub(super) fn new(pulses: Pulses) -> Self {
        Table {
            pulses,
            ..Table::default()
        }
    }

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
            let known = ["USER", "BASE", "ROBOT", "PULSE", "ANGLE"];
            return known.contains(&self.kind.as_str());
        }
        if let Some(config) = said("///RCONF ") {
            let first: Vec<&str> = config.split(',').map(str::trim).take(6).collect();
            self.config = first.join(",");
            return true;
        }
        let known = ["///NPOS", "///RECTAN", "///PULSE", "///ANGLE"];
        if known.iter().any(|w| strip_prefix(line, w).is_some()) {
            return true;
        }
        let Some((name, values)) = line.split_once('=') else {
            return false;
        };
        self.entry(name.trim(), values).is_some()
    }

    /// Takes in a position.
    fn entry(&mut self, name: &str, values: &str) -> Option<()> {
        let values = numbers(values)?;
        let (of, key) = key(name)?;
        let cartesian = matches!(self.kind.as_str(), "USER" | "BASE" | "ROBOT");
        let axes = match of {
            Of::Robot => {
                let user = if self.kind == "USER" { self.user } else { 0 };
                let frames = (Some(user), Some(self.tool));
                let coordinates = self.coordinates(&values)?;
                self.robots.insert(key, (coordinates, frames));
                return Some(());
            }
            Of::Base if self.kind == "PULSE" => self.pulses.base(&values)?,
            // millimetres of the first, second, third base axis
            Of::Base if cartesian => match values[..] {
                [along] => base_at(along),
                [along, y, z] if y == 0.0 && z == 0.0 => base_at(along),
                _ => return None,
            },
            Of::Station if self.kind == "PULSE" => self.pulses.station(&values)?,
            Of::Station if self.kind == "ANGLE" => self.pulses.station_in_degrees(&values)?,
            Of::Base | Of::Station => return None,
        };
        self.axes.insert(key, axes);
        Some(())
    }

    fn coordinates(&self, values: &[f64]) -> Option<Coordinates> {
        if self.kind == "PULSE" {
            if let Some(joints) = self.pulses.arm(values) {
                return Some(Coordinates::Joint(joints));
            }
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

    /// The position that a move names; nothing where a part of it is not known.
    pub(super) fn get(&self, names: &Names) -> Option<Entry> {
        let (mut coordinates, frames) = self.robots.get(&key(&names.robot)?.1)?.clone();
        let axes = |name: &Option<String>| match name {
            Some(name) => self.axes.get(&key(name)?.1).cloned(),
            None => Some(Vec::new()),
        };
        let base = axes(&names.base)?;
        match &mut coordinates {
            Coordinates::Cartesian { external, .. } => *external = base,
            Coordinates::Joint(axes) => axes.extend(base),
            Coordinates::Unread(_) => {}
        }
        Some(Entry {
            coordinates,
            frames,
            station: axes(&names.station)?,
        })
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
    pulses: Pulses,
    base: Vec<String>,
    station: Vec<String>,
}

impl Written {
    /// Empty; axes beside the arm are told in these pulses.
    pub(super) fn new(pulses: Pulses) -> Self {
        Written {
            pulses,
            ..Written::default()
        }
    }

    /// Adds a position; its names, or nothing for one that has no words.
    pub(super) fn add(&mut self, entry: &Entry) -> Option<Names> {
        let (user, tool) = (entry.frames.0.unwrap_or(0), entry.frames.1.unwrap_or(0));
        let tool = format!("///TOOL {tool}");
        let (head, value, base) = match &entry.coordinates {
            Coordinates::Cartesian {
                config,
                xyz,
                wpr_degrees,
                external,
            } if config.split(',').count() == 6 => {
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
                (head, values.collect::<Vec<_>>(), &external[..])
            }
            Coordinates::Joint(axes) => {
                let (arm, base) = axes.split_at_checked(AXES.len())?;
                let head = vec![tool, PULSES[0].to_owned(), PULSES[1].to_owned()];
                let pulses = self.pulses.told_arm(arm)?;
                let values = pulses.iter().map(|v| fixed(*v, 0)).collect();
                (head, values, base)
            }
            _ => return None,
        };
        let beside = |letters: &str, axes: Option<Vec<f64>>| {
            let told = axes?.iter().map(|v| fixed(*v, 0)).collect::<Vec<_>>();
            let name = format!("{letters}{:05}", self.count);
            let line = format!("{name}={}", told.join(","));
            Some((name, line))
        };
        let base = match base {
            [] => None,
            axes => Some(beside("BC", self.pulses.told_base(axes))?),
        };
        let station = match &entry.station[..] {
            [] => None,
            axes => Some(beside("EC", self.pulses.told_station(axes))?),
        };
        self.head(head);
        let robot = format!("C{:05}", self.count);
        // writing to a String cannot fail
        let _ = writeln!(self.text, "{robot}={}", value.join(","));
        self.count += 1;
        let mut names = Names {
            robot,
            ..Names::default()
        };
        if let Some((name, line)) = base {
            names.base = Some(name);
            self.base.push(line);
        }
        if let Some((name, line)) = station {
            names.station = Some(name);
            self.station.push(line);
        }
        Some(names)
    }

    /// One line that changes is enough, but a change of type sets all anew.
    fn head(&mut self, head: Vec<String>) {
        let anew = kind(&head) != kind(&self.set);
        for line in &head {
            let zero = line == "///USER 0";
            if (anew || !self.set.contains(line)) && !zero {
                // writing to a String cannot fail
                let _ = writeln!(self.text, "{line}");
            }
        }
        self.set = head;
    }

    /// Whether the base axis is told, and the station.
    pub(super) fn tells(&self) -> (bool, bool) {
        (!self.base.is_empty(), !self.station.is_empty())
    }

    /// The section.
    pub(super) fn section(&self) -> String {
        let (base, station) = (self.base.len(), self.station.len());
        let mut text = format!(
            "//POS\n///NPOS {},{base},{station},0,0,0\n{}",
            self.count, self.text
        );
        let in_pulses = kind(&self.set) == Some(PULSES[0]);
        let head = PULSES.iter().map(|l| (*l).to_owned());
        let head = head.take(if in_pulses || base + station == 0 {
            0
        } else {
            2
        });
        for line in head.chain(self.base.iter().chain(&self.station).cloned()) {
            text += &line;
            text.push('\n');
        }
        text
    }
}

/// What stands before positions in pulses.
const PULSES: [&str; 2] = ["///POSTYPE PULSE", "///PULSE"];

/// The line of a head that says the type of positions.
fn kind(lines: &[String]) -> Option<&str> {
    let all = lines.iter().map(String::as_str);
    all.into_iter().find(|l| l.starts_with("///POSTYPE"))
}
