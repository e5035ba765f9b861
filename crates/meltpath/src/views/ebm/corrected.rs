//! Corrected currents as people look at them: what each round made of the section, and what shape costs.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::Section;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_report::series::csv::write_columns;
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::criteria::Class;
use meltpath_thermal::material::CELSIUS;

use super::found::{Quantity, along_lines};
use crate::ebm::correct::rounds::{Corrected, Round, frontier as unbeaten};
use crate::ebm::judge::of_all;
use crate::ebm::plan::Plan;

/// Every round as a table of numbers.
const ROUNDS: &str = "series/correction.csv";

fn share(round: &Round, class: Class) -> f64 {
    100.0 * of_all(&round.tally, class)
}

/// What was found.
pub(super) fn section(found: &Corrected, plan: &Plan) -> Section {
    let current: Quantity<'_> = &|p, _| 1e3 * plan.gun.current(p.power);
    let axis = Axis::new("beam current", "mA");
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
            by_round(found),
            window_against_shape(found, plan),
            frontier(found),
            along_lines(&found.path, "Corrected current along lines", axis, current),
        ],
        tables: vec![table(found)],
    }
}

fn by_round(found: &Corrected) -> Plot {
    let line = |name: &str, of: &dyn Fn(&Round) -> f64| Mark::Line {
        name: name.to_owned(),
        points: (0..)
            .zip(&found.rounds)
            .map(|(n, round)| DVec2::new(f64::from(n), of(round)))
            .collect(),
    };
    Plot::new(
        "The section, round by round",
        Axis::new("round", ""),
        Axis::new("share of the section", "%"),
    )
    .with(line("in the window", &|r| share(r, Class::Good)))
    .with(line("below it", &|r| share(r, Class::Porous)))
    .with(line("above it", &|r| share(r, Class::Overheated)))
    .with(line("molten outside", &|r| 100.0 * r.outside.share))
}

fn dots(name: &str, points: Vec<DVec2>) -> Mark {
    let name = name.to_owned();
    Mark::Dots { name, points }
}

/// What shape costs: the share in the window against what melts outside.
fn window_against_shape(found: &Corrected, plan: &Plan) -> Plot {
    let place =
        |round: &Round| DVec2::new(100.0 * round.molten_outside(), 100.0 * round.in_window());
    let limit = 100.0 * plan.settings.job.checks.outside.0;
    let kept = found.rounds.get(found.kept).map(place);
    let at_most = found.ceiling.map_or(String::new(), |share| {
        format!(
            " The edge of the beam lets at most {:.1} % of the section into the window, evenly hot.",
            100.0 * share
        )
    });
    Plot::new(
        "Window against shape",
        Axis::new("molten beyond the rim, of the section's area", "%"),
        Axis::new("section in the window", "%"),
    )
    .with(dots("rounds", found.rounds.iter().map(place).collect()))
    .with(dots("kept", kept.into_iter().collect()))
    .caption(&format!(
        "At most {limit} % may melt beyond the rim (checks.outside).{at_most}"
    ))
}

/// What too cold and too hot cost each other.
fn frontier(found: &Corrected) -> Plot {
    let place = |round: &Round| {
        let [cold, hot, _] = round.faults();
        DVec2::new(100.0 * cold, 100.0 * hot)
    };
    let unbeaten = unbeaten(&found.rounds);
    let ends = found.rounds.iter().zip(&unbeaten);
    let ends: Vec<DVec2> = ends.filter(|(_, n)| **n).map(|(r, _)| place(r)).collect();
    let kept = found.rounds.get(found.kept).map(place);
    Plot::new(
        "Porous against overheated",
        Axis::new("powder, or molten below the window", "%"),
        Axis::new("above the window", "%"),
    )
    .with(dots("rounds", found.rounds.iter().map(place).collect()))
    .with(dots("frontier", ends))
    .with(dots("kept", kept.into_iter().collect()))
    .caption("Frontier: no other round on the same cells has less of one fault (too cold, too hot, molten outside) and no more of the others.")
}

fn table(found: &Corrected) -> Table {
    let table = Table::of(
        "Rounds",
        found.rounds.iter().enumerate().map(|(n, round)| {
            let of = |class| Cell::Fixed(share(round, class), 1);
            let [low, high] = round.window.map(|k| k - CELSIUS);
            let name = match n {
                0 => "as it was".to_owned(),
                _ if n == found.kept => format!("{n}, kept"),
                _ => n.to_string(),
            };
            let towards = format!(
                "{:+.0} K, {:+.0} % out",
                round.aimed.hotter * (high - low),
                100.0 * round.aimed.outward
            );
            [
                ("round", Cell::Text(name)),
                ("cell (µm)", Cell::Fixed(1e3 * round.cell, 1)),
                ("window (°C)", Cell::Text(format!("{low:.0} to {high:.0}"))),
                ("aimed beside the middle", Cell::Text(towards)),
                ("unmelted (%)", of(Class::Unmelted)),
                ("below the window (%)", of(Class::Porous)),
                ("in window (%)", of(Class::Good)),
                ("above it (%)", of(Class::Overheated)),
                (
                    "molten outside (%)",
                    Cell::Fixed(100.0 * round.outside.share, 2),
                ),
                ("farthest (mm)", Cell::Fixed(round.outside.farthest, 2)),
                (
                    "in window, least (%)",
                    Cell::Fixed(100.0 * round.in_window(), 1),
                ),
                (
                    "molten outside, most (%)",
                    Cell::Fixed(100.0 * round.molten_outside(), 2),
                ),
                ("mean (°C)", Cell::Fixed(round.tally.mean - CELSIUS, 0)),
                (
                    "standard deviation (K)",
                    Cell::Fixed(round.tally.deviation, 0),
                ),
            ]
        }),
    );
    table.noted(&format!(
        "Shares of all points of the section, at the depth of judge.depth; the same in {ROUNDS}. Least and most over the powers that were drawn (correct.robust). Out: how far beyond the rim the edge is wanted, of what checks.outside leaves. The finer cells begin with the best round of the coarser ones."
    ))
}

/// Writes every round.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(folder: &OutputFolder, found: &Corrected) -> Result<(), OutputError> {
    let column = |of: &dyn Fn(&Round) -> f64| found.rounds.iter().map(of).collect::<Vec<f64>>();
    let counted = (0..found.rounds.len()).map(|n| n as f64).collect();
    let flag = |is: bool| f64::from(u8::from(is));
    let ends = unbeaten(&found.rounds);
    folder.write(ROUNDS, |w| {
        let columns = [
            ("round", "", counted),
            ("cell", "mm", column(&|r| r.cell)),
            ("window_low", "C", column(&|r| r.window[0] - CELSIUS)),
            ("window_high", "C", column(&|r| r.window[1] - CELSIUS)),
            ("unmelted", "pct", column(&|r| share(r, Class::Unmelted))),
            ("below", "pct", column(&|r| share(r, Class::Porous))),
            ("in_window", "pct", column(&|r| share(r, Class::Good))),
            ("above", "pct", column(&|r| share(r, Class::Overheated))),
            ("outside", "pct", column(&|r| 100.0 * r.outside.share)),
            ("farthest", "mm", column(&|r| r.outside.farthest)),
            ("mean", "C", column(&|r| r.tally.mean - CELSIUS)),
            ("deviation", "K", column(&|r| r.tally.deviation)),
            (
                "aimed_hotter",
                "K",
                column(&|r| r.aimed.hotter * (r.window[1] - r.window[0])),
            ),
            ("aimed_outward", "pct", column(&|r| 100.0 * r.aimed.outward)),
            ("in_window_least", "pct", column(&|r| 100.0 * r.in_window())),
            (
                "outside_most",
                "pct",
                column(&|r| 100.0 * r.molten_outside()),
            ),
            ("frontier", "", ends.into_iter().map(flag).collect()),
            (
                "kept",
                "",
                (0..found.rounds.len())
                    .map(|n| flag(n == found.kept))
                    .collect(),
            ),
        ];
        write_columns(w, &columns).map_err(io::Error::other)
    })
}
