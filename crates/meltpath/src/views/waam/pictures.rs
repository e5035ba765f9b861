//! Still pictures of the moments that decide about the robot: the whole cell, and the torch from near, with what is laid by then.

use std::f64::consts::PI;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::mesh::bounds;
use meltpath_geometry::shapes::cuboid;
use meltpath_geometry::{Mesh, Pose};
use meltpath_report::number::duration;
use meltpath_report::picture::draw::{Camera, Drawing};
use meltpath_report::picture::{Image, text, write_png};
use meltpath_report::table::{self, Table};
use meltpath_robot::cell::{Arrangement, Cell};
use meltpath_robot::collision::Body;
use meltpath_robot::command::{Kind, Source};
use meltpath_robot::summary::CommandRecord;
use rayon::prelude::*;

use super::machine::machine;
use crate::waam::drive::film::{Film, Moment, Step, timed};
use crate::waam::drive::key_moments::KeyMoment;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Pixels of a picture, of its head, and the width of its left view.
const SIZE: [usize; 2] = [1360, 820];
const HEAD: usize = 92;
const LEFT: usize = 800;
/// Free space about what is shown, pixels.
const MARGIN: usize = 36;
/// Half of what the view from near spans, mm.
const NEAR: f64 = 130.0;
/// From where it is seen: beside the arm, rad, and over the level, rad.
const BESIDE: f64 = -1.05;
const OVER: f64 = 0.38;
/// A table whose top is seen under less than this sine hides what stands on it.
const FACING: f64 = 0.2;
/// Side of the squares on the floor, mm.
const SQUARE: f64 = 250.0;
/// Beads are drawn within this of their arcs, mm.
const CHORD: f64 = 0.5;
/// The plate reaches so far beyond the beads where the job says no size, mm.
const PLATE: f64 = 25.0;

const PAPER: [u8; 3] = [255, 255, 255];
const SKY: [u8; 3] = [246, 248, 250];
const INK: [u8; 3] = [30, 36, 44];
const PALE: [u8; 3] = [96, 106, 118];
const FLOOR: [u8; 3] = [214, 220, 226];
const LINK: [[u8; 3]; 2] = [[245, 178, 66], [228, 150, 48]];
const TORCH: [u8; 3] = [92, 104, 120];
const TABLE: [u8; 3] = [186, 194, 204];
const BASE_METAL: [u8; 3] = [148, 156, 166];
const BEAD: [[u8; 3]; 2] = [[86, 130, 176], [116, 158, 200]];
const NOW: [u8; 3] = [226, 60, 46];

/// What was built by which arm.
pub(super) struct Build<'a> {
    pub(super) cell: &'a Cell,
    pub(super) settings: &'a Settings,
    pub(super) commands: &'a Commands,
    pub(super) records: &'a [CommandRecord],
    /// What the beads stand on, in the part; nothing on a plate.
    pub(super) body: Option<&'a Mesh>,
}

/// Draws the key moments into the run's folder; the table of them.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(
    folder: &OutputFolder,
    build: &Build<'_>,
    film: &Film,
) -> Result<Table, OutputError> {
    let columns = [
        "picture",
        "moment",
        "value",
        "time",
        "layer",
        "check or fact",
    ];
    let mut told = Table::new("Key moments", &columns);
    let shown = film.moments.iter().filter_map(|moment| {
        let (time, step) = when(build, film, moment)?;
        Some((moment, value(build, moment), time, step))
    });
    let shown: Vec<_> = shown.collect();
    let images: Vec<Image> = shown
        .par_iter()
        .map(|(moment, value, time, step)| picture(build, (moment, value), (*time, step)))
        .collect();
    for ((moment, value, time, step), image) in shown.iter().zip(&images) {
        let name = format!("pictures/{}.png", moment.name);
        folder.write(&name, |to| write_png(image, to))?;
        let layer = layer(build, step.command);
        told.rows.push(vec![
            table::Cell::text(&name),
            table::Cell::text(moment.title),
            table::Cell::text(value),
            table::Cell::Duration(*time),
            table::Cell::Fixed(f64::from(layer), 0),
            table::Cell::text(moment.id),
        ]);
    }
    Ok(told)
}

fn layer(build: &Build<'_>, command: u32) -> u32 {
    let layers = &build.commands.layer_of_command;
    layers.get(command as usize).copied().unwrap_or(0)
}

fn value(build: &Build<'_>, moment: &KeyMoment) -> String {
    if moment.place.is_some() {
        return moment.value.clone();
    }
    let layers = build.commands.layer_of_command.iter().max();
    let end = build.records.last().map_or(0.0, |r| r.end);
    format!("{} layers in {}", layers.unwrap_or(&0), duration(end))
}

/// The step nearest to a moment, and its time.
fn when(build: &Build<'_>, film: &Film, moment: &KeyMoment) -> Option<(f64, Step)> {
    let steps = timed(&film.steps, build.records);
    let Some((command, position)) = moment.place else {
        return steps.last().map(|(time, step)| (time, *step));
    };
    let far = |step: &Step| {
        let tip = build.cell.frames(&step.values).part_from_wire_tip();
        tip.position.distance(position)
    };
    let of_command = steps.filter(|(_, step)| step.command == command);
    let nearest = of_command.min_by(|a, b| far(a.1).total_cmp(&far(b.1)));
    nearest.map(|(time, step)| (time, *step))
}

/// A mesh in the world, and its colour.
struct Shape {
    mesh: Mesh,
    colour: [u8; 3],
}

/// All that is seen at a moment.
fn shapes(build: &Build<'_>, bodies: &[Body], (time, step): (f64, &Step)) -> Vec<Shape> {
    let now = Moment {
        time,
        layer: 0,
        values: step.values,
    };
    let machine = machine(build.cell, &[now]);
    let base = machine.bodies.iter().position(|b| b.name == "base");
    let is_of = |i: usize, body: &Body| match body {
        Body::Link(n) => base.is_some_and(|base| i == base + usize::from(*n)),
        Body::Torch | Body::Nozzle => machine.bodies[i].name == "torch",
        Body::Table => machine.bodies[i].name == "table",
        Body::Metal => false,
    };
    let mut shapes = Vec::new();
    for (i, pose) in machine.poses(0).into_iter().enumerate() {
        let colour = match machine.bodies[i].name.as_str() {
            "torch" => TORCH,
            "table" => TABLE,
            _ => LINK[i % 2],
        };
        let about = bodies.iter().any(|b| is_of(i, b));
        let pose = match machine.bodies[i].name.as_str() {
            "table" => pose.then(Pose::at(under(build) * DVec3::Z)),
            _ => pose,
        };
        shapes.push(Shape {
            mesh: placed(&machine.bodies[i].mesh, pose),
            colour: if about { NOW } else { colour },
        });
    }
    let part = build.cell.frames(&step.values).part;
    let about = bodies.contains(&Body::Metal);
    shapes.extend(laid(build, about, (time, part)));
    shapes
}

/// How high over its frame the table begins, mm: under the plate, as it is held against torch and arm.
fn under(build: &Build<'_>) -> f64 {
    match build.cell.arrangement {
        Arrangement::TorchOnRobot => -build.settings.plate_thickness,
        Arrangement::PartOnRobot => 0.0,
    }
}

fn placed(mesh: &Mesh, pose: Pose) -> Mesh {
    Mesh {
        vertices: mesh.vertices.iter().map(|v| pose.point(*v)).collect(),
        triangles: mesh.triangles.clone(),
    }
}

/// The straight pieces of the beads up to a time, in the part: command, ends, and the direction away from the metal.
fn pieces(build: &Build<'_>, until: f64) -> Vec<(u32, [DVec3; 2], DVec3)> {
    let mut pieces = Vec::new();
    let mut here = build.commands.start.position;
    for (command, record) in build.commands.commands.iter().zip(build.records) {
        if record.start >= until {
            break;
        }
        let span = (record.end - record.start).max(1e-9);
        let share = ((until - record.start) / span).clamp(0.0, 1.0);
        let from = here;
        if !matches!(command.kind, Kind::Wait { .. }) {
            here = command.target;
        }
        if !matches!(command.source, Source::On { .. }) || from == here {
            continue;
        }
        let up = -(command.orientation * DVec3::Z);
        let arc = match command.kind {
            Kind::Arc { via } => Arc::through(from, via, here),
            _ => None,
        };
        let count = arc.map_or(1, |a| a.chords(CHORD));
        let at = |i: usize| {
            let t = share * i as f64 / count as f64;
            arc.map_or_else(|| from.lerp(here, t), |a| a.at(t))
        };
        pieces.extend((0..count).map(|i| (command.id, [at(i), at(i + 1)], up)));
    }
    pieces
}

/// Plate or body, and beads, in the world.
fn laid(build: &Build<'_>, about: bool, (time, part): (f64, Pose)) -> Vec<Shape> {
    let bead = &build.settings.bead;
    let (half, high) = (0.5 * bead.width.value, bead.height.value);
    let mut beads = [Mesh::default(), Mesh::default()];
    for (command, ends, up) in pieces(build, time) {
        let of_layer = (layer(build, command) % 2) as usize;
        ridge(&mut beads[of_layer], ends, up, (half, high));
    }
    let mut shapes: Vec<Shape> = beads
        .iter()
        .zip(BEAD)
        .map(|(mesh, colour)| Shape {
            mesh: placed(mesh, part),
            colour: if about { NOW } else { colour },
        })
        .collect();
    let under = build.body.cloned().into_iter().chain(plate(build));
    shapes.extend(under.map(|under| Shape {
        mesh: placed(&under, part),
        colour: BASE_METAL,
    }));
    shapes
}

/// The plate under the whole build, in the part: of the size that the job says, its middle under that of the beads. Nothing where there is none.
fn plate(build: &Build<'_>) -> Option<Mesh> {
    if build.settings.plate_thickness <= 0.0 {
        return None;
    }
    let beads = pieces(build, f64::INFINITY);
    let (low, high) = bounds(beads.iter().flat_map(|(_, ends, _)| *ends))?;
    let half = match build.settings.plate {
        Some([length, width]) => 0.5 * DVec3::new(length, width, 0.0),
        None => 0.5 * (high - low) + PLATE,
    };
    let middle = 0.5 * (low + high);
    let thick = build.settings.plate_thickness.max(1.0);
    // a little below the beads, so that one of both is seen where they touch
    let (low, high) = (middle - half, middle + half);
    Some(cuboid(low.with_z(-thick), high.with_z(-0.05)))
}

/// A piece of a bead: round on top, flat below.
fn ridge(mesh: &mut Mesh, [from, to]: [DVec3; 2], up: DVec3, (half, high): (f64, f64)) {
    let Some(along) = (to - from).try_normalize() else {
        return;
    };
    let across = up.cross(along).normalize_or_zero() * half;
    let over = along.cross(across).normalize_or_zero() * high;
    let profile = [
        [-1.0, 0.0],
        [-0.75, 0.66],
        [0.0, 1.0],
        [0.75, 0.66],
        [1.0, 0.0],
    ];
    let first = mesh.vertices.len() as u32;
    for end in [from - 0.5 * half * along, to + 0.5 * half * along] {
        let points = profile.map(|[x, z]| end + x * across + z * over);
        mesh.vertices.extend(points);
    }
    let count = profile.len() as u32;
    for i in 0..count - 1 {
        let (a, b) = (first + i, first + i + 1);
        mesh.triangles.push([a, b, b + count]);
        mesh.triangles.push([a, b + count, a + count]);
    }
    for end in [first, first + count] {
        mesh.triangles
            .extend((1..count - 1).map(|i| [end, end + i, end + i + 1]));
    }
}

/// From where a cell is seen, rad: beside the arm, and where a tilted table would hide the torch from the other side of it.
fn beside(arm: f64, build: &Build<'_>, table: Pose) -> f64 {
    let far = PI + BESIDE;
    let sides = [BESIDE, -BESIDE, far, -far].map(|side| arm + side);
    let top = table.orientation * DVec3::Z;
    let facing = |azimuth: &f64| {
        let level = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        top.dot(OVER.cos() * level + OVER.sin() * DVec3::Z)
    };
    let hidden = build.cell.arrangement == Arrangement::TorchOnRobot && facing(&sides[0]) < FACING;
    let best = sides
        .into_iter()
        .max_by(|a, b| facing(a).total_cmp(&facing(b)));
    best.filter(|_| hidden).unwrap_or(sides[0])
}

/// A picture of a moment: the cell, the torch from near, what it is in words.
fn picture(
    build: &Build<'_>,
    (moment, value): (&KeyMoment, &str),
    (time, step): (f64, &Step),
) -> Image {
    let shapes = shapes(build, &moment.bodies, (time, step));
    let frames = build.cell.frames(&step.values);
    let tip = frames.wire_tip.position;
    let arm = tip - frames.base.position;
    let azimuth = beside(arm.y.atan2(arm.x), build, frames.table);
    let mut image = Image::new(SIZE, PAPER);
    let height = SIZE[1] - HEAD;
    let points = || shapes.iter().flat_map(|s| s.mesh.vertices.iter().copied());
    let room = [LEFT, height].map(|n| (n - 2 * MARGIN) as f64);
    let whole = Camera::from(tip, azimuth, OVER, 1.0).fitted(points(), room);
    let right = SIZE[0] - LEFT - 8;
    let near = Camera::from(tip, azimuth, OVER, right as f64 / (2.0 * NEAR));
    for (camera, width, left) in [(whole, LEFT, 0), (near, right, LEFT + 8)] {
        let mut drawing = Drawing::new(camera, [width, height], SKY);
        floor(&mut drawing, points());
        for shape in &shapes {
            for corners in &shape.mesh.triangles {
                let corners = corners.map(|v| shape.mesh.vertices[v as usize]);
                drawing.triangle(corners, shape.colour);
            }
        }
        drawing.line(frames.torch.position, tip, 2.0, INK);
        let arms = 14.0 / camera.scale;
        for side in [DVec3::X, DVec3::Y, DVec3::Z] {
            drawing.line(tip - arms * side, tip + arms * side, 1.5, NOW);
        }
        let names = axes(&mut drawing, camera, [width, height]);
        drawing.lay(&mut image, [left, HEAD]);
        for (name, at) in names {
            let at = [left + at[0] as usize, HEAD + at[1] as usize];
            text::write(&mut image, name, at, 2, INK);
        }
        ruler(&mut image, camera.scale, [left + width, SIZE[1]]);
    }
    head(&mut image, build, (moment, value), (time, step));
    image
}

/// What a picture shows, in words above it.
fn head(
    image: &mut Image,
    build: &Build<'_>,
    (moment, value): (&KeyMoment, &str),
    (time, step): (f64, &Step),
) {
    let title = format!("{}: {value}", moment.title);
    let scale = if text::width(&title, 3) + 32 > SIZE[0] {
        2
    } else {
        3
    };
    text::write(image, &title, [16, 16], scale, INK);
    let command = step.command as usize;
    let bead = build
        .commands
        .bead_of_command
        .get(command)
        .copied()
        .flatten();
    let bead = bead.map_or_else(|| "travel".to_owned(), |b| format!("bead {b}"));
    let tip = build
        .cell
        .frames(&step.values)
        .part_from_wire_tip()
        .position;
    let place = format!(
        "at {}, layer {}, {bead}, wire tip at x {:.1}, y {:.1}, z {:.1} mm in the part",
        duration(time),
        layer(build, step.command),
        tip.x,
        tip.y,
        tip.z
    );
    text::write(image, &place, [16, 56], 2, PALE);
    text::write(image, &build.cell.name, [16, HEAD + 16], 2, PALE);
}

/// Squares on the floor under all that is shown.
fn floor(drawing: &mut Drawing, points: impl Iterator<Item = DVec3>) {
    let Some((low, high)) = bounds(points.filter(|p| p.is_finite())) else {
        return;
    };
    let first = (low / SQUARE).floor() - 1.0;
    let last = ((high / SQUARE).ceil() + 1.0).min(first + 200.0);
    let z = low.z.min(0.0);
    let lines = |from: f64, to: f64| (from as i64..=to as i64).map(|i| i as f64 * SQUARE);
    let (from, to) = (first * SQUARE, last * SQUARE);
    for x in lines(first.x, last.x) {
        drawing.line(DVec3::new(x, from.y, z), DVec3::new(x, to.y, z), 1.0, FLOOR);
    }
    for y in lines(first.y, last.y) {
        drawing.line(DVec3::new(from.x, y, z), DVec3::new(to.x, y, z), 1.0, FLOOR);
    }
}

/// The directions of the world in the lower left corner; their names and where these stand.
fn axes(drawing: &mut Drawing, camera: Camera, size: [usize; 2]) -> Vec<(&'static str, [f64; 2])> {
    let long = 44.0 / camera.scale;
    let corner = [80.0 - 0.5 * size[0] as f64, 80.0 - 0.5 * size[1] as f64];
    let before = 1e5 / camera.scale.max(1e-3);
    let origin = camera.at(
        [corner[0] / camera.scale, corner[1] / camera.scale],
        -before,
    );
    let named = [
        ("x", DVec3::X, [206, 52, 44]),
        ("y", DVec3::Y, [42, 140, 62]),
        ("z", DVec3::Z, [44, 86, 190]),
    ];
    let ends = named.map(|(name, along, colour)| {
        drawing.line(origin, origin + long * along, 3.0, colour);
        let [x, y] = drawing.pixel(origin + 1.25 * long * along);
        (name, [(x - 5.0).max(0.0), (y - 7.0).max(0.0)])
    });
    ends.to_vec()
}

/// A length to measure by, in the lower right corner of a view.
fn ruler(image: &mut Image, scale: f64, [right, bottom]: [usize; 2]) {
    let lengths = [
        5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0,
    ];
    let fits = |l: &&f64| **l * scale <= 170.0;
    let length = lengths
        .iter()
        .rev()
        .find(fits)
        .copied()
        .unwrap_or(lengths[0]);
    let wide = (length * scale) as usize;
    let (left, y) = (right.saturating_sub(wide + 20), bottom - 24);
    for x in left..left + wide {
        for dy in 0..3 {
            image.set([x, y + dy], INK);
        }
    }
    for x in [left, left + wide] {
        for dy in 0..13 {
            image.set([x, y - 5 + dy], INK);
            image.set([x + 1, y - 5 + dy], INK);
        }
    }
    let words = format!("{length:.0} mm");
    let at = right.saturating_sub(20 + text::width(&words, 2));
    text::write(image, &words, [at, y - 26], 2, INK);
}
