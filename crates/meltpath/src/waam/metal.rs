//! What is checked of laid metal, however it was laid: against the part, layer by layer, and by the distance of the contact tube.

use meltpath_base::{Check, Observer, Reporter};
use meltpath_geometry::workpiece::HeightMap;

use super::checks::{borrowed_check, overhang_check, planned, plate_check, range_check};
use super::doubt::{self, Doubt};
use super::error::WaamError;
use super::judge::{
    GrowthError, LayerOutcome, TargetOutcome, TubePlace, layer_checks, target_checks,
};
use super::plan::{Lean, Plan};
use super::settings::Settings;
use super::target::{Allowance, Target, compare};
use super::tube;
use crate::stages::part::Part;

/// Metal as it was laid.
pub(super) struct Laid<'a> {
    /// Layer by layer.
    pub(super) layers: &'a [LayerOutcome],
    /// Contact tube distance along the beads.
    pub(super) ctwd: &'a [TubePlace],
    /// The surface.
    pub(super) map: &'a HeightMap,
}

/// The checks of a plan and of its metal.
pub(super) fn checks(
    laid: &Laid<'_>,
    (part, plan): (&Part, &Plan),
    settings: &Settings,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<Vec<Check>, WaamError> {
    let growth = settings.growth_error(plan.single);
    let over = plan.over.value;
    let outcome = against_part(
        part,
        settings,
        over,
        laid.map,
        &growth,
        (reporter, observer),
    )?;
    let mut checks = target_checks(&outcome, &settings.limits, &settings.remedies);
    checks.extend(layer_checks(
        laid.layers,
        &growth,
        &settings.limits,
        &settings.remedies,
    ));
    checks.extend(tube::checks(laid.layers, laid.ctwd, &growth, settings));
    doubt::undecided(&mut checks, &doubts(plan.lean.as_ref(), settings));
    checks.extend(range_check(planned(&plan.toolpath), settings));
    checks.extend(borrowed_check(settings));
    checks.push(overhang_check(plan, settings));
    checks.extend(plate_check(plan, settings));
    Ok(checks)
}

/// What keeps a plan's metal from being decided about.
fn doubts(lean: Option<&Lean>, settings: &Settings) -> Vec<Doubt> {
    let corners = doubt::of_corners(*settings.cell.program.dialect, settings);
    lean.map(doubt::of_lean)
        .into_iter()
        .chain(corners)
        .chain(settings.weave.map(|_| doubt::of_weaves()))
        .collect()
}

/// The metal compared with the finished part, at the predicted growth and one standard deviation beside it; `over`: metal
/// planned over faces that look up, mm.
pub(super) fn against_part(
    part: &Part,
    settings: &Settings,
    over: f64,
    metal: &HeightMap,
    growth: &GrowthError,
    (reporter, observer): (&Reporter, &dyn Observer),
) -> Result<TargetOutcome, WaamError> {
    let allowance = Allowance {
        side: settings.allowance,
        top: over,
    };
    let target = Target::new(&part.mesh, allowance, metal, reporter, observer)?;
    let at = |deviations: f64| compare(metal, &target, |h: f64| growth.shifted(h, deviations));
    Ok(TargetOutcome {
        volume: target.volume,
        expected: at(0.0),
        low: at(-1.0),
        high: at(1.0),
    })
}
