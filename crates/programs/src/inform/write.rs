//! A program to INFORM.

use std::collections::BTreeMap;

use super::motion::{NO_LEVEL, STATION};
use super::positions::{Entry, Names, Written};
use super::pulses::Pulses;
use super::times;
use super::words::InformWords;
use crate::program::{
    ArcAction, ArcWord, COORDINATED, Coordinates, Instruction, MotionInstruction, MotionKind,
    Position, PositionRef, Program, Speed, SpeedUnit, Termination,
};
use crate::template::UNFILLED;
use crate::written::{
    ENDING, GOES_ON, JUMP, Lines, NAME_THE_ROBOT, NO_PLACE, TextFile, WEAVE, WriteError, fixed,
    short,
};

/// Longest wait of one `TIMER`, s.
const LONGEST: f64 = 655.35;
/// Longest wait in all, s: a day.
const DAY: f64 = 86_400.0;
/// A job carries the time of its making; ours are the same whenever they are made.
const DATE: &str = "///DATE 2000/01/01 00:00";

/// The job of a program, with `\n` line ends: 1 µm and 0.0001°; base axis and station in whole pulses.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or INFORM has no words for something.
pub fn write(
    program: &Program,
    words: &InformWords,
    pulses: &Pulses,
) -> Result<Vec<TextFile>, WriteError> {
    let mut writer = Writer {
        out: Lines::new(program, "")?,
        words,
        places: program.positions.iter().filter_map(entry).collect(),
        positions: Written::new(pulses.clone()),
        burns: false,
        last: None,
        skip: false,
    };
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.out.at = at;
        if !std::mem::take(&mut writer.skip) {
            writer.instruction(instruction)?;
        }
    }
    if writer.burns {
        return Err(writer.out.no_words(GOES_ON));
    }
    let head = if program.application.is_empty() {
        writer.head()
    } else {
        program.application.clone()
    };
    let text = format!(
        "/JOB\n//NAME {}\n{}//INST\n{}\nNOP\n{}END\n",
        program.name,
        writer.positions.section(),
        head.join("\n"),
        writer.out.text,
    );
    Ok(vec![TextFile {
        name: format!("{}.JBI", program.name),
        text,
    }])
}

struct Writer<'a> {
    out: Lines<'a>,
    words: &'a InformWords,
    places: BTreeMap<u32, Entry>,
    positions: Written,
    burns: bool,
    /// The next instruction is written already.
    skip: bool,
    /// Where the last move ended, and whether it was a circle.
    last: Option<(Entry, bool)>,
}

impl Writer<'_> {
    /// What stands before the instructions: the job moves with its user frame.
    fn head(&self) -> Vec<String> {
        let users = self.places.values().find_map(|e| e.frames.0);
        let user = users.filter(|n| *n > 0);
        let (base, station) = self.positions.tells();
        let base = if base {
            format!(",{}", *self.words.base_group)
        } else {
            String::new()
        };
        let group = format!("///GROUP1 {}{base}", *self.words.group);
        let station = station.then(|| format!("///GROUP2 {}", *self.words.station_group));
        let groups = std::iter::once(group).chain(station).collect();
        let attributes = match user {
            Some(number) => vec![
                "///ATTR SC,RW,RJ".to_owned(),
                format!("////FRAME USER {number}"),
            ],
            None => vec!["///ATTR SC,RW".to_owned()],
        };
        [vec![DATE.to_owned()], attributes, groups].concat()
    }

    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => {
                self.motion(motion)?;
                if let Some(word) = &motion.arc {
                    self.arc(word)?;
                }
            }
            Instruction::Arc(word) => self.arc(word)?,
            Instruction::Wait(seconds) if self.is_of_end(*seconds) => {}
            Instruction::Wait(seconds) if *seconds > DAY => {
                return Err(self
                    .out
                    .no_words(("a wait of more than a day", "wait by hand")));
            }
            Instruction::Wait(seconds) => {
                let mut left = *seconds;
                while left > LONGEST {
                    self.out.line(&format!("TIMER T={LONGEST}"));
                    left -= LONGEST;
                }
                self.out.line(&format!("TIMER T={}", fixed(left, 2)));
            }
            // positions carry theirs
            Instruction::UserFrame(_)
            | Instruction::ToolFrame(_)
            | Instruction::Holds(_)
            | Instruction::Blank => {}
            Instruction::Call { program, .. } => self.out.line(&format!("CALL JOB:{program}")),
            Instruction::Comment { text, .. } => self.out.line(&format!("'{text}")),
            Instruction::End => self.out.line("RET"),
            Instruction::Raw(text) if names_position(text) => {
                return Err(self.out.no_words((
                    "a line that names a position by its number",
                    "positions are numbered anew: leave the line out, or write it as a move",
                )));
            }
            Instruction::Raw(text) => self.out.line(text),
            Instruction::Weave(_) => return Err(self.out.no_words(WEAVE)),
            Instruction::Label { .. } | Instruction::Jump(_) => {
                return Err(self.out.no_words(JUMP));
            }
        }
        Ok(())
    }

    fn arc(&mut self, word: &ArcWord) -> Result<(), WriteError> {
        let starts = word.action == ArcAction::Start;
        if !starts && !self.burns {
            return Err(self.out.no_words(GOES_ON));
        }
        let number = |v: &str| v.trim().parse::<f64>().is_ok();
        let lines = if starts && !word.arguments.split(',').all(number) {
            // words of the controller, as they were read
            let name = if self.burns { "ARCSET" } else { "ARCON" };
            Some(vec![format!("{name} {}", word.arguments).trim().to_owned()])
        } else {
            self.words.arc().filled(word, self.burns)
        };
        let Some(lines) = lines else {
            return Err(self.out.no_words(UNFILLED));
        };
        let stands = lines.iter().filter_map(|line| times::of(line)).next_back();
        if let (true, Some(stands), Some(Instruction::Wait(time))) =
            (starts, stands, self.out.coming().first())
        {
            // as it was read of the line
            self.skip = same_time(stands.time, *time);
        }
        for line in lines {
            self.out.line(&line);
        }
        self.burns = starts;
        Ok(())
    }

    /// Whether a wait is the time that the line says which ends the arc behind it.
    fn is_of_end(&self, seconds: f64) -> bool {
        let Some(Instruction::Arc(word)) = self.out.coming().first() else {
            return false;
        };
        if word.action != ArcAction::End {
            return false;
        }
        let lines = self.words.arc().filled(word, self.burns);
        let mut said = lines.iter().flatten().filter_map(|line| times::of(line));
        said.any(|stands| !stands.valued && same_time(stands.time, seconds))
    }

    fn entry(&self, reference: &PositionRef) -> Result<Entry, WriteError> {
        let found = match reference {
            PositionRef::Point { index, .. } => self.places.get(index),
            PositionRef::Unresolved(_) => None,
        };
        found.cloned().ok_or_else(|| self.out.no_words(NO_PLACE))
    }

    /// A name of its own for this use of a position.
    fn names(&mut self, entry: &Entry) -> Result<Names, WriteError> {
        self.positions.add(entry).ok_or_else(|| {
            self.out.no_words((
                "a position of which the arm's way to stand (RCONF), or the pulses of base axis or station, are not known",
                NAME_THE_ROBOT,
            ))
        })
    }

    /// One move to a position that gets names of its own, with speed and what follows.
    fn move_to(
        &mut self,
        verb: &str,
        entry: &Entry,
        (speed, rest): (&str, &str),
        motion: &MotionInstruction,
    ) -> Result<(), WriteError> {
        let Names {
            robot,
            base,
            station,
        } = self.names(entry)?;
        let base = base.map(|name| format!(" {name}")).unwrap_or_default();
        let coordinated = motion.extra.iter().any(|w| w == COORDINATED);
        let (with, led) = match station {
            None => ("", String::new()),
            Some(name) if coordinated => ("S", format!(" {STATION} {name}")),
            Some(name) => {
                let said = motion.extra.iter().find(|w| w.starts_with(SHARE));
                let share = match said {
                    Some(word) => format!(" {word}"),
                    None if verb == "MOVJ" => speed.to_owned(),
                    None => String::new(),
                };
                ("", format!(" {STATION} {name}{share}"))
            }
        };
        self.out
            .line(&format!("{with}{verb} {robot}{base}{speed}{rest}{led}"));
        Ok(())
    }

    fn motion(&mut self, motion: &MotionInstruction) -> Result<(), WriteError> {
        let to = self.entry(&motion.target)?;
        let speed = self.speed(motion)?;
        let ending = match &motion.termination {
            Termination::Fine => " PL=0".to_owned(),
            Termination::Blend(distance) => match self.words.level(*distance) {
                Some(level) => format!(" PL={level}"),
                None => format!(" CR={}", short(*distance, 1)),
            },
            Termination::Other(word) if word == NO_LEVEL => String::new(),
            Termination::Other(word) if word.starts_with("PL=") => format!(" {word}"),
            _ => {
                return Err(self.out.no_words(ENDING));
            }
        };
        // said with the station
        let apart = |w: &&String| *w != COORDINATED && !w.starts_with(SHARE);
        let words = motion.extra.iter().filter(apart).map(|w| format!(" {w}"));
        let rest = format!("{ending}{}", words.collect::<String>());
        let verb = match &motion.kind {
            MotionKind::Joint => "MOVJ",
            MotionKind::Linear => "MOVL",
            MotionKind::CircleArc => "MOVC",
            // from where the arm happens to be there is no circle
            MotionKind::Circular { .. } if self.last.is_none() && !self.burns => "MOVL",
            MotionKind::Circular { via } => {
                let via = self.entry(via)?;
                self.circle_begins(&speed, motion)?;
                self.move_to("MOVC", &via, (&speed, ""), motion)?;
                "MOVC"
            }
        };
        self.move_to(verb, &to, (&speed, &rest), motion)?;
        self.last = Some((to, verb == "MOVC"));
        Ok(())
    }

    /// The first point of a circle is where the tool is.
    fn circle_begins(&mut self, speed: &str, motion: &MotionInstruction) -> Result<(), WriteError> {
        let Some((from, round)) = self.last.clone() else {
            return Err(self
                .out
                .no_words(("a circle that begins nowhere", "move to its start first")));
        };
        for verb in ["MOVL", "MOVC"] {
            if verb == "MOVC" || round {
                self.move_to(verb, &from, (speed, ""), motion)?;
            }
        }
        Ok(())
    }

    fn speed(&self, motion: &MotionInstruction) -> Result<String, WriteError> {
        let joint = motion.kind == MotionKind::Joint;
        let unit = if joint {
            SpeedUnit::Percent
        } else {
            self.words.unit()
        };
        match (&motion.speed, motion.speed.given_in(unit)) {
            (Speed::Weld, _) => Ok(String::new()),
            (_, Some(share)) if joint && share >= 0.01 => Ok(format!(" VJ={}", fixed(share, 2))),
            (_, Some(value)) if !joint && value >= 0.1 => Ok(format!(" V={}", fixed(value, 1))),
            _ => Err(self.out.no_words((
                "a speed in this unit, or below a tenth of it",
                "give it in the unit of program.inform.speed_unit, joint moves in %",
            ))),
        }
    }
}

/// How the share begins that a station's axes have of their speeds.
const SHARE: &str = "VJ=";

/// A position by its number, where the arm's place is known.
fn entry(position: &Position) -> Option<(u32, Entry)> {
    let robot = position.robot()?;
    let further = position.groups.iter().find(|g| g.number != 1);
    let station = match further.map(|g| &g.coordinates) {
        Some(Coordinates::Joint(axes)) => axes.clone(),
        _ => Vec::new(),
    };
    let entry = Entry {
        coordinates: robot.coordinates.clone(),
        frames: (robot.frame, robot.tool),
        station,
    };
    Some((position.index, entry))
}

/// Whether two times have the same digits in a job, s.
fn same_time(a: f64, b: f64) -> bool {
    (a - b).abs() < 5e-3
}

/// Whether a word of a line is one of the job's positions, such as `C00012`.
fn names_position(text: &str) -> bool {
    let mut words = text.split(|c: char| !c.is_ascii_alphanumeric());
    words.any(|w| {
        let arm = w.strip_prefix(['B', 'E', 'b', 'e']).unwrap_or(w);
        let number = arm.strip_prefix(['C', 'c']).unwrap_or_default();
        !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
    })
}
