//! The arguments, with the help that teaches them.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

/// Plan the path, simulate the machine, predict the metal.
///
/// meltpath takes a part file and a short job file and gives a wire-arc deposition plan, the robot's program, what
/// the robot will really do with it, what the metal will look like, and a verdict. Jobs of laser scan heads and of
/// electron beams run too.
///
/// Start with:  meltpath new waam my-part    then    meltpath run my-part/job.toml
///
/// Exit codes: 0 the part passes, 1 the part fails its checks, 2 the input is wrong, 3 a bug in meltpath,
/// 130 interrupted (nothing is written then).
#[derive(Debug, Parser)]
#[command(name = "meltpath", version, verbatim_doc_comment)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Number of threads; default all cores. Results do not depend on it.
    #[arg(long, global = true)]
    pub(crate) threads: Option<usize>,
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
    },
    /// Write the robot's program for a plan.
    Program {
        /// The job file that the plan was made with.
        job: PathBuf,
        /// The plan, as `meltpath plan` writes it.
        #[arg(long)]
        toolpath: PathBuf,
        /// Folder to write, new; default `<job>-program` beside the job.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Simulate a robot program: motion, metal and verdict. Programs that other software wrote are welcome.
    Simulate {
        /// The main program (`.ls`); programs that it calls are looked for beside it.
        program: PathBuf,
        /// The job that gives process, cell, part and limits; without it stated defaults are used and the part is not judged.
        #[arg(long)]
        job: Option<PathBuf>,
        /// Folder to write, new; default the next free `<program>-runs/NNN` beside the program.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Look into a file: a part (size, volume, faults and where), a program, a plan.
    Inspect {
        /// STEP, STL, 3MF, `.ls` or `.melt` file.
        file: PathBuf,
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
    /// Say what is missing, defaulted or inconsistent in a job, before anything runs.
    Doctor {
        /// The job file.
        job: PathBuf,
    },
}

/// The processes of `meltpath new`.
#[derive(Debug, Subcommand)]
pub(crate) enum NewProcess {
    /// Wire and arc by robot.
    Waam {
        /// Name of the folder to make.
        name: PathBuf,
        /// The part to start with.
        #[arg(long, default_value = "ring")]
        shape: String,
    },
}
