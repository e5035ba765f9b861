//! From an electron-beam job to a folder of results.

use std::fs::File;
use std::path::Path;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{
    Cancelled, Check, Fact, Limit, Measure, Observer, Place, Reporter, Status, Verdict,
};
use meltpath_melt_strategy::judgement::Variant;
use meltpath_report::html::{ReportError, write_html};
use meltpath_thermal::charts::file as chart_file;
use meltpath_thermal::criteria::{Class, Tally};
use meltpath_thermal::grid::Field;

use super::cost;
use super::error::EbmError;
use super::judge::JudgedPath;
use super::plan::{Plan, planned};
use super::settings::Settings;
use super::simulate::{Outcome, simulate};
use crate::job::{EbmJob, JobError, Written};
use crate::outcome::{self, Examined};
use crate::views;

fn plan_of(
    job_file: &Path,
    job: &Written<EbmJob>,
    text: &str,
    observer: &dyn Observer,
) -> Result<Plan, EbmError> {
    let folder = job_file.parent().unwrap_or(Path::new(""));
    planned(job, folder, observer).map_err(|e| match observer.check() {
        // whatever reading the part says of it, the job is not to blame
        Err(cancelled) => EbmError::Cancelled(cancelled),
        Ok(()) => EbmError::Job(JobError::in_file(job_file, text, e)),
    })
}

/// Runs a job: a new folder `out`, else the next free number in `runs`.
///
/// # Errors
/// [`EbmError`]; nothing is written then.
pub fn run(
    job_file: &Path,
    job: &Written<EbmJob>,
    text: &str,
    out: Option<&Path>,
    runs: &Path,
    observer: &dyn Observer,
) -> Result<outcome::Outcome, EbmError> {
    let reporter = Reporter::new();
    let plan = plan_of(job_file, job, text, observer)?;
    let settings = &plan.settings;
    let folder = out.map_or_else(|| OutputFolder::create_numbered(runs), OutputFolder::create)?;
    plan.warnings.iter().for_each(|w| reporter.push(w.clone()));
    let outcome = simulate(&plan, &reporter, observer)?;
    let verdict = Verdict {
        checks: checks(settings, &outcome),
        facts: facts(&outcome),
        warnings: reporter.warnings(),
    };
    let mut provenance = settings.provenance.clone();
    provenance.model(
        "charts and chart simulation",
        "Béraud 2016, sections 3.2.1 to 3.2.3, corrected; heat by finite volumes in enthalpy",
    );
    if outcome.judged.is_some() {
        provenance.model(
            "judge",
            "reference solver: finite volumes in enthalpy, explicit; laws and domain of Béraud 2016, section 3.2.2.1",
        );
    }
    provenance.model("criteria", "Béraud 2016, section 3.3.2.1");
    outcome::record_inputs(&mut provenance, &[job_file])?;
    let own = settings.subject.file().into_iter();
    for file in own.chain(settings.material_file.as_deref()) {
        outcome::record_inputs(&mut provenance, &[file])?;
    }
    observer.stage("write results", 0);
    observer
        .check()
        .map_err(|c: Cancelled| EbmError::Cancelled(c))?;
    let title = job_file.parent().and_then(Path::file_name).map_or_else(
        || "electron beam".to_owned(),
        |n| n.to_string_lossy().into_owned(),
    );
    let report = views::ebm::report(&title, &plan, &outcome, &verdict, &provenance);
    folder.write("report.html", |w| {
        write_html(w, &report).map_err(|e| match e {
            ReportError::Io(e) => e,
            ReportError::Scene(e) => std::io::Error::other(e),
        })
    })?;
    json(&folder, "verdict.json", &verdict.to_json())?;
    json(
        &folder,
        "provenance.json",
        &serde_json::to_value(&provenance).unwrap_or_default(),
    )?;
    folder.write("job.toml", |w| w.write_all(text.as_bytes()))?;
    if let Some(part) = plan.part.as_ref().map(|p| &p.file) {
        folder.write(&part_copy(part), |w| {
            std::io::copy(&mut File::open(part)?, w).map(drop)
        })?;
    }
    if let Some(file) = &settings.material_file {
        folder.write(MATERIAL_COPY, |w| {
            std::io::copy(&mut File::open(file)?, w).map(drop)
        })?;
    }
    views::ebm::write_files(&folder, &plan, &outcome)?;
    for (n, set) in outcome.charts.iter().enumerate() {
        folder.write(&format!("charts/{}.melt", n + 1), |mut w| {
            chart_file::write(set, &mut w)
        })?;
    }
    Ok(outcome::Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

fn json(folder: &OutputFolder, name: &str, value: &serde_json::Value) -> Result<(), OutputError> {
    folder.write(name, |w| {
        serde_json::to_writer_pretty(&mut *w, value)?;
        w.write_all(b"\n")
    })
}

/// The name of the user's own material in the folder of a run.
pub(crate) const MATERIAL_COPY: &str = "material.toml";

/// The name of a part in the folder of a run, so that the run can be drawn again without anything outside.
pub(crate) fn part_copy(file: &Path) -> String {
    let extension = file.extension().unwrap_or_default().to_string_lossy();
    format!("part.{}", extension.to_lowercase())
}

/// What is judged: of the path with better speeds where there is one.
fn checks(settings: &Settings, outcome: &Outcome) -> Vec<Check> {
    let (_, tally) = last(outcome);
    let percent = |share: f64| Measure::exact(100.0 * share, "%");
    let remedy =
        "change speed, power, distance or order of lines; or let [optimise] change the speeds";
    let title = "molten voxels of the region whose highest temperature lies in the window";
    let on_charts = tally.share(Class::Good);
    let in_window = match &outcome.judged {
        None => vec![
            Check::judge(
                "in-window",
                title,
                percent(on_charts),
                Limit::AtLeast(100.0 * settings.in_window),
            )
            .remedy(remedy),
            Check::not_checked(
                "reference",
                "shares on the reference solver, at half the cell, half the step and ±5 % power",
                "shares are not converged in themselves; [judge] solver = \"reference\" judges on the reference solver",
            ),
        ],
        Some(judged) => vec![
            on_reference(
                judged.better.as_ref().unwrap_or(&judged.given),
                judged.classes.window,
                settings,
                title,
            )
            .remedy(remedy),
        ],
    };
    let unmelted = Check::judge(
        "unmelted",
        "region that stays powder",
        percent(tally.counts[Class::Unmelted as usize] as f64 / (tally.voxels as f64).max(1.0)),
        Limit::AtMost(100.0 * settings.unmelted),
    )
    .remedy("more power, slower lines, or lines closer together");
    let mut checks = in_window;
    checks.push(unmelted);
    checks
}

/// Highest temperatures and classes of the last drawing: on the reference solver where the path was looked for there.
fn last(outcome: &Outcome) -> (&Field, &Tally) {
    let there = outcome.found.as_ref().and_then(|f| f.reference.as_ref());
    let drawn = outcome.better.as_ref().unwrap_or(&outcome.given);
    there.map_or((&drawn.highest, &drawn.tally), |r| {
        (&r.better.0, &r.better.1)
    })
}

/// What is told beside the checks.
fn facts(outcome: &Outcome) -> Vec<Fact> {
    let path = &outcome.better.as_ref().unwrap_or(&outcome.given).path;
    let (highest, tally) = last(outcome);
    let (hottest, [i, j, k]) = tally.hottest;
    let on_solver = outcome
        .found
        .as_ref()
        .is_some_and(|f| f.reference.is_some());
    let place = if hottest.is_finite() {
        Place::at(highest.grid.centre(i, j, k).to_array())
    } else {
        Place::default()
    };
    let celsius = hottest - meltpath_thermal::material::CELSIUS;
    let mut facts = vec![
        Fact::new(
            "time-path",
            "time of the path",
            Measure::exact(path.end() - path.begin(), "s"),
            "",
        ),
        Fact::new(
            "hottest",
            "hottest place of the region",
            Measure::exact(celsius, "°C"),
            if on_solver {
                "on the reference solver"
            } else {
                "on charts"
            },
        )
        .at(place),
    ];
    if outcome.judged.is_some() {
        let share = Measure::exact(100.0 * tally.share(Class::Good), "%");
        let title = if on_solver {
            "share in the window where the path was looked for, whole region"
        } else {
            "share in the window on the charts, whole region"
        };
        facts.push(Fact::new("in-window-charts", title, share, ""));
    }
    facts
}

/// The share on the reference solver; one that is not converged never passes without a remark.
fn on_reference(judged: &JudgedPath, window: [f64; 2], settings: &Settings, title: &str) -> Check {
    let celsius = |kelvin: f64| kelvin - meltpath_thermal::material::CELSIUS;
    let share = &judged.share;
    let check = Check::judge(
        "in-window",
        &format!("{title}, on the reference solver"),
        Measure::new(100.0 * share.value, 100.0 * share.spread(), "%"),
        Limit::AtLeast(100.0 * settings.in_window),
    );
    let run = &judged.runs[0].resolution;
    let changes: Vec<String> = judged.runs[1..]
        .iter()
        .zip(&share.changes)
        .map(|(run, (v, c))| {
            let told = format!("{:+.1} at {}", 100.0 * c, v.words());
            match v {
                Variant::LessPower | Variant::MorePower => {
                    format!(
                        "{told}, {:.1} % in the window as it was",
                        100.0 * run.as_it_was
                    )
                }
                _ => told,
            }
        })
        .collect();
    let marked = if share.converged() {
        "converged within 5 points"
    } else {
        "NOT CONVERGED: it moves by more than 5 points"
    };
    let check = Check {
        status: if share.converged() {
            check.status
        } else {
            check.status.max(Status::Warn)
        },
        ..check
    };
    check.because(&format!(
            "the mean is {:.0} °C, the window {:.0} to {:.0} °C; cells of {:.1} µm, steps of {:.2} µs; {marked} ({})",
            celsius(judged.runs[0].tally.mean),
            celsius(window[0]),
            celsius(window[1]),
            1e3 * run.cell,
            1e6 * run.step,
            changes.join("; ")
        ))
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
    let notes = cost::lines(&plan, &reporter)?;
    let mut warnings = plan.warnings;
    warnings.extend(reporter.warnings());
    Ok(Examined {
        provenance: plan.settings.provenance,
        notes,
        warnings,
    })
}
