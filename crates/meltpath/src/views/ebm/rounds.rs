//! Rounds on the judge's solver as people look at them: what each made of the section, and what its faults cost each other.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_report::series::csv::write_columns;
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::criteria::Class;
use meltpath_thermal::material::CELSIUS;

use crate::ebm::judge::of_all;
use crate::ebm::plan::Plan;
use crate::ebm::rounds::{Round, frontier as unbeaten};

/// What there is to tell of rounds.
pub(super) struct Told<'a> {
    /// All of them, the first as the path was.
    pub(super) rounds: &'a [Round],
    /// Which one is kept.
    pub(super) kept: usize,
    /// Greatest share of the section that the edge of the beam lets into the window.
    pub(super) ceiling: Option<f64>,
    /// The table of numbers in the run's folder.
    pub(super) file: &'a str,
}

fn share(round: &Round, class: Class) -> f64 {
    100.0 * of_all(&round.tally, class)
}

fn dots(name: &str, points: Vec<DVec2>) -> Mark {
    let name = name.to_owned();
    Mark::Dots { name, points }
}

fn unfused(round: &Round) -> Cell {
    let share = round.unfused;
    share.map_or(Cell::Empty, |share| Cell::Fixed(100.0 * share, 1))
}

impl Told<'_> {
    pub(super) fn by_round(&self) -> Plot {
        let line = |name: &str, of: &dyn Fn(&Round) -> f64| Mark::Line {
            name: name.to_owned(),
            points: (0..)
                .zip(self.rounds)
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

    /// What shape costs: the share in the window against what melts outside.
    pub(super) fn window_against_shape(&self, plan: &Plan) -> Plot {
        let place =
            |round: &Round| DVec2::new(100.0 * round.molten_outside(), 100.0 * round.in_window());
        let limit = 100.0 * plan.settings.job.checks.outside.0;
        let kept = self.rounds.get(self.kept).map(place);
        let at_most = self.ceiling.map_or(String::new(), |share| {
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
        .with(dots("rounds", self.rounds.iter().map(place).collect()))
        .with(dots("kept", kept.into_iter().collect()))
        .caption(&format!(
            "At most {limit} % may melt beyond the rim (checks.outside).{at_most}"
        ))
    }

    /// What too cold and too hot cost each other.
    pub(super) fn frontier(&self) -> Plot {
        let place = |round: &Round| {
            let [cold, hot, _, _] = round.faults();
            DVec2::new(100.0 * cold, 100.0 * hot)
        };
        let unbeaten = unbeaten(self.rounds);
        let ends = self.rounds.iter().zip(&unbeaten);
        let ends: Vec<DVec2> = ends.filter(|(_, n)| **n).map(|(r, _)| place(r)).collect();
        let kept = self.rounds.get(self.kept).map(place);
        Plot::new(
        "Porous against overheated",
        Axis::new("powder, or molten below the window", "%"),
        Axis::new("above the window", "%"),
    )
    .with(dots("rounds", self.rounds.iter().map(place).collect()))
    .with(dots("frontier", ends))
    .with(dots("kept", kept.into_iter().collect()))
    .caption("Frontier: no other round on the same cells has less of one fault (too cold, too hot, molten outside, not fused to the layer below) and no more of the others.")
    }

    pub(super) fn table(&self) -> Table {
        let table = Table::of(
            "Rounds",
            self.rounds.iter().enumerate().map(|(n, round)| {
                let of = |class| Cell::Fixed(share(round, class), 1);
                let [low, high] = round.window.map(|k| k - CELSIUS);
                let name = match n {
                    0 => "as it was".to_owned(),
                    _ if n == self.kept => format!("{n}, kept"),
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
                    ("not fused below (%)", unfused(round)),
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
        let file = self.file;
        table.noted(&format!(
        "Shares of all points of the section, at the depth of judge.depth; the same in {file}. Least and most over the powers that were drawn (correct.robust, optimise.robust). Out: how far beyond the rim the edge is wanted, of what checks.outside leaves. The finer cells begin with the best round of the coarser ones."
    ))
    }

    /// Writes every round.
    ///
    /// # Errors
    /// [`OutputError`].
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<(), OutputError> {
        let column = |of: &dyn Fn(&Round) -> f64| self.rounds.iter().map(of).collect::<Vec<f64>>();
        let counted = (0..self.rounds.len()).map(|n| n as f64).collect();
        let flag = |is: bool| f64::from(u8::from(is));
        let ends = unbeaten(self.rounds);
        folder.write(self.file, |w| {
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
                (
                    "unfused",
                    "pct",
                    column(&|r| r.unfused.map_or(f64::NAN, |share| 100.0 * share)),
                ),
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
                    (0..self.rounds.len())
                        .map(|n| flag(n == self.kept))
                        .collect(),
                ),
            ];
            write_columns(w, &columns).map_err(io::Error::other)
        })
    }
}
