//! A program to KRL.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::arc::{self, Form, WeldData};
use super::words::KrlWords;
use super::{COUPLED, data};
use crate::program::{
    ArcAction, Instruction, Motion, MotionKind, PositionRef, Program, Speed, SpeedUnit, Termination,
};
use crate::written::{GOES_ON, TextFile, WriteError, check, no_words, short};

/// The two files of a program, with `\n` line ends: 1 µm and 0.0001°.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or KRL has no words for something.
pub fn write(program: &Program, words: &KrlWords) -> Result<Vec<TextFile>, WriteError> {
    check(program)?;
    let mut writer = Writer {
        program,
        names: program
            .positions
            .iter()
            .map(|p| (p.index, data::name_of(p)))
            .collect(),
        text: String::new(),
        at: 0,
        velocity: String::new(),
        joint_velocity: String::new(),
        distance: String::new(),
        arc: None,
        burns: false,
        sets: Vec::new(),
        seams: 0,
    };
    if program.application.is_empty() {
        writer.line("&ACCESS RVP");
    }
    for line in &program.application {
        writer.line(line);
    }
    writer.line(&format!("DEF {}( )", program.name));
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.at = at;
        writer.instruction(instruction)?;
    }
    if writer.arc.is_some() {
        return Err(writer.no_words(GOES_ON.0, GOES_ON.1));
    }
    writer.line("END");
    let mut list = format!("&ACCESS RVP\nDEFDAT {}\n", program.name);
    for position in &program.positions {
        if let Some((kind, value)) = data::aggregate(position) {
            // writing to a String cannot fail
            let _ = writeln!(list, "DECL {kind} X{}={value}", data::name_of(position));
        }
    }
    for (i, set) in writer.sets.iter().enumerate() {
        let _ = writeln!(list, "{}", arc::declaration(i + 1, set, words));
    }
    for seam in 1..=writer.seams {
        let _ = writeln!(list, "{}", arc::seam(seam));
    }
    for line in program.sections.iter().flat_map(|s| &s.lines) {
        let _ = writeln!(list, "{line}");
    }
    list += "ENDDAT\n";
    let file = |ending: &str, text: String| TextFile {
        name: format!("{}.{ending}", program.name),
        text,
    };
    Ok(vec![file("src", writer.text), file("dat", list)])
}

struct Writer<'a> {
    program: &'a Program,
    names: BTreeMap<u32, String>,
    text: String,
    /// Instruction being written, from 0.
    at: usize,
    /// What the lines before have set.
    velocity: String,
    joint_velocity: String,
    distance: String,
    /// The weld data that is on, in `sets`, and its arc word.
    arc: Option<(usize, String)>,
    /// Whether metal is laid during the move being written.
    burns: bool,
    sets: Vec<WeldData>,
    seams: usize,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) {
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn no_words(&self, what: &str, remedy: &'static str) -> WriteError {
        no_words(self.program, self.at, what, remedy)
    }

    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => self.motion(motion)?,
            Instruction::Wait(_) if self.arc.is_some() => {
                return Err(self.no_words(
                    "a wait with the arc on",
                    "plan without dwells in beads: ArcTech's crater time stands at their ends",
                ));
            }
            Instruction::Arc(_) => {
                return Err(self.no_words(
                    "an arc that is switched between moves",
                    "switch it at the end of a move",
                ));
            }
            Instruction::Wait(seconds) => self.line(&format!("WAIT SEC {}", short(*seconds, 3))),
            Instruction::UserFrame(n) => match self.program.attribute(COUPLED) {
                Some(machine) => self.line(&format!(
                    "$BASE=EK(MACHINE_DEF[{machine}].ROOT,MACHINE_DEF[{machine}].MECH_TYPE,BASE_DATA[{n}])"
                )),
                None => self.line(&format!("$BASE=BASE_DATA[{n}]")),
            },
            Instruction::ToolFrame(n) => self.line(&format!("$TOOL=TOOL_DATA[{n}]")),
            Instruction::Call { program, arguments } => {
                self.line(&format!("{program}({arguments})"));
            }
            Instruction::Comment { text, .. } => self.line(&format!(";{text}")),
            Instruction::End => self.line("RETURN"),
            Instruction::Blank => self.line(""),
            Instruction::Raw(text) => self.line(text),
            Instruction::Label { .. } | Instruction::Jump(_) => {
                return Err(self.no_words("a jump", "write the moves one after the other"));
            }
        }
        Ok(())
    }

    fn name(&self, reference: &PositionRef) -> Result<String, WriteError> {
        match reference {
            PositionRef::Point { index, .. } => match self.names.get(index) {
                Some(name) => Ok(format!("X{name}")),
                None => Err(self.no_words("a position that is not there", "teach it")),
            },
            PositionRef::Unresolved(text) => Ok(text.clone()),
        }
    }

    /// A line that sets something, where it is not set already.
    fn set(&mut self, which: fn(&mut Self) -> &mut String, line: String) {
        if *which(self) != line {
            self.line(&line);
            *which(self) = line;
        }
    }

    fn motion(&mut self, motion: &Motion) -> Result<(), WriteError> {
        let target = self.name(&motion.target)?;
        self.burns = self.arc.is_some();
        let (form, set) = self.arc_form(motion)?;
        let verb = match &motion.kind {
            MotionKind::Joint => format!("PTP {target}"),
            MotionKind::Linear => format!("LIN {target}"),
            MotionKind::Circular { via } => format!("CIRC {},{target}", self.name(via)?),
            MotionKind::CircleArc => {
                return Err(self.no_words("a circle through three moves", "give its via point"));
            }
        };
        self.speed(motion)?;
        let ending = match &motion.termination {
            Termination::Fine => "",
            Termination::Blend(distance) => {
                self.set(
                    |s| &mut s.distance,
                    format!("$APO.CDIS={}", short(*distance, 3)),
                );
                " C_DIS"
            }
            _ => {
                return Err(
                    self.no_words("this way to end a move", "give the distance of blending")
                );
            }
        };
        let (before, after) = match form {
            Some(form) => {
                let (before, after) = form.lines(set + 1, self.seams);
                (before, Some(after))
            }
            None => (Vec::new(), None),
        };
        for line in before {
            self.line(&line);
        }
        self.line(&(verb + ending));
        if let Some(after) = after {
            self.line(&after);
        }
        Ok(())
    }

    fn speed(&mut self, motion: &Motion) -> Result<(), WriteError> {
        let Speed::Value { value, unit } = motion.speed else {
            return Err(self.no_words("a speed without a number", "write it out"));
        };
        let line = match (unit, &motion.kind) {
            (SpeedUnit::Percent, MotionKind::Joint) => {
                let line = format!("BAS(#VEL_PTP,{})", short(value, 3));
                self.set(|s| &mut s.joint_velocity, line);
                return Ok(());
            }
            (SpeedUnit::MillimetrePerSecond, MotionKind::Linear | MotionKind::Circular { .. }) => {
                // ArcTech says the speed of beads
                if self.burns {
                    "$VEL.CP=gArcBasVelDefinition".to_owned()
                } else {
                    format!("$VEL.CP={}", short(value / 1000.0, 6))
                }
            }
            _ => return Err(self.no_words("a speed in this unit", "give it in mm/s")),
        };
        self.set(|s| &mut s.velocity, line);
        Ok(())
    }

    /// What ArcTech does with a move, and with which weld data.
    fn arc_form(&mut self, motion: &Motion) -> Result<(Option<Form>, usize), WriteError> {
        let word = motion.arc.as_ref();
        let (form, arguments) = match (self.arc.take(), word.map(|w| w.action)) {
            (None, None) => return Ok((None, 0)),
            (None, Some(ArcAction::End)) => return Err(self.no_words(GOES_ON.0, GOES_ON.1)),
            (Some((set, _)), Some(ArcAction::End)) => return Ok((Some(Form::Off), set)),
            (None, Some(ArcAction::Start)) => {
                self.seams += 1;
                (Form::On, word.map(|w| w.arguments.clone()))
            }
            (Some((_, on)), _) => (Form::Switch, Some(word.map_or(on, |w| w.arguments.clone()))),
        };
        let arguments = arguments.unwrap_or_default();
        if !arc::fits(&arguments) {
            return Err(self.no_words(
                "an arc word of other than at most eight numbers",
                "list what ArcTech's channels hold as the values of the cell's [[program.schedule]]",
            ));
        }
        let coming = self
            .program
            .instructions
            .get(self.at + 1..)
            .unwrap_or_default();
        let next = coming.iter().find_map(|i| match i {
            Instruction::Motion(m) => Some(m.speed),
            _ => None,
        });
        let Some(Speed::Value { value: speed, .. }) = next else {
            return Err(self.no_words(GOES_ON.0, GOES_ON.1));
        };
        let set = WeldData {
            arguments: arguments.clone(),
            speed,
            weave: None,
        };
        let known = self.sets.iter().position(|s| *s == set);
        let index = known.unwrap_or(self.sets.len());
        if known.is_none() {
            self.sets.push(set);
        }
        self.arc = Some((index, arguments));
        Ok((Some(form), index))
    }
}
