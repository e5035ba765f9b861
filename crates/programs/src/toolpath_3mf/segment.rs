//! A segment of a layer while it is read: its points, and the passes that it becomes.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_toolpath::{Channel, Layer, Move, PassHead, PassWriter, Role};

use super::frame::axis_and_turn;
use super::profile::{FACTORS, SaidProfile};
use super::walk::Element;
use super::words::Form;
use super::xml::{Fault, Start, Words, broken, count, integer, number};

/// Lines stand for an arc where they keep so close to it, mm: some digits of files, as all three points that make it are rounded.
const ON_ARC: f64 = 5e-3;

/// Where a line ends, and what varies along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Corner {
    position: DVec3,
    /// Axis from the part to the tool, and turn about it, rad.
    tool: Option<(DVec3, f64)>,
    factors: [Option<f64>; 4],
    /// So many lines lead to the point that an arc goes through, and so many up to here stand for it.
    arc: Option<[usize; 2]>,
}

/// A segment.
#[derive(Debug)]
pub(super) struct Segment {
    pub(super) form: Form,
    /// Index of its profile in the toolpath.
    pub(super) profile: usize,
    pub(super) role: Option<Role>,
    pub(super) part: u32,
    /// The corners; of a hatch two for each line.
    pub(super) corners: Vec<Corner>,
}

/// What a point says as numbers.
#[derive(Default)]
struct Said {
    whole: [Option<i32>; 4],
    turn: [Option<f64>; 4],
    factors: [Option<f64>; 4],
    arc: Option<[usize; 2]>,
}

const NAMES: [&str; 4] = ["x", "y", "z", ""];
const HATCH: [&str; 4] = ["x1", "y1", "x2", "y2"];
const QUATERNION: [&str; 4] = ["i", "j", "k", "w"];

impl Segment {
    /// Whether its points are such elements.
    fn holds(&self, element: Element) -> bool {
        matches!(
            (self.form, element),
            (Form::Loop | Form::Polyline, Element::Point)
                | (Form::Hatch, Element::Hatch)
                | (Form::Spatial, Element::Point3)
                | (Form::Oriented, Element::Point6)
        )
    }

    /// Takes in a point or a hatch line; `unit` is one device unit, mm. What others add to it comes back by its name.
    pub(super) fn point(
        &mut self,
        element: Element,
        start: &Start<'_, '_>,
        unit: f64,
    ) -> Result<Option<String>, Fault> {
        if !self.holds(element) {
            return Err(broken(format!(
                "a segment of this type does not hold `{}`",
                start.name()
            )));
        }
        let names = if element == Element::Hatch {
            HATCH
        } else {
            NAMES
        };
        let (mut said, mut other) = (Said::default(), None);
        start.each(|whose, name, text| {
            other = take(&mut said, names, (whose, name, text))?.or(other.take());
            Ok(())
        })?;
        let lacks = |what: &str| broken(format!("`{}` lacks {what}", start.name()));
        let at = |k: usize| {
            let value = said.whole[k].map(|v| f64::from(v) * unit);
            // without the digits that the product invents
            let value = value.map(|v| (v * 1e9).round() / 1e9);
            value.ok_or_else(|| lacks(names[k]))
        };
        let mut corner = Corner {
            position: DVec3::new(at(0)?, at(1)?, 0.0),
            tool: None,
            factors: said.factors,
            arc: said.arc,
        };
        match element {
            Element::Hatch => {
                self.corners.push(corner);
                corner.position = DVec3::new(at(2)?, at(3)?, 0.0);
            }
            Element::Point3 | Element::Point6 => corner.position.z = at(2)?,
            _ => {}
        }
        if element == Element::Point6 {
            let [Some(i), Some(j), Some(k), Some(w)] = said.turn else {
                return Err(lacks("one of i, j, k, w"));
            };
            let tool = axis_and_turn(DQuat::from_xyzw(i, j, k, w)).ok_or_else(|| {
                broken(format!(
                    "the quaternion i={i}, j={j}, k={k}, w={w} has no direction"
                ))
            })?;
            corner.tool = Some(tool);
        }
        self.corners.push(corner);
        Ok(other)
    }

    /// Adds the passes of the segment to a layer; each gets the next identifier. Words of arcs that its lines are none of come back.
    pub(super) fn write(
        mut self,
        layer: &mut Layer,
        profile: &SaidProfile,
        mut head: impl FnMut(PassHead) -> PassHead,
    ) -> Result<Vec<String>, Fault> {
        let lines = match self.form {
            Form::Hatch => self.corners.len() / 2,
            _ => self.corners.len(),
        };
        if lines < self.form.least() {
            return Err(broken(format!(
                "a segment of type {} has {lines} points or lines, it must have at least {}",
                name(self.form),
                self.form.least()
            )));
        }
        let usual = match self.form {
            Form::Loop | Form::Polyline => Role::Contour,
            Form::Hatch | Form::Spatial | Form::Oriented => Role::Fill,
        };
        let mut begun = || {
            head(PassHead {
                part: self.part,
                profile: self.profile as u16,
                role: self.role.unwrap_or(usual),
                ..PassHead::default()
            })
        };
        if self.form == Form::Hatch {
            for line in self.corners.chunks_exact(2) {
                let mut pass = layer.begin(begun(), line[0].position);
                pass.line_to(line[1].position);
                vary(&mut pass, &line[1], profile)?;
            }
            return Ok(Vec::new());
        }
        if let (Form::Loop, Some(first), Some(last)) =
            (self.form, self.corners.first(), self.corners.last())
            && first.position != last.position
        {
            // what varies on the way back stands at the first point
            self.corners.push(*first);
        }
        let mut pass = layer.begin(begun(), self.corners[0].position);
        stand(&mut pass, &self.corners[0]);
        let mut none = Vec::new();
        for (from, to) in spans(&self.corners) {
            let last = self.corners[to];
            if let Some(via) = arc(&self.corners[from..=to]) {
                pass.go(Move::Arc { via }, last.position);
                stand(&mut pass, &last);
                vary(&mut pass, &last, profile)?;
                continue;
            }
            none.extend(last.no_arc(to - from));
            for corner in &self.corners[from + 1..=to] {
                pass.line_to(corner.position);
                stand(&mut pass, corner);
                vary(&mut pass, corner, profile)?;
            }
        }
        Ok(none)
    }
}

impl Corner {
    /// What is told of an arc that it asks for and that the `there` lines up to it are not; one line is meant as itself.
    fn no_arc(&self, there: usize) -> Option<String> {
        let [through, lines] = self.arc.filter(|[_, lines]| *lines > 1)?;
        let why = if lines > there {
            format!("only {there} lines lead there")
        } else {
            "they do not lie on it, or do not go on along it".to_owned()
        };
        Some(format!(
            "arc=\"{through} {lines}\" says that {lines} lines stand for an arc, and {why}: they are laid as lines"
        ))
    }
}

fn name(form: Form) -> &'static str {
    let found = Form::ALL.iter().find(|(f, ..)| *f == form);
    found.map_or("", |(_, name, _)| name)
}

/// Takes in an attribute of a point; what nobody here knows comes back by its name.
fn take(
    said: &mut Said,
    names: [&str; 4],
    (whose, name, text): (Words<'_>, &str, &str),
) -> Result<Option<String>, Fault> {
    let place = |names: &[&str; 4]| names.iter().position(|n| *n == name && !n.is_empty());
    match whose {
        Words::Own => {
            if let Some(k) = place(&names) {
                said.whole[k] = Some(integer(name, text)?);
            } else if let Some(k) = place(&QUATERNION) {
                said.turn[k] = Some(number(name, text)?);
            } else if let Some(k) = place(&FACTORS) {
                let factor = number(name, text)?;
                if !(0.0..=1.0).contains(&factor) {
                    return Err(broken(format!("{name}=\"{text}\" is not between 0 and 1")));
                }
                said.factors[k] = Some(factor);
            } else if name == "tag" {
                count(name, text, 0)?;
            } else {
                return Err(broken(format!(
                    "a point of this profile and segment has no attribute `{name}`"
                )));
            }
            Ok(None)
        }
        Words::Ours if name == "arc" => {
            let (through, lines) = text.split_once(' ').unwrap_or((text, ""));
            let count = |text| count(name, text, 1).map(|n| n as usize);
            let [through, lines] = [count(through)?, count(lines)?];
            // one line after another is what is meant by none
            if lines > 1 && through >= lines {
                return Err(broken(format!(
                    "{name}=\"{text}\": the point that an arc goes through comes before its last one"
                )));
            }
            said.arc = Some([through, lines]);
            Ok(None)
        }
        _ => Ok(Some(name.to_owned())),
    }
}

/// From corner to corner, lines that may stand for an arc together.
fn spans(corners: &[Corner]) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    let mut to = corners.len() - 1;
    while to > 0 {
        let lines = corners[to].arc.map_or(1, |[_, lines]| lines.max(1));
        let from = to.saturating_sub(lines);
        all.push((from, to));
        to = from;
    }
    all.reverse();
    all
}

/// A point on the way of the arc that lines stand for; nothing where they stand for themselves.
fn arc(corners: &[Corner]) -> Option<DVec3> {
    let [first, inner @ .., last] = corners else {
        return None;
    };
    let [through, lines] = last.arc?;
    if lines != corners.len() - 1 || !(1..lines).contains(&through) {
        return None;
    }
    let via = corners[through].position;
    let arc = Arc::through(first.position, via, last.position)?;
    let mut before = 0.0;
    let mut on = |corner: &Corner| {
        let from_centre = corner.position - arc.centre;
        let (along, across) = (from_centre.dot(arc.u), from_centre.dot(arc.v));
        let beside = from_centre.dot(arc.u.cross(arc.v));
        let angle = across.atan2(along).rem_euclid(std::f64::consts::TAU);
        let goes_on = angle > before && angle < arc.sweep;
        before = angle;
        let near = (along.hypot(across) - arc.radius).hypot(beside) < ON_ARC;
        goes_on && near && corner.factors == last.factors
    };
    inner.iter().all(&mut on).then_some(via)
}

/// How the tool stands at the last point of a pass.
fn stand(pass: &mut PassWriter<'_>, corner: &Corner) {
    if let Some((axis, turn)) = corner.tool {
        pass.axis(axis).turn(turn);
    }
}

/// What holds along the last line of a pass: of a beam what the profile says, then what the corner varies.
fn vary(pass: &mut PassWriter<'_>, corner: &Corner, profile: &SaidProfile) -> Result<(), Fault> {
    if corner.tool.is_none() {
        let of_beam = [
            (Channel::Speed, profile.laser_speed),
            (Channel::Power, profile.power),
        ];
        for (channel, value) in of_beam {
            if let Some(value) = value {
                pass.set(channel, value);
            }
        }
    }
    for (k, factor) in corner.factors.iter().enumerate() {
        let Some(factor) = factor else { continue };
        let Some(modifier) = profile.modifiers.iter().find(|m| m.factor == k) else {
            return Err(broken(format!(
                "a point says the factor {}, which its profile \"{}\" does not have",
                FACTORS[k], profile.name
            )));
        };
        pass.set(modifier.channel, modifier.value(*factor));
    }
    Ok(())
}
