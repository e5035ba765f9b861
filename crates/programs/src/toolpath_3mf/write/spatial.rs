//! A path of a torch in space: six axes a point, speed and wire feed by profiles and what varies in them.

use std::fmt::Write as _;
use std::io::{Seek, Write};

use meltpath_base::Ratio;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_geometry::mesh::NamedMesh;
use meltpath_toolpath::{Channel, Event, Move, Pass, PassPlace, Profile, Toolpath};

use super::super::error::ToolpathFileWriteError;
use super::super::frame::quaternion;
use super::super::words::{BEAD_CHORD, BEAD_STEP, Kind, role_word};
use super::package::{Package, WrittenProfile, above_zero, device};

/// Writes the beads of a path in space, and the part that they build; `part` and path lie in the same frame, mm. `smoothing` is that of corners
/// within beads, a share of what the controller can.
///
/// Every bead is a segment, in order; what lies between beads is not written, nor where track and positioner stand. Points are kept to
/// 1 µm as in programs, arcs as lines within 10 µm which say that they are one. The same path gives the same bytes.
///
/// # Errors
/// [`ToolpathFileWriteError`] where the format has no words for a bead: a weave, a dwell or a spot with the arc on.
pub fn write_spatial<W: Write + Seek>(
    toolpath: &Toolpath,
    part: NamedMesh,
    smoothing: Ratio,
    to: W,
) -> Result<W, ToolpathFileWriteError> {
    let mut beads = toolpath.passes().filter(|p| p.head.role.deposits());
    let plan = Profiles::of(toolpath, &mut beads)?;
    let mut package = Package::new(to, (Kind::SixAxis, BEAD_STEP), &part.name)?;
    package.profiles = plan.written(smoothing);
    let mut text = String::new();
    for layer in &toolpath.layers {
        text.clear();
        for pass in layer.passes().filter(|p| p.head.role.deposits()) {
            plan.segment(&pass, layer.height, &mut text)?;
        }
        package.layer(layer.number, None, &text)?;
    }
    package.finish(part.mesh)
}

/// Least and greatest value of something along the beads of a profile.
#[derive(Clone, Copy)]
struct Range(f64, f64);

impl Range {
    fn over(range: Option<Range>, value: f64) -> Range {
        let Range(least, most) = range.unwrap_or(Range(value, value));
        Range(least.min(value), most.max(value))
    }

    fn varies(self) -> bool {
        self.0 < self.1
    }

    /// Where a value lies in it, 0 to 1.
    fn factor(self, value: f64) -> f64 {
        (value - self.0) / (self.1 - self.0)
    }
}

/// The profiles that beads have, with the speeds, mm/s, and wire feeds, mm/s, along them.
struct Profiles<'a> {
    profiles: &'a [Profile],
    /// Of each profile, where a bead has it: speeds, wire feeds.
    ranges: Vec<Option<[Range; 2]>>,
}

impl<'a> Profiles<'a> {
    fn of<'p>(
        toolpath: &'a Toolpath,
        beads: &mut dyn Iterator<Item = Pass<'p>>,
    ) -> Result<Self, ToolpathFileWriteError> {
        let mut all = Profiles {
            profiles: &toolpath.profiles,
            ranges: vec![None; toolpath.profiles.len()],
        };
        for pass in beads {
            all.check(&pass)?;
            let index = usize::from(pass.head.profile);
            for i in 0..pass.move_count() {
                let [speed, feed] = all.values(&pass, i);
                let speed = above_zero(pass.place(), "the speed", speed)?;
                let feed = above_zero(pass.place(), "the wire feed", feed)?;
                let known = all.ranges[index];
                all.ranges[index] = Some([
                    Range::over(known.map(|k| k[0]), speed),
                    Range::over(known.map(|k| k[1]), feed),
                ]);
            }
        }
        Ok(all)
    }

    /// Speed and wire feed of a move of a pass that was checked.
    fn values(&self, pass: &Pass<'_>, i: usize) -> [f64; 2] {
        let profile = &self.profiles[usize::from(pass.head.profile)];
        [
            pass.value(Channel::Speed, i).unwrap_or(profile.speed),
            pass.value(Channel::WireFeed, i)
                .unwrap_or(profile.wire_feed),
        ]
    }

    /// Refuses what the format has no words for.
    fn check(&self, pass: &Pass<'_>) -> Result<(), ToolpathFileWriteError> {
        let index = pass.head.profile;
        let Some(profile) = self.profiles.get(usize::from(index)) else {
            return Err(ToolpathFileWriteError::Value {
                pass: pass.place(),
                what: "its profile",
                value: f64::from(index),
                wanted: "one of the toolpath's",
            });
        };
        let wordless = |what, remedy| {
            Err(ToolpathFileWriteError::NoWords {
                pass: pass.place(),
                what,
                remedy,
            })
        };
        let mut events = pass.events();
        if events.any(|(_, Event::Weave(number))| number != 0) {
            return wordless("a weave", "plan without waam.bead.weave");
        }
        let dwells = |i| pass.value(Channel::Dwell, i).unwrap_or(profile.dwell) > 0.0;
        if (0..pass.move_count()).any(dwells) {
            return wordless("a dwell with the arc on", "plan without dwells");
        }
        if pass.moves().any(|m| matches!(m, Move::Spot { .. })) {
            return wordless("a torch that burns in place", "plan lines");
        }
        Ok(())
    }

    fn written(&self, smoothing: Ratio) -> Vec<WrittenProfile> {
        let mut names: Vec<String> = Vec::new();
        let mut all = Vec::new();
        for (profile, ranges) in self.profiles.iter().zip(&self.ranges) {
            let Some([speed, feed]) = ranges else {
                continue;
            };
            let name = new_name(&profile.name, &names);
            names.push(name.clone());
            let mut values = format!(
                r#" depositionspeed="{}" mp:wirefeed="{}" mp:smoothing="{}""#,
                nominal(profile.speed, *speed),
                nominal(profile.wire_feed, *feed),
                smoothing.0
            );
            for (word, value) in [("beadwidth", profile.width), ("beadheight", profile.height)] {
                if value > 0.0 && value.is_finite() {
                    let _ = write!(values, r#" {word}="{value}""#);
                }
            }
            let mut elements = String::new();
            for (word, factor, range) in
                [("depositionspeed", "e", speed), ("mp:wirefeed", "f", feed)]
            {
                if range.varies() {
                    let _ = writeln!(
                        elements,
                        r#"<tp:modifier attribute="{word}" type="constant" factor="{factor}" minvalue="{}" maxvalue="{}"/>"#,
                        range.0, range.1
                    );
                }
            }
            all.push(WrittenProfile::new(&name, &values, elements));
        }
        all
    }

    /// The number by which layers call a profile, from 1.
    fn number(&self, index: u16) -> usize {
        let used = self.ranges.iter().take(usize::from(index) + 1);
        used.filter(|r| r.is_some()).count()
    }

    /// Adds a bead; nothing where it is shorter than the file's digits.
    fn segment(
        &self,
        pass: &Pass<'_>,
        height: f64,
        text: &mut String,
    ) -> Result<(), ToolpathFileWriteError> {
        let points = points(pass, height)?;
        if points.len() < 2 {
            return Ok(());
        }
        let ranges = self.ranges[usize::from(pass.head.profile)];
        let _ = writeln!(
            text,
            r#"<segment type="polyline6d" profileid="{}" partid="1" mp:role="{}" mp:part="{}">"#,
            self.number(pass.head.profile),
            role_word(pass.head.role),
            pass.head.part
        );
        for point in &points {
            let ([x, y, z], q) = (point.at, point.tool);
            let [i, j, k, w] = [q.x, q.y, q.z, q.w].map(digits);
            let _ = write!(
                text,
                r#"<point6d x="{x}" y="{y}" z="{z}" i="{i}" j="{j}" k="{k}" w="{w}""#
            );
            if let (Some(i), Some(ranges)) = (point.ends, ranges) {
                let values = self.values(pass, i);
                for ((range, value), factor) in ranges.iter().zip(values).zip(["e", "f"]) {
                    if range.varies() {
                        let _ = write!(text, r#" {factor}="{}""#, range.factor(value));
                    }
                }
            }
            if let Some([through, lines]) = point.arc {
                let _ = write!(text, r#" mp:arc="{through} {lines}""#);
            }
            text.push_str("/>\n");
        }
        text.push_str("</segment>\n");
        Ok(())
    }
}

/// A name that no other profile has, as the format asks.
fn new_name(name: &str, others: &[String]) -> String {
    let name = name.replace(char::is_control, " ");
    let numbered = (1..).map(|n| match (n, name.trim()) {
        (1, name) => name.to_owned(),
        (n, "") => format!("profile {n}"),
        (n, name) => format!("{name} {n}"),
    });
    let mut free = numbered.filter(|n| !n.is_empty() && !others.contains(n));
    // there are more numbers than names
    free.next().unwrap_or_default()
}

/// What a profile says where nothing varies it.
fn nominal(said: f64, range: Range) -> f64 {
    if said >= range.0 && said <= range.1 {
        said
    } else {
        range.0
    }
}

/// Nine decimals, without a minus sign before zero.
fn digits(value: f64) -> f64 {
    (value * 1e9).round() / 1e9 + 0.0
}

/// A point as it is written.
struct Point {
    at: [i32; 3],
    tool: DQuat,
    /// The move that ends here, or goes on from here along an arc.
    ends: Option<usize>,
    /// So many lines lead to the point that an arc goes through, and so many up to here stand for it.
    arc: Option<[usize; 2]>,
}

/// How the tool stands at point `i` of a pass: upright where it is not said.
fn tool(pass: &Pass<'_>, i: usize) -> DQuat {
    let axis = pass.axis(i).unwrap_or(DVec3::Z).normalize_or(DVec3::Z);
    quaternion(axis, pass.turn(i).unwrap_or(0.0))
}

/// The points of a bead of a layer that lies `height` mm over the part's z = 0, those that fall together left out.
fn points(pass: &Pass<'_>, height: f64) -> Result<Vec<Point>, ToolpathFileWriteError> {
    let place = pass.place();
    let mut all = vec![Point {
        at: units(place, pass.points[0], height)?,
        tool: tool(pass, 0),
        ends: None,
        arc: None,
    }];
    for i in 0..pass.move_count() {
        let inner = inner(pass, i);
        let (from, to) = (tool(pass, i), tool(pass, i + 1));
        let to_shorter = if from.dot(to) < 0.0 { -to } else { to };
        let before = all.len();
        let between = inner.points.iter().map(|(share, position)| {
            let tool = (from * (1.0 - share) + to_shorter * *share).normalize();
            (*position, tool)
        });
        for (position, tool) in between.chain([(pass.points[i + 1], to)]) {
            let at = units(place, position, height)?;
            if all.last().is_some_and(|p| p.at == at) {
                continue;
            }
            all.push(Point {
                at,
                tool,
                ends: Some(i),
                arc: None,
            });
        }
        let lines = inner.points.len() + 1;
        if let (Some(last), Some(through)) = (all.last_mut(), inner.through)
            && last.ends == Some(i)
        {
            last.arc = Some([through, lines]);
        }
        if all.len() != before + lines
            && let Some(last) = all.last_mut()
        {
            last.arc = None;
        }
    }
    Ok(all)
}

/// Points between the ends of a move: with their shares of the way, and how many lines lead to the one that an arc is told by.
#[derive(Default)]
struct Inner {
    points: Vec<(f64, DVec3)>,
    through: Option<usize>,
}

fn inner(pass: &Pass<'_>, i: usize) -> Inner {
    let (Move::Arc { via }, Some(arc)) = (pass.move_at(i), pass.arc(i)) else {
        return Inner::default();
    };
    let from_centre = via - arc.centre;
    let angle = from_centre.dot(arc.v).atan2(from_centre.dot(arc.u));
    let share = angle.rem_euclid(std::f64::consts::TAU) / arc.sweep;
    let lines = arc.chords(BEAD_CHORD) as f64;
    let count = |share: f64| (lines * share).ceil().max(1.0) as usize;
    let (before, after) = (count(share), count(1.0 - share));
    let mut points: Vec<(f64, DVec3)> = Vec::with_capacity(before + after);
    for k in 1..before {
        let t = share * k as f64 / before as f64;
        points.push((t, arc.at(t)));
    }
    points.push((share, via));
    for k in 1..after {
        let t = share + (1.0 - share) * k as f64 / after as f64;
        points.push((t, arc.at(t)));
    }
    Inner {
        points,
        through: Some(before),
    }
}

fn units(
    place: PassPlace,
    position: DVec3,
    height: f64,
) -> Result<[i32; 3], ToolpathFileWriteError> {
    let DVec3 { x, y, z } = position + height * DVec3::Z;
    Ok([
        device(place, "the x of a point", (x, BEAD_STEP))?,
        device(place, "the y of a point", (y, BEAD_STEP))?,
        device(place, "the z of a point", (z, BEAD_STEP))?,
    ])
}
