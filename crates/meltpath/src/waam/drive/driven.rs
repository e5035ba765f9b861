//! The axes of the robot along its real motion: how slow they make it, and what the verdict says of their speeds and accelerations while the arc burns.

use meltpath_base::{Check, Fact, Limit, Measure, Observer, Quiet, Status};
use meltpath_robot::command::Source;
use meltpath_robot::driven::{Driven, Peak, drive};
use meltpath_robot::posture::{Held, Least, Task};

use crate::waam::drive::axes::axis;
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// m/min in a mm/s.
const M_PER_MIN: f64 = 0.06;

/// The axes along the motion of a held program. Where nobody says how the controller interpolates, it goes round corners at once, and what
/// accelerations ask there is not known: speeds alone are kept.
pub(in crate::waam) fn along(
    task: &Task<'_>,
    held: &Held,
    moves: &Commands,
    (settings, observer): (&Settings, &dyn Observer),
) -> Option<Driven> {
    let weaves = (&moves.weaves[..], &moves.weave_of_command[..]);
    let drive = |task: &Task<'_>| {
        let (joint_moves, controller) = (&moves.joint_moves, &settings.controller);
        drive(
            task,
            held,
            joint_moves,
            controller,
            weaves,
            &Quiet(observer),
        )
        .ok()
    };
    if settings.cell.motion.is_some() {
        return drive(task);
    }
    let by_speeds = task.cell.without_accelerations();
    drive(&Task {
        cell: &by_speeds,
        ..*task
    })
}

/// What the verdict tells of the axes along the motion: nothing where nobody says how the controller interpolates.
pub(in crate::waam) fn told(moves: &Commands, settings: &Settings) -> Option<Driven> {
    settings.cell.motion.as_ref()?;
    moves.driven.clone()
}

const SPEED: &str = "speed of axes along beads, share of what they can do";
const ACCELERATION: &str = "acceleration of axes along beads, share of what they can do";

/// The greatest speed of an axis along beads; where the motion is not known, that at the set speed along the path as `written`.
pub(in crate::waam) fn speed(
    (driven, written): (Option<&Driven>, Option<Least>),
    moves: &Commands,
    settings: &Settings,
) -> Check {
    let id = "joint-speed";
    let set = |most: Least| {
        let command = moves.commands.get(most.command as usize);
        let speed = command.map_or(0.0, |c| c.speed);
        Peak::written(most, speed)
    };
    let peak = match driven {
        Some(driven) => driven.speed,
        None => written.map(set),
    };
    match peak {
        Some(peak) => judged((id, SPEED), (driven, &peak), moves, settings),
        None if !moves.lays() => Check::not_checked(id, SPEED, "no bead is laid"),
        None => Check::not_checked(id, SPEED, "the robot's file tells no speeds"),
    }
}

/// The greatest acceleration of an axis along beads.
pub(in crate::waam) fn acceleration(
    driven: Option<&Driven>,
    moves: &Commands,
    settings: &Settings,
) -> Check {
    let id = "joint-acceleration";
    let Some(driven) = driven else {
        return Check::not_checked(id, ACCELERATION, NO_MOTION);
    };
    let untold: Vec<usize> = (0..)
        .zip(driven.untold)
        .filter(|u| u.1)
        .map(|u| u.0)
        .collect();
    match driven.acceleration {
        // what is known decides where it fails
        Some(peak) if untold.is_empty() || peak.most.value > 1.0 => {
            judged((id, ACCELERATION), (Some(driven), &peak), moves, settings)
        }
        _ if untold.is_empty() => {
            Check::not_checked(id, ACCELERATION, "no axis moves along a bead")
        }
        _ => {
            let lacks = |of: &std::ops::Range<usize>| untold.iter().any(|a| of.contains(a));
            let tables = [
                ("[joints]", 0..6),
                ("[track]", 6..7),
                ("[positioner]", 7..9),
            ];
            let lacking = tables.iter().filter(|(_, of)| lacks(of));
            let lacking: Vec<&str> = lacking.map(|(table, _)| *table).collect();
            let reason = format!(
                "the robot's file does not tell what axes can do that move: write acceleration in its {}",
                lacking.join(" and ")
            );
            Check::not_checked(id, ACCELERATION, &reason)
        }
    }
}

const NO_MOTION: &str =
    "the cell's file does not say how its controller goes round corners: write its [motion]";

fn judged(
    (id, title): (&str, &str),
    (driven, peak): (Option<&Driven>, &Peak),
    moves: &Commands,
    settings: &Settings,
) -> Check {
    let (share, at) = (peak.most.value, peak.most);
    let check = Check::judge(
        id,
        title,
        Measure::exact(100.0 * share, "%"),
        Limit::AtMost(100.0),
    )
    .at(moves.place(at.command, at.position))
    .because(&axis(at.joint))
    .remedy("a lower travel speed, or the part elsewhere: near a singularity joints turn fast");
    let check = if share > 1.0 {
        check.because(&not_held(driven, peak, moves, settings))
    } else {
        check
    };
    let Some(lost) = driven.and_then(|d| d.lost) else {
        return check;
    };
    let reason = format!(
        "not followed at {}: there the motion, which cuts corners, leaves what the arm can hold",
        moves.place(lost.command, lost.position)
    );
    let status = match check.status {
        Status::Fail => Status::Fail,
        _ => Status::CannotSay,
    };
    Check { status, ..check }.because(&reason)
}

/// What happens where the set speed cannot be held.
fn not_held(driven: Option<&Driven>, peak: &Peak, moves: &Commands, settings: &Settings) -> String {
    let rate = match driven {
        Some(_) => peak.rate,
        None => 1.0 / peak.most.value,
    };
    let reached = peak.speed * rate;
    let command = moves.commands.get(peak.most.command as usize);
    let bead = match command.map(|c| c.source) {
        Some(Source::On { wire_feed }) => {
            let programmed = wire_feed / settings.feed_factor();
            let bead = settings.map.bead(programmed, reached);
            let known = settings.map.covers(programmed, reached);
            let size = format!(
                ", a bead {:.1} mm wide and {:.1} mm high",
                bead.width.value, bead.height.value
            );
            known.then_some(size)
        }
        _ => None,
    };
    let bead = bead.unwrap_or_else(|| ", a bead that the process map does not cover".to_owned());
    let beyond = driven.map_or_else(String::new, |d| {
        format!("; along {:.1} mm of beads an axis cannot follow", d.beyond)
    });
    format!(
        "the wire's tip should go {:.2} m/min there and goes {:.2} m/min, as slowly as that axis: {:.2} times the metal per length{bead}{beyond}",
        peak.speed * M_PER_MIN,
        reached * M_PER_MIN,
        1.0 / rate,
    )
}

/// Beads that axes make longer.
pub(in crate::waam) fn fact(moves: &Commands) -> Option<Fact> {
    let driven = moves.driven.as_ref()?;
    let slowest = driven.slowest?;
    let (at, rate) = (slowest.at, slowest.at.value);
    let told = format!(
        "along {:.1} mm of them; slowest where {} lets the wire's tip go {:.2} m/min in place of {:.2}: {:.2} times the metal per length",
        driven.slowed,
        axis(at.joint),
        slowest.speed * rate * M_PER_MIN,
        slowest.speed * M_PER_MIN,
        1.0 / rate
    );
    let fact = Fact::new(
        "bead-axes",
        "beads take longer than set, as an axis goes no faster",
        Measure::exact(driven.pacing.delay(), "s"),
        &told,
    );
    Some(fact.at(moves.place(at.command, at.position)))
}
