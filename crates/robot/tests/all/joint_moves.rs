//! Joint moves: their chords against the forward chain on a far finer grid, and their motion against it.

use std::f64::consts::PI;

use meltpath_base::{Silent, settings};
use meltpath_data::{cells, find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_numerics::random::Random;
use meltpath_robot::cell::{self, Cell, External, Values};
use meltpath_robot::driven::drive;
use meltpath_robot::interpolation::joints::{Along, simulate};
use meltpath_robot::joint_move::{CHORD, JointMove, TURN};
use meltpath_robot::posture::hold;
use meltpath_robot::{Command, Controller, Kind, Smoothing, Source};
use meltpath_toolpath::{MotionBlock, MotionSink};

use crate::driven::task;

fn controller() -> Controller {
    settings::peek(cells::ARCMATE_120IC.text, &["motion"])
        .unwrap()
        .unwrap()
}

fn arcmate() -> Cell {
    cell::read(find(robots::ALL, "fanuc-arcmate-120ic").unwrap().text).unwrap()
}

/// Somewhere within the limits of every axis.
fn anywhere(cell: &Cell, random: &mut Random) -> Values {
    let limits = cell.axis_limits();
    let mut value = |i: usize| limits[i].map_or(0.0, |l| random.between(l.low, l.high));
    let shown = std::array::from_fn(&mut value);
    let external = External(std::array::from_fn(|i| value(6 + i)));
    Values::of(cell.arm.joints(shown), external)
}

/// Of every robot that ships: ends and middle are those of the forward chain, and a grid a hundred times finer than the chords leaves
/// them by no more than is told, in place and turn.
#[test]
fn chords_stand_for_the_curve_on_a_hundred_times_finer_grid() {
    let mut random = Random::new(11);
    for robot in robots::ALL {
        let cell = cell::read(robot.text).unwrap();
        let (mut farthest, mut most_turned, mut most) = (0.0_f64, 0.0_f64, 0);
        for _ in 0..4 {
            let joint_move = JointMove {
                command: 0,
                ends: [anywhere(&cell, &mut random), anywhere(&cell, &mut random)],
            };
            let [from, to] = joint_move.ends;
            let tip = |values: &Values| cell.frames(values).part_from_wire_tip();
            for (share, values) in [(0.0, from), (1.0, to)] {
                let found = joint_move.tip(&cell, share);
                assert!(found.position.distance(tip(&values).position) < 1e-9);
            }
            let [a, b] = [from.external().0, to.external().0];
            let middle = Values::of(
                std::array::from_fn(|i| 0.5 * (from.arm[i] + to.arm[i])),
                External(std::array::from_fn(|i| 0.5 * (a[i] + b[i]))),
            );
            let found = joint_move.tip(&cell, 0.5).position;
            assert!(found.distance(tip(&middle).position) < 1e-9);
            let places: Vec<Values> = joint_move.places(&cell).collect();
            assert_eq!(places.last(), Some(&joint_move.at(1.0)));
            most = most.max(places.len());
            let mut before = tip(&from);
            for (i, values) in places.iter().enumerate() {
                let here = tip(values);
                for k in 1..100 {
                    let within = f64::from(k) / 100.0;
                    let share = (i as f64 + within) / places.len() as f64;
                    let real = joint_move.tip(&cell, share);
                    let chord = before.position.lerp(here.position, within);
                    let turn = before.orientation.slerp(here.orientation, within);
                    farthest = farthest.max(real.position.distance(chord));
                    most_turned = most_turned.max(real.orientation.angle_between(turn));
                }
                before = here;
            }
        }
        println!(
            "{}: {most} chords, {farthest:.4} mm, {most_turned:.6} rad",
            robot.name
        );
        assert!(farthest <= CHORD && most_turned <= TURN, "{}", robot.name);
        // no finer than some ten times what is asked
        assert!(farthest > 0.02 * CHORD || most_turned > 0.02 * TURN);
    }
}

fn down(position: DVec3) -> Pose {
    Pose::from_wpr(position, DVec3::new(PI, 0.0, 0.0))
}

/// Commands, and their joint moves as their ends are held.
struct Program {
    cell: Cell,
    start: Pose,
    commands: Vec<Command>,
    joint_moves: Vec<JointMove>,
}

/// What comes between two joint ends.
const HOME: [f64; 6] = [0.3, 0.2, -0.2, 0.1, -0.9, 0.4];

impl Program {
    /// From place to place of the joints, by joint moves of 2 s, and straight on by `beside` mm before and after.
    fn of(places: &[[f64; 6]], smoothing: Smoothing, beside: f64) -> Self {
        let cell = arcmate();
        let rest = cell.at_rest().external();
        let values = |arm: &[f64; 6]| Values::of(*arm, rest);
        let tip = |arm: &[f64; 6]| cell.frames(&values(arm)).part_from_wire_tip();
        let first = tip(&places[0]);
        let mut commands = Vec::new();
        let mut joint_moves = Vec::new();
        let mut add = |to: Pose, kind: Kind, smoothing: Smoothing| {
            let id = commands.len() as u32;
            commands.push(Command {
                kind,
                orientation: to.orientation,
                ..Command::line(id, to.position, 100.0, smoothing)
            });
            id
        };
        let aside = |pose: Pose| Pose {
            position: pose.position + beside * DVec3::Y,
            ..pose
        };
        let start = aside(first);
        if beside > 0.0 {
            add(first, Kind::Line, smoothing);
        }
        for ends in places.windows(2) {
            let joint_move = JointMove {
                command: 0,
                ends: [values(&ends[0]), values(&ends[1])],
            };
            let course = joint_move.course(&cell, &joint_move.tip_way(&cell), 2.0);
            let command = add(tip(&ends[1]), Kind::Joint(Some(course)), smoothing);
            joint_moves.push(JointMove {
                command,
                ..joint_move
            });
        }
        if beside > 0.0 {
            add(
                aside(tip(&places[places.len() - 1])),
                Kind::Line,
                Smoothing::Fine,
            );
        }
        Program {
            cell,
            start,
            commands,
            joint_moves,
        }
    }

    fn motion(&self) -> Motion {
        let mut motion = Motion::default();
        let along = Along {
            cell: Some(&self.cell),
            moves: &self.joint_moves,
            start: self.start,
            commands: &self.commands,
        };
        simulate(&along, &controller(), &Silent, &mut motion).unwrap();
        motion
    }
}

#[derive(Default)]
struct Motion {
    places: Vec<DVec3>,
    axes: Vec<DVec3>,
    speeds: Vec<f64>,
    commands: Vec<u32>,
}

impl MotionSink for Motion {
    fn block(&mut self, block: &MotionBlock) {
        self.places.extend(&block.position);
        self.axes
            .extend((0..block.len()).map(|i| block.axis.get(i).copied().unwrap_or(DVec3::Z)));
        self.speeds.extend(&block.speed);
        self.commands.extend(&block.command);
    }
}

/// The share of a joint move at which its tip is nearest to a place, and how near.
fn nearest(program: &Program, place: DVec3) -> (f64, f64) {
    let far = |share: f64| {
        let tip = program.joint_moves[0].tip(&program.cell, share);
        tip.position.distance(place)
    };
    let grid = (0..=400).map(|i| f64::from(i) / 400.0);
    let best = grid.min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap();
    let (mut low, mut high) = (best - 1.0 / 400.0, best + 1.0 / 400.0);
    for _ in 0..80 {
        let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
        if far(a) < far(b) {
            high = b;
        } else {
            low = a;
        }
    }
    (low, far(low))
}

/// Between two stops the motion lies on the curve of the forward chain, its ends on those of the move, with the torch as the chain has it.
#[test]
fn between_stops_the_motion_is_the_curve() {
    let to = [-0.9, 0.5, 0.1, 1.0, -0.4, -0.8];
    let program = Program::of(&[HOME, to], Smoothing::Fine, 30.0);
    let motion = program.motion();
    let [a, b] = [0.0, 1.0].map(|share| program.joint_moves[0].tip(&program.cell, share).position);
    let of_joints: Vec<usize> = (0..motion.places.len())
        .filter(|i| motion.commands[*i] == 1)
        .collect();
    assert!(of_joints.len() > 900, "{}", of_joints.len());
    let (mut shares, mut bow) = (Vec::new(), 0.0_f64);
    for &i in of_joints.iter().step_by(7) {
        let (share, far) = nearest(&program, motion.places[i]);
        assert!(far < 1e-6, "{far} at {share}");
        let axis = program.joint_moves[0]
            .tip(&program.cell, share.clamp(0.0, 1.0))
            .tool_axis();
        assert!(axis.distance(motion.axes[i]) < 1e-5, "{share}");
        let along = (b - a).normalize();
        bow = bow.max((motion.places[i] - a).reject_from(along).length());
        shares.push(share);
    }
    println!("{bow:.1} mm beside the straight line");
    assert!(bow > 50.0);
    assert!(shares.windows(2).all(|w| w[1] > w[0] - 1e-6));
    let last = *of_joints.last().unwrap();
    assert!(motion.places[last].distance(b) < 1e-3);
    // speed is that of the curve
    for i in of_joints[10]..last - 10 {
        let gone = motion.places[i].distance(motion.places[i - 1]) / controller().sampling();
        assert!((motion.speeds[i] - gone).abs() < 1e-6 * gone.max(1.0));
    }
    let end = program.commands[2].target;
    assert!(motion.places.last().unwrap().distance(end) < 1e-9);
}

/// Where moves pass into each other the motion goes on without a jump, near to every place, and comes to its end.
#[test]
fn without_stops_nothing_jumps() {
    let middle = [-0.2, 0.4, 0.0, 0.5, -0.7, -0.2];
    let to = [-0.9, 0.5, 0.1, 1.0, -0.4, -0.8];
    for beside in [0.0, 60.0] {
        let program = Program::of(&[HOME, middle, to], Smoothing::Cnt(1.0), beside);
        let motion = program.motion();
        let dt = controller().sampling();
        let gone = motion.places.windows(2).map(|w| w[0].distance(w[1]) / dt);
        let fastest = gone.clone().fold(0.0, f64::max);
        let speeds: Vec<f64> = gone.collect();
        let hardest = speeds.windows(2).map(|w| (w[1] - w[0]).abs() / dt);
        let hardest = hardest.fold(0.0, f64::max);
        println!("{fastest:.0} mm/s, {hardest:.0} mm/s²");
        // the tip's way of 1 to 2 m in 2 s, reached within the averages
        assert!(fastest < 1500.0 && hardest < 2.0 * fastest / 0.072);
        let end = program.commands.last().unwrap().target;
        assert!(motion.places.last().unwrap().distance(end) < 1e-9);
        let passed = program.joint_moves[0].tip(&program.cell, 1.0).position;
        let near = motion.places.iter().map(|p| p.distance(passed));
        assert!(near.fold(f64::INFINITY, f64::min) < 40.0);
    }
}

/// A joint move whose tip stays where it is takes its time, and the tip goes out and comes back.
#[test]
fn a_tip_that_comes_back_has_moved() {
    // the same place with the wrist turned over
    let [a, b, c, d, e, f] = HOME;
    let over = [a, b, c, d - PI, -e, f + PI];
    let program = Program::of(&[HOME, over], Smoothing::Fine, 0.0);
    assert!(program.start.position.distance(program.commands[0].target) < 1e-9);
    let motion = program.motion();
    let time = motion.places.len() as f64 * controller().sampling();
    assert!(
        (time - 2.0 - controller().transition()).abs() < 0.01,
        "{time}"
    );
    let out = motion
        .places
        .iter()
        .map(|p| p.distance(program.start.position));
    let out = out.fold(0.0, f64::max);
    println!("{out:.1} mm");
    assert!(out > 20.0);
}

/// The axes are followed along a joint move too, where its ends are known: through the wrist's singularity, and on to the bead after it.
#[test]
fn the_arm_is_not_lost_on_a_joint_move() {
    let cell = arcmate();
    let on = Source::On { wire_feed: 130.0 };
    let start = down(DVec3::new(-100.0, -150.0, 0.0));
    let places = [[-60.0, -150.0], [-60.0, 150.0], [-100.0, 150.0]];
    let places = places.map(|[x, y]| DVec3::new(x, y, 0.0));
    let line = |id: u32| Command {
        orientation: start.orientation,
        source: on,
        ..Command::line(id, places[id as usize], 12.5, Smoothing::Fine)
    };
    let mut commands = vec![line(0), line(1), line(2)];
    (commands[1].source, commands[1].kind) = (Source::Off, Kind::Joint(None));
    let held = hold(&task(&cell, start, &commands), &Silent).unwrap();
    let mut from = held.chains[0].joints;
    let whole = task(&cell, start, &commands);
    let mut follower = meltpath_robot::posture::Follower::new(&whole, &held.chains[0]);
    while let Some(sample) = follower.next_sample().unwrap() {
        from = sample.joints;
    }
    let mut to = held.chains[1].joints;
    let rest = cell.at_rest().external();
    let end = |joints: [f64; 6]| Values::of(joints, rest);
    let known = JointMove {
        command: 1,
        ends: [end(from), end(to)],
    };
    let course = known.course(&cell, &known.tip_way(&cell), 1.0);
    let mut bent = commands.clone();
    bent[1].kind = Kind::Joint(Some(course));
    let of = |commands: &[Command], known: &[JointMove]| {
        let task = task(&cell, start, commands);
        drive(&task, &held, known, &controller(), (&[], &[]), &Silent).unwrap()
    };
    let followed = of(&bent, &[known]);
    let dropped = of(&commands, &[]);
    assert!(followed.lost.is_none() && dropped.lost.is_none());
    let [seen, unseen] = [&followed, &dropped].map(|d| d.limit.unwrap());
    println!("{seen:?} {unseen:?}");
    assert!(seen.value <= unseen.value + 1e-6);
    // through the singularity: joint 5 changes its sign
    to[3] += PI;
    to[4] = -to[4];
    to[5] -= PI;
    let through = JointMove {
        command: 1,
        ends: [end(from), end(to)],
    };
    assert!(through.tip(&cell, 1.0).position.distance(places[1]) < 1e-6);
    assert!(from[4] * to[4] < 0.0);
    let course = through.course(&cell, &through.tip_way(&cell), 3.0);
    bent[1].kind = Kind::Joint(Some(course));
    let mut other = held.clone();
    other.chains[1].joints = to;
    let drive_through = drive(
        &task(&cell, start, &bent),
        &other,
        &[through],
        &controller(),
        (&[], &[]),
        &Silent,
    );
    let found = drive_through.unwrap();
    assert!(found.lost.is_none(), "{:?}", found.lost);
}
