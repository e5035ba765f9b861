//! What mends a plan that is expected to fail: other settings, tried one at a time on the same part, each planned, driven and judged as the
//! job's own.

use std::path::Path;

use meltpath_base::{Check, Length, Observer, Quiet, Ratio, Reporter};
use rayon::prelude::*;

use super::error::WaamError;
use super::foretell::foretell;
use super::planned::planned;
use super::settings::resolve;
use crate::job::waam::{FillOrder, FillStrategy, Spacing};
use crate::job::{WaamJob, Written};
use crate::stages::part::Part;

/// Settings as a job writes them, and what writes them.
type Change = (&'static str, fn(&mut WaamJob));

/// Those that are tried, the gentlest first: other ways to fill, then corners that are cut less, which takes longer, then more metal.
const CHANGES: [Change; 10] = [
    ("fill.order = \"outside-in\"", |job| {
        job.fill.value.order.value = Some(FillOrder::OutsideIn);
    }),
    ("fill.strategy = \"zigzag\"", |job| {
        job.fill.value.strategy.value = FillStrategy::Zigzag;
    }),
    ("fill.strategy = \"hybrid\"", |job| {
        job.fill.value.strategy.value = FillStrategy::Hybrid;
    }),
    ("fill.strategy = \"contour\"", |job| {
        job.fill.value.strategy.value = FillStrategy::Contour;
    }),
    ("fill.strategy = \"raster\"", |job| {
        job.fill.value.strategy.value = FillStrategy::Raster;
    }),
    ("fill.spacing = \"exact\"", |job| {
        job.fill.value.spacing.value = Spacing::Exact;
    }),
    ("machine.smoothing = \"25 %\"", |job| {
        job.machine.value.smoothing.value = Ratio(0.25);
    }),
    ("machine.smoothing = \"0 %\"", |job| {
        job.machine.value.smoothing.value = Ratio(0.0);
    }),
    ("target.allowance = \"3 mm\"", allow),
    // beads whose distance is kept leave up to one of them out at a flank
    (
        "fill.spacing = \"exact\" and target.allowance = \"3 mm\"",
        |job| {
            job.fill.value.spacing.value = Spacing::Exact;
            allow(job);
        },
    ),
];

/// Three millimetres round the part, where it has less.
fn allow(job: &mut WaamJob) {
    let now = job.target.allowance.0;
    job.target.value.allowance.value = Length(now.max(3.0));
}

/// Tells which other setting leaves nothing that is expected to fail, else the one that leaves least of what is now, `foretold`.
///
/// # Errors
/// [`WaamError`] when cancelled; a setting with which nothing can be planned mends nothing.
pub(super) fn mend(
    (name, folder): (&str, &Path),
    job: &Written<WaamJob>,
    part: &Part,
    foretold: &[Check],
    observer: &dyn Observer,
) -> Result<String, WaamError> {
    observer.stage("try other settings", CHANGES.len() as u64);
    let tried: Vec<(&str, Vec<Check>)> = CHANGES
        .par_iter()
        .filter_map(|(words, change)| {
            let mut other = job.clone();
            change(&mut other.tables);
            let quiet = (Reporter::new(), Quiet(observer));
            let left = (other.tables != job.tables && observer.check().is_ok())
                .then(|| left((name, folder), &other, part, (&quiet.0, &quiet.1)));
            observer.advance(1);
            Some((*words, left?.ok()?))
        })
        .collect();
    observer.check()?;
    let best = tried.iter().min_by_key(|(_, left)| left.len());
    Ok(match best {
        Some((words, left)) if left.is_empty() => {
            format!("foretold: with {words} no check is expected to fail")
        }
        Some((words, left)) if left.len() < foretold.len() => {
            let ids: Vec<&str> = left.iter().map(|c| c.id.as_str()).collect();
            format!(
                "foretold: of {} other settings, tried one at a time, {words} leaves least: {}",
                tried.len(),
                ids.join(", ")
            )
        }
        _ => format!(
            "foretold: none of {} other settings, tried one at a time, mends any of it",
            tried.len()
        ),
    })
}

/// What is expected to fail with a job.
fn left(
    (name, folder): (&str, &Path),
    job: &Written<WaamJob>,
    part: &Part,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Vec<Check>, WaamError> {
    let settings =
        resolve(job, folder, reporter).map_err(|e| crate::job::JobError::in_file(folder, "", e))?;
    let planned = planned(name, part, &settings, reporter, observer)?;
    foretell(part, &planned.plan, &planned.commands, &settings, observer)
}
