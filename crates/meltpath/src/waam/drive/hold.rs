//! How the job's robot holds the torch along programs, and what their positions then say.

use std::collections::BTreeMap;
use std::sync::Arc;

use meltpath_base::{Observer, Reporter};
use meltpath_programs::{Program, Schedule, dry_run, tell};
use meltpath_robot::cell::{Cell, External, Stance};
use meltpath_robot::collision::Cleared;
use meltpath_robot::posture::{End, Follower, Held, NotHeld, Task};
use meltpath_toolpath::Toolpath;

use crate::job::waam::ExternalChoice;
use crate::waam::drive::arm_way::{ArmWay, Over};
use crate::waam::drive::over;
use crate::waam::drive::positions::{Positions, Reached, hold_so, joint_move, of_robot, stance};
use crate::waam::drive::site::Site;
use crate::waam::drive::way::{free, looked_for};
use crate::waam::program::wanted::{Asked, Torch};
use crate::waam::program::{self, Axes, Chosen, Commands, ProgramStageError, Programs, commands};
use crate::waam::settings::Settings;

/// The robot that is followed along a program; nothing where the job names none, or where others turn the part than it knows.
pub(in crate::waam) fn followed<'a>(moves: &Commands, settings: &'a Settings) -> Option<&'a Cell> {
    let known = !moves.turns || moves.external.is_some();
    settings.robot.as_ref().filter(|_| known)
}

/// The programs of a toolpath, their positions as the job's robot holds them, written and read back. A way that is `known` of programs of
/// the same moves is not looked for again.
///
/// # Errors
/// [`ProgramStageError`]; of a job that asks for several dialects with the one that cannot be written.
pub(in crate::waam) fn write(
    name: &str,
    toolpath: &Toolpath,
    asked: Asked,
    site: Site<'_>,
    known: Option<&Arc<ArmWay>>,
    told: (&Reporter, &dyn Observer),
) -> Result<Programs, ProgramStageError> {
    let written = write_one(name, toolpath, asked, site, known, told);
    written.map_err(|why| why.of(asked.0, &site.settings.programs))
}

/// Those of one dialect.
fn write_one(
    name: &str,
    toolpath: &Toolpath,
    asked: Asked,
    site: Site<'_>,
    known: Option<&Arc<ArmWay>>,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Programs, ProgramStageError> {
    let settings = site.settings;
    let turned = turned(toolpath, settings);
    let toolpath = turned.as_ref().unwrap_or(toolpath);
    let mut built = program::make(name, toolpath, asked, settings, reporter)?;
    let chosen = choose(
        (&mut built.programs, &built.schedules),
        site,
        known,
        observer,
    )?;
    if asked.1.torch == Torch::Dry {
        dry_run(&mut built.programs);
    }
    let programs = program::write(built, &settings.cell.program)?;
    Ok(Programs { chosen, ..programs })
}

/// The same toolpath for programs that are to say where track and positioner stand: at rest until that is chosen. Nothing where
/// programs need not say it.
fn turned(toolpath: &Toolpath, settings: &Settings) -> Option<Toolpath> {
    let cell = settings.robot.as_ref()?;
    if settings.external == ExternalChoice::Standing || settings.programs.is_empty() {
        return None;
    }
    let rest = cell.at_rest();
    let count = cell.positioner.as_ref().map_or(0, |p| p.joints.len());
    let track = says_track(cell, settings).then_some(rest.track);
    let axes: Vec<f64> = track
        .into_iter()
        .chain(rest.positioner.into_iter().take(count))
        .collect();
    if axes.is_empty() {
        return None;
    }
    let mut toolpath = toolpath.clone();
    for layer in &mut toolpath.layers {
        for (axis, value) in axes.iter().enumerate() {
            layer.stand(axis, *value);
        }
    }
    Some(toolpath)
}

/// Whether programs say where the track stands.
fn says_track(cell: &Cell, settings: &Settings) -> bool {
    cell.track.is_some() && settings.cell.program.track.is_some()
}

/// Chooses how the robot holds the torch along programs, and writes it into their positions. Where it cannot hold it they stay as
/// they are: [`along`] tells why.
fn choose(
    (programs, schedules): (&mut [Program], &[Schedule]),
    site: Site<'_>,
    known: Option<&Arc<ArmWay>>,
    observer: &dyn Observer,
) -> Result<Chosen, ProgramStageError> {
    let settings = site.settings;
    let Some(cell) = &settings.robot else {
        return Ok(Chosen::default());
    };
    let moves = commands(programs, schedules, settings, &Reporter::new())?;
    // a plan that moves the axes itself has chosen
    let moved = |axes: &Axes| axes.ends.iter().any(|end| *end != axes.start);
    if moves.turns || moves.external.as_ref().is_some_and(moved) {
        return Ok(Chosen::default());
    }
    let known = known.filter(|way| way.is_along((moves.start, &moves.commands)));
    let found = match known {
        Some(way) => Ok(Arc::clone(way)),
        None => looked_for((programs, schedules), &moves, site, observer)?.map(Arc::new),
    };
    let way = match found {
        Ok(way) => way,
        Err(none) => {
            return Ok(Chosen {
                divisions: none.divisions,
                not_held: none.not_held,
                ..Chosen::default()
            });
        }
    };
    let Over { changes, lift } = &way.over;
    let raised = !changes.is_empty() && over::write(programs, &moves, changes, *lift);
    let moves = if raised {
        commands(programs, schedules, settings, &Reporter::new())?
    } else {
        moves
    };
    let any = BTreeMap::new();
    let task = free(cell, &moves, settings, &any);
    let Cleared { held, found } = &way.cleared;
    let positions = Positions::of(programs);
    let dialect = program::spoken(programs);
    let reached = ends(&task, held).unwrap_or_default();
    let joints = cell.positioner.as_ref().map_or(0, |p| p.joints.len());
    let free = settings.external == ExternalChoice::Free;
    let positioner = settings.cell.program.positioner.as_ref();
    let slides = says_track(cell, settings);
    for reached in &reached {
        let stance = stance(cell, dialect, reached.joints);
        let Some(position) = positions.at(programs, &moves, reached) else {
            continue;
        };
        if let Some(coordinates) = of_robot(position) {
            hold_so(coordinates, stance, reached.tip);
        }
        if free && (slides || positioner.is_some()) {
            let [track, ..] = reached.external.0;
            let turning = reached.external.0.get(1..=joints).unwrap_or_default();
            let axes = (slides.then_some(track), turning);
            tell(
                position,
                reached.tip,
                axes,
                (&settings.cell.program, dialect),
            );
        }
    }
    let (stands, stances) = stands_of(&reached, &moves, cell);
    Ok(Chosen {
        stands,
        stances,
        external: free.then(|| axes_of(&reached, &moves)),
        clearance: Some(*found),
        over: way.over.changes.clone(),
        way: Some(way),
        divisions: Vec::new(),
        not_held: None,
    })
}

/// How the arm stands at the start and at the ends of joint moves, and one after the other along all of them.
fn stands_of(
    reached: &[Reached],
    moves: &Commands,
    cell: &Cell,
) -> (BTreeMap<Option<u32>, Stance>, Vec<Stance>) {
    let (mut stands, mut stances) = (BTreeMap::new(), Vec::new());
    for reached in reached.iter().filter(|r| r.end == End::Target) {
        let Some(stance) = cell.stance(reached.joints) else {
            continue;
        };
        // joints change with every place: they are no way to stand
        let is_way = !matches!(stance, Stance::Joints(_));
        if is_way && stances.last() != Some(&stance) {
            stances.push(stance);
        }
        let command = reached.command;
        if command.is_none() || joint_move(moves, command) {
            stands.insert(command, stance);
        }
    }
    (stands, stances)
}

/// Track and positioner at the end of each command.
fn axes_of(reached: &[Reached], moves: &Commands) -> Axes {
    let mut stands = reached.first().map_or(External::default(), |r| r.external);
    let mut axes = Axes {
        start: stands,
        ends: Vec::with_capacity(moves.commands.len()),
    };
    let mut ends = reached.iter().filter(|r| r.end == End::Target).peekable();
    for id in 0..moves.commands.len() as u32 {
        while let Some(end) = ends.next_if(|r| r.command.is_none_or(|c| c <= id)) {
            stands = end.external;
        }
        axes.ends.push(stands);
    }
    axes
}

/// The ends of all moves, those of no length too.
pub(in crate::waam) fn ends(task: &Task<'_>, held: &Held) -> Result<Vec<Reached>, NotHeld> {
    let mut ends: Vec<Reached> = Vec::new();
    for chain in &held.chains {
        let mut follower = Follower::new(task, chain);
        let mut first = true;
        while let Some(sample) = follower.next_sample()? {
            let command = if first {
                chain.first
            } else {
                Some(sample.command)
            };
            first = false;
            let Some(end) = sample.ends else { continue };
            let reached = |command| Reached {
                command,
                end,
                tip: sample.tip,
                joints: sample.joints,
                external: sample.external,
            };
            ends.push(reached(command));
        }
    }
    // moves that go nowhere end as the one before
    let mut all: Vec<Reached> = Vec::with_capacity(ends.len());
    for reached in ends {
        if let (Some(command), Some(before)) = (reached.command, all.last()) {
            let (tip, joints, external) = (before.tip, before.joints, before.external);
            let missed = before.command.map_or(0, |c| c + 1)..command;
            all.extend(missed.map(|c| Reached {
                command: Some(c),
                end: End::Target,
                tip,
                joints,
                external,
            }));
        }
        all.push(reached);
    }
    Ok(all)
}
