//! What comes next: jumps, conditions, choices, loops, calls, as far as the values that decide are known.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};

use super::logic::{Logic, logic, opens, parts, strip_label};
use super::{Machine, ProgramError, Refusal};
use crate::fanuc_ls::parse_instruction;
use crate::program::Instruction;

/// Calls within calls that are followed.
const DEEPEST: usize = 64;
/// Instructions that are executed beyond one time each: what runs longer is taken for endless.
const MOST_REPEATED: usize = 1_000_000;

/// What happens after an instruction.
pub(super) enum Flow {
    /// The next one.
    Next,
    /// The one with this index.
    To(usize),
    /// The program returns to its caller.
    Return,
    /// Everything ends.
    Abort,
}

/// A program that runs.
pub(super) struct Frame {
    /// Its index.
    pub(super) program: usize,
    /// By the index of their `FOR`: register, last value, step.
    loops: BTreeMap<usize, (u32, f64, f64)>,
    /// Where it went back to, and with which values: a state that comes again comes again for ever.
    states: BTreeSet<(usize, u64)>,
}

impl Machine<'_> {
    /// Runs a program with its arguments.
    pub(super) fn run(
        &mut self,
        program: usize,
        arguments: Vec<Option<f64>>,
    ) -> Result<Flow, ProgramError> {
        if self.memory.arguments.len() >= DEEPEST {
            let name = &self.programs[program].name;
            let why = format!("{name} is called {DEEPEST} calls deep");
            return Err(self.refuse(Refusal::Loop(why)));
        }
        self.memory.arguments.push(arguments);
        let mut frame = Frame {
            program,
            loops: BTreeMap::new(),
            states: BTreeSet::new(),
        };
        let mut next = 0;
        let mut end = Flow::Return;
        loop {
            self.take_in(program, next);
            let Some(instruction) = self.programs[program].instructions.get(next) else {
                break;
            };
            self.at = (program, next);
            self.count += 1;
            if self.count > self.most {
                let why = format!("{MOST_REPEATED} instructions were repeated");
                return Err(self.refuse(Refusal::Loop(why)));
            }
            match self.execute(&mut frame, instruction)? {
                Flow::Next => next += 1,
                Flow::To(index) => {
                    self.go_back(&mut frame, index)?;
                    next = index;
                }
                Flow::Return => break,
                Flow::Abort => {
                    end = Flow::Abort;
                    break;
                }
            }
        }
        self.memory.arguments.pop();
        Ok(end)
    }

    /// The most instructions that are executed.
    pub(super) fn most(programs: &[crate::program::Program]) -> usize {
        let all: usize = programs.iter().map(|p| p.instructions.len()).sum();
        all + MOST_REPEATED
    }

    /// Refuses to go back to a state that was there before.
    fn go_back(&self, frame: &mut Frame, to: usize) -> Result<(), ProgramError> {
        if to > self.at.1 {
            return Ok(());
        }
        let mut state = DefaultHasher::new();
        for (register, value) in &self.memory.registers {
            (register, value.to_bits()).hash(&mut state);
        }
        for (name, value) in &self.memory.names.values {
            (name, value.to_bits()).hash(&mut state);
        }
        self.memory.signals.hash(&mut state);
        for (register, all) in &self.memory.positions {
            (register, all.map(|v| v.map(f64::to_bits))).hash(&mut state);
        }
        (&self.as_told, &self.no_places).hash(&mut state);
        self.by_output
            .as_ref()
            .map(|(line, _)| line)
            .hash(&mut state);
        let arc = self.arc.as_ref().map(|(word, _)| word);
        (self.frames, arc, self.weave).hash(&mut state);
        if frame.states.insert((to, state.finish())) {
            return Ok(());
        }
        let line = to + 1;
        Err(self.refuse(Refusal::Loop(format!(
            "it goes back to line {line} as before"
        ))))
    }

    /// The index after the label.
    pub(super) fn jump(&self, program: usize, label: u32) -> Result<Flow, ProgramError> {
        let is_label =
            |i: &Instruction| matches!(i, Instruction::Label { number, .. } if *number == label);
        let instructions = &self.programs[program].instructions;
        let to = instructions.iter().position(is_label);
        to.map(Flow::To)
            .ok_or_else(|| self.refuse(Refusal::Label(label)))
    }

    pub(super) fn call(&mut self, name: &str, arguments: &str) -> Result<Flow, ProgramError> {
        let found = self
            .programs
            .iter()
            .position(|p| p.name.eq_ignore_ascii_case(name));
        let Some(program) = found else {
            self.call_outside(name);
            return Ok(Flow::Next);
        };
        let arguments = arguments.split(',').map(|a| self.memory.number(a.trim()));
        let arguments = arguments.collect();
        let at = self.at;
        let own = self.own_variables();
        let end = self.run(program, arguments)?;
        self.own_again(own);
        self.at = at;
        Ok(match end {
            Flow::Abort => Flow::Abort,
            _ => Flow::Next,
        })
    }

    /// What a line of logic does; `None` where it is none.
    pub(super) fn decide(
        &mut self,
        frame: &mut Frame,
        text: &str,
    ) -> Result<Option<Flow>, ProgramError> {
        let Some(logic) = logic(text) else {
            return Ok(None);
        };
        let unknown = |m: &Self| m.refuse(Refusal::Condition(text.to_owned()));
        let flow = match logic {
            Logic::If(condition, action) => match self.memory.condition(condition) {
                Some(true) => self.act(frame, action)?,
                Some(false) => Flow::Next,
                None => return Err(unknown(self)),
            },
            Logic::Then(condition) => match self.memory.condition(condition) {
                Some(true) => Flow::Next,
                Some(false) => Flow::To(self.block_end(frame, true)? + 1),
                None => return Err(unknown(self)),
            },
            // the branch before it was executed
            Logic::Else => Flow::To(self.block_end(frame, false)? + 1),
            // at a case the choice before it was made
            Logic::EndIf | Logic::Case => Flow::Next,
            Logic::For(rest) => self.begin_loop(frame, rest)?,
            Logic::EndFor => self.end_loop(frame)?,
            Logic::While(condition) => match self.memory.condition(condition) {
                Some(true) => Flow::Next,
                Some(false) => Flow::To(self.block_end(frame, false)? + 1),
                None => return Err(unknown(self)),
            },
            Logic::EndWhile => Flow::To(self.block_begin(frame)?),
            Logic::Select(rest) => self.choose(frame, rest)?,
            Logic::Jump(label) => {
                let number = strip_label(label).and_then(|inner| self.memory.index(inner));
                let number = number.ok_or_else(|| unknown(self))?;
                self.jump(frame.program, number)?
            }
        };
        Ok(Some(flow))
    }

    /// Executes what follows a condition.
    fn act(&mut self, frame: &mut Frame, action: &str) -> Result<Flow, ProgramError> {
        self.execute(frame, &parse_instruction(action))
    }

    fn line(&self, frame: &Frame, index: usize) -> Option<&str> {
        match self.programs[frame.program].instructions.get(index)? {
            Instruction::Raw(text) => Some(text),
            _ => Some(""),
        }
    }

    /// The end of the block that begins here, or its `ELSE` where `branches`.
    fn block_end(&self, frame: &Frame, branches: bool) -> Result<usize, ProgramError> {
        let (mut depth, mut at) = (0, self.at.1 + 1);
        while let Some(line) = self.line(frame, at) {
            let (opened, branch) = opens(line);
            depth += opened;
            if depth < 0 || (branches && branch && depth == 0) {
                return Ok(at);
            }
            at += 1;
        }
        Err(self.refuse(Refusal::Unpaired))
    }

    /// The beginning of the block that ends here.
    fn block_begin(&self, frame: &Frame) -> Result<usize, ProgramError> {
        let mut depth = 0;
        for at in (0..self.at.1).rev() {
            depth += opens(self.line(frame, at).unwrap_or_default()).0;
            if depth > 0 {
                return Ok(at);
            }
        }
        Err(self.refuse(Refusal::Unpaired))
    }

    /// `register=from TO to`, or `DOWNTO`: a loop that has nothing to do is passed over.
    fn begin_loop(&mut self, frame: &mut Frame, text: &str) -> Result<Flow, ProgramError> {
        let unknown = |m: &Self| m.refuse(Refusal::Condition(format!("FOR {text}")));
        let upper = text.to_ascii_uppercase();
        let (bounds, step) = match upper.split_once(" DOWNTO ") {
            Some(bounds) => (Some(bounds), -1.0),
            None => (upper.split_once(" TO "), 1.0),
        };
        let read = bounds.and_then(|(begin, last)| {
            let (register, from) = begin.split_once('=')?;
            Some((
                self.memory.reference(register).filter(|r| r.0 == "R")?.1,
                self.memory.number(from)?,
                self.memory.number(last)?,
            ))
        });
        let (register, from, last) = read.ok_or_else(|| unknown(self))?;
        self.memory.registers.insert(register, from);
        frame.loops.insert(self.at.1, (register, last, step));
        if (last - from) * step < 0.0 {
            return Ok(Flow::To(self.block_end(frame, false)? + 1));
        }
        Ok(Flow::Next)
    }

    fn end_loop(&mut self, frame: &Frame) -> Result<Flow, ProgramError> {
        let begin = self.block_begin(frame)?;
        let Some(&(register, last, step)) = frame.loops.get(&begin) else {
            return Err(self.refuse(Refusal::Unpaired));
        };
        let Some(value) = self.memory.registers.get_mut(&register) else {
            let why = format!("R[{register}] at the end of its loop");
            return Err(self.refuse(Refusal::Condition(why)));
        };
        if (last - *value) * step > 0.0 {
            *value += step;
            return Ok(Flow::To(begin + 1));
        }
        Ok(Flow::Next)
    }

    /// `value=case,action`, then lines `=case,action`, then `ELSE,action`: the first that fits is executed.
    fn choose(&mut self, frame: &mut Frame, text: &str) -> Result<Flow, ProgramError> {
        let select = self.at.1;
        let unknown = |m: &Self| m.refuse(Refusal::Condition(format!("SELECT {text}")));
        let (subject, first) = text.split_once('=').ok_or_else(|| unknown(self))?;
        let value = self.memory.number(subject).ok_or_else(|| unknown(self))?;
        let mut case = first.to_owned();
        let mut at = select;
        loop {
            let (condition, action) = parts(&case).ok_or_else(|| unknown(self))?;
            let fits = if condition.is_empty() {
                true
            } else {
                self.memory.number(condition).ok_or_else(|| unknown(self))? == value
            };
            if fits {
                let action = action.to_owned();
                return self.act(frame, &action);
            }
            at += 1;
            let line = self.line(frame, at).unwrap_or_default();
            case = match logic(line) {
                Some(Logic::Case) => line
                    .trim_start_matches('=')
                    .get(if line.starts_with('=') { 0 } else { 4 }..)
                    .unwrap_or_default()
                    .to_owned(),
                _ => return Ok(Flow::Next),
            };
        }
    }
}
