//! Arm, torch, table, track and positioner as bodies that move around the part.

use meltpath_geometry::math::{DQuat, DVec2, DVec3};
use meltpath_geometry::shapes::{cuboid, revolve};
use meltpath_geometry::{Mesh, Pose};
use meltpath_report::scene::Machine;
use meltpath_report::scene::machine::{Axis, Body, Joint, JointMotion};
use meltpath_robot::cell::{Arrangement, Cell, Links, Shapes, Values};
use meltpath_robot::kinematics::{Chain, JointKind};

use super::thinned::thinned;
use crate::waam::drive::film::Moment;

/// Radius of links, torch and nozzle where the cell's file tells no shapes, mm: lines that can be seen.
const LINE: f64 = 20.0;

/// Triangles of a link as it is drawn, at most.
const TRIANGLES: usize = 2000;

/// Sides of round shapes.
const SIDES: u32 = 24;

/// Thickness of a table as it is drawn, mm: one that reaches the floor would hide what stands behind it.
const TABLE: f64 = 100.0;

/// The bodies so far, and the columns of their axes.
#[derive(Default)]
struct Built {
    bodies: Vec<Body>,
    axes: Vec<Axis>,
}

impl Built {
    fn fixed(&mut self, name: &str, carrier: Option<usize>, at: Pose, mesh: Mesh) -> usize {
        self.bodies.push(Body {
            name: name.to_owned(),
            carrier,
            carrier_from_body: at,
            joint: None,
            mesh,
        });
        self.bodies.len() - 1
    }

    /// The joints of a chain on what carries it, each with the shape that `mesh` gives for its number and where it ends.
    fn chain(
        &mut self,
        chain: &Chain,
        carrier: Option<usize>,
        moments: &[Moment],
        value: impl Fn(&Values, usize) -> f64,
        mesh: impl Fn(usize, DVec3) -> Mesh,
    ) -> Option<usize> {
        let mut last = carrier;
        for (i, joint) in chain.joints.iter().enumerate() {
            let next = chain.joints.get(i + 1);
            let end = next.map_or(chain.last_from_end, |j| j.parent_from_joint);
            self.axes.push(Axis {
                name: joint.name.clone(),
                values: moments.iter().map(|m| value(&m.values, i)).collect(),
            });
            self.bodies.push(Body {
                name: joint.name.clone(),
                carrier: last,
                carrier_from_body: joint.parent_from_joint,
                joint: Some(Joint {
                    axis: self.axes.len() - 1,
                    motion: match joint.kind {
                        JointKind::Revolute => JointMotion::Turns,
                        JointKind::Prismatic => JointMotion::Slides,
                    },
                    along: joint.axis,
                }),
                mesh: mesh(i, end.position),
            });
            last = Some(self.bodies.len() - 1);
        }
        last
    }
}

/// The cell, with its axes at each moment.
pub(super) fn machine(cell: &Cell, moments: &[Moment]) -> Machine {
    let mut built = Built::default();
    let bare = |_: usize, _: DVec3| Mesh::default();
    let track = cell.track.as_ref();
    let carriage = track.map(|t| {
        let last = built.chain(t, None, moments, |v, _| v.track, bare);
        built.fixed("carriage", last, t.last_from_end, Mesh::default())
    });
    let links = cell.shapes.as_ref().map(|s| &s.links);
    let pedestal = told(links, 0).unwrap_or_default();
    let base = built.fixed("base", carriage, cell.carrier_from_base, pedestal);
    let radius = |i: usize| match links {
        Some(Links::Bars(radii)) => radii[i.min(5)],
        _ => LINE,
    };
    let link = |i: usize, end: DVec3| {
        told(links, i + 1).unwrap_or_else(|| capsule(DVec3::ZERO, end, radius(i)))
    };
    let arm = &cell.arm.chain;
    let wrist = built.chain(arm, Some(base), moments, |v, i| v.arm[i], link);
    let flange = built.fixed("flange", wrist, arm.last_from_end, Mesh::default());
    let positioner = cell.positioner.as_ref();
    let carrier = positioner.map(|p| {
        let last = built.chain(p, None, moments, |v, i| v.positioner[i], bare);
        built.fixed("positioner", last, p.last_from_end, Mesh::default())
    });
    let shapes = cell.shapes.as_ref();
    let table = built.fixed("table", carrier, cell.carrier_from_table, table(shapes));
    let (holder, torch_on, flange_from_torch) = match cell.arrangement {
        Arrangement::TorchOnRobot => (table, Some(flange), Some(cell.carrier_from_torch)),
        Arrangement::PartOnRobot => (flange, None, None),
    };
    let torch = torch(shapes, flange_from_torch);
    built.fixed("torch", torch_on, cell.carrier_from_torch, torch);
    Machine {
        name: cell.name.clone(),
        bodies: built.bodies,
        holder: Some(holder),
        holder_from_part: cell.carrier_from_part,
        axes: built.axes,
        times: moments.iter().map(|m| m.time).collect(),
        layers: moments.iter().map(|m| m.layer).collect(),
    }
}

/// A link as its URDF tells it, of few triangles; nothing where it tells none.
fn told(links: Option<&Links>, link: usize) -> Option<Mesh> {
    let Some(Links::Hulls(hulls)) = links else {
        return None;
    };
    let mut all = Mesh::default();
    for body in hulls.iter().filter(|h| usize::from(h.link) == link) {
        all.add(&body.mesh);
    }
    let all = thinned(&all, TRIANGLES);
    // a link of the arm without one is a line that can be seen
    (!all.triangles.is_empty() || link == 0).then_some(all)
}

/// A round bar with round ends.
fn capsule(a: DVec3, b: DVec3, radius: f64) -> Mesh {
    const QUARTER: u32 = 6;
    let length = a.distance(b);
    let side = |i: u32| {
        let angle = std::f64::consts::FRAC_PI_2 * f64::from(i) / f64::from(QUARTER);
        radius * DVec2::new(angle.cos(), angle.sin())
    };
    // poles lie on the axis to the bit
    let below = (0..QUARTER).rev().map(|i| side(i) * DVec2::new(1.0, -1.0));
    let above = (0..QUARTER).map(|i| side(i) + length * DVec2::Y);
    let mut profile = vec![DVec2::new(0.0, -radius)];
    profile.extend(below.chain(above));
    profile.push(DVec2::new(0.0, length + radius));
    let axis = (b - a).try_normalize().unwrap_or(DVec3::Z);
    turned(revolve(&profile, SIDES), a, axis)
}

/// A shape that stands on z, along `axis` from `at`.
fn turned(mut mesh: Mesh, at: DVec3, axis: DVec3) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, axis);
    for vertex in &mut mesh.vertices {
        *vertex = at + turn * *vertex;
    }
    mesh
}

/// Nozzle and body of the torch in its own frame: the contact tube ends at the origin, the wire leaves along z.
fn torch(shapes: Option<&Shapes>, flange_from_torch: Option<Pose>) -> Mesh {
    let [length, radius] = shapes.map_or([4.0 * LINE, 0.5 * LINE], |s| s.nozzle);
    let back = -length * DVec3::Z;
    // a torch that stands goes on behind its nozzle by as much again
    let flange = flange_from_torch.map_or(2.0 * back, |f| f.inverse().position);
    let mut mesh = revolve(
        &[[0.0, -length], [radius, -length], [radius, 0.0], [0.0, 0.0]].map(DVec2::from),
        SIDES,
    );
    let radius = shapes.map_or(LINE, |s| s.torch);
    mesh.add(&capsule(back, flange, radius));
    mesh
}

/// The table, its upper side at zero; nothing where its size is not told.
fn table(shapes: Option<&Shapes>) -> Mesh {
    let Some(table) = shapes.and_then(|s| s.table) else {
        return Mesh::default();
    };
    let [x, y] = table.size;
    let half = DVec3::new(0.5 * x, 0.5 * y, 0.0);
    cuboid(-half - table.thickness.min(TABLE) * DVec3::Z, half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_closed_and_of_the_right_size() {
        use std::f64::consts::PI;
        let bar = capsule(
            DVec3::new(10.0, 0.0, 0.0),
            DVec3::new(110.0, 0.0, 0.0),
            10.0,
        );
        let exact = PI * 100.0 * 100.0 + 4.0 / 3.0 * PI * 1000.0;
        assert!(
            (bar.volume() / exact - 1.0).abs() < 0.03,
            "{}",
            bar.volume()
        );
        let mesh = torch(None, None);
        assert!(mesh.vertices.iter().all(|v| v.z < 1e-9));
    }

    /// The bodies of the view stand where the cell says, with a table that tilts and without one.
    #[test]
    fn bodies_stand_where_the_frames_of_the_cell_do() {
        for robot in meltpath_data::robots::ALL {
            let cell = meltpath_robot::cell::read(robot.text).unwrap();
            let mut values = cell.at_rest();
            values.arm[0] += 0.4;
            values.arm[4] += 0.3;
            values.positioner = [0.2, -0.5];
            let moment = Moment {
                time: 0.0,
                layer: 1,
                values,
            };
            let machine = machine(&cell, &[moment]);
            let poses = machine.poses(0);
            let frames = cell.frames(&values);
            for (name, wanted) in [
                ("base", frames.base),
                ("flange", frames.flange),
                ("table", frames.table),
                ("torch", frames.torch),
            ] {
                let at = machine.bodies.iter().position(|b| b.name == name).unwrap();
                let off = poses[at].position.distance(wanted.position);
                let turn = poses[at].orientation.angle_between(wanted.orientation);
                assert!(
                    off < 1e-9 && turn < 1e-6,
                    "{}: {name}: {off} {turn}",
                    robot.name
                );
            }
        }
    }
}
