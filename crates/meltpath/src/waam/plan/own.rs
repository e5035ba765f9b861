//! Whether a program is that of a plan of its job, all of it or from one of its beads on: it is judged as that plan then, with what the plan chose of
//! what the job leaves open. One that begins as such a plan and goes on otherwise is told where it does.

use meltpath_base::{Fact, Observer, Place, Quiet, Reporter};
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use meltpath_robot::command::{Command, Kind, Source};

use crate::stages::part::Part;
use crate::waam::drive::division;
use crate::waam::drive::site::Site;
use crate::waam::error::WaamError;
use crate::waam::loaded::Loaded;
use crate::waam::plan::begun::{SAME_PLACE, beads, begins_at};
use crate::waam::plan::mend::ways;
use crate::waam::plan::planned::read_back;
use crate::waam::plan::{self, Plan};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;
use crate::waam::settings::bead::PER_MINUTE;

/// Lengths laid that differ by less, in relation, may be those of one plan.
const SAME_LENGTH: f64 = 1e-3;
/// By how much wire feeds and travel speeds may differ, in relation: these digits too. A bead 1 % larger is far within what a process map
/// knows.
pub(in crate::waam) const SAME_SETTING: f64 = 0.01;
/// Waits with the arc on that differ by less are the same, s.
const SAME_WAIT: f64 = 0.01;

/// The plan that a program was written from.
pub(in crate::waam) struct Own {
    /// The job's, with what the plan chose.
    pub(in crate::waam) settings: Settings,
    pub(in crate::waam) plan: Plan,
    /// What the plan lays before the program begins; nothing where it begins with the plan.
    pub(in crate::waam) before: Option<Commands>,
    /// What it chose, where it chose, and the beads that it divided for the robot.
    pub(in crate::waam) told: Vec<Fact>,
}

/// The plan of the job whose beads `commands` lay, all of them or all from one on, at its wire feeds and travel speeds, or along which they go
/// without arc; `None` where they are of other software, or edited. Where they begin as a plan of the job does, `reporter` is told the first that
/// is otherwise.
///
/// # Errors
/// [`WaamError`] when cancelled.
pub(in crate::waam) fn own_plan(
    loaded: &Loaded,
    part: &Part,
    commands: &Commands,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Option<Own>, WaamError> {
    if loaded.settings.surface.is_some() {
        return Ok(None);
    }
    observer.stage("look for the plan of the program", 0);
    // what is to be told of the job was told when it was read
    let (silent, quiet) = (Reporter::new(), Quiet(observer));
    let (mut nearest, mut unwritten): (Option<Difference>, Option<WaamError>) = (None, None);
    for (settings, words) in ways(loaded) {
        observer.check()?;
        let Ok(mut plan) = plan::plan(part, &settings, &silent, &quiet) else {
            continue;
        };
        if !may_be(&plan, commands) {
            continue;
        }
        let read = read_back(
            &loaded.name,
            &mut plan.toolpath,
            Site::flat(&settings),
            (&silent, &quiet),
        );
        let planned = match read {
            Ok((_, planned)) => planned,
            Err(why) => {
                unwritten.get_or_insert(why);
                continue;
            }
        };
        let first = match begins(&plan, &planned, commands, settings.feed_factor()) {
            Begins::Whole => None,
            Begins::Rest(first) => Some(first),
            Begins::Otherwise(difference) => {
                nearest = [nearest, difference]
                    .into_iter()
                    .flatten()
                    .reduce(Difference::farther);
                continue;
            }
        };
        let title = "chosen by the plan that the program was written from";
        let chosen = words.map(|words| Fact::words("chosen", title, &words));
        let divided = division::fact(&planned.divided);
        let rest = first.and_then(|first| rest(&planned, first));
        tell_pauses(&planned, first.unwrap_or(0), commands, reporter);
        return Ok(Some(Own {
            settings,
            plan,
            told: chosen.into_iter().chain(divided).chain(rest).collect(),
            before: first.map(|first| until(planned, first)),
        }));
    }
    // one that has no bead of a plan is of other software
    if let Some(difference) = nearest.filter(|d| d.same > 0 || d.setting) {
        difference.tell(commands, reporter);
    } else if let Some(why) = unwritten {
        reporter.warn(
            "plan-not-compared",
            format!("the program lays as much as the job's plan, which cannot be written to compare them: {why}"),
            "mend that where the program is the plan's own: it is judged as one of other software, not as the plan with what it chose",
        );
    }
    Ok(None)
}

/// Whether a program may be one of a plan: it lays as much, begins where a bead of it does, or goes where its last one ends.
fn may_be(plan: &Plan, commands: &Commands) -> bool {
    let near = |a: Option<&DVec3>, b: DVec3| a.is_some_and(|a| a.distance(b) <= SAME_PLACE);
    let Some(first) = welded(commands).next() else {
        let last = beads(&plan.toolpath).next_back();
        let end = last.as_ref().and_then(|p| p.points.last());
        return commands.commands.iter().any(|c| near(end, c.target));
    };
    let (long, laid) = (plan.toolpath.deposited_length(), commands.arc_length);
    (long - laid).abs() <= SAME_LENGTH * long
        || beads(&plan.toolpath).any(|p| near(p.points.first(), first.from))
}

/// How a program goes along a plan.
enum Begins {
    /// As the plan does, to its end.
    Whole,
    /// From this command of the plan on, to its end.
    Rest(u32),
    /// Otherwise; with what is first so, where it lays beads.
    Otherwise(Option<Difference>),
}

/// How a program goes along a plan; `factor`: wire fed per programmed wire.
fn begins(plan: &Plan, planned: &Commands, said: &Commands, factor: f64) -> Begins {
    let of_plan: Vec<Welded<'_>> = welded(planned).collect();
    let of_program: Vec<Welded<'_>> = welded(said).collect();
    let id = |at: usize| of_plan.get(at).map(|w| w.command.id);
    // a bead begins where the command before lays nothing
    let is_first = |at: &usize| *at == 0 || id(at - 1).map(|id| id + 1) != id(*at);
    let firsts: Vec<usize> = (0..of_plan.len()).filter(is_first).collect();
    let from = |at: usize| match id(at).filter(|_| at > 0) {
        Some(id) => Begins::Rest(id),
        None => Begins::Whole,
    };
    let Some(first) = of_program.first() else {
        let bead = begins_at(&plan.toolpath, said);
        let at = bead.and_then(|bead| firsts.get(bead));
        return at.map_or(Begins::Otherwise(None), |at| from(*at));
    };
    let there = |at: &&usize| of_plan[**at].from.distance(first.from) <= SAME_PLACE;
    let mut at: Vec<usize> = firsts.iter().filter(there).copied().collect();
    if at.is_empty() {
        at.push(0);
    }
    let mut nearest: Option<Difference> = None;
    for at in at {
        let Some(other) = first_difference(&of_plan[at..], &of_program, factor) else {
            return from(at);
        };
        nearest = Some(match nearest {
            Some(nearest) => nearest.farther(other),
            None => other,
        });
    }
    Begins::Otherwise(nearest)
}

/// The same commands, with the arc off from one on.
fn until(mut planned: Commands, first: u32) -> Commands {
    for command in planned.commands.iter_mut().filter(|c| c.id >= first) {
        command.source = Source::Off;
    }
    planned
}

/// Where a program begins that lays the rest of a plan.
fn rest(planned: &Commands, first: u32) -> Option<Fact> {
    let i = first as usize;
    let layer = planned.layer_of_command.get(i)?;
    let bead = planned.bead_of_command.get(i).copied().flatten()?;
    let words = format!(
        "layer {layer}, bead {bead} of its plan: what stands below is taken to be as it was planned"
    );
    Some(Fact::words(
        "begins",
        "the program begins later than its plan",
        &words,
    ))
}

/// A pause between two beads.
struct Pause {
    time: f64,
    /// The command that it ends before: the first of the bead.
    before: u32,
    /// The last wait of it; none where it has none.
    wait: Option<u32>,
}

/// The pauses between beads from a command on.
fn pauses(commands: &Commands, from: u32) -> Vec<Pause> {
    let mut all = Vec::new();
    let mut open: Option<(f64, Option<u32>)> = None;
    let mut burns = false;
    for command in commands.commands.iter().filter(|c| c.id >= from) {
        match (command.source, command.kind) {
            (Source::On { .. }, _) => {
                let pause = open.take().filter(|_| !burns);
                all.extend(pause.map(|(time, wait)| Pause {
                    time,
                    before: command.id,
                    wait,
                }));
                burns = true;
            }
            (Source::Off, kind) => {
                if burns {
                    (open, burns) = (Some((0.0, None)), false);
                }
                if let (Kind::Wait { time }, Some((paused, wait))) = (kind, &mut open) {
                    *paused += time;
                    *wait = Some(command.id);
                }
            }
        }
    }
    all
}

/// Tells where a program pauses otherwise between beads than its plan does, from a command of the plan on. Its metal is laid as that of the plan all
/// the same, on what is as cold as was measured.
fn tell_pauses(planned: &Commands, from: u32, said: &Commands, reporter: &Reporter) {
    let (of_plan, of_program) = (pauses(planned, from), pauses(said, 0));
    let both = of_plan.iter().zip(&of_program);
    let other = |(plan, program): &(&Pause, &Pause)| (plan.time - program.time).abs() > SAME_WAIT;
    let mut others = both.filter(other);
    let Some((plan, program)) = others.next() else {
        return;
    };
    let id = program.wait.unwrap_or(program.before);
    let line = said.line_of_command.get(id as usize).map(|(_, line)| *line);
    let bead = program.before;
    let target = said.commands.get(bead as usize).map(|c| c.target);
    let place = Place {
        line,
        ..said.place(bead, target.unwrap_or_default())
    };
    let more = match others.count() {
        0 => String::new(),
        1 => ", and 1 pause more".to_owned(),
        n => format!(", and {n} pauses more"),
    };
    let line = line.map_or_else(String::new, |line| format!(", line {line}"));
    reporter.warn_at(
        "pauses",
        format!(
            "the program is that of a plan of this job but for its pauses, and first differs before a bead of layer {}: {:.1} s, planned {:.1} s{line}{more}. No heat is simulated: metal that is laid on warmer metal than was measured is wider and lower than told here",
            place.layer.unwrap_or(0), program.time, plan.time
        ),
        place,
        "write the pause that is meant into the job (layers.pause), and program its plan anew",
    );
}

/// A move or a wait with the arc on.
struct Welded<'a> {
    from: DVec3,
    wire_feed: f64,
    command: &'a Command,
}

fn welded(commands: &Commands) -> impl Iterator<Item = Welded<'_>> {
    let ends = commands.commands.iter().map(|c| c.target);
    let starts = std::iter::once(commands.start.position).chain(ends);
    let moves = commands.commands.iter().zip(starts);
    moves.filter_map(|(command, from)| match command.source {
        Source::On { wire_feed } => Some(Welded {
            from,
            wire_feed,
            command,
        }),
        Source::Off => None,
    })
}

/// What of a program is first otherwise than in a plan.
struct Difference {
    /// Moves with the arc on before it.
    same: usize,
    /// The command of the program; none where it ends before the plan does.
    command: Option<u32>,
    /// Whether it is a wire feed or a speed, of a move that is where the plan has it.
    setting: bool,
    words: String,
}

impl Difference {
    /// The one that comes later, of two alike this one.
    fn farther(self, other: Difference) -> Difference {
        if other.same > self.same { other } else { self }
    }

    fn tell(&self, commands: &Commands, reporter: &Reporter) {
        let of = |id: u32| commands.commands.get(id as usize);
        let place = self.command.and_then(|id| {
            let line = commands.line_of_command.get(id as usize);
            let place = commands.place(id, of(id)?.target);
            Some(Place {
                line: line.map(|(_, line)| *line),
                ..place
            })
        });
        let place = place.unwrap_or_default();
        let before = match self.same {
            0 => String::new(),
            n => format!(" after {n} moves with the arc on"),
        };
        let line = place
            .line
            .map_or_else(String::new, |l| format!(", line {l}"));
        reporter.warn_at(
            "edited",
            format!(
                "the program begins as a plan of this job does, and first differs from it{before}: {}{line}. It is judged as one of other software",
                self.words
            ),
            place,
            "write what was changed into the job, and program its plan anew",
        );
    }
}

/// Where beads first differ from those of a plan by more than the digits of programs do: place, shape, smoothing, wire feed, travel speed, time.
/// `factor`: wire fed per programmed wire.
fn first_difference(
    planned: &[Welded<'_>],
    said: &[Welded<'_>],
    factor: f64,
) -> Option<Difference> {
    let (mut of_plan, mut of_program) = (planned.iter(), said.iter());
    let mut same = 0;
    loop {
        let (plan, program) = (of_plan.next(), of_program.next());
        let command = program.map(|w| w.command.id);
        let found = match (plan, program) {
            (None, None) => return None,
            (Some(_), None) => Some((false, "it lays fewer beads than the plan".to_owned())),
            (None, Some(_)) => Some((false, "it lays more beads than the plan".to_owned())),
            (Some(plan), Some(program)) => in_place(plan, program)
                .map(|words| (false, words))
                .or_else(|| in_settings(plan, program, factor).map(|words| (true, words))),
        };
        if let Some((setting, words)) = found {
            return Some(Difference {
                same,
                command,
                setting,
                words,
            });
        }
        same += 1;
    }
}

/// How a move lies otherwise than planned.
fn in_place(plan: &Welded<'_>, program: &Welded<'_>) -> Option<String> {
    let (a, b) = (plan.command, program.command);
    let off = match (a.kind, b.kind) {
        (Kind::Wait { time: planned }, Kind::Wait { time }) => {
            return ((time - planned).abs() > SAME_WAIT).then(|| {
                format!("the torch stands {time:.2} s with the arc on, planned {planned:.2} s")
            });
        }
        (Kind::Arc { .. }, Kind::Arc { .. }) => {
            let middle = |w: &Welded<'_>| match w.command.kind {
                Kind::Arc { via } => {
                    Arc::through(w.from, via, w.command.target).map(|arc| arc.at(0.5))
                }
                _ => None,
            };
            match (middle(plan), middle(program)) {
                (Some(a), Some(b)) => a.distance(b),
                _ => 0.0,
            }
        }
        (Kind::Wait { .. } | Kind::Arc { .. }, _) | (_, Kind::Wait { .. } | Kind::Arc { .. }) => {
            f64::INFINITY
        }
        _ => 0.0,
    };
    let off = off
        .max(plan.from.distance(program.from))
        .max(a.target.distance(b.target));
    if off.is_infinite() {
        return Some("a line, an arc or a wait is another of these in the plan".to_owned());
    }
    if off > SAME_PLACE {
        return Some(format!("a bead lies {off:.2} mm from where it is planned"));
    }
    (a.smoothing != b.smoothing).then(|| "a corner is smoothed otherwise than planned".to_owned())
}

/// How a move is laid at other settings than planned.
fn in_settings(plan: &Welded<'_>, program: &Welded<'_>, factor: f64) -> Option<String> {
    let same = |a: f64, b: f64| (a - b).abs() <= SAME_SETTING * a;
    let per_minute = |v: f64| v * PER_MINUTE;
    if !same(plan.wire_feed, program.wire_feed) {
        return Some(format!(
            "the wire is fed at {:.2} m/min, planned {:.2} m/min",
            per_minute(program.wire_feed / factor),
            per_minute(plan.wire_feed / factor)
        ));
    }
    let (planned, said) = (plan.command.speed, program.command.speed);
    let stands = matches!(program.command.kind, Kind::Wait { .. });
    (!stands && !same(planned, said)).then(|| {
        format!(
            "a bead is laid at {:.3} m/min, planned {:.3} m/min",
            per_minute(said),
            per_minute(planned)
        )
    })
}
