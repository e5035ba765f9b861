//! What one instruction does.

use super::effect::{Effect, Selected, effect, effect_of, first_word, numbered, told_bead};
use super::flow::{Flow, Frame};
use super::{Executed, Machine, Missing, ProgramError, Refusal};
use crate::program::{ArcLine, CommentMark, Dialect, Instruction};

/// Longest wait that is simulated, s: a day.
const LONGEST_WAIT: f64 = 86_400.0;

impl Machine<'_> {
    /// Executes one instruction of a program that runs.
    pub(super) fn execute(
        &mut self,
        frame: &mut Frame,
        instruction: &Instruction,
    ) -> Result<Flow, ProgramError> {
        match instruction {
            Instruction::Motion(motion) => {
                self.move_as_set(motion)?;
                if self.stops && self.arc.is_some() {
                    self.wait(0.0)?;
                }
            }
            Instruction::Arc(word) => {
                self.close_arcs();
                self.switch(word)?;
            }
            Instruction::Weave(weave) => match weave {
                Some(weave) => self.swing(Some(*weave)),
                None => self.weave = None,
            },
            Instruction::Wait(time) => self.wait(*time)?,
            Instruction::UserFrame(n) => self.frames.0 = Some(*n),
            Instruction::ToolFrame(n) => self.frames.1 = Some(*n),
            Instruction::Holds(holds) => self.holds = Some(*holds),
            Instruction::Call { program, arguments } => return self.call(program, arguments),
            Instruction::Comment { mark, text } => {
                if *mark == CommentMark::Remark {
                    self.layer = numbered(text, "Layer").or(self.layer);
                    self.bead = told_bead(text).or(self.bead);
                    self.comments.hear(text);
                }
            }
            Instruction::Jump(label) => return self.jump(frame.program, *label),
            Instruction::End => return Ok(Flow::Return),
            Instruction::Label { .. } | Instruction::Blank => {}
            Instruction::Raw(text) if self.programs[frame.program].dialect != Dialect::FanucLs => {
                return self.foreign(self.programs[frame.program].dialect, text);
            }
            Instruction::Raw(text) => {
                return match self.decide(frame, text)? {
                    Some(flow) => Ok(flow),
                    None => self.other(text),
                };
            }
        }
        Ok(Flow::Next)
    }

    /// Executes a line that is kept verbatim and decides nothing.
    fn other(&mut self, text: &str) -> Result<Flow, ProgramError> {
        match effect(text) {
            Effect::Set => self.set(text),
            Effect::Frame(which) => {
                let number = text.split_once('=').map(|(_, right)| right);
                let number = number.and_then(|right| self.memory.index(right));
                match which {
                    Selected::User => self.frames.0 = number,
                    Selected::Tool => self.frames.1 = number,
                }
            }
            Effect::Weave => self.begin_weave(text),
            Effect::WeaveEnd => self.weave = None,
            Effect::Abort => return Ok(self.end_all(text)),
            Effect::Pause => self.stand(text),
            Effect::Wait => {
                let until = text.get(4..).unwrap_or_default();
                let time = until.trim().trim_end_matches("(sec)");
                match self.memory.number(time).filter(|t| *t >= 0.0) {
                    Some(time) => self.wait(time)?,
                    // it is so already
                    None if self.memory.condition(until) == Some(true) => {}
                    None => self.stand(text),
                }
            }
            Effect::Signal => {
                self.set(text);
                self.note("line-passed-over", first_word(text));
            }
            Effect::Output => self.set_output(text),
            Effect::Position => self.set_position(text),
            Effect::Passive
            | Effect::Stops
            | Effect::Ahead(_)
            | Effect::Turns(_)
            | Effect::Interrupts(_) => {
                self.note("line-passed-over", first_word(text));
            }
            Effect::Shapes(why) => self.gap(why),
        }
        Ok(Flow::Next)
    }

    /// A line that is kept verbatim of another dialect: what decides or changes something is told as a gap.
    fn foreign(&mut self, dialect: Dialect, text: &str) -> Result<Flow, ProgramError> {
        let of_arc = self.programs[self.at.0].arc_lines.get(&self.at.1);
        if let Some(what) = of_arc {
            match what {
                // the line that goes on otherwise tells them all
                ArcLine::Begins => {}
                ArcLine::Breaks => self.gap(Missing::ArcLines(text.to_owned())),
                ArcLine::Output => self.gap(Missing::ArcOutput(text.to_owned())),
            }
            return Ok(Flow::Next);
        }
        let word = first_word(text);
        // of scripts and data lists every line begins with a word of its own
        let calls = matches!(dialect, Dialect::Rapid | Dialect::Inform);
        if calls && self.settings.passed_over.contains(&word) {
            self.call_outside(&word);
            return Ok(Flow::Next);
        }
        if self.programs[self.at.0].passes.contains(&self.at.1) {
            self.note("line-passed-over", word);
            return Ok(Flow::Next);
        }
        if dialect == Dialect::Inform
            && let Some(flow) = self.job_logic(text)?
        {
            return Ok(flow);
        }
        // frames are numbered as they are set
        if self.programs[self.at.0].said_frames.sets(self.at.1) {
            return Ok(Flow::Next);
        }
        match effect_of(dialect, text) {
            // whether it comes to it nobody knows in a block that is not followed
            Effect::Abort if self.in_block() => self.gap(Missing::MayEnd(text.to_owned())),
            Effect::Abort => return Ok(self.end_all(text)),
            Effect::Wait | Effect::Pause => self.stand(text),
            Effect::Interrupts(name) => self.interrupts(&name, text),
            Effect::Turns(set) => self.set_to(&set),
            Effect::Shapes(why) => {
                if dialect == Dialect::Inform {
                    self.forget_variables(text);
                }
                self.gap(why);
            }
            Effect::Output => self.set_named_output(text),
            Effect::Weave => self.begin_weave(text),
            Effect::WeaveEnd => self.weave = None,
            Effect::Stops if self.arc.is_some() && !self.goes_on() => self.wait(0.0)?,
            Effect::Ahead(some) => {
                self.stops = !some;
                self.note("line-passed-over", first_word(text));
            }
            _ => self.note("line-passed-over", first_word(text)),
        }
        Ok(Flow::Next)
    }

    /// Whether the line before says that the one being executed keeps what is prepared ahead (`CONTINUE`).
    fn goes_on(&self) -> bool {
        let before = self.at.1.checked_sub(1);
        let before = before.and_then(|i| self.programs[self.at.0].instructions.get(i));
        matches!(before, Some(Instruction::Raw(text)) if first_word(text) == "CONTINUE")
    }

    /// Everything ends here, which is told.
    fn end_all(&mut self, text: &str) -> Flow {
        self.note("program-ends", first_word(text));
        Flow::Abort
    }

    /// Stands for a time that is not known: of no matter while the arc is off.
    fn stand(&mut self, text: &str) {
        if self.arc.is_some() {
            self.gap(Missing::WaitWithArc);
        } else {
            self.note("line-passed-over", first_word(text));
        }
    }

    /// Whether a block of a script is open at the line being executed.
    fn in_block(&self) -> bool {
        let before = self.programs[self.at.0].instructions.iter();
        let depth = before.take(self.at.1).fold(0_i32, |depth, instruction| {
            let Instruction::Raw(text) = instruction else {
                return depth;
            };
            depth + block(text)
        });
        depth > 0
    }

    /// Sets a register or a signal to what stands after `=`, as far as it is known.
    fn set(&mut self, text: &str) {
        let sides = text.split_once('=');
        let target = sides.and_then(|(left, _)| self.memory.reference(left));
        let right = sides.map_or("", |(_, right)| right);
        match target {
            Some((name, register)) if name == "R" => match self.memory.number(right) {
                Some(value) => drop(self.memory.registers.insert(register, value)),
                None => drop(self.memory.registers.remove(&register)),
            },
            Some(signal) => match self.memory.condition(right) {
                Some(on) => drop(self.memory.signals.insert(signal, on)),
                None => drop(self.memory.signals.remove(&signal)),
            },
            // any of them may be the one
            None => {
                self.memory.registers.clear();
                self.memory.signals.clear();
            }
        }
    }

    pub(super) fn wait(&mut self, time: f64) -> Result<(), ProgramError> {
        self.close_arcs();
        if time > LONGEST_WAIT {
            return Err(self.refuse(Refusal::Wait(time)));
        }
        self.executed.push(Executed::Wait {
            time,
            arc: self.arc.as_ref().map(|(_, source)| *source),
            program: self.at.0 as u32,
            line: self.at.1 as u32 + 1,
        });
        Ok(())
    }

    /// A program may run at any time, by an interrupt.
    fn interrupts(&mut self, name: &str, text: &str) {
        let given = self
            .programs
            .iter()
            .any(|p| p.name.eq_ignore_ascii_case(name));
        if given && !self.settings.passed_over.contains(name) {
            self.gap(Missing::OnTheWay(text.to_owned()));
        } else {
            self.call_outside(name);
        }
    }

    /// Passes over a call of a program that was not given.
    pub(super) fn call_outside(&mut self, name: &str) {
        let name = name.to_ascii_uppercase();
        let passed_over = self.settings.passed_over.contains(&name);
        if passed_over && self.settings.returning.contains(&name) {
            self.note("call-passed-over", name);
            return;
        }
        self.here = None;
        if passed_over {
            self.leaves_out(Missing::Returns(name.clone()));
            self.note("call-passed-over", name);
        } else {
            if self.programs[self.at.0].dialect == Dialect::Inform {
                self.forget_variables("");
            }
            self.gap(Missing::Call(name));
        }
    }
}

/// By how many blocks more are open behind a line of a script.
fn block(text: &str) -> i32 {
    match first_word(text).as_str() {
        "IF" | "WHILE" | "FOR" | "THREAD" | "SEC" | "DEF" if text.ends_with(':') => 1,
        "END" => -1,
        _ => 0,
    }
}
