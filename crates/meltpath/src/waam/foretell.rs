//! What a plan is expected to fail: its program driven by the machine's model, its metal laid in coarse steps and judged by the
//! checks of the run. It never says "pass".

use std::fmt::Write as _;

use meltpath_base::{Check, Fact, Observer, Quiet, Reporter, Status};
use meltpath_deposition::deposit::{self, Levelling, Mode};

use super::error::WaamError;
use super::metal::{self, Laid};
use super::plan::{Plan, PlanStageError};
use super::program::Commands;
use super::settings::Settings;
use super::simulate::{Build, simulate};
use crate::stages::part::Part;

/// Travel between two solutions of the pool, mm, and longest step along the path.
const STEP: f64 = 0.5;

/// The checks that the plan is expected to fail, or to be unable to tell; what is expected to pass or to come near its limit is not
/// among them.
pub(super) fn foretell(
    part: &Part,
    plan: &Plan,
    commands: &Commands,
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Vec<Check>, WaamError> {
    observer.stage("foretell", 0);
    let coarse = Settings {
        deposit: deposit::Settings {
            mode: Mode::Build(Levelling {
                step: STEP,
                ..Levelling::default()
            }),
            stamp: STEP,
            ..settings.deposit
        },
        ..settings.clone()
    };
    let quiet = (&Reporter::new(), &Quiet(observer));
    let map = plan.plate(settings)?;
    let layers = plan
        .planned_layers(&map, settings)
        .map_err(PlanStageError::Planar)?;
    let build = Build::of(commands, &layers, map, &coarse);
    let simulation = simulate(build, quiet.0, quiet.1)?;
    let laid = Laid {
        layers: &simulation.layers,
        ctwd: &simulation.ctwd,
        map: &simulation.deposit.map,
    };
    let checks = metal::checks(&laid, (part, plan), &coarse, (quiet.0, quiet.1))?;
    Ok(undecided(checks))
}

/// The checks that fail or cannot say.
pub(super) fn undecided(mut checks: Vec<Check>) -> Vec<Check> {
    checks.retain(|c| matches!(c.status, Status::Fail | Status::CannotSay));
    checks
}

/// What was foretold, for the verdict.
pub(super) fn fact(foretold: &[Check]) -> Fact {
    let ids: Vec<&str> = foretold.iter().map(|c| c.id.as_str()).collect();
    let words = if ids.is_empty() {
        "no check".to_owned()
    } else {
        ids.join(", ")
    };
    Fact::words(
        "foretold",
        "expected from the plan to fail or to stay undecided",
        &words,
    )
}

/// A line for each check that is expected to fail or to be undecided.
pub(super) fn lines(foretold: &[Check]) -> Vec<String> {
    if foretold.is_empty() {
        return vec!["foretold: no check is expected to fail".to_owned()];
    }
    foretold.iter().map(line).collect()
}

fn line(check: &Check) -> String {
    let mut text = format!("foretold: {}: {}", check.status.words(), check.title);
    // a value near its limit is an estimate, and so is what its reason tells
    let (means, found) = match &check.value {
        Some(_) => (
            ", about ",
            Check {
                reason: String::new(),
                ..check.clone()
            },
        ),
        None => (": ", check.clone()),
    };
    text.push_str(means);
    text.push_str(&found.line());
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
