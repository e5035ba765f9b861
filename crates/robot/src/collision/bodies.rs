//! The bodies of a cell as bars, and where they are.

use std::fmt;

use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use super::distance::Segment;
use super::form::Form;
use super::round::{BESIDE, Ends, Round};
use crate::cell::{Arrangement, Cell, Links, Shapes, Values};

/// The link that ends at the flange.
const LAST: u8 = 6;

/// Something that may touch something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Body {
    /// The nozzle around the contact tube.
    Nozzle,
    /// The body of the torch.
    Torch,
    /// A link of the arm, from 1; 0 is its base.
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
            Body::Link(0) => f.write_str("base"),
            Body::Link(n) => write!(f, "link {n}"),
            Body::Metal => f.write_str("part"),
            Body::Table => f.write_str("table"),
        }
    }
}

/// A body, or a piece of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bar<'a> {
    pub(super) body: Body,
    pub(super) in_part: Form<'a>,
    /// The same in the arm's base.
    pub(super) in_base: Form<'a>,
}

/// The number of the last link that is longer than it is thick before the wrist: its roundness ends there.
pub(super) fn forearm(cell: &Cell, shapes: &Shapes) -> u8 {
    let length = |joint: usize| {
        let joint = cell.arm.chain.joints.get(joint);
        joint.map_or(0.0, |j| j.parent_from_joint.position.length())
    };
    let thick = match &shapes.links {
        Links::Bars(radii) => radii[3],
        Links::Hulls(hulls) => {
            let fourth = hulls.iter().filter(|h| h.link == 4);
            fourth.map(|h| h.hull.thickness()).fold(0.0, f64::max)
        }
    };
    if length(4) > thick { 4 } else { 3 }
}

/// How far each link reaches beyond the end of its line where it turns with all of it, mm.
pub(super) fn beside_links(cell: &Cell, shapes: &Shapes) -> [f64; 6] {
    let mut beside = [0.0; 6];
    match &shapes.links {
        Links::Bars(radii) => beside[5] = BESIDE * radii[5],
        Links::Hulls(hulls) => {
            for of in hulls.iter() {
                let Some(joint) = usize::from(of.link).checked_sub(1) else {
                    continue;
                };
                let more = of.hull.farthest() - end(cell, joint).length();
                if let Some(beside) = beside.get_mut(joint) {
                    *beside = more.max(*beside);
                }
            }
        }
    }
    beside
}

/// Where the line of a link ends, in the frame of its joint, which is counted from zero.
fn end(cell: &Cell, joint: usize) -> DVec3 {
    let chain = &cell.arm.chain;
    let next = chain.joints.get(joint + 1);
    next.map_or(chain.last_from_end, |j| j.parent_from_joint)
        .position
}

/// The bars of torch and arm, in an order that does not depend on the joints.
pub(super) fn bars<'a>(cell: &Cell, shapes: &'a Shapes, values: &Values) -> Vec<Bar<'a>> {
    let frames = cell.frames(values);
    let part_from_base = frames.part.inverse().then(frames.base);
    let mut bars = Vec::with_capacity(9);
    let mut add = |(body, in_base): (Body, Form<'a>)| {
        bars.push(Bar {
            body,
            in_part: in_base.seen_from(part_from_base),
            in_base,
        });
    };
    let torch = frames.base.inverse().then(frames.torch);
    let torch_from_flange = frames.torch.inverse().then(frames.flange);
    torch_bars(cell, shapes, torch, torch_from_flange)
        .into_iter()
        .for_each(&mut add);
    let of_joints = cell.arm.chain.frames(&values.arm);
    match &shapes.links {
        Links::Bars(radii) => link_bars(cell, shapes, radii, &of_joints, &mut add),
        Links::Hulls(hulls) => {
            for of in hulls.iter() {
                let joint = usize::from(of.link).checked_sub(1);
                let frame = joint.and_then(|j| of_joints.get(j)).copied();
                let form = Form::of_hull(&of.hull, &of.pieces, frame.unwrap_or(Pose::IDENTITY));
                add((Body::Link(of.link), form));
            }
        }
    }
    bars
}

/// A line in a frame with a radius around it.
fn round<'a>(
    body: Body,
    frame: Pose,
    [a, b]: [DVec3; 2],
    (radius, ends): (f64, Ends),
) -> (Body, Form<'a>) {
    let line = Segment {
        a: frame.point(a),
        b: frame.point(b),
    };
    (body, Form::Round(Round { line, radius, ends }))
}

/// Nozzle and torch.
fn torch_bars<'a>(
    cell: &Cell,
    shapes: &Shapes,
    torch: Pose,
    torch_from_flange: Pose,
) -> [(Body, Form<'a>); 2] {
    let [length, radius] = shapes.nozzle;
    let back = -length * DVec3::Z;
    let flange = match cell.arrangement {
        Arrangement::TorchOnRobot => torch_from_flange.position,
        // a torch that stands goes on behind its nozzle by as much again
        Arrangement::PartOnRobot => 2.0 * back,
    };
    let nozzle = [DVec3::ZERO, back];
    let body = (shapes.torch, Ends::Round);
    [
        round(Body::Nozzle, torch, nozzle, (radius, Ends::Flat)),
        round(Body::Torch, torch, [back, flange], body),
    ]
}

/// Links as bars around their lines.
fn link_bars<'a>(
    cell: &Cell,
    shapes: &Shapes,
    radii: &[f64; 6],
    of_joints: &[Pose],
    add: &mut impl FnMut((Body, Form<'a>)),
) {
    let forearm = forearm(cell, shapes);
    for ((number, frame), radius) in (1..).zip(of_joints).zip(*radii) {
        let body = Body::Link(number);
        let end = end(cell, usize::from(number) - 1);
        if number == LAST && cell.arrangement == Arrangement::PartOnRobot {
            let flange = frame.then(cell.arm.chain.last_from_end);
            let length = end.length();
            let thin = radius.min(length);
            let line = [DVec3::ZERO, end.clamp_length_max(length - thin)];
            add(round(body, *frame, line, (thin, Ends::Round)));
            // its face is flat: the part begins there
            let line = [DVec3::ZERO, -length * DVec3::Z];
            add(round(body, flange, line, (radius, Ends::Flat)));
            continue;
        }
        // a forearm is slim at the wrist, where the torch begins
        let slim = if number == forearm { radius } else { 0.0 };
        let line = [DVec3::ZERO, end - end.clamp_length_max(slim)];
        add(round(body, *frame, line, (radius, Ends::Round)));
    }
}
