//! What all writers share: what cannot be written, and numbers as text.

use std::collections::BTreeMap;

use meltpath_toolpath::Weave;

use crate::program::{Coordinates, Group, Instruction, PositionRef, Program, Speed, Termination};

/// Why a program cannot be written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WriteError {
    /// A coordinate or a speed is infinite or not a number.
    #[error("program {program}: {what} is not finite or too small to write; nothing is written")]
    NotFinite {
        /// Program.
        program: String,
        /// Which number.
        what: String,
    },
    /// A text would break the file: a line break or, in a header, a semicolon.
    #[error("program {program}: {what} holds a character that programs cannot hold: {text:?}")]
    Text {
        /// Program.
        program: String,
        /// Which text.
        what: &'static str,
        /// That text.
        text: String,
    },
    /// The cell does not say what this dialect needs.
    #[error(
        "program {program}: the cell file has no [program.{table}], which {dialect} needs: write it"
    )]
    NoTable {
        /// Program.
        program: String,
        /// The table.
        table: &'static str,
        /// The dialect.
        dialect: &'static str,
    },
    /// A file is larger than the cell says.
    #[error(
        "{file} has {bytes} bytes, more than the {most} of program.bytes_per_file: lower lines_per_program and points_per_program of the cell file, or cut programs at layers (program.split = \"layer\")"
    )]
    TooLarge {
        /// Its name.
        file: String,
        /// Its size.
        bytes: usize,
        /// The most.
        most: usize,
    },
    /// Something that the dialect has no words for.
    #[error(
        "program {program}, instruction {instruction}: {what} cannot be written for this controller: {remedy}"
    )]
    NoWords {
        /// Program.
        program: String,
        /// Its number, from 1.
        instruction: usize,
        /// What.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
}

/// A file of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextFile {
    /// File name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// What a dialect has no words for, and what to do.
pub(crate) type NoWords = (&'static str, &'static str);

/// A bead that is cut where the arc's lines cannot be.
pub(crate) const GOES_ON: NoWords = (
    "a bead that goes on in another program",
    "raise lines_per_program and points_per_program of the cell file, or plan shorter beads",
);
pub(crate) const WEAVE: NoWords = (
    "a weave",
    "plan without one, or write the program for a controller that weaves",
);
pub(crate) const JUMP: NoWords = ("a jump", "write the moves one after the other");
pub(crate) const NO_PLACE: NoWords = ("a position that is not there", "teach it");
pub(crate) const ENDING: NoWords = ("this way to end a move", "give the distance of blending");
pub(crate) const UNIT: NoWords = ("a speed in this unit", "give it in mm/s");
pub(crate) const THREE_MOVES: NoWords = ("a circle through three moves", "give its via point");
pub(crate) const BETWEEN_MOVES: NoWords = (
    "an arc that is switched between moves",
    "switch it at the end of a move",
);
/// What to do where a pose does not say how the arm stands.
pub(crate) const NAME_THE_ROBOT: &str = "name a robot of this controller's maker (machine.robot; a file of yours says maker), and see that it reaches every place: the check of reach tells";

/// What is taken of each position of the robot's own group, by the position's number.
pub(crate) fn robot_places<T>(program: &Program, take: impl Fn(&Group) -> T) -> BTreeMap<u32, T> {
    let own = program
        .positions
        .iter()
        .filter_map(|p| p.robot().map(|g| (p.index, take(g))));
    own.collect()
}

/// The text of a program while it is written.
pub(crate) struct Lines<'a> {
    pub(crate) program: &'a Program,
    /// Instruction being written, from 0.
    pub(crate) at: usize,
    indent: &'static str,
    pub(crate) text: String,
}

impl<'a> Lines<'a> {
    /// No lines yet.
    ///
    /// # Errors
    /// Where [`check`] refuses the program.
    pub(crate) fn new(program: &'a Program, indent: &'static str) -> Result<Self, WriteError> {
        check(program)?;
        Ok(Lines {
            program,
            at: 0,
            indent,
            text: String::new(),
        })
    }

    pub(crate) fn line(&mut self, text: &str) {
        for part in [self.indent, text, "\n"] {
            self.text.push_str(part);
        }
    }

    /// What the dialect has no words for in the instruction being written.
    pub(crate) fn no_words(&self, (what, remedy): NoWords) -> WriteError {
        WriteError::NoWords {
            program: self.program.name.clone(),
            instruction: self.at + 1,
            what: what.to_owned(),
            remedy,
        }
    }

    /// What `names` call a position; what only the controller knows stands as it is.
    pub(crate) fn place(
        &self,
        names: &BTreeMap<u32, String>,
        reference: &PositionRef,
    ) -> Result<String, WriteError> {
        match reference {
            PositionRef::Point { index, .. } => match names.get(index) {
                Some(name) => Ok(name.clone()),
                None => Err(self.no_words(NO_PLACE)),
            },
            PositionRef::Unresolved(text) => Ok(text.clone()),
        }
    }

    /// The weave that is on for the next move, where `now` is.
    pub(crate) fn coming_weave(&self, now: Option<Weave>) -> Option<Weave> {
        let coming = self.coming().iter();
        let until = coming.take_while(|i| !matches!(i, Instruction::Motion(_)));
        let said = until.filter_map(|i| match i {
            Instruction::Weave(weave) => Some(*weave),
            _ => None,
        });
        said.last().unwrap_or(now)
    }

    /// The instructions that follow the one being written.
    pub(crate) fn coming(&self) -> &'a [Instruction] {
        self.program
            .instructions
            .get(self.at + 1..)
            .unwrap_or_default()
    }
}

/// A fixed number of decimals, without a minus sign before zero.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
    match text.strip_prefix('-') {
        Some(positive) if zero => positive.to_owned(),
        _ => text,
    }
}

/// At most so many decimals: no zeros at the end.
pub(crate) fn short(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Refuses numbers that are not finite, and texts that would break a line.
pub(crate) fn check(program: &Program) -> Result<(), WriteError> {
    let infinite = |what: String| {
        Err(WriteError::NotFinite {
            program: program.name.clone(),
            what,
        })
    };
    for position in &program.positions {
        for group in &position.groups {
            let finite = match &group.coordinates {
                Coordinates::Cartesian {
                    xyz,
                    wpr_degrees,
                    external,
                    ..
                } => {
                    xyz.iter().chain(wpr_degrees).all(|v| v.is_finite())
                        && external.iter().all(|a| a.value.is_finite())
                }
                Coordinates::Joint(axes) => axes.iter().all(|a| a.value.is_finite()),
                Coordinates::Unread(_) => true,
            };
            if !finite {
                return infinite(format!("position P[{}]", position.index));
            }
        }
    }
    for (i, instruction) in program.instructions.iter().enumerate() {
        let finite = match instruction {
            Instruction::Motion(m) => {
                let speed = match m.speed {
                    // less would be written as zero
                    Speed::Value { value, .. } => value.is_finite() && value >= 1e-3,
                    Speed::Register { .. } | Speed::Weld | Speed::Maximum | Speed::Other(_) => true,
                };
                let ends = match m.termination {
                    Termination::Blend(distance) => distance.is_finite() && distance >= 1e-3,
                    _ => true,
                };
                speed && ends
            }
            Instruction::Wait(seconds) => seconds.is_finite() && *seconds >= 0.0,
            _ => true,
        };
        if !finite {
            return infinite(format!("the speed or time in line {}", i + 1));
        }
        if let Instruction::Comment { text, .. } | Instruction::Raw(text) = instruction
            && text.contains(['\n', '\r'])
        {
            return Err(WriteError::Text {
                program: program.name.clone(),
                what: "a comment or instruction",
                text: text.clone(),
            });
        }
    }
    for attribute in &program.attributes {
        if attribute.value.contains(['\n', '\r']) {
            return Err(WriteError::Text {
                program: program.name.clone(),
                what: "the header",
                text: attribute.value.clone(),
            });
        }
    }
    Ok(())
}
