//! What leaves open where the arm goes along a program of others: lines that were not simulated, frames and axes of which the robot's file
//! says nothing.

use std::collections::BTreeMap;

use meltpath_base::{Check, Reporter, Status};
use meltpath_programs::frame_text::shown;
use meltpath_programs::program::{Coordinates, Group, Instruction, Position, PositionRef};
use meltpath_programs::{Dialect, Gap, Open, Program, Reading};
use meltpath_toolpath::Move;

use crate::waam::drive::own_frame::beside_part;
use crate::waam::maker::reads;
use crate::waam::settings::Settings;

/// Something that leaves open where the arm goes.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::waam) struct Unsure {
    open: Open,
    lie: Lie,
    reason: String,
    remedy: String,
}

/// What is not known of the places of moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lie {
    /// Where all of them lie to the arm.
    InArm,
    /// Where travels lie to the beads, too.
    ToBeads,
}

/// A move of a program: where it stands, in which frames it is, and whether it lays metal.
#[derive(Clone, Copy, PartialEq)]
struct At {
    line: (u32, u32),
    frames: (u32, u32),
    lays: bool,
}

/// Programs with their positions by their numbers.
struct Read<'a> {
    programs: &'a [Program],
    tables: Vec<BTreeMap<u32, &'a Position>>,
}

impl<'a> Read<'a> {
    fn of(programs: &'a [Program]) -> Self {
        let table = |p: &'a Program| p.positions.iter().map(|p| (p.index, p)).collect();
        Read {
            programs,
            tables: programs.iter().map(table).collect(),
        }
    }
}

impl At {
    fn names(self, read: &Read<'_>) -> Option<[String; 2]> {
        Some(self.program(read)?.frame_names(self.frames))
    }

    fn program<'a>(self, read: &Read<'a>) -> Option<&'a Program> {
        read.programs.get(self.line.0 as usize)
    }

    /// Its target, where that is a position of the program.
    fn position<'a>(self, read: &Read<'a>) -> Option<&'a Position> {
        let program = self.program(read)?;
        let at = (self.line.1 as usize).checked_sub(1)?;
        let Instruction::Motion(motion) = program.instructions.get(at)? else {
            return None;
        };
        let PositionRef::Point { index, .. } = motion.target else {
            return None;
        };
        read.tables.get(self.line.0 as usize)?.get(&index).copied()
    }

    /// What the robot's group says at its target.
    fn robot<'a>(self, read: &Read<'a>) -> Option<&'a Group> {
        let mut groups = self.position(read)?.groups.iter();
        groups.find(|g| g.number == 1)
    }

    /// Its frames count: it is not given by joints.
    fn counts(self, read: &Read<'_>) -> bool {
        let robot = self.robot(read);
        !robot.is_some_and(|g| matches!(g.coordinates, Coordinates::Joint(_)))
    }

    /// The line, as people find it.
    fn told(self, read: &Read<'_>) -> String {
        let Some(program) = self.program(read) else {
            return String::new();
        };
        let (line, text) = (program.line_of(self.line.1), self.line.1 as usize);
        let text = text.checked_sub(1).and_then(|at| program.texts.get(at));
        let text = text.map_or_else(String::new, |text| format!(", \"{text}\""));
        format!("program {}, line {line}{text}", program.name)
    }
}

/// What the programs that were read leave open beside their gaps; frames with other numbers than the cell file's are warned of too.
pub(in crate::waam) fn of(
    programs: &[Program],
    reading: &Reading,
    settings: &Settings,
    reporter: &Reporter,
) -> Vec<Unsure> {
    let (read, moves) = (&Read::of(programs), moves(reading));
    let counting = |at: &&At| at.counts(read);
    let counting: Vec<At> = moves.iter().filter(counting).copied().collect();
    let bead = counting.iter().find(|at| at.lays).copied();
    let numbers = bead.and_then(|bead| of_numbers(read, bead, settings));
    let own = bead.and_then(|bead| of_own_frame(read, bead, settings));
    let numbers = numbers.filter(|_| own.is_none());
    if let Some(numbers) = &numbers {
        reporter.warn("other-frames", &numbers.reason, &numbers.remedy);
    }
    if let Some((reason, remedy)) = bead.and_then(|bead| of_part(read, bead, settings)) {
        reporter.warn("part-frame", reason, remedy);
    }
    let mut all: Vec<Unsure> = numbers.into_iter().collect();
    all.extend(own);
    all.extend(bead.and_then(|bead| of_travels(read, &counting, bead)));
    all.extend(of_declarations(read));
    all.extend(of_lines(&reading.left_out));
    all
}

/// The moves of a reading, that to its start first.
fn moves(reading: &Reading) -> Vec<At> {
    let start = At {
        line: reading.start_line,
        frames: reading.start_frames,
        lays: false,
    };
    let mut all = vec![start];
    let mut controls = reading.controls.iter();
    for pass in reading.toolpath.passes() {
        for (i, control) in (0..pass.move_count()).zip(controls.by_ref()) {
            if !matches!(pass.move_at(i), Move::Spot { .. }) {
                all.push(At {
                    line: (control.program, control.line),
                    frames: control.frames,
                    lays: pass.head.role.deposits(),
                });
            }
        }
    }
    all
}

/// Beads in the robot's own frame: FANUC's UFRAME 0, KUKA's base 0 and `$WORLD`, Yaskawa's positions of the base, `wobj0`, a script's plain poses.
pub(in crate::waam) fn in_own_frame(
    programs: &[Program],
    reading: &Reading,
    settings: &Settings,
) -> bool {
    let read = &Read::of(programs);
    let bead = moves(reading)
        .into_iter()
        .find(|at| at.lays && at.counts(read));
    bead.is_some_and(|bead| of_own_frame(read, bead, settings).is_some())
}

fn of_own_frame(read: &Read<'_>, bead: At, settings: &Settings) -> Option<Unsure> {
    let program = bead.program(read)?;
    beside_part(program, bead.frames.0, settings).then(|| Unsure {
        open: Open::Places,
        lie: Lie::InArm,
        reason: format!(
            "beads are in the robot's own frame ({}), not in that of the part: where the part lies in it the program does not say",
            bead.told(read)
        ),
        remedy: OWN_FRAME.to_owned(),
    })
}

/// What to do about beads in the robot's own frame.
pub(in crate::waam) const OWN_FRAME: &str = "export the program in the user frame of the part (program.user_frame of the cell file), or name the robot whose file says where the part lies (machine.robot; without a track, external axes at zero)";

/// Whether frames have the controller's numbers.
fn numbered(dialect: Dialect) -> bool {
    matches!(dialect, Dialect::FanucLs | Dialect::Krl | Dialect::Inform)
}

/// Beads in a frame that the program tells in numbers, where the cell file calls the part's otherwise and no robot's file says where it lies: what is noted, and
/// what to do.
fn of_part(read: &Read<'_>, bead: At, settings: &Settings) -> Option<(String, String)> {
    let program = bead.program(read)?;
    let there = program.said_frames.user.get(&bead.frames.0)?;
    let ([own, _], [key, _]) = frames_of_cell(program.dialect, settings)?;
    let [name, _] = bead.names(read)?;
    (settings.robot.is_none() && name != own).then(|| {
        (
            format!(
                "beads are in user frame {name}, at {} ({}), and the cell file's is {own}: the part is taken to lie in the frame of the beads",
                shown(program.dialect, there),
                bead.told(read)
            ),
            format!("tell in the program where {own} lies, or write the frame of the part into the cell file: {key}"),
        )
    })
}

/// What the cell file calls user frame and tool of beads in a dialect, and by which keys.
fn frames_of_cell(
    dialect: Dialect,
    settings: &Settings,
) -> Option<([String; 2], [&'static str; 2])> {
    let cell = &settings.cell.program;
    match dialect {
        dialect if numbered(dialect) => Some((
            [cell.user_frame.to_string(), cell.tool_frame.to_string()],
            ["program.user_frame", "program.tool_frame"],
        )),
        Dialect::Rapid => {
            let words = cell.rapid.as_ref()?;
            Some((
                [words.work_object.to_lowercase(), words.tool.to_lowercase()],
                ["program.rapid.work_object", "program.rapid.tool"],
            ))
        }
        _ => None,
    }
}

/// Beads in frames that are not the cell file's: the robot's file tells where those lie.
fn of_numbers(read: &Read<'_>, bead: At, settings: &Settings) -> Option<Unsure> {
    let program = bead.program(read)?;
    let said = &program.said_frames;
    let names = bead.names(read)?;
    let (own, keys) = frames_of_cell(program.dialect, settings)?;
    let known = [
        said.user.contains_key(&bead.frames.0),
        said.tool.contains_key(&bead.frames.1),
    ];
    let what = ["user frame", "tool frame"];
    let differs = |i: &usize| !known[*i] && names[*i] != own[*i];
    let differ: Vec<usize> = (0..2).filter(differs).collect();
    let told = differ
        .iter()
        .map(|i| format!("{} {} in place of {}", what[*i], names[*i], own[*i]));
    let told: Vec<String> = told.collect();
    let keys: Vec<&str> = differ.iter().map(|i| keys[*i]).collect();
    (!told.is_empty()).then(|| Unsure {
        open: Open::Places,
        lie: Lie::InArm,
        reason: format!(
            "beads are in other frames than the cell file's: {} ({}): whether they lie where the robot's file tells part and torch is not known",
            told.join(", "),
            bead.told(read)
        ),
        remedy: format!(
            "where the robot's file tells these frames ([table], [torch], machine.place), write them into the cell file: {}",
            keys.join(", ")
        ),
    })
}

/// Travels in other frames than the beads.
fn of_travels(read: &Read<'_>, moves: &[At], bead: At) -> Option<Unsure> {
    let own = bead.names(read)?;
    let same = |at: &At| (at.line.0, at.frames) == (bead.line.0, bead.frames);
    let other = |at: &&At| !at.lays && !same(at) && at.names(read).as_ref() != Some(&own);
    let mut others = moves.iter().filter(other);
    let first = others.next()?;
    let [frame, tool] = first.names(read)?;
    Some(Unsure {
        open: Open::Places,
        lie: Lie::ToBeads,
        reason: format!(
            "{} is in user frame {frame} with tool frame {tool}, beads are in {} and {}: how the frames lie to each other is not known{}",
            first.told(read),
            own[0],
            own[1],
            more(others.count())
        ),
        remedy: "give the positions of travels in the frames of the beads, or by joints".to_owned(),
    })
}

fn more(count: usize) -> String {
    match count {
        0 => String::new(),
        n => format!(", and {n} more"),
    }
}

/// Frames that a program declares otherwise than by numbers, and those that it sets while moves are made in them.
fn of_declarations(read: &Read<'_>) -> Vec<Unsure> {
    let told = |program: &Program, (line, text): &(u32, String)| Unsure {
        open: Open::Places,
        lie: Lie::InArm,
        reason: format!(
            "program {}, line {line}, \"{text}\": where this frame lies is not written in plain numbers",
            program.name
        ),
        remedy: "write its place in numbers, or in sums of constants that are numbers".to_owned(),
    };
    let all = read
        .programs
        .iter()
        .flat_map(|p| p.said_frames.unread.iter().map(move |unread| (p, unread)));
    let unread = all.map(|(program, unread)| told(program, unread));
    let changed = read.programs.iter().flat_map(|p| &p.said_frames.changed);
    let changed = changed.map(|line| Unsure {
        open: Open::Places,
        lie: Lie::ToBeads,
        reason: format!(
            "program {}, line {}, \"{}\" sets a frame that moves before it, or in another program, are made in, too: where it lies for each is not followed",
            line.program, line.line, line.text
        ),
        remedy: "set each frame once, before all that moves in it, or in the program that moves in it".to_owned(),
    });
    unread.chain(changed).collect()
}

/// External axes away from zero that the robot's file lacks.
pub(in crate::waam) fn of_axes(
    programs: &[Program],
    reading: &Reading,
    settings: &Settings,
) -> Option<Unsure> {
    let read = &Read::of(programs);
    let cell = settings.robot.as_ref()?;
    let known = cell.track.is_some() || cell.positioner.is_some();
    let moves = moves(reading);
    let mut away = moves.iter().filter_map(|at| {
        let position = at.position(read)?;
        let axes = position.groups.iter().flat_map(|g| match &g.coordinates {
            Coordinates::Cartesian { external, .. } => &external[..],
            Coordinates::Joint(axes) if g.number == 1 => axes.get(6..).unwrap_or_default(),
            Coordinates::Joint(axes) => &axes[..],
            Coordinates::Unread(_) => &[],
        });
        let moved = axes.into_iter().find(|axis| axis.value != 0.0)?;
        Some((at, moved))
    });
    let (first, axis) = away.next()?;
    Some(Unsure {
        open: Open::Places,
        lie: Lie::InArm,
        reason: format!(
            "external axis {} stands at {} ({}), {}{}",
            axis.name,
            format!("{} {}", axis.value, axis.unit).trim_end(),
            first.told(read),
            if known {
                "and the robot's file has other axes than the program tells"
            } else {
                "and the robot's file has no such axis"
            },
            more(away.count())
        ),
        remedy: "tell it in the robot's file: [track] where it carries the arm, [positioner] where it turns the part"
            .to_owned(),
    })
}

/// Lines that were not simulated, as far as they are about the arm.
fn of_lines(lines: &[Gap]) -> Vec<Unsure> {
    let mut all: Vec<(Open, Vec<&Gap>)> = Vec::new();
    for gap in lines {
        let open = gap.why.open();
        match all.iter_mut().find(|(known, _)| *known == open) {
            Some((_, gaps)) => gaps.push(gap),
            None => all.push((open, vec![gap])),
        }
    }
    let told = |(open, gaps): (Open, Vec<&Gap>)| {
        let first = gaps.first()?;
        Some(Unsure {
            open,
            lie: Lie::ToBeads,
            reason: format!(
                "the arm was followed without {}, line {}, \"{}\" ({}){}",
                first.program,
                first.line,
                first.text,
                first.why,
                more(gaps.len() - 1)
            ),
            remedy: first.why.remedy().to_owned(),
        })
    };
    all.into_iter().filter_map(told).collect()
}

/// Takes from a check of the arm what is not known. Where the places of all moves are open nothing is decided; where other moves are, what was
/// found to fail fails all the same.
pub(in crate::waam) fn undecided(check: Check, gaps: &[Gap], unsure: &[Unsure]) -> Check {
    if check.status == Status::NotChecked {
        return check;
    }
    let of_speed = matches!(check.id.as_str(), "joint-speed" | "joint-acceleration");
    let takes = |unsure: &Unsure| match unsure.open {
        Open::Nothing => false,
        Open::Speeds => of_speed,
        Open::Moves => check.status != Status::Fail,
        Open::Places => true,
    };
    let gaps = of_lines(gaps);
    let all = gaps.iter().chain(unsure);
    let all: Vec<&Unsure> = all.filter(|unsure| takes(unsure)).collect();
    open(check, &all)
}

/// Takes from the check of the way over the metal what is not known of travels: those that are left out, and those in frames of which it is not
/// known how they lie to the beads'.
pub(in crate::waam) fn undecided_over_metal(check: Check, unsure: &[Unsure]) -> Check {
    let of_travels = unsure
        .iter()
        .filter(|unsure| unsure.lie == Lie::ToBeads)
        .cloned();
    let of_travels: Vec<Unsure> = of_travels.collect();
    undecided(check, &[], &of_travels)
}

/// Takes from a check of the arm what the arm of another maker than the controller's leaves open: it stands in other ways, and CONFIG is none of its words.
pub(in crate::waam) fn undecided_of_another_arm(
    check: Check,
    programs: &[Program],
    settings: &Settings,
) -> Check {
    let Some(cell) = &settings.robot else {
        return check;
    };
    let other = |p: &&Program| !reads(cell.maker, p.dialect);
    let Some(program) = programs.iter().find(other) else {
        return check;
    };
    let config = check.id == "config";
    if check.status == Status::NotChecked && !config {
        return check;
    }
    let unsure = Unsure {
        open: Open::Places,
        lie: Lie::InArm,
        reason: format!(
            "the program {} is one for {}, and the arm that is named is another maker's ({}): how its controller holds it and leads it is not known",
            program.name,
            program.dialect.name(),
            cell.name
        ),
        remedy: "name an arm of this controller's maker in the job (machine.robot; `maker` of the robot's file), or ask for programs that the arm's reads (output.programs)".to_owned(),
    };
    open(check, &[&unsure])
}

fn open(check: Check, all: &[&Unsure]) -> Check {
    let Some(first) = all.first() else {
        return check;
    };
    let told = all.iter().map(|unsure| unsure.reason.as_str());
    let told = told.chain((!check.reason.is_empty()).then_some(check.reason.as_str()));
    let undecided = Check {
        status: Status::CannotSay,
        reason: String::new(),
        ..check.clone()
    };
    told.fold(undecided, Check::because)
        .remedy(first.remedy.as_str())
}
