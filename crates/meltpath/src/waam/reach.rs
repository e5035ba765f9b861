//! The robot along a program: how it holds the torch, what its positions then say, and whether they can be reached.

use std::collections::BTreeMap;

use meltpath_base::{Check, Fact, Limit, Measure, Place, Reporter, Status};
use meltpath_geometry::Pose;
use meltpath_programs::program::{Coordinates, Instruction, MotionKind, PositionRef};
use meltpath_programs::{Dialect, Program, Schedule, dry_run};
use meltpath_robot::cell::{Cell, Stance};
use meltpath_robot::collision::{Closest, Metal, Surroundings, sweep};
use meltpath_robot::kinematics::Unreachable;
use meltpath_robot::posture::{
    End, Follower, Held, Least, Margins, NotHeld, Rotation, Task, Why, hold,
};
use meltpath_toolpath::Toolpath;

use super::film::{self, Moment, Step};
use super::program::{self, Commands, ProgramStageError, Programs, commands};
use super::record;
use super::settings::Settings;
use super::wanted::{Asked, Torch};

/// What the robot does along a program.
#[derive(Debug)]
pub(crate) struct Along {
    margins: Margins,
    /// The words for its ways, in the order in which they come; empty where they have none.
    configurations: Vec<Stance>,
    /// Each pair of bodies where they come nearest; nothing where the robot's file tells no shapes.
    closest: Option<Vec<Closest>>,
    /// Positions whose CONFIG is not that of the arm there, and the first of them.
    differing: Option<(usize, Place)>,
    /// The way of the axes.
    steps: Vec<Step>,
}

/// The programs of a toolpath, their positions as the job's robot holds them, written and read back.
///
/// # Errors
/// [`ProgramStageError`].
pub(super) fn write(
    name: &str,
    toolpath: &Toolpath,
    asked: Asked,
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Programs, ProgramStageError> {
    let mut built = program::make(name, toolpath, asked, settings, reporter)?;
    choose(&mut built.programs, &built.schedules, settings)?;
    if asked.1.torch == Torch::Dry {
        dry_run(&mut built.programs);
    }
    program::write(built, &settings.cell.program)
}

/// Chooses how the robot holds the torch along programs, and writes it into their positions. Where it cannot hold it they stay as
/// they are: [`along`] tells why.
fn choose(
    programs: &mut [Program],
    schedules: &[Schedule],
    settings: &Settings,
) -> Result<(), ProgramStageError> {
    let Some(cell) = &settings.robot else {
        return Ok(());
    };
    let moves = commands(programs, schedules, settings, &Reporter::new())?;
    if moves.turns {
        return Ok(());
    }
    let any = BTreeMap::new();
    let task = task(cell, &moves, Rotation::Free, &any);
    let Ok(held) = hold(&task) else {
        return Ok(());
    };
    let positions = Positions::of(programs);
    let dialect = program::spoken(programs);
    for reached in ends(&task, &held).unwrap_or_default() {
        let stance = stance(cell, dialect, reached.joints);
        if let Some(coordinates) = positions.at(programs, &moves, &reached) {
            hold_so(coordinates, stance, &reached);
        }
    }
    Ok(())
}

/// How the robot goes along programs as they are written; nothing where the job names no robot.
pub(super) fn along(
    programs: &[Program],
    moves: &Commands,
    settings: &Settings,
    metal: &[(u32, Metal)],
) -> Option<Result<Along, NotHeld>> {
    let cell = settings.robot.as_ref().filter(|_| !moves.turns)?;
    let dialect = program::spoken(programs);
    let mut programs = programs.to_vec();
    let positions = Positions::of(&programs);
    let named = named(&positions, &mut programs, moves, cell);
    let task = task(cell, moves, Rotation::Written, &named);
    Some(hold(&task).and_then(|held| {
        let closest = swept(&task, &held, moves, settings, metal).transpose()?;
        let mut along = Along {
            margins: held.margins,
            closest,
            configurations: Vec::new(),
            differing: None,
            steps: film::steps(&task, &held)?,
        };
        for reached in ends(&task, &held)? {
            let found = stance(cell, dialect, reached.joints);
            let Some(found) = found.filter(|s| !matches!(s, Stance::Joints(_))) else {
                continue;
            };
            if along.configurations.last() != Some(&found) {
                along.configurations.push(found);
            }
            let written = positions
                .at(&mut programs, moves, &reached)
                .and_then(|c| written_stance(c, cell));
            if written.is_some_and(|w| w != found) {
                let place = || moves.place(reached.command.unwrap_or(0), reached.tip.position);
                along.differing.get_or_insert_with(|| (0, place())).0 += 1;
            }
        }
        Ok(along)
    }))
}

/// The cell at every moment of the simulated motion; nothing where the robot does not hold the torch along the whole program.
pub(super) fn moments(
    along: Option<&Result<Along, NotHeld>>,
    samples: &[record::Sample],
    moves: &Commands,
) -> Vec<Moment> {
    match along {
        Some(Ok(along)) => film::moments(&along.steps, samples, &moves.layer_of_command),
        _ => Vec::new(),
    }
}

/// How near bodies come. While a layer is laid its metal counts as laid already.
fn swept(
    task: &Task<'_>,
    held: &Held,
    moves: &Commands,
    settings: &Settings,
    metal: &[(u32, Metal)],
) -> Option<Result<Vec<Closest>, NotHeld>> {
    let shapes = task.cell.shapes.as_ref()?;
    let (_, first) = metal.first()?;
    let at = |command: u32| {
        let layer = moves.layer_of_command.get(command as usize);
        let until = metal.partition_point(|(l, _)| layer.is_some_and(|layer| l <= layer));
        metal.get(until.saturating_sub(1)).map_or(first, |m| &m.1)
    };
    let around = Surroundings {
        shapes,
        metal: &at,
        plate: settings.plate_thickness,
    };
    Some(sweep(task, held, &around))
}

fn task<'a>(
    cell: &'a Cell,
    moves: &'a Commands,
    rotation: Rotation,
    configurations: &'a BTreeMap<Option<u32>, Stance>,
) -> Task<'a> {
    Task {
        cell,
        values: cell.at_rest(),
        start: moves.start,
        commands: &moves.commands,
        rotation,
        configurations,
    }
}

/// An end of a move.
struct Reached {
    /// The move; nothing for the start.
    command: Option<u32>,
    end: End,
    tip: Pose,
    joints: [f64; 6],
}

/// The ends of all moves, those of no length too.
fn ends(task: &Task<'_>, held: &Held) -> Result<Vec<Reached>, NotHeld> {
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
            };
            ends.push(reached(command));
        }
    }
    // moves that go nowhere end as the one before
    let mut all: Vec<Reached> = Vec::with_capacity(ends.len());
    for reached in ends {
        if let (Some(command), Some(before)) = (reached.command, all.last()) {
            let (tip, joints) = (before.tip, before.joints);
            let missed = before.command.map_or(0, |c| c + 1)..command;
            all.extend(missed.map(|c| Reached {
                command: Some(c),
                end: End::Target,
                tip,
                joints,
            }));
        }
        all.push(reached);
    }
    Ok(all)
}

/// How the arm stands, where the dialect has its maker's words.
fn stance(cell: &Cell, dialect: Dialect, joints: [f64; 6]) -> Option<Stance> {
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

fn written_stance(coordinates: &Coordinates, cell: &Cell) -> Option<Stance> {
    let Coordinates::Cartesian { config, .. } = coordinates else {
        return None;
    };
    Stance::read(cell.maker, config)
}

/// Writes rotation and configuration into a position.
fn hold_so(coordinates: &mut Coordinates, stance: Option<Stance>, reached: &Reached) {
    let said = stance.map(|s| s.to_string());
    if let Coordinates::Cartesian {
        config,
        wpr_degrees: wpr,
        ..
    } = coordinates
    {
        *wpr = reached.tip.wpr().to_array().map(f64::to_degrees);
        *config = said.unwrap_or_else(|| std::mem::take(config));
    }
}

/// How joint moves end, as the program says.
fn named(
    positions: &Positions,
    programs: &mut [Program],
    moves: &Commands,
    cell: &Cell,
) -> BTreeMap<Option<u32>, Stance> {
    let mut named = BTreeMap::new();
    let joint = moves
        .commands
        .iter()
        .filter(|c| matches!(c.kind, meltpath_robot::Kind::Joint));
    for command in std::iter::once(None).chain(joint.map(|c| Some(c.id))) {
        let reached = Reached {
            command,
            end: End::Target,
            tip: Pose::IDENTITY,
            joints: [0.0; 6],
        };
        let written = positions.at(programs, moves, &reached);
        if let Some(stance) = written.and_then(|c| written_stance(c, cell)) {
            named.insert(command, stance);
        }
    }
    named
}

/// Where the positions of programs stand in their tables.
struct Positions(Vec<BTreeMap<u32, usize>>);

impl Positions {
    fn of(programs: &[Program]) -> Self {
        let table = |p: &Program| {
            p.positions
                .iter()
                .zip(0..)
                .map(|(p, i)| (p.index, i))
                .collect()
        };
        Positions(programs.iter().map(table).collect())
    }

    /// The robot's coordinates at the end of a move.
    fn at<'a>(
        &self,
        programs: &'a mut [Program],
        moves: &Commands,
        reached: &Reached,
    ) -> Option<&'a mut Coordinates> {
        let (program, line) = match reached.command {
            Some(command) => *moves.line_of_command.get(command as usize)?,
            None => moves.start_line,
        };
        let table = self.0.get(program as usize)?;
        let program = programs.get_mut(program as usize)?;
        let instruction = program.instructions.get((line as usize).checked_sub(1)?)?;
        let Instruction::Motion(motion) = instruction else {
            return None;
        };
        let reference = match (reached.end, &motion.kind) {
            (End::Target, _) => &motion.target,
            (End::Via, MotionKind::Circular { via }) => via,
            (End::Via, _) => return None,
        };
        let PositionRef::Point { index, .. } = reference else {
            return None;
        };
        let position = program.positions.get_mut(*table.get(index)?)?;
        let robot = position.groups.iter_mut().find(|g| g.number == 1)?;
        Some(&mut robot.coordinates)
    }
}

/// The checks of reach, joint speeds, collision and CONFIG.
pub(super) fn checks(
    along: Option<&Result<Along, NotHeld>>,
    moves: &Commands,
    settings: &Settings,
) -> Vec<Check> {
    let (Some(along), Some(cell)) = (along, &settings.robot) else {
        return not_checked(if moves.turns { TURNS } else { NO_ROBOT });
    };
    match along {
        Err(not) => {
            let mut checks = vec![not_reached(not, moves, cell)];
            checks.extend(
                not_checked("the robot does not hold the torch along the whole program")
                    .split_off(1),
            );
            checks
        }
        Ok(along) => vec![
            guessed(reached(&along.margins, moves, settings), &cell.guesses()),
            guessed(speed(&along.margins, moves), &cell.guesses()),
            collision(along, moves, settings, cell),
            config(along, cell),
        ],
    }
}

const NO_ROBOT: &str =
    "the job names no robot: write machine.robot, a name that ships or a file of your own";
const TURNS: &str = "a positioner turns the part while metal is laid, and the arm is not followed beside a positioner that moves";
const REACH: &str = "reach of the robot";
const COLLISION: &str = "collision of torch, robot and part";
const CONFIG: &str = "robot CONFIG";

fn not_checked(reason: &str) -> Vec<Check> {
    [
        ("reach", REACH),
        ("collision", COLLISION),
        ("config", CONFIG),
    ]
    .map(|(id, title)| Check::not_checked(id, title, reason))
    .to_vec()
}

/// The least distance of a joint from its limits.
fn reached(margins: &Margins, moves: &Commands, settings: &Settings) -> Check {
    let least = margins.limit;
    let degrees = least.map_or(f64::NAN, |l| l.value.to_degrees());
    let check = Check::judge(
        "reach",
        "reach of the robot: least distance of a joint from its limits",
        Measure::exact(degrees, "deg"),
        Limit::AtLeast(settings.limits.joint_margin.to_degrees()),
    );
    match least {
        Some(l) => check
            .at(moves.place(l.command, l.position))
            .because(&format!("joint {}", l.joint + 1))
            .remedy("place the part elsewhere (machine.place, or [table] of the robot's file)"),
        None => check,
    }
}

/// The greatest joint speed along beads.
fn speed(margins: &Margins, moves: &Commands) -> Check {
    const ID: &str = "joint-speed";
    const TITLE: &str = "speed of joints along beads, share of what they can do";
    match margins.speed {
        Some(l) => Check::judge(
            ID,
            TITLE,
            Measure::exact(100.0 * l.value, "%"),
            Limit::AtMost(100.0),
        )
        .at(moves.place(l.command, l.position))
        .because(&format!("joint {}", l.joint + 1))
        .remedy("a lower travel speed, or the part elsewhere: near a singularity joints turn fast"),
        None => Check::not_checked(ID, TITLE, "the robot's file tells no speeds"),
    }
}

/// The pair that comes nearest, and those after it.
fn collision(along: &Along, moves: &Commands, settings: &Settings, cell: &Cell) -> Check {
    let Some([worst, ..]) = along.closest.as_deref() else {
        return Check::not_checked(
            "collision",
            COLLISION,
            "the robot's file tells no shapes: write [shapes], or try the program in the cell's simulator",
        );
    };
    let check = Check::judge(
        "collision",
        "least distance of torch and robot from part, table and each other",
        Measure::exact(worst.distance, "mm"),
        Limit::AtLeast(settings.limits.clearance),
    )
    .at(moves.place(worst.command, worst.position))
    .because(&pair(worst))
    .remedy("another machine.place, more clearance of travels, or a slimmer nozzle");
    let check = match cell.shapes.as_ref().and_then(|s| s.table) {
        Some(_) => check,
        None => check.because("the table is not checked: shapes.table is not written"),
    };
    let shapes = cell.shapes_are_guessed().then(|| "shapes".to_owned());
    let guesses: Vec<String> = cell.guesses().into_iter().chain(shapes).collect();
    guessed(check, &guesses)
}

fn pair(closest: &Closest) -> String {
    let [a, b] = closest.bodies;
    format!("{a} and {b}")
}

/// Pairs that come nearer than this are told with their place, mm.
const NEAR: f64 = 100.0;

/// Every pair where it comes nearest.
fn clearances(along: &Along, moves: &Commands) -> Option<Fact> {
    let told = |c: &Closest| {
        let told = format!("{} {:.1} mm", pair(c), c.distance);
        if c.distance < NEAR {
            format!("{told} ({})", moves.place(c.command, c.position))
        } else {
            told
        }
    };
    let told: Vec<String> = along.closest.as_ref()?.iter().map(told).collect();
    let title = "least distance of each pair that comes within a metre";
    Some(Fact::words("clearances", title, &told.join("; ")))
}

fn config(along: &Along, cell: &Cell) -> Check {
    if along.configurations.is_empty() {
        return Check::not_checked(
            "config",
            CONFIG,
            &format!(
                "how an arm stands is said in its maker's words (FANUC, KUKA, ABB, Yaskawa, Stäubli); {} has none that are known here",
                cell.name
            ),
        );
    }
    let words: Vec<String> = along
        .configurations
        .iter()
        .map(ToString::to_string)
        .collect();
    let (count, place) = along.differing.clone().unwrap_or_default();
    let check = Check::judge(
        "config",
        "robot CONFIG: positions that do not carry the arm's",
        Measure::exact(count as f64, ""),
        Limit::AtMost(0.0),
    );
    let check = if count > 0 { check.at(place) } else { check };
    let check = check.because(&format!("computed: {}", shown(&words)));
    check.remedy("touch up the position at the controller, or write the program by meltpath")
}

/// The first of many words.
fn shown(words: &[String]) -> String {
    const MOST: usize = 4;
    let first = words.chunks(MOST).next().unwrap_or_default().join("; ");
    match words.len().saturating_sub(MOST) {
        0 => first,
        more => format!("{first}; and {more} changes more"),
    }
}

/// Where and why a program cannot be held.
fn not_reached(not: &NotHeld, moves: &Commands, cell: &Cell) -> Check {
    let (reason, remedy) = match not.why {
        Why::Unreachable(why) => (
            why.to_string(),
            match why {
                Unreachable::TooFar { .. } => "move the part nearer: machine.place, or [table] of the robot's file",
                _ => "move the part: machine.place, or [table] of the robot's file",
            }
            .to_owned(),
        ),
        Why::Limit { joint, by } => (
            format!("whatever the rotation about the wire, a joint is beyond its limits: at best joint {}, by {:.1} deg", joint + 1, by.to_degrees()),
            "move the part: machine.place, or [table] of the robot's file".to_owned(),
        ),
        Why::Configuration(wanted) => (
            format!("no way to hold the torch there within limits is {wanted}, as the program says"),
            "touch up the position at the controller".to_owned(),
        ),
        Why::Change => (
            "the torch can be held there, but not by going on from the places before: the arm would have to change its configuration, or wind a joint beyond its limits, within a move".to_owned(),
            "move the part, so that the wrist stays on one side of the first axis and its own axes do not come in line".to_owned(),
        ),
    };
    let check = Check {
        status: Status::Fail,
        reason,
        ..Check::not_checked("reach", REACH, "")
    };
    let guesses = cell.guesses();
    let check = if guesses.is_empty() {
        check
    } else {
        check.because(&format!(
            "with the guesses of the robot's file: {}",
            guesses.join(", ")
        ))
    };
    check
        .at(moves.place(not.command, not.position))
        .remedy(remedy)
}

/// Nothing passes by a guess.
fn guessed(check: Check, guesses: &[String]) -> Check {
    if guesses.is_empty() || !matches!(check.status, Status::Pass | Status::Warn) {
        return check;
    }
    let reason = format!(
        "within the limit, but the robot's file guesses {}",
        guesses.join(", ")
    );
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&reason)
    .remedy("measure them, and write them with their `source` into a robot file of your own (meltpath inspect shows it)")
}

/// How near the arm comes to its singularities.
pub(super) fn facts(along: Option<&Result<Along, NotHeld>>, moves: &Commands) -> Vec<Fact> {
    let Some(Ok(along)) = along else {
        return Vec::new();
    };
    let m = &along.margins;
    let angle =
        |id, title, l: Option<Least>| (id, title, l.map(|l| (l, l.value.to_degrees(), "deg")));
    [
        angle(
            "singular-wrist",
            "J5 from where the wrist's axes are in line, at least",
            m.wrist,
        ),
        angle(
            "singular-elbow",
            "elbow from the stretched arm, at least",
            m.elbow,
        ),
        (
            "singular-shoulder",
            "centre of the wrist from the first axis, at least",
            m.shoulder.map(|l| (l, l.value, "mm")),
        ),
    ]
    .into_iter()
    .filter_map(|(id, title, least)| {
        let (l, value, unit) = least?;
        let fact = Fact::new(id, title, Measure::exact(value, unit), "");
        Some(fact.at(moves.place(l.command, l.position)))
    })
    .chain(clearances(along, moves))
    .collect()
}
