//! The recipes of a run beside each other.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::measures::histogram::Histogram;

use crate::lpbf::plan::Plan;
use crate::lpbf::plan::work::Work;
use crate::lpbf::result::{MODES, RecipeResult};

/// One quantity, of each recipe.
struct Line {
    name: String,
    cells: Vec<Cell>,
}

/// The recipes compared.
pub(super) struct Comparison<'a> {
    plan: &'a Plan,
    results: &'a [RecipeResult<'a>],
    lines: Vec<Line>,
}

/// A quantile of energies a millimetre, %; beyond the histogram's bins only that it is more.
fn energy(of: &Histogram, q: f64) -> Cell {
    let value = of.quantile(q);
    let most = of.bin * (of.counts.len() - 1) as f64;
    if value >= most {
        return Cell::text(&format!("more than {:.0}", 100.0 * most));
    }
    Cell::Fixed(100.0 * value, 1)
}

impl<'a> Comparison<'a> {
    pub(super) fn new(plan: &'a Plan, results: &'a [RecipeResult<'a>]) -> Self {
        let mut found = Comparison {
            plan,
            results,
            lines: Vec::new(),
        };
        found.times();
        found.contours();
        found.errors();
        found.fills();
        found
    }

    fn add(&mut self, name: &str, of: &dyn Fn(&RecipeResult<'_>) -> Cell) {
        self.lines.push(Line {
            name: name.to_owned(),
            cells: self.results.iter().map(of).collect(),
        });
    }

    fn times(&mut self) {
        self.add("time, s", &|r| Cell::Fixed(r.duration, 3));
        if let Work::Plate(plate) = &self.plan.work {
            let squares = f64::from(plate.squares());
            self.add("time a square, s", &|r| {
                Cell::Fixed(r.duration / squares, 3)
            });
        }
        self.add("mark length, m", &|r| {
            Cell::Fixed((r.survey.contours + r.survey.fills) / 1000.0, 2)
        });
        self.add("laser-on delay, µs", &|r| {
            Cell::Fixed(1e6 * r.delays.on, 0)
        });
        self.add("laser-off delay, µs", &|r| {
            Cell::Fixed(1e6 * r.delays.off, 0)
        });
    }

    fn contours(&mut self) {
        let limits: &[f64] = if self.plan.settings.data.head.focus.is_some() {
            &[10.0, 20.0, 30.0, 100.0]
        } else {
            &[10.0, 30.0, 100.0, 200.0, 300.0]
        };
        // what is left out of the simulation is not in these shares, and is in the verdict's
        let strays = match self.plan.settings.data.head.left_out {
            Some(_) => " as simulated",
            None => "",
        };
        for &limit in limits {
            self.add(
                &format!("way along contours below {limit:.0} µm{strays}, %"),
                &|r| Cell::Fixed(100.0 * r.errors.contour_share(1e-3 * limit, None), 2),
            );
        }
        self.add("largest contour error, µm", &|r| {
            Cell::Fixed(1e3 * r.errors.contour.largest, 1)
        });
    }

    fn errors(&mut self) {
        for (axis, name) in ["X", "Y"].into_iter().enumerate() {
            self.add(
                &format!("tracking error of {name} on marks, median, deg"),
                &|r| Cell::Fixed(r.errors.tracking[axis].quantile(0.5), 4),
            );
        }
        self.add("focus error, 99 % of lit points, mm", &|r| {
            Cell::Fixed(r.errors.focus.quantile(0.99), 3)
        });
        let beam = self.plan.settings.data.head.beam;
        self.add("spot at that focus error, over the waist, %", &|r| {
            let radius = beam.radius_at(r.errors.focus.quantile(0.99));
            Cell::Fixed(100.0 * radius / beam.waist, 2)
        });
    }

    fn fills(&mut self) {
        for (m, mode) in MODES.iter().enumerate() {
            self.add(&format!("fill rate, {}, %", mode.words()), &|r| {
                let whole = r.fill(m).map(|fill| fill.whole.share);
                whole.map_or(Cell::Empty, |share| Cell::Fixed(100.0 * share, 2))
            });
        }
        for (q, name) in [(0.5, "median"), (0.99, "99 % of pieces below")] {
            self.add(
                &format!("energy a millimetre, contours, {name}, % of power over speed"),
                &|r| energy(&r.energy.contour, q),
            );
            self.add(
                &format!("energy a millimetre, fills, {name}, % of power over speed"),
                &|r| energy(&r.energy.fill, q),
            );
        }
        self.add("energy a millimetre, most, % of power over speed", &|r| {
            let most = r.energy.contour.largest.max(r.energy.fill.largest);
            Cell::Fixed(100.0 * most, 0)
        });
    }

    /// The names of the columns: the quantity, and each recipe.
    fn columns(&self) -> Vec<String> {
        let recipes = self.results.iter().map(|r| r.recipe.name.clone());
        std::iter::once("quantity".to_owned())
            .chain(recipes)
            .collect()
    }

    /// For the report.
    pub(super) fn table(&self) -> Table {
        let row = |line: &Line| {
            std::iter::once(Cell::text(&line.name))
                .chain(line.cells.iter().cloned())
                .collect()
        };
        Table {
            title: "This run".to_owned(),
            columns: self.columns(),
            rows: self.lines.iter().map(row).collect(),
            ..Table::default()
        }
    }

    /// `series/recipes.csv`: the same figures for other software.
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<(), OutputError> {
        folder.write("series/recipes.csv", |w| {
            let names: Vec<String> = self.columns().iter().map(|c| quoted(c)).collect();
            writeln!(w, "{}", names.join(","))?;
            for line in &self.lines {
                let mut row = vec![quoted(&line.name)];
                row.extend(line.cells.iter().map(value));
                writeln!(w, "{}", row.join(","))?;
            }
            io::Result::Ok(())
        })
    }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

fn value(cell: &Cell) -> String {
    match cell {
        Cell::Fixed(value, _) | Cell::Number(value) | Cell::Duration(value) => value.to_string(),
        Cell::Text(text) => quoted(text),
        Cell::Empty => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energies_beyond_the_bins_are_told_as_more() {
        let mut energies = Histogram::new(0.01, 10_000);
        energies.add(1.0);
        assert!(matches!(energy(&energies, 0.5), Cell::Fixed(..)));
        energies.add_many(187.0, 9);
        assert_eq!(energy(&energies, 0.5), Cell::text("more than 9999"));
    }
}
