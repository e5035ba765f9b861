//! A beam's marks in planes, layer by layer: contours as loops and polylines, lines of a fill as hatches.

use std::fmt::Write as _;
use std::io::{Seek, Write};

use meltpath_geometry::math::DVec3;
use meltpath_geometry::shapes::cuboid;
use meltpath_toolpath::{Channel, Layer, Move, Pass, Role};

use super::super::error::ToolpathFileWriteError;
use super::super::words::{Kind, MARK_CHORD, MARK_STEP, role_word};
use super::package::{Package, WrittenProfile, above_zero, device};

/// Heights of a layer's points that differ by less are one, mm.
const SAME_HEIGHT: f64 = 1e-6;

/// What a beam marks with where a pass does not say it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Speed along contours and along everything else, mm/s.
    pub speed: [f64; 2],
    /// Power on contours and on everything else, W.
    pub power: [f64; 2],
    /// Speed of jumps to contours and to everything else, mm/s.
    pub jump_speed: [f64; 2],
}

/// Writes a toolpath of layers that a beam marks, one after the other. The same layers give the same bytes.
///
/// What does not mark is left out: jumps, waits, runs before and after lines. Points are kept to
/// 0.1 µm; arcs become lines within half a micrometre.
pub struct PlanarWriter<W: Write + Seek> {
    package: Package<W>,
    beam: Beam,
    /// What the profiles stand for: contour or not, speed and power.
    known: Vec<(bool, f64, f64)>,
    /// Lowest and highest corner of the box round all marks, from the plate on, mm.
    marked: Option<(DVec3, DVec3)>,
}

/// A segment that grows: a hatch takes in the lines that follow.
#[derive(PartialEq)]
struct Head {
    form: &'static str,
    profile: usize,
    role: Role,
    part: u32,
}

impl<W: Write + Seek> PlanarWriter<W> {
    /// Begins a package for something called `name`.
    ///
    /// # Errors
    /// [`ToolpathFileWriteError::Io`].
    pub fn new(to: W, beam: Beam, name: &str) -> Result<Self, ToolpathFileWriteError> {
        Ok(PlanarWriter {
            package: Package::new(to, (Kind::Planar, MARK_STEP), name)?,
            beam,
            known: Vec::new(),
            marked: None,
        })
    }

    /// Writes a layer; nothing where it marks nothing.
    ///
    /// # Errors
    /// [`ToolpathFileWriteError`] where a layer is not plane or lies below 0, or a pass stays on spots.
    pub fn layer(&mut self, layer: &Layer) -> Result<(), ToolpathFileWriteError> {
        let marks = || layer.passes().filter(|p| p.head.role.deposits());
        let Some(first) = marks().next() else {
            return Ok(());
        };
        let z = first.points[0].z;
        let top = device(first.place(), "the height", (layer.height + z, MARK_STEP))?;
        if top < 0 {
            return Err(ToolpathFileWriteError::Value {
                pass: first.place(),
                what: "the height of its layer",
                value: layer.height + z,
                wanted: "0 or above (mm)",
            });
        }
        let (mut text, mut open) = (String::new(), None);
        for pass in marks() {
            self.pass(&pass, z, (&mut text, &mut open))?;
            let top = layer.height + z;
            for p in pass.points {
                let (low, high) = (p.with_z(0.0), p.with_z(top));
                let (a, b) = self.marked.unwrap_or((low, high));
                self.marked = Some((a.min(low), b.max(high)));
            }
        }
        end(&mut text, &mut open);
        self.package.layer(layer.number, Some(top), &text)
    }

    /// Writes what is left, and gives back where it was written. A package must hold a shape: it is the box round all marks.
    ///
    /// # Errors
    /// [`ToolpathFileWriteError`].
    pub fn finish(self) -> Result<W, ToolpathFileWriteError> {
        let (low, high) = self.marked.ok_or(ToolpathFileWriteError::Empty)?;
        // nothing is flat
        let high = high.max(low + DVec3::splat(MARK_STEP));
        self.package.finish(cuboid(low, high))
    }

    /// Adds a pass: in pieces where speed or power change along it.
    fn pass(
        &mut self,
        pass: &Pass<'_>,
        z: f64,
        (text, open): (&mut String, &mut Option<Head>),
    ) -> Result<(), ToolpathFileWriteError> {
        let plane = |p: &DVec3| (p.z - z).abs() <= SAME_HEIGHT;
        if let Some(p) = pass.points.iter().find(|p| !plane(p)) {
            return Err(ToolpathFileWriteError::Value {
                pass: pass.place(),
                what: "the height of a point",
                value: p.z,
                wanted: "that of its whole layer",
            });
        }
        if pass.moves().any(|m| matches!(m, Move::Spot { .. })) {
            return Err(ToolpathFileWriteError::NoWords {
                pass: pass.place(),
                what: "spots",
                remedy: "fill with lines",
            });
        }
        let fills = matches!(pass.head.role, Role::Fill | Role::Support);
        let mut from = 0;
        while from < pass.move_count() {
            let profile = self.profile(pass, from)?;
            let mut to = from + 1;
            while to < pass.move_count() && self.profile(pass, to)? == profile {
                to += 1;
            }
            let points = lines(pass, from, to)?;
            let whole = to - from == pass.move_count();
            let closed = points.len() > 3 && points.first() == points.last();
            let form = match points.len() {
                0 | 1 => {
                    from = to;
                    continue;
                }
                2 if fills => "hatch",
                _ if whole && closed => "loop",
                _ => "polyline",
            };
            let head = Head {
                form,
                profile,
                role: pass.head.role,
                part: pass.head.part,
            };
            add(text, open, head, &points);
            from = to;
        }
        Ok(())
    }

    /// Index of the profile of a move, which is added where it is new.
    fn profile(&mut self, pass: &Pass<'_>, i: usize) -> Result<usize, ToolpathFileWriteError> {
        let contour = pass.head.role == Role::Contour;
        let which = usize::from(!contour);
        let speed = pass.value(Channel::Speed, i);
        let speed = above_zero(
            pass.place(),
            "the speed",
            speed.unwrap_or(self.beam.speed[which]),
        )?;
        let power = pass.value(Channel::Power, i);
        let power = power.unwrap_or(self.beam.power[which]);
        if !(power >= 0.0 && power.is_finite()) {
            return Err(ToolpathFileWriteError::Value {
                pass: pass.place(),
                what: "the power",
                value: power,
                wanted: "finite and not negative (W)",
            });
        }
        let wanted = (contour, speed, power);
        if let Some(known) = self.known.iter().position(|k| *k == wanted) {
            return Ok(known);
        }
        let word = if contour { "contour" } else { "hatch" };
        let same = self.known.iter().filter(|k| k.0 == contour).count();
        let name = match same {
            0 => word.to_owned(),
            n => format!("{word} {}", n + 1),
        };
        let values = format!(
            r#" laserpower="{power}" laserspeed="{speed}" jumpspeed="{}""#,
            self.beam.jump_speed[which]
        );
        let profile = WrittenProfile::new(&name, &values, String::new());
        self.package.profiles.push(profile);
        self.known.push(wanted);
        Ok(self.known.len() - 1)
    }
}

/// The points of the moves `from` to `to` of a pass, device units, those that fall together left out.
fn lines(pass: &Pass<'_>, from: usize, to: usize) -> Result<Vec<[i32; 2]>, ToolpathFileWriteError> {
    let unit = |p: DVec3| -> Result<[i32; 2], ToolpathFileWriteError> {
        Ok([
            device(pass.place(), "the x of a point", (p.x, MARK_STEP))?,
            device(pass.place(), "the y of a point", (p.y, MARK_STEP))?,
        ])
    };
    let mut all = vec![unit(pass.points[from])?];
    for i in from..to {
        let arc = pass.arc(i);
        let count = arc.as_ref().map_or(1, |a| a.chords(MARK_CHORD).max(1));
        for n in 1..=count {
            let on = arc.as_ref().filter(|_| n < count);
            let p = on.map_or(pass.points[i + 1], |a| a.at(n as f64 / count as f64));
            let p = unit(p)?;
            if all.last() != Some(&p) {
                all.push(p);
            }
        }
    }
    Ok(all)
}

/// Adds points to the hatch that is open, or as a segment of their own.
fn add(text: &mut String, open: &mut Option<Head>, head: Head, points: &[[i32; 2]]) {
    let goes_on = head.form == "hatch" && open.as_ref() == Some(&head);
    if !goes_on {
        end(text, open);
        let _ = writeln!(
            text,
            r#"<segment type="{}" profileid="{}" partid="1" mp:role="{}" mp:part="{}">"#,
            head.form,
            head.profile + 1,
            role_word(head.role),
            head.part
        );
    }
    match (head.form, points) {
        ("hatch", [[x1, y1], [x2, y2]]) => {
            let _ = writeln!(text, r#"<hatch x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"/>"#);
        }
        (form, points) => {
            // the way back to the first point goes without saying
            let count = points.len() - usize::from(form == "loop");
            for [x, y] in &points[..count] {
                let _ = writeln!(text, r#"<point x="{x}" y="{y}"/>"#);
            }
        }
    }
    *open = Some(head);
}

fn end(text: &mut String, open: &mut Option<Head>) {
    if open.take().is_some() {
        text.push_str("</segment>\n");
    }
}
