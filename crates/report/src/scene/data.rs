//! A scene as the viewer reads it: a short description in JSON and packed columns that it refers to by number.

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::machine::{Body, JointMotion, Machine};
use super::{LineSet, Scalar, Scene, SceneError, Stroke, Surface, Visibility};
use crate::colour::ColourMap;
use crate::packing::{Quantiser, pack_codes, pack_indices};

/// Points of a line set that a page carries at most; beyond, every k-th point is shown and the page says so.
const SHOWN_POINTS: usize = 2_500_000;

/// Bit of the layer column that marks the first point of a polyline.
const START: u16 = 0x8000;

/// A packed scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneData {
    /// What the columns are; see the viewer for its reading.
    pub description: Value,
    /// Packed columns, base64.
    pub columns: Vec<String>,
    /// What the quantisation and thinning cost, in sentences for people.
    pub notes: Vec<String>,
}

enum Column {
    Codes(Vec<u16>, usize),
    Indices(Vec<u32>, usize),
}

/// Columns queued for packing; the number of a column is its place.
#[derive(Default)]
struct Queue(Vec<Column>);

impl Queue {
    fn codes(&mut self, codes: Vec<u16>, stride: usize) -> Value {
        self.0.push(Column::Codes(codes, stride));
        json!(self.0.len() - 1)
    }

    fn indices(&mut self, indices: Vec<u32>, stride: usize) -> Value {
        self.0.push(Column::Indices(indices, stride));
        json!(self.0.len() - 1)
    }
}

/// Packs `scene`: positions to 1/65534 of its largest extent, scalars to 1/65534 of their range.
///
/// # Errors
/// [`SceneError`] when the scene does not pass [`Scene::check`].
pub fn pack(scene: &Scene) -> Result<SceneData, SceneError> {
    scene.check()?;
    let frame = Frame::of(scene);
    let mut queue = Queue::default();
    let mut notes = Vec::new();
    let lines: Vec<Value> = scene
        .lines
        .iter()
        .map(|set| {
            let Some((thin, every)) = set.thinned(SHOWN_POINTS) else {
                return describe_lines(set, &frame, &mut queue);
            };
            notes.push(format!(
                "“{}” has {} points: one in {every} is shown.",
                set.name,
                set.points.len()
            ));
            describe_lines(&thin, &frame, &mut queue)
        })
        .collect();
    let surfaces: Vec<Value> = scene
        .surfaces
        .iter()
        .map(|s| describe_surface(s, &frame, &mut queue))
        .collect();
    let heights = scene.heights.as_ref().filter(|h| !h.numbers().is_empty()).map(|h| {
        let (given, shown) = (h.given(), h.shown());
        let frame_size = shown.nx * shown.ny;
        let q = Quantiser::covering(h.heights().iter().map(|&v| f64::from(v)));
        if shown.cell > given.cell {
            notes.push(format!(
                "The predicted surface is shown in cells of {} mm; it was computed in cells of {} mm.",
                shown.cell, given.cell
            ));
        }
        let codes = h.heights().iter().map(|&v| q.code(f64::from(v))).collect();
        json!({
            "name": h.name,
            "opacity": h.opacity.clamp(0.05, 1.0),
            "shown": h.visibility.at_first(),
            "nx": shown.nx, "ny": shown.ny, "cell": shown.cell,
            "origin": [shown.origin.x, shown.origin.y],
            "numbers": h.numbers(),
            "lo": q.lo, "step": q.step, "data": queue.codes(codes, frame_size),
            "scalars": h.scalars().iter().map(|s| describe_scalar(s, frame_size, &mut queue)).collect::<Vec<_>>(),
        })
    });
    let machine = scene
        .machine
        .as_ref()
        .map(|m| describe_machine(m, &mut queue));
    notes.push(format!(
        "Positions are shown to {} µm; files beside this page hold full precision.",
        crate::number::significant(500.0 * frame.step, 2)
    ));
    let description = json!({
        "lo": frame.lo.to_array(),
        "step": frame.step,
        "size": (frame.hi - frame.lo).to_array(),
        "layers": scene.layers(),
        "maps": [ColourMap::Sequential.stops(), ColourMap::Diverging.stops()],
        "lines": lines,
        "surfaces": surfaces,
        "heights": heights,
        "machine": machine,
    });
    let columns = queue
        .0
        .par_iter()
        .map(|column| match column {
            Column::Codes(codes, stride) => pack_codes(codes, *stride),
            Column::Indices(indices, stride) => pack_indices(indices, *stride),
        })
        .collect();
    Ok(SceneData {
        description,
        columns,
        notes,
    })
}

/// One quantisation for all positions, the same step along each axis.
struct Frame {
    lo: DVec3,
    hi: DVec3,
    step: f64,
}

impl Frame {
    fn of(scene: &Scene) -> Frame {
        let points = scene
            .lines
            .iter()
            .flat_map(|l| &l.points)
            .chain(scene.surfaces.iter().flat_map(|s| &s.mesh.vertices));
        let mut lo = DVec3::INFINITY;
        let mut hi = DVec3::NEG_INFINITY;
        for &p in points {
            lo = lo.min(p);
            hi = hi.max(p);
        }
        if let Some(h) = &scene.heights {
            let grid = h.shown();
            let size = grid.cell * DVec3::new((grid.nx - 1) as f64, (grid.ny - 1) as f64, 0.0);
            for &z in h.heights().iter().filter(|z| z.is_finite()) {
                let corner = grid.origin.extend(f64::from(z));
                lo = lo.min(corner);
                hi = hi.max(corner + size);
            }
        }
        if !(lo.is_finite() && hi.is_finite()) {
            (lo, hi) = (DVec3::ZERO, DVec3::ZERO);
        }
        let step = Quantiser::between(0.0, (hi - lo).max_element()).step;
        Frame { lo, hi, step }
    }

    fn codes(&self, p: DVec3) -> [u16; 3] {
        let q = Quantiser {
            lo: 0.0,
            step: self.step,
        };
        (p - self.lo).to_array().map(|v| q.code(v))
    }
}

fn describe_scalar(scalar: &Scalar, stride: usize, queue: &mut Queue) -> Value {
    let q = Quantiser::covering(scalar.values.iter().map(|&v| f64::from(v)));
    let codes = scalar
        .values
        .iter()
        .map(|&v| q.code(f64::from(v)))
        .collect();
    let range = scalar
        .range
        .unwrap_or([q.lo, q.value(crate::packing::NO_VALUE - 1)]);
    json!({
        "name": scalar.name,
        "unit": scalar.unit,
        "lo": q.lo, "step": q.step,
        "range": range,
        "map": match scalar.map { ColourMap::Sequential => 0, ColourMap::Diverging => 1 },
        "data": queue.codes(codes, stride),
    })
}

fn describe_lines(set: &LineSet, frame: &Frame, queue: &mut Queue) -> Value {
    let mut codes = Vec::with_capacity(4 * set.points.len());
    let mut polylines = set.polylines.iter().peekable();
    let mut layer = 0;
    for (i, &p) in set.points.iter().enumerate() {
        let mut mark = 0;
        if let Some(polyline) = polylines.next_if(|next| next.first == i) {
            layer = polyline.layer as u16;
            mark = START;
        }
        codes.extend(frame.codes(p));
        codes.push(layer | mark);
    }
    json!({
        "name": set.name,
        "points": set.points.len(),
        "width": match set.stroke { Stroke::Bead(width) => width, Stroke::Hairline => 0.0 },
        "shown": set.visibility.at_first(),
        "data": queue.codes(codes, 4),
        "scalars": set.scalars.iter().map(|s| describe_scalar(s, 1, queue)).collect::<Vec<_>>(),
    })
}

fn describe_surface(surface: &Surface, frame: &Frame, queue: &mut Queue) -> Value {
    let mut codes = Vec::with_capacity(4 * surface.mesh.vertices.len());
    for &p in &surface.mesh.vertices {
        codes.extend(frame.codes(p));
        codes.push(0);
    }
    let indices = surface.mesh.triangles.iter().flatten().copied().collect();
    json!({
        "name": surface.name,
        "points": surface.mesh.vertices.len(),
        "triangles": surface.mesh.triangles.len(),
        "opacity": surface.opacity.clamp(0.05, 1.0),
        "shown": surface.visibility.at_first(),
        "finished": surface.visibility == Visibility::Finished,
        "data": queue.codes(codes, 4),
        "indices": queue.indices(indices, 3),
        "scalars": surface.scalars.iter().map(|s| describe_scalar(s, 1, queue)).collect::<Vec<_>>(),
    })
}

/// Position, then the quaternion x, y, z, w.
fn pose(pose: &Pose) -> Vec<f64> {
    let (p, q) = (pose.position.to_array(), pose.orientation.to_array());
    p.into_iter().chain(q).collect()
}

fn describe_machine(machine: &Machine, queue: &mut Queue) -> Value {
    let mut column = |values: &[f64]| {
        let q = Quantiser::covering(values.iter().copied());
        let codes = values.iter().map(|&v| q.code(v)).collect();
        json!({ "lo": q.lo, "step": q.step, "data": queue.codes(codes, 1) })
    };
    let axes: Vec<Value> = machine.axes.iter().map(|a| column(&a.values)).collect();
    let times = column(&machine.times);
    let layers = machine.layers.iter().map(|&l| l as u16).collect();
    let layers = queue.codes(layers, 1);
    let bodies: Vec<Value> = machine
        .bodies
        .iter()
        .map(|b| describe_body(b, queue))
        .collect();
    json!({
        "name": machine.name,
        "bodies": bodies,
        "holder": machine.holder,
        "part": pose(&machine.holder_from_part),
        "axes": axes,
        "times": times,
        "layers": layers,
    })
}

fn describe_body(body: &Body, queue: &mut Queue) -> Value {
    let coordinates = body.mesh.vertices.iter().flat_map(DVec3::to_array);
    let q = Quantiser::covering(coordinates);
    let codes = body.mesh.vertices.iter().flat_map(|v| {
        let [x, y, z] = v.to_array().map(|c| q.code(c));
        [x, y, z, 0]
    });
    let indices = body.mesh.triangles.iter().flatten().copied().collect();
    json!({
        "name": body.name,
        "carrier": body.carrier,
        "pose": pose(&body.carrier_from_body),
        "axis": body.joint.map(|j| j.axis),
        "turns": body.joint.is_some_and(|j| j.motion == JointMotion::Turns),
        "along": body.joint.map(|j| j.along.to_array()),
        "lo": q.lo, "step": q.step,
        "data": queue.codes(codes.collect(), 4),
        "indices": queue.indices(indices, 3),
    })
}
