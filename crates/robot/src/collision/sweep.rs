//! The least distance of every pair of bodies along a held program.

use std::collections::BTreeMap;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::bodies::{Body, Capsule, capsules, may_touch};
use super::distance::{Bounds, Segment, between};
use super::metal::Metal;
use crate::cell::{Arrangement, Cell, Shapes, Values};
use crate::posture::{Follower, Held, NotHeld, Task};

/// Distances beyond this are of no interest, mm.
const FAR: f64 = 1000.0;

/// How deep a table is taken to be, mm.
const DEEP: f64 = 2000.0;

/// What stands around a program while it is executed.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// Shapes of torch and arm.
    pub shapes: &'a Shapes,
    /// Plate and metal while a command is executed.
    pub metal: &'a dyn Fn(u32) -> &'a Metal,
    /// Thickness of the plate between part and table, mm.
    pub plate: f64,
}

/// Where two bodies come nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The bodies.
    pub bodies: [Body; 2],
    /// No more than their distance, mm; zero or less where they may touch.
    pub distance: f64,
    /// The command.
    pub command: u32,
    /// The wire's tip in the part, mm.
    pub position: DVec3,
}

/// The least distance of each pair, the nearest pair first.
///
/// # Errors
/// [`NotHeld`], where the program is not held after all.
pub fn sweep(
    task: &Task<'_>,
    held: &Held,
    around: &Surroundings<'_>,
) -> Result<Vec<Closest>, NotHeld> {
    let mut least = BTreeMap::new();
    for chain in &held.chains {
        let mut before: Option<Vec<Capsule>> = None;
        let mut follower = Follower::new(task, chain);
        while let Some(sample) = follower.next_sample()? {
            let values = Values {
                arm: sample.joints,
                ..task.values
            };
            let now = capsules(task.cell, around.shapes, &values);
            // a body is nowhere farther from one of two places than half of its way between them
            let ways = match &before {
                Some(before) => before
                    .iter()
                    .zip(&now)
                    .map(|(b, n)| 0.5 * way(b, n))
                    .collect(),
                None => vec![0.0; now.len()],
            };
            let scene = Scene {
                cell: task.cell,
                metal: (around.metal)(sample.command),
                table: table(task.cell, around, &values),
                capsules: &now,
                ways,
                command: sample.command,
                position: sample.tip.position,
            };
            for i in 0..now.len() {
                scene.add(i, &mut least);
            }
            before = Some(now);
        }
    }
    let mut found: Vec<Closest> = least.into_values().collect();
    found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    Ok(found)
}

/// How far the points of a capsule go from one place to the next, mm, with a tenth for the bend of their ways.
fn way(before: &Capsule, now: &Capsule) -> f64 {
    let ends = [(before.line.a, now.line.a), (before.line.b, now.line.b)];
    1.1 * ends
        .map(|(a, b)| a.distance(b))
        .into_iter()
        .fold(0.0, f64::max)
}

/// The table in its own frame, with the part in it; nothing where it is not known.
fn table(cell: &Cell, around: &Surroundings<'_>, values: &Values) -> Option<(Pose, Bounds)> {
    let [x, y] = around.shapes.table?;
    if cell.arrangement == Arrangement::PartOnRobot {
        return None;
    }
    let frames = cell.frames(values);
    let half = DVec3::new(0.5 * x, 0.5 * y, 0.0);
    let top = -around.plate;
    let bounds = Bounds {
        low: -half + (top - DEEP) * DVec3::Z,
        high: half + top * DVec3::Z,
    };
    Some((frames.table.inverse().then(frames.part), bounds))
}

/// One place of a program.
struct Scene<'a> {
    cell: &'a Cell,
    metal: &'a Metal,
    table: Option<(Pose, Bounds)>,
    capsules: &'a [Capsule],
    /// How far each capsule may be off on the way to here, mm.
    ways: Vec<f64>,
    command: u32,
    position: DVec3,
}

impl Scene<'_> {
    /// Keeps the least distances of a capsule from what stands after it in the order of bodies.
    fn add(&self, i: usize, least: &mut BTreeMap<[Body; 2], Closest>) {
        let Capsule { body, line, radius } = self.capsules[i];
        let may = |other: Body| may_touch(body, other, self.cell.arrangement);
        let mut keep = |other: Body, way: f64, distance: &dyn Fn(f64) -> f64| {
            let bodies = [body.min(other), body.max(other)];
            let known = least.get(&bodies).map_or(FAR, |c| c.distance);
            let distance = distance(known + way) - way;
            if distance < known {
                let closest = Closest {
                    bodies,
                    distance,
                    command: self.command,
                    position: self.position,
                };
                least.insert(bodies, closest);
            }
        };
        if may(Body::Metal) {
            keep(Body::Metal, self.ways[i], &|known| {
                self.metal.distance(&line, known + radius) - radius
            });
        }
        if let Some((table_from_part, bounds)) = &self.table
            && may(Body::Table)
        {
            let line = Segment {
                a: table_from_part.point(line.a),
                b: table_from_part.point(line.b),
            };
            let distance = |_| bounds.to_segment(&line) - radius;
            keep(Body::Table, self.ways[i], &distance);
        }
        for (other, way) in self.capsules.iter().zip(&self.ways) {
            if other.body > body && may(other.body) {
                let distance = |_| between(&line, &other.line) - radius - other.radius;
                keep(other.body, self.ways[i] + way, &distance);
            }
        }
    }
}
