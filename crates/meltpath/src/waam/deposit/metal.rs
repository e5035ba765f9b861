//! What is checked of laid metal, however it was laid: against the part, layer by layer, and by the distance of the contact tube.

use meltpath_base::{Check, Observer, Reporter};
use meltpath_deposition::deposit::TubeDistance;
use meltpath_geometry::workpiece::HeightMap;

use crate::stages::part::Part;
use crate::waam::deposit::grown;
use crate::waam::deposit::simulate::Simulation;
use crate::waam::deposit::target::{Allowance, Target, compare, metal_round};
use crate::waam::deposit::tube;
use crate::waam::error::WaamError;
use crate::waam::judge::checks::{borrowed_check, heat_check, overhang_check, plate_checks};
use crate::waam::judge::doubt::{self, Doubt};
use crate::waam::judge::{
    GrowthError, LayerOutcome, TargetOutcome, TubePlace, layer_checks, target_checks,
};
use crate::waam::plan::{Lean, Plan};
use crate::waam::settings::Settings;

/// Metal as it was laid.
pub(in crate::waam) struct Laid<'a> {
    /// Layer by layer.
    pub(in crate::waam) layers: &'a [LayerOutcome],
    /// Contact tube distance along the beads.
    pub(in crate::waam) ctwd: &'a [TubePlace],
    /// The surface.
    pub(in crate::waam) map: &'a HeightMap,
    /// Where travels pass nearest over metal and plate.
    pub(in crate::waam) passed: &'a [TubeDistance],
}

impl<'a> Laid<'a> {
    /// Of a simulation.
    pub(in crate::waam) fn of(simulation: &'a Simulation) -> Self {
        Laid {
            layers: &simulation.layers,
            ctwd: &simulation.ctwd,
            map: &simulation.deposit.map,
            passed: &simulation.deposit.passed,
        }
    }
}

/// The checks of a plan and of its metal, but for the settings that beads are laid at.
pub(in crate::waam) fn checks(
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
    if let Some(remedy) = few_layers(laid, part, settings) {
        let reached = laid.layers.last().map_or(0.0, |l| l.planned_top);
        let above = |check: &Check| {
            let at = check.place.as_ref().and_then(|p| p.position);
            at.is_some_and(|at| at[2] > reached)
        };
        for check in &mut checks {
            if check.id == "lack" || check.id == "stock" && above(check) {
                *check = check.clone().remedy(remedy.clone());
            }
        }
    }
    checks.extend(layer_checks(
        laid.layers,
        &growth,
        &settings.limits,
        &settings.remedies,
    ));
    checks.extend(tube::checks(laid.layers, laid.ctwd, &growth, settings));
    grown::name(&mut checks, laid.layers, settings);
    checks.extend(tube::travels(laid.passed, &growth));
    doubt::undecided(
        &mut checks,
        &doubts(plan.lean.as_ref(), laid.layers, settings),
    );
    checks.extend(borrowed_check(settings));
    checks.push(heat_check());
    let mut of_plan = vec![overhang_check(plan, settings)];
    of_plan.extend(plate_checks(plan, settings));
    // they count in widths of a bead, which nobody measured woven
    let woven = settings.weave.map(|_| doubt::of_weaves());
    doubt::undecided(&mut of_plan, woven.as_slice());
    checks.extend(of_plan);
    Ok(checks)
}

/// Metal this far round a place, bead widths, tells whether the place is a well between beads.
const WELL: f64 = 1.5;

/// What to do about metal that is missing where the layers that the job counts end below the part's top; nothing where they do not.
fn few_layers(laid: &Laid<'_>, part: &Part, settings: &Settings) -> Option<String> {
    let count = settings.count?;
    let (reached, top) = (laid.layers.last()?.planned_top, part.mesh.bounds()?.1.z);
    let missing = top - reached;
    (missing > 0.5 * settings.bead.height.value).then(|| {
        format!(
            "raise layers.count, or leave it out: {count} layers end {reached:.1} mm over the plate, the part is {top:.1} mm high"
        )
    })
}

/// What keeps a plan's metal from being decided about.
fn doubts(lean: Option<&Lean>, layers: &[LayerOutcome], settings: &Settings) -> Vec<Doubt> {
    let corners = doubt::of_corners(settings.judged(), settings);
    let hangs = || doubt::of_hanging(layers);
    lean.map(doubt::of_lean)
        .or_else(hangs)
        .into_iter()
        .chain(corners)
        .chain(doubt::of_standing(settings))
        .chain(settings.weave.map(|_| doubt::of_weaves()))
        .chain(doubt::of_bead(settings))
        .chain(doubt::of_cells(settings))
        .collect()
}

/// The metal compared with the finished part, at the predicted growth and one standard deviation beside it; `over`: metal
/// planned over faces that look up, mm.
pub(in crate::waam) fn against_part(
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
    let target = Target::new(part, allowance, metal, reporter, observer)?;
    let at = |deviations: f64| compare(metal, &target, |h: f64| growth.shifted(h, deviations));
    let expected = at(0.0);
    let radius = WELL * settings.bead.width.value;
    let round = expected.stock[0].and_then(|(stock, least)| {
        let top = metal_round(metal, least.position.truncate(), radius)?;
        let over = top - least.position.z;
        // a dip between beads is lifted by more layers; a well deeper than a bead is high goes through them
        (over - stock > settings.bead.height.value).then_some(over)
    });
    Ok(TargetOutcome {
        volume: target.volume,
        round,
        expected,
        low: at(-1.0),
        high: at(1.0),
        edge: settings.edge_error(),
    })
}
