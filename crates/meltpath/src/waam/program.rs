//! The robot's program: written, read back, and executed as commands for the machine model.
//!
//! The simulation starts from what was read back, rounding included.

pub(crate) mod by_joints;
mod carried;
pub(crate) mod files;
mod no_bead;
pub(crate) mod to_folder;
pub(crate) mod toolpath_file;
pub mod wanted;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use meltpath_base::{Cancelled, Place, Ratio, Reporter};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_programs::program::Instruction;
use meltpath_programs::toolpath_3mf::{ToolpathFileError, ToolpathFileWriteError};
use meltpath_programs::{
    BuildError, BuildSettings, Built, CellProgramming, Control, Dialect, Gap, ParseError, Pause,
    Program, ProgramError, Schedule, TextFile, Way, WeldSettings, WriteError, build, dialect,
    read_toolpath,
};
use meltpath_robot::cell::Stance;
use meltpath_robot::collision::Clearance;
use meltpath_robot::command::{Command, Kind, Smoothing, Source};
use meltpath_robot::driven::Driven;
use meltpath_robot::joint_move::JointMove;
use meltpath_robot::pacing::Pacing;
use meltpath_robot::posture::{Change, NotHeld};
use meltpath_robot::travel::LeastTime;
use meltpath_toolpath::{Channel, Event, Move, Pass, Toolpath, Weave};

use super::settings::Settings;
use crate::job::waam::LayerRelease;
use crate::waam::drive::arm_way::ArmWay;
use crate::waam::drive::division::Division;
use crate::waam::drive::said_frames::{Elsewhere, elsewhere};
use crate::waam::drive::slope::{Slope, slope};
use crate::waam::drive::unsure::{self, Unsure};
pub use crate::waam::program::carried::Axes;
use crate::waam::program::carried::{external, turns};
use crate::waam::program::wanted::{Asked, Torch};

/// Why there is no program, or why it cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ProgramStageError {
    /// The toolpath cannot become a program.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The program cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// Programs of one of several dialects cannot be written.
    #[error(
        "the programs for {dialect} cannot be written: {source}; or leave \"{dialect}\" out of output.programs"
    )]
    Dialect {
        /// The dialect, as jobs call it.
        dialect: &'static str,
        /// Why.
        source: Box<ProgramStageError>,
    },
    /// A program cannot be read.
    #[error("cannot read the program {}: {source}", .path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        source: ParseError,
    },
    /// A program file cannot be opened.
    #[error("cannot open the program {}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A 3MF toolpath cannot be written.
    #[error(transparent)]
    WriteToolpath(#[from] ToolpathFileWriteError),
    /// A 3MF toolpath cannot be read.
    #[error("cannot read the toolpath {}: {source}", .path.display())]
    ReadToolpath {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        source: ToolpathFileError,
    },
    /// A writer is at fault.
    #[error(
        "the programs do not read back as they were written, or do not lay what the plan does: this is a fault of the program writer; please report it with the job"
    )]
    Unfaithful,
    /// A folder without a single main program.
    #[error(
        "the folder {} has no single main program, one that no other calls: {}; name the file to begin with",
        .path.display(), if .found.is_empty() { "there is none".to_owned() } else { .found.join(", ") }
    )]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The programs that no other calls.
        found: Vec<String>,
    },
    /// The person stopped it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The program cannot be run.
    #[error("cannot run the program: {0}")]
    Execute(#[from] ProgramError),
    /// The program never burns the arc.
    #[error("the program {} never starts the arc: there is no metal to predict; a job that names its robot (machine.robot) has the arm's way judged", .0)]
    NoArc(String),
    /// The program burns the arc where it stands, and nowhere else.
    #[error(
        "the program {} starts the arc and moves nowhere with it: what an arc lays that only stands is not simulated", .0
    )]
    NoMove(String),
    /// No move of a bead is known here.
    #[error(
        "the program {name} lays no bead that is known here: {}", no_bead::reasons(.gaps)
    )]
    NoBead {
        /// The program.
        name: String,
        /// The lines that were not simulated.
        gaps: Vec<Gap>,
    },
}

impl ProgramStageError {
    /// The same of programs of a dialect, which is named where a job asks for several.
    pub(in crate::waam) fn of(self, dialect: Dialect, asked: &[Dialect]) -> Self {
        match self {
            why if asked.len() > 1 && !matches!(why, ProgramStageError::Cancelled(_)) => {
                ProgramStageError::Dialect {
                    dialect: dialect.word(),
                    source: Box::new(why),
                }
            }
            why => why,
        }
    }
}

/// The programs of a plan.
#[derive(Debug, Clone)]
pub struct Programs {
    /// The files, main program first.
    pub files: Vec<TextFile>,
    /// The same programs, read back from the text of the files.
    pub parsed: Vec<Program>,
    /// Weld schedules that the operator sets.
    pub schedules: Vec<Schedule>,
    /// Whether each file, read and written again, gives itself.
    pub stable: bool,
    /// What was chosen of the robot's way.
    pub chosen: Chosen,
}

/// What was chosen of the robot's way along a program, beside what its positions say.
#[derive(Debug, Clone, Default)]
pub struct Chosen {
    /// How track and positioner move with it, where they were free.
    pub external: Option<Axes>,
    /// Whether the way keeps clear of what stands around; nothing where none was chosen.
    pub clearance: Option<Clearance>,
    /// The way, for programs of the same moves in other words.
    pub way: Option<Arc<ArmWay>>,
    /// How the arm stands at the start, and at the ends of joint moves: what its way follows from.
    pub stands: BTreeMap<Option<u32>, Stance>,
    /// How it stands along the whole of the way, one after the other.
    pub stances: Vec<Stance>,
    /// Travels on which the arm goes over to another way.
    pub over: Vec<Change>,
    /// Where beads are to be divided first; a way is not chosen then.
    pub divisions: Vec<Division>,
    /// Where no way leads on, and why; a way is not chosen then.
    pub not_held: Option<NotHeld>,
}

impl Programs {
    /// What they command, with track and positioner as they were chosen where the programs do not say it.
    ///
    /// # Errors
    /// As [`commands`].
    pub(super) fn commands(
        &self,
        settings: &Settings,
        reporter: &Reporter,
    ) -> Result<Commands, ProgramStageError> {
        let mut commands = commands(&self.parsed, &self.schedules, settings, reporter)?;
        let chosen = self.chosen.external.clone();
        commands.external = commands.external.or(chosen);
        commands.clearance = self.chosen.clearance;
        commands.stands.clone_from(&self.chosen.stands);
        commands.over.clone_from(&self.chosen.over);
        commands.not_held = self.chosen.not_held;
        Ok(commands)
    }
}

/// Makes the programs of a toolpath.
///
/// # Errors
/// [`ProgramStageError`].
pub fn make(
    name: &str,
    toolpath: &Toolpath,
    (dialect, wanted): Asked,
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Built, ProgramStageError> {
    let pause = match (wanted.torch, settings.until) {
        (Torch::Burns, LayerRelease::Cooled) => Pause::Cooled(settings.pause),
        (Torch::Burns, LayerRelease::Pause) if settings.pause > 0.0 => Pause::Wait(settings.pause),
        (Torch::Dry, _) | (Torch::Burns, LayerRelease::Pause) => Pause::None,
    };
    let build_settings = BuildSettings {
        name: name.to_owned(),
        comment: "meltpath".to_owned(),
        dialect,
        smoothing: Ratio(settings.smoothing),
        pause,
        from: wanted.from,
        variant: wanted.variant(),
        standing: settings.robot.as_ref().and_then(by_joints::standing),
    };
    let cell = &settings.cell.program;
    Ok(build(toolpath, cell, &build_settings, reporter)?)
}

/// Writes programs and reads them back.
///
/// # Errors
/// [`ProgramStageError`].
pub fn write(built: Built, cell: &CellProgramming) -> Result<Programs, ProgramStageError> {
    let mut programs = Programs {
        files: Vec::new(),
        parsed: Vec::new(),
        schedules: built.schedules,
        stable: true,
        chosen: Chosen::default(),
    };
    for program in &built.programs {
        let files = dialect::write(program, cell)?;
        let bytes = |i: usize| files.get(i).map(|f| f.text.as_bytes());
        let read = dialect::read(
            program.dialect,
            bytes(0).unwrap_or_default(),
            bytes(1),
            cell,
        );
        let parsed = read.map_err(|source| ProgramStageError::Parse {
            path: PathBuf::from(files.first().map_or("", |f| &f.name)),
            source,
        })?;
        let [parsed] = &parsed[..] else {
            programs.stable = false;
            continue;
        };
        let kept = kept(&parsed.program) == kept(program);
        programs.stable &= kept && dialect::write(&parsed.program, cell)? == files;
        programs.files.extend(files);
        programs.parsed.push(parsed.program.clone());
    }
    Ok(programs)
}

/// The dialect of programs, the first of which is the main one.
pub(super) fn spoken(programs: &[Program]) -> Dialect {
    programs.first().map_or(Dialect::FanucLs, |p| p.dialect)
}

/// Whether a program strikes an arc.
pub(super) fn burns(program: &Program) -> bool {
    program.instructions.iter().any(|i| match i {
        Instruction::Arc(_) => true,
        Instruction::Motion(motion) => motion.arc.is_some(),
        _ => false,
    })
}

/// How many lines of a program are kept verbatim.
fn kept(program: &Program) -> usize {
    let raw = |i: &&Instruction| matches!(i, Instruction::Raw(_));
    program.instructions.iter().filter(raw).count()
}

/// Commands for the machine model, with what they mean.
#[derive(Debug, Clone)]
pub struct Commands {
    /// Where the tool stands at first.
    pub start: Pose,
    /// The commands, numbered by their position.
    pub commands: Vec<Command>,
    /// The layer of each command, from 1; 0 for none, as of programs that lay nothing.
    pub layer_of_command: Vec<u32>,
    /// The bead of each command, counted from 1 in its layer; `None` on travels.
    pub bead_of_command: Vec<Option<u32>>,
    /// The weave of each command, in [`Commands::weaves`] from 1; 0 for none.
    pub weave_of_command: Vec<u32>,
    /// The weaves.
    pub weaves: Vec<Weave>,
    /// Length driven with the arc on, mm.
    pub arc_length: f64,
    /// Program, from 0, and instruction, from 1, of each command.
    pub line_of_command: Vec<(u32, u32)>,
    /// Those of the start.
    pub start_line: (u32, u32),
    /// A positioner turns the part while metal is laid.
    pub turns: bool,
    /// Where track and positioner of the job's robot stand, where the program says it, or what was chosen with it.
    pub external: Option<Axes>,
    /// Whether the way that was chosen keeps clear of what stands around; nothing where none was chosen.
    pub clearance: Option<Clearance>,
    /// How the arm stands at the start and at the ends of joint moves, as it was chosen; it counts where the program does not say it.
    pub stands: BTreeMap<Option<u32>, Stance>,
    /// Travels on which the arm goes over to another way, as it was chosen.
    pub over: Vec<Change>,
    /// Where no way leads on, as it was looked for, and why.
    pub not_held: Option<NotHeld>,
    /// Beads that were divided, as no way of the arm holds them as a whole.
    pub divided: Vec<Division>,
    /// Travels that take longer than they are programmed, as an axis goes no faster: their speeds are set so.
    pub slowed: Vec<Slowed>,
    /// Joint moves whose axes are known at both ends, in order: their commands say how they look.
    pub joint_moves: Vec<JointMove>,
    /// The axes of the job's robot along the motion, and the pace that they leave it; nothing where they were not followed.
    pub driven: Option<Driven>,
    /// Where the program says that part and torch lie, if that is elsewhere than in the robot's file.
    pub(in crate::waam) elsewhere: Vec<Elsewhere>,
    /// How far from level the program has the part, where no robot's file places it.
    pub(in crate::waam) slope: Option<Slope>,
    /// What else leaves open where the arm goes.
    pub(in crate::waam) unsure: Vec<Unsure>,
    /// Beads are told in the robot's own frame, and the cell file's is another.
    pub(in crate::waam) in_own_frame: bool,
    /// Lines that shape metal and were not simulated.
    pub gaps: Vec<Gap>,
}

/// A travel that an axis makes longer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slowed {
    /// The travel.
    pub command: u32,
    /// The least time that the axes take, and the slowest of them.
    pub least: LeastTime,
    /// What it would take the tool alone, s.
    pub programmed: f64,
}

/// Share of a bead's width within which it may gain its speed: metal does not show it there. A rule of our own.
const UNSEEN: f64 = 0.1;

/// Where every axis keeps up.
static OWN_PACE: Pacing = Pacing::OWN;

impl Commands {
    /// Whether the arc burns anywhere.
    fn burns(&self) -> bool {
        let mut all = self.commands.iter();
        all.any(|c| matches!(c.source, Source::On { .. }))
    }

    /// Whether they lay metal.
    pub(super) fn lays(&self) -> bool {
        self.arc_length > 0.0
    }

    /// The pace at which the motion is driven.
    pub(super) fn pacing(&self) -> &Pacing {
        self.driven.as_ref().map_or(&OWN_PACE, |d| &d.pacing)
    }

    /// A place along a command.
    pub(super) fn place(&self, command: u32, position: DVec3) -> Place {
        let i = command as usize;
        Place {
            position: Some(position.to_array()),
            layer: self.layer_of_command.get(i).copied().filter(|l| *l > 0),
            bead: self.bead_of_command.get(i).copied().flatten(),
            ..Place::default()
        }
    }

    /// Counts heights from `height` mm of the user frame on.
    pub fn lower(&mut self, height: f64) {
        self.start.position.z -= height;
        for command in &mut self.commands {
            command.target.z -= height;
            if let Kind::Arc { via } = &mut command.kind {
                via.z -= height;
            }
        }
    }
}

/// Executes programs as the controller would; `schedules` are those that were written with the programs, beside those of the
/// cell. What is not known is told as [`Commands::gaps`], and the job's bead stands in for it.
///
/// # Errors
/// [`ProgramStageError`] where the programs cannot be run without the controller, or never burn the arc.
pub fn commands(
    programs: &[Program],
    schedules: &[Schedule],
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Commands, ProgramStageError> {
    let moves = moves(programs, schedules, settings, reporter)?;
    if moves.lays() {
        Ok(moves)
    } else {
        Err(no_bead(programs, (moves.burns(), moves.gaps)))
    }
}

/// The same of programs whose arc stays off, too, where the job's robot can be followed along them.
///
/// # Errors
/// [`ProgramStageError`] where the programs cannot be run without the controller, or nothing can be said of them.
pub(in crate::waam) fn commands_or_moves(
    programs: &[Program],
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Commands, ProgramStageError> {
    let mut moves = moves(programs, &[], settings, reporter)?;
    let stays_off = !moves.burns() && moves.gaps.is_empty();
    if !moves.lays() {
        if !stays_off || settings.robot.is_none() {
            return Err(no_bead(programs, (moves.burns(), moves.gaps)));
        }
        // layers are those of what is laid
        moves.layer_of_command.fill(0);
    }
    Ok(moves)
}

/// What programs command, with or without arc.
fn moves(
    programs: &[Program],
    schedules: &[Schedule],
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Commands, ProgramStageError> {
    let mut known = settings.cell.program.execution(settings.bead.travel_speed);
    let of_cell = known.schedules.clone();
    known.schedules.extend(schedules.iter().map(|s| {
        let mut listed = of_cell
            .iter()
            .filter(|((_, number), _)| *number == s.number);
        let set = WeldSettings {
            wire_feed: s.wire_feed,
            speed: None,
            // a program of one's own fills no crater but by its schedule
            crater: listed.find_map(|(_, set)| set.crater).or(Some(0.0)),
        };
        ((None, s.number), set)
    }));
    known.unseen_way = UNSEEN * settings.bead.width.value;
    if let Some(cell) = &settings.robot {
        known.turning = by_joints::turning(cell);
    }
    known.by_joints = by_joints::poses(programs, &known, settings);
    known.register_poses = by_joints::registers(programs, &known, settings);
    let joint_speed = settings.controller.joint_speed.value.0;
    let reading = read_toolpath(programs, &known, joint_speed, reporter)?;
    let external = external(&reading.toolpath, settings);
    let mut unsure = unsure::of(programs, &reading, settings, reporter);
    if external.is_none() {
        unsure.extend(unsure::of_axes(programs, &reading, settings));
    }
    let in_own_frame = unsure::in_own_frame(programs, &reading, settings);
    let toolpath = &reading.toolpath;
    let arc_length = toolpath.deposited_length();
    let start = toolpath.passes().next().map(|pass| tool(&pass, 0));
    let Some(start) = start else {
        return Err(no_bead(programs, (false, reading.gaps)));
    };
    let count = reading.controls.len();
    let mut commands: Vec<Command> = Vec::with_capacity(count);
    let mut layer_of_command = Vec::with_capacity(count);
    let mut bead_of_command = Vec::with_capacity(count);
    let mut beads = BTreeMap::<u32, u32>::new();
    let mut weave_of_command = Vec::with_capacity(count);
    let line_of_command = reading.controls.iter().map(|c| (c.program, c.line));
    let line_of_command = line_of_command.collect();
    let mut controls = reading.controls.iter();
    for pass in toolpath.passes() {
        let bead = pass.head.role.deposits().then(|| {
            let laid = beads.entry(pass.layer).or_default();
            *laid += 1;
            *laid
        });
        let mut events = pass.events().peekable();
        let mut weave = 0;
        for (i, control) in (0..pass.move_count()).zip(controls.by_ref()) {
            while let Some((_, event)) = events.next_if(|(point, _)| *point <= i) {
                let Event::Weave(number) = event;
                weave = number;
            }
            let id = commands.len() as u32;
            commands.push(command(id, &pass, i, *control, settings));
            layer_of_command.push(pass.layer);
            bead_of_command.push(bead);
            weave_of_command.push(weave);
        }
    }
    Ok(Commands {
        start,
        commands,
        layer_of_command,
        bead_of_command,
        weave_of_command,
        line_of_command,
        start_line: reading.start_line,
        turns: turns(toolpath, known.slides),
        external,
        weaves: reading.toolpath.weaves,
        clearance: None,
        stands: BTreeMap::new(),
        over: Vec::new(),
        not_held: None,
        divided: Vec::new(),
        slowed: Vec::new(),
        joint_moves: Vec::new(),
        driven: None,
        elsewhere: elsewhere(programs, &reading.controls, settings),
        slope: slope(programs, &reading.controls, settings),
        unsure,
        in_own_frame,
        arc_length,
        gaps: reading.gaps,
    })
}

/// How the tool stands at point `i` of a pass that was read.
pub(crate) fn tool(pass: &Pass<'_>, i: usize) -> Pose {
    // a reading says axis and turn of every point
    let (axis, turn) = (
        pass.axis(i).unwrap_or(DVec3::Z),
        pass.turn(i).unwrap_or(0.0),
    );
    Pose::of_tool(pass.points[i], axis, turn)
}

/// The command of move `i` of a pass.
fn command(id: u32, pass: &Pass<'_>, i: usize, control: Control, settings: &Settings) -> Command {
    let programmed = pass.value(Channel::WireFeed, i);
    let wire_feed = settings.feed_factor() * programmed.unwrap_or(settings.bead.wire_feed);
    let source = if pass.head.role.deposits() {
        Source::On { wire_feed }
    } else {
        Source::Off
    };
    driven(id, pass, i, control, source)
}

/// The command of move `i` of a pass, with what the source does.
pub(crate) fn driven(
    id: u32,
    pass: &Pass<'_>,
    i: usize,
    control: Control,
    source: Source,
) -> Command {
    let kind = match (pass.move_at(i), control.way) {
        (Move::Spot { time }, _) => Kind::Wait { time },
        (Move::Arc { via }, _) => Kind::Arc { via },
        (Move::Line, Way::Joint) => Kind::Joint(None),
        (Move::Line, Way::Path) => Kind::Line,
    };
    let to = tool(pass, i + 1);
    Command {
        id,
        kind,
        target: to.position,
        orientation: to.orientation,
        // waits have none
        speed: pass.value(Channel::Speed, i).unwrap_or(1.0),
        smoothing: control.smoothing.map_or(Smoothing::Fine, Smoothing::Cnt),
        source,
    }
}

/// Why programs lay no metal.
fn no_bead(programs: &[Program], (stands, gaps): (bool, Vec<Gap>)) -> ProgramStageError {
    let name = programs.first().map(|p| p.name.clone()).unwrap_or_default();
    match (gaps.is_empty(), stands) {
        (false, _) => ProgramStageError::NoBead { name, gaps },
        (true, true) => ProgramStageError::NoMove(name),
        (true, false) => ProgramStageError::NoArc(name),
    }
}
