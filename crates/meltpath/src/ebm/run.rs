//! From an electron-beam job to a folder of results.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use meltpath_base::{Observer, Reporter, Verdict};
use meltpath_melt_strategy::interrupted::Kept;
use meltpath_thermal::charts::file as chart_file;

use super::cost;
use super::error::EbmError;
use super::gun::drawn::foretold;
use super::judge::{facts, verdict};
use super::plan::{Plan, planned};
use super::simulate::simulate;
use crate::job::{EbmJob, JobError, Written};
use crate::machine::Machine;
use crate::outcome::{self, Examined, RunFolder};
use crate::views;

/// Layers that took less are drawn again: writing one takes some hundredths of drawing it.
const KEPT_EVERY: Duration = Duration::from_secs(1);

fn plan_of(
    job_file: &Path,
    job: &Written<EbmJob>,
    text: &str,
    observer: &dyn Observer,
) -> Result<Plan, EbmError> {
    let folder = job_file.parent().unwrap_or(Path::new(""));
    let reporter = Reporter::new();
    let possible = |mut plan: Plan| {
        cost::settle_search(&mut plan, job, &reporter);
        cost::refused::check(&plan, Machine::here(), &reporter)?;
        Ok(plan)
    };
    let plan = planned(job, folder, observer).and_then(possible);
    let mut plan = plan.map_err(|e| match observer.check() {
        // whatever reading the part says of it, the job is not to blame
        Err(cancelled) => EbmError::from(cancelled),
        Ok(()) => JobError::in_file(job_file, text, e).into(),
    })?;
    plan.warnings.extend(reporter.warnings());
    Ok(plan)
}

/// Runs a job.
///
/// # Errors
/// [`EbmError`]; nothing is written then.
pub fn run(
    job_file: &Path,
    job: &Written<EbmJob>,
    text: &str,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<outcome::Outcome, EbmError> {
    let reporter = Reporter::new();
    let mut plan = plan_of(job_file, job, text, observer)?;
    let kept = Arc::new(Kept::new(&home.interrupted(), KEPT_EVERY));
    plan.kept = Some(kept.clone());
    let settings = &plan.settings;
    let folder = home.create()?;
    plan.warnings.iter().for_each(|w| reporter.push(w.clone()));
    let outcome = simulate(&plan, &reporter, observer).inspect_err(|_| {
        if kept.holds() {
            observer.note("the layers drawn so far are kept: the same command goes on from them");
        }
    })?;
    tell_kept(&kept, observer);
    let verdict = Verdict {
        checks: verdict::checks(&plan, &outcome),
        facts: facts::facts(&plan, &outcome),
        warnings: reporter.warnings(),
    };
    let mut provenance = settings.provenance.clone();
    if outcome.preview.is_some() {
        provenance.model(
            "charts and chart simulation",
            "Béraud 2016, sections 3.2.1 to 3.2.3, corrected; heat by finite volumes in enthalpy",
        );
    }
    if outcome.judged.is_some() {
        provenance.model(
            "judge",
            "solver for whole layers: finite volumes in enthalpy on levels of cells, explicit; laws of Béraud 2016, section 3.2.2.1; vapour of each component by Hertz, Knudsen and Clausius-Clapeyron, against the chamber's gas by Knight 1979; a pool of conduction up to where recoil passes surface tension",
        );
    }
    provenance.model("criteria", "Béraud 2016, section 3.3.2.1");
    outcome::record_inputs(&mut provenance, &[job_file])?;
    let own = settings.subject.file().into_iter();
    for file in own.chain(settings.material_file.as_deref()) {
        outcome::record_inputs(&mut provenance, &[file])?;
    }
    observer.stage("write results", 0);
    observer.check()?;
    let title = job_file.parent().and_then(Path::file_name).map_or_else(
        || "electron beam".to_owned(),
        |n| n.to_string_lossy().into_owned(),
    );
    let report = views::ebm::report(&title, &plan, &outcome, &verdict, &provenance);
    outcome::tell(&folder, &report)?;
    crate::inputs::write(&folder, job_file, text, &[])?;
    views::ebm::write_files(&folder, &plan, &outcome)?;
    let charts = outcome.preview.iter().flat_map(|p| &p.charts);
    for (n, set) in charts.enumerate() {
        folder.write(&format!("charts/{}.melt", n + 1), |mut w| {
            chart_file::write(set, &mut w)
        })?;
    }
    let folder = folder.commit()?;
    kept.clear();
    Ok(outcome::Outcome { folder, verdict })
}

/// Says what was not drawn anew, and what would have to be.
fn tell_kept(kept: &Kept, observer: &dyn Observer) {
    let layers = kept.layers();
    if layers > 0 {
        observer.note(&format!(
            "{layers} layers, of all drawings of the solver together, are those that an interrupted run of this job had drawn"
        ));
    }
    if let Some(why) = kept.trouble() {
        observer.note(&format!(
            "layers are not kept for the case that the run is interrupted: {why}"
        ));
    }
}

/// What is resolved in a job, what it costs, and what it warns of.
///
/// # Errors
/// [`EbmError`] for whatever a run refuses before it computes.
pub fn examine(
    job_file: &Path,
    job: &Written<EbmJob>,
    text: &str,
    observer: &dyn Observer,
) -> Result<Examined, EbmError> {
    let plan = plan_of(job_file, job, text, observer)?;
    let reporter = Reporter::new();
    let mut notes = cost::lines(&plan, &reporter)?;
    notes.extend(foretold(&plan));
    let mut warnings = plan.warnings;
    warnings.extend(reporter.warnings());
    Ok(Examined {
        provenance: plan.settings.provenance,
        notes,
        warnings,
    })
}
