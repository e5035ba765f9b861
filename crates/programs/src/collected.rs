//! A program while its text is read: instructions with their lines, positions by their names.

use std::collections::BTreeMap;

use crate::parsed::{Parsed, Unread};
use crate::program::{
    ArcLine, ArcWord, CommentMark, Coordinates, Dialect, Group, Instruction, MotionInstruction,
    MotionKind, Position, PositionRef, Program, Speed, Termination, Unsaid,
};
use crate::scan::tidy;
use crate::template::ArcLines;

/// A program being read.
#[derive(Debug)]
pub(crate) struct Collected {
    pub(crate) program: Program,
    pub(crate) unread: Vec<Unread>,
    /// Line being read, from 1.
    pub(crate) line: u32,
    names: BTreeMap<String, u32>,
}

impl Collected {
    pub(crate) fn new(dialect: Dialect, name: &str) -> Self {
        Collected {
            program: Program {
                dialect,
                name: name.to_owned(),
                ..Program::default()
            },
            unread: Vec::new(),
            line: 0,
            names: BTreeMap::new(),
        }
    }

    /// Adds an instruction of the line being read.
    pub(crate) fn push(&mut self, instruction: Instruction) {
        if let Instruction::Raw(text) = &instruction {
            self.unread.push(Unread {
                line: self.line,
                text: text.clone(),
            });
        }
        self.program.instructions.push(instruction);
        self.program.lines.push(self.line);
    }

    /// Adds a move that switches nothing.
    pub(crate) fn push_move(
        &mut self,
        kind: MotionKind,
        target: PositionRef,
        speed: Speed,
        termination: Termination,
    ) {
        let motion = MotionInstruction::plain(kind, target, speed, termination);
        self.push(Instruction::Motion(motion));
    }

    /// A comment for people.
    pub(crate) fn remark(&mut self, text: &str) {
        self.push(Instruction::Comment {
            mark: CommentMark::Remark,
            text: text.trim_end().to_owned(),
        });
    }

    /// What a line says before its remark, if it is not empty; a line that is all remark is kept as one.
    pub(crate) fn said<'a>(&mut self, line: &'a str, mark: &str) -> Option<&'a str> {
        if let Some(text) = line.strip_prefix(mark) {
            self.remark(text);
            return None;
        }
        let said = line.split(mark).next()?.trim();
        (!line.is_empty()).then_some(said)
    }

    /// Another program runs.
    pub(crate) fn call(&mut self, program: &str, arguments: &str) {
        self.push(Instruction::Call {
            program: program.to_owned(),
            arguments: tidy(arguments),
        });
    }

    /// Keeps the line being read as it is.
    pub(crate) fn keep(&mut self, text: &str) {
        self.push(Instruction::Raw(tidy(text)));
    }

    /// Keeps the line being read, which shapes no metal by the kind of what it names.
    pub(crate) fn pass(&mut self, text: &str) {
        let at = self.program.instructions.len();
        self.program.passes.insert(at);
        self.keep(text);
    }

    /// Keeps the line being read, and marks it where it sets an output of the arc's.
    pub(crate) fn keep_beside(&mut self, arc: Option<ArcLines<'_>>, text: &str) {
        if arc.is_some_and(|arc| arc.touches(text)) {
            let at = self.program.instructions.len();
            self.program.arc_lines.insert(at, ArcLine::Output);
        }
        self.keep(text);
    }

    /// Keeps lines that begin as those of the arc do and go on otherwise, told at the one that does; how many they are.
    pub(crate) fn broken(&mut self, arc: ArcLines<'_>, lines: &[&str]) -> usize {
        let Some(broken) = arc.broken(lines).and_then(|n| lines.get(..n)) else {
            return 0;
        };
        let first = self.line;
        for (i, line) in broken.iter().enumerate() {
            self.line = first + i as u32;
            let at = self.program.instructions.len();
            let what = if i + 1 == broken.len() {
                ArcLine::Breaks
            } else {
                ArcLine::Begins
            };
            self.program.arc_lines.insert(at, what);
            self.keep(line);
        }
        broken.len()
    }

    /// The last move.
    pub(crate) fn last_move(&mut self) -> Option<&mut MotionInstruction> {
        let all = self.program.instructions.iter_mut().rev();
        let mut moves = all.filter_map(|i| match i {
            Instruction::Motion(motion) => Some(motion),
            _ => None,
        });
        moves.next()
    }

    /// The arc is switched at the end of the move before, where that is the last thing that was read.
    pub(crate) fn switch(&mut self, word: ArcWord) {
        match self.program.instructions.last_mut() {
            Some(Instruction::Motion(motion)) if motion.arc.is_none() => motion.arc = Some(word),
            _ => self.push(Instruction::Arc(word)),
        }
    }

    /// What the last instruction does to a bead beside its own words.
    pub(crate) fn unsaid(&mut self, all: impl IntoIterator<Item = Unsaid>) {
        let mut all = all.into_iter().peekable();
        if let (Some(at), true) = (
            self.program.instructions.len().checked_sub(1),
            all.peek().is_some(),
        ) {
            self.program.unsaid.entry(at).or_default().extend(all);
        }
    }

    /// A position that has no name.
    pub(crate) fn place(
        &mut self,
        coordinates: Coordinates,
        frames: (Option<u32>, Option<u32>),
    ) -> PositionRef {
        let index = self.program.positions.last().map_or(1, |p| p.index + 1);
        self.add(index, None, coordinates, frames);
        PositionRef::point(index)
    }

    /// The position called `name`, known by `numbered` where that is its number; `look_up` finds it where it is new.
    pub(crate) fn named(
        &mut self,
        name: &str,
        frames: (Option<u32>, Option<u32>),
        look_up: impl FnOnce() -> Option<Coordinates>,
    ) -> Option<PositionRef> {
        if let Some(index) = self.names.get(name) {
            return Some(PositionRef::point(*index));
        }
        let coordinates = look_up()?;
        let index = self.program.positions.last().map_or(1, |p| p.index + 1);
        // names that only number are not kept
        let number = name
            .strip_prefix(['P', 'p'])
            .and_then(|n| n.parse::<u32>().ok());
        let plain = number == Some(index) && name == format!("P{index}");
        self.add(
            index,
            (!plain).then(|| name.to_owned()),
            coordinates,
            frames,
        );
        self.names.insert(name.to_owned(), index);
        Some(PositionRef::point(index))
    }

    fn add(
        &mut self,
        index: u32,
        comment: Option<String>,
        coordinates: Coordinates,
        (frame, tool): (Option<u32>, Option<u32>),
    ) {
        self.program.positions.push(Position {
            index,
            comment,
            groups: vec![Group {
                number: 1,
                frame,
                tool,
                coordinates,
            }],
        });
    }

    /// What was read of a file of these lines.
    pub(crate) fn finish(mut self, lines: &[&str]) -> Parsed {
        let text = |line: &u32| {
            let at = (*line as usize).checked_sub(1);
            let text = at.and_then(|i| lines.get(i));
            text.map(|t| tidy(t)).unwrap_or_default()
        };
        self.program.texts = self.program.lines.iter().map(text).collect();
        Parsed {
            lines: self.program.lines.clone(),
            program: self.program,
            unread: self.unread,
        }
    }
}

/// A number of a file times the unit's factor, without the digits that the product invents.
pub(crate) fn scaled(value: f64, factor: f64) -> f64 {
    (value * factor * 1e9).round() / 1e9
}

/// The index of a value among those that are there, each once; it is added where it is new.
pub(crate) fn indexed(all: &mut Vec<String>, value: String) -> usize {
    let known = all.iter().rposition(|v| *v == value);
    known.unwrap_or_else(|| {
        all.push(value);
        all.len() - 1
    })
}
