//! The `/POS` section: positions from text and to text.

use std::fmt::Write as _;

use crate::parsed::ParseError;
use crate::program::{Axis, Coordinates, Group, Position};
use crate::scan::{bracket, number, numbered, strip_prefix, tidy};
use crate::written::fixed;

/// The positions in `text`, whose first line is line `first` of the file.
pub(super) fn parse(text: &str, first: u32) -> Result<Vec<Position>, ParseError> {
    let mut positions = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start_matches(|c: char| c.is_whitespace() || c == ';');
        if rest.is_empty() {
            return Ok(positions);
        }
        let at = text.len() - rest.len();
        // lines are counted for errors only: counting for each position would take the square of their number
        let error = |why| ParseError::Position {
            line: first + text[..at].matches('\n').count() as u32,
            why,
        };
        let head = strip_prefix(rest, "P").ok_or_else(|| error("it does not start with P["))?;
        let (inner, after) = bracket(head).ok_or_else(|| error("its bracket is not closed"))?;
        let (index, comment) = numbered(inner).ok_or_else(|| error("its number does not read"))?;
        let after = after.trim_start();
        let after = after
            .strip_prefix('{')
            .ok_or_else(|| error("no { follows"))?;
        let (body, after) = after
            .split_once('}')
            .ok_or_else(|| error("its { is not closed: the file is cut off"))?;
        positions.push(Position {
            index,
            comment,
            groups: groups(body),
        });
        rest = after;
    }
}

/// The groups of a position: `GP1:` and what follows up to the next.
fn groups(body: &str) -> Vec<Group> {
    let mut starts: Vec<(u32, usize, usize)> = Vec::new();
    let mut at = 0;
    for line in body.split_inclusive('\n') {
        let trimmed = line.trim();
        let header = strip_prefix(trimmed, "GP").and_then(|r| r.split_once(':'));
        if let Some((number, rest)) = header.and_then(|(n, r)| Some((n.trim().parse().ok()?, r))) {
            let content = at + line.trim_end().len() - rest.len();
            starts.push((number, at, content));
        } else if starts.is_empty() && !trimmed.is_empty() {
            // no group header: the robot's
            starts.push((1, at, at));
        }
        at += line.len();
    }
    let ends = starts.iter().skip(1).map(|s| s.1).chain([body.len()]);
    starts
        .iter()
        .zip(ends)
        .map(|(&(number, _, from), to)| group(number, body.get(from..to).unwrap_or_default()))
        .collect()
}

/// The entries of a group, cut at commas outside quotes, as key and value.
fn entries(text: &str) -> Vec<(&str, &str)> {
    let mut quoted = false;
    text.split(|c| {
        quoted ^= c == '\'';
        c == ',' && !quoted
    })
    .map(str::trim)
    .filter(|part| !part.is_empty())
    .map(|part| {
        let at = part.find(['=', ':']);
        at.map_or((part, ""), |at| (part[..at].trim(), part[at + 1..].trim()))
    })
    .collect()
}

fn group(number: u32, text: &str) -> Group {
    let entries = entries(text);
    let entry = |key: &str| {
        let found = entries.iter().find(|(k, _)| k.eq_ignore_ascii_case(key));
        found.map(|(_, v)| *v)
    };
    Group {
        number,
        frame: entry("UF").and_then(|v| v.parse().ok()),
        tool: entry("UT").and_then(|v| v.parse().ok()),
        coordinates: coordinates(&entries).unwrap_or_else(|| Coordinates::Unread(tidy(text))),
    }
}

/// `None` where an entry does not read.
fn coordinates(entries: &[(&str, &str)]) -> Option<Coordinates> {
    let (mut config, mut axes) = (None, Vec::new());
    for &(key, value) in entries {
        match key.to_ascii_uppercase().as_str() {
            // F: whatever frame is selected
            "UF" | "UT" if value.eq_ignore_ascii_case("F") => {}
            "UF" | "UT" => drop(value.parse::<u32>().ok()?),
            "CONFIG" => {
                let inner = value.strip_prefix('\'')?.strip_suffix('\'')?.trim();
                if inner.contains('\'') || config.is_some() {
                    return None;
                }
                config = Some(tidy(inner));
            }
            name => {
                // what is no name of an axis makes the whole unreadable: it is kept as it is
                let plain = name.len() <= 4 && name.bytes().all(|b| b.is_ascii_alphanumeric());
                let known = axes.iter().any(|a: &Axis| a.name == name);
                if !plain || known || !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
                    return None;
                }
                let (value, unit) = self::number(value)?;
                let unit = unit.trim();
                if !unit.bytes().all(|b| b.is_ascii_alphabetic()) {
                    return None;
                }
                axes.push(Axis {
                    name: name.to_owned(),
                    value,
                    unit: unit.to_owned(),
                });
            }
        }
    }
    let of_joints = |a: &Axis| a.name.starts_with(['J', 'E']);
    let first = axes.first().is_some_and(|a| a.name.starts_with('J'));
    if config.is_none() && first && axes.iter().all(of_joints) {
        return Some(Coordinates::Joint(axes));
    }
    let mut take = |name: &str, unit: &str| {
        let at = axes.iter().position(|a| a.name == name)?;
        (axes[at].unit.is_empty() || axes[at].unit.eq_ignore_ascii_case(unit))
            .then(|| axes.remove(at).value)
    };
    let xyz = [take("X", "mm")?, take("Y", "mm")?, take("Z", "mm")?];
    let wpr_degrees = [take("W", "deg")?, take("P", "deg")?, take("R", "deg")?];
    Some(Coordinates::Cartesian {
        config: config?,
        xyz,
        wpr_degrees,
        external: axes,
    })
}

/// Whether a group that was not read tells its place in other units than mm and deg.
pub(crate) fn other_unit(text: &str) -> bool {
    entries(text).iter().any(|(key, value)| {
        let usual = match key.to_ascii_uppercase().as_str() {
            "X" | "Y" | "Z" => "mm",
            "W" | "P" | "R" => "deg",
            _ => return false,
        };
        let unit = number(value).map_or("", |(_, unit)| unit.trim());
        !unit.is_empty() && !unit.eq_ignore_ascii_case(usual)
    })
}

/// Whether a group that was not read tells a place, and lacks its CONFIG alone.
pub(crate) fn lacks_config(text: &str) -> bool {
    let mut all = entries(text);
    let said = all
        .iter()
        .any(|(key, _)| key.eq_ignore_ascii_case("CONFIG"));
    all.push(("CONFIG", "''"));
    !said && matches!(coordinates(&all), Some(Coordinates::Cartesian { .. }))
}

/// Which of X, Y, Z, W, P, R a group lacks that was not read and tells others of them.
pub(crate) fn lacking(text: &str) -> Option<[bool; 6]> {
    let all = entries(text);
    let lacks = ["X", "Y", "Z", "W", "P", "R"]
        .map(|name| !all.iter().any(|(key, _)| key.eq_ignore_ascii_case(name)));
    (lacks.contains(&true) && lacks.contains(&false)).then_some(lacks)
}

/// The position as `/POS` holds it.
pub(super) fn write(text: &mut String, position: &Position) {
    let comment = position.comment.as_ref();
    let comment = comment.map_or(String::new(), |c| format!(":\"{c}\""));
    // writing to a String cannot fail
    let _ = writeln!(text, "P[{}{comment}]{{", position.index);
    for (i, group) in position.groups.iter().enumerate() {
        if i > 0 {
            text.push('\n');
        }
        if let Coordinates::Unread(body) = &group.coordinates {
            // on one line: nothing in it can be taken for a section or a group
            let _ = write!(text, "   GP{}: {body}", group.number);
            continue;
        }
        let _ = writeln!(text, "   GP{}:", group.number);
        let frame = |n: Option<u32>| n.map_or("F".to_owned(), |n| n.to_string());
        let (frame, tool) = (frame(group.frame), frame(group.tool));
        match &group.coordinates {
            Coordinates::Cartesian {
                config,
                xyz: [x, y, z],
                wpr_degrees: [w, p, r],
                external,
            } => {
                let _ = writeln!(text, "\tUF : {frame}, UT : {tool},\t\tCONFIG : '{config}',");
                let [x, y, z, w, p, r] = [x, y, z, w, p, r].map(|v| fixed(*v, 3));
                let _ = writeln!(text, "\tX = {x:>9}  mm,\tY = {y:>9}  mm,\tZ = {z:>9}  mm,");
                let _ = write!(text, "\tW = {w:>9} deg,\tP = {p:>9} deg,\tR = {r:>9} deg");
                if !external.is_empty() {
                    text.push_str(",\n");
                    axes(text, external);
                }
            }
            Coordinates::Joint(values) => {
                let _ = writeln!(text, "\tUF : {frame}, UT : {tool},");
                axes(text, values);
            }
            Coordinates::Unread(_) => {}
        }
    }
    text.push_str("\n};\n");
}

fn axes(text: &mut String, axes: &[Axis]) {
    for (i, axis) in axes.iter().enumerate() {
        if i > 0 {
            text.push_str(if i % 3 == 0 { ",\n" } else { "," });
        }
        let Axis { name, value, unit } = axis;
        let _ = write!(text, "\t{name}= {:>9} {unit:>3}", fixed(*value, 3));
    }
}
