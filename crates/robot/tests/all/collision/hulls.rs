//! Links as hulls: a line with a radius is one, and comes as near as the bar that it is.

use std::sync::Arc;

use meltpath_geometry::Mesh;
use meltpath_robot::cell::{LinkHull, Links};
use meltpath_robot::hull::{Excess, Hull};

use super::*;

/// The same cell with the bars of its links as hulls of two points, the fourth slim at the wrist as the forearm's bar is.
fn as_hulls(cell: &Cell, forearm: usize) -> Cell {
    let mut cell = cell.clone();
    let chain = &cell.arm.chain;
    let shapes = cell.shapes.as_mut().unwrap();
    let Links::Bars(radii) = shapes.links else {
        panic!("{:?}", shapes.links);
    };
    let hull = |i: usize| {
        let next = chain.joints.get(i + 1);
        let end = next.map_or(chain.last_from_end, |j| j.parent_from_joint);
        let slim = if i + 1 == forearm { radii[i] } else { 0.0 };
        let end = end.position - end.position.clamp_length_max(slim);
        LinkHull {
            link: i as u8 + 1,
            hull: Hull::with(vec![DVec3::ZERO, end], radii[i]).unwrap(),
            pieces: Vec::new(),
            excess: Excess::default(),
            mesh: Mesh::default(),
            of: String::new(),
        }
    };
    shapes.links = Links::Hulls(Arc::from((0..6).map(hull).collect::<Vec<_>>()));
    cell
}

/// Distances below this are found exactly, mm.
const NEAR: f64 = 60.0;

/// The pairs that come near along a bead.
fn near(cell: &Cell, metal: &Metal) -> BTreeMap<[Body; 2], f64> {
    let job = Job::bead(cell.clone(), 0.0);
    let task = job.task(Rotation::Free);
    let held = hold(&task, &Silent).unwrap();
    let found = sweep(&task, &held, &job.around(&|_| metal), NEAR).unwrap();
    let near = found.iter().filter(|c| c.distance < NEAR);
    near.map(|c| (c.bodies, c.distance)).collect()
}

#[test]
fn a_bar_and_its_hull_come_as_near() {
    let cell = abb();
    let hulls = as_hulls(&cell, 3);
    let metal = plate(60.0, 200.0);
    let (wanted, found) = (near(&cell, &metal), near(&hulls, &metal));
    assert!(
        !wanted.is_empty() && wanted.keys().eq(found.keys()),
        "{wanted:?} {found:?}"
    );
    for (bodies, wanted) in wanted {
        let off = (wanted.max(0.0) - found[&bodies].max(0.0)).abs();
        assert!(
            off <= RESERVED + 1e-3,
            "{bodies:?}: {wanted} {}",
            found[&bodies]
        );
    }
}
