//! What other powers make of a section, as the judge's runs drew it.

use meltpath_geometry::math::DVec2;
use meltpath_melt_strategy::judgement::Variant;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::criteria::{Class, Tally};
use meltpath_thermal::material::CELSIUS;

use crate::ebm::judge::{Judged, Run, of_all};

/// The runs of the path that counts with other powers and the one that they are held against, by their power.
fn by_power(judged: &Judged) -> Vec<&Run> {
    let path = judged.better.as_ref().unwrap_or(&judged.given);
    let runs = path.runs.iter();
    let mut runs: Vec<&Run> = runs
        .filter(|run| run.variant.is_of_power() || run.variant == Variant::TwiceCell)
        .collect();
    runs.sort_by(|a, b| a.variant.power().total_cmp(&b.variant.power()));
    runs
}

/// Shares of the section against the power.
pub(super) fn plot(judged: &Judged) -> Plot {
    let runs = by_power(judged);
    let line = |name: &str, of: &dyn Fn(&Run) -> f64| Mark::Line {
        name: name.to_owned(),
        points: runs
            .iter()
            .map(|run| DVec2::new(100.0 * (run.variant.power() - 1.0), 100.0 * of(run)))
            .collect(),
    };
    Plot::new(
        "Where the power drifts",
        Axis::new("change of the power", "%"),
        Axis::new("share of the section", "%"),
    )
    .with(line("below the window as it was, or powder", &|run| {
        below(&run.as_it_was)
    }))
    .with(line("in the window as it was", &|run| {
        of_all(&run.as_it_was, Class::Good)
    }))
    .with(line("above it", &|run| {
        of_all(&run.as_it_was, Class::Overheated)
    }))
    .with(line(
        "in the window of a body drawn with that power",
        &|run| of_all(&run.tally, Class::Good),
    ))
    .with(line("molten outside", &|run| run.outside.share))
}

fn below(tally: &Tally) -> f64 {
    of_all(tally, Class::Unmelted) + of_all(tally, Class::Porous)
}

/// The same in numbers.
pub(super) fn table(judged: &Judged) -> Table {
    let rows = by_power(judged).into_iter().map(|run| {
        let share = |share: f64| Cell::Fixed(100.0 * share, 1);
        [
            ("power (%)", Cell::Fixed(100.0 * run.variant.power(), 0)),
            (
                "below the window as it was, or powder (%)",
                share(below(&run.as_it_was)),
            ),
            ("in it (%)", share(of_all(&run.as_it_was, Class::Good))),
            (
                "above it (%)",
                share(of_all(&run.as_it_was, Class::Overheated)),
            ),
            (
                "in the window of a body drawn with that power (%)",
                share(of_all(&run.tally, Class::Good)),
            ),
            (
                "molten outside (%)",
                Cell::Fixed(100.0 * run.outside.share, 2),
            ),
            ("farthest (mm)", Cell::Fixed(run.outside.farthest, 2)),
            ("mean (°C)", Cell::Fixed(run.tally.mean - CELSIUS, 0)),
        ]
    });
    Table::of("Where the power drifts", rows).noted(
        "On cells twice as large as those of the run as set. The window as it was is that of the run as set: the power drifts after it was found. A window of limits is the same for all.",
    )
}
