//! A program to VAL3.

use std::collections::BTreeMap;

use quick_xml::escape::escape;

use super::data::{Descriptor, PART, Written};
use super::words::Val3Words;
use crate::held::Holds;
use crate::program::{
    ArcWord, Coordinates, Instruction, MotionInstruction, MotionKind, PositionRef, Program,
    SpeedUnit, Termination,
};
use crate::template::UNFILLED;
use crate::written::{
    ENDING, JUMP, Lines, NO_PLACE, NoWords, THREE_MOVES, TextFile, WEAVE, WriteError, robot_places,
    short,
};

/// A speed along the path that limits no joint move, mm/s.
const FREE: f64 = 99_999.0;
/// The words of a cell are those of one part and one torch.
const OTHER_FRAME: NoWords = (
    "a second user frame or tool",
    "write the moves of each as a program of its own",
);
/// A project has the words of one arrangement.
const HOLDS: NoWords = (
    "moves with the torch on the robot beside those with the part on it",
    "write the moves of each as a program of its own",
);
/// What joint moves ask for besides.
const JOINTS_IN_PERCENT: NoWords = ("a speed in this unit", "give it in mm/s, joint moves in %");
const XML: &str = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";

/// The files of a project, its program and its data first, with `\n` line ends.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or VAL3 has no words for something.
pub fn write(program: &Program, words: &Val3Words) -> Result<Vec<TextFile>, WriteError> {
    let mut writer = Writer {
        out: Lines::new(program, "  ")?,
        words,
        places: robot_places(program, |g| g.coordinates.clone()),
        frames: robot_places(program, |g| (g.frame, g.tool)),
        first: (None, None),
        data: Written::default(),
        holds: Holds::Torch,
        moves: None,
        queued: false,
        calls: false,
    };
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.out.at = at;
        let mut rest = program.instructions.iter().skip(at + 1);
        let next = rest.find(|i| !matches!(i, Instruction::Comment { .. }));
        writer.calls = matches!(next, Some(Instruction::Call { .. }));
        writer.instruction(instruction)?;
    }
    let name = program.name.as_str();
    let file = |ending: &str, text: String| TextFile {
        name: ending.replace('*', name),
        text,
    };
    Ok(vec![
        file("*.pgx", code(name, &writer.out.text)),
        file(
            "*.dtx",
            writer.data.file(words, writer.moves == Some(Holds::Part)),
        ),
        file("*.pjx", project(name)),
        file(
            "start.pgx",
            code("start", &format!("  call {name}()\n  waitEndMove()\n")),
        ),
        file("stop.pgx", code("stop", "  resetMotion()\n")),
    ])
}

fn project(name: &str) -> String {
    let name = escape(name);
    format!(
        "{XML}<Project xmlns=\"http://www.staubli.com/robotics/VAL3/Project/3\">\n  \
         <Parameters version=\"s7.10.2\" stackSize=\"5000\" millimeterUnit=\"true\" />\n  <Programs>\n    \
         <Program file=\"{name}.pgx\" />\n    <Program file=\"start.pgx\" />\n    <Program file=\"stop.pgx\" />\n  </Programs>\n  \
         <Database>\n    <Data file=\"{name}.dtx\" />\n  </Database>\n  <Libraries />\n</Project>\n"
    )
}

fn code(name: &str, lines: &str) -> String {
    let access = if matches!(name, "start" | "stop") {
        "public"
    } else {
        "private"
    };
    format!(
        "{XML}<Programs xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xmlns=\"http://www.staubli.com/robotics/VAL3/Program/2\">\n  \
         <Program name=\"{}\" access=\"{access}\">\n    <Code><![CDATA[\nbegin\n{lines}end\n]]></Code>\n  </Program>\n</Programs>\n",
        escape(name)
    )
}

struct Writer<'a> {
    out: Lines<'a>,
    words: &'a Val3Words,
    places: BTreeMap<u32, Coordinates>,
    /// User frame and tool of each position, and the first ones.
    frames: BTreeMap<u32, (Option<u32>, Option<u32>)>,
    first: (Option<u32>, Option<u32>),
    data: Written,
    /// What the robot holds, as the program says it, and along all moves so far.
    holds: Holds,
    moves: Option<Holds>,
    /// Moves were told that may not have ended.
    queued: bool,
    /// A program is called next.
    calls: bool,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) -> Result<(), WriteError> {
        if text.contains("]]>") {
            return Err(self.out.no_words(("\"]]>\"", "leave it out")));
        }
        self.out.line(text);
        Ok(())
    }

    /// Lets the moves end that were told.
    fn stop(&mut self) -> Result<(), WriteError> {
        if std::mem::take(&mut self.queued) {
            self.line("waitEndMove()")?;
        }
        Ok(())
    }

    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => {
                let line = self.motion(motion)?;
                self.line(&line)?;
                self.queued = true;
                match &motion.arc {
                    Some(word) => self.arc(word),
                    None => Ok(()),
                }
            }
            Instruction::Arc(word) => self.arc(word),
            Instruction::Wait(seconds) => {
                self.stop()?;
                self.line(&format!("delay({})", short(*seconds, 3)))
            }
            // points and moves name theirs
            Instruction::UserFrame(_) | Instruction::ToolFrame(_) | Instruction::Blank => Ok(()),
            Instruction::Holds(holds) => {
                self.holds = *holds;
                Ok(())
            }
            Instruction::Call { program, .. } => {
                // its outputs act at once, and moves of its own may be left behind it
                self.stop()?;
                self.queued = true;
                self.line(&format!("call {program}()"))
            }
            Instruction::Comment { text, .. } => self.line(&format!("//{text}")),
            Instruction::End => self.line("return"),
            Instruction::Raw(text) => {
                if text.starts_with("wait(") {
                    self.stop()?;
                }
                self.line(text)
            }
            Instruction::Weave(_) => Err(self.out.no_words(WEAVE)),
            Instruction::Label { .. } | Instruction::Jump(_) => Err(self.out.no_words(JUMP)),
        }
    }

    fn arc(&mut self, word: &ArcWord) -> Result<(), WriteError> {
        let Some(lines) = self.words.arc().filled(word, false) else {
            return Err(self.out.no_words(UNFILLED));
        };
        self.stop()?;
        lines.iter().try_for_each(|line| self.line(line))
    }

    /// The coordinates of a position, in the frames of all others.
    fn place(&mut self, reference: &PositionRef) -> Result<Coordinates, WriteError> {
        let index = match reference {
            PositionRef::Point { index, .. } => Some(index),
            PositionRef::Unresolved(_) => None,
        };
        if let Some((frame, tool)) = index.and_then(|i| self.frames.get(i)) {
            let first = (self.first.0.or(*frame), self.first.1.or(*tool));
            self.first = first;
            let other = |own: &Option<u32>, first| own.is_some() && *own != first;
            if other(frame, first.0) || other(tool, first.1) {
                return Err(self.out.no_words(OTHER_FRAME));
            }
        }
        let found = index.and_then(|i| self.places.get(i));
        found.cloned().ok_or_else(|| self.out.no_words(NO_PLACE))
    }

    /// What a move names: the point on the way of a circle, where it ends, and the tool.
    fn names(
        &mut self,
        motion: &MotionInstruction,
    ) -> Result<(Option<String>, String, String), WriteError> {
        if *self.moves.get_or_insert(self.holds) != self.holds {
            return Err(self.out.no_words(HOLDS));
        }
        let via = match &motion.kind {
            MotionKind::Circular { via } => Some(self.place(via)?),
            _ => None,
        };
        let to = self.place(&motion.target)?;
        let named = if self.holds == Holds::Part && !matches!(to, Coordinates::Joint(_)) {
            let via = via.map(|via| self.data.held(&to, Some(&via)));
            let end = self.data.held(&to, None);
            match (via, end) {
                (None, Some((end, tool))) => Some((None, end, tool)),
                (Some(Some((via, _))), Some((end, tool))) => Some((Some(via), end, tool)),
                _ => None,
            }
        } else {
            let via = via.map(|via| self.data.place(&via));
            let tool = match self.holds {
                Holds::Part => PART,
                _ => "tTorch",
            };
            let end = self.data.place(&to);
            match (via, end) {
                (None, Some(end)) => Some((None, end, tool.to_owned())),
                (Some(Some(via)), Some(end)) => Some((Some(via), end, tool.to_owned())),
                _ => None,
            }
        };
        named.ok_or_else(|| self.out.no_words(NO_PLACE))
    }

    fn motion(&mut self, motion: &MotionInstruction) -> Result<String, WriteError> {
        let joint = motion.kind == MotionKind::Joint;
        let percent = motion.speed.given_in(SpeedUnit::Percent).filter(|_| joint);
        let path = motion
            .speed
            .given_in(SpeedUnit::MillimetrePerSecond)
            .filter(|_| !joint);
        let (share, speed) = match (percent, path) {
            (Some(share), _) => (share, FREE),
            (None, Some(speed)) => (100.0, speed),
            (None, None) => return Err(self.out.no_words(JOINTS_IN_PERCENT)),
        };
        // what switches the arc stops the arm, and so does a call
        let termination = if motion.arc.is_some() || self.calls {
            Termination::Fine
        } else {
            motion.termination.clone()
        };
        let how = Descriptor {
            acceleration: 100.0,
            share,
            speed,
            turns: None,
            termination,
        };
        let verb = match &motion.kind {
            MotionKind::Joint => "movej",
            MotionKind::Linear => "movel",
            MotionKind::Circular { .. } => "movec",
            MotionKind::CircleArc => {
                return Err(self.out.no_words(THREE_MOVES));
            }
        };
        let (via, to, tool) = self.names(motion)?;
        let via = via.map(|via| format!("{via},")).unwrap_or_default();
        let Some(how) = self.data.descriptor(&how) else {
            return Err(self.out.no_words(ENDING));
        };
        Ok(format!("{verb}({via}{to},{tool},{how})"))
    }
}
