//! The order in which a controller executes programs: calls followed, frames and arc tracked, positions looked up.
//!
//! Every line is executed, or shapes no metal (told as a warning), or shapes metal in a way that only the controller knows: such
//! lines are told as [`Gap`]s, and the result is not that of the program. Conditions, choices and loops are followed where the values
//! that decide are known, and refused where they are not. A frame that is never selected, or differs from a position's own, is an error, as on the controller.

mod effect;
mod expression;
mod flow;
mod gap;
mod moves;
mod refusal;

use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::{Place, Reporter};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;

use effect::{Effect, Selected, effect, first_word, numbered, told_schedule};
use expression::Memory;
use flow::{Flow, Frame};
pub use gap::{Gap, Missing};
pub use refusal::{ProgramError, Refusal};

use crate::fanuc_ls::instruction_text;
use crate::program::{ArcAction, ArcWord, CommentMark, Instruction, Position, Program};

/// Longest wait that is simulated, s: a day.
const LONGEST_WAIT: f64 = 86_400.0;

/// What the programs do not say themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct ExecutionSettings {
    /// Register contents before the start.
    pub registers: BTreeMap<u32, f64>,
    /// States of inputs, outputs and flags before the start, by name in capitals and number.
    pub signals: BTreeMap<(String, u32), bool>,
    /// What weld schedules set, by number.
    pub schedules: BTreeMap<u32, WeldSettings>,
    /// Speed along the path, mm/s, of moves whose own is not known.
    pub assumed_speed: f64,
    /// Programs of the cell that lay no metal: calls to them are passed over. Capital letters.
    pub passed_over: BTreeSet<String>,
}

impl Default for ExecutionSettings {
    fn default() -> Self {
        ExecutionSettings {
            registers: BTreeMap::new(),
            signals: BTreeMap::new(),
            schedules: BTreeMap::new(),
            assumed_speed: 10.0,
            passed_over: BTreeSet::new(),
        }
    }
}

/// What a weld schedule sets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeldSettings {
    /// Programmed wire feed speed, mm/s.
    pub wire_feed: f64,
    /// Meaning of `WELD_SPEED`, mm/s, where the schedule says it.
    pub speed: Option<f64>,
}

/// What programs do when they are executed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Execution {
    /// The moves and waits, in order.
    pub steps: Vec<Executed>,
    /// What the weld schedules that were used set, as far as it is known.
    pub schedules: BTreeMap<u32, WeldSettings>,
    /// Lines that shape metal and were not simulated, each once, in the order of execution.
    pub gaps: Vec<Gap>,
}

/// One thing executed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Executed {
    /// A move.
    Motion(ExecutedMotion),
    /// A wait.
    Wait {
        /// Duration, s.
        time: f64,
        /// Schedule of the arc meanwhile; `None` while it is off.
        arc: Option<u32>,
        /// Index of the program.
        program: u32,
        /// Instruction number, from 1.
        line: u32,
    },
}

/// A move with everything resolved.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ExecutedMotion {
    /// How.
    pub kind: ExecutedKind,
    /// Where to: the tool in the user frame, mm.
    pub target: Pose,
    /// Where the external axes go, mm or rad: those of the robot's group, then those of further groups.
    pub external: Vec<f64>,
    /// How fast.
    pub speed: ExecutedSpeed,
    /// Smoothing at the end, 0 to 1; `None` stops (FINE).
    pub smoothing: Option<f64>,
    /// Schedule of the arc during the move, in [`Execution::schedules`] where it is known; `None` while it is off.
    pub arc: Option<u32>,
    /// User and tool frame.
    pub frames: (u32, u32),
    /// Layer, where a comment `Layer n` said it.
    pub layer: Option<u32>,
    /// Pass, where a comment `Pass n` said it.
    pub pass: Option<u32>,
    /// Index of the program.
    pub program: u32,
    /// Instruction number, from 1.
    pub line: u32,
}

/// How a move goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ExecutedKind {
    /// By the joints; its path is not known here.
    Joint,
    /// Straight.
    Linear,
    /// On the circle through the last target, `via` and the target.
    Circular {
        /// Point on the way, mm.
        via: DVec3,
    },
}

/// How fast a move is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ExecutedSpeed {
    /// mm/s.
    Path(f64),
    /// Share of the robot's joint speed, 0 to 1.
    Joint(f64),
    /// rad/s.
    Rotation(f64),
    /// Duration, s.
    Duration(f64),
}

/// Executes `programs`, the first of which is the main one, without a robot.
///
/// # Errors
/// [`ProgramError`] with program and instruction number.
pub(crate) fn execution_order(
    programs: &[Program],
    settings: &ExecutionSettings,
    reporter: &Reporter,
) -> Result<Execution, ProgramError> {
    let mut machine = Machine {
        programs,
        settings,
        tables: programs.iter().map(table).collect(),
        memory: Memory {
            registers: settings.registers.clone(),
            signals: settings.signals.clone(),
            arguments: Vec::new(),
        },
        schedules: settings.schedules.clone(),
        unnumbered: Vec::new(),
        frames: (None, None),
        bead_frames: None,
        bead_axes: None,
        arc: None,
        layer: None,
        pass: None,
        arc_points: Vec::new(),
        executed: Vec::new(),
        told: BTreeMap::new(),
        gaps: Vec::new(),
        seen: BTreeSet::new(),
        count: 0,
        most: Machine::most(programs),
        at: (0, 0),
    };
    if programs.is_empty() {
        return Err(machine.refuse(Refusal::NoProgram));
    }
    machine.run(0, Vec::new())?;
    machine.close_arcs();
    if machine.arc.is_some() {
        return Err(machine.refuse(Refusal::ArcLeftOn));
    }
    machine.tell(reporter);
    Ok(Execution {
        steps: machine.executed,
        schedules: machine.schedules,
        gaps: machine.gaps,
    })
}

fn table(program: &Program) -> BTreeMap<u32, &Position> {
    program.positions.iter().map(|p| (p.index, p)).collect()
}

struct Machine<'a> {
    programs: &'a [Program],
    settings: &'a ExecutionSettings,
    tables: Vec<BTreeMap<u32, &'a Position>>,
    memory: Memory,
    schedules: BTreeMap<u32, WeldSettings>,
    /// Arc words that set the source by values: they take the numbers that no controller has, from the last one down.
    unnumbered: Vec<String>,
    frames: (Option<u32>, Option<u32>),
    /// Frames of the first bead.
    bead_frames: Option<(u32, u32)>,
    /// External axes of the robot's group at the first bead.
    bead_axes: Option<Vec<f64>>,
    arc: Option<u32>,
    layer: Option<u32>,
    pass: Option<u32>,
    /// Consecutive circle-arc moves whose circle is not known yet: indices into `executed`.
    arc_points: Vec<usize>,
    executed: Vec<Executed>,
    /// What is not executed, by its first word: how often, first place, an example.
    told: BTreeMap<(&'static str, String), (u32, String, u32)>,
    gaps: Vec<Gap>,
    /// Lines and reasons that are among the gaps.
    seen: BTreeSet<((usize, usize), String)>,
    /// Instructions executed, and the most that are.
    count: usize,
    most: usize,
    /// Program and instruction being executed, from 0.
    at: (usize, usize),
}

impl Machine<'_> {
    fn refuse(&self, why: Refusal) -> ProgramError {
        let program = self.programs.get(self.at.0);
        ProgramError {
            program: program.map_or_else(|| "(none)".to_owned(), |p| p.name.clone()),
            line: self.at.1 as u32 + 1,
            why,
        }
    }

    /// Remembers something that is not executed.
    fn note(&mut self, code: &'static str, word: String) {
        let (program, line) = self.at;
        let name = || self.programs[program].name.clone();
        let entry = self
            .told
            .entry((code, word))
            .or_insert_with(|| (0, name(), line as u32 + 1));
        entry.0 += 1;
    }

    /// Remembers a line that shapes metal and is not simulated.
    fn gap(&mut self, why: Missing) {
        let program = &self.programs[self.at.0];
        let line = self.at.1 as u32 + 1;
        if !self.seen.insert((self.at, why.to_string())) {
            return;
        }
        let text = program.instructions.get(self.at.1);
        self.gaps.push(Gap {
            program: program.name.clone(),
            line,
            text: text.map(instruction_text).unwrap_or_default(),
            why,
        });
    }

    fn tell(&self, reporter: &Reporter) {
        for ((code, word), (count, program, line)) in &self.told {
            let times = if *count == 1 { "line" } else { "lines" };
            let (message, remedy) = match *code {
                "joint-position-skipped" => (
                    format!(
                        "{count} {times}: P[{word}] is given by joints: this travel is left out"
                    ),
                    "the simulation goes on at the next position; times leave this travel out",
                ),
                "arc-on-the-fly" => (
                    format!(
                        "{count} {times}: the arc changes at a point the tool does not stop at ({word})"
                    ),
                    "use FINE where beads start and end",
                ),
                "call-passed-over" => (
                    format!("{count} {times}: calls of {word} are passed over"),
                    "",
                ),
                "travel-speed" => (
                    format!("{count} {times}: the speed {word} of a travel is not known"),
                    "times leave it open",
                ),
                _ => (
                    format!(
                        "{count} {times} with {word}: kept, not executed, no metal is laid by it"
                    ),
                    "",
                ),
            };
            let place = Place {
                file: Some(program.clone()),
                line: Some(*line),
                ..Place::default()
            };
            reporter.warn_at(code, message, place, remedy);
        }
    }

    /// Executes one instruction of a program that runs.
    fn execute(
        &mut self,
        frame: &mut Frame,
        instruction: &Instruction,
    ) -> Result<Flow, ProgramError> {
        match instruction {
            Instruction::Motion(motion) => self.motion(motion)?,
            Instruction::Arc(word) => {
                self.close_arcs();
                self.switch(word)?;
            }
            Instruction::Wait(time) => self.wait(*time)?,
            Instruction::UserFrame(n) => self.frames.0 = Some(*n),
            Instruction::ToolFrame(n) => self.frames.1 = Some(*n),
            Instruction::Call { program, arguments } => return self.call(program, arguments),
            Instruction::Comment { mark, text } => {
                if *mark == CommentMark::Remark {
                    self.layer = numbered(text, "Layer").or(self.layer);
                    self.pass = numbered(text, "Pass").or(self.pass);
                    self.learn(text);
                }
            }
            Instruction::Jump(label) => return self.jump(frame.program, *label),
            Instruction::End => return Ok(Flow::Return),
            Instruction::Label { .. } | Instruction::Blank => {}
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
            Effect::Abort => return Ok(Flow::Abort),
            Effect::Wait => {
                let until = text.get(4..).unwrap_or_default();
                let time = until.trim().trim_end_matches("(sec)");
                match self.memory.number(time).filter(|t| *t >= 0.0) {
                    Some(time) => self.wait(time)?,
                    // it is so already
                    None if self.memory.condition(until) == Some(true) => {}
                    None if self.arc.is_some() => self.gap(Missing::WaitWithArc),
                    None => self.note("line-passed-over", first_word(text)),
                }
            }
            Effect::Signal => {
                self.set(text);
                self.note("line-passed-over", first_word(text));
            }
            Effect::Passive => self.note("line-passed-over", first_word(text)),
            Effect::Shapes(why) => self.gap(why),
        }
        Ok(Flow::Next)
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

    fn wait(&mut self, time: f64) -> Result<(), ProgramError> {
        self.close_arcs();
        if time > LONGEST_WAIT {
            return Err(self.refuse(Refusal::Wait(time)));
        }
        self.executed.push(Executed::Wait {
            time,
            arc: self.arc,
            program: self.at.0 as u32,
            line: self.at.1 as u32 + 1,
        });
        Ok(())
    }

    /// Passes over a call of a program that was not given.
    fn call_outside(&mut self, name: &str) {
        let name = name.to_ascii_uppercase();
        if self.settings.passed_over.contains(&name) {
            self.note("call-passed-over", name);
        } else {
            self.gap(Missing::Call(name));
        }
    }

    /// A schedule that a comment tells, where the cell does not know better.
    fn learn(&mut self, comment: &str) {
        if let Some((number, wire_feed)) = told_schedule(comment) {
            let told = WeldSettings {
                wire_feed,
                speed: None,
            };
            self.schedules.entry(number).or_insert(told);
        }
    }

    /// The number of what an arc word sets.
    fn schedule(&mut self, word: &ArcWord) -> u32 {
        if let Some(number) = word.schedule() {
            return number;
        }
        let known = self.unnumbered.iter().position(|u| *u == word.arguments);
        let index = known.unwrap_or_else(|| {
            self.unnumbered.push(word.arguments.clone());
            self.unnumbered.len() - 1
        });
        u32::MAX - index as u32
    }

    fn switch(&mut self, word: &ArcWord) -> Result<(), ProgramError> {
        match word.action {
            ArcAction::Start => {
                let schedule = self.schedule(word);
                if self.arc == Some(schedule) {
                    return Err(self.refuse(Refusal::ArcOn));
                }
                self.arc = Some(schedule);
                if !self.schedules.contains_key(&schedule) {
                    self.gap(Missing::Schedule(word.to_string()));
                }
            }
            ArcAction::End => {
                if self.arc.take().is_none() {
                    return Err(self.refuse(Refusal::ArcOff));
                }
            }
        }
        Ok(())
    }
}
