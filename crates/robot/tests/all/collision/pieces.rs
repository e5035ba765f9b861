//! A link as the hulls of its pieces: what stands between its tines is as far as it is, and what is in it touches.

use std::sync::Arc;

use meltpath_geometry::Mesh;
use meltpath_geometry::shapes::cuboid;
use meltpath_robot::cell::{LinkHull, Links};
use meltpath_robot::collision::{Solids, room};
use meltpath_robot::hull::{Fineness, Pieces};

use super::*;

/// Farther is of no interest, mm: everything but the fork is.
const FAR: f64 = 40.0;

fn bar(low: [f64; 3], high: [f64; 3]) -> Mesh {
    cuboid(low.into(), high.into())
}

/// A cell that holds its tip straight over the middle of the part at 120 mm, and how it stands.
fn over_the_middle() -> (Cell, Values) {
    let cell = abb();
    let rest = cell.at_rest();
    let tip = Pose::of_tool(DVec3::new(0.0, 0.0, 120.0), DVec3::Z, 0.0);
    let ways = cell.arm.inverse(cell.base_from_flange(tip, &rest)).unwrap();
    let arm = ways.solutions[0].angles;
    (cell, Values { arm, ..rest })
}

/// The same with a body in place of its links, which stands so in the part: as one hull, or as the hulls of its pieces.
fn with(cell: &Cell, values: &Values, mut mesh: Mesh, whole: bool) -> Cell {
    let mut cell = cell.clone();
    let frames = cell.frames(values);
    let link = frames.base.then(cell.arm.chain.frames(&values.arm)[5]);
    let link_from_part = link.inverse().then(frames.part);
    let at = |v: &mut DVec3| *v = link_from_part.point(*v);
    mesh.vertices.iter_mut().for_each(at);
    let pieces = Pieces::of(&mesh, Fineness::default()).unwrap();
    let link = LinkHull {
        link: 6,
        hull: pieces.whole,
        pieces: if whole { Vec::new() } else { pieces.pieces },
        excess: pieces.excess,
        mesh,
        of: String::new(),
    };
    cell.shapes.as_mut().unwrap().links = Links::Hulls(Arc::from([link]));
    cell
}

fn room_of(cell: &Cell, values: &Values, metal: &Metal) -> f64 {
    let at = |_: u32| metal;
    let around = Surroundings::new(cell, cell.shapes.as_ref().unwrap(), &at, 20.0);
    room(cell, &around, (0, values), FAR)
}

/// Two tines with their inner sides 30 mm beside the middle, 36 mm over the plate, under a bridge.
fn between_tines() -> Mesh {
    let mut fork = bar([-45.0, -20.0, 200.0], [45.0, 20.0, 230.0]);
    fork.add(&bar([-45.0, -20.0, 36.0], [-30.0, 20.0, 200.0]));
    fork.add(&bar([30.0, -20.0, 36.0], [45.0, 20.0, 200.0]));
    fork
}

#[test]
fn what_stands_between_tines_is_as_far_as_its_sides() {
    let (cell, values) = over_the_middle();
    // a wall of 8 mm, whose top is 75 mm below the nozzle
    let corner = DVec2::splat(200.0);
    let mut map = HeightMap::new(-corner, corner, 1.0, 0.0).unwrap();
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            if map.centre(ix, iy).x.abs() < 4.0 {
                let i = map.index(ix, iy);
                map.z[i] = 60.0;
            }
        }
    }
    let metal = Metal::of(&map, 1.0);
    let far = with(
        &cell,
        &values,
        bar([0.0, 0.0, 300.0], [9.0, 9.0, 309.0]),
        false,
    );
    assert_eq!(room_of(&far, &values, &metal), FAR);
    let fork = with(&cell, &values, between_tines(), false);
    let Links::Hulls(links) = &fork.shapes.as_ref().unwrap().links else {
        panic!("{:?}", fork.shapes);
    };
    let excess = links[0].excess.most;
    assert!(excess <= 1.0, "{excess}");
    // cells of 1 mm whose middles lie within 4 mm: from -4 to 4
    let found = room_of(&fork, &values, &metal);
    assert!(found <= 26.0 + 1e-3 && found > 26.0 - 0.01, "{found}");
    let whole = with(&cell, &values, between_tines(), true);
    assert!(room_of(&whole, &values, &metal) <= 0.0);
}

/// A cube that lies within a tine, and touches no side of it.
#[test]
fn what_lies_in_a_piece_touches() {
    let (cell, values) = over_the_middle();
    let fork = with(&cell, &values, between_tines(), false);
    for ([x, z], inside) in [
        ([36.0, 100.0], true),
        ([0.0, 210.0], true),
        ([0.0, 66.0], false),
    ] {
        let cube = bar([x - 1.0, -1.0, z - 1.0], [x + 1.0, 1.0, z + 1.0]);
        let solids = Arc::new(Solids::new(&[cube], []));
        let found = room_of(&fork, &values, &Metal::until(&solids, 0));
        if inside {
            assert!(found <= 0.0, "{x} {z}: {found}");
        } else {
            // from the cube's side to a tine
            assert!((found - 29.0).abs() < 1e-2, "{x} {z}: {found}");
        }
    }
}
