//! The bodies of a cell as bars, and where they are.

use std::fmt;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::distance::Segment;
use super::round::{Ends, Round};
use crate::cell::{Arrangement, Cell, Shapes, Values};

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

/// A body, or a piece of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bar {
    pub(super) body: Body,
    pub(super) in_part: Round,
    /// The same in the arm's base.
    pub(super) in_base: Round,
}

/// The number of the last link that is longer than it is thick before the wrist: its roundness ends there.
pub(super) fn forearm(cell: &Cell, shapes: &Shapes) -> u8 {
    let length = |joint: usize| {
        let joint = cell.arm.chain.joints.get(joint);
        joint.map_or(0.0, |j| j.parent_from_joint.position.length())
    };
    if length(4) > shapes.links[3] { 4 } else { 3 }
}

/// The bars of torch and arm, in an order that does not depend on the joints.
pub(super) fn bars(cell: &Cell, shapes: &Shapes, values: &Values) -> Vec<Bar> {
    let frames = cell.frames(values);
    let part_from_base = frames.part.inverse().then(frames.base);
    let base_from_world = frames.base.inverse();
    let mut bars = Vec::with_capacity(9);
    let mut add = |body, frame: Pose, [a, b]: [DVec3; 2], (radius, ends)| {
        let in_base = Round {
            line: Segment {
                a: frame.point(a),
                b: frame.point(b),
            },
            radius,
            ends,
        };
        let in_part = in_base.along(Segment {
            a: part_from_base.point(in_base.line.a),
            b: part_from_base.point(in_base.line.b),
        });
        bars.push(Bar {
            body,
            in_part,
            in_base,
        });
    };
    let [length, radius] = shapes.nozzle;
    let torch = base_from_world.then(frames.torch);
    let back = -length * DVec3::Z;
    add(
        Body::Nozzle,
        torch,
        [DVec3::ZERO, back],
        (radius, Ends::Flat),
    );
    let flange = match cell.arrangement {
        Arrangement::TorchOnRobot => {
            let torch_from_flange = frames.torch.inverse().then(frames.flange);
            torch_from_flange.position
        }
        // a torch that stands goes on behind its nozzle by as much again
        Arrangement::PartOnRobot => 2.0 * back,
    };
    add(
        Body::Torch,
        torch,
        [back, flange],
        (shapes.torch, Ends::Round),
    );
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
            let line = [DVec3::ZERO, end.clamp_length_max(length - thin)];
            add(body, *frame, line, (thin, Ends::Round));
            // its face is flat: the part begins there
            let line = [DVec3::ZERO, -length * DVec3::Z];
            add(body, flange, line, (radius, Ends::Flat));
            continue;
        }
        // a forearm is slim at the wrist, where the torch begins
        let slim = if number == forearm { radius } else { 0.0 };
        let line = [DVec3::ZERO, end - end.clamp_length_max(slim)];
        add(body, *frame, line, (radius, Ends::Round));
    }
    bars
}
