//! The order in which a controller executes programs: calls followed, frames and arc tracked, positions looked up.
//!
//! What only the controller knows is refused (conditions, loops, registers that nothing sets, position registers) or told as a warning
//! where it does not move the tool. A frame that is never selected, or differs from a position's own, is an error, as on the controller.

mod effect;
mod refusal;

use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::{Place, Reporter};
use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;

use effect::{Effect, effect, first_word, moves_target, numbered};
pub use refusal::{ProgramError, Refusal};

use crate::orientation::pose;
use crate::program::{
    ArcAction, ArcWord, CommentMark, Coordinates, Instruction, Motion, MotionKind, Position,
    PositionRef, Program, Speed, SpeedUnit, Termination,
};

/// Calls within calls that a controller takes.
const DEEPEST: usize = 10;

/// What the programs do not say themselves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExecutionSettings {
    /// Register contents before the start.
    pub registers: BTreeMap<u32, f64>,
    /// Meaning of `WELD_SPEED`, mm/s.
    pub weld_speed: Option<f64>,
    /// Programs of the cell that do not move the tool: calls to them are passed over. Capital letters.
    pub passed_over: BTreeSet<String>,
}

/// One thing executed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Executed {
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExecutedMotion {
    /// How.
    pub kind: ExecutedKind,
    /// Where to: the tool in the user frame, mm.
    pub target: Pose,
    /// How fast.
    pub speed: ExecutedSpeed,
    /// Smoothing at the end, 0 to 1; `None` stops (FINE).
    pub smoothing: Option<f64>,
    /// Schedule of the arc during the move; `None` while it is off.
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
pub enum ExecutedKind {
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
pub enum ExecutedSpeed {
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
pub fn execution_order(
    programs: &[Program],
    settings: &ExecutionSettings,
    reporter: &Reporter,
) -> Result<Vec<Executed>, ProgramError> {
    let mut machine = Machine {
        programs,
        settings,
        tables: programs.iter().map(table).collect(),
        registers: settings.registers.clone(),
        frames: (None, None),
        arc: None,
        layer: None,
        pass: None,
        arc_points: Vec::new(),
        executed: Vec::new(),
        told: BTreeMap::new(),
        stack: Vec::new(),
        at: (0, 0),
    };
    if programs.is_empty() {
        return Err(machine.refuse(Refusal::NoProgram));
    }
    machine.run(0)?;
    machine.close_arcs();
    if machine.arc.is_some() {
        return Err(machine.refuse(Refusal::ArcLeftOn));
    }
    machine.tell(reporter);
    Ok(machine.executed)
}

fn table(program: &Program) -> BTreeMap<u32, &Position> {
    program.positions.iter().map(|p| (p.index, p)).collect()
}

struct Machine<'a> {
    programs: &'a [Program],
    settings: &'a ExecutionSettings,
    tables: Vec<BTreeMap<u32, &'a Position>>,
    registers: BTreeMap<u32, f64>,
    frames: (Option<u32>, Option<u32>),
    arc: Option<u32>,
    layer: Option<u32>,
    pass: Option<u32>,
    /// Consecutive circle-arc moves whose circle is not known yet: indices into `executed`.
    arc_points: Vec<usize>,
    executed: Vec<Executed>,
    /// What is not executed, by its first word: how often, first place, an example.
    told: BTreeMap<(&'static str, String), (u32, String, u32)>,
    stack: Vec<usize>,
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

    fn tell(&self, reporter: &Reporter) {
        for ((code, word), (count, program, line)) in &self.told {
            let times = if *count == 1 { "line" } else { "lines" };
            let (message, remedy) = match *code {
                "positioner-not-simulated" => (
                    format!(
                        "{count} {times}: motion group {word} moves, but only group 1 is simulated"
                    ),
                    "read the result for a positioner that stands still",
                ),
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
                _ => (
                    format!("{count} {times} with {word}: kept, but not executed"),
                    "its effect on the motion, if any, is not in the result",
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

    fn run(&mut self, program: usize) -> Result<Flow, ProgramError> {
        if self.stack.contains(&program) || self.stack.len() >= DEEPEST {
            let name = &self.programs[program].name;
            return Err(self.refuse(Refusal::Loop(format!("{name} is called from itself"))));
        }
        self.stack.push(program);
        let instructions = &self.programs[program].instructions;
        let mut next = 0;
        let mut flow = Flow::Return;
        while let Some(instruction) = instructions.get(next) {
            self.at = (program, next);
            next += 1;
            match instruction {
                Instruction::Motion(motion) => self.motion(motion)?,
                Instruction::Arc(word) => {
                    self.close_arcs();
                    self.switch(word)?;
                }
                Instruction::Wait(time) => {
                    self.close_arcs();
                    self.executed.push(Executed::Wait {
                        time: *time,
                        arc: self.arc,
                        program: program as u32,
                        line: next as u32,
                    });
                }
                Instruction::UserFrame(n) => self.frames.0 = Some(*n),
                Instruction::ToolFrame(n) => self.frames.1 = Some(*n),
                Instruction::Call { program: name, .. } => {
                    if let Flow::Abort = self.call(name)? {
                        flow = Flow::Abort;
                        break;
                    }
                    self.at = (program, next - 1);
                }
                Instruction::Comment { mark, text } => {
                    if *mark == CommentMark::Remark {
                        self.layer = numbered(text, "Layer").or(self.layer);
                        self.pass = numbered(text, "Pass").or(self.pass);
                    }
                }
                Instruction::Jump(label) => next = self.jump(program, *label)?,
                Instruction::End => break,
                Instruction::Label { .. } | Instruction::Blank => {}
                Instruction::Raw(text) => match effect(text) {
                    Effect::Condition => return Err(self.refuse(Refusal::Condition(text.clone()))),
                    Effect::Loop => return Err(self.refuse(Refusal::Loop(text.clone()))),
                    Effect::Set(register, value) => {
                        match value {
                            Some(v) => self.registers.insert(register, v),
                            None => self.registers.remove(&register),
                        };
                    }
                    Effect::Frame { user: true } => self.frames.0 = None,
                    Effect::Frame { user: false } => self.frames.1 = None,
                    Effect::Abort => {
                        flow = Flow::Abort;
                        break;
                    }
                    Effect::Passive => self.note("line-passed-over", first_word(text)),
                    Effect::Unknown => self.note("line-not-executed", first_word(text)),
                },
            }
        }
        self.stack.pop();
        Ok(flow)
    }

    fn jump(&self, program: usize, label: u32) -> Result<usize, ProgramError> {
        let instructions = &self.programs[program].instructions;
        let is_label =
            |i: &Instruction| matches!(i, Instruction::Label { number, .. } if *number == label);
        let to = instructions
            .iter()
            .position(is_label)
            .ok_or_else(|| self.refuse(Refusal::Label(label)))?;
        if to <= self.at.1 {
            return Err(self.refuse(Refusal::Loop(format!("JMP LBL[{label}] goes back"))));
        }
        Ok(to)
    }

    fn call(&mut self, name: &str) -> Result<Flow, ProgramError> {
        let found = self
            .programs
            .iter()
            .position(|p| p.name.eq_ignore_ascii_case(name));
        if let Some(program) = found {
            return self.run(program);
        }
        let name = name.to_ascii_uppercase();
        if self.settings.passed_over.contains(&name) {
            self.note("call-passed-over", name);
            return Ok(Flow::Return);
        }
        Err(self.refuse(Refusal::Call(name)))
    }

    fn switch(&mut self, word: &ArcWord) -> Result<(), ProgramError> {
        match word.action {
            ArcAction::Start => {
                // schedules that are written as values have no number
                let schedule = word.schedule().unwrap_or(0);
                if self.arc == Some(schedule) {
                    return Err(self.refuse(Refusal::ArcOn));
                }
                self.arc = Some(schedule);
            }
            ArcAction::End => {
                if self.arc.take().is_none() {
                    return Err(self.refuse(Refusal::ArcOff));
                }
            }
        }
        Ok(())
    }

    /// The pose of a position in the selected frames; `None` for a position given by joints.
    fn place(&mut self, reference: &PositionRef) -> Result<Option<Pose>, ProgramError> {
        let index = match reference {
            PositionRef::Point { index, .. } => *index,
            PositionRef::Unresolved(text) => {
                return Err(self.refuse(Refusal::Unresolved(text.clone())));
            }
        };
        let Some(position) = self.tables[self.at.0].get(&index).copied() else {
            return Err(self.refuse(Refusal::NoPosition(index)));
        };
        let Some(group) = position.groups.iter().find(|g| g.number == 1) else {
            return Err(self.refuse(Refusal::JointPosition(index)));
        };
        for other in position.groups.iter().filter(|g| g.number != 1) {
            if moved_away(&other.coordinates) {
                self.note("positioner-not-simulated", other.number.to_string());
            }
        }
        let Coordinates::Cartesian {
            xyz, wpr_degrees, ..
        } = &group.coordinates
        else {
            return Ok(None);
        };
        let pairs = [
            ("user frame", group.frame, self.frames.0),
            ("tool frame", group.tool, self.frames.1),
        ];
        for (what, taught, selected) in pairs {
            if let (Some(taught), Some(selected)) = (taught, selected)
                && taught != selected
            {
                return Err(self.refuse(Refusal::OtherFrame {
                    index,
                    what,
                    taught,
                    selected,
                }));
            }
        }
        Ok(Some(pose(DVec3::from_array(*xyz), *wpr_degrees)))
    }

    fn speed(&self, motion: &Motion) -> Result<ExecutedSpeed, ProgramError> {
        let (value, unit) = match motion.speed {
            Speed::Value { value, unit } => (value, unit),
            Speed::Register { number, unit } => {
                let register = || self.refuse(Refusal::Register(format!("R[{number}]")));
                (*self.registers.get(&number).ok_or_else(register)?, unit)
            }
            Speed::Weld => {
                let unknown = || self.refuse(Refusal::Register("WELD_SPEED".to_owned()));
                let speed = self.settings.weld_speed.ok_or_else(unknown)?;
                return Ok(ExecutedSpeed::Path(speed));
            }
            Speed::Maximum => {
                return match motion.kind {
                    MotionKind::Joint => Ok(ExecutedSpeed::Joint(1.0)),
                    _ => Err(self.refuse(Refusal::Speed)),
                };
            }
        };
        if !(value > 0.0 && value.is_finite()) {
            return Err(self.refuse(Refusal::Speed));
        }
        match (unit, &motion.kind) {
            (SpeedUnit::Second, _) => Ok(ExecutedSpeed::Duration(value)),
            (SpeedUnit::Millisecond, _) => Ok(ExecutedSpeed::Duration(value * 1e-3)),
            (SpeedUnit::Percent, MotionKind::Joint) if value <= 100.0 => {
                Ok(ExecutedSpeed::Joint(value / 100.0))
            }
            (SpeedUnit::Percent, _) | (_, MotionKind::Joint) => Err(self.refuse(Refusal::Speed)),
            (SpeedUnit::DegreePerSecond, _) => Ok(ExecutedSpeed::Rotation(value.to_radians())),
            (SpeedUnit::MillimetrePerSecond, _) => Ok(ExecutedSpeed::Path(value)),
            (SpeedUnit::CentimetrePerMinute, _) => Ok(ExecutedSpeed::Path(value * 10.0 / 60.0)),
            (SpeedUnit::InchPerMinute, _) => Ok(ExecutedSpeed::Path(value * 25.4 / 60.0)),
        }
    }

    fn smoothing(&mut self, motion: &Motion) -> Result<Option<f64>, ProgramError> {
        let share = match &motion.termination {
            Termination::Fine => return Ok(None),
            Termination::Cnt(share) => f64::from(*share),
            Termination::CntRegister(n) => {
                let register = || self.refuse(Refusal::Register(format!("R[{n}]")));
                *self.registers.get(n).ok_or_else(register)?
            }
            Termination::Other(word) => {
                self.note("line-not-executed", first_word(word));
                100.0
            }
        };
        Ok(Some((share / 100.0).clamp(0.0, 1.0)))
    }

    fn motion(&mut self, motion: &Motion) -> Result<(), ProgramError> {
        let (Some(frame), Some(tool)) = self.frames else {
            let missing = if self.frames.0.is_none() {
                "UFRAME_NUM"
            } else {
                "UTOOL_NUM"
            };
            return Err(self.refuse(Refusal::NoFrame(missing)));
        };
        for word in &motion.extra {
            if moves_target(word) {
                return Err(self.refuse(Refusal::Unresolved(word.clone())));
            }
            self.note("line-not-executed", first_word(word));
        }
        let joint = motion.kind == MotionKind::Joint;
        if joint && self.arc.is_some() {
            return Err(self.refuse(Refusal::ArcInJointMove));
        }
        let Some(target) = self.place(&motion.target)? else {
            let index = match &motion.target {
                PositionRef::Point { index, .. } => *index,
                PositionRef::Unresolved(_) => 0,
            };
            if joint && motion.arc.is_none() {
                self.note("joint-position-skipped", index.to_string());
                return Ok(());
            }
            return Err(self.refuse(Refusal::JointPosition(index)));
        };
        let kind = match &motion.kind {
            MotionKind::Joint => ExecutedKind::Joint,
            // circles of A moves are found once three of them are known
            MotionKind::Linear | MotionKind::CircleArc => ExecutedKind::Linear,
            MotionKind::Circular { via } => {
                let place = self.place(via)?;
                let unknown = || self.refuse(Refusal::Unresolved("via point".to_owned()));
                ExecutedKind::Circular {
                    via: place.ok_or_else(unknown)?.position,
                }
            }
        };
        let (speed, smoothing) = (self.speed(motion)?, self.smoothing(motion)?);
        if motion.kind == MotionKind::CircleArc {
            self.arc_points.push(self.executed.len());
        } else {
            self.close_arcs();
        }
        self.executed.push(Executed::Motion(ExecutedMotion {
            kind,
            target,
            speed,
            smoothing,
            arc: self.arc,
            frames: (frame, tool),
            layer: self.layer,
            pass: self.pass,
            program: self.at.0 as u32,
            line: self.at.1 as u32 + 1,
        }));
        if let Some(word) = &motion.arc {
            let was = self.arc;
            self.switch(word)?;
            let changes = was.is_none() || self.arc.is_none();
            if smoothing.is_some() && changes {
                self.note("arc-on-the-fly", word.to_string());
            }
        }
        Ok(())
    }

    /// Gives a finished chain of A moves its circles: each pair of points lies on the circle with the next point, the last pair on
    /// that with the one before. The move to the first point is straight, and so are chains of less than three points.
    fn close_arcs(&mut self) {
        let chain = std::mem::take(&mut self.arc_points);
        let at = |executed: &[Executed], i: usize| match executed.get(i) {
            Some(Executed::Motion(m)) => m.target.position,
            _ => DVec3::ZERO,
        };
        for (k, pair) in chain.windows(2).enumerate() {
            let Some(first) = k.checked_sub(usize::from(k + 3 > chain.len())) else {
                continue;
            };
            let Some(three) = chain.get(first..first + 3) else {
                continue;
            };
            let points = [0, 1, 2].map(|i| at(&self.executed, three[i]));
            let Some(arc) = Arc::through(points[0], points[1], points[2]) else {
                continue;
            };
            let offset = points[1] - arc.centre;
            let share = offset
                .dot(arc.v)
                .atan2(offset.dot(arc.u))
                .rem_euclid(std::f64::consts::TAU)
                / arc.sweep;
            let middle = if first == k {
                0.5 * share
            } else {
                0.5 * (1.0 + share)
            };
            if let Some(Executed::Motion(m)) = self.executed.get_mut(pair[1]) {
                m.kind = ExecutedKind::Circular {
                    via: arc.at(middle),
                };
            }
        }
    }
}

/// Whether the axes of a further group stand elsewhere than at zero.
fn moved_away(coordinates: &Coordinates) -> bool {
    match coordinates {
        Coordinates::Joint(axes) => axes.iter().any(|a| a.value != 0.0),
        Coordinates::Cartesian { .. } | Coordinates::Unread(_) => true,
    }
}

/// How a program ended.
enum Flow {
    Return,
    Abort,
}
