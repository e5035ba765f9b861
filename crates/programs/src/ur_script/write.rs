//! A program to script.

use std::collections::BTreeMap;

use super::words::ScriptWords;
use crate::orientation::rotation_vector_of;
use crate::program::{
    ArcWord, Coordinates, Instruction, Motion, MotionKind, PositionRef, Program, Speed, SpeedUnit,
    Termination,
};
use crate::template::UNFILLED;
use crate::written::{TextFile, WriteError, check, fixed, no_words, robot_places, short};

/// The script of a program, with `\n` line ends: 1 µm and 0.0001°.
///
/// # Errors
/// [`WriteError`] where a number is not finite, or script has no words for something.
pub fn write(program: &Program, words: &ScriptWords) -> Result<Vec<TextFile>, WriteError> {
    check(program)?;
    let mut writer = Writer {
        program,
        words,
        places: robot_places(program, |g| g.coordinates.clone()),
        text: format!("def {}():\n", program.name),
        at: 0,
    };
    for (at, instruction) in program.instructions.iter().enumerate() {
        writer.at = at;
        writer.instruction(instruction)?;
    }
    writer.text += "end\n";
    Ok(vec![TextFile {
        name: format!("{}.script", program.name),
        text: writer.text,
    }])
}

struct Writer<'a> {
    program: &'a Program,
    words: &'a ScriptWords,
    places: BTreeMap<u32, Coordinates>,
    text: String,
    /// Instruction being written, from 0.
    at: usize,
}

impl Writer<'_> {
    fn line(&mut self, text: &str) {
        self.text.push_str("  ");
        self.text.push_str(text);
        self.text.push('\n');
    }

    fn no_words(&self, what: &str, remedy: &'static str) -> WriteError {
        no_words(self.program, self.at, what, remedy)
    }

    fn instruction(&mut self, instruction: &Instruction) -> Result<(), WriteError> {
        match instruction {
            Instruction::Motion(motion) => {
                let line = self.motion(motion)?;
                self.line(&line);
                if let Some(word) = &motion.arc {
                    self.arc(word)?;
                }
            }
            Instruction::Arc(word) => self.arc(word)?,
            Instruction::Wait(seconds) => self.line(&format!("sleep({})", short(*seconds, 3))),
            // the part's pose and the active tool stand for them
            Instruction::UserFrame(_) | Instruction::ToolFrame(_) | Instruction::Blank => {}
            Instruction::Call { program, arguments } => {
                self.line(&format!("{program}({arguments})"));
            }
            Instruction::Comment { text, .. } => self.line(&format!("#{text}")),
            Instruction::End => self.line("return"),
            Instruction::Raw(text) => self.line(text),
            Instruction::Label { .. } | Instruction::Jump(_) => {
                return Err(self.no_words("a jump", "write the moves one after the other"));
            }
        }
        Ok(())
    }

    fn arc(&mut self, word: &ArcWord) -> Result<(), WriteError> {
        let Some(lines) = self.words.arc().filled(word, false) else {
            return Err(self.no_words(UNFILLED.0, UNFILLED.1));
        };
        for line in lines {
            self.line(&line);
        }
        Ok(())
    }

    fn coordinates(&self, reference: &PositionRef) -> Result<&Coordinates, WriteError> {
        let found = match reference {
            PositionRef::Point { index, .. } => self.places.get(index),
            PositionRef::Unresolved(_) => None,
        };
        found.ok_or_else(|| self.no_words("a position that is not there", "teach it"))
    }

    fn pose(&self, reference: &PositionRef) -> Result<String, WriteError> {
        let Coordinates::Cartesian {
            xyz, wpr_degrees, ..
        } = self.coordinates(reference)?
        else {
            return Err(self.no_words("a straight move to joints", "give the position as a pose"));
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

    fn motion(&self, motion: &Motion) -> Result<String, WriteError> {
        if motion.kind == MotionKind::Joint {
            return self.joint(motion);
        }
        let Speed::Value {
            value,
            unit: SpeedUnit::MillimetrePerSecond,
        } = motion.speed
        else {
            return Err(self.no_words("a speed in this unit", "give it in mm/s"));
        };
        let speed = short(value / 1000.0, 6);
        let blend = match motion.termination {
            Termination::Fine => "0".to_owned(),
            Termination::Blend(distance) => short(distance / 1000.0, 6),
            _ => {
                return Err(
                    self.no_words("this way to end a move", "give the distance of blending")
                );
            }
        };
        let to = self.pose(&motion.target)?;
        match &motion.kind {
            MotionKind::Linear => Ok(format!("movel({to},v={speed},r={blend})")),
            MotionKind::Circular { via } => Ok(format!(
                "movec({},{to},v={speed},r={blend},mode=0)",
                self.pose(via)?
            )),
            MotionKind::Joint | MotionKind::CircleArc => {
                Err(self.no_words("a circle through three moves", "give its via point"))
            }
        }
    }

    /// A joint move, to joints or to the pose that they hold.
    fn joint(&self, motion: &Motion) -> Result<String, WriteError> {
        let Speed::Value {
            value: share,
            unit: SpeedUnit::Percent,
        } = motion.speed
        else {
            return Err(self.no_words("a joint move whose speed is no share", "give it in %"));
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
                    return Err(self.no_words(
                        "a joint move to a pose of which the joints are not known",
                        "name the robot (machine.robot), and see that it reaches every place: the check of reach tells",
                    ));
                }
                format!(
                    "get_inverse_kin({},[{}])",
                    self.pose(&motion.target)?,
                    radians(&joints)
                )
            }
            Coordinates::Unread(_) => {
                return Err(self.no_words("a position that is not taught", "teach it"));
            }
        };
        Ok(format!("movej({to},v={speed})"))
    }
}
