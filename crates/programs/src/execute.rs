//! The order in which a controller executes programs: calls followed, frames and arc tracked, positions looked up.
//!
//! Every line is executed, or shapes no metal (told as a warning), or shapes metal in a way that only the controller knows: such
//! lines are told as [`Gap`]s, and the result is not that of the program. Conditions, choices and loops are followed where the values
//! that decide are known, and refused where they are not. A frame that is never selected, or differs from a position's own, is an error, as on the controller.

mod axes;
mod beside;
mod circles;
mod class;
mod comments;
mod crater;
mod deciders;
mod effect;
mod flow;
mod frames;
mod gap;
mod held;
mod inform_logic;
mod instructions;
mod job_lines;
mod logic;
mod modal;
mod moves;
mod outputs;
mod path;
mod positions;
mod refusal;
mod source;
mod told;
mod turned;
mod turns;
mod untold;
mod zones;

use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

use meltpath_base::{Place, Reporter};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_toolpath::Weave;

pub use class::{Becomes, becomes};
use deciders::Depends;
pub use gap::{Gap, Lacking, Missing, NoPose, Open};
use path::{Came, FramesAt, Zone};
pub use refusal::{ProgramError, Refusal};
pub use told::{ToldOutput, ToldPosition};

use crate::expression::{Memory, Names};
use crate::fanuc_ls::instruction_text;
use crate::held::Holds;
use crate::modal::Now;
use crate::positioner::Turning;
use crate::program::{ArcValue, Dialect, Instruction, Position, Program};
use crate::scan::tidy;
use comments::Comments;

/// What the programs do not say themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct ExecutionSettings {
    /// Register contents before the start.
    pub registers: BTreeMap<u32, f64>,
    /// Variables of a Yaskawa before the start, by name and number: `B`, 12.
    pub variables: BTreeMap<(String, u32), f64>,
    /// Position registers before the start.
    pub positions: BTreeMap<u32, ToldPosition>,
    /// Where the tool is at those that hold joints, mm in the frame that beads are told in; else why that is not known.
    pub register_poses: BTreeMap<u32, Result<Pose, NoPose>>,
    /// What outputs set the welding source to.
    pub outputs: Vec<ToldOutput>,
    /// States of inputs, outputs and flags before the start, by name in capitals and number.
    pub signals: BTreeMap<(String, u32), bool>,
    /// What weld schedules set, by procedure, where it matters, and number.
    pub schedules: BTreeMap<(Option<u32>, u32), WeldSettings>,
    /// What schedules set that an arc word calls by a value of theirs ([`ArcValue::Schedule`]): a job of the source, a condition file.
    /// Where that is not their number, their number calls nothing; nor does what several call.
    pub called: BTreeMap<u32, Option<WeldSettings>>,
    /// What the numbers in the brackets of an arc word mean, in order; empty where they are a schedule's.
    pub arc_values: Vec<ArcValue>,
    /// What weave schedules set, by number.
    pub weaves: BTreeMap<u32, Weave>,
    /// Way, mm, over which a bead may gain its speed without its metal showing it.
    pub unseen_way: f64,
    /// Speed along the path, mm/s, of moves whose own is not known.
    pub assumed_speed: f64,
    /// Programs of the cell that lay no metal: calls to them are passed over. Capital letters.
    pub passed_over: BTreeSet<String>,
    /// Those that leave the torch where they are called.
    pub returning: BTreeSet<String>,
    /// Distance, mm, at which a path is left that is smoothed in full; nothing where the cell does not say it.
    pub blend: Option<f64>,
    /// What turns the part while metal is laid; nothing where the cell does not say it.
    pub positioner: Option<Turning>,
    /// How many external axes of the robot's group, from the first on, carry the arm and leave positions where they are: a track that the
    /// controller counts to the arm.
    pub slides: usize,
    /// By how many external axes the robot's group may have, which of them turn: dialects that write no unit tell these in degrees.
    /// Empty where the robot is not known.
    pub turning: BTreeMap<usize, Vec<bool>>,
    /// Where the tool is at positions that are given by joints, mm in the frame that beads are told in, by program, from 0, and number.
    pub by_joints: BTreeMap<(usize, u32), Result<Pose, NoPose>>,
}

impl Default for ExecutionSettings {
    fn default() -> Self {
        ExecutionSettings {
            registers: BTreeMap::new(),
            variables: BTreeMap::new(),
            positions: BTreeMap::new(),
            register_poses: BTreeMap::new(),
            outputs: Vec::new(),
            signals: BTreeMap::new(),
            schedules: BTreeMap::new(),
            called: BTreeMap::new(),
            arc_values: Vec::new(),
            weaves: BTreeMap::new(),
            unseen_way: 0.5,
            assumed_speed: 10.0,
            passed_over: BTreeSet::new(),
            returning: BTreeSet::new(),
            blend: None,
            positioner: None,
            slides: 0,
            turning: BTreeMap::new(),
            by_joints: BTreeMap::new(),
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
    /// How long the torch stands on the crater where a FANUC ends the arc with it, s, where the cell says it.
    pub crater: Option<f64>,
}

/// What programs do when they are executed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Execution {
    /// The moves and waits, in order.
    pub steps: Vec<Executed>,
    /// The weaves that moves refer to.
    pub weaves: Vec<Weave>,
    /// Lines that shape metal and were not simulated, each once, in the order of execution.
    pub gaps: Vec<Gap>,
    /// Travels that are left out, as it is not known where they lead.
    pub left_out: Vec<Gap>,
}

/// The source while the arc burns, as far as it is known.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Source {
    /// Programmed wire feed speed, mm/s.
    pub wire_feed: Option<f64>,
    /// Meaning of `WELD_SPEED`, mm/s.
    pub speed: Option<f64>,
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
        /// The arc meanwhile; `None` while it is off.
        arc: Option<Source>,
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
    /// How fast the tool turns at the most, °/s, where the program says it.
    pub turns: Option<f64>,
    /// Smoothing at the end, 0 to 1; `None` stops (FINE).
    pub smoothing: Option<f64>,
    /// The arc during the move; `None` while it is off.
    pub arc: Option<Source>,
    /// Number of the weave in [`Execution::weaves`], from 1; `None` without.
    pub weave: Option<u32>,
    /// User and tool frame.
    pub frames: (u32, u32),
    /// What the robot holds; nothing where it is not said, and for places that are given by joints.
    pub holds: Option<Holds>,
    /// Layer, where a comment `Layer n` said it.
    pub layer: Option<u32>,
    /// Bead of the layer, counted from 1, where a comment `Layer n bead m` said it.
    pub bead: Option<u32>,
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
            positions: told::places(&settings.positions),
            names: match programs.first().map(|p| p.dialect) {
                Some(Dialect::Inform) => told::variables(&settings.variables),
                _ => Names::default(),
            },
            ..Memory::default()
        },
        as_told: settings.positions.keys().map(|n| (*n, *n)).collect(),
        no_places: BTreeSet::new(),
        astray: false,
        depends: OnceCell::new(),
        by_output: None,
        comments: Comments::of(programs, &settings.arc_values),
        weaves: Vec::new(),
        weave: None,
        stops: false,
        frames: (None, None),
        holds: None,
        said_holds: programs.iter().map(said_holds).collect(),
        here: None,
        bead_frames: None,
        bead_axes: None,
        axes: None,
        came: Came::Unknown,
        now: Now::default(),
        turned: None,
        arc: None,
        layer: None,
        bead: None,
        arc_points: Vec::new(),
        zones: Vec::new(),
        executed: Vec::new(),
        told: BTreeMap::new(),
        gaps: Vec::new(),
        left_out: Vec::new(),
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
    machine.tell_in_frames_of_beads();
    machine.look_at_circles();
    machine.keep_turns();
    machine.look_at_zones();
    if machine.arc.is_some() {
        machine.gap(Missing::ArcLeftOn);
    }
    machine.leave_out_held_otherwise();
    machine.tell(reporter);
    Ok(Execution {
        steps: machine.executed,
        weaves: machine.weaves,
        gaps: machine.gaps,
        left_out: machine.left_out,
    })
}

fn table(program: &Program) -> BTreeMap<u32, &Position> {
    program.positions.iter().map(|p| (p.index, p)).collect()
}

/// What a program says that the robot holds, from which instruction on.
fn said_holds(program: &Program) -> Vec<(usize, Holds)> {
    let all = program.instructions.iter().enumerate();
    let said = all.filter_map(|(at, instruction)| match instruction {
        Instruction::Holds(holds) => Some((at, *holds)),
        _ => None,
    });
    said.collect()
}

/// An instruction, from 0, as people find it in its file.
fn text_of(program: &Program, at: usize) -> String {
    match (program.instructions.get(at), program.texts.get(at)) {
        (Some(Instruction::Raw(text)), _) | (_, Some(text)) => text.clone(),
        (Some(instruction), None) => instruction_text(instruction),
        (None, None) => String::new(),
    }
}

struct Machine<'a> {
    programs: &'a [Program],
    settings: &'a ExecutionSettings,
    tables: Vec<BTreeMap<u32, &'a Position>>,
    memory: Memory,
    /// Position registers that hold what the cell tells of a register, by the number of that one.
    as_told: BTreeMap<u32, u32>,
    /// Those that were set to what is no place that is known, and may be joints.
    no_places: BTreeSet<u32>,
    /// A jump of a job was passed over: whether later ones lead back is not known.
    astray: bool,
    /// What registers and signals hang on, once it was asked for.
    depends: OnceCell<Depends>,
    /// What an output set the source to, since no arc word did: the line, and the schedule.
    by_output: Option<(String, WeldSettings)>,
    /// What comments say of schedules.
    comments: Comments,
    weaves: Vec<Weave>,
    /// The weave that is on, from 1.
    weave: Option<u32>,
    frames: (Option<u32>, Option<u32>),
    /// What the robot holds, as the last line said that says it.
    holds: Option<Holds>,
    /// What each program says of it, from which instruction on.
    said_holds: Vec<Vec<(usize, Holds)>>,
    /// Where the last move led to, where it is known.
    here: Option<Pose>,
    /// Names of user and tool frame of the first bead, and its program with their numbers there.
    bead_frames: Option<([String; 2], FramesAt)>,
    /// External axes of the robot's group at the first bead.
    bead_axes: Option<Vec<f64>>,
    /// External axes of the robot's group at the last move that tells them.
    axes: Option<Vec<f64>>,
    /// Where the last move came to.
    came: Came,
    /// What lines have set for the moves to come.
    now: Now,
    /// Where the positioner stood at the last move.
    turned: Option<Vec<f64>>,
    /// Nothing is prepared ahead: every move ends at a standstill.
    stops: bool,
    /// While the arc burns: what its word says, and what it sets.
    arc: Option<(String, Source)>,
    layer: Option<u32>,
    bead: Option<u32>,
    /// Consecutive circle-arc moves whose circle is not known yet: indices into `executed`.
    arc_points: Vec<usize>,
    /// Moves that are rounded farther than the corner model reaches.
    zones: Vec<Zone>,
    executed: Vec<Executed>,
    /// What is not executed, by its first word.
    told: BTreeMap<(&'static str, String), Told>,
    gaps: Vec<Gap>,
    left_out: Vec<Gap>,
    /// Lines and reasons that are among the gaps.
    seen: BTreeSet<((usize, usize), String)>,
    /// Instructions executed, and the most that are.
    count: usize,
    most: usize,
    /// Program and instruction being executed, from 0.
    at: (usize, usize),
}

/// Lines of a kind that are not executed.
struct Told {
    count: u32,
    /// The first one: its program, its number, its text.
    program: String,
    line: u32,
    text: String,
}

impl Told {
    /// How many they are, and which is the first.
    fn lines(&self) -> String {
        let Told {
            count, line, text, ..
        } = self;
        if *count == 1 {
            return format!("line {line} (\"{text}\")");
        }
        format!("{count} lines, first line {line} (\"{text}\")")
    }
}

impl Machine<'_> {
    fn refuse(&self, why: Refusal) -> ProgramError {
        let program = self.programs.get(self.at.0);
        ProgramError {
            program: program.map_or_else(|| "(none)".to_owned(), |p| p.name.clone()),
            line: program.map_or(0, |p| p.line_of(self.at.1 as u32 + 1)),
            untold: match &why {
                Refusal::Condition(_) => self.deciders(),
                _ => Vec::new(),
            },
            why,
        }
    }

    /// Remembers something that is not executed.
    fn note(&mut self, code: &'static str, word: String) {
        let (program, line) = self.at;
        let program = &self.programs[program];
        let entry = self.told.entry((code, word)).or_insert_with(|| Told {
            count: 0,
            program: program.name.clone(),
            line: program.line_of(line as u32 + 1),
            text: tidy(&text_of(program, line)),
        });
        entry.count += 1;
    }

    /// Remembers a line that shapes metal and is not simulated.
    fn gap(&mut self, why: Missing) {
        if self.seen.insert((self.at, why.to_string())) {
            let gap = self.here_is(why);
            self.gaps.push(gap);
        }
    }

    /// Remembers a travel that is left out.
    fn leaves_out(&mut self, why: Missing) {
        if self.seen.insert((self.at, why.to_string())) {
            let travel = self.here_is(why);
            self.left_out.push(travel);
        }
    }

    /// What is missing at the line being executed.
    fn here_is(&self, why: Missing) -> Gap {
        let program = &self.programs[self.at.0];
        Gap {
            program: program.name.clone(),
            line: program.line_of(self.at.1 as u32 + 1),
            text: text_of(program, self.at.1),
            why,
        }
    }

    fn tell(&self, reporter: &Reporter) {
        for ((code, word), told) in &self.told {
            let lines = told.lines();
            let (message, remedy) = match *code {
                "joint-position-skipped" => (
                    format!("{lines}: {word}: this travel is left out"),
                    "name the robot, with all axes of the program (machine.robot); the simulation goes on at the next position, and times leave this travel out",
                ),
                "held-otherwise" => (
                    format!("{lines}: the robot holds {word} there: this travel is left out"),
                    "the simulation goes on at the next position that is told in the frames of the beads, and times leave this travel out",
                ),
                "arc-on-the-fly" => (
                    format!(
                        "{lines}: the arc changes at a point the tool does not stop at ({word})"
                    ),
                    "use FINE where beads start and end",
                ),
                "call-passed-over" => (format!("{lines}: calls of {word} are passed over"), ""),
                "travel-speed" => (
                    format!("{lines}: the speed {word} of a travel is not known"),
                    "times leave it open",
                ),
                "travel-smoothing" => (
                    format!("{lines}: how a travel ends ({word}) is not known"),
                    "times leave it open",
                ),
                "crater-not-told" => (
                    format!(
                        "{lines}: how long {word} stands on the crater is known to the controller only: no time is simulated"
                    ),
                    "tell it in the cell file: crater_time of [[program.schedule]], \"0 s\" where the crater is not filled",
                ),
                "tool-turns-slowly" => (
                    format!(
                        "{lines}: the tool may turn by {word} alone: this bead is laid more slowly than its speed says"
                    ),
                    "raise the limit (the second number of the speeddata, rmax of the movement descriptor), or let the torch turn less along the bead",
                ),
                "program-ends" => (
                    format!(
                        "{lines}: the program ends there, what stands behind it is not executed"
                    ),
                    "take the line out if the program is to go on",
                ),
                _ => (
                    format!("{lines}: {word} is kept, not executed, no metal is laid by it"),
                    "",
                ),
            };
            let place = Place {
                file: Some(told.program.clone()),
                line: Some(told.line),
                ..Place::default()
            };
            reporter.warn_at(code, message, place, remedy);
        }
    }
}
