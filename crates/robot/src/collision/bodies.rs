//! The bodies of a cell as capsules, and where they are.

use std::fmt;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::distance::{Segment, between};
use crate::cell::{Arrangement, Cell, Shapes, Values};

/// Rods along something round with a flat end, and as many around its rim.
const RODS: u32 = 24;

/// The link that ends at the flange.
const LAST: u8 = 6;

/// Something that may touch something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Body {
    /// The nozzle around the contact tube.
    Nozzle,
    /// The body of the torch.
    Torch,
    /// A link of the arm, from 1.
    Link(u8),
    /// Plate and part as grown.
    Metal,
    /// The table below the plate.
    Table,
}

impl fmt::Display for Body {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Body::Nozzle => f.write_str("nozzle"),
            Body::Torch => f.write_str("torch"),
            Body::Link(n) => write!(f, "link {n}"),
            Body::Metal => f.write_str("part"),
            Body::Table => f.write_str("table"),
        }
    }
}

/// A line with a radius around it, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Capsule {
    pub(super) body: Body,
    /// In the part.
    pub(super) line: Segment,
    /// In the arm's base.
    pub(super) in_base: Segment,
    pub(super) radius: f64,
}

impl Capsule {
    /// The distance of another, mm.
    pub(super) fn apart(&self, other: &Capsule) -> f64 {
        between(&self.in_base, &other.in_base) - self.radius - other.radius
    }
}

/// The number of the last link that is longer than it is thick before the wrist: its roundness ends there.
pub(super) fn forearm(cell: &Cell, shapes: &Shapes) -> u8 {
    let length = |joint: usize| {
        let joint = cell.arm.chain.joints.get(joint);
        joint.map_or(0.0, |j| j.parent_from_joint.position.length())
    };
    if length(4) > shapes.links[3] { 4 } else { 3 }
}

/// The capsules of torch and arm, in an order that does not depend on the joints.
pub(super) fn capsules(cell: &Cell, shapes: &Shapes, values: &Values) -> Vec<Capsule> {
    let frames = cell.frames(values);
    let part_from_base = frames.part.inverse().then(frames.base);
    let base_from_world = frames.base.inverse();
    let mut capsules = Vec::with_capacity(7 + 2 * RODS as usize);
    let mut add = |body, frame: Pose, [a, b]: [DVec3; 2], radius| {
        let in_base = Segment {
            a: frame.point(a),
            b: frame.point(b),
        };
        capsules.push(Capsule {
            body,
            line: Segment {
                a: part_from_base.point(in_base.a),
                b: part_from_base.point(in_base.b),
            },
            in_base,
            radius,
        });
    };
    let [length, radius] = shapes.nozzle;
    let torch = base_from_world.then(frames.torch);
    for (ends, rod) in round(radius, length) {
        add(Body::Nozzle, torch, ends, rod);
    }
    let back = -length * DVec3::Z;
    let flange = match cell.arrangement {
        Arrangement::TorchOnRobot => {
            let torch_from_flange = frames.torch.inverse().then(frames.flange);
            torch_from_flange.position
        }
        // a torch that stands goes on behind its nozzle by as much again
        Arrangement::PartOnRobot => 2.0 * back,
    };
    add(Body::Torch, torch, [back, flange], shapes.torch);
    let joints = &cell.arm.chain.joints;
    let of_joints = cell.arm.chain.frames(&values.arm);
    let ends = joints.iter().skip(1).map(|j| j.parent_from_joint.position);
    let ends = ends.chain([cell.arm.chain.last_from_end.position]);
    let forearm = forearm(cell, shapes);
    for ((number, (frame, end)), radius) in (1..).zip(of_joints.iter().zip(ends)).zip(shapes.links)
    {
        let body = Body::Link(number);
        if number == LAST && cell.arrangement == Arrangement::PartOnRobot {
            let flange = frame.then(cell.arm.chain.last_from_end);
            let length = end.length();
            let thin = radius.min(length);
            add(
                body,
                *frame,
                [DVec3::ZERO, end.clamp_length_max(length - thin)],
                thin,
            );
            // its face is flat: the part begins there
            for (ends, rod) in round(radius, length) {
                add(body, flange, ends, rod);
            }
            continue;
        }
        // a forearm is slim at the wrist, where the torch begins
        let slim = if number == forearm { radius } else { 0.0 };
        let line = [DVec3::ZERO, end - end.clamp_length_max(slim)];
        add(body, *frame, line, radius);
    }
    capsules
}

/// How far from its axis the lines of the rods lie at most that stand for something round of this radius, mm.
pub(super) fn outmost(radius: f64) -> f64 {
    radius / (std::f64::consts::PI / f64::from(RODS)).cos()
}

/// Rods that hold the side and the rim of something round along z with a flat end at zero: their ends and radii, mm. None goes beyond the
/// end; beside the side they stand out by a twentieth of the radius at most. Within the rim the end is open.
fn round(radius: f64, length: f64) -> impl Iterator<Item = ([DVec3; 2], f64)> {
    let half = std::f64::consts::PI / f64::from(RODS);
    let (sine, cosine) = half.sin_cos();
    // rods that touch each other within what is round, as thick as they must be to hold its side between them
    let within = radius * sine / (1.0 + sine);
    let around = radius - within;
    let thick = (radius * sine).hypot(radius * cosine - around);
    let deep = -length.max(2.0 * thick);
    let rim = thick - within;
    let at = move |step: f64| {
        let (s, c) = (2.0 * half * step).sin_cos();
        DVec3::new(c, s, 0.0)
    };
    (0..RODS).map(f64::from).flat_map(move |i| {
        let along = [-thick, deep].map(|z| at(i) * around + z * DVec3::Z);
        let corner = |step: f64| at(step) * outmost(radius) - rim * DVec3::Z;
        let across = [corner(i - 0.5), corner(i + 0.5)];
        [(along, thick), (across, rim)]
    })
}

/// Rods of a nozzle that are looked at together, those along it and those of its rim.
const TOGETHER: usize = 8;

/// The rods of the nozzle, side by side some together.
pub(super) fn of_nozzle(capsules: &[Capsule]) -> impl Iterator<Item = &[Capsule]> {
    let count = capsules.iter().take_while(|c| c.body == Body::Nozzle);
    capsules[..count.count()].chunks(TOGETHER)
}

/// A capsule around rods of the nozzle, in their order: those along it and those of its rim take turns.
pub(super) fn around(rods: &[Capsule]) -> Option<Capsule> {
    let first = *rods.first()?;
    let along = || rods.iter().step_by(2);
    let middle = |end: fn(&Segment) -> DVec3, of: fn(&Capsule) -> Segment| {
        along().map(|rod| end(&of(rod))).sum::<DVec3>() / along().count() as f64
    };
    let line = |of: fn(&Capsule) -> Segment| Segment {
        a: middle(|s| s.a, of),
        b: middle(|s| s.b, of),
    };
    let axis = line(|c| c.line);
    let out = rods.iter().map(|rod| {
        let ends = [rod.line.a, rod.line.b].map(|end| between(&axis, &Segment { a: end, b: end }));
        ends[0].max(ends[1]) + rod.radius
    });
    Some(Capsule {
        line: axis,
        in_base: line(|c| c.in_base),
        radius: out.fold(0.0, f64::max),
        ..first
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half-spaces and points beside rim and side are told nowhere farther than they are, and by little nearer.
    #[test]
    fn rods_hold_what_is_round() {
        let (radius, length) = (12.0, 80.0);
        let rods: Vec<([DVec3; 2], f64)> = round(radius, length).collect();
        for turn in (0..720).map(|i| f64::from(i).to_radians() / 2.0) {
            let out = DVec3::new(turn.cos(), turn.sin(), 0.0);
            for down in (0..=90).map(|i| f64::from(i).to_radians()) {
                let normal = out * down.cos() + DVec3::Z * down.sin();
                let exact = radius * down.cos();
                let reached =
                    |([a, b], r): &([DVec3; 2], f64)| a.dot(normal).max(b.dot(normal)) + r;
                let told = rods.iter().map(reached).fold(f64::MIN, f64::max);
                assert!(told > exact - 1e-9, "{turn} {down}: {told} {exact}");
                assert!(
                    told < exact + 0.063 * radius,
                    "{turn} {down}: {told} {exact}"
                );
            }
            for deep in (0..200).map(|i| 0.1 * f64::from(i)) {
                let point = out * radius - deep * DVec3::Z;
                let of = |([a, b], r): &([DVec3; 2], f64)| {
                    let share = (point - *a).dot(*b - *a) / (*b - *a).length_squared();
                    point.distance(a.lerp(*b, share.clamp(0.0, 1.0))) - r
                };
                let told = rods.iter().map(of).fold(f64::MAX, f64::min);
                assert!(told < 0.015 * radius, "{turn} {deep}: {told}");
            }
        }
        // straight below it is exact
        let lowest = |([a, b], r): &([DVec3; 2], f64)| a.z.max(b.z) + r;
        let low = rods.iter().map(lowest).fold(f64::MIN, f64::max);
        assert!(low.abs() < 1e-12, "{low}");
    }
}
