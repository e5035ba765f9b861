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

/// How much farther than the least known distance a body is looked for, mm: what is found there spares the places after it.
const AHEAD: f64 = 25.0;

/// How deep a table is taken to be, mm.
const DEEP: f64 = 2000.0;

/// What stands around a program while it is executed.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// Shapes of torch and arm.
    pub shapes: &'a Shapes,
    /// Plate and metal while a command is executed.
    pub metal: &'a (dyn Fn(u32) -> &'a Metal + Sync),
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
        let mut rooms = Rooms::default();
        let mut follower = Follower::new(task, chain);
        while let Some(sample) = follower.next_sample()? {
            let values = Values::of(sample.joints, sample.external);
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
            let metal = (around.metal)(sample.command);
            rooms.gone(&ways, metal);
            let scene = Scene {
                cell: task.cell,
                metal,
                table: table(task.cell, around, &values),
                capsules: &now,
                ways,
                command: sample.command,
                position: sample.tip.position,
            };
            for i in 0..now.len() {
                scene.add(i, &mut rooms, &mut least);
            }
            before = Some(now);
        }
    }
    let mut found: Vec<Closest> = least.into_values().collect();
    found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    Ok(found)
}

/// How far the points of a capsule go from one place to the next, mm, with a tenth for the bend of their ways.
pub(super) fn way(before: &Capsule, now: &Capsule) -> f64 {
    let ends = [(before.line.a, now.line.a), (before.line.b, now.line.b)];
    1.1 * ends
        .map(|(a, b)| a.distance(b))
        .into_iter()
        .fold(0.0, f64::max)
}

/// The table in its own frame, with the part in it; nothing where it is not known.
pub(super) fn table(
    cell: &Cell,
    around: &Surroundings<'_>,
    values: &Values,
) -> Option<(Pose, Bounds)> {
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

/// The distance of a body from the table, mm.
pub(super) fn to_table((table_from_part, bounds): &(Pose, Bounds), capsule: &Capsule) -> f64 {
    let line = Segment {
        a: table_from_part.point(capsule.line.a),
        b: table_from_part.point(capsule.line.b),
    };
    bounds.to_segment(&line) - capsule.radius
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
    fn add(&self, i: usize, rooms: &mut Rooms<'_>, least: &mut BTreeMap<[Body; 2], Closest>) {
        let Capsule { body, line, radius } = self.capsules[i];
        let own = self.ways[i];
        let may = |other: Body| may_touch(body, other, self.cell.arrangement);
        if may(Body::Metal) {
            let far = known(least, body, Body::Metal);
            if rooms.metal[i] - own < far {
                let most = far + own + AHEAD + radius;
                rooms.metal[i] = self.metal.distance(&line, most) - radius;
                self.keep(least, [body, Body::Metal], rooms.metal[i] - own);
            }
        }
        if let Some(table) = &self.table
            && may(Body::Table)
            && rooms.table[i] - own < known(least, body, Body::Table)
        {
            rooms.table[i] = to_table(table, &self.capsules[i]);
            self.keep(least, [body, Body::Table], rooms.table[i] - own);
        }
        for (other, way) in self.capsules.iter().zip(&self.ways) {
            if other.body > body && may(other.body) {
                let distance = between(&line, &other.line) - radius - other.radius;
                self.keep(least, [body, other.body], distance - own - way);
            }
        }
    }

    fn keep(&self, least: &mut BTreeMap<[Body; 2], Closest>, bodies: [Body; 2], distance: f64) {
        if distance < known(least, bodies[0], bodies[1]) {
            let closest = Closest {
                bodies,
                distance,
                command: self.command,
                position: self.position,
            };
            least.insert(bodies, closest);
        }
    }
}

/// The least distance of a pair so far, mm.
fn known(least: &BTreeMap<[Body; 2], Closest>, a: Body, b: Body) -> f64 {
    least.get(&[a, b]).map_or(FAR, |c| c.distance)
}

/// How much room each capsule still has at least, so that it need not be looked at in every place: what was found, less the way since.
#[derive(Default)]
struct Rooms<'a> {
    metal: Vec<f64>,
    table: Vec<f64>,
    /// The metal that was looked at.
    of: Option<&'a Metal>,
}

impl<'a> Rooms<'a> {
    /// The capsules have gone on; nothing is known of the room in other metal.
    fn gone(&mut self, ways: &[f64], metal: &'a Metal) {
        let other = self.of.is_none_or(|of| !std::ptr::eq(of, metal));
        self.of = Some(metal);
        self.metal.resize(ways.len(), f64::NEG_INFINITY);
        self.table.resize(ways.len(), f64::NEG_INFINITY);
        for (i, way) in ways.iter().enumerate() {
            self.table[i] -= 2.0 * way;
            self.metal[i] = if other {
                f64::NEG_INFINITY
            } else {
                self.metal[i] - 2.0 * way
            };
        }
    }
}
