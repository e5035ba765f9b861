//! A program from INFORM. Never panics; what it does not know it keeps and lists.

use super::motion::{Line, NO_LEVEL, Path, line as motion_line};
use super::positions::{Entry, Table};
use super::pulses::Pulses;
use super::times::{self, Stands};
use super::words::InformWords;
use crate::collected::Collected;
use crate::parsed::{ParseError, Parsed, Unread, decoded, trimmed};
use crate::program::{
    ArcAction, ArcWord, COORDINATED, Coordinates, Dialect, Group, Instruction, MotionInstruction,
    MotionKind, PositionRef, Termination, Unsaid,
};
use crate::scan::{duration, strip_prefix, strip_word, word};

/// Reads a job; `words` say what zones mean and what switches the arc, `pulses` where base axis and station stand. Moves that name positions of
/// either are kept and told where their pulses are not known.
///
/// # Errors
/// [`ParseError`] where the text is no job, or the job does not end.
pub fn read(
    bytes: &[u8],
    words: Option<&InformWords>,
    pulses: &Pulses,
) -> Result<Vec<Parsed>, ParseError> {
    let text = decoded(bytes);
    let lines: Vec<&str> = trimmed(&text).collect();
    if !lines.iter().any(|l| l.eq_ignore_ascii_case("/JOB")) {
        return Err(ParseError::Other {
            dialect: "Yaskawa",
            wanted: "/JOB",
        });
    }
    let mut reader = Reader {
        out: Collected::new(Dialect::Inform, ""),
        words,
        group: pulses.group,
        table: Table::new(pulses.clone()),
        section: Section::Head,
        arc: None,
        round: Vec::new(),
        last: None,
    };
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        reader.out.line = at as u32 + 1;
        if reader.section == Section::Instructions && line.eq_ignore_ascii_case("END") {
            reader.close_round();
            return Ok(vec![reader.out.finish(&lines)]);
        }
        at += reader.lines(lines.get(at..).unwrap_or_default()).max(1);
    }
    Err(ParseError::Unended {
        line: lines.len() as u32,
        wanted: "END",
    })
}

/// Where in the job a line stands.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Head,
    Positions,
    Instructions,
}

/// One `MOVC`, its place and its line in the file.
struct Round {
    entry: Entry,
    line: Line,
    at: u32,
}

struct Reader<'w> {
    out: Collected,
    words: Option<&'w InformWords>,
    /// Number of the station's group.
    group: u32,
    table: Table,
    section: Section,
    /// The values of the arc that is on.
    arc: Option<String>,
    /// Circular moves that follow each other.
    round: Vec<Round>,
    /// Where the last move ended, and whether that was the end of a circle.
    last: Option<(Entry, bool)>,
}

impl Reader<'_> {
    /// Takes in the first of `lines`; how many belong to it.
    fn lines(&mut self, lines: &[&str]) -> usize {
        let Some(line) = lines.first().filter(|l| !l.is_empty()) else {
            return 1;
        };
        if let Some(name) = strip_prefix(line, "//NAME ") {
            name.trim().clone_into(&mut self.out.program.name);
        } else if line.eq_ignore_ascii_case("//POS") {
            self.section = Section::Positions;
        } else if line.eq_ignore_ascii_case("//INST") {
            self.section = Section::Instructions;
        } else if self.section == Section::Positions {
            if !self.table.line(line) {
                self.out.unread.push(Unread {
                    line: self.out.line,
                    text: (*line).to_owned(),
                });
            }
        } else if self.section == Section::Instructions {
            return self.instruction(line, lines);
        }
        1
    }

    fn instruction(&mut self, line: &str, lines: &[&str]) -> usize {
        if line.starts_with("///") {
            self.out.program.application.push(line.to_owned());
            return 1;
        }
        let motion = motion_line(line, self.words);
        let found = motion.and_then(|m| Some((self.table.get(&m.names)?, m)));
        if let Some((entry, line)) = found {
            self.motion(entry, line);
            return 1;
        }
        self.close_round();
        if let Some(words) = self.words
            && let Some((taken, word)) = words.arc().read(lines, &mut self.arc)
        {
            self.stand();
            let text = lines.get(..taken).unwrap_or_default().iter();
            let said = text.filter_map(|line| times::of(line)).next_back();
            self.switch(word, said);
            return taken;
        }
        self.statement(line);
        1
    }

    fn motion(&mut self, entry: Entry, line: Line) {
        if line.path == Path::Round {
            let at = self.out.line;
            self.round.push(Round { entry, line, at });
            return;
        }
        self.close_round();
        let here = matches!(&self.last, Some((last, true)) if *last == entry);
        if here && line.path == Path::Straight && unlevelled(&line) {
            // it only parts two circles
            self.last = Some((entry, false));
            return;
        }
        let kind = match line.path {
            Path::Joint => MotionKind::Joint,
            Path::Straight | Path::Round => MotionKind::Linear,
        };
        self.push(kind, entry, line);
    }

    fn push(&mut self, kind: MotionKind, entry: Entry, line: Line) {
        let round = matches!(kind, MotionKind::Circular { .. });
        let target = self.place(&entry);
        self.last = Some((entry, round));
        let coordinated = line.coordinated.then(|| COORDINATED.to_owned());
        self.out.push(Instruction::Motion(MotionInstruction {
            extra: coordinated.into_iter().chain(line.extra).collect(),
            ..MotionInstruction::plain(kind, target, line.speed, line.termination)
        }));
    }

    fn place(&mut self, entry: &Entry) -> PositionRef {
        let place = self.out.place(entry.coordinates.clone(), entry.frames);
        if let (false, Some(position)) = (
            entry.station.is_empty(),
            self.out.program.positions.last_mut(),
        ) {
            position.groups.push(Group {
                number: self.group,
                frame: entry.frames.0,
                tool: entry.frames.1,
                coordinates: Coordinates::Joint(entry.station.clone()),
            });
        }
        place
    }

    /// Three circular moves are a circle; the first of them goes straight to where it begins, if the tool is not there.
    fn close_round(&mut self) {
        let mut chain = std::mem::take(&mut self.round);
        let line = self.out.line;
        let circle = chain.len() == 3 && chain.get(1).is_some_and(|r| unlevelled(&r.line));
        if circle {
            let end = chain.pop();
            let via = chain.pop();
            if let Some(start) = chain.pop() {
                let here = self.last.as_ref().is_some_and(|l| l.0 == start.entry);
                if !(here && unlevelled(&start.line)) {
                    self.out.line = start.at;
                    self.push(MotionKind::Linear, start.entry, start.line);
                }
            }
            if let (Some(via), Some(end)) = (via, end) {
                self.out.line = end.at;
                let via = self.place(&via.entry);
                self.push(MotionKind::Circular { via }, end.entry, end.line);
            }
        }
        for round in chain {
            self.out.line = round.at;
            self.push(MotionKind::CircleArc, round.entry, round.line);
        }
        self.out.line = line;
    }

    /// What is no move waits until the move before has ended.
    fn stand(&mut self) {
        if let Some(Instruction::Motion(motion)) = self.out.program.instructions.last_mut()
            && motion.termination == Termination::Other(NO_LEVEL.to_owned())
        {
            motion.termination = Termination::Fine;
        }
    }

    fn statement(&mut self, line: &str) {
        if let Some(text) = line.strip_prefix('\'') {
            return self.out.remark(text);
        }
        if line.eq_ignore_ascii_case("NOP") {
            return;
        }
        if let Some(instruction) = self.known(line) {
            if matches!(instruction, Instruction::Wait(_)) {
                self.stand();
            }
            return match instruction {
                Instruction::Arc(word) => {
                    self.stand();
                    let ends = word.action == ArcAction::End;
                    let said = times::of(line);
                    let untold = ends && said.is_none();
                    self.switch(word, said);
                    self.out
                        .unsaid(untold.then(|| Unsaid::Crater(line.to_owned())));
                }
                other => self.out.push(other),
            };
        }
        let moves = ["MOV", "SMOV", "IMOV", "REFP"];
        if moves.iter().any(|w| strip_prefix(line, w).is_some()) {
            self.last = None;
        }
        let arc = self.words.map(InformWords::arc);
        self.out.keep_beside(arc, line);
    }

    /// Switches the arc, and stands with it as long as the line says that switches it.
    fn switch(&mut self, word: ArcWord, said: Option<Stands>) {
        let Some(Stands { time, valued, text }) = said else {
            return self.out.switch(word);
        };
        match (word.action, valued) {
            (ArcAction::Start, _) => {
                self.out.switch(word);
                self.out.push(Instruction::Wait(time));
            }
            (ArcAction::End, false) => {
                self.out.push(Instruction::Wait(time));
                self.out.push(Instruction::Arc(word));
            }
            (ArcAction::End, true) => {
                self.out.switch(word);
                self.out.unsaid([Unsaid::CraterFeed(text)]);
            }
        }
    }

    fn known(&mut self, line: &str) -> Option<Instruction> {
        if line.eq_ignore_ascii_case("RET") {
            return Some(Instruction::End);
        }
        if let Some(rest) = strip_word(line, "TIMER") {
            return duration(strip_prefix(rest.trim(), "T=")?).map(Instruction::Wait);
        }
        if let Some(rest) = strip_word(line, "CALL") {
            let (name, rest) = word(strip_prefix(rest.trim(), "JOB:")?)?;
            return rest.trim().is_empty().then(|| Instruction::Call {
                program: name.to_owned(),
                arguments: String::new(),
            });
        }
        for name in ["ARCON", "ARCSET"] {
            if let Some(rest) = strip_word(line, name) {
                let arguments = rest.trim().to_owned();
                self.arc = Some(arguments.clone());
                let word = ArcWord::new(ArcAction::Start, arguments);
                return Some(Instruction::Arc(word));
            }
        }
        strip_word(line, "ARCOF").map(|_| {
            let on = self.arc.take().unwrap_or_default();
            Instruction::Arc(ArcWord::new(ArcAction::End, on))
        })
    }
}

/// A move that says only where it goes and how fast.
fn unlevelled(line: &Line) -> bool {
    line.termination == Termination::Other(NO_LEVEL.to_owned()) && line.extra.is_empty()
}
