//! Joint moves of programs: how they look and how long they take by the axes of the job's robot, and what the verdict tells of them.

use meltpath_base::{Fact, Measure};
use meltpath_robot::cell::Cell;
use meltpath_robot::command::Kind;
use meltpath_robot::controller::Controller;
use meltpath_robot::interpolation::joints::Along;
use meltpath_robot::joint_move::{JointMove, TipWay};
use meltpath_robot::travel::{LeastTime, least_time};

use crate::waam::drive::axes::axis;
use crate::waam::drive::times::{Times, longer};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Lets joint moves, in order, follow their axes. `full` is the tool's speed at 100 % where a program gives joint moves a share of what the
/// axes can do; where it gives them a speed of the tool there is none.
pub(in crate::waam) fn follow(
    joint_moves: Vec<JointMove>,
    full: Option<f64>,
    (cell, moves): (&Cell, &mut Commands),
    controller: &Controller,
) {
    let ways: Vec<TipWay> = joint_moves.iter().map(|m| m.tip_way(cell)).collect();
    let mut tool_takes = Vec::with_capacity(ways.len());
    for (joint_move, way) in joint_moves.iter().zip(&ways) {
        let Some(command) = moves.commands.get_mut(joint_move.command as usize) else {
            continue;
        };
        let turning = way.turn / controller.rotation_speed.value.0;
        let time = (way.length / command.speed).max(turning);
        // where the tool rests follows from directions alone
        command.kind = Kind::Joint(Some(joint_move.course(cell, way, time)));
        tool_takes.push(time);
    }
    let times = Times::of(moves, controller);
    for (joint_move, tool_takes) in joint_moves.iter().zip(tool_takes) {
        let number = joint_move.command;
        let Some(command) = moves.commands.get_mut(number as usize) else {
            continue;
        };
        let share = full.map_or(1.0, |full| (command.speed / full).min(1.0));
        let smoothing = times.beside(number);
        let least = least_time(cell, &joint_move.ends, times.rests(number), share);
        let Some(least) = least else { continue };
        let axes_take = least.steady.max(least.time - smoothing);
        let Kind::Joint(Some(course)) = &mut command.kind else {
            continue;
        };
        if full.is_some() {
            course.time = axes_take;
        } else {
            course.time = tool_takes.max(axes_take);
            moves
                .slowed
                .extend(longer(number, least, tool_takes + smoothing));
        }
    }
    moves.joint_moves = joint_moves;
}

/// What drives commands, joint moves along their joints.
pub(in crate::waam) fn along<'a>(moves: &'a Commands, settings: &'a Settings) -> Along<'a> {
    Along {
        cell: settings.robot.as_ref(),
        moves: &moves.joint_moves,
        start: moves.start,
        commands: &moves.commands,
    }
}

/// Program, from 1, and line of a command.
pub(in crate::waam) fn line(command: u32, moves: &Commands) -> (u32, u32) {
    let line = moves.line_of_command.get(command as usize);
    line.map_or((0, 0), |(program, line)| (program + 1, *line))
}

/// How joint moves were taken; nothing where there is none.
pub(in crate::waam) fn fact(moves: &Commands, settings: &Settings) -> Option<Fact> {
    const TITLE: &str = "joint moves";
    let all = moves.commands.iter();
    let straight: Vec<u32> = all
        .filter(|c| c.kind == Kind::Joint(None))
        .map(|c| c.id)
        .collect();
    let count = straight.len() + moves.joint_moves.len();
    let fact = |told: &str| Fact::new("joint-moves", TITLE, Measure::exact(count as f64, ""), told);
    if let Some(&first) = straight.first() {
        let (program, line) = line(first, moves);
        let why = match settings.robot {
            None => "the job names no robot",
            Some(_) => "its axes are not known at their ends",
        };
        let told = format!(
            "taken as straight lines of the wire's tip, first in program {program}, line {line}, as {why}: their way, their time and what they pass are not known"
        );
        let target = moves.commands.get(first as usize)?.target;
        return Some(fact(&told).at(moves.place(first, target)));
    }
    let cell = settings.robot.as_ref()?;
    let bows = moves.joint_moves.iter().map(|m| (m, m.tip_way(cell)));
    let (worst, way) = bows.max_by(|a, b| a.1.bow.total_cmp(&b.1.bow))?;
    let told = format!(
        "all axes together from end to end, the wire's tip up to {:.1} mm beside the straight line; {}",
        way.bow,
        longest(moves, cell, &settings.controller)
            .unwrap_or_else(|| "the robot's file tells no speeds".to_owned()),
    );
    Some(fact(&told).at(moves.place(worst.command, way.farthest)))
}

/// The joint move that takes longest.
fn longest(moves: &Commands, cell: &Cell, controller: &Controller) -> Option<String> {
    let times = Times::of(moves, controller);
    let time = |joint_move: &JointMove| {
        let least = least_time(cell, &joint_move.ends, [true; 2], 1.0)?;
        Some((times.time(joint_move.command), least))
    };
    let all = moves.joint_moves.iter().filter_map(time);
    let (
        time,
        LeastTime {
            axis: slowest,
            accelerated,
            ..
        },
    ) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let without = if accelerated {
        ""
    } else {
        ", accelerations not counted, as the robot's file does not tell them"
    };
    Some(format!(
        "the longest takes {time:.1} s, {} the slowest{without}",
        axis(slowest)
    ))
}
