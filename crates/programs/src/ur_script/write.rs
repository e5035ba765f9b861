//! A program to script.

use std::collections::BTreeMap;

use super::words::ScriptWords;
use crate::orientation::rotation_vector_of;
use crate::program::{
    ArcWord, Coordinates, Instruction, MotionInstruction, MotionKind, PositionRef, Program,
    SpeedUnit, Termination,
};
use crate::template::UNFILLED;
use crate::written::{
    ENDING, JUMP, Lines, NAME_THE_ROBOT, NO_PLACE, THREE_MOVES, TextFile, UNIT, WEAVE, WriteError,
    fixed, robot_places, short,
};

/// The script of a program, with `\n` line ends: 1 µm and 0.0001°.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or script has no words for something.
pub fn write(program: &Program, words: &ScriptWords) -> Result<Vec<TextFile>, WriteError> {
    let mut writer = Writer {
        out: Lines::new(program, "  ")?,
        words,
        places: robot_places(program, |g| g.coordinates.clone()),
    };
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.out.at = at;
        writer.instruction(instruction)?;
    }
    Ok(vec![TextFile {
        name: format!("{}.script", program.name),
        text: format!("def {}():\n{}end\n", program.name, writer.out.text),
    }])
}

struct Writer<'a> {
    out: Lines<'a>,
    words: &'a ScriptWords,
    places: BTreeMap<u32, Coordinates>,
}

impl Writer<'_> {
    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => {
                let line = self.motion(motion)?;
                self.out.line(&line);
                if let Some(word) = &motion.arc {
                    self.arc(word)?;
                }
            }
            Instruction::Arc(word) => self.arc(word)?,
            Instruction::Wait(seconds) => self.out.line(&format!("sleep({})", short(*seconds, 3))),
            // the part's pose and the active tool stand for them
            Instruction::UserFrame(_)
            | Instruction::ToolFrame(_)
            | Instruction::Holds(_)
            | Instruction::Blank => {}
            Instruction::Call { program, arguments } => {
                self.out.line(&format!("{program}({arguments})"));
            }
            Instruction::Comment { text, .. } => self.out.line(&format!("#{text}")),
            Instruction::End => self.out.line("return"),
            Instruction::Raw(text) => self.out.line(text),
            Instruction::Weave(_) => return Err(self.out.no_words(WEAVE)),
            Instruction::Label { .. } | Instruction::Jump(_) => {
                return Err(self.out.no_words(JUMP));
            }
        }
        Ok(())
    }

    fn arc(&mut self, word: &ArcWord) -> Result<(), WriteError> {
        let Some(lines) = self.words.arc().filled(word, false) else {
            return Err(self.out.no_words(UNFILLED));
        };
        for line in lines {
            self.out.line(&line);
        }
        Ok(())
    }

    fn coordinates(&self, reference: &PositionRef) -> Result<&Coordinates, WriteError> {
        let found = match reference {
            PositionRef::Point { index, .. } => self.places.get(index),
            PositionRef::Unresolved(_) => None,
        };
        found.ok_or_else(|| self.out.no_words(NO_PLACE))
    }

    fn pose(&self, reference: &PositionRef) -> Result<String, WriteError> {
        let Coordinates::Cartesian {
            xyz, wpr_degrees, ..
        } = self.coordinates(reference)?
        else {
            return Err(self
                .out
                .no_words(("a straight move to joints", "give the position as a pose")));
        };
        let xyz = xyz.map(|v| fixed(v / 1000.0, 6)).join(",");
        let turn = rotation_vector_of(*wpr_degrees)
            .map(|v| fixed(v, 10))
            .join(",");
        Ok(format!(
            "pose_trans({},p[{xyz},{turn}])",
            self.words.part.as_str()
        ))
    }

    fn motion(&self, motion: &MotionInstruction) -> Result<String, WriteError> {
        if motion.kind == MotionKind::Joint {
            return self.joint(motion);
        }
        let Some(value) = motion.speed.given_in(SpeedUnit::MillimetrePerSecond) else {
            return Err(self.out.no_words(UNIT));
        };
        let speed = short(value / 1000.0, 6);
        let blend = match motion.termination {
            Termination::Fine => "0".to_owned(),
            Termination::Blend(distance) => short(distance / 1000.0, 6),
            _ => {
                return Err(self.out.no_words(ENDING));
            }
        };
        let to = self.pose(&motion.target)?;
        match &motion.kind {
            MotionKind::Linear => Ok(format!("movel({to},v={speed},r={blend})")),
            MotionKind::Circular { via } => Ok(format!(
                "movec({},{to},v={speed},r={blend},mode=0)",
                self.pose(via)?
            )),
            MotionKind::Joint | MotionKind::CircleArc => Err(self.out.no_words(THREE_MOVES)),
        }
    }

    /// A joint move, to joints or to the pose that they hold.
    fn joint(&self, motion: &MotionInstruction) -> Result<String, WriteError> {
        let Some(share) = motion.speed.given_in(SpeedUnit::Percent) else {
            let what = "a joint move whose speed is no share";
            return Err(self.out.no_words((what, "give it in %")));
        };
        // half a turn a second is the fastest that every joint of these arms does
        let speed = short(share / 100.0 * std::f64::consts::PI, 5);
        let radians = |degrees: &[f64]| -> String {
            let all = degrees.iter().map(|d| fixed(d.to_radians(), 6));
            all.collect::<Vec<_>>().join(",")
        };
        let to = match self.coordinates(&motion.target)? {
            Coordinates::Joint(axes) => {
                let joints: Vec<f64> = axes.iter().map(|a| a.value).collect();
                format!("[{}]", radians(&joints))
            }
            Coordinates::Cartesian { config, .. } => {
                let joints: Vec<f64> = config
                    .split(',')
                    .filter_map(|j| j.trim().parse().ok())
                    .collect();
                if joints.len() != 6 {
                    let what = "a joint move to a pose of which the joints are not known";
                    return Err(self.out.no_words((what, NAME_THE_ROBOT)));
                }
                format!(
                    "get_inverse_kin({},[{}])",
                    self.pose(&motion.target)?,
                    radians(&joints)
                )
            }
            Coordinates::Unread(_) => {
                return Err(self
                    .out
                    .no_words(("a position that is not taught", "teach it")));
            }
        };
        Ok(format!("movej({to},v={speed})"))
    }
}
