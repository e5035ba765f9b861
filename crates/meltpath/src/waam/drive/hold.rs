//! How the job's robot holds the torch along programs, and what their positions then say.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::sync::Arc;

use meltpath_base::{Observer, Quiet, Reporter};
use meltpath_geometry::Pose;
use meltpath_programs::program::{Axis, Coordinates, Position};
use meltpath_programs::{Dialect, Program, Schedule, dry_run, tell};
use meltpath_robot::cell::{Cell, External, Stance, Values};
use meltpath_robot::collision::{
    self, Clearance, Cleared, Surroundings, hold_clear, is_nearest_on,
};
use meltpath_robot::command::Kind;
use meltpath_robot::posture::{self, Change, End, Follower, Held, NotHeld, Rotation, Task, hold};
use meltpath_toolpath::Toolpath;

use crate::job::waam::ExternalChoice;
use crate::waam::drive::arm_way::{ArmWay, Over};
use crate::waam::drive::divide;
use crate::waam::drive::division::Division;
use crate::waam::drive::expected::{expected, metal_at};
use crate::waam::drive::over;
use crate::waam::drive::positions::{Positions, Reached};
use crate::waam::drive::site::Site;
use crate::waam::program::wanted::{Asked, Torch};
use crate::waam::program::{self, Axes, Chosen, Commands, ProgramStageError, Programs, commands};
use crate::waam::settings::Settings;

/// The robot that is followed along a program; nothing where the job names none, or where others turn the part than it knows.
pub(in crate::waam) fn followed<'a>(moves: &Commands, settings: &'a Settings) -> Option<&'a Cell> {
    let known = !moves.turns || moves.external.is_some();
    settings.robot.as_ref().filter(|_| known)
}

/// Room that the way keeps beyond what the verdict asks for, mm.
const SPARE: f64 = 1.0;

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
        Err(divisions) => {
            return Ok(Chosen {
                divisions,
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
            tell(position, reached.tip, axes, positioner);
        }
    }
    Ok(Chosen {
        external: free.then(|| axes_of(&reached, &moves)),
        clearance: Some(*found),
        over: way.over.changes.clone(),
        way: Some(way),
        divisions: Vec::new(),
    })
}

/// What is held along a program whose way is to be chosen.
fn free<'a>(
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

/// The way along programs. Where no single way holds them, travels are to become joint moves over which the arm goes to another one. Where that
/// does not help it is told which beads to divide first, if any.
fn looked_for(
    (programs, schedules): (&[Program], &[Schedule]),
    moves: &Commands,
    site: Site<'_>,
    observer: &dyn Observer,
) -> Result<Result<ArmWay, Vec<Division>>, ProgramStageError> {
    let settings = site.settings;
    let none = Vec::new();
    let Some(cell) = &settings.robot else {
        return Ok(Err(none));
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
            why: None,
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
    if let Ok(cleared) = cleared {
        let along = (moves.start, &moves.commands[..]);
        return Ok(Ok(ArmWay::along(along, cleared, Over::default())));
    }
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
            Ok(Err(divisions))
        }
    }
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
    Some(find(&Surroundings {
        shapes: cell.shapes.as_ref()?,
        metal: &at,
        plate: site.settings.plate_thickness,
    }))
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

/// How the arm stands, where the dialect has its maker's words.
pub(in crate::waam) fn stance(cell: &Cell, dialect: Dialect, joints: [f64; 6]) -> Option<Stance> {
    let stance = cell.stance(joints)?;
    let spoken = match stance {
        Stance::Fanuc(_) => Dialect::FanucLs,
        Stance::Kuka { .. } => Dialect::Krl,
        Stance::Abb(_) => Dialect::Rapid,
        Stance::Joints(_) => Dialect::UrScript,
        Stance::Yaskawa(_) => Dialect::Inform,
        Stance::Staubli(_) => Dialect::Val3,
    };
    (spoken == dialect).then_some(stance)
}

/// How the arm stands, as a position says; `reached` with the wire's tip there, and with track and positioner.
pub(in crate::waam) fn written_stance(
    position: &mut Position,
    cell: &Cell,
    (tip, external): (Pose, External),
) -> Option<Stance> {
    match of_robot(position)? {
        Coordinates::Cartesian { config, .. } => Stance::read(cell.maker, config),
        Coordinates::Joint(axes) => {
            let (shown, _) = Axis::of_arm(axes)?;
            let joints = cell.arm.joints(shown.map(f64::to_radians));
            let flange = cell.base_from_flange(tip, &Values::of(joints, external));
            // a move may shift its target: then only the way of the arm is said
            if cell.arm.holds(flange, joints) {
                Some(Stance::Joints(shown))
            } else {
                cell.stance(joints)
            }
        }
        Coordinates::Unread(_) => None,
    }
}

/// The robot's coordinates of a position.
fn of_robot(position: &mut Position) -> Option<&mut Coordinates> {
    let robot = position.groups.iter_mut().find(|g| g.number == 1)?;
    Some(&mut robot.coordinates)
}

/// Writes rotation and configuration into a position.
fn hold_so(coordinates: &mut Coordinates, stance: Option<Stance>, tip: Pose) {
    let said = stance.map(|s| s.to_string());
    if let Coordinates::Cartesian {
        config,
        wpr_degrees: wpr,
        ..
    } = coordinates
    {
        *wpr = tip.wpr().to_array().map(f64::to_degrees);
        *config = said.unwrap_or_else(|| std::mem::take(config));
    }
}

/// How joint moves end, as the program says.
pub(in crate::waam) fn named(
    positions: &Positions,
    programs: &mut [Program],
    moves: &Commands,
    cell: &Cell,
) -> BTreeMap<Option<u32>, Stance> {
    let mut named = BTreeMap::new();
    let joint = moves
        .commands
        .iter()
        .filter(|c| matches!(c.kind, Kind::Joint(_)));
    let start = (None, moves.start);
    let rest = cell.at_rest().external();
    let ends = joint.map(|c| {
        (
            Some(c.id),
            Pose {
                position: c.target,
                orientation: c.orientation,
            },
        )
    });
    for (command, tip) in std::iter::once(start).chain(ends) {
        let external = moves.external.as_ref().map_or(rest, |a| a.at(command));
        let reached = Reached {
            command,
            end: End::Target,
            tip,
            joints: [0.0; 6],
            external,
        };
        let written = positions.at(programs, moves, &reached);
        if let Some(stance) = written.and_then(|c| written_stance(c, cell, (tip, external))) {
            named.insert(command, stance);
        }
    }
    named
}
