//! The torus built with the part on the flange of the source's robot under a torch that stands upright.

use std::collections::BTreeMap;

use meltpath_base::Silent;
use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_planning::surface::paced_layers;
use meltpath_robot::cell::{self, Cell, Frames, Values};
use meltpath_robot::posture::{Axes, Follower, Rotation, Task, hold};
use meltpath_robot::{Command, Kind, Smoothing, Source};
use meltpath_toolpath::Role;

use super::*;

const SPEED: f64 = 12.5;

/// The RX60BL with the part 80 mm before its flange, under a torch whose wire ends upright over the arm.
fn cell() -> Cell {
    let text = find(robots::ALL, "staubli-rx60bl").unwrap().text;
    let arm = &text[..text.find("[torch]").unwrap()];
    let held = "[torch]\nposition = [\"480 mm\", \"0 mm\", \"715 mm\"]\nangles = [\"180 deg\", \"0 deg\", \"0 deg\"]\nwire = \"15 mm\"\n[part]\nposition = [\"0 mm\", \"0 mm\", \"80 mm\"]\n";
    let arm = arm.replacen("maker", "arrangement = \"part-on-robot\"\nmaker", 1);
    cell::read(&format!("{arm}{held}")).unwrap()
}

/// The passes with the torch halfway, as moves of the wire's tip in the part; the arm goes free from one pass to the next.
fn program() -> (Pose, Vec<Command>) {
    let passes = planned(SurfaceStrategy::Distance);
    let mut start = None;
    let mut commands: Vec<Command> = Vec::new();
    for layer in paced_layers(&passes, &upwards(TorchRule::Half), STEP, |_| {
        (Role::Contour, &[])
    }) {
        for pass in layer.passes() {
            for (i, point) in pass.points.iter().enumerate() {
                let pose = Pose::of_tool(*point, pass.axis(i).unwrap(), 0.0);
                if start.is_none() {
                    start = Some(pose);
                    continue;
                }
                let id = commands.len() as u32;
                let kind = if i == 0 {
                    Kind::Joint(None)
                } else {
                    Kind::Line
                };
                let source = match kind {
                    Kind::Joint(_) => Source::Off,
                    _ => Source::On { wire_feed: 130.0 },
                };
                commands.push(Command {
                    kind,
                    source,
                    orientation: pose.orientation,
                    ..Command::line(id, pose.position, SPEED, Smoothing::Fine)
                });
            }
        }
    }
    (start.unwrap(), commands)
}

#[test]
fn multiaxis_ma8_the_part_turns_under_a_torch_that_stands_upright() {
    let cell = cell();
    let (start, commands) = program();
    let task = Task {
        cell: &cell,
        values: Values::default(),
        axes: Axes::Standing,
        start,
        commands: &commands,
        rotation: Rotation::Free,
        configurations: &BTreeMap::new(),
    };
    let held = hold(&task, &Silent).unwrap();
    let frames = |arm: [f64; 6]| -> Frames {
        let values = Values {
            arm,
            ..Values::default()
        };
        cell.frames(&values)
    };
    let (mut turned, mut off, mut slower, mut between) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut reached = 0;
    for chain in &held.chains {
        let mut follower = Follower::new(&task, chain);
        let mut before: Option<([f64; 6], DVec3)> = None;
        while let Some(sample) = follower.next_sample().unwrap() {
            let here = frames(sample.joints);
            // the torch stands: its wire points straight down, whatever the part does
            assert!((here.wire_tip.orientation * DVec3::Z).distance(-DVec3::Z) < 1e-12);
            let tip = here.part_from_wire_tip();
            if sample.ends.is_some() && before.is_some() {
                let command = commands[sample.command as usize];
                let wanted = -(command.orientation * DVec3::Z);
                turned = turned.max(tip.tool_axis().cross(wanted).length());
                off = off.max(tip.position.distance(command.target));
                reached += 1;
            }
            if let Some((joints, from)) = before {
                // the time of the way as planned, and the way that the joints make of it: whole, and half of it in half of the time
                let planned = sample.tip.position.distance(from);
                let a = frames(joints).part_from_wire_tip().position;
                let time = planned / SPEED;
                slower = slower.max((tip.position.distance(a) / time - SPEED).abs());
                let middle = std::array::from_fn(|i| 0.5 * (joints[i] + sample.joints[i]));
                let half = frames(middle).part_from_wire_tip().position;
                between = between.max((half.distance(a) / (0.5 * time) - SPEED).abs());
            }
            before = Some((sample.joints, sample.tip.position));
        }
    }
    let moves = commands.iter().filter(|c| c.kind == Kind::Line).count();
    assert_eq!(reached, moves);
    assert!(turned < 1e-9 && off < 1e-6);
    assert!(slower < 1e-6 * SPEED && between < 0.02 * SPEED);
}
