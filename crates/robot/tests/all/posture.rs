//! Programs held by arms: every place on one way, verified between, and what cannot be held told with its place.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use meltpath_base::Silent;
use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::solve;
use meltpath_robot::cell::{self, Cell, Stance, Values};
use meltpath_robot::kinematics::numeric::distance;
use meltpath_robot::kinematics::{Configuration, Unreachable};
use meltpath_robot::posture::{Axes, Follower, Held, NotHeld, Rotation, Sample, Task, Why, hold};
use meltpath_robot::{Command, Kind, Smoothing, Source};

static ANY: BTreeMap<Option<u32>, Stance> = BTreeMap::new();

fn shipped(name: &str) -> Cell {
    cell::read(find(robots::ALL, name).unwrap().text).unwrap()
}

fn down(position: DVec3) -> Pose {
    Pose::from_wpr(position, DVec3::new(PI, 0.0, 0.0))
}

/// Beads through points, with the torch straight down.
fn beads(points: &[DVec3]) -> (Pose, Vec<Command>) {
    let lines = points[1..].iter().zip(0..);
    let commands = lines.map(|(p, id)| Command {
        source: Source::On { wire_feed: 130.0 },
        ..Command::line(id, *p, 12.5, Smoothing::Fine)
    });
    (down(points[0]), commands.collect())
}

/// Squares of 200 mm, one over the other.
fn tower(at: DVec3) -> (Pose, Vec<Command>) {
    let corners = [
        (-1.0, -1.0),
        (1.0, -1.0),
        (1.0, 1.0),
        (-1.0, 1.0),
        (-1.0, -1.0),
    ];
    let layer = |z: f64| corners.map(|(x, y)| at + DVec3::new(100.0 * x, 100.0 * y, z));
    let points: Vec<DVec3> = [0.0, 30.0, 60.0].into_iter().flat_map(layer).collect();
    beads(&points)
}

fn held(
    cell: &Cell,
    (start, commands): &(Pose, Vec<Command>),
    rotation: Rotation,
) -> Result<Held, NotHeld> {
    hold(&task(cell, (start, commands), rotation), &Silent)
}

fn task<'a>(
    cell: &'a Cell,
    (start, commands): (&Pose, &'a Vec<Command>),
    rotation: Rotation,
) -> Task<'a> {
    Task {
        cell,
        values: Values::default(),
        axes: Axes::Standing,
        start: *start,
        commands,
        rotation,
        configurations: &ANY,
    }
}

fn samples(task: &Task<'_>, held: &Held) -> Vec<Sample> {
    let mut samples = Vec::new();
    for chain in &held.chains {
        let mut follower = Follower::new(task, chain);
        while let Some(sample) = follower.next_sample().unwrap() {
            samples.push(sample);
        }
    }
    samples
}

/// Where the wire's tip lies in the part, by the frames of the cell.
fn tip(cell: &Cell, joints: [f64; 6]) -> Pose {
    let values = Values {
        arm: joints,
        ..Values::default()
    };
    cell.frames(&values).part_from_wire_tip()
}

/// Every robot that ships holds a tower on its own table: within limits, without a jump, the wire where it was asked and as it was
/// asked, whatever the rotation about it.
#[test]
fn multiaxis_ma7_every_shipped_robot_holds_a_tower_on_its_table() {
    for file in robots::ALL {
        let cell = shipped(file.name);
        let program = tower(DVec3::ZERO);
        let held = held(&cell, &program, Rotation::Free)
            .unwrap_or_else(|e| panic!("{}: {e:?}", file.name));
        let task = task(&cell, (&program.0, &program.1), Rotation::Free);
        let samples = samples(&task, &held);
        assert!(samples.len() > 3 * 4 * 200 / 5, "{}", file.name);
        for pair in samples.windows(2) {
            let step = (0..6).map(|i| (pair[1].joints[i] - pair[0].joints[i]).abs());
            assert!(step.fold(0.0, f64::max) <= 0.1, "{}", file.name);
        }
        for s in &samples {
            let [off, turned] = distance(tip(&cell, s.joints), s.tip);
            assert!(
                off < 1e-8 && turned < 1e-8,
                "{}: {off:e} {turned:e}",
                file.name
            );
            assert!((s.tip.orientation * DVec3::Z).distance(-DVec3::Z) < 1e-12);
            assert!(cell.arm.margin(s.joints).0 >= 0.0);
        }
        // each corner is reached
        for c in &program.1 {
            assert!(
                samples
                    .iter()
                    .any(|s| s.tip.position.distance(c.target) < 1e-9)
            );
        }
        let limit = held.margins.limit.unwrap();
        let wrist = held.margins.wrist.unwrap();
        println!(
            "{}: J{} {:.1} deg from its limit, wrist {:.1} deg, {} samples",
            file.name,
            limit.joint + 1,
            limit.value.to_degrees(),
            wrist.value.to_degrees(),
            samples.len()
        );
        assert!(limit.value > 0.05, "{}: {limit:?}", file.name);
        assert!(wrist.value > 0.05, "{}: {wrist:?}", file.name);
    }
}

/// What an arm comes near to is the worst of all places that it goes through, and where that is.
#[test]
fn margins_are_those_of_the_worst_places() {
    let cell = shipped("abb-irb2600-12-185");
    let (start, commands) = tower(DVec3::ZERO);
    let task = task(&cell, (&start, &commands), Rotation::Free);
    let held = hold(&task, &Silent).unwrap();
    let (samples, margins) = (samples(&task, &held), held.margins);
    let least =
        |value: &dyn Fn(&Sample) -> f64| samples.iter().map(value).fold(f64::INFINITY, f64::min);
    let near = |s: &Sample| cell.arm.nearness(s.joints).unwrap();
    let worst = [
        (
            margins.limit,
            least(&|s| cell.arm.margin(s.joints).0 - s.curve),
        ),
        (margins.wrist, least(&|s| near(s).wrist - s.curve)),
        (margins.elbow, least(&|s| near(s).elbow - s.curve)),
        (margins.shoulder, least(&|s| near(s).shoulder.abs())),
        (margins.speed, -least(&|s| -s.speed.map_or(0.0, |v| v.0))),
    ];
    for (n, (found, wanted)) in worst.into_iter().enumerate() {
        let found = found.unwrap();
        assert!(
            (found.value - wanted).abs() < 1e-12,
            "{n}: {found:?} {wanted}"
        );
        assert!(
            samples
                .iter()
                .any(|s| s.tip.position == found.position && s.command == found.command)
        );
    }
}

#[test]
fn multiaxis_ma9_a_part_out_of_reach_is_told_with_place_and_distance() {
    let cell = shipped("kuka-kr16-r2010-2");
    // the table lies 1100 mm in front: the far corners of a tower 1300 mm farther are too far
    let program = tower(DVec3::new(1300.0, 0.0, 0.0));
    let not = held(&cell, &program, Rotation::Free).unwrap_err();
    let Why::Unreachable(Unreachable::TooFar { by }) = not.why else {
        panic!("{not:?}");
    };
    assert!(by > 0.0 && by < 500.0, "{by}");
    assert!(not.position.x >= 1200.0, "{not:?}");
}

#[test]
fn multiaxis_ma9_a_joint_at_its_limit_is_told_with_place_and_angle() {
    // a first joint that may turn by 5 deg only
    let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
    let text = text
        .replacen("low = [\"-180 deg\"", "low = [\"-5 deg\"", 1)
        .replacen("high = [\"180 deg\"", "high = [\"5 deg\"", 1);
    let cell = cell::read(&text).unwrap();
    let line = [DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.0, 600.0, 0.0)];
    let not = held(&cell, &beads(&line), Rotation::Free).unwrap_err();
    let Why::Limit { joint, by } = not.why else {
        panic!("{not:?}");
    };
    assert!(joint == 0 && by > 0.0, "{not:?}");
    // the wrist is held within 23 deg of the wire's tip by its neck: 1000 mm in front the first joint is at 5 deg somewhere there
    assert!(not.position.y > 80.0 && not.position.y < 450.0, "{not:?}");
}

/// Written rotations are kept, and what they make impossible is told; left free the same line is held.
#[test]
fn a_free_rotation_holds_what_a_written_one_does_not() {
    // a last joint that turns by 60 deg only
    let text = find(robots::ALL, "yaskawa-ar2010").unwrap().text;
    let text = text.replacen("\"-210 deg\"]", "\"-60 deg\"]", 1).replacen(
        "\"210 deg\"]",
        "\"60 deg\"]",
        1,
    );
    let cell = cell::read(&text).unwrap();
    let line = [DVec3::new(-150.0, 0.0, 0.0), DVec3::new(150.0, 0.0, 0.0)];
    let (_, mut commands) = beads(&line);
    let mut kept = 0;
    for i in 0..12 {
        let turn = DQuat::from_rotation_z(TAU * f64::from(i) / 12.0);
        let start = Pose {
            orientation: down(line[0]).orientation * turn,
            ..down(line[0])
        };
        for c in &mut commands {
            c.orientation = start.orientation;
        }
        match held(&cell, &(start, commands.clone()), Rotation::Written) {
            Ok(held) => {
                kept += 1;
                let program = (start, commands.clone());
                let task = task(&cell, (&program.0, &program.1), Rotation::Written);
                for s in samples(&task, &held) {
                    assert!(s.tip.orientation.angle_between(start.orientation) < 1e-7);
                }
            }
            Err(e) => assert!(
                matches!(e.why, Why::Limit { .. } | Why::Unreachable(_) | Why::Change),
                "{e:?}"
            ),
        }
        assert!(held(&cell, &(start, commands.clone()), Rotation::Free).is_ok());
    }
    assert!((1..12).contains(&kept), "{kept}");
}

/// A line that leads the wrist from one side of the first axis to the other changes configuration on the way: told, not taken.
#[test]
fn a_line_that_changes_configuration_is_told() {
    let text = find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text;
    let (arm, _) = text.split_once("\n# A table that tilts").unwrap();
    // straight torch, part on top of the robot
    let cell = cell::read(&format!(
        "{arm}\n[torch]\nposition = [\"0 mm\", \"0 mm\", \"100 mm\"]\n[part]\nposition = [\"0 mm\", \"0 mm\", \"1000 mm\"]\n"
    ))
    .unwrap();
    let line = [DVec3::new(700.0, 1.0, 0.0), DVec3::new(-700.0, 1.0, 0.0)];
    let not = held(&cell, &beads(&line), Rotation::Free).unwrap_err();
    assert!(not.position.x < 600.0 && not.position.x > -600.0, "{not:?}");
}

/// Joint speeds against those of the Jacobian: the flange moves with the tip, at 12.5 mm/s.
#[test]
fn joint_speeds_are_those_of_the_jacobian() {
    let cell = shipped("staubli-rx60bl");
    let line = [DVec3::new(-60.0, -60.0, 0.0), DVec3::new(60.0, 50.0, 0.0)];
    let program = beads(&line);
    let held = held(&cell, &program, Rotation::Written).unwrap();
    let task = task(&cell, (&program.0, &program.1), Rotation::Written);
    let samples = samples(&task, &held);
    let along = (line[1] - line[0]).normalize() * 12.5;
    let mut greatest = 0.0_f64;
    for pair in samples.windows(2) {
        let middle: [f64; 6] =
            std::array::from_fn(|i| 0.5 * (pair[0].joints[i] + pair[1].joints[i]));
        let columns = cell.arm.chain.jacobian(&middle);
        let entry = |row: usize, j: usize| {
            if row < 3 {
                columns[j].0[row]
            } else {
                columns[j].1[row - 3]
            }
        };
        let jacobian = Matrix::from_fn(6, 6, entry);
        // base, world and part stand parallel; the torch does not turn: the flange goes as the tip
        let wanted = Matrix::from_fn(6, 1, |row, _| if row < 3 { along[row] } else { 0.0 });
        let speeds = solve(&jacobian, &wanted).unwrap();
        let share = (0..6)
            .map(|i| speeds[(i, 0)].abs() / cell.arm.chain.joints[i].limits.speed.unwrap())
            .fold(0.0, f64::max);
        let (found, _) = pair[1].speed.unwrap();
        assert!((found / share - 1.0).abs() < 1e-3, "{found} {share}");
        greatest = greatest.max(found);
    }
    assert_eq!(held.margins.speed.unwrap().value, greatest);
    assert!(greatest > 0.0 && greatest < 0.1);
}

/// Arcs are followed on their circle, joint moves begin anew, and a run is the same on each call.
#[test]
fn arcs_and_joint_moves_are_followed() {
    let cell = shipped("universal-ur10e");
    let (start, mut commands) = beads(&[
        DVec3::new(50.0, 0.0, 0.0),
        DVec3::new(-50.0, 0.0, 0.0),
        DVec3::new(80.0, 80.0, 20.0),
        DVec3::new(80.0, -80.0, 20.0),
    ]);
    commands[0].kind = Kind::Arc {
        via: DVec3::new(0.0, 50.0, 0.0),
    };
    commands[1].kind = Kind::Joint(None);
    let program = (start, commands);
    let held = held(&cell, &program, Rotation::Free).unwrap();
    assert_eq!(held, self::held(&cell, &program, Rotation::Free).unwrap());
    assert_eq!(held.chains.len(), 2);
    let task = task(&cell, (&program.0, &program.1), Rotation::Free);
    let samples = samples(&task, &held);
    let arc = samples.iter().filter(|s| s.command == 0);
    for s in arc {
        let p = s.tip.position;
        assert!((p.length() - 50.0).abs() < 1e-9 && p.z == 0.0, "{p}");
    }
    assert!(
        samples
            .iter()
            .any(|s| s.tip.position.distance(DVec3::new(0.0, 50.0, 0.0)) < 1e-9)
    );
    let turned = |s: &Sample| {
        DMat3::from_quat(s.tip.orientation)
            .z_axis
            .distance(-DVec3::Z)
    };
    assert!(samples.iter().all(|s| turned(s) < 1e-12));
}

/// A CONFIG that is written decides the way; one that no way has is told.
#[test]
fn a_written_configuration_is_kept_or_refused() {
    let cell = shipped("fanuc-arcmate-120ic");
    let program = beads(&[DVec3::new(-40.0, 0.0, 0.0), DVec3::new(40.0, 0.0, 0.0)]);
    let any = task(&cell, (&program.0, &program.1), Rotation::Free);
    let first = hold(&any, &Silent).unwrap().chains[0].joints;
    let chosen = cell.arm.configuration(first).unwrap();
    let flipped: Configuration = match chosen.to_string().split_at(1) {
        ("N", rest) => format!("F{rest}").parse().unwrap(),
        (_, rest) => format!("N{rest}").parse().unwrap(),
    };
    for wanted in [chosen, flipped] {
        let named = [(None, Stance::Fanuc(wanted))].into();
        let task = Task {
            configurations: &named,
            ..any
        };
        let joints = hold(&task, &Silent).unwrap().chains[0].joints;
        assert_eq!(cell.arm.configuration(joints), Some(wanted));
    }
    let wound = Configuration {
        turns: [3, 0, 0],
        ..chosen
    };
    let named = [(None, Stance::Fanuc(wound))].into();
    let named = Task {
        configurations: &named,
        ..any
    };
    let not = hold(&named, &Silent).unwrap_err();
    assert_eq!(not.why, Why::Configuration(Stance::Fanuc(wound)));
}

/// Where a program's words say no turns of the wrist, a joint move goes on to the turn that is near, as its controller does.
#[test]
fn a_joint_move_ends_at_the_turn_that_is_near() {
    let cell = shipped("staubli-rx60bl");
    let mut told = 0;
    for i in 0..12 {
        let turn = DQuat::from_rotation_z(TAU * f64::from(i) / 12.0);
        let at = |x: f64| Pose {
            orientation: down(DVec3::ZERO).orientation * turn,
            ..down(DVec3::new(x, 0.0, 0.0))
        };
        let to = |id: u32, x: f64, kind: Kind| Command {
            kind,
            orientation: at(x).orientation,
            ..Command::line(id, at(x).position, 12.5, Smoothing::Fine)
        };
        let commands = vec![
            to(0, 40.0, Kind::Line),
            to(1, 0.0, Kind::Joint(None)),
            to(2, 40.0, Kind::Line),
        ];
        let start = at(0.0);
        let task = task(&cell, (&start, &commands), Rotation::Written);
        let Ok(held) = hold(&task, &Silent) else {
            continue;
        };
        let first = held.chains[0].joints;
        for by in [-TAU, TAU] {
            let mut joints = first;
            joints[3] += by;
            if cell.arm.chain.joints[3].limits.margin(joints[3]) < 0.1 {
                continue;
            }
            let shown = cell.arm.shown(joints).map(f64::to_degrees);
            let words = cell.stance(first).unwrap();
            let said = BTreeMap::from([(None, Stance::Joints(shown)), (Some(1), words)]);
            let task = Task {
                configurations: &said,
                ..task
            };
            let held = hold(&task, &Silent).unwrap();
            let [before, after] = [0, 1].map(|run: usize| held.chains[run].joints[3]);
            assert!((before - joints[3]).abs() < 0.01, "{before}");
            assert!((after - before).abs() < 0.1, "{before} {after}");
            told += 1;
        }
    }
    assert!(told > 0);
}
