//! The recipes of a run beside each other and, where the thesis has the same recipe, beside what it prints.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::head::job::VectorKind::{Contour, Fill};

use super::run::{MODES, RecipeResult};
use super::settings::Settings;
use super::thesis::{Fitted, Printed, printed};
use super::work::Work;

/// One quantity: of each recipe, and as printed.
struct Line {
    name: String,
    ours: Vec<Cell>,
    theirs: Vec<Cell>,
    fitted: Option<Fitted>,
}

/// The recipes compared.
pub(super) struct Comparison<'a> {
    settings: &'a Settings,
    results: &'a [RecipeResult<'a>],
    /// Of each recipe.
    printed: Vec<Option<Printed>>,
    lines: Vec<Line>,
}

impl<'a> Comparison<'a> {
    pub(super) fn new(settings: &'a Settings, results: &'a [RecipeResult<'a>]) -> Self {
        let mut found = Comparison {
            settings,
            results,
            printed: results
                .iter()
                .map(|r| printed(settings, r.recipe))
                .collect(),
            lines: Vec::new(),
        };
        found.times();
        found.contours();
        found.errors();
        found.fills();
        found
    }

    /// A quantity that the thesis does not print.
    fn own(&mut self, name: &str, ours: &dyn Fn(&RecipeResult<'_>) -> Cell) {
        self.lines.push(Line {
            name: name.to_owned(),
            ours: self.results.iter().map(ours).collect(),
            theirs: vec![Cell::Empty; self.results.len()],
            fitted: None,
        });
    }

    /// A quantity that it may print.
    fn both(
        &mut self,
        name: &str,
        fitted: Fitted,
        ours: &dyn Fn(&RecipeResult<'_>) -> Cell,
        theirs: &dyn Fn(&Printed) -> Cell,
    ) {
        self.own(name, ours);
        let cells: Vec<Cell> = self
            .printed
            .iter()
            .map(|p| p.as_ref().map_or(Cell::Empty, theirs))
            .collect();
        if let Some(line) = self.lines.last_mut()
            && cells.iter().any(|c| *c != Cell::Empty)
        {
            line.theirs = cells;
            line.fitted = Some(fitted);
        }
    }

    fn times(&mut self) {
        let squares = match &self.settings.work {
            Work::Plate(plate) => Some(plate.squares()),
            Work::Layers(_) => None,
        };
        self.both(
            "time, s",
            Fitted::Time,
            &|r| Cell::Fixed(r.duration, 3),
            &|p| {
                if squares == Some(p.squares) {
                    Cell::Fixed(p.time, 3)
                } else {
                    Cell::Empty
                }
            },
        );
        if let Some(n) = squares {
            self.both(
                "time a square, s",
                Fitted::Time,
                &|r| Cell::Fixed(r.duration / f64::from(n), 3),
                &|p| Cell::Fixed(p.time / f64::from(p.squares), 3),
            );
        }
        self.own("mark length, m", &|r| {
            Cell::Fixed((r.job.length(Contour) + r.job.length(Fill)) / 1000.0, 2)
        });
        for (k, name) in ["on", "off"].into_iter().enumerate() {
            self.both(
                &format!("laser-{name} delay, µs"),
                Fitted::Not,
                &|r| Cell::Fixed(1e6 * [r.delays.on, r.delays.off][k], 0),
                &|p| p.delays.map_or(Cell::Empty, |d| Cell::Fixed(d[k], 0)),
            );
        }
    }

    fn contours(&mut self) {
        let limits: &[f64] = if self.settings.data.head.focus.is_some() {
            &[10.0, 20.0, 30.0, 100.0]
        } else {
            &[10.0, 30.0, 100.0, 200.0, 300.0]
        };
        for &limit in limits {
            self.both(
                &format!("contour points below {limit:.0} µm, %"),
                Fitted::Contours,
                &|r| Cell::Fixed(100.0 * r.errors.contour.share_below(1e-3 * limit), 2),
                &|p| {
                    let at = p.shares.iter().find(|s| s.0 == limit);
                    at.map_or(Cell::Empty, |s| Cell::Fixed(s.1, 2))
                },
            );
        }
        self.own("largest contour error, µm", &|r| {
            Cell::Fixed(1e3 * r.errors.contour.largest, 1)
        });
    }

    fn errors(&mut self) {
        let median = if self.printed.iter().any(Option::is_some) {
            "median (thesis: most)"
        } else {
            "median"
        };
        for (axis, name) in ["X", "Y"].into_iter().enumerate() {
            self.both(
                &format!("tracking error of {name} on marks, {median}, deg"),
                Fitted::Tracking,
                &|r| Cell::Fixed(r.errors.tracking[axis].quantile(0.5), 4),
                &|p| Cell::text(p.tracking[axis]),
            );
        }
        self.own("focus error, 99 % of lit points, mm", &|r| {
            Cell::Fixed(r.errors.focus.quantile(0.99), 3)
        });
    }

    fn fills(&mut self) {
        for (m, mode) in MODES.iter().enumerate() {
            let name = format!("fill rate, {}, %", mode.words());
            let ours = |r: &RecipeResult<'_>| Cell::Fixed(100.0 * r.fill[m], 2);
            // cells with a lit sample are the likely reading of the thesis
            if m == 0 {
                self.both(&name, Fitted::Fill, &ours, &|p| Cell::Fixed(p.fill, 2));
            } else {
                self.own(&name, &ours);
            }
        }
        for (q, name) in [(0.5, "median"), (0.99, "99 % of pieces below")] {
            self.own(
                &format!("energy a millimetre, contours, {name}, % of power over speed"),
                &|r| Cell::Fixed(100.0 * r.energy.contour.quantile(q), 1),
            );
            self.own(
                &format!("energy a millimetre, fills, {name}, % of power over speed"),
                &|r| Cell::Fixed(100.0 * r.energy.fill.quantile(q), 1),
            );
        }
        self.own("energy a millimetre, most, % of power over speed", &|r| {
            let most = r.energy.contour.largest.max(r.energy.fill.largest);
            Cell::Fixed(100.0 * most, 0)
        });
    }

    /// The names of the columns: the quantity, and each recipe with what is printed of it.
    fn columns(&self) -> Vec<String> {
        let mut columns = vec!["quantity".to_owned()];
        for (r, printed) in self.results.iter().zip(&self.printed) {
            columns.push(r.recipe.name.clone());
            if printed.is_some() {
                columns.push("thesis".to_owned());
            }
        }
        columns
    }

    fn cells<'b>(&'b self, line: &'b Line) -> impl Iterator<Item = &'b Cell> {
        let pairs = line.ours.iter().zip(&line.theirs).zip(&self.printed);
        pairs.flat_map(|((ours, theirs), printed)| {
            std::iter::once(ours).chain(printed.is_some().then_some(theirs))
        })
    }

    /// For the report.
    pub(super) fn table(&self) -> Table {
        let mut columns = self.columns();
        let compared = self.printed.iter().any(Option::is_some);
        if compared {
            columns.push("ours against the thesis".to_owned());
        }
        let mut table = Table {
            title: "This run".to_owned(),
            columns,
            ..Table::default()
        };
        for line in &self.lines {
            let mut row = vec![Cell::text(&line.name)];
            row.extend(self.cells(line).cloned());
            if let Some(fitted) = line.fitted {
                row.push(Cell::text(fitted.words(&self.settings.data.head)));
            }
            table.rows.push(row);
        }
        if compared {
            let source = if self.settings.data.head.focus.is_some() {
                "its three-axis simulator, 300 squares"
            } else {
                "its two-axis bench, 100 squares"
            };
            table.note = format!(
                "Thesis: Rasoanarivo 2020, table 3.1 and § 2.6.1, 3.2, {source}. It states neither its motors nor its friction nor the mode of its fill rates \
                 (cells with a lit sample are the likely one), and its § 2.6.2 gives other contour shares for the same runs."
            );
        }
        table
    }

    /// `series/recipes.csv`: the same figures for other software.
    pub(super) fn write(&self, folder: &OutputFolder) -> Result<(), OutputError> {
        folder.write("series/recipes.csv", |w| {
            let names: Vec<String> = self.columns().iter().map(|c| quoted(c)).collect();
            writeln!(w, "{}", names.join(","))?;
            for line in &self.lines {
                let mut row = vec![quoted(&line.name)];
                row.extend(self.cells(line).map(value));
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
