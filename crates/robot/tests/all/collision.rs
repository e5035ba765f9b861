//! Torch and arm beside metal: distances that follow from the drawing, and bodies that touch.

mod between;
mod hulls;
mod pieces;

use std::collections::BTreeMap;
use std::f64::consts::PI;

use meltpath_base::Silent;
use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_robot::cell::{self, Cell, Links, Stance, Values};
use meltpath_robot::collision::{Body, Clearance, Closest, Metal, Surroundings, hold_clear, sweep};
use meltpath_robot::posture::{Axes, Follower, Held, Rotation, Task, hold};
use meltpath_robot::{Command, Smoothing, Source};

/// The ABB with a straight torch of 330 mm, nozzle 80 mm by 12 mm, body 20 mm.
fn abb() -> Cell {
    let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
    let text = text.replacen("\"35 deg\"", "\"0 deg\"", 1).replacen(
        "torch = \"45 mm\"",
        "torch = \"20 mm\"",
        1,
    );
    cell::read(&text).unwrap()
}

/// The ABB as it ships, its torch at 35 deg.
fn leaning() -> Cell {
    cell::read(find(robots::ALL, "abb-irb2600-12-185").unwrap().text).unwrap()
}

/// A plate of 400 mm with a wall of `height` mm from x = `from` on.
fn plate(from: f64, height: f64) -> Metal {
    let corner = DVec2::splat(200.0);
    let mut map = HeightMap::new(-corner, corner, 1.0, 0.0).unwrap();
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            if map.centre(ix, iy).x > from {
                let i = map.index(ix, iy);
                map.z[i] = height;
            }
        }
    }
    Metal::of(&map, 1.0)
}

/// What a task looks at.
struct Job {
    cell: Cell,
    start: Pose,
    commands: Vec<Command>,
    configurations: BTreeMap<Option<u32>, Stance>,
}

impl Job {
    /// A bead of 100 mm along y at x = 0, the wire's tip at `z`.
    fn bead(cell: Cell, z: f64) -> Self {
        let bead = Command {
            source: Source::On { wire_feed: 100.0 },
            ..Command::line(0, DVec3::new(0.0, 50.0, z), 10.0, Smoothing::Fine)
        };
        Job {
            cell,
            start: Pose::from_wpr(DVec3::new(0.0, -50.0, z), DVec3::new(PI, 0.0, 0.0)),
            commands: vec![bead],
            configurations: BTreeMap::new(),
        }
    }

    fn task(&self, rotation: Rotation) -> Task<'_> {
        Task {
            cell: &self.cell,
            values: Values::default(),
            axes: Axes::Standing,
            start: self.start,
            commands: &self.commands,
            rotation,
            configurations: &self.configurations,
        }
    }

    fn around<'a>(&'a self, metal: &'a (dyn Fn(u32) -> &'a Metal + Sync)) -> Surroundings<'a> {
        let shapes = self.cell.shapes.as_ref().unwrap();
        Surroundings::new(&self.cell, shapes, metal, 20.0)
    }
}

/// How near bodies come along the bead at `z`, to 0.1 mm.
fn closest(cell: &Cell, metal: &Metal, z: f64) -> Vec<Closest> {
    let job = Job::bead(cell.clone(), z);
    let task = job.task(Rotation::Free);
    let held = hold(&task, &Silent).unwrap();
    sweep(&task, &held, &job.around(&|_| metal), EVERYTHING).unwrap()
}

/// Distances below this are found exactly, mm: all that are told.
const EVERYTHING: f64 = 1e4;

fn of(found: &[Closest], bodies: [Body; 2]) -> f64 {
    let pair = found.iter().find(|c| c.bodies == bodies);
    pair.unwrap_or_else(|| panic!("{bodies:?} is not among {found:?}"))
        .distance
}

/// What exact distances may be less than they are, mm.
const RESERVED: f64 = 0.1;

#[test]
fn the_nozzle_stands_its_wire_over_the_plate() {
    let found = closest(&abb(), &plate(1e9, 0.0), 0.0);
    let least = of(&found, [Body::Nozzle, Body::Metal]);
    assert!(least <= 15.0 && least > 15.0 - RESERVED - 1e-6, "{least}");
    // the table lies 20 mm lower
    let table = of(&found, [Body::Nozzle, Body::Table]);
    assert!((table - least - 20.0).abs() < 1e-6, "{table} {least}");
    assert_eq!(found[0].bodies, [Body::Nozzle, Body::Metal]);
}

/// Beside a wall higher than the torch the nozzle is nearest by its radius, the body by its own.
#[test]
fn a_forearm_that_goes_on_behind_the_fourth_axis_is_held_against_the_torch() {
    let text = find(robots::ALL, "universal-ur10e").unwrap().text;
    let slim = cell::read(text).unwrap();
    let of_link_4 = |cell: &Cell| {
        of(
            &closest(cell, &plate(190.0, 1.0), 0.0),
            [Body::Torch, Body::Link(4)],
        )
    };
    let room = of_link_4(&slim);
    let mut thick = slim.clone();
    let shapes = thick.shapes.as_mut().unwrap();
    let Links::Bars(radii) = &mut shapes.links else {
        panic!("{:?}", shapes.links);
    };
    radii[3] += 20.0;
    let less = of_link_4(&thick);
    assert!(less < room - 10.0, "{room} {less}");
}

#[test]
fn a_wall_beside_the_torch_is_measured_to_its_radius() {
    let found = closest(&abb(), &plate(30.0, 100.0), 0.0);
    let nozzle = of(&found, [Body::Nozzle, Body::Metal]);
    assert!(
        nozzle > 15.0 - RESERVED - 1e-6 && nozzle <= 15.0,
        "{nozzle}"
    );
    let found = closest(&abb(), &plate(26.0, 100.0), 0.0);
    let nozzle = of(&found, [Body::Nozzle, Body::Metal]);
    // rods stand for the round nozzle: they stand out of its side
    let out = 0.063 * 12.0;
    assert!(
        nozzle > 14.0 - out - RESERVED && nozzle < 14.0 + 1e-6,
        "{nozzle}"
    );
    // a wall as high as the torch meets its body, which is thicker
    let found = closest(&abb(), &plate(26.0, 250.0), 0.0);
    let torch = of(&found, [Body::Torch, Body::Metal]);
    assert!(
        torch > 6.0 - RESERVED - 1e-6 && torch <= 6.0 + 1e-6,
        "{torch}"
    );
}

#[test]
fn multiaxis_ma9_a_collision_is_told_with_the_bodies_and_the_place() {
    let metal = {
        let corner = DVec2::splat(200.0);
        let mut map = HeightMap::new(-corner, corner, 1.0, 0.0).unwrap();
        let post = map.cell_at(DVec2::new(8.0, 20.0)).unwrap();
        let i = map.index(post.0, post.1);
        map.z[i] = 60.0;
        Metal::of(&map, 1.0)
    };
    let found = closest(&abb(), &metal, 0.0);
    let worst = found[0];
    assert_eq!(worst.bodies, [Body::Nozzle, Body::Metal]);
    assert!(worst.distance < 0.0, "{worst:?}");
    assert!((worst.position.y - 20.0).abs() < 15.0, "{worst:?}");
    // high over the post nothing touches
    assert!(closest(&abb(), &metal, 100.0)[0].distance > 0.0);
}

/// A plate of 600 mm with metal of 260 mm wherever `stands` says so.
fn walls(stands: impl Fn(DVec2) -> bool) -> Metal {
    let corner = DVec2::splat(300.0);
    let mut map = HeightMap::new(-corner, corner, 2.0, 0.0).unwrap();
    for iy in 0..map.ny {
        for ix in 0..map.nx {
            if stands(map.centre(ix, iy)) {
                let i = map.index(ix, iy);
                map.z[i] = 260.0;
            }
        }
    }
    Metal::of(&map, 2.0)
}

/// A post where the torch leans over in the best way: another way is found that keeps clear of it. Between walls all around there is none.
#[test]
fn multiaxis_ma9_a_way_that_hits_is_changed_where_there_is_another() {
    let job = Job::bead(leaning(), 0.0);
    let (cell, start) = (&job.cell, job.start);
    let task = job.task(Rotation::Free);
    let best = hold(&task, &Silent).unwrap();
    let values = Values {
        arm: best.chains[0].joints,
        ..Values::default()
    };
    let frames = cell.frames(&values);
    let flange = frames.part.inverse().then(frames.flange).position;
    let over = (flange - start.position).truncate().normalize();
    let one = walls(|p| p.distance(110.0 * over) < 40.0);
    let ring = walls(|p| p.x.abs() > 60.0 || p.y.abs() > 110.0);
    for (metal, found) in [(one, Clearance::Kept), (ring, Clearance::InVain)] {
        let at = |_| &metal;
        let around = job.around(&at);
        let first = sweep(&task, &best, &around, 3.0).unwrap()[0];
        assert!(first.distance < 0.0, "{first:?}");
        let cleared = hold_clear(&task, &around, 3.0, &Silent).unwrap();
        assert_eq!(cleared.found, found);
        let now = sweep(&task, &cleared.held, &around, 3.0).unwrap()[0];
        println!(
            "{found:?}: {:.1} mm, {:.1} mm before",
            now.distance, first.distance
        );
        assert_eq!(now.distance >= 3.0, found == Clearance::Kept, "{now:?}");
        // only the way is another: the wire goes where it went
        assert_eq!(cleared.held.chains[0].legs, best.chains[0].legs);
    }
    // where any room will do the way is that of the search without it
    let clear = walls(|_| false);
    let cleared = hold_clear(&task, &job.around(&|_| &clear), -1e3, &Silent);
    assert_eq!(cleared.unwrap().held, best);
}
