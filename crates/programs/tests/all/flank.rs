//! Beads on flanks of what was built: travels stay beyond the metal along the torch, and go over the top only from flank to flank.

use meltpath_base::Reporter;
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{ArcAction, Coordinates, Instruction, PositionRef, Program};
use meltpath_programs::{BuildSettings, Pause, Restart, build};
use meltpath_toolpath::{Layer, Role, Toolpath};

use crate::built::{head, settings, toolpath};

const FEED: f64 = 400.0 / 3.0;
/// Out of the second boss, 11° upwards.
const LEAN: DVec3 = DVec3::new(0.98, 0.0, 0.198_997_487_421_323_99);

/// A layer of two beads from and to places, under one axis.
fn layer(number: u32, beads: [[DVec3; 2]; 2], axis: DVec3) -> Layer {
    let mut layer = Layer::new(number, 0.0);
    for (k, [from, to]) in (0..).zip(beads) {
        let mut pass = layer.begin(head(2 * number + k, Role::Fill), from);
        pass.axis(axis).line_to(to).axis(axis);
    }
    layer
}

/// Two layers of a trunk 40 wide and 50 high, two of a boss out of its flank, two of another above that, one on the opposite flank.
fn plan() -> Toolpath {
    let flat = |z: f64| [-10.0, 10.0].map(|y| [-20.0, 20.0].map(|x| DVec3::new(x, y, z)));
    let flank = |x: f64, z: f64| [0.0, 5.0].map(|up| [-8.0, 8.0].map(|y| DVec3::new(x, y, z + up)));
    let layers = vec![
        layer(1, flat(48.0), DVec3::Z),
        layer(2, flat(50.0), DVec3::Z),
        layer(3, flank(22.0, 10.0), DVec3::X),
        layer(4, flank(24.0, 10.0), DVec3::X),
        layer(5, flank(22.0, 30.0), LEAN),
        layer(6, flank(-22.0, 20.0), DVec3::NEG_X),
    ];
    toolpath(FEED, layers)
}

/// Ends of moves in their order, with whether the arc burns on the way there.
fn ends(programs: &[Program]) -> Vec<(DVec3, bool)> {
    let (mut burns, mut found) = (false, Vec::new());
    for program in programs {
        for instruction in &program.instructions {
            let Instruction::Motion(motion) = instruction else {
                continue;
            };
            let PositionRef::Point { index, .. } = motion.target else {
                continue;
            };
            let position = program.positions.iter().find(|p| p.index == index).unwrap();
            let Coordinates::Cartesian { xyz, .. } = position.groups[0].coordinates else {
                continue;
            };
            found.push((DVec3::from_array(xyz), burns));
            if let Some(arc) = &motion.arc {
                burns = arc.action == ArcAction::Start;
            }
        }
    }
    found
}

fn built(from: Option<Restart>) -> Vec<(DVec3, bool)> {
    let cell = crate::dialects::cell(&[FEED]);
    let settings = BuildSettings {
        from,
        ..settings(Pause::None)
    };
    let built = build(&plan(), &cell, &settings, &Reporter::new()).unwrap();
    ends(&built.programs)
}

/// The ends of moves without arc between two beads, each by one of its ends.
fn between(ends: &[(DVec3, bool)], from: DVec3, to: DVec3) -> Vec<DVec3> {
    let is = |p: DVec3| move |e: &(DVec3, bool)| e.0.distance(p) < 1e-6;
    let begin = ends.iter().position(is(from)).unwrap();
    let end = begin + ends[begin..].iter().position(is(to)).unwrap();
    ends[begin + 1..end].iter().map(|e| e.0).collect()
}

#[test]
fn travels_on_a_flank_stay_beyond_its_metal() {
    let ends = built(None);
    let clearance = crate::dialects::cell(&[FEED]).clearance.0;
    // the boss's own beads, 2 mm higher than their paths
    let out = 24.0 + 2.0 + clearance;
    let on_flank = between(
        &ends,
        DVec3::new(24.0, 8.0, 10.0),
        DVec3::new(24.0, -8.0, 15.0),
    );
    assert!(on_flank.len() >= 2);
    for p in &on_flank {
        assert!(p.x >= out - 1e-6, "{p} {out}");
        assert!((10.0..=15.0).contains(&p.z), "up and over for a flank: {p}");
    }
    // straight back along the torch, and straight in
    assert_eq!((on_flank[0].y, on_flank[0].z), (8.0, 10.0));
    let last = on_flank.last().unwrap();
    assert_eq!((last.y, last.z), (-8.0, 15.0));
    // to the other boss above, whose torch leans by another 11 degrees: beyond all along its own
    let above = between(
        &ends,
        DVec3::new(24.0, 8.0, 15.0),
        DVec3::new(22.0, -8.0, 30.0),
    );
    let [back, up, down] = above[..] else {
        panic!("{above:?}");
    };
    assert!(back.x >= out - 1e-6);
    let reach = |p: DVec3| p.dot(LEAN);
    assert!((reach(up) - reach(down)).abs() < 0.01, "{above:?}");
    assert!(reach(down) >= reach(DVec3::new(24.0, 8.0, 35.0)) + clearance);
}

#[test]
fn from_flank_to_flank_the_way_leads_over_the_top() {
    let ends = built(None);
    let clear = 50.0 + 2.0 + crate::dialects::cell(&[FEED]).clearance.0;
    for (from, to) in [
        (DVec3::new(20.0, 10.0, 50.0), DVec3::new(22.0, -8.0, 10.0)),
        (DVec3::new(22.0, 8.0, 35.0), DVec3::new(-22.0, -8.0, 20.0)),
    ] {
        let way = between(&ends, from, to);
        let mut here = from;
        for next in way.iter().copied().chain([to]) {
            // over the trunk with room, never through it
            let samples = (0..=50).map(|i| here.lerp(next, f64::from(i) / 50.0));
            // a bead ends at the trunk's edge, and the way up begins there
            let within = |p: &DVec3| p.x.abs() < 20.0 - 1e-6 && p.y.abs() < 10.0 - 1e-6;
            let inside = |p: &DVec3| within(p) && p.z < clear - 1e-6;
            let cut = samples.skip(1).find(inside);
            assert_eq!(cut, None, "{here} {next}");
            here = next;
        }
        let last = way.last().unwrap();
        assert_eq!(
            (last.y, last.z),
            (to.y, to.z),
            "straight in along the torch"
        );
        assert!(last.x.abs() > 22.0 + 2.0);
    }
}

/// A restart on a flank knows what stands.
#[test]
fn a_restart_on_a_flank_comes_in_from_beyond_what_stands() {
    let from = Restart { layer: 3, bead: 2 };
    let whole = built(None);
    let part = built(Some(from));
    let start = DVec3::new(22.0, -8.0, 15.0);
    let at = |ends: &[(DVec3, bool)]| {
        ends.iter()
            .position(|e| e.0.distance(start) < 1e-6)
            .unwrap()
    };
    assert_eq!(part[at(&part) - 1], whole[at(&whole) - 1]);
}
