//! `meltpath tune`: the control of a head's axes designed, compared and exported.
//!
//! Source: Rasoanarivo 2020, § 2.2.2 (cascade, step by step), § 2.2.3 (refinement by swarm), chapter 3 (H-infinity). Beyond it:
//! a controller that serves motors whose modes moved, and exported controllers judged as exported.

mod bode;
pub mod choose;
mod design;
mod export;
pub mod file;
mod present;
mod refinement;
pub mod settings;
mod tables;

use std::path::Path;

use meltpath_base::output::OutputFolder;
use meltpath_base::{Cancelled, Check, Limit, Measure, Observer, Reporter, Status, Verdict};
use meltpath_control::export::ExportError;
use meltpath_numerics::swarm::SwarmError;
use meltpath_perception::RecordError;
use meltpath_scan_head::axis::galvanometer::AxisError;
use meltpath_scan_head::servo::compare::ScatterError;
use meltpath_scan_head::servo::h_infinity::HinfError;
use meltpath_scan_head::servo::refine::RefineError;
use meltpath_scan_head::servo::robust::RobustError;
use meltpath_scan_head::servo::synthesis::ServoError;

use crate::job::JobError;
use crate::outcome::{Outcome, RunError};
use crate::waam::settings::in_file;
use design::AxisResult;
use settings::Settings;

/// Why an axis is not tuned.
#[derive(Debug, thiserror::Error)]
pub enum TuneError {
    /// One of its steps.
    #[error("{axis} axis, {step}: {source}")]
    Step {
        /// Which axis.
        axis: char,
        /// Which step.
        step: &'static str,
        /// Why.
        source: StepError,
    },
    /// The record of a refinement.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A record that was sampled otherwise than the head.
    #[error(
        "the record is sampled every {found:.4} µs, the head every {wanted:.4} µs: refine on a record at the head's rate"
    )]
    Sampling {
        /// The record's, µs.
        found: f64,
        /// The head's, µs.
        wanted: f64,
    },
    /// Stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Why a step of the tuning fails.
#[derive(Debug, thiserror::Error)]
pub enum StepError {
    /// The cascade.
    #[error(transparent)]
    Servo(#[from] ServoError),
    /// The refinement.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The H-infinity controller.
    #[error(transparent)]
    Hinf(#[from] HinfError),
    /// The search for a spread of motors.
    #[error(transparent)]
    Robust(#[from] RobustError),
    /// The comparison.
    #[error(transparent)]
    Axis(#[from] AxisError),
    /// The scattered motors.
    #[error(transparent)]
    Scatter(#[from] ScatterError),
    /// The export.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A linear system.
    #[error(transparent)]
    System(#[from] meltpath_control::SystemError),
}

impl StepError {
    /// Whether the person stopped it.
    fn cancelled(&self) -> Option<Cancelled> {
        match self {
            StepError::Refine(RefineError::Swarm(SwarmError::Cancelled(c)))
            | StepError::Robust(RobustError::Swarm(SwarmError::Cancelled(c)))
            | StepError::Scatter(ScatterError::Cancelled(c)) => Some(*c),
            _ => None,
        }
    }
}

/// The error of a step of an axis.
pub(crate) fn step<E: Into<StepError>>(
    axis: char,
    step: &'static str,
) -> impl FnOnce(E) -> TuneError {
    move |source| {
        let source = source.into();
        match source.cancelled() {
            Some(c) => TuneError::Cancelled(c),
            None => TuneError::Step { axis, step, source },
        }
    }
}

impl From<TuneError> for RunError {
    fn from(error: TuneError) -> Self {
        match error {
            TuneError::Cancelled(c) => RunError::Cancelled(c),
            other => RunError::Tune(other),
        }
    }
}

/// Tunes the axes that a file names: a new folder `out`, else the next free number in `runs`.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn tune(
    path: &Path,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Outcome, RunError> {
    let text = std::fs::read_to_string(path).map_err(|source| JobError::Io {
        path: path.to_path_buf(),
        source,
    })?;
    let here = path.parent().unwrap_or(Path::new(""));
    let settings = file::read(&text)
        .and_then(|file| settings::resolve(&file, here))
        .map_err(|e| in_file(path, &text, e))?;
    let folder = out.map_or_else(|| OutputFolder::create_numbered(runs), OutputFolder::create)?;
    let reporter = Reporter::new();
    let record = design::record(&settings, &reporter)?;
    let mut results: Vec<AxisResult> = Vec::new();
    for task in &settings.tasks {
        let twin = results.iter().find(|r| {
            let renamed = settings::AxisTask {
                name: task.name,
                ..r.task.clone()
            };
            renamed == *task
        });
        let result = match twin {
            Some(done) => AxisResult {
                task: task.clone(),
                ..done.clone()
            },
            None => design::design(task, &settings, record.as_deref(), &reporter, observer)?,
        };
        results.push(result);
    }
    let verdict = Verdict {
        checks: results.iter().flat_map(|r| checks(r, &settings)).collect(),
        warnings: reporter.digest(3),
    };
    let mut provenance = settings.provenance.clone();
    crate::outcome::record_inputs(&mut provenance, &[path])?;
    observer.stage("write results", 0);
    let name = title(path);
    present::write(&folder, &name, &settings, &results, &verdict, &provenance)?;
    export::write(&folder, &settings, &results)?;
    folder.write("tune.toml", |w| w.write_all(text.as_bytes()))?;
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// The run's name: the file's, or its folder's.
fn title(path: &Path) -> String {
    let plain = |p: Option<&std::ffi::OsStr>| p.map(|s| s.to_string_lossy().into_owned());
    plain(path.file_stem())
        .filter(|s| s != "tune")
        .or_else(|| plain(path.parent().and_then(Path::file_name)))
        .filter(|s| !s.is_empty())
        .unwrap_or_else(|| "axis tuning".to_owned())
}

fn checks(result: &AxisResult, settings: &Settings) -> Vec<Check> {
    let letter = result.task.name.letter();
    let upper = letter.to_ascii_uppercase();
    let mut checks = Vec::new();
    let wanted = result.task.targets.position.margin.to_degrees();
    if let Some(figures) = &result.position {
        checks.push(
            Check::judge(
                &format!("{letter}-margin"),
                &format!("{upper}: phase margin of the position loop after the synthesis"),
                Measure::exact(figures.crossover.value.to_degrees(), "deg"),
                // the bisection ends a hair on either side
                Limit::AtLeast(wanted - 0.01),
            )
            .remedy("a slower position loop, or a faster speed loop"),
        );
    }
    let chosen = result.chosen();
    if let Some(spread) = &settings.spread
        && let Some(least) = chosen.least_distance
    {
        checks.push(
            Check::judge(
                &format!("{letter}-mode"),
                &format!(
                    "{upper}: distance to the critical point of the exported controller, modes moved by ±{:.0} %",
                    100.0 * (1.0 - spread.mode_shifts[0])
                ),
                Measure::exact(least, ""),
                Limit::AtLeast(0.99 * spread.modulus_margin),
            )
            .remedy("export.controller = \"robust\", a lower bandwidth, or a smaller robust.mode_shift"),
        );
    }
    if settings.draws > 0 {
        checks.push(
            Check::judge(
                &format!("{letter}-scatter"),
                &format!(
                    "{upper}: of {} scattered motors those that the exported controller loses",
                    settings.draws
                ),
                Measure::exact(chosen.lost() as f64, ""),
                Limit::AtMost(0.0),
            )
            .remedy("export.controller = \"robust\", or a lower bandwidth"),
        );
    }
    match &result.as_exported {
        Some(exported) => checks.push(
            Check::judge(
                &format!("{letter}-export"),
                &format!("{upper}: error as exported over error as designed"),
                Measure::exact(exported.error.rms() / chosen.bare.error.rms(), ""),
                Limit::AtMost(1.05),
            )
            .remedy("a longer word, sections instead of state space, or a higher output limit"),
        ),
        None => checks.push(Check {
            status: Status::Pass,
            ..Check::not_checked(
                &format!("{letter}-export"),
                &format!("{upper}: exported"),
                "the cascade leaves as gains: nothing is rounded",
            )
        }),
    }
    checks
}
