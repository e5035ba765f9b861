//! The robot along a program: how it holds the torch, what its positions then say, and whether they can be reached.

use std::collections::BTreeSet;

use meltpath_base::{Check, Fact, Limit, Measure, Observer, Place, Status};
use meltpath_programs::{Dialect, Program};
use meltpath_robot::cell::{Cell, Stance, Values};
use meltpath_robot::collision::{Clearance, Closest, Metal, Surroundings, sweep};
use meltpath_robot::driven::Driven;
use meltpath_robot::joint_move::JointMove;
use meltpath_robot::posture::{Because, Held, Least, Margins, NotHeld, Rotation, Task, hold};

use crate::job::waam::ExternalChoice;
use crate::waam::drive::axes::{axis, guessed, shown};
use crate::waam::drive::division;
use crate::waam::drive::driven;
use crate::waam::drive::expected::metal_at;
use crate::waam::drive::film::{self, Film, Step};
use crate::waam::drive::held_as;
use crate::waam::drive::hold::{ends, followed};
use crate::waam::drive::joint_moves;
use crate::waam::drive::key_moments;
use crate::waam::drive::lean::Turned;
use crate::waam::drive::no_way::{not_held, what_stands, why};
use crate::waam::drive::positions::{
    Positions, Reached, joint_move, named, stance, stands, written_stance,
};
use crate::waam::drive::said_frames;
use crate::waam::drive::travels;
use crate::waam::drive::unsure;
use crate::waam::drive::way::task;
use crate::waam::maker::reads;
use crate::waam::program::{self, Commands};
use crate::waam::settings::Settings;

/// What the robot does along a program.
#[derive(Debug)]
pub(crate) struct Along {
    margins: Margins,
    /// The words for its ways, in the order in which they come; empty where they have none.
    configurations: Vec<Stance>,
    /// What the programs are written in.
    dialect: Dialect,
    /// Each pair of bodies where they come nearest; nothing where the robot's file tells no shapes.
    closest: Option<Vec<Closest>>,
    /// Positions whose CONFIG is not that of the arm there, and the first of them.
    differing: Option<(usize, Place)>,
    /// Joint moves over which the arm stands another way than before, and how before and after.
    changes: Vec<(u32, [Stance; 2])>,
    /// Its axes along the real motion; nothing where they were not followed.
    driven: Option<Driven>,
    /// Joint moves of whose end the program does not say how the arm stands.
    unsaid: Vec<u32>,
    /// In how many ways the arm can stand at the first position, where the program does not say in which.
    begins: Option<usize>,
    /// The way of the axes.
    steps: Vec<Step>,
}

/// How the robot goes along programs as they are written; nothing where the job names no robot.
pub(in crate::waam) fn along(
    programs: &[Program],
    moves: &Commands,
    settings: &Settings,
    metal: &[(u32, Metal)],
    observer: &dyn Observer,
) -> Option<Result<Along, NotHeld>> {
    let cell = followed(moves, settings)?;
    let dialect = program::spoken(programs);
    let mut programs = programs.to_vec();
    let positions = Positions::of(&programs);
    let named = named(&positions, &mut programs, moves, cell);
    let stands = stands(&named, moves);
    let task = task(cell, moves, Rotation::Written, &stands);
    Some(hold(&task, observer).and_then(|held| {
        let (steps, joint_moves) = film::steps(&task, &held)?;
        let said = |joint: &&JointMove| !named.contains_key(&Some(joint.command));
        let closest = swept(&task, &held, moves, settings, metal).transpose()?;
        let mut along = Along {
            margins: held.margins,
            closest,
            configurations: Vec::new(),
            dialect,
            differing: None,
            changes: Vec::new(),
            driven: driven::told(moves, settings),
            unsaid: joint_moves.iter().filter(said).map(|m| m.command).collect(),
            begins: None,
            steps,
        };
        let mut before = None;
        for reached in ends(&task, &held)? {
            let found = stance(cell, dialect, reached.joints);
            // of an arm that programs have no words for the check of CONFIG tells that
            if reached.command.is_none() && !stands.contains_key(&None) && found.is_some() {
                along.begins = Some(ways(cell, &reached)).filter(|ways| *ways > 1);
            }
            let Some(found) = found.filter(|s| !matches!(s, Stance::Joints(_))) else {
                continue;
            };
            if let (Some(before), Some(command)) = (before.replace(found), reached.command)
                && before != found
            {
                along.changes.push((command, [before, found]));
            }
            if along.configurations.last() != Some(&found) {
                along.configurations.push(found);
            }
            let written = positions
                .at(&mut programs, moves, &reached)
                .and_then(|p| written_stance(p, cell, (reached.tip, reached.external)));
            let stands = |w: &Stance| {
                if joint_move(moves, reached.command) {
                    cell.stands(reached.joints, w)
                } else {
                    cell.stands_within_digits(reached.joints, w)
                }
            };
            if written.is_some_and(|w| !stands(&w)) {
                let place = || moves.place(reached.command.unwrap_or(0), reached.tip.position);
                along.differing.get_or_insert_with(|| (0, place())).0 += 1;
            }
        }
        Ok(along)
    }))
}

/// In how many ways, turns of its joints among them, the arm can stand at the end of a move.
fn ways(cell: &Cell, reached: &Reached) -> usize {
    let values = Values::of(reached.joints, reached.external);
    let found = cell
        .arm
        .inverse(cell.base_from_flange(reached.tip, &values));
    let found = found.map(|f| f.solutions).unwrap_or_default();
    let within = found.iter().filter(|s| s.margin >= 0.0);
    within.map(|s| cell.arm.turns(s.angles).len()).sum()
}

/// What is shown of the robot; nothing where it does not hold the torch along the whole program.
pub(in crate::waam) fn film(along: Option<Result<Along, NotHeld>>) -> Film {
    let Some(Ok(along)) = along else {
        return Film::default();
    };
    let closest = along.closest.as_ref().and_then(|pairs| pairs.first());
    let speed = match &along.driven {
        Some(driven) => driven.speed.map(|peak| peak.most),
        None => along.margins.speed,
    };
    let moments = [
        closest.map(key_moments::clearance),
        nearest_limit(&along).as_ref().map(key_moments::joint_limit),
        speed.as_ref().map(key_moments::fastest),
        key_moments::singularity(&along.margins),
        Some(key_moments::end()),
    ];
    Film {
        steps: along.steps,
        moments: moments.into_iter().flatten().collect(),
    }
}

/// The joint that comes nearest to its limits, on the path as written and on the one that is driven.
fn nearest_limit(along: &Along) -> Option<Least> {
    let driven = along.driven.as_ref().and_then(|d| d.limit);
    let both = [along.margins.limit, driven].into_iter().flatten();
    both.min_by(|a, b| a.value.total_cmp(&b.value))
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
    metal.first()?;
    let at = |command| metal_at(moves, metal, command);
    let around = Surroundings::new(task.cell, shapes, &at, settings.plate_thickness);
    Some(sweep(task, held, &around, settings.limits.clearance))
}

/// How the torch leans, where track or positioner move.
pub(in crate::waam) fn turned(
    along: Option<&Result<Along, NotHeld>>,
    moves: &Commands,
) -> Option<Turned> {
    let (Some(Ok(along)), Some(_)) = (along, &moves.external) else {
        return None;
    };
    let lean = along.margins.lean?;
    let place = moves.place(lean.greatest.command, lean.greatest.position);
    Some(Turned::new(lean, place))
}

/// The checks of reach, joint speeds, collision and CONFIG.
pub(in crate::waam) fn checks(
    along: Option<&Result<Along, NotHeld>>,
    (programs, moves): (&[Program], &Commands),
    settings: &Settings,
) -> Vec<Check> {
    let (Some(along), Some(cell)) = (along, &settings.robot) else {
        return not_checked(match settings.robot {
            Some(_) => TURNS,
            None => NO_ROBOT,
        });
    };
    let checks = match along {
        Err(not) => {
            // of a way that was looked for it is told where that ends, not where the positions that were written without one do
            let not = moves.not_held.as_ref().unwrap_or(not);
            let mut checks = vec![not_reached(not, moves, (settings, cell))];
            checks.extend(
                not_checked("the robot does not hold the torch along the whole program")
                    .split_off(1),
            );
            checks
        }
        Ok(along) => [
            guessed(reached(along, moves, settings, cell), &cell.guesses()),
            guessed(
                driven::speed(
                    (along.driven.as_ref(), along.margins.speed),
                    moves,
                    settings,
                ),
                &cell.guesses(),
            ),
            guessed(
                driven::acceleration(along.driven.as_ref(), moves, settings),
                &cell.guesses(),
            ),
            collision(along, moves, settings, cell),
            config(along, cell),
        ]
        .map(|check| begun(check, along, moves))
        .into_iter()
        .chain(track(along, moves, cell))
        .collect(),
    };
    let undecided = |check| {
        let check = said_frames::undecided(check, &moves.elsewhere);
        let check = unsure::undecided(check, &moves.gaps, &moves.unsure);
        unsure::undecided_of_another_arm(check, programs, settings)
    };
    checks.into_iter().map(undecided).collect()
}

/// How far a track keeps from its ends at least, mm: it never stands exactly where its file says.
const TRACK: f64 = 1.0;
const NO_ROBOT: &str =
    "the job names no robot: write machine.robot, a name that ships or a file of your own";
const TURNS: &str = "axes turn the part while metal is laid that are not those of the robot's file: write its [positioner] with as many";
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

/// The least distance of a joint of arm or positioner from its limits, on the path as written and on the one that is driven.
fn reached(along: &Along, moves: &Commands, settings: &Settings, cell: &Cell) -> Check {
    let turned = (1..3).filter_map(|axis| along.margins.external(cell, axis));
    let all = nearest_limit(along).into_iter().chain(turned);
    let least = all.min_by(|a, b| a.value.total_cmp(&b.value));
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
            .because(&axis(l.joint))
            .remedy(format!(
                "place the part elsewhere (machine.place, or {} of the robot's file)",
                what_stands(settings.robot.as_ref())
            )),
        None => check,
    }
}

/// The track's least distance from its ends, where it carries the arm.
fn track(along: &Along, moves: &Commands, cell: &Cell) -> Option<Check> {
    let least = along.margins.external(cell, 0)?;
    let check = Check::judge(
        "track",
        "least distance of the track from its ends",
        Measure::exact(least.value, "mm"),
        Limit::AtLeast(TRACK),
    )
    .at(moves.place(least.command, least.position))
    .remedy(
        "place the part elsewhere along the track (machine.place, or [table] of the robot's file)",
    );
    Some(guessed(check, &cell.guesses()))
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
    let check = match (moves.clearance, check.status) {
        (Some(Clearance::InVain), Status::Fail) => {
            check.because("other ways to hold the torch there were tried: none keeps clear")
        }
        _ => check,
    };
    let check = held_as::hulls(check, worst, settings.limits.clearance, cell);
    let check = swung(check, worst.distance - settings.limits.clearance, moves);
    let check = unsaid(check, &along.unsaid, moves);
    let check = match cell.shapes.as_ref().and_then(|s| s.table) {
        Some(_) => check,
        None => check.because("the table is not checked: shapes.table is not written"),
    };
    let guesses = cell.guesses().into_iter().chain(cell.guessed_shapes());
    let guesses: Vec<String> = guesses.collect();
    guessed(check, &guesses)
}

/// Nothing passes that the torch might touch where it swings beside the path that was followed; `room` mm are left along the path.
fn swung(check: Check, room: f64, moves: &Commands) -> Check {
    let swings = moves.weaves.iter().map(|w| w.amplitude);
    let swing = swings.fold(0.0, f64::max);
    if check.status != Status::Pass || swing <= room {
        return check;
    }
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&format!(
        "the torch swings {swing:.1} mm beside the path that is followed, farther than there is room beyond the limit"
    ))
}

/// Nothing passes where the arm may begin another way than is taken here: from there it goes along another way as a whole.
fn begun(check: Check, along: &Along, moves: &Commands) -> Check {
    let open = !matches!(check.status, Status::Fail | Status::NotChecked);
    let Some(ways) = along.begins.filter(|_| open) else {
        return check;
    };
    let (program, line) = moves.start_line;
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&format!(
        "how the arm stands at the first position is not said (program {}, line {line}), and it can in {ways} ways; what was checked goes on from one that was chosen here",
        program + 1
    ))
    .remedy("touch up the first position at the controller, so that it carries a configuration, or lead there by joints")
}

/// Nothing passes on joint moves that may end another way than is taken here: the arm then sweeps elsewhere.
fn unsaid(check: Check, unsaid: &[u32], moves: &Commands) -> Check {
    let Some(first) = unsaid.first().filter(|_| check.status == Status::Pass) else {
        return check;
    };
    let (program, line) = joint_moves::line(*first, moves);
    Check {
        status: Status::CannotSay,
        ..check
    }
    .because(&format!(
        "how the arm stands at the end of joint moves is not said: {}, first in program {program}, line {line}; what was checked leads to a way that was chosen here",
        unsaid.len()
    ))
    .remedy("touch up the position at the controller, so that it carries a configuration")
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
        let own = reads(cell.maker, along.dialect);
        let why = if own {
            format!(
                "how {} stands is said in no words of a maker that are known here",
                cell.name
            )
        } else {
            format!(
                "a program for {} says nothing of how the arm of another maker stands ({})",
                along.dialect.name(),
                cell.name
            )
        };
        return Check::not_checked("config", CONFIG, &why)
            .remedy("programs for the robot's own controller: program.dialect of the cell's file");
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

/// Where and why a program cannot be held.
fn not_reached(not: &NotHeld, moves: &Commands, (settings, cell): (&Settings, &Cell)) -> Check {
    let (reason, remedy) = not_held(not, cell);
    let searched = settings.external == ExternalChoice::Free && moves.not_held.is_some();
    let reason = if searched {
        format!("with track and positioner where they serve best: {reason}")
    } else {
        reason
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

/// Joint moves over which the arm goes to another way, and why.
fn way_changes(along: &Along, moves: &Commands) -> Option<Fact> {
    let seen = along.changes.iter().map(|c| c.0);
    let seen = seen.filter(|c| joint_move(moves, Some(*c)));
    let all: BTreeSet<u32> = seen.chain(moves.over.iter().map(|o| o.command)).collect();
    let place = |command: u32| {
        let target = moves.commands.get(command as usize).map(|c| c.target);
        moves.place(command, target.unwrap_or_default())
    };
    let told = |command: &u32| {
        let stood = along.changes.iter().find(|c| c.0 == *command);
        let stood = stood.map(|(_, [before, after])| format!(" from {before} to {after}"));
        let over = moves.over.iter().find(|o| o.command == *command);
        let since = over.map(|o| match &o.why {
            Because::NotHeld(not) => {
                let at = moves.place(not.command, not.position);
                let why = why(not, what_stands(None)).0;
                format!(", as no way from before leads past {at}: {why}")
            }
            Because::OtherDirection => ", as the torch goes on in another direction".to_owned(),
            Because::TurnedBack => {
                ", so that the positioner turns back and keeps the torch upright".to_owned()
            }
        });
        let [stood, since] = [stood, since].map(Option::unwrap_or_default);
        format!("at {}{stood}{since}", place(*command))
    };
    let first = place(*all.first()?);
    let words: Vec<String> = all.iter().map(told).collect();
    let fact = Fact::new(
        "way-changes",
        "changes of the arm's way in the air, by joint moves",
        Measure::exact(words.len() as f64, ""),
        &shown(&words),
    );
    Some(fact.at(first))
}

/// How near the arm comes to its singularities, where it changes its way, and which travels its axes make longer.
pub(in crate::waam) fn facts(
    along: Option<&Result<Along, NotHeld>>,
    moves: &Commands,
    settings: &Settings,
) -> Vec<Fact> {
    let joint_moves = joint_moves::fact(moves, settings);
    let Some(Ok(along)) = along else {
        return joint_moves.into_iter().collect();
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
    .chain(division::fact(&moves.divided))
    .chain(way_changes(along, moves))
    .chain(joint_moves)
    .chain(travels::fact(moves))
    .chain(driven::fact(moves))
    .collect()
}
