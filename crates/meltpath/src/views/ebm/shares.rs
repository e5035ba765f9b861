//! The table of where the highest temperatures of paths lie.

use meltpath_report::table::{Cell, Table};
use meltpath_thermal::criteria::{Class, Tally};
use meltpath_thermal::material::CELSIUS;

/// What a path makes of a region.
pub(super) struct Shares<'a> {
    pub(super) name: &'static str,
    /// Of the last layer, s.
    pub(super) time: f64,
    pub(super) tally: &'a Tally,
}

impl Shares<'_> {
    /// Shares of the molten voxels, unmelted of all.
    pub(super) fn table(title: &str, rows: impl IntoIterator<Item = Self>) -> Table {
        let row = |Shares { name, time, tally }| {
            let percent = |class| Cell::Fixed(100.0 * tally.share(class), 1);
            let unmelted = tally.counts[0] as f64 / (tally.voxels as f64).max(1.0);
            [
                ("path", Cell::text(name)),
                ("time", Cell::Duration(time)),
                ("molten", Cell::Fixed(tally.molten() as f64, 0)),
                ("unmelted (%)", Cell::Fixed(100.0 * unmelted, 2)),
                ("below the window (%)", percent(Class::Porous)),
                ("in the window (%)", percent(Class::Good)),
                ("above the window (%)", percent(Class::Overheated)),
                ("mean (°C)", Cell::Fixed(tally.mean - CELSIUS, 0)),
                ("standard deviation (K)", Cell::Fixed(tally.deviation, 0)),
            ]
        };
        Table::of(title, rows.into_iter().map(row))
    }
}
