//! Data of modules: nested lists, targets, speeds, zones, weld data, from text and to text.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Weave, WeaveShape};

use crate::held::Held;
use crate::orientation::{pose, quaternion_of, wpr_of_quaternion};
use crate::program::{Axis, Coordinates};
use crate::scan::{arguments, finite, strip_word};
use crate::weave::told;
use crate::written::{fixed, short};

/// Deepest nesting of lists that is read.
const DEEPEST: usize = 6;
/// How many values an `arcdata` has.
pub(super) const ARC_VALUES: usize = 9;
/// An external axis that is not there.
pub(super) const NO_AXIS: f64 = 9e9;

/// A value of a module.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Word(String),
    List(Vec<Value>),
}

pub(super) fn value(text: &str) -> Option<Value> {
    nested(text.trim(), 0)
}

fn nested(text: &str, depth: usize) -> Option<Value> {
    if depth > DEEPEST {
        return None;
    }
    if let Some(inner) = text.strip_prefix('[') {
        let inner = inner.strip_suffix(']')?;
        let all = arguments(inner)
            .into_iter()
            .map(|part| nested(part, depth + 1));
        return all.collect::<Option<Vec<_>>>().map(Value::List);
    }
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Some(Value::Number(number)),
        Ok(_) => None,
        Err(_) => (!text.is_empty()).then(|| Value::Word(text.to_owned())),
    }
}

impl Value {
    pub(super) fn list(&self) -> Option<&[Value]> {
        match self {
            Value::List(all) => Some(all),
            _ => None,
        }
    }

    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Value::Number(n) => Some(*n),
            _ => None,
        }
    }

    /// The same with sums of constants in the places of their words.
    pub(super) fn with(self, known: &BTreeMap<String, f64>) -> Value {
        match self {
            Value::Word(word) => match sum(&word, known) {
                Some(number) => Value::Number(number),
                None => Value::Word(word),
            },
            Value::List(all) => {
                Value::List(all.into_iter().map(|value| value.with(known)).collect())
            }
            Value::Number(number) => Value::Number(number),
        }
    }

    fn numbers<const N: usize>(&self) -> Option<[f64; N]> {
        let all: Option<Vec<f64>> = self.list()?.iter().map(Value::number).collect();
        all?.try_into().ok()
    }
}

/// Where a `robtarget` lies; its configuration only where that is monitored.
pub(super) fn target(value: &Value) -> Option<Coordinates> {
    let [trans, rot, robconf, extax] = value.list()? else {
        return None;
    };
    let config: [f64; 4] = robconf.numbers()?;
    let config = config.map(|n| short(n, 0));
    Some(Coordinates::Cartesian {
        config: config.join(","),
        xyz: trans.numbers()?,
        wpr_degrees: wpr_of_quaternion(rot.numbers()?)?,
        external: external(extax)?,
    })
}

/// The pose of a place and a quaternion.
fn frame(value: &Value) -> Option<Pose> {
    let [trans, rot] = value.list()? else {
        return None;
    };
    let at = DVec3::from_array(trans.numbers()?);
    Some(pose(at, wpr_of_quaternion(rot.numbers()?)?))
}

/// Whether the places of a `tooldata` or a `wobjdata` are plain numbers.
pub(super) fn says_places(value: &Value) -> bool {
    let places = match value.list() {
        Some([_, at, _]) => [at, at],
        Some([_, _, _, user, object]) => [user, object],
        _ => return false,
    };
    places.into_iter().all(|at| frame(at).is_some())
}

/// Takes in `CONST num name:=1.5`.
pub(super) fn constant(known: &mut BTreeMap<String, f64>, text: &str) {
    let rest = strip_word(text, "LOCAL").unwrap_or(text).trim_start();
    let (constant, rest) = match strip_word(rest, "CONST") {
        Some(rest) => (true, rest),
        None => (false, strip_word(rest, "VAR").unwrap_or(rest)),
    };
    let Some((name, text)) = strip_word(rest.trim_start(), "num").and_then(|r| r.split_once(":="))
    else {
        return;
    };
    let name = name.trim().to_ascii_lowercase();
    match sum(text, known).filter(|_| constant) {
        Some(number) => drop(known.insert(name, number)),
        // a variable of that name hides the constant
        None => drop(known.remove(&name)),
    }
}

/// The value of `a+2.5-b` of numbers and known constants.
fn sum(text: &str, known: &BTreeMap<String, f64>) -> Option<f64> {
    let mut rest = text.trim();
    let (mut total, mut first) = (0.0, true);
    while first || !rest.is_empty() {
        let signs = rest.len() - rest.trim_start_matches(['+', '-', ' ']).len();
        if signs == 0 && !first {
            return None;
        }
        let (before, behind) = rest.split_at(signs);
        let sign = match before.matches('-').count() % 2 {
            0 => 1.0,
            _ => -1.0,
        };
        rest = behind;
        let exponent = |i: usize| {
            let before = rest.get(..i).unwrap_or_default();
            before.ends_with(['e', 'E'])
                && before.starts_with(|c: char| c.is_ascii_digit() || c == '.')
        };
        let end = rest
            .char_indices()
            .find(|(i, c)| matches!(c, '+' | '-') && !exponent(*i))
            .map_or(rest.len(), |(i, _)| i);
        let (term, after) = rest.split_at(end);
        let term = term.trim();
        let number =
            finite(term).filter(|_| term.starts_with(|c: char| c.is_ascii_digit() || c == '.'));
        total += sign * number.or_else(|| known.get(&term.to_ascii_lowercase()).copied())?;
        (rest, first) = (after, false);
    }
    Some(total)
}

fn is(value: &Value, word: &str) -> bool {
    matches!(value, Value::Word(own) if own.eq_ignore_ascii_case(word))
}

/// Who holds a tool or an object, and where it lies, as far as that is said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lies {
    pub(super) held: Held,
    pub(super) at: Option<Pose>,
}

/// Who holds what has this `robhold`.
fn held(robhold: &Value) -> Option<Held> {
    if is(robhold, "TRUE") {
        Some(Held::ByRobot)
    } else {
        is(robhold, "FALSE").then_some(Held::Standing)
    }
}

/// Where the tool of a `tooldata` is: in the flange, or in the world where it stands.
pub(super) fn tool(value: &Value) -> Option<Lies> {
    let [robhold, at, ..] = value.list()? else {
        return None;
    };
    let (held, at) = (held(robhold)?, frame(at));
    Some(Lies { held, at })
}

/// Where the object of a `wobjdata` lies: in the base, or in the flange where the robot holds it; nowhere where a unit moves it.
pub(super) fn object(value: &Value) -> Option<Lies> {
    let [robhold, fixed, _, user, object] = value.list()? else {
        return None;
    };
    let at = frame(user).zip(frame(object)).filter(|_| is(fixed, "TRUE"));
    Some(Lies {
        held: held(robhold)?,
        at: at.map(|(user, object)| user.then(object)),
    })
}

/// A pose as data hold it: 1 µm, and the quaternion.
pub(super) fn written_pose(pose: &Pose) -> String {
    let at = pose.position.to_array().map(|v| short(v, 3)).join(",");
    let turned = pose.wpr().to_array().map(f64::to_degrees);
    let turned = quaternion_of(turned).map(|v| fixed(v, 10)).join(",");
    format!("[[{at}],[{turned}]]")
}

/// Where a `jointtarget` lies.
pub(super) fn joints(value: &Value) -> Option<Coordinates> {
    let [robax, extax] = value.list()? else {
        return None;
    };
    let angles: [f64; 6] = robax.numbers()?;
    let mut axes = Axis::joints(angles);
    axes.extend(external(extax)?);
    Some(Coordinates::Joint(axes))
}

fn external(value: &Value) -> Option<Vec<Axis>> {
    let all: [f64; 6] = value.numbers()?;
    let named = "abcdef"
        .chars()
        .zip(all)
        .filter(|(_, v)| *v < 0.5 * NO_AXIS);
    let axis = |(letter, value): (char, f64)| Axis {
        name: format!("eax_{letter}"),
        value,
        unit: String::new(),
    };
    Some(named.map(axis).collect())
}

fn written_external(axes: &[Axis]) -> String {
    let of = |letter: char| {
        let name = format!("eax_{letter}");
        let found = axes.iter().find(|a| a.name == name);
        found.map_or("9E+09".to_owned(), |a| short(a.value, 4))
    };
    "abcdef".chars().map(of).collect::<Vec<_>>().join(",")
}

/// Type and value of a position; nothing for one that was not read.
pub(super) fn written(coordinates: &Coordinates) -> Option<(&'static str, String)> {
    match coordinates {
        Coordinates::Cartesian {
            config,
            xyz,
            wpr_degrees,
            external,
        } => {
            let xyz = xyz.map(|v| short(v, 3)).join(",");
            let rot = quaternion_of(*wpr_degrees).map(|v| fixed(v, 10)).join(",");
            let config = if config.is_empty() { "0,0,0,0" } else { config };
            let external = written_external(external);
            Some((
                "robtarget",
                format!("[[{xyz}],[{rot}],[{config}],[{external}]]"),
            ))
        }
        Coordinates::Joint(axes) => {
            let angles = axes.iter().filter(|a| a.name.starts_with('J'));
            let angles: Vec<String> = angles.map(|a| short(a.value, 4)).collect();
            let external = written_external(axes);
            Some((
                "jointtarget",
                format!("[[{}],[{external}]]", angles.join(",")),
            ))
        }
        Coordinates::Unread(_) => None,
    }
}

/// Speed of the tool, mm/s, of a `speeddata` or of a predefined one such as `v100`.
pub(super) fn speed(value: &Value) -> Option<f64> {
    let speed = match value {
        Value::List(all) => all.first()?.number()?,
        Value::Word(name) => numbered(name, 'v')?,
        Value::Number(_) => return None,
    };
    (speed > 0.0).then_some(speed)
}

/// How fast a `speeddata` lets the tool turn, °/s.
pub(super) fn turns(value: &Value) -> Option<f64> {
    let limit = value.list()?.get(1)?.number()?;
    (limit > 0.0).then_some(limit)
}

/// The distance of a zone, mm; 0 for one that stops.
pub(super) fn zone(value: &Value) -> Option<f64> {
    match value {
        Value::List(all) => match all.get(..2)? {
            [Value::Word(fine), _] if fine.eq_ignore_ascii_case("TRUE") => Some(0.0),
            [_, distance] => distance.number().filter(|d| *d >= 0.0),
            _ => None,
        },
        Value::Word(name) if name.eq_ignore_ascii_case("fine") => Some(0.0),
        Value::Word(name) if name.eq_ignore_ascii_case("z0") => Some(0.3),
        Value::Word(name) => numbered(name, 'z'),
        Value::Number(_) => None,
    }
}

/// The number behind a letter.
fn numbered(name: &str, letter: char) -> Option<f64> {
    let mut characters = name.chars();
    let same = characters.next()?.eq_ignore_ascii_case(&letter);
    let digits = characters.as_str();
    let plain = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    (same && plain).then(|| digits.parse().ok())?
}

/// What a `welddata` says: the values of its main arc, with commas, and its speed, mm/s.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WeldData {
    pub(super) arguments: String,
    pub(super) speed: f64,
}

/// Weld data; `values` says how many of the arc's values mean something.
pub(super) fn weld(value: &Value, values: usize) -> Option<WeldData> {
    let [speed, _, main, ..] = value.list()? else {
        return None;
    };
    Some(WeldData {
        arguments: arc_values(main, values)?,
        speed: speed.number().filter(|s| *s > 0.0)?,
    })
}

/// What a `seamdata` says of the begin and the end of beads.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SeamData {
    /// How long the arc stands on the crater, s, and the values of the arc meanwhile, with commas.
    pub(super) fill: (f64, String),
    /// What it does at the begin that is not simulated: names of its parts and their values.
    pub(super) begin: Vec<String>,
}

/// The parts of a `seamdata` that lay metal at the begin of a bead while the torch stands or moves otherwise, by their places.
const BEGIN: [(usize, &str); 4] = [
    (3, "ign_move_delay"),
    (5, "heat_speed"),
    (6, "heat_time"),
    (7, "heat_distance"),
];
/// How many parts a `seamdata` has, and where its fill time and its fill arc stand.
const SEAM: (usize, usize, usize) = (16, 10, 11);

/// Seam data; `values` says how many of an arc's values mean something.
///
/// Purge, preflow, cooling, burn back, roll back and postflow lay no metal; what an ignition lays is the source's.
pub(super) fn seam(value: &Value, values: usize) -> Option<SeamData> {
    let all = value.list().filter(|all| all.len() == SEAM.0)?;
    let time = all.get(SEAM.1)?.number().filter(|t| *t >= 0.0)?;
    let arc = arc_values(all.get(SEAM.2)?, values)?;
    let begin: Option<Vec<(&str, f64)>> = BEGIN
        .into_iter()
        .map(|(at, name)| Some((name, all.get(at)?.number()?)))
        .collect();
    let begin = begin?.into_iter().filter(|(_, value)| *value != 0.0);
    Some(SeamData {
        fill: (time, arc),
        begin: begin
            .map(|(name, value)| format!("{name} {value}"))
            .collect(),
    })
}

/// The values of an `arcdata` that mean something, with commas.
fn arc_values(arc: &Value, values: usize) -> Option<String> {
    let all: Option<Vec<f64>> = arc.list()?.iter().map(Value::number).collect();
    let mut all = all?;
    while all.len() > values.max(1) && all.last() == Some(&0.0) {
        all.pop();
    }
    let all: Vec<String> = all.iter().map(ToString::to_string).collect();
    Some(all.join(","))
}

/// How long a zigzag is along the path, mm, and how wide to one side, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Zigzag {
    length: f64,
    amplitude: f64,
}

/// The zigzag of a `weavedata`: nothing where the torch swings in another way, or stays at its sides.
pub(super) fn zigzag(value: &Value) -> Option<Zigzag> {
    let all: Option<Vec<f64>> = value.list()?.iter().map(Value::number).collect();
    let all = all?;
    let [shape, kind, length, width] = *all.first_chunk()?;
    // height, dwells, direction, tilt, orientation and bias; what follows is for the controller's own use
    let plain = all.iter().take(12).skip(4).all(|v| *v == 0.0);
    let by_length = kind == 0.0 || kind == 1.0;
    (shape == 1.0 && by_length && plain && length > 0.0 && width > 0.0).then_some(Zigzag {
        length,
        amplitude: 0.5 * width,
    })
}

impl Zigzag {
    /// The weave that it is at a speed, mm/s.
    pub(super) fn at(self, speed: f64) -> Weave {
        told(&Weave {
            shape: WeaveShape::Triangle,
            frequency: speed / self.length,
            amplitude: self.amplitude,
            dwell: [0.0; 2],
        })
    }
}

/// The value of the `weavedata` of a weave at a speed, mm/s; `kind` says which axes weave.
pub(super) fn written_weave(weave: &Weave, speed: f64, kind: u32) -> String {
    let length = short(speed / weave.frequency, 6);
    let width = short(2.0 * weave.amplitude, 4);
    format!("[1,{kind},{length},{width},0,0,0,0,0,0,0,0,0,0,0]")
}

/// The value of a `welddata`; nothing where the arc word does not fit.
pub(super) fn written_weld(data: &WeldData) -> Option<String> {
    let mut values: Vec<&str> = data.arguments.split(',').map(str::trim).collect();
    let numbers = values
        .iter()
        .all(|v| v.parse::<f64>().is_ok_and(f64::is_finite));
    if !numbers || values.len() > ARC_VALUES {
        return None;
    }
    values.resize(ARC_VALUES, "0");
    let none = ["0"; ARC_VALUES].join(",");
    Some(format!(
        "[{},0,[{}],[{none}]]",
        short(data.speed, 3),
        values.join(",")
    ))
}
