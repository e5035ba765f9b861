//! What a command leaves: a folder with its verdict, or the reason why not; and what every run writes of itself.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::container::ContainerError;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Cancelled, Provenance, Verdict, Warning};
use meltpath_geometry::workpiece::WorkpieceError;
use meltpath_scan_head::head::error::HeadError;
use meltpath_thermal::pool::fusion::FusionError;

use crate::job::JobError;
use crate::lpbf::heat::HeatError;
use crate::stages::part::PartError;
use crate::start::StartError;
use crate::waam::plan::PlanStageError;
use crate::waam::program::ProgramStageError;
use crate::waam::simulate::SimulateError;
use crate::waam::target::TargetError;

/// What a run made.
#[derive(Debug)]
pub struct Outcome {
    /// The folder.
    pub folder: PathBuf,
    /// The verdict.
    pub verdict: Verdict,
}

/// What a process says of a job that it can run.
#[derive(Debug, Clone)]
pub struct Examined {
    /// Every value with its origin.
    pub provenance: Provenance,
    /// What it will cost and where its data come from.
    pub notes: Vec<String>,
    /// What should be known though it runs.
    pub warnings: Vec<Warning>,
}

/// Why a command could not be done. Everything here is the input's or the system's doing; nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(Cancelled),
    /// The job file.
    #[error(transparent)]
    Job(#[from] JobError),
    /// A bench record.
    #[error(transparent)]
    Identify(#[from] crate::identify::IdentifyError),
    /// A comparison.
    #[error(transparent)]
    Compare(#[from] crate::compare::CompareError),
    /// A fit.
    #[error(transparent)]
    Fit(#[from] crate::fit::FitCommandError),
    /// A health test.
    #[error(transparent)]
    Health(#[from] crate::health::HealthError),
    /// An electron-beam job.
    #[error(transparent)]
    Ebm(#[from] crate::ebm::EbmError),
    /// The part.
    #[error(transparent)]
    Part(PartError),
    /// The plan.
    #[error(transparent)]
    Plan(PlanStageError),
    /// The program.
    #[error(transparent)]
    Program(#[from] ProgramStageError),
    /// The simulation.
    #[error(transparent)]
    Simulate(SimulateError),
    /// The comparison with the part.
    #[error("cannot compare with the part: {0}")]
    Target(TargetError),
    /// The height map.
    #[error(transparent)]
    Workpiece(#[from] WorkpieceError),
    /// A native file.
    #[error("cannot use {}: {source}", .path.display())]
    Container {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ContainerError,
    },
    /// Output.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The scan head.
    #[error(transparent)]
    ScanHead(HeadError),
    /// What the laser melts.
    #[error("cannot tell what the laser melts: {0}")]
    Heat(HeatError),
    /// A tuning of axes.
    #[error(transparent)]
    Tune(crate::tune::TuneError),
    /// A new job.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A file to inspect.
    #[error("{0}")]
    Inspect(String),
}

/// Turns a stage's cancellation into the run's.
macro_rules! cancellable {
    ($error:ty, $variant:ident, $($cancelled:pat => $inner:expr),+) => {
        impl From<$error> for RunError {
            fn from(error: $error) -> Self {
                match error {
                    $($cancelled => RunError::Cancelled($inner),)+
                    other => RunError::$variant(other),
                }
            }
        }
    };
}
cancellable!(PartError, Part, PartError::Cancelled(c) => c);
cancellable!(PlanStageError, Plan,
    PlanStageError::Cancelled(c) => c,
    PlanStageError::Slice(meltpath_geometry::section::SliceError::Cancelled(c)) => c,
    PlanStageError::Overhang(meltpath_geometry::overhang::OverhangError::Cancelled(c)) => c,
    PlanStageError::Fill(meltpath_planning::PlanError::Cancelled(c)) => c);
cancellable!(SimulateError, Simulate, SimulateError::Motion(meltpath_robot::interpolation::fir::MotionError::Cancelled(c)) => c);
cancellable!(HeadError, ScanHead, HeadError::Cancelled(c) => c);
cancellable!(HeatError, Heat, HeatError::Fusion(FusionError::Cancelled(c)) => c);
cancellable!(TargetError, Target,
    TargetError::Cancelled(c) => c,
    TargetError::Slice(meltpath_geometry::section::SliceError::Cancelled(c)) => c);

impl From<Cancelled> for RunError {
    fn from(c: Cancelled) -> Self {
        RunError::Cancelled(c)
    }
}

pub(crate) fn json(
    folder: &OutputFolder,
    name: &str,
    value: &serde_json::Value,
) -> Result<(), OutputError> {
    folder.write(name, |w| {
        serde_json::to_writer_pretty(&mut *w, value)?;
        w.write_all(b"\n")
    })
}

pub(crate) fn record_inputs(provenance: &mut Provenance, files: &[&Path]) -> Result<(), RunError> {
    for path in files {
        let failed = |source| JobError::Io {
            path: path.to_path_buf(),
            source,
        };
        let mut reader = BufReader::new(File::open(path).map_err(failed)?);
        let hash = meltpath_base::provenance::sha256(&mut reader).map_err(failed)?;
        let name = path
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        provenance.inputs.insert(name, hash);
    }
    Ok(())
}

/// A warning with what to do about it.
pub(crate) fn warning_line(warning: &Warning) -> String {
    let remedy = warning.remedy.iter().map(|r| format!("; {r}"));
    format!("note: {}{}", warning.message, remedy.collect::<String>())
}
