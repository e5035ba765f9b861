//! Between the places of a way: what is told against the same way in steps a thousand times finer, and what is met on the way only.

use meltpath_geometry::math::DQuat;
use meltpath_numerics::random::Random;
use meltpath_robot::Kind;

use super::*;

/// The distance of two lines, mm: that of the points of one from the other is convex.
fn lines_apart(p: [DVec3; 2], [a, b]: [DVec3; 2]) -> f64 {
    nearest(|s| {
        let from = p[0].lerp(p[1], s) - a;
        let along = (from.dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        from.distance(along * (b - a))
    })
}

/// The least of a convex function between 0 and 1, by thirds.
fn nearest(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
        if f(a) < f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    f(0.5 * (low + high)).min(f(0.0)).min(f(1.0))
}

/// Distances of the torch's body from the forearm and from the post, mm, as the drawing has them.
fn drawn(job: &Job, joints: [f64; 6], post: DVec3) -> [f64; 2] {
    let shapes = job.cell.shapes.as_ref().unwrap();
    let frames = job.cell.frames(&Values {
        arm: joints,
        ..Values::default()
    });
    let torch = [
        frames.torch.point(-shapes.nozzle[0] * DVec3::Z),
        frames.flange.position,
    ];
    let third = job.cell.arm.chain.frames(&joints)[2];
    let end = job.cell.arm.chain.joints[3].parent_from_joint.position;
    let Links::Bars(radii) = &shapes.links else {
        panic!("{:?}", shapes.links);
    };
    let [link, body] = [radii[2], shapes.torch];
    let forearm = [
        frames.base.then(third).position,
        frames
            .base
            .then(third)
            .point(end - end.clamp_length_max(link)),
    ];
    let in_part = torch.map(|p| frames.part.inverse().point(p));
    let to_post = nearest(|s| {
        let p = in_part[0].lerp(in_part[1], s);
        let aside = (p - post).truncate().abs() - DVec2::splat(0.5);
        let aside = aside.max(DVec2::ZERO);
        aside.extend((p.z - post.z).max(0.0)).length()
    });
    [lines_apart(torch, forearm) - link - body, to_post - body]
}

/// A column of 1 mm x 1 mm up to `top`, somewhere on a plate far below the torch.
fn post(top: DVec3) -> Metal {
    let corner = DVec2::splat(200.0);
    let mut map = HeightMap::new(-corner, corner, 1.0, -1e4).unwrap();
    let (x, y) = map.cell_at(top.truncate()).unwrap();
    let i = map.index(x, y);
    map.z[i] = top.z;
    Metal::of(&map, 1.0)
}

/// A short travel on which the torch turns far about its wire, as long ones are told by a controller that turns it on the way.
fn travel(random: &mut Random) -> Job {
    let mut tip = || {
        let position = DVec3::new(
            random.between(-60.0, 60.0),
            random.between(-60.0, 60.0),
            random.between(0.0, 40.0),
        );
        (position, random.between(-PI, PI))
    };
    let ((from, turn), (to, _)) = (tip(), tip());
    let further = turn + random.between(-1.5, 1.5);
    let down = DQuat::from_rotation_x(PI);
    let at = |turn: f64| down * DQuat::from_rotation_z(turn);
    let start = Pose {
        position: from,
        orientation: at(turn),
    };
    Job {
        cell: leaning(),
        start,
        commands: vec![Command {
            orientation: at(further),
            ..Command::line(0, from.lerp(to, 0.3), 100.0, Smoothing::Fine)
        }],
        configurations: BTreeMap::new(),
    }
}

/// Places along a travel: a thousand times as many as it is followed at.
const PLACES: u32 = 20_000;

/// What is told of travels on which the arm goes far between two places is what a thousand times as many places tell: never more,
/// and less by 0.1 mm at most where it is looked at, whether the pair touches or not.
#[test]
fn distances_are_those_of_many_more_places() {
    let mut random = Random::new(5);
    let (mut tried, mut touching, mut spared) = (0, 0, 0);
    while tried < 12 {
        let job = travel(&mut random);
        let task = job.task(Rotation::Written);
        let Ok(held) = hold(&task, &Silent) else {
            continue;
        };
        tried += 1;
        let (from, to) = (job.start, &job.commands[0]);
        // beside the torch, half-way up its body
        let aside = DVec3::new(
            random.between(-150.0, 150.0),
            random.between(-150.0, 150.0),
            140.0,
        );
        let top = (from.position + aside).floor() + DVec3::new(0.5, 0.5, 0.0);
        let metal = post(top);
        let at = |_| &metal;
        // columns go down to the underside of the plate, which is to be far below
        let around = Surroundings {
            plate: 1e4,
            ..job.around(&at)
        };
        let mut joints = held.chains[0].joints;
        let mut wanted = [f64::INFINITY; 2];
        for i in 0..=PLACES {
            let share = f64::from(i) / f64::from(PLACES);
            let tip = Pose {
                position: from.position.lerp(to.target, share),
                orientation: from.orientation.slerp(to.orientation, share),
            };
            let flange = job.cell.base_from_flange(tip, &Values::default());
            joints = job.cell.arm.nearest(flange, &joints).unwrap();
            let drawn = drawn(&job, joints, top);
            wanted = [0, 1].map(|i| drawn[i].min(wanted[i]));
        }
        let exact = sweep(&task, &held, &around, EVERYTHING).unwrap();
        let coarse = sweep(&task, &held, &around, 0.0).unwrap();
        let pairs = [[Body::Torch, Body::Link(3)], [Body::Torch, Body::Metal]];
        for (pair, wanted) in pairs.into_iter().zip(wanted) {
            let (told, rough) = (of(&exact, pair), of(&coarse, pair));
            println!("{pair:?}: {wanted:.3} mm, told {told:.3}, {rough:.3} where no more is asked");
            // places leave this much open
            assert!(told <= wanted + 1e-6, "{pair:?} {told} {wanted}");
            assert!(told >= wanted - RESERVED - 0.02, "{pair:?} {told} {wanted}");
            assert!(rough <= wanted + 1e-6, "{pair:?} {rough} {wanted}");
            // what is clear is told with four fifths of its room at least
            assert!(rough >= told.min(0.8 * wanted), "{pair:?} {rough} {told}");
            touching += u32::from(told < 0.0);
            spared += u32::from(rough < told);
        }
    }
    assert!(touching > 2 && spared > 2, "{touching} {spared}");
}

/// A post that the torch meets between two programmed places and at neither of them, in a move of the joints.
#[test]
fn a_joint_move_is_followed_in_the_joints() {
    let cell = abb();
    let tip = |y: f64| DVec3::new(0.0, y, 10.0);
    let joint = |id, y| Command {
        kind: Kind::Joint(None),
        ..Command::line(id, tip(y), 100.0, Smoothing::Fine)
    };
    let line = |id, y| Command::line(id, tip(y), 100.0, Smoothing::Fine);
    let job = Job {
        start: Pose::from_wpr(tip(-150.0), DVec3::new(PI, 0.0, 0.0)),
        commands: vec![line(0, -140.0), joint(1, 140.0), line(2, 150.0)],
        configurations: BTreeMap::new(),
        cell,
    };
    let task = job.task(Rotation::Written);
    let held = hold(&task, &Silent).unwrap();
    assert_eq!(held.chains.len(), 2);
    // half-way the tip lies beside the straight line between the ends
    let [a, b] = [job.commands[0].target, job.commands[1].target];
    let joints = |run: usize, end: bool| {
        let mut follower = Follower::new(&task, &held.chains[run]);
        let mut joints = held.chains[run].joints;
        while end && let Some(sample) = follower.next_sample().unwrap() {
            joints = sample.joints;
        }
        joints
    };
    let (from, to) = (joints(0, true), joints(1, false));
    let middle = job.cell.frames(&Values {
        arm: std::array::from_fn(|i| 0.5 * (from[i] + to[i])),
        ..Values::default()
    });
    let tip = middle.part_from_wire_tip().position;
    println!("the tip passes {tip:.1}");
    assert!(tip.distance(a.midpoint(b)) > 5.0);
    let met = post(tip + 30.0 * DVec3::Z);
    let at = |_| &met;
    let around = job.around(&at);
    let worst = sweep(&task, &held, &around, 2.0).unwrap()[0];
    assert_eq!(worst.bodies, [Body::Nozzle, Body::Metal], "{worst:?}");
    assert!(worst.distance < 0.0 && worst.command == 1, "{worst:?}");
    // its ends alone do not tell of it
    for run in 0..2 {
        let alone = Held {
            chains: vec![held.chains[run].clone()],
            margins: held.margins,
        };
        assert!(sweep(&task, &alone, &around, 2.0).unwrap()[0].distance > 2.0);
    }
}
