//! A program to KRL.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use meltpath_toolpath::Weave;

use super::arc::{self, Form, WeldData};
use super::words::KrlWords;
use super::{COUPLED, data};
use crate::held::Holds;
use crate::program::{
    ArcAction, Instruction, MotionInstruction, MotionKind, PositionRef, Program, Speed, SpeedUnit,
    Termination,
};
use crate::written::{
    BETWEEN_MOVES, ENDING, GOES_ON, JUMP, Lines, THREE_MOVES, TextFile, UNIT, WriteError, short,
};

/// The two files of a program, with `\n` line ends: 1 µm and 0.0001°.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or KRL has no words for something.
pub fn write(program: &Program, words: &KrlWords) -> Result<Vec<TextFile>, WriteError> {
    let mut writer = Writer {
        out: Lines::new(program, "")?,
        words,
        skip: 0,
        names: program
            .positions
            .iter()
            .map(|p| (p.index, format!("X{}", p.name())))
            .collect(),
        velocity: String::new(),
        joint_velocity: String::new(),
        distance: String::new(),
        arc: None,
        burns: false,
        weave: None,
        sets: Vec::new(),
        seams: 0,
    };
    if program.application.is_empty() {
        writer.out.line("&ACCESS RVP");
    }
    for line in &program.application {
        writer.out.line(line);
    }
    writer.out.line(&format!("DEF {}( )", program.name));
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.out.at = at;
        if writer.skip > 0 {
            writer.skip -= 1;
            continue;
        }
        writer.instruction(instruction)?;
    }
    if writer.arc.is_some() {
        return Err(writer.out.no_words(GOES_ON));
    }
    writer.out.line("END");
    let mut list = format!("&ACCESS RVP\nDEFDAT {}\n", program.name);
    let held = held(program);
    for position in &program.positions {
        let holds = held.get(&position.index).copied().unwrap_or(Holds::Torch);
        if let Some((kind, value)) = data::aggregate(position, holds) {
            // writing to a String cannot fail
            let _ = writeln!(list, "DECL {kind} X{}={value}", position.name());
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
    Ok(vec![file("src", writer.out.text), file("dat", list)])
}

/// What the robot holds at each position, as the lines before its first move say it.
fn held(program: &Program) -> BTreeMap<u32, Holds> {
    let (mut now, mut held) = (Holds::Torch, BTreeMap::new());
    for instruction in &program.instructions {
        let motion = match instruction {
            Instruction::Holds(holds) => {
                now = *holds;
                continue;
            }
            Instruction::Motion(motion) => motion,
            _ => continue,
        };
        let via = match &motion.kind {
            MotionKind::Circular { via } => Some(via),
            _ => None,
        };
        for place in via.into_iter().chain([&motion.target]) {
            if let PositionRef::Point { index, .. } = place {
                held.entry(*index).or_insert(now);
            }
        }
    }
    held
}

/// Whether two times have the same digits in a file, s.
fn same_time(a: f64, b: f64) -> bool {
    (a - b).abs() < 5e-4
}

struct Writer<'a> {
    out: Lines<'a>,
    words: &'a KrlWords,
    /// Instructions to come that are written already.
    skip: usize,
    names: BTreeMap<u32, String>,
    /// What the lines before have set.
    velocity: String,
    joint_velocity: String,
    distance: String,
    /// The weld data that is on, in `sets`, and its arc word.
    arc: Option<(usize, String)>,
    /// Whether metal is laid during the move being written.
    burns: bool,
    /// The weave that is on.
    weave: Option<Weave>,
    sets: Vec<WeldData>,
    seams: usize,
}

impl Writer<'_> {
    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => self.motion(motion)?,
            Instruction::Wait(_) if self.arc.is_some() => {
                return Err(self.out.no_words((
                    "a wait with the arc on",
                    "plan without dwells in beads: ArcTech's crater time stands at their ends",
                )));
            }
            Instruction::Arc(_) => return Err(self.out.no_words(BETWEEN_MOVES)),
            // the weld data of the moves tell it
            Instruction::Weave(weave) => self.weave = *weave,
            Instruction::Wait(seconds) => {
                self.out.line(&format!("WAIT SEC {}", short(*seconds, 3)));
            }
            Instruction::UserFrame(n) => {
                let base = match self.out.program.attribute(COUPLED) {
                    Some(machine) => format!(
                        "EK(MACHINE_DEF[{machine}].ROOT,MACHINE_DEF[{machine}].MECH_TYPE,BASE_DATA[{n}])"
                    ),
                    None => data::said_as(&self.out.program.said_frames.user, *n)
                        .unwrap_or_else(|| format!("BASE_DATA[{n}]")),
                };
                self.out.line(&format!("$BASE={base}"));
            }
            Instruction::Holds(Holds::Part) => self.out.line("$IPO_MODE=#TCP"),
            Instruction::Holds(_) => self.out.line("$IPO_MODE=#BASE"),
            Instruction::ToolFrame(n) => {
                let said = data::said_as(&self.out.program.said_frames.tool, *n);
                let value = said.unwrap_or_else(|| format!("TOOL_DATA[{n}]"));
                self.out.line(&format!("$TOOL={value}"));
            }
            Instruction::Call { program, arguments } => {
                self.out.line(&format!("{program}({arguments})"));
            }
            Instruction::Comment { text, .. } => self.out.line(&format!(";{text}")),
            Instruction::End => self.out.line("RETURN"),
            Instruction::Blank => self.out.line(""),
            Instruction::Raw(text) => self.out.line(text),
            Instruction::Label { .. } | Instruction::Jump(_) => {
                return Err(self.out.no_words(JUMP));
            }
        }
        Ok(())
    }

    /// A line that sets something, where it is not set already.
    fn set(&mut self, which: fn(&mut Self) -> &mut String, line: String) {
        if *which(self) != line {
            self.out.line(&line);
            *which(self) = line;
        }
    }

    fn motion(&mut self, motion: &MotionInstruction) -> Result<(), WriteError> {
        let target = self.out.place(&self.names, &motion.target)?;
        self.burns = self.arc.is_some();
        let (form, set) = self.arc_form(motion)?;
        let verb = match &motion.kind {
            MotionKind::Joint => format!("PTP {target}"),
            MotionKind::Linear => format!("LIN {target}"),
            MotionKind::Circular { via } => {
                format!("CIRC {},{target}", self.out.place(&self.names, via)?)
            }
            MotionKind::CircleArc => {
                return Err(self.out.no_words(THREE_MOVES));
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
                return Err(self.out.no_words(ENDING));
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
            self.out.line(&line);
        }
        self.out.line(&(verb + ending));
        if let Some(after) = after {
            self.out.line(&after);
        }
        Ok(())
    }

    fn speed(&mut self, motion: &MotionInstruction) -> Result<(), WriteError> {
        let Speed::Value { value, unit } = motion.speed else {
            return Err(self
                .out
                .no_words(("a speed without a number", "write it out")));
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
            _ => return Err(self.out.no_words(UNIT)),
        };
        self.set(|s| &mut s.velocity, line);
        Ok(())
    }

    /// What ArcTech does with a move, and with which weld data.
    fn arc_form(
        &mut self,
        motion: &MotionInstruction,
    ) -> Result<(Option<Form>, usize), WriteError> {
        let mut word = motion.arc.as_ref();
        match self.out.coming() {
            // ArcTech's own times stand where the arc starts and where it ends
            [Instruction::Wait(time), ..]
                if word.is_some_and(|w| w.action == ArcAction::Start)
                    && self.arc.is_none()
                    && same_time(*time, self.words.start_time.0) =>
            {
                self.skip = 1;
            }
            [Instruction::Wait(time), Instruction::Arc(end), ..]
                if word.is_none()
                    && end.action == ArcAction::End
                    && same_time(*time, self.words.crater_time.0) =>
            {
                word = Some(end);
                self.skip = 2;
            }
            _ => {}
        }
        let (form, arguments) = match (self.arc.take(), word.map(|w| w.action)) {
            (None, None) => return Ok((None, 0)),
            (None, Some(ArcAction::End)) => return Err(self.out.no_words(GOES_ON)),
            (Some((set, _)), Some(ArcAction::End)) => return Ok((Some(Form::Off), set)),
            (None, Some(ArcAction::Start)) => {
                self.seams += 1;
                (Form::On, word.map(|w| w.arguments.clone()))
            }
            (Some((_, on)), _) => (Form::Switch, Some(word.map_or(on, |w| w.arguments.clone()))),
        };
        let arguments = arguments.unwrap_or_default();
        if !arc::fits(&arguments) {
            return Err(self.out.no_words((
                "an arc word of other than at most eight numbers",
                "list what ArcTech's channels hold as the values of the cell's [[program.schedule]]",
            )));
        }
        let next = self.out.coming().iter().find_map(|i| match i {
            Instruction::Motion(m) => Some(&m.speed),
            _ => None,
        });
        let Some(&Speed::Value { value: speed, .. }) = next else {
            return Err(self.out.no_words(GOES_ON));
        };
        let set = WeldData {
            arguments: arguments.clone(),
            speed,
            weave: self.out.coming_weave(self.weave).map(Ok),
            stands: 0.0,
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
