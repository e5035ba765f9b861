//! The chain from a job file to a folder of results.

use std::path::Path;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Check, Limit, Measure, Observer, Reporter, Status, Verdict};
use meltpath_geometry::math::DVec2;
use meltpath_machine::scan_head::contour_error::PathErrors;
use meltpath_machine::scan_head::delays::{DelayTuning, HitRecord, Tuned};
use meltpath_machine::scan_head::fill_rate::{FillMode, FillRate};
use meltpath_machine::scan_head::head::{HeadBlock, HeadError, HeadSink, ReadyHead};
use meltpath_machine::scan_head::job::{LaserDelays, Recipe, ScanJob};
use meltpath_machine::scan_head::plate::SquarePlate;

use super::present;
use super::settings::{self, Settings};
use crate::job::LpbfJob;
use crate::waam::settings::in_file;
use crate::waam::{Outcome, RunError};

/// The modes in which fill rates are told.
pub(super) const MODES: [FillMode; 3] = [
    FillMode::SampledPoints { every: 1 },
    FillMode::Segments,
    FillMode::SweptSpot,
];
/// Lit points are compared with marks commanded at most this long before, s: longer than any lag and off-delay.
const WINDOW: f64 = 4e-3;
/// The longest delay tried by the tuning, s.
const LONGEST_DELAY: f64 = 1.2e-3;
/// Samples kept of the path of the first square, at most.
const SHOWN: usize = 400_000;

/// What one recipe did.
pub(super) struct RecipeResult<'a> {
    pub(super) recipe: &'a Recipe,
    pub(super) job: &'a ScanJob,
    pub(super) delays: LaserDelays,
    pub(super) tuned: Option<Tuned>,
    pub(super) duration: f64,
    pub(super) errors: PathErrors<'a>,
    /// Mean rate over the squares, in each of [`MODES`].
    pub(super) fill: Vec<f64>,
    pub(super) path: Path2d,
}

/// The path of the first square: point hit, whether lit, vector.
#[derive(Debug, Default)]
pub(super) struct Path2d {
    pub(super) hits: Vec<DVec2>,
    pub(super) lit: Vec<bool>,
    pub(super) vectors: Vec<u32>,
    last: u32,
}

impl HeadSink for Path2d {
    fn block(&mut self, block: &HeadBlock) {
        for (k, &vector) in block.command.vector.iter().enumerate() {
            if vector <= self.last && self.hits.len() < SHOWN {
                self.hits.push(block.hit[k]);
                self.lit.push(block.lit[k] >= 0.5);
                self.vectors.push(vector);
            }
        }
    }
}

/// The whole chain: a new folder `out`, else the next free number in `runs`.
///
/// # Errors
/// [`RunError`]; nothing is written then.
pub fn run(
    path: &Path,
    job: &LpbfJob,
    text: &str,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<Outcome, RunError> {
    let reporter = Reporter::new();
    let here = path.parent().unwrap_or(Path::new(""));
    let settings = settings::resolve(job, here).map_err(|e| in_file(path, text, e))?;
    let folder = out.map_or_else(|| OutputFolder::create_numbered(runs), OutputFolder::create)?;
    for letter in &settings.foreign {
        reporter.warn(
            "controller-other-motor",
            format!(
                "the controller of the {} axis was made for another motor than the head's",
                letter.to_ascii_uppercase()
            ),
            "tune on the head's own motor",
        );
    }
    let mut head = settings.data.head.ready()?;
    if let Some(previews) = crate::tune::choose::previews(&settings.data.head, settings.path)? {
        head = head.with_previews(previews);
    }
    let mut jobs = Vec::with_capacity(settings.recipes.len());
    for recipe in &settings.recipes {
        jobs.push(settings.plate.job(recipe).map_err(HeadError::from)?);
    }
    let mut results = Vec::with_capacity(jobs.len());
    for (recipe, job) in settings.recipes.iter().zip(&jobs) {
        results.push(execute(&head, &settings, recipe, job, &reporter, observer)?);
    }
    let verdict = Verdict {
        checks: checks(&settings, &results),
        warnings: reporter.digest(3),
    };
    let mut provenance = settings.provenance.clone();
    crate::waam::run::record_inputs(&mut provenance, &[path])?;
    observer.stage("write results", 0);
    let title = present::title(path);
    present::write(&folder, &title, &settings, &results, &verdict, &provenance)?;
    folder.write("job.toml", |w| w.write_all(text.as_bytes()))?;
    observer.check()?;
    Ok(Outcome {
        folder: commit(folder)?,
        verdict,
    })
}

fn commit(folder: OutputFolder) -> Result<std::path::PathBuf, OutputError> {
    folder.commit()
}

fn execute<'a>(
    head: &ReadyHead,
    settings: &'a Settings,
    recipe: &'a Recipe,
    job: &'a ScanJob,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<RecipeResult<'a>, RunError> {
    let spot = 2.0 * head.head().beam.waist;
    let period = head.head().period;
    let tuned = match settings.delays {
        crate::job::lpbf::DelayChoice::Recipe => None,
        crate::job::lpbf::DelayChoice::Tuned => {
            let two = SquarePlate {
                columns: 2,
                rows: 1,
                ..settings.plate
            };
            let job = two.job(recipe).map_err(HeadError::from)?;
            let mut record = HitRecord::default();
            head.run(&job, recipe.delays, 1, observer, &mut record)?;
            Some(DelayTuning::new(&job, &record.hits, period, LONGEST_DELAY, 0.5 * spot).tune())
        }
    };
    let delays = tuned.as_ref().map_or(recipe.delays, |t| t.best.delays);
    if let Some(t) = &tuned
        && t.best.delays.on.max(t.best.delays.off) > LONGEST_DELAY - 2.0 * period
    {
        reporter.warn(
            "delays-long",
            format!(
                "{}: the tuned laser delays reach the longest tried, {:.0} µs",
                recipe.name,
                LONGEST_DELAY * 1e6
            ),
            "longer waits after marks and jumps let the axes settle",
        );
    }
    let first_square = job
        .vectors
        .iter()
        .take_while(|v| v.block == 0)
        .count()
        .saturating_sub(1);
    let mut sinks = (
        PathErrors::new(job, WINDOW, period),
        (
            FillRate::new(job, &settings.plate, spot, &MODES),
            Path2d {
                last: first_square as u32,
                ..Path2d::default()
            },
        ),
    );
    let summary = head.run(job, delays, 1, observer, &mut sinks)?;
    let (errors, (fill, path)) = sinks;
    let rates = fill.finish();
    let fill = (0..MODES.len())
        .map(|m| rates.iter().map(|r| r[m]).sum::<f64>() / rates.len() as f64)
        .collect();
    Ok(RecipeResult {
        recipe,
        job,
        delays,
        tuned,
        duration: summary.duration,
        errors,
        fill,
        path,
    })
}

fn checks(settings: &Settings, results: &[RecipeResult<'_>]) -> Vec<Check> {
    let mut checks = Vec::new();
    for (k, r) in results.iter().enumerate() {
        let number = k + 1;
        let below = 100.0 * r.errors.contour.share_below(settings.contour_error);
        checks.push(
            Check::judge(
                &format!("contour-{number}"),
                &format!(
                    "{}: contour points within {:.0} µm",
                    r.recipe.name,
                    1e3 * settings.contour_error
                ),
                Measure::exact(below, "%"),
                Limit::AtLeast(100.0 * settings.contour_share),
            )
            .at(meltpath_base::Place::at(
                r.errors.worst.extend(0.0).to_array(),
            ))
            .remedy("slower contours, a shorter pre-filter, or a controller that rejects friction"),
        );
        let rate = 100.0 * r.fill[2];
        let title = format!("{}: fill rate, {}", r.recipe.name, MODES[2].words());
        let id = format!("fill-{number}");
        checks.push(match settings.fill_rate {
            Some(limit) => Check::judge(
                &id,
                &title,
                Measure::exact(rate, "%"),
                Limit::AtLeast(100.0 * limit),
            )
            .remedy("a closer hatch, or other laser delays"),
            None => Check {
                status: Status::Pass,
                value: Some(Measure::exact(rate, "%")),
                ..Check::not_checked(&id, &title, &format!("{rate:.1} %; no limit was asked for"))
            },
        });
    }
    checks.push(Check::not_checked(
        "melt-pool",
        "fusion of the powder",
        "no melt pool is modelled by this version: fast recipes may not melt well",
    ));
    checks
}

/// What the job leaves to defaults: every resolved value with its origin.
///
/// # Errors
/// [`RunError`].
pub fn doctor(job_file: &Path, job: &LpbfJob, text: &str) -> Result<Vec<String>, RunError> {
    let here = job_file.parent().unwrap_or(Path::new(""));
    let settings = settings::resolve(job, here).map_err(|e| in_file(job_file, text, e))?;
    Ok(crate::waam::run::parameter_lines(&settings.provenance))
}
