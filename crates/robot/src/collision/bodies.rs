//! The bodies of a cell as capsules, and where they are.

use std::fmt;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::distance::{Segment, between};
use crate::cell::{Arrangement, Cell, Shapes, Values};

/// Rods that stand for something round with flat ends.
const RODS: u32 = 12;

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
    let mut capsules = Vec::with_capacity(7 + RODS as usize);
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
    for (aside, rod) in ring(radius) {
        let ends = [-rod, -length].map(|z| aside + z * DVec3::Z);
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
            for (aside, rod) in ring(radius) {
                let ends = [-rod, -length.max(2.0 * rod)].map(|z| aside + z * DVec3::Z);
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

/// Rods side by side around a line along z that stand for something round with flat ends: where each is, and its radius, mm.
fn ring(radius: f64) -> impl Iterator<Item = (DVec3, f64)> {
    let sine = (std::f64::consts::PI / f64::from(RODS)).sin();
    let rod = radius * sine / (1.0 + sine);
    (0..RODS).map(move |i| {
        let (s, c) = (std::f64::consts::TAU * f64::from(i) / f64::from(RODS)).sin_cos();
        (DVec3::new(c, s, 0.0) * (radius - rod), rod)
    })
}

/// A capsule around all rods of the nozzle.
pub(super) fn around_nozzle(capsules: &[Capsule]) -> Option<Capsule> {
    let rods = || capsules.iter().filter(|c| c.body == Body::Nozzle);
    let count = rods().count();
    let first = *rods().next()?;
    let middle = |end: fn(&Segment) -> DVec3, of: fn(&Capsule) -> Segment| {
        rods().map(|rod| end(&of(rod))).sum::<DVec3>() / count as f64
    };
    let line = |of: fn(&Capsule) -> Segment| Segment {
        a: middle(|s| s.a, of),
        b: middle(|s| s.b, of),
    };
    let axis = line(|c| c.line);
    Some(Capsule {
        line: axis,
        in_base: line(|c| c.in_base),
        radius: first.line.a.distance(axis.a) + first.radius,
        ..first
    })
}
