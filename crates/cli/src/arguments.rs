//! The arguments, with the help that teaches them.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use clap_complete::Shell;
use meltpath::job::PartUnit;
use meltpath::list::Listing;
use meltpath::reference::Subject;
use meltpath_base::Length;

/// Plan the path, simulate the machine, predict the metal.
///
/// meltpath takes a part file and a short job file and gives a wire-arc deposition plan, the robot's program, what
/// the robot will really do with it, what the metal will look like, and a verdict. Jobs of laser scan heads and of
/// electron beams run too.
///
/// Start with:  meltpath new waam my-part    then    meltpath run my-part/job.toml
///
/// Exit codes: 0 the part passes, 1 the part fails its checks, 2 the input is wrong, 3 a bug in meltpath,
/// 4 nothing fails but a check cannot be decided or none of them was made, 130 interrupted (nothing is written then).
#[derive(Debug, Parser)]
#[command(name = "meltpath", version)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Number of threads; default all cores. Results do not depend on it.
    #[arg(long, global = true)]
    pub(crate) threads: Option<usize>,
    /// Print one JSON object instead of words: the verdict, where the report is, the exit code.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Print only what answers: what fails or cannot be said, and the verdict.
    #[arg(long, global = true, conflicts_with = "json")]
    pub(crate) quiet: bool,
    /// Open the report when it is written.
    #[arg(long, global = true)]
    pub(crate) open: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The whole chain: plan, program, machine, metal, verdict, report.
    Run {
        /// The job file.
        job: PathBuf,
        /// Folder to write, new; default the next free `<job>-runs/NNN` beside the job.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Plan only: slices the part and fills its layers; writes `toolpath.melt`.
    Plan {
        /// The job file.
        job: PathBuf,
        /// File to write, new; default `<job>-toolpath.melt` beside the job.
        #[arg(long)]
        out: Option<PathBuf>,
        /// Keep the defaults of what the job leaves out: quick, for the metal is not simulated. A run may choose others.
        #[arg(long)]
        as_written: bool,
    },
    /// Write the robot's program for a plan: all of it, from a bead on, or a copy without the arc for a dry run.
    Program {
        /// The job file that the plan was made with.
        job: PathBuf,
        /// The plan, as `meltpath plan` writes it.
        #[arg(long)]
        toolpath: PathBuf,
        /// Folder to write, new; default `<job>-program` beside the job.
        #[arg(long)]
        out: Option<PathBuf>,
        /// Begin with this layer: what lies under it is taken to stand.
        #[arg(long, value_name = "LAYER")]
        from_layer: Option<u32>,
        /// Begin with this bead of that layer, counted from 1.
        #[arg(long, value_name = "BEAD", requires = "from_layer")]
        from_bead: Option<u32>,
        /// Write a copy that moves without the arc, and without pauses.
        #[arg(long)]
        dry_run: bool,
    },
    /// Simulate a robot program or a 3MF toolpath: motion, metal and verdict. Those that other software wrote are welcome.
    Simulate {
        /// The main program (`.ls`); programs that it calls are looked for beside it. Or a toolpath of three or six axes (`.3mf`).
        program: PathBuf,
        /// The job that gives process, cell, part and limits; without it stated defaults are used and the part is not judged.
        #[arg(long)]
        job: Option<PathBuf>,
        /// Folder to write, new; default the next free `<program>-runs/NNN` beside the program.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Look into a file: a part (size, volume, faults and where), a program, a plan, a robot (joints, reach, frames, guesses).
    Inspect {
        /// STEP, STL, 3MF (with its toolpath), `.ls`, `.melt` file, or a robot: its `.toml` file, or the name of one that ships; a `.urdf` is told as a robot file.
        file: PathBuf,
        /// Unit of a part file that carries none: mm, cm, m, in.
        #[arg(long, default_value = "mm", value_parser = unit)]
        unit: PartUnit,
        /// Chord error of the mesh made of a STEP file.
        #[arg(long, default_value = "0.02 mm", value_parser = chord)]
        chord: Length,
        /// Of a robot: its reach as a picture, into this new file (PNG): where the wire's tip comes straight down, by how far the joints are from their limits.
        #[arg(long, value_name = "FILE")]
        picture: Option<PathBuf>,
    },
    /// List the names that a job may use, each with what it is and where it comes from.
    List {
        /// What: wires, gases, maps, pools, energies, cells, robots, materials, heads, recipes, guns, focus, examples.
        #[arg(value_parser = listing)]
        of: Listing,
    },
    /// Print completions for a shell.
    Completions {
        /// The shell.
        shell: Shell,
    },
    /// Write pages for `man`, one for each command, and the reference of job files and data files.
    Man {
        /// The folder to write them into.
        out: PathBuf,
    },
    /// Where on a robot's table a part can stand, or in its flange be held: a map of what the arm keeps from its limits, and the best place.
    Reach {
        /// STEP, STL or 3MF file.
        part: PathBuf,
        /// Unit of a part file that carries none: mm, cm, m, in.
        #[arg(long, default_value = "mm", value_parser = unit)]
        unit: PartUnit,
        /// The robot: the name of one that ships, or a TOML file.
        #[arg(long)]
        robot: String,
    },
    /// Start a new job: a folder with a commented job file and a part, that runs as it is.
    New {
        /// The process.
        #[command(subcommand)]
        process: NewProcess,
    },
    /// Find the parameters of a galvanometer from a bench record of voltage, current and angle, and test them on its last third.
    Identify {
        /// The record: `.csv`, `.parquet` or `.mat` (level 5); it begins at rest.
        record: PathBuf,
        /// The mapping: which column is "voltage", "current", "angle" (and "set-point", if the loop was closed), in which unit.
        #[arg(long)]
        mapping: PathBuf,
        /// A second record: ramps up and down at several speeds, for the friction.
        #[arg(long)]
        ramps: Option<PathBuf>,
        /// The mapping of the ramps, channels "current" and "angle"; default that of the first record.
        #[arg(long, requires = "ramps")]
        ramps_mapping: Option<PathBuf>,
    },
    /// Design the control of a scan head's axes: cascade step by step, H-infinity, a controller for motors that differ;
    /// compare them, export one.
    Tune {
        /// The tuning file; `head = "two-axis-150"` is enough.
        file: PathBuf,
        /// Folder to write, new; default the next free `<file>-runs/NNN` beside the file.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Compare a table of temperatures (x, y, z, t, T) with a run of an electron beam, or with another table; or a run's charts
    /// with the reference solver that judged it.
    Compare {
        /// A run's folder, or a `.csv` or `.parquet` table.
        against: PathBuf,
        /// The table: `.csv` or `.parquet`, columns x, y, z, t, T, or `T_max`, `time_molten`, solidified; without one the run's judge.
        table: Option<PathBuf>,
        /// Folder to write, new; default the next free `<table>-compare/NNN` beside the table, or beside the run.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Correct efficiency and beam diameter from struts, walls and pores that were built and measured.
    Fit {
        /// The measurements: a TOML file.
        measurements: PathBuf,
        /// Folder to write, new; default the next free `<measurements>-fit/NNN` beside the file.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Calibrate the focus of an electron gun from walls that were built with it: the beam's diameter over the focus current.
    Focus {
        /// The walls: a TOML file.
        walls: PathBuf,
        /// Folder to write, new; default the next free `<walls>-focus/NNN` beside the file.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Measure straight beads in a scan of a plate: width, height, section, how much of the wire is in them, and a process map. Or records
    /// of beads (voltage, current, wire feed): energy per volume, how the source answers to the contact tube distance, and files of both. Or
    /// a log of the tool along a path that was driven without arc: how the controller goes round corners, for the cell's `[motion]`.
    Measure {
        /// The file that names the scan or the records, and tells the settings of the beads; or the file that names the log and its path.
        file: PathBuf,
        /// Folder to write, new; default the next free `<file>-measured/NNN` beside the file.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Test the health of a scan head's axis (KM0): both stages, the history of dated tests, what drifted and what it may mean.
    Health(HealthArguments),
    /// Print the JSON Schema of a file: editors check and complete it with that.
    Schema {
        /// Which file: job, tune, measurements, walls, scan, records, motion-log, mapping, or a data file: wire, gas, map, pool, energy, circuit, cell, robot, material, head, motor, recipe, gun, focus.
        #[arg(value_parser = subject)]
        of: Subject,
    },
    /// Print every value of a job with where it comes from, and what is wrong, before anything runs; exits with 2 where `run`
    /// would refuse the job.
    Doctor {
        /// The job file.
        job: PathBuf,
    },
}

/// The arguments of `meltpath health`.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("bench").required(true).args(["records", "simulate", "signal"])))]
pub(crate) struct HealthArguments {
    /// Records of the first and the second stage: `.csv`, `.parquet` or `.mat` (level 5).
    #[arg(num_args = 2, requires = "mapping", value_names = ["STAGE1", "STAGE2"])]
    pub(crate) records: Vec<PathBuf>,
    /// Test the head's own data instead of records.
    #[arg(long)]
    pub(crate) simulate: bool,
    /// Write the signals of both stages into this new folder, to be played by the machine, and test nothing.
    #[arg(long)]
    pub(crate) signal: Option<PathBuf>,
    /// The scan head: a name in data/scan-heads, or a file.
    #[arg(long)]
    pub(crate) head: String,
    /// The axis: x, y or z.
    #[arg(long)]
    pub(crate) axis: String,
    /// The machine, as you name it in the history.
    #[arg(long, default_value = "machine")]
    pub(crate) machine: String,
    /// The mapping of both records: which column is "voltage", "current", "angle", "set-point", in which unit.
    #[arg(long)]
    pub(crate) mapping: Option<PathBuf>,
    /// Folder of the history; reports go into it too.
    #[arg(long, default_value = "health")]
    pub(crate) history: PathBuf,
    /// Change the simulated axis: NAME=FACTOR, as often as wanted (coulomb=2, resistance=1.3, mode=0.9, …).
    #[arg(long, requires = "simulate", value_name = "NAME=FACTOR")]
    pub(crate) change: Vec<String>,
    /// Temperature at the test, °C.
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) temperature: Option<f64>,
    /// When the test was made, ISO 8601; default now.
    #[arg(long)]
    pub(crate) time: Option<String>,
    /// Compare later tests with this one: after an intervention.
    #[arg(long)]
    pub(crate) accept: bool,
}

/// The file of a word.
fn subject(word: &str) -> Result<Subject, String> {
    Subject::from_word(word).ok_or_else(|| {
        let words = Subject::ALL.map(Subject::word);
        format!("known are {}", words.join(", "))
    })
}

/// What a word lists.
fn listing(word: &str) -> Result<Listing, String> {
    Listing::from_word(word).ok_or_else(|| {
        let words = Listing::ALL.map(Listing::word);
        format!("known are {}", words.join(", "))
    })
}

/// The unit of a word.
fn unit(word: &str) -> Result<PartUnit, String> {
    PartUnit::from_word(word).ok_or_else(|| {
        let words = PartUnit::ALL.map(PartUnit::word);
        format!("known are {}", words.join(", "))
    })
}

/// A chord error with its unit.
fn chord(text: &str) -> Result<Length, String> {
    let length = Length::parse(text).map_err(|e| e.to_string())?;
    if (CHORDS.0..=CHORDS.1).contains(&length.0) {
        Ok(length)
    } else {
        Err(format!("it must be {} to {} mm", CHORDS.0, CHORDS.1))
    }
}

/// Least and greatest chord error, mm, as in jobs.
const CHORDS: (f64, f64) = (1e-4, 10.0);

/// The processes of `meltpath new`.
#[derive(Debug, Subcommand)]
pub(crate) enum NewProcess {
    /// Laser powder bed: recipes of a scan head.
    Lpbf {
        /// Name of the folder to make.
        name: PathBuf,
    },
    /// Wire and arc by robot.
    Waam {
        /// Name of the folder to make.
        name: PathBuf,
        /// The part to start with.
        #[arg(long, default_value = "ring")]
        shape: String,
        /// The wire, one with a process map; gas, mode and bead are those of its map. Default: that of the template.
        #[arg(long)]
        wire: Option<String>,
    },
    /// Electron beam over powder.
    Ebm {
        /// Name of the folder to make.
        name: PathBuf,
    },
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use clap::CommandFactory;

    use super::*;

    /// The command that prints what a file says, where its messages name none.
    const PRINTS: &[(&str, &str)] = &[
        ("waam/foreign.rs", "simulate"),
        ("waam/foreign/doubts.rs", "simulate"),
        ("meltpath/src/health.rs", "health"),
        ("meltpath/src/health/checks.rs", "health"),
    ];

    fn files(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                files(&path, found);
            } else if path
                .extension()
                .is_some_and(|e| ["rs", "md", "toml"].iter().any(|known| e == *known))
            {
                found.push(path);
            }
        }
    }

    fn knows(command: &clap::Command, option: &str) -> bool {
        let own = |c: &clap::Command| c.get_arguments().any(|a| a.get_long() == Some(option));
        own(command) || command.get_subcommands().any(|c| knows(c, option))
    }

    /// Whether an option that follows a command's name, or stands where no command is named, is one of its own.
    #[test]
    fn commands_and_options_that_texts_name_exist() {
        let mut all = Arguments::command();
        all.build();
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut paths = vec![root.join("README.md")];
        files(&root.join("docs"), &mut paths);
        for room in fs::read_dir(root.join("crates")).unwrap() {
            files(&room.unwrap().path().join("src"), &mut paths);
        }
        let (mut commands, mut options) = (0, 0);
        for path in paths {
            let is_code = path.extension().is_some_and(|e| e == "rs");
            let text = fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]").next().unwrap();
            let printed = PRINTS.iter().find(|(file, _)| path.ends_with(file));
            let mut said = printed.map(|(_, by)| all.find_subcommand(by).unwrap());
            let ours = |line: &&str| {
                let other = is_code && line.trim_start().starts_with("//");
                // another program's command line
                !other
                    && !["cargo ", "ci/", "python", "-- --"]
                        .iter()
                        .any(|o| line.contains(o))
            };
            for line in text.lines().filter(ours) {
                let mut before = "";
                for word in line.split(|c: char| !(c.is_ascii_lowercase() || "-:`/._".contains(c)))
                {
                    let told = || format!("{}: {word}: {line}", path.display());
                    if let Some(option) = word.trim_matches(['`', '.']).strip_prefix("--")
                        && option.starts_with(|c: char| c.is_ascii_lowercase())
                        && !option.ends_with(':')
                    {
                        options += 1;
                        assert!(said.is_some() || !is_code, "who prints it? {}", told());
                        assert!(knows(said.unwrap_or(&all), option), "{}", told());
                    }
                    let name = word.trim_matches(['`', ':', '.']);
                    if before.trim_start_matches('`') == "meltpath" {
                        let found = all.find_subcommand(name);
                        commands += usize::from(found.is_some());
                        assert!(found.is_some() || !before.starts_with('`'), "{}", told());
                        said = found.or(said);
                    } else if let Some(inner) = said.and_then(|c| c.find_subcommand(name)) {
                        said = Some(inner);
                    }
                    before = word;
                }
            }
        }
        assert!(commands > 30 && options > 20, "{commands} {options}");
    }
}
