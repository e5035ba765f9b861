//! Axes along the real motion: bounded between samples, told with place, and followed where the arm changes its way.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

use meltpath_base::{Silent, settings};
use meltpath_data::{cells, find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_robot::cell::{self, Cell, Stance, Values};
use meltpath_robot::driven::{Driven, drive};
use meltpath_robot::interpolation::fir::simulate;
use meltpath_robot::posture::{Axes, Because, Rotation, Task, Why, changes, hold};
use meltpath_robot::travel::least_time;
use meltpath_robot::{Command, Controller, Smoothing, Source};
use meltpath_toolpath::{MotionBlock, Weave, WeaveShape};

static ANY: BTreeMap<Option<u32>, Stance> = BTreeMap::new();

fn controller() -> Controller {
    settings::peek(cells::ARCMATE_120IC.text, &["motion"])
        .unwrap()
        .unwrap()
}

fn arcmate() -> Cell {
    let text = find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text;
    let mut cell = cell::read(text).unwrap();
    for joint in &mut cell.arm.chain.joints {
        joint.limits.acceleration = Some(10.0);
    }
    cell
}

fn down(position: DVec3) -> Pose {
    Pose::from_wpr(position, DVec3::new(PI, 0.0, 0.0))
}

fn line(id: u32, to: DVec3, speed: f64, source: Source) -> Command {
    Command {
        source,
        orientation: down(to).orientation,
        ..Command::line(id, to, speed, Smoothing::Cnt(0.5))
    }
}

pub(crate) fn task<'a>(cell: &'a Cell, start: Pose, commands: &'a [Command]) -> Task<'a> {
    Task {
        cell,
        values: cell.at_rest(),
        axes: Axes::Standing,
        start,
        commands,
        rotation: Rotation::Written,
        configurations: &ANY,
    }
}

const ON: Source = Source::On { wire_feed: 130.0 };

/// A square of 40 mm at a speed.
fn square(at: DVec3, speed: f64) -> (Pose, Vec<Command>) {
    let corners = [
        (0.0, 0.0),
        (40.0, 0.0),
        (40.0, 40.0),
        (0.0, 40.0),
        (0.0, 0.0),
    ];
    let points = corners.map(|(x, y)| at + DVec3::new(x, y, 0.0));
    let lines = points[1..].iter().zip(0..);
    let commands = lines.map(|(p, id)| line(id, *p, speed, ON)).collect();
    (down(points[0]), commands)
}

fn driven(cell: &Cell, (start, commands): &(Pose, Vec<Command>)) -> Driven {
    let task = task(cell, *start, commands);
    let held = hold(&task, &Silent).unwrap();
    drive(&task, &held, &[], &controller(), (&[], &[]), &Silent).unwrap()
}

/// A weave turns round corners as the motion does: what the joints do there is a few times what the swing asks for on straight lines, and no
/// jump of the tip from one side to the other.
#[test]
fn a_weave_asks_for_no_jump_at_corners() {
    let cell = arcmate();
    let weave = Weave {
        shape: WeaveShape::Sine,
        frequency: 2.0,
        amplitude: 2.0,
        dwell: [0.0; 2],
    };
    let at = DVec3::new(-100.0, 150.0, 0.0);
    let (start, commands) = square(at, 10.0);
    let of = |commands: &[Command]| {
        let task = task(&cell, start, commands);
        let held = hold(&task, &Silent).unwrap();
        let on = vec![1; commands.len()];
        let weaves = (std::slice::from_ref(&weave), &on[..]);
        let found = drive(&task, &held, &[], &controller(), weaves, &Silent).unwrap();
        assert!(found.lost.is_none(), "{:?}", found.lost);
        (found.acceleration.unwrap().most.value, found.beyond)
    };
    let straight = of(&commands[..1]);
    let corners = of(&commands);
    println!("{straight:?} {corners:?}");
    assert!(corners.0 < 4.0 * straight.0, "{corners:?} {straight:?}");
    assert!(corners.0 < 0.5 && corners.1 == 0.0, "{corners:?}");
}

/// What is bounded between samples 4 ms apart is no less than what samples a sixteenth as far apart show, and little more.
#[test]
fn what_happens_between_samples_is_bounded() {
    let (cell, controller) = (arcmate(), controller());
    let moves = square(DVec3::new(-100.0, 150.0, 0.0), 30.0);
    let found = driven(&cell, &moves);
    assert!(found.lost.is_none() && found.beyond == 0.0 && found.untold == [false; 9]);
    let mut blocks: Vec<MotionBlock> = Vec::new();
    let dt = controller.period.value.0 / 48.0;
    simulate(moves.0, &moves.1, &controller, dt, &Silent, &mut blocks).unwrap();
    let mut joints = held_joints(&cell, &moves);
    let mut row: Vec<[f64; 6]> = Vec::new();
    for position in blocks.iter().flat_map(|b| &b.position) {
        let flange = cell.base_from_flange(down(*position), &cell.at_rest());
        joints = cell.arm.nearest(flange, &joints).unwrap();
        row.push(cell.arm.shown(joints));
    }
    let share = |step: usize, of: &dyn Fn(usize, usize) -> f64| {
        let all = (step..row.len()).flat_map(|n| (0..6).map(move |i| (n, i)));
        all.map(|(n, i)| of(n, i)).fold(0.0, f64::max)
    };
    let limit = |i: usize| cell.arm.chain.joints[i].limits;
    let speed = share(1, &|n, i| {
        (row[n][i] - row[n - 1][i]).abs() / dt / limit(i).speed.unwrap()
    });
    // over four fine steps: second differences of less are rounding
    let acceleration = share(8, &|n, i| {
        let second = row[n][i] - 2.0 * row[n - 4][i] + row[n - 8][i];
        second.abs() / (16.0 * dt * dt) / limit(i).acceleration.unwrap()
    });
    let told = [found.speed.unwrap(), found.acceleration.unwrap()];
    println!("{speed} {acceleration} {told:?}");
    for (peak, fine) in told.iter().zip([speed, acceleration]) {
        let ratio = peak.most.value / fine;
        assert!((1.0 - 1e-6..1.005).contains(&ratio), "{ratio}");
    }
    assert!(told[1].most.position.distance(told[0].most.position) < 60.0);
}

fn held_joints(cell: &Cell, (start, commands): &(Pose, Vec<Command>)) -> [f64; 6] {
    let task = task(cell, *start, commands);
    hold(&task, &Silent).unwrap().chains[0].joints
}

/// Accelerations at corners grow with the speed; an axis that is too weak is told with the length of the beads, one without a figure as such.
#[test]
fn a_weak_axis_is_told_with_its_place() {
    let at = DVec3::new(-100.0, 150.0, 0.0);
    let share = |speed: f64, cell: &Cell| driven(cell, &square(at, speed));
    let mut cell = arcmate();
    let peak = |d: &Driven| d.acceleration.unwrap().most.value;
    let [slow, fast] = [10.0, 20.0].map(|speed| peak(&share(speed, &cell)));
    assert!((fast / slow - 2.0).abs() < 0.05, "{slow} {fast}");
    for joint in &mut cell.arm.chain.joints {
        joint.limits.acceleration = Some(10.0 * slow / 2.0);
    }
    cell.arm.chain.joints[4].limits.acceleration = None;
    let weak = share(10.0, &cell);
    let found = weak.acceleration.unwrap().most;
    assert!(
        found.value > 1.0 && weak.beyond > 0.0 && weak.beyond < 160.0,
        "{weak:?}"
    );
    let corner = [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)]
        .map(|(x, y)| found.position.distance(at + DVec3::new(x, y, 0.0)));
    assert!(corner.iter().any(|d| *d < 5.0), "{found:?}");
    assert_eq!(weak.untold.iter().filter(|u| **u).count(), 1);
    assert!(weak.untold[4]);
}

/// The positioner's axes pass the averages in step with the tool: a table that is slow is the axis that is told.
#[test]
fn a_table_that_turns_counts() {
    let mut cell = arcmate();
    let at = DVec3::new(-100.0, 0.0, 0.0);
    let commands = vec![line(0, at + DVec3::X * 60.0, 10.0, ON)];
    let ends = [meltpath_robot::cell::External([0.0, 0.0, 0.6])];
    let start = meltpath_robot::cell::External::default();
    // 0.6 rad in 6 s
    cell.positioner.as_mut().unwrap().joints[1].limits.speed = Some(0.08);
    let task = Task {
        axes: Axes::Written { start, ends: &ends },
        ..task(&cell, down(at), &commands)
    };
    let held = hold(&task, &Silent).unwrap();
    let found = drive(&task, &held, &[], &controller(), (&[], &[]), &Silent).unwrap();
    let speed = found.speed.unwrap().most;
    assert_eq!(speed.joint, 8);
    assert!((speed.value - 0.1 / 0.08).abs() < 1e-3, "{speed:?}");
    assert!(found.untold[8] && !found.untold[0]);
}

#[test]
fn the_least_time_is_a_trapezoid() {
    let mut cell = arcmate();
    let limits = &mut cell.arm.chain.joints[0].limits;
    (limits.speed, limits.acceleration) = (Some(1.0), Some(2.0));
    let at = |turn: f64| Values {
        arm: [turn, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..cell.at_rest()
    };
    let time = |places: &[f64], rests| {
        let places: Vec<Values> = places.iter().map(|p| at(*p)).collect();
        least_time(&cell, &places, rests, 1.0).unwrap()
    };
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    // up to speed, along, down; too short for the speed; from full speed
    close(time(&[0.0, 1.0], [true, true]).time, 1.5);
    close(
        time(&[0.0, 0.25], [true, true]).time,
        2.0 * 0.125_f64.sqrt(),
    );
    close(time(&[0.0, 1.0], [false, true]).time, 1.25);
    close(time(&[0.0, 1.0], [false, false]).time, 1.0);
    // in pieces it is the same
    close(time(&[0.0, 0.1, 0.3, 0.35, 1.0], [true, true]).time, 1.5);
    assert!(time(&[0.0, 1.0], [true, true]).accelerated);
    assert!(least_time(&cell, &[at(0.0); 2], [true, true], 1.0).is_none());
    cell.arm.chain.joints[0].limits.acceleration = None;
    let places = [0.0, 1.0].map(|turn| Values {
        arm: [turn, 0.0, 0.0, 0.0, 0.0, 0.0],
        ..cell.at_rest()
    });
    let found = least_time(&cell, &places, [true, true], 0.5).unwrap();
    close(found.time, 2.0);
    assert!(!found.accelerated && found.axis == 0);
}

/// Two beads behind the robot, one on each side of where its first joint ends: the travel between them is where it goes over.
#[test]
fn the_arm_goes_over_where_no_way_holds_both_sides() {
    let mut cell = arcmate();
    // something behind its second axis keeps it from going over its own head
    cell.arm.chain.joints[1].limits.low = (-10.0_f64).to_radians();
    let frames = cell.frames(&cell.at_rest());
    let part_from_base = frames.part.inverse().then(frames.base);
    let at = |x: f64, y: f64, z: f64| part_from_base.point(DVec3::new(x, y, z + 500.0));
    let points = [
        (at(-950.0, 350.0, 0.0), ON),
        (at(-950.0, 350.0, 60.0), Source::Off),
        (at(-950.0, -350.0, 60.0), Source::Off),
        (at(-950.0, -350.0, 0.0), Source::Off),
        (at(-1050.0, -350.0, 0.0), ON),
    ];
    let commands: Vec<Command> = (0..)
        .zip(points)
        .map(|(id, (to, source))| line(id, to, 20.0, source))
        .collect();
    let task = Task {
        rotation: Rotation::Free,
        ..task(&cell, down(at(-1050.0, 350.0, 0.0)), &commands)
    };
    assert!(hold(&task, &Silent).is_err());
    let found = changes(&task, &BTreeSet::from([2]), &Silent).unwrap();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].command, 2);
    assert!(matches!(found[0].why, Because::NotHeld(not) if not.why != Why::Stopped));
    // a table that hardly turns does not help
    let mut tilting = cell.clone();
    for joint in &mut tilting.positioner.as_mut().unwrap().joints {
        (joint.limits.low, joint.limits.high) = (-0.01, 0.01);
    }
    let free = Task {
        cell: &tilting,
        axes: Axes::Free,
        ..task
    };
    let with_table = changes(&free, &BTreeSet::from([2]), &Silent).unwrap();
    assert_eq!(with_table.len(), 1, "{with_table:?}");
    assert_eq!(with_table[0].command, 2);
    // without a travel to go over the place is told as before
    let not = changes(&task, &BTreeSet::new(), &Silent).unwrap_err();
    assert_eq!(not, hold(&task, &Silent).unwrap_err());
}

/// An arm with its torch straight under the flange goes past its first axis, which cannot keep up: at the place y of a line that keeps r from the
/// axis the tip reaches ω (r² + y²) / r, and the line takes longer by 2 atan(y₀ / r) / ω - 2 y₀ / v up to where ω (r² + y₀²) / r = v.
#[test]
fn a_slow_axis_slows_the_tip_down_to_what_it_can() {
    let text = find(robots::ALL, "kuka-kr16-r2010-2").unwrap().text;
    let (arm, _) = text.split_once("\n[torch]").unwrap();
    let text = format!(
        "{arm}\n[torch]\nposition = [\"0 mm\", \"0 mm\", \"330 mm\"]\nwire = \"15 mm\"\n\
         [table]\nposition = [\"800 mm\", \"0 mm\", \"300 mm\"]\n"
    );
    let mut cell = cell::read(&text).unwrap();
    let (r, v, omega) = (800.0_f64, 12.5_f64, 8.5 / 800.0);
    cell.arm.chain.joints[0].limits.speed = Some(omega);
    let at = |y: f64| DVec3::new(0.0, y, 0.0);
    let moves = (down(at(-600.0)), vec![line(0, at(600.0), v, ON)]);
    let found = driven(&cell, &moves);
    let y0 = (r * v / omega - r * r).sqrt();
    let wanted = 2.0 * (y0 / r).atan() / omega - 2.0 * y0 / v;
    assert!(
        (found.pacing.delay() - wanted).abs() < 2e-3 * wanted,
        "{found:?}"
    );
    assert!((found.slowed - 2.0 * y0).abs() < 1.0, "{}", found.slowed);
    let slowest = found.slowest.unwrap();
    assert_eq!(slowest.at.joint, 0);
    let tip = slowest.at.value * slowest.speed;
    assert!((tip - omega * r).abs() < 1e-3, "{slowest:?}");
    assert!(slowest.at.position.y.abs() < 1.0);
    let peak = found.speed.unwrap();
    assert!((peak.rate * peak.most.value - 1.0).abs() < 1e-6, "{peak:?}");

    let mut blocks: Vec<MotionBlock> = Vec::new();
    let controller = controller();
    let dt = controller.sampling();
    let mut paced = found.pacing.before(&mut blocks);
    let own = simulate(moves.0, &moves.1, &controller, dt, &Silent, &mut paced).unwrap();
    let summary = found.pacing.summary(own.clone(), &moves.1);
    let fed: f64 = blocks.iter().flat_map(|b| &b.wire).sum();
    assert!((fed / summary.wire - 1.0).abs() < 1e-9);
    assert!((summary.wire / (130.0 * summary.arc_time) - 1.0).abs() < 1e-12);
    assert!((summary.arc_time - own.arc_time - wanted).abs() < 2e-3 * wanted);
    let mut before: Option<(f64, DVec3)> = None;
    for (i, block) in blocks
        .iter()
        .flat_map(|b| (0..b.len()).map(move |i| (i, b)))
    {
        let here = (block.time(i), block.position[i]);
        if let Some((time, from)) = before.replace(here)
            && here.1.y.abs() < 590.0
        {
            let y = 0.5 * (from.y + here.1.y);
            let wanted = (omega * (r * r + y * y) / r).min(v);
            let speed = from.distance(here.1) / (here.0 - time);
            assert!((speed / wanted - 1.0).abs() < 2e-3, "{y} {speed} {wanted}");
        }
    }
}

/// On the motion at its pace no joint goes or speeds up faster than it can, at corners where its own pace asks for twice that.
#[test]
fn axes_keep_their_accelerations_at_corners() {
    let (mut cell, controller) = (arcmate(), controller());
    let moves = square(DVec3::new(-100.0, 150.0, 0.0), 20.0);
    let own = driven(&cell, &moves).acceleration.unwrap().most.value;
    for joint in &mut cell.arm.chain.joints {
        joint.limits.acceleration = Some(10.0 * own / 2.0);
    }
    let found = driven(&cell, &moves);
    let peak = found.acceleration.unwrap();
    assert!(
        (peak.most.value - 2.0).abs() < 0.01 && peak.rate < 0.8,
        "{peak:?}"
    );
    let mut blocks: Vec<MotionBlock> = Vec::new();
    let mut paced = found.pacing.before(&mut blocks);
    simulate(
        moves.0,
        &moves.1,
        &controller,
        controller.sampling(),
        &Silent,
        &mut paced,
    )
    .unwrap();
    let mut joints = held_joints(&cell, &moves);
    let mut row: Vec<(f64, [f64; 6])> = Vec::new();
    for block in &blocks {
        for (i, position) in block.position.iter().enumerate() {
            let flange = cell.base_from_flange(down(*position), &cell.at_rest());
            joints = cell.arm.nearest(flange, &joints).unwrap();
            row.push((block.time(i), cell.arm.shown(joints)));
        }
    }
    let mut hardest = 0.0_f64;
    for at in row.windows(9) {
        let [a, b, c] = [at[0], at[4], at[8]];
        for i in 0..6 {
            let [early, late] = [(a, b), (b, c)].map(|(p, q)| (q.1[i] - p.1[i]) / (q.0 - p.0));
            let limit = cell.arm.chain.joints[i].limits.acceleration.unwrap();
            hardest = hardest.max(2.0 * (late - early).abs() / (c.0 - a.0) / limit);
        }
    }
    println!("{hardest}");
    assert!((0.95..1.005).contains(&hardest), "{hardest}");
}
