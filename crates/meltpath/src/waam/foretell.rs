//! What a plan becomes: its program driven by the machine's model, its metal laid and judged. What fails then is foretold to whoever asks
//! before a run; a run shows the same build.

use std::fmt::Write as _;

use meltpath_base::{Check, Observer, Reporter, Status};

use super::error::WaamError;
use super::metal::{self, Laid};
use super::plan::PlanStageError;
use super::planned::Planned;
use super::settings::Settings;
use super::simulate::{Build, Simulation, simulate};
use crate::stages::part::Part;

/// What the program of a plan builds.
pub(super) struct Built {
    pub(super) simulation: Simulation,
    /// The checks of the plan and of its metal.
    pub(super) checks: Vec<Check>,
}

/// Drives the program of a plan, lays its metal and judges it.
pub(super) fn build(
    part: &Part,
    planned: &Planned,
    settings: &Settings,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Built, WaamError> {
    let Planned { plan, commands, .. } = planned;
    let map = plan.plate(settings)?;
    let layers = plan
        .planned_layers(&map, settings)
        .map_err(PlanStageError::Planar)?;
    let build = Build::of(commands, &layers, map, settings).beside_robot(settings);
    let simulation = simulate(build, reporter, observer)?;
    observer.stage("compare with the part", 0);
    let laid = Laid {
        layers: &simulation.layers,
        ctwd: &simulation.ctwd,
        map: &simulation.deposit.map,
    };
    let checks = metal::checks(&laid, (part, plan), settings, (reporter, observer))?;
    Ok(Built { simulation, checks })
}

impl Built {
    /// The checks that fail or cannot say.
    pub(super) fn undecided(&self) -> Vec<Check> {
        undecided(self.checks.clone())
    }
}

/// The checks that fail or cannot say.
pub(super) fn undecided(mut checks: Vec<Check>) -> Vec<Check> {
    checks.retain(|c| matches!(c.status, Status::Fail | Status::CannotSay));
    checks
}

/// A line for each check that is expected to fail or to be undecided.
pub(super) fn lines(foretold: &[Check]) -> Vec<String> {
    if foretold.is_empty() {
        return vec!["foretold: no check is expected to fail".to_owned()];
    }
    foretold.iter().map(line).collect()
}

fn line(check: &Check) -> String {
    let (outcome, title, found) = (check.status.words(), check.title.as_str(), check.line());
    let mut text = format!("foretold: {outcome}: {title}: {found}");
    if let Some(place) = &check.place {
        // writing to a String cannot fail
        let _ = write!(text, " ({place})");
    }
    if let Some(remedy) = &check.remedy {
        text.push_str("; ");
        text.push_str(remedy);
    }
    text
}
