//! The way of the job's robot along programs: straight, with travels that become joint moves, or which beads to divide first.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use meltpath_base::{Observer, Quiet, Reporter};
use meltpath_programs::{Program, Schedule};
use meltpath_robot::cell::{Cell, Stance};
use meltpath_robot::collision::{
    self, Clearance, Cleared, Surroundings, hold_clear, is_nearest_on,
};
use meltpath_robot::posture::{self, Because, Change, NotHeld, Rotation, Task, hold};

use crate::job::waam::ExternalChoice;
use crate::waam::drive::arm_way::{ArmWay, Over};
use crate::waam::drive::divide;
use crate::waam::drive::division::Division;
use crate::waam::drive::expected::{expected, metal_at};
use crate::waam::drive::over;
use crate::waam::drive::positions::stance;
use crate::waam::drive::site::Site;
use crate::waam::program::{self, Commands, ProgramStageError, commands};
use crate::waam::settings::Settings;

/// Room that the way keeps beyond what the verdict asks for, mm.
const SPARE: f64 = 1.0;

/// A torch that a positioner carries the part under leans no farther, as a rule, rad: from here on it may turn back in the air.
const LEANS: f64 = 20.0 * DEGREE;
/// It turns back where the torch then leans so much less, rad.
const WORTH: f64 = 5.0 * DEGREE;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// What is told where no way holds a program.
#[derive(Default)]
pub(super) struct NoWay {
    /// Beads to divide first, if any.
    pub(super) divisions: Vec<Division>,
    /// Where the straight way ends, and why.
    pub(super) not_held: Option<NotHeld>,
}

/// The way along programs. Where no single way holds them, travels are to become joint moves over which the arm goes to another one. Where that
/// does not help it is told which beads to divide first, if any.
pub(super) fn looked_for(
    (programs, schedules): (&[Program], &[Schedule]),
    moves: &Commands,
    site: Site<'_>,
    observer: &dyn Observer,
) -> Result<Result<ArmWay, NoWay>, ProgramStageError> {
    let settings = site.settings;
    let Some(cell) = &settings.robot else {
        return Ok(Err(NoWay::default()));
    };
    let free_axes = settings.external == ExternalChoice::Free;
    // an arm without words for its way cannot be told to change it
    let told = stance(cell, program::spoken(programs), [0.0; 6]).is_some();
    let any = BTreeMap::new();
    let task = free(cell, moves, settings, &any);
    let turns = if free_axes && told {
        over::turns(moves)
    } else {
        Vec::new()
    };
    let between: Vec<_> = turns.iter().map(|turn| turn.moves.clone()).collect();
    let cleared = held(&task, moves, site, observer);
    observer.check()?;
    if !turns.is_empty() && is_in_vain(&task, moves, (site, &between), &cleared) {
        let turns = turns.iter().map(|turn| Change {
            command: turn.over,
            why: Because::OtherDirection,
        });
        let over = over_to(
            turns.collect(),
            (programs, schedules),
            moves,
            site,
            observer,
        )?;
        if let Some((way, room)) = over
            && (cleared.is_err() || room >= 0.0 || way.cleared.found == Clearance::Kept)
        {
            return Ok(Ok(way));
        }
    }
    if let Ok(straight) = &cleared
        && free_axes
        && told
        && let leans = greatest_lean(straight)
        && leans > LEANS
        && let Ok(changes) = over::turned_back_in_the_air(&task, moves, observer)
        && !changes.is_empty()
        && let Some((way, _)) = over_to(changes, (programs, schedules), moves, site, observer)?
        && greatest_lean(&way.cleared) < leans - WORTH
        && (way.cleared.found == Clearance::Kept || straight.found != Clearance::Kept)
    {
        return Ok(Ok(way));
    }
    observer.check()?;
    let none = match cleared {
        Ok(cleared) => {
            let along = (moves.start, &moves.commands[..]);
            return Ok(Ok(ArmWay::along(along, cleared, Over::default())));
        }
        Err(not) => NoWay {
            divisions: Vec::new(),
            not_held: Some(not),
        },
    };
    if !told {
        return Ok(Err(none));
    }
    let changes = over::in_the_air(&task, moves, observer);
    observer.check()?;
    match changes {
        Ok(changes) if changes.is_empty() => Ok(Err(none)),
        Ok(changes) => {
            let way = over_to(changes, (programs, schedules), moves, site, observer)?;
            Ok(way.map(|(way, _)| way).ok_or(none))
        }
        Err(_) if free_axes => Ok(Err(none)),
        Err(_) => {
            let divisions = divide::divisions(&task, moves, settings, observer);
            observer.check()?;
            Ok(Err(NoWay { divisions, ..none }))
        }
    }
}

/// How far the torch leans from straight down at most while the arc burns, rad.
fn greatest_lean(cleared: &Cleared) -> f64 {
    cleared.held.margins.lean.map_or(0.0, |l| l.greatest.value)
}

/// Whether no way leads straight along a program, or the one that was found comes too near something, and nearest along some of its moves.
fn is_in_vain(
    task: &Task<'_>,
    moves: &Commands,
    (site, of): (Site<'_>, &[RangeInclusive<u32>]),
    cleared: &Result<Cleared, NotHeld>,
) -> bool {
    let Ok(cleared) = cleared else { return true };
    if cleared.found == Clearance::Kept {
        return false;
    }
    let near = |around: &Surroundings<'_>| {
        let near = is_nearest_on(task, &cleared.held, around, (wanted(site), of));
        near.unwrap_or(true)
    };
    among(task.cell, moves, site, near).unwrap_or(false)
}

/// The room that a way is to keep, mm.
fn wanted(site: Site<'_>) -> f64 {
    site.settings.limits.clearance + SPARE
}

/// What is found among all that stands around a cell while programs are executed; nothing where no shapes are told.
fn among<T>(
    cell: &Cell,
    moves: &Commands,
    site: Site<'_>,
    find: impl FnOnce(&Surroundings<'_>) -> T,
) -> Option<T> {
    // the metal that is judged is the one that is laid
    let metal = expected(moves, site);
    metal.first()?;
    let at = |command| metal_at(moves, &metal, command);
    let (shapes, plate) = (cell.shapes.as_ref()?, site.settings.plate_thickness);
    Some(find(&Surroundings::new(cell, shapes, &at, plate)))
}

/// The way along programs with joint moves for some travels, whose ends are lifted until they keep clear, and how much more room they leave
/// than is asked for, mm; nothing where no way is found.
fn over_to(
    changes: Vec<Change>,
    (programs, schedules): (&[Program], &[Schedule]),
    moves: &Commands,
    site: Site<'_>,
    observer: &dyn Observer,
) -> Result<Option<(ArmWay, f64)>, ProgramStageError> {
    let settings = site.settings;
    let Some(cell) = &settings.robot else {
        return Ok(None);
    };
    let any = BTreeMap::new();
    let lifted = |lift: f64| {
        let mut programs = programs.to_vec();
        if !over::write(&mut programs, moves, &changes, lift) {
            return Ok(None);
        }
        commands(&programs, schedules, settings, &Reporter::new()).map(Some)
    };
    let mut best: Option<(f64, f64)> = None;
    for lift in over::LIFTS {
        let Some(raised) = lifted(lift)? else {
            return Ok(None);
        };
        let task = free(cell, &raised, settings, &any);
        let room = room_over(&task, &raised, site, observer);
        observer.check()?;
        let Some(room) = room else { continue };
        if best.is_none_or(|(most, _)| room > most + SPARE) {
            best = Some((room, lift));
        }
        if room >= 0.0 {
            break;
        }
    }
    let Some((room, lift)) = best else {
        return Ok(None);
    };
    let Some(raised) = lifted(lift)? else {
        return Ok(None);
    };
    let cleared = held(
        &free(cell, &raised, settings, &any),
        &raised,
        site,
        observer,
    );
    observer.check()?;
    let over = Over { changes, lift };
    let along = (moves.start, &moves.commands[..]);
    let way = cleared.map(|c| ArmWay::along(along, c, over));
    Ok(way.ok().map(|way| (way, room)))
}

/// How much more room than is asked for the joint moves of a program leave to what stands around, mm; nothing where no way holds it. Where no
/// shapes are told, any do.
fn room_over(
    task: &Task<'_>,
    moves: &Commands,
    site: Site<'_>,
    observer: &dyn Observer,
) -> Option<f64> {
    let room = |around: &Surroundings<'_>| {
        collision::room_over(task, around, wanted(site), &Quiet(observer)).ok()
    };
    match among(task.cell, moves, site, room) {
        Some(room) => room,
        None => hold(task, &Quiet(observer)).is_ok().then_some(0.0),
    }
}

/// The way of the robot; clear of metal, table and itself where its file tells shapes and there is such a way.
fn held(
    task: &Task<'_>,
    moves: &Commands,
    site: Site<'_>,
    observer: &dyn Observer,
) -> Result<Cleared, NotHeld> {
    observer.stage("way of the robot", 0);
    let clear = |around: &Surroundings<'_>| hold_clear(task, around, wanted(site), observer);
    among(task.cell, moves, site, clear).unwrap_or_else(|| {
        Ok(Cleared {
            held: hold(task, observer)?,
            found: Clearance::Kept,
        })
    })
}

/// What is held along a program whose way is to be chosen.
pub(super) fn free<'a>(
    cell: &'a Cell,
    moves: &'a Commands,
    settings: &Settings,
    any: &'a BTreeMap<Option<u32>, Stance>,
) -> Task<'a> {
    let axes = match settings.external {
        ExternalChoice::Standing => posture::Axes::Standing,
        ExternalChoice::Free => posture::Axes::Free,
    };
    Task {
        axes,
        ..task(cell, moves, Rotation::Free, any)
    }
}

/// What is held along a program as it is written, its rotation as `rotation` says.
pub(in crate::waam) fn task<'a>(
    cell: &'a Cell,
    moves: &'a Commands,
    rotation: Rotation,
    configurations: &'a BTreeMap<Option<u32>, Stance>,
) -> Task<'a> {
    Task {
        cell,
        values: cell.at_rest(),
        axes: match &moves.external {
            Some(axes) => posture::Axes::Written {
                start: axes.start,
                ends: &axes.ends,
            },
            None => posture::Axes::Standing,
        },
        start: moves.start,
        commands: &moves.commands,
        rotation,
        configurations,
    }
}
