//! The path that was driven: of a program, or of points.

use std::path::PathBuf;

use meltpath_base::settings::peek;
use meltpath_base::{Place, Reporter};
use meltpath_data::cells;
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::{Instruction, Termination};
use meltpath_programs::{Program, Reading, read_toolpath};
use meltpath_robot::command::{Command, Kind, Smoothing, Source};
use meltpath_robot::controller::CornerLaw;
use meltpath_robot::identification::DrivenPath;

use super::error::MotionLogError;
use super::file::{PathPoint, Told};
use crate::waam::program::files::{main_of, read};
use crate::waam::program::{driven, tool};

/// The path with what it was read from.
#[derive(Debug)]
pub struct Driven {
    /// The path.
    pub path: DrivenPath,
    /// Distance of blending that is 100 % of smoothing, mm, where the path tells distances.
    pub blend: Option<f64>,
    /// Files of the program.
    pub files: Vec<PathBuf>,
    /// Line of the program of each command, where there is a program.
    pub lines: Vec<(String, u32)>,
}

/// What a change of direction is: as the cell says, else as the cell that ships does.
fn corner_law(told: &Told) -> Option<CornerLaw> {
    let own = told.cell.as_ref().and_then(|c| c.motion.as_ref());
    own.map(|m| m.corner.value.clone()).or_else(|| {
        let shipped = peek(cells::ARCMATE_120IC.text, &["motion", "corner"]);
        shipped.ok().flatten()
    })
}

/// The path that a file tells.
///
/// # Errors
/// [`MotionLogError`].
pub(super) fn of(told: &Told, reporter: &Reporter) -> Result<Driven, MotionLogError> {
    let law = corner_law(told).ok_or(MotionLogError::NoMoves)?;
    match (&*told.file.program, &told.cell) {
        (Some(program), Some(_)) => of_program(told, &program.0, &law, reporter),
        _ => of_points(told, &law),
    }
}

fn of_points(told: &Told, law: &CornerLaw) -> Result<Driven, MotionLogError> {
    let points = &told.file.points;
    let most = points.iter().filter_map(|p| Some((*p.distance)?.0));
    let most = most.fold(0.0, f64::max);
    let blend = told.file.blend.map(|b| b.0);
    let blend = blend.or_else(|| Some(told.cell.as_ref()?.program.blend.as_ref()?.0));
    let blend = if most > 0.0 {
        Some(blend.unwrap_or(most))
    } else {
        blend
    };
    let place = |p: &PathPoint| DVec3::new(p.x.0, p.y.0, p.z.0);
    let mut commands = Vec::new();
    let mut speed = 0.0;
    let mut from = points.first().map_or(DVec3::ZERO, place);
    let down = Command::line(0, from, 1.0, Smoothing::Fine).orientation;
    let start = Pose {
        position: from,
        orientation: down,
    };
    for (n, point) in points.iter().enumerate().skip(1) {
        speed = point.speed.map_or(speed, |s| s.0);
        let to = place(point);
        if to.distance(from) < 1e-6 {
            return Err(MotionLogError::SamePoint { point: n + 1 });
        }
        from = to;
        let of_distance = point.distance.map(|d| d.0 / blend.unwrap_or(d.0));
        let share = point.smoothing.map(|s| s.0).or(of_distance);
        let smoothing = share.map_or(Smoothing::Fine, |s| Smoothing::Cnt(s.min(1.0)));
        let id = n as u32;
        commands.push(Command::line(id, to, speed, smoothing));
        if let Some(wait) = *point.wait {
            let kind = Kind::Wait { time: wait.0 };
            commands.push(Command {
                kind,
                ..Command::line(id, to, speed, Smoothing::Fine)
            });
        }
    }
    Ok(Driven {
        lines: commands
            .iter()
            .map(|c| ("[[point]]".to_owned(), c.id + 1))
            .collect(),
        path: DrivenPath::new(start, &commands, law)?,
        blend: blend.filter(|_| most > 0.0),
        files: Vec::new(),
    })
}

/// The greatest distance at which a path is left.
fn widest(programs: &[Program]) -> Option<f64> {
    let all = programs.iter().flat_map(|p| &p.instructions);
    let distances = all.filter_map(|i| match i {
        Instruction::Motion(m) => match m.termination {
            Termination::Blend(distance) => Some(distance),
            _ => None,
        },
        _ => None,
    });
    distances.reduce(f64::max)
}

fn of_program(
    told: &Told,
    name: &str,
    law: &CornerLaw,
    reporter: &Reporter,
) -> Result<Driven, MotionLogError> {
    let cell = told.cell.as_ref().ok_or(MotionLogError::NoMoves)?;
    let main = main_of(&told.folder.join(name), &cell.program)?;
    let (programs, files) = read(&main, &cell.program, reporter)?;
    let mut known = cell.program.execution(1.0);
    let told_blend = told.file.blend.map(|b| b.0);
    let by_distance = widest(&programs);
    known.blend = told_blend.or(known.blend).or(by_distance);
    let joint_speed = cell
        .motion
        .as_ref()
        .map_or(1000.0, |m| m.joint_speed.value.0);
    let reading = read_toolpath(&programs, &known, joint_speed, reporter)?;
    if !reading.toolpath.weaves.is_empty() {
        return Err(MotionLogError::Weaves);
    }
    for gap in &reading.gaps {
        reporter.warn_at(
            "line-not-followed",
            format!("\"{}\": {}", gap.text, gap.why),
            Place {
                file: Some(gap.program.clone()),
                line: Some(gap.line),
                ..Place::default()
            },
            gap.why.remedy(),
        );
    }
    let (start, commands, numbers) = longest(&reading, reporter)?;
    let line = |n: &usize| {
        let control = reading.controls.get(*n);
        control.map_or_else(Default::default, |c| {
            let name = programs.get(c.program as usize);
            (name.map_or_else(String::new, |p| p.name.clone()), c.line)
        })
    };
    Ok(Driven {
        path: DrivenPath::new(start, &commands, law)?,
        blend: by_distance.and(known.blend),
        files,
        lines: numbers.iter().map(line).collect(),
    })
}

/// The longest part of a program that goes along lines and arcs, from a stop to a stop, with what each command is in the whole.
fn longest(
    reading: &Reading,
    reporter: &Reporter,
) -> Result<(Pose, Vec<Command>, Vec<usize>), MotionLogError> {
    let mut all = Vec::new();
    let mut start = None;
    let mut controls = reading.controls.iter();
    for pass in reading.toolpath.passes() {
        start = start.or_else(|| Some(tool(&pass, 0)));
        for (i, control) in (0..pass.move_count()).zip(controls.by_ref()) {
            let id = all.len() as u32;
            all.push(driven(id, &pass, i, *control, Source::Off));
        }
    }
    let start = start.ok_or(MotionLogError::NoMoves)?;
    let stops = |c: &Command| match c.smoothing {
        Smoothing::Fine => true,
        Smoothing::Cnt(share) => share <= 0.0,
    };
    let joint = |c: &Command| matches!(c.kind, Kind::Joint(_));
    let mut best = (0.0, 0..0);
    let mut begin = 0;
    for end in 0..=all.len() {
        if end < all.len() && !joint(&all[end]) {
            continue;
        }
        let mut from = begin;
        // what a joint move passes into is not known there
        if begin > 0 && !stops(&all[begin - 1]) {
            while from < end && !stops(&all[from]) {
                from += 1;
            }
            from = (from + 1).min(end);
        }
        let mut to = end;
        while end < all.len() && to > from && !stops(&all[to - 1]) {
            to -= 1;
        }
        let mut last = if from == 0 {
            start.position
        } else {
            all[from - 1].target
        };
        let mut length = 0.0;
        for command in &all[from..to] {
            if !matches!(command.kind, Kind::Wait { .. }) {
                length += command.target.distance(last);
                last = command.target;
            }
        }
        if length > best.0 {
            best = (length, from..to);
        }
        begin = end + 1;
    }
    let part = best.1;
    if part.len() < all.len() {
        reporter.warn(
            "part-of-program",
            format!(
                "moves {} to {} of the {} of the program are compared: joint moves, and what is not between stops beside them, are not",
                part.start + 1,
                part.end,
                all.len()
            ),
            "let the dry run go along lines and arcs from stop to stop",
        );
    }
    let start = match part.start.checked_sub(1).map(|before| &all[before]) {
        Some(before) => Pose {
            position: before.target,
            orientation: before.orientation,
        },
        None => start,
    };
    Ok((start, all[part.clone()].to_vec(), part.collect()))
}
