//! The data list (`.dat`): aggregates such as `{X 1.0,Y 2.0}`, positions from text and to text.
//!
//! Where the torch stands (`$IPO_MODE=#TCP`) a position is the part's frame (`$TOOL`) in that of the torch (`$BASE`): the inverse of the torch in the
//! part, which programs hold here.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use crate::held::Holds;
use crate::orientation::pose;
use crate::program::{Axis, Coordinates, Position};
use crate::said_frames::{WRITTEN_OUT, Which};
use crate::scan::tidy;
use crate::written::fixed;

/// Deepest nesting of aggregates that is read.
const DEEPEST: usize = 8;

/// What stands behind a name in an aggregate.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Field {
    /// A number, a word, a quoted text.
    Text(String),
    /// An aggregate.
    Group(Vec<(String, Field)>),
}

/// The fields of an aggregate in braces; nothing where it does not read.
pub(super) fn fields(text: &str) -> Option<Vec<(String, Field)>> {
    let mut rest = text.trim();
    let all = group(&mut rest, 0)?;
    rest.trim().is_empty().then_some(all)
}

fn group(rest: &mut &str, depth: usize) -> Option<Vec<(String, Field)>> {
    if depth > DEEPEST {
        return None;
    }
    *rest = rest.trim_start().strip_prefix('{')?;
    // a type may stand in front: `{E6POS: X 1.0,…}`
    if let Some((head, after)) = rest.split_once(':')
        && head
            .trim()
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || b == b'_')
    {
        *rest = after;
    }
    let mut all = Vec::new();
    loop {
        *rest = rest.trim_start();
        if let Some(after) = rest.strip_prefix('}') {
            *rest = after;
            return Some(all);
        }
        let end = rest.find(|c: char| c.is_whitespace() || matches!(c, '{' | '}' | ','))?;
        let (name, after) = rest.split_at(end);
        if name.is_empty() {
            return None;
        }
        *rest = after.trim_start();
        let value = if rest.starts_with('{') {
            Field::Group(group(rest, depth + 1)?)
        } else {
            let mut quoted = false;
            let end = rest.find(|c: char| {
                quoted ^= c == '"';
                !quoted && matches!(c, ',' | '}')
            })?;
            let (value, after) = rest.split_at(end);
            *rest = after;
            Field::Text(value.trim().trim_matches('"').to_owned())
        };
        all.push((name.trim_end_matches("[]").to_owned(), value));
        *rest = rest.trim_start();
        *rest = rest.strip_prefix(',').unwrap_or(rest);
    }
}

/// The text of a field.
pub(super) fn text_of(fields: &[(String, Field)], name: &str) -> Option<String> {
    match fields
        .iter()
        .find(|(key, _)| key.eq_ignore_ascii_case(name))
    {
        Some((_, Field::Text(text))) => Some(text.clone()),
        _ => None,
    }
}

/// The finite number of a field.
pub(super) fn number_of(fields: &[(String, Field)], name: &str) -> Option<f64> {
    let value: f64 = text_of(fields, name)?.parse().ok()?;
    value.is_finite().then_some(value)
}

/// Beyond this an angle is none, deg: nobody writes so many turns, and no more is left of it than rounding.
const ANY_TURN: f64 = 1e6;

/// The angle of a field, deg.
fn angle_of(fields: &[(String, Field)], name: &str) -> Option<f64> {
    number_of(fields, name).filter(|angle| angle.abs() <= ANY_TURN)
}

/// Where a frame lies that is written out: `{X 700,Y 300,Z 100,A 0,B 0,C 0}`, `$NULLFRAME`, and of bases `$WORLD`, which is taken to lie at the arm's base.
pub(super) fn place(which: Which, value: &str) -> Option<Pose> {
    let world = which == Which::User && value.eq_ignore_ascii_case("$WORLD");
    if world || value.eq_ignore_ascii_case("$NULLFRAME") {
        return Some(Pose::IDENTITY);
    }
    let all = fields(value)?;
    let [x, y, z] = ["X", "Y", "Z"].map(|name| number_of(&all, name));
    let [a, b, c] = ["A", "B", "C"].map(|name| angle_of(&all, name));
    Some(pose(DVec3::new(x?, y?, z?), [c?, b?, a?]))
}

/// A frame that a program writes out, as it does so; nothing of one that the controller numbers.
pub(super) fn said_as(said: &BTreeMap<u32, Pose>, number: u32) -> Option<String> {
    let pose = said.get(&number).filter(|_| number >= WRITTEN_OUT)?;
    Some(frame(pose))
}

/// What a position's aggregate says: a pose where it has X, Y, Z, A, B, C, joints where it has A1 to A6.
pub(super) fn coordinates(text: &str) -> Option<Coordinates> {
    let all = fields(text)?;
    let number = |name: &str| number_of(&all, name);
    let axes = |letter: &str, unit: &str| -> Vec<Axis> {
        let named = (1..=6).filter_map(|i| {
            let name = format!("{letter}{i}");
            let value = number(&name)?;
            Some(Axis {
                name,
                value,
                unit: unit.to_owned(),
            })
        });
        named.collect()
    };
    let mut external = axes("E", "");
    // inline forms list all six, whether there are any or not
    if external.len() == 6 && external.iter().all(|a| a.value == 0.0) {
        external.clear();
    }
    if number("A1").is_some() {
        let mut joints = axes("A", "deg");
        joints.retain(|axis| axis.value.abs() <= ANY_TURN);
        joints.extend(external);
        return (joints.len() >= 6).then_some(Coordinates::Joint(joints));
    }
    let [x, y, z] = ["X", "Y", "Z"].map(number);
    let [a, b, c] = ["A", "B", "C"].map(|name| angle_of(&all, name));
    let (xyz, wpr_degrees) = ([x?, y?, z?], [c?, b?, a?]);
    let config = match (number("S"), number("T")) {
        (Some(s), Some(t)) => format!("S {s}, T {t}"),
        _ => String::new(),
    };
    Some(Coordinates::Cartesian {
        config,
        xyz,
        // A turns about z first, B about the new y, C about the new x: W, P, R in the other order
        wpr_degrees,
        external,
    })
}

/// Decimals of places, mm, and of angles, deg.
#[derive(Clone, Copy)]
struct Decimals(usize, usize);

/// Those of a torch that moves: its place is told as it is.
const MOVES: Decimals = Decimals(3, 4);
/// Those of a torch that stands: the place of the torch in the part comes out to 1 µm, half a metre from the part's origin too.
const STANDS: Decimals = Decimals(4, 6);
/// The last of its decimals of angles, deg.
const STEP: f64 = 1e-6;

/// The other way round: the torch in the part from the part in the torch's frame, and that from this.
pub(super) fn turned_round(mut coordinates: Coordinates) -> Coordinates {
    if let Coordinates::Cartesian {
        xyz, wpr_degrees, ..
    } = &mut coordinates
    {
        let inverse = pose(DVec3::from_array(*xyz), *wpr_degrees).inverse();
        *xyz = inverse.position.to_array();
        *wpr_degrees = inverse.wpr().to_array().map(f64::to_degrees);
    }
    coordinates
}

/// As the digits of a file hold it: where the second angle comes to 90° the first and the third become one.
fn in_digits(coordinates: Coordinates) -> Coordinates {
    let Coordinates::Cartesian {
        config,
        xyz,
        wpr_degrees,
        external,
    } = coordinates
    else {
        return coordinates;
    };
    let stepped = wpr_degrees.map(|angle| (angle / STEP).round() * STEP);
    let held = pose(DVec3::from_array(xyz), stepped);
    Coordinates::Cartesian {
        config,
        xyz,
        wpr_degrees: held.wpr().to_array().map(f64::to_degrees),
        external,
    }
}

/// A frame as people write it for the controller: 1 µm and 0.0001°.
pub(super) fn frame(pose: &Pose) -> String {
    let wpr = pose.wpr().to_array().map(f64::to_degrees);
    format!("{{{}}}", told(pose.position.to_array(), wpr, MOVES))
}

fn told(xyz: [f64; 3], [c, b, a]: [f64; 3], Decimals(place, angle): Decimals) -> String {
    let [x, y, z] = xyz.map(|v| fixed(v, place));
    let [a, b, c] = [a, b, c].map(|v| fixed(v, angle));
    format!("X {x},Y {y},Z {z},A {a},B {b},C {c}")
}

/// The aggregate of a position, and its type, where the robot holds this.
pub(super) fn aggregate(position: &Position, holds: Holds) -> Option<(&'static str, String)> {
    let robot = position.robot()?;
    let (coordinates, decimals) = match holds {
        Holds::Part => {
            let inverse = turned_round(robot.coordinates.clone());
            (in_digits(inverse), STANDS)
        }
        Holds::Torch | Holds::Both | Holds::Neither => (robot.coordinates.clone(), MOVES),
    };
    let listed = |axes: &[Axis]| -> String {
        let all = axes
            .iter()
            .map(|a| format!("{} {}", a.name, fixed(a.value, 4)));
        all.collect::<Vec<_>>().join(",")
    };
    match &coordinates {
        Coordinates::Cartesian {
            config,
            xyz,
            wpr_degrees,
            external,
        } => {
            let mut text = format!("{{{}", told(*xyz, *wpr_degrees, decimals));
            if !config.is_empty() {
                text += ",";
                text += &tidy(config).replace(", ", ",");
            }
            let kind = if external.is_empty() { "POS" } else { "E6POS" };
            if !external.is_empty() {
                text += ",";
                text += &listed(external);
            }
            Some((kind, text + "}"))
        }
        Coordinates::Joint(axes) => {
            let kind = if axes.len() > 6 { "E6AXIS" } else { "AXIS" };
            Some((kind, format!("{{{}}}", listed(axes))))
        }
        Coordinates::Unread(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aggregates_nest() {
        let all = fields("{E6POS: X 1.5,Weld {JobModeId[] \"a, b}\",Velocity 0.01}, S 2}").unwrap();
        assert_eq!(number_of(&all, "x"), Some(1.5));
        assert_eq!(number_of(&all, "S"), Some(2.0));
        let Field::Group(weld) = &all[1].1 else {
            panic!("{all:?}")
        };
        assert_eq!(text_of(weld, "JobModeId").as_deref(), Some("a, b}"));
        for broken in ["", "{", "{X", "{X 1", "{X {Y 1}", "{,}", "{X 1}}", "{}x"] {
            assert_eq!(fields(broken), None, "{broken}");
        }
        assert_eq!(fields(&"{a ".repeat(100_000)), None);
    }
}
