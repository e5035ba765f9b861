//! The robot's program: written, read back, and executed as commands for the machine model.
//!
//! The simulation starts from what was read back, rounding included.

use std::path::{Path, PathBuf};

use meltpath_base::{Ratio, Reporter};
use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_programs::fanuc_ls::{self, ParseError, WriteError};
use meltpath_programs::program::Instruction;
use meltpath_programs::{
    BuildError, BuildSettings, Built, Executed, ExecutedKind, ExecutedSpeed, Gap, Pause, Program,
    ProgramError, Schedule, WeldSettings, build, execution_order,
};
use meltpath_robot::command::{Command, Kind, Smoothing, Source};
use meltpath_toolpath::Toolpath;

use super::settings::Settings;
use super::simulate::layers_by_height;

/// Why there is no program, or why it cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum ProgramStageError {
    /// The toolpath cannot become a program.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The program cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
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
    /// The program cannot be run.
    #[error("cannot run the program: {0}")]
    Execute(#[from] ProgramError),
    /// The program never burns the arc.
    #[error("the program {} never starts the arc: there is no metal to predict", .0)]
    NoArc(String),
    /// No move of a bead is known here.
    #[error(
        "the program {name} lays no bead that is known here, first at {}, line {}, \"{}\": {}; {}",
        .gap.program, .gap.line, .gap.text, .gap.why, .gap.why.remedy()
    )]
    NoBead {
        /// The program.
        name: String,
        /// The first line that was not simulated.
        gap: Box<Gap>,
    },
}

/// A program as a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramFile {
    /// File name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// The programs of a plan.
#[derive(Debug, Clone)]
pub struct Programs {
    /// The files, main program first.
    pub files: Vec<ProgramFile>,
    /// The same programs, read back from the text of the files.
    pub parsed: Vec<Program>,
    /// Weld schedules that the operator sets.
    pub schedules: Vec<Schedule>,
    /// Whether each file, read and written again, gives itself.
    pub stable: bool,
}

/// Makes the programs of a toolpath.
///
/// # Errors
/// [`ProgramStageError`].
pub fn make(
    name: &str,
    toolpath: &Toolpath,
    settings: &Settings,
    reporter: &Reporter,
) -> Result<Built, ProgramStageError> {
    let pause = if settings.pause > 0.0 {
        Pause::Wait(settings.pause)
    } else {
        Pause::None
    };
    let build_settings = BuildSettings {
        name: name.to_owned(),
        comment: "meltpath".to_owned(),
        smoothing: Ratio(settings.smoothing),
        pause,
    };
    let cell = &settings.cell.program;
    Ok(build(toolpath, cell, &build_settings, reporter)?)
}

/// Writes programs and reads them back.
///
/// # Errors
/// [`ProgramStageError`].
pub fn write(built: Built) -> Result<Programs, ProgramStageError> {
    let mut programs = Programs {
        files: Vec::new(),
        parsed: Vec::new(),
        schedules: built.schedules,
        stable: true,
    };
    for program in &built.programs {
        let text = fanuc_ls::write(program)?;
        let path = PathBuf::from(format!("{}.LS", program.name));
        let parsed = fanuc_ls::parse(&text).map_err(|source| ProgramStageError::Parse {
            path: path.clone(),
            source,
        })?;
        programs.stable &= parsed.unread.is_empty() && fanuc_ls::write(&parsed.program)? == text;
        programs.files.push(ProgramFile {
            name: path.display().to_string(),
            text,
        });
        programs.parsed.push(parsed.program);
    }
    Ok(programs)
}

/// Reads a main program and the programs that it calls, which lie beside it.
///
/// Sections that nothing here models are kept, and listed as warnings; lines are classed when the program is executed.
///
/// # Errors
/// [`ProgramStageError`].
pub fn read(main: &Path, reporter: &Reporter) -> Result<Vec<Program>, ProgramStageError> {
    let mut programs = Vec::new();
    let mut waiting = vec![main.to_path_buf()];
    while let Some(path) = waiting.pop() {
        let bytes = std::fs::read(&path).map_err(|source| ProgramStageError::Io {
            path: path.clone(),
            source,
        })?;
        let parsed = fanuc_ls::read(&bytes).map_err(|source| ProgramStageError::Parse {
            path: path.clone(),
            source,
        })?;
        let instruction = |line: &u32| parsed.lines.binary_search(line).is_ok();
        for unread in parsed.unread.iter().filter(|u| !instruction(&u.line)) {
            let place = meltpath_base::Place {
                file: Some(path.display().to_string()),
                line: Some(unread.line),
                ..meltpath_base::Place::default()
            };
            reporter.warn_at(
                "program-line-kept",
                format!(
                    "\"{}\" stands outside the instructions and is kept, not executed",
                    unread.text.trim()
                ),
                place,
                "",
            );
        }
        for called in calls(&parsed.program) {
            let known = programs
                .iter()
                .any(|p: &Program| p.name.eq_ignore_ascii_case(called));
            if !known
                && let Some(beside) = find_beside(&path, called)
                && !waiting.contains(&beside)
            {
                waiting.push(beside);
            }
        }
        programs.push(parsed.program);
    }
    Ok(programs)
}

/// The programs that a program calls.
fn calls(program: &Program) -> impl Iterator<Item = &str> {
    program.instructions.iter().filter_map(|i| match i {
        Instruction::Call { program, .. } => Some(program.as_str()),
        _ => None,
    })
}

/// The file of program `name` beside `path`, whatever the case of its name.
fn find_beside(path: &Path, name: &str) -> Option<PathBuf> {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let wanted = format!("{name}.ls");
    std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .map(|e| e.path())
        .find(|p| {
            p.file_name()
                .is_some_and(|n| n.to_string_lossy().eq_ignore_ascii_case(&wanted))
        })
}

/// Commands for the machine model, with what they mean.
#[derive(Debug, Clone)]
pub struct Commands {
    /// Where the tool stands at first.
    pub start: Pose,
    /// The commands, numbered by their position.
    pub commands: Vec<Command>,
    /// The layer of each command, from 1.
    pub layer_of_command: Vec<u32>,
    /// The pass of each command, where the program tells it.
    pub pass_of_command: Vec<Option<u32>>,
    /// Length driven with the arc on, mm.
    pub arc_length: f64,
    /// Program, from 0, and instruction, from 1, of each command.
    pub line_of_command: Vec<(u32, u32)>,
    /// Those of the start.
    pub start_line: (u32, u32),
    /// Lines that shape metal and were not simulated.
    pub gaps: Vec<Gap>,
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
    let bead = &settings.bead;
    let mut known = settings.cell.program.execution(bead.travel_speed);
    known.schedules.extend(schedules.iter().map(|s| {
        let set = WeldSettings {
            wire_feed: s.wire_feed,
            speed: None,
        };
        (s.number, set)
    }));
    let executed = execution_order(programs, &known, reporter)?;
    let name = programs.first().map_or("", |p| &p.name);
    let joint_speed = settings.cell.motion.joint_speed.value.0;
    let factor = settings.feed_factor();
    let source = |arc: Option<u32>| match arc {
        None => Source::Off,
        Some(schedule) => {
            let set = executed.schedules.get(&schedule);
            let programmed = set.map_or(bead.wire_feed, |s| s.wire_feed);
            Source::On {
                wire_feed: factor * programmed,
            }
        }
    };
    let mut start = None;
    let mut here = Pose {
        position: DVec3::ZERO,
        orientation: DQuat::IDENTITY,
    };
    let mut commands: Vec<Command> = Vec::with_capacity(executed.steps.len());
    let mut layers = Vec::with_capacity(executed.steps.len());
    let mut passes = Vec::with_capacity(executed.steps.len());
    let mut lines = Vec::with_capacity(executed.steps.len());
    let mut start_line = (0, 0);
    let mut arc_length = 0.0;
    for step in &executed.steps {
        let id = commands.len() as u32;
        match *step {
            Executed::Wait {
                time,
                arc,
                program,
                line,
            } => {
                lines.push((program, line));
                commands.push(Command {
                    kind: Kind::Wait { time },
                    source: source(arc),
                    ..Command::line(id, here.position, 1.0, Smoothing::Fine)
                });
                if let Some(last) = commands.last_mut() {
                    last.orientation = here.orientation;
                }
                layers.push(None);
                passes.push(None);
            }
            Executed::Motion(m) => {
                if start.is_none() {
                    // where the robot comes from is not in the program: it starts at its first position
                    start = Some(m.target);
                    start_line = (m.program, m.line);
                    here = m.target;
                    continue;
                }
                let kind = match m.kind {
                    ExecutedKind::Joint => Kind::Joint,
                    ExecutedKind::Linear => Kind::Line,
                    ExecutedKind::Circular { via } => Kind::Arc { via },
                };
                let length = length(kind, here.position, m.target.position);
                if m.arc.is_some() {
                    arc_length += length;
                }
                commands.push(Command {
                    id,
                    kind,
                    target: m.target.position,
                    orientation: m.target.orientation,
                    speed: path_speed(m.speed, length, joint_speed),
                    smoothing: m.smoothing.map_or(Smoothing::Fine, Smoothing::Cnt),
                    source: source(m.arc),
                });
                layers.push(m.layer.filter(|_| m.arc.is_some()));
                passes.push(m.pass);
                lines.push((m.program, m.line));
                here = m.target;
            }
        }
    }
    if arc_length <= 0.0 {
        let name = name.to_owned();
        return Err(match executed.gaps.into_iter().next() {
            Some(gap) => ProgramStageError::NoBead {
                name,
                gap: Box::new(gap),
            },
            None => ProgramStageError::NoArc(name),
        });
    }
    let known = told_or_by_height(layers, &commands);
    let layer_of_command = carried(&known);
    Ok(Commands {
        start: start.unwrap_or(here),
        commands,
        layer_of_command,
        pass_of_command: passes,
        line_of_command: lines,
        start_line,
        arc_length,
        gaps: executed.gaps,
    })
}

/// Speed along a move of `length` mm, mm/s.
fn path_speed(speed: ExecutedSpeed, length: f64, joint_speed: f64) -> f64 {
    match speed {
        ExecutedSpeed::Path(v) => v,
        ExecutedSpeed::Joint(share) => share * joint_speed,
        ExecutedSpeed::Duration(t) if length > 0.0 => length / t,
        // a pure rotation: its path speed has no meaning, the machine model times the rotation itself
        ExecutedSpeed::Duration(_) | ExecutedSpeed::Rotation(_) => joint_speed,
    }
}

/// Length of a move, mm.
fn length(kind: Kind, from: DVec3, to: DVec3) -> f64 {
    let arc = match kind {
        Kind::Arc { via } => Arc::through(from, via, to),
        _ => None,
    };
    arc.map_or_else(|| from.distance(to), |a| a.length())
}

/// The layer of each command as comments tell it; by height where they leave one out that lays metal.
fn told_or_by_height(layers: Vec<Option<u32>>, commands: &[Command]) -> Vec<Option<u32>> {
    let told = commands.iter().zip(&layers).all(|(c, l)| {
        l.is_some() || matches!(c.source, Source::Off) || matches!(c.kind, Kind::Wait { .. })
    });
    if told {
        return layers;
    }
    let (by_height, _) = layers_by_height(commands);
    let some = |l: u32| (l > 0).then_some(l);
    by_height.into_iter().map(some).collect()
}

/// Travels and waits belong to the layer that was worked on last, those before the first bead to its layer: an arc that
/// is struck or ends during one of them must find its layer.
fn carried(known: &[Option<u32>]) -> Vec<u32> {
    let mut layer = known.iter().flatten().copied().next().unwrap_or(1);
    known
        .iter()
        .map(|l| {
            layer = l.unwrap_or(layer);
            layer
        })
        .collect()
}
