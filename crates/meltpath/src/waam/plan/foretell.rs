//! What a plan becomes: its program driven by the machine's model, its metal laid and judged. What fails then is foretold to whoever asks
//! before a run; a run shows the same build.

use std::fmt::Write as _;

use meltpath_base::{Check, Observer, Reporter, Status};

use crate::stages::part::Part;
use crate::waam::deposit::metal::{self, Laid};
use crate::waam::deposit::simulate::{Build, Simulation, simulate};
use crate::waam::error::WaamError;
use crate::waam::judge::checks::{planned as stretches, range_check, tool_check};
use crate::waam::judge::feet;
use crate::waam::plan::PlanStageError;
use crate::waam::plan::planned::Planned;
use crate::waam::settings::Settings;

/// What the program of a plan builds.
pub(in crate::waam) struct Built {
    pub(in crate::waam) simulation: Simulation,
    /// The checks of the plan and of its metal.
    pub(in crate::waam) checks: Vec<Check>,
}

/// Drives the program of a plan, lays its metal and judges it.
pub(in crate::waam) fn build(
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
    let laid = Laid::of(&simulation);
    let mut checks = metal::checks(&laid, (part, plan), settings, (reporter, observer))?;
    checks.extend(range_check(stretches(&plan.toolpath), settings));
    checks.extend(feet::check(commands, settings));
    checks.extend(tool_check(settings));
    Ok(Built { simulation, checks })
}

impl Built {
    /// The checks that fail or cannot say.
    pub(in crate::waam) fn undecided(&self) -> Vec<Check> {
        undecided(self.checks.clone())
    }
}

/// The checks that fail or cannot say.
pub(in crate::waam) fn undecided(mut checks: Vec<Check>) -> Vec<Check> {
    checks.retain(|c| matches!(c.status, Status::Fail | Status::CannotSay));
    checks
}

/// A line for each check that is expected to fail or to be undecided.
pub(in crate::waam) fn lines(foretold: &[Check]) -> Vec<String> {
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
