//! Corrected currents as people look at them: what each round made of the section, and what shape costs.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::html::Section;
use meltpath_report::plot::Axis;

use super::found::{Quantity, along_lines};
use super::rounds::Told;
use crate::ebm::correct::stages::Corrected;
use crate::ebm::plan::Plan;

/// What there is to tell of the rounds.
fn told(found: &Corrected) -> Told<'_> {
    Told {
        rounds: &found.rounds,
        kept: found.kept,
        ceiling: found.ceiling,
        file: "series/correction.csv",
    }
}

/// What was found.
pub(super) fn section(found: &Corrected, plan: &Plan) -> Section {
    let current: Quantity<'_> = &|p, _| 1e3 * plan.gun.current(p.power);
    let axis = Axis::new("beam current", "mA");
    let told = told(found);
    let robust = plan.settings.correct.as_ref().and_then(|how| how.robust);
    let worth = robust.map_or(String::new(), |drift| {
        format!(
            " A round is worth the least that it does with {:.1} % less power, as set, and with as much more.",
            100.0 * drift
        )
    });
    Section {
        title: "Corrected currents".to_owned(),
        intro: format!(
            "The path drawn again and again on the judge's solver; in between every place asks for more or less current. Rounds that keep to the shape come first, of these the one with most of the section in the window is kept.{worth}"
        ),
        plots: vec![
            told.by_round(),
            told.window_against_shape(plan),
            told.frontier(),
            along_lines(&found.path, "Corrected current along lines", axis, current),
        ],
        tables: vec![told.table()],
    }
}

/// Writes every round.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(folder: &OutputFolder, found: &Corrected) -> Result<(), OutputError> {
    told(found).write(folder)
}
