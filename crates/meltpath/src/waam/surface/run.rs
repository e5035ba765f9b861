//! The run of a job of layers that are not flat: plan, program, machine, checks, and what it writes.

use meltpath_base::output::OutputFolder;
use meltpath_base::{Observer, Reporter, Verdict};
use meltpath_report::html::Report;

use super::Asked;
use super::ground::shown;
use super::judge::arc_starts;
use super::plan::SurfacePlan;
use super::wall::{Placed, placed, wall};
use crate::outcome::{self, Examined, Outcome};
use crate::views;
use crate::waam::drive::site::Site;
use crate::waam::error::WaamError;
use crate::waam::loaded::{Loaded, SHOWN_WARNINGS, subtitle};
use crate::waam::plan::foretell;
use crate::waam::plan::planned::read_back;

/// The run into a new folder.
pub(in crate::waam) fn run(
    loaded: &Loaded,
    asked: &Asked,
    folder: OutputFolder,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Outcome, WaamError> {
    let settings = &loaded.settings;
    let wall = wall(loaded, asked, reporter, observer)?;
    let verdict = Verdict {
        checks: wall.checks.clone(),
        facts: wall.facts.clone(),
        warnings: reporter.digest(SHOWN_WARNINGS),
    };
    let mut provenance = settings.provenance.clone();
    loaded.record(&mut provenance)?;
    observer.stage("write results", 0);
    views::waam::surface::write_files(&folder, &wall)?;
    let mut report = Report {
        title: loaded.name.clone(),
        subtitle: subtitle(&wall.name, settings),
        verdict: verdict.clone(),
        scene: Some(views::waam::surface::scene(&wall, settings)),
        sections: views::waam::surface::sections(&wall, asked, settings),
        sheet: None,
        provenance,
    };
    let way = (&wall.film, &wall.summary.commands[..]);
    let body = shown(&wall.plan, &wall.standing.holders);
    let laid = (&wall.commands, body.as_ref());
    views::waam::cell::show(&folder, &mut report, settings, way, laid)?;
    outcome::tell(&folder, &report)?;
    let built = (wall.name.as_str(), &wall.mesh);
    loaded.keep(&folder, (&wall.plan.toolpath, built), &wall.files)?;
    observer.check()?;
    Ok(Outcome {
        folder: folder.commit()?,
        verdict,
    })
}

/// The plan alone, with a summary in words.
pub(in crate::waam) fn plan_only(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<(SurfacePlan, Vec<String>), WaamError> {
    let Placed {
        mut plan,
        findings,
        standing,
        ..
    } = placed(loaded, asked, reporter, observer)?;
    if loaded.settings.robot.is_some() {
        // it may need beads divided
        let site = Site {
            settings: &loaded.settings,
            standing: Some(&standing),
        };
        let (name, told) = (&loaded.name, (reporter, observer));
        read_back(name, &mut plan.toolpath, site, told)?;
    }
    let passes = plan.passes.last().map_or(0, |p| p.number);
    let mut lines = vec![format!(
        "{} beads, {:.1} m, in {passes} layers {:.3} mm apart",
        arc_starts(&plan),
        plan.toolpath.deposited_length() / 1000.0,
        asked.spacing
    )];
    lines.extend(findings);
    Ok((plan, lines))
}

/// What a run of the job will find.
pub(in crate::waam) fn examine(
    loaded: &Loaded,
    asked: &Asked,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Examined, WaamError> {
    let quiet = Reporter::new();
    let wall = wall(loaded, asked, &quiet, observer)?;
    let mut notes = wall.findings.clone();
    notes.push(format!(
        "{} passes, {:.0} min with arc",
        wall.plan.passes.last().map_or(0, |p| p.number),
        wall.summary.arc_time / 60.0
    ));
    notes.extend(foretell::lines(&foretell::undecided(wall.checks)));
    Ok(Examined {
        notes,
        provenance: loaded.settings.provenance.clone(),
        warnings: reporter.warnings(),
    })
}
