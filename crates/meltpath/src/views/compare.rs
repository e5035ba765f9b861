//! What a comparison looks like: map, histogram, course in time and temperature, the pairs as a table.

use std::collections::BTreeMap;
use std::io;

use meltpath_base::Provenance;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::colour::ColourMap;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::{Axis, Map as PlotMap, Mark, Plot, histogram};
use meltpath_report::scene::{Grid, HeightLayers, Scalar, Scene};
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::{Field, Values as FieldValues, write_height_image};
use meltpath_thermal::calibration::comparison::{PERCENTILES, Pair, apart, relative};

use crate::compare::comparison::{Compared, Comparison};
use crate::compare::quantity::Quantity;
use crate::views::write_csv;

/// Dots drawn of temperature against temperature, at most.
const DOTS: usize = 3000;
/// Intervals of the courses.
const INTERVALS: usize = 40;
/// Cells of the map, at most.
const CELLS: f64 = 1e6;
/// Samples in a cell of the map, in the mean and at least.
const PER_CELL: f64 = 4.0;

/// Differences by place of the plan, as they are shown.
struct Map {
    grid: Grid,
    count: Vec<f64>,
    mean: Vec<f64>,
    largest: Vec<f64>,
}

fn map(part: &Compared, cell: f64) -> Option<Map> {
    let mut low = DVec2::splat(f64::INFINITY);
    let mut high = DVec2::splat(f64::NEG_INFINITY);
    for p in &part.pairs {
        let at = DVec2::new(p.sample.place[0], p.sample.place[1]);
        (low, high) = (low.min(at), high.max(at));
    }
    let size = high - low;
    // some samples in each cell, so that a sparse table still gives a map
    let cells = (part.pairs.len() as f64 / PER_CELL).clamp(1.0, CELLS);
    let least = (size.x * size.y / cells).sqrt();
    let cell = cell.max(least);
    let count = |length: f64| (length / cell).round() as usize + 1;
    let grid = Grid {
        origin: low,
        cell,
        nx: count(size.x),
        ny: count(size.y),
    };
    if !low.is_finite() {
        return None;
    }
    let cells = grid.nx * grid.ny;
    let shown = part.quantity.shown();
    let mut map = Map {
        grid,
        count: vec![0.0; cells],
        mean: vec![0.0; cells],
        largest: vec![f64::NAN; cells],
    };
    for p in &part.pairs {
        let index = |a: usize, n: usize| {
            let x = (p.sample.place[a] - low[a]) / cell;
            (x.round().max(0.0) as usize).min(n - 1)
        };
        let n = index(1, grid.ny) * grid.nx + index(0, grid.nx);
        let difference = shown.difference(p.difference());
        map.count[n] += 1.0;
        map.mean[n] += difference;
        if map.largest[n].is_nan() || difference.abs() > map.largest[n].abs() {
            map.largest[n] = difference;
        }
    }
    for (mean, count) in map.mean.iter_mut().zip(&map.count) {
        *mean /= count;
    }
    Some(map)
}

/// Which quantity the view shows: the one whose map has most cells with a value.
fn viewed(comparison: &Comparison) -> usize {
    let cells = |part: &Compared| {
        let map = map(part, comparison.cell);
        map.map_or(0, |m| m.count.iter().filter(|c| **c > 0.0).count())
    };
    let parts = comparison.parts.iter().enumerate().rev();
    parts
        .max_by_key(|(_, part)| cells(part))
        .map_or(0, |(n, _)| n)
}

/// The map of one quantity.
fn scene(comparison: &Comparison, part: &Compared) -> Option<Scene> {
    let shown = part.quantity.shown();
    let map = map(part, comparison.cell)?;
    // what 99 % of the differences stay below
    let most = shown
        .difference(part.apart.percentiles[3])
        .max(f64::MIN_POSITIVE);
    let scalar = |name: &str| Scalar::new(name, shown.difference, Vec::new()).diverging(most);
    let mut layers = HeightLayers::new("difference", map.grid, 1)
        .ok()?
        .with_scalar(scalar("mean difference"))
        .with_scalar(scalar("largest difference"));
    let heights: Vec<f64> = map
        .count
        .iter()
        .map(|c| if *c > 0.0 { 0.0 } else { f64::NAN })
        .collect();
    layers.push(1, &heights, &[&map.mean, &map.largest]).ok()?;
    Some(Scene {
        lines: Vec::new(),
        surfaces: Vec::new(),
        heights: Some(layers),
        machine: None,
    })
}

/// The map of a quantity in the plan, for those that the view does not show.
fn flat_map(part: &Compared, cell: f64) -> Option<Plot> {
    // a few places make no map
    let map = map(part, cell).filter(|m| m.grid.nx > 2 && m.grid.ny > 2)?;
    let grid = map.grid;
    let shown = part.quantity.shown();
    let most = shown
        .difference(part.apart.percentiles[3])
        .max(f64::MIN_POSITIVE);
    let low = grid.origin - 0.5 * grid.cell;
    let high = low + grid.cell * DVec2::new(grid.nx as f64, grid.ny as f64);
    let plot = Plot::new(
        "By place",
        Axis::new("x", "mm").between(low.x, high.x),
        Axis::new("y", "mm").between(low.y, high.y),
    );
    Some(plot.with(Mark::Map(PlotMap {
        name: "mean difference".to_owned(),
        unit: shown.difference.to_owned(),
        corners: [low, high],
        columns: grid.nx,
        values: map.mean,
        range: Some([-most, most]),
        colours: ColourMap::Diverging,
    })))
}

/// Mean difference and its standard deviation over intervals of `along`.
fn course(title: &str, axis: Axis, part: &Compared, along: &dyn Fn(&Pair) -> f64) -> Plot {
    let shown = part.quantity.shown();
    let pairs = &part.pairs;
    let ends = pairs
        .iter()
        .map(along)
        .fold([f64::INFINITY, f64::NEG_INFINITY], |e, v| {
            [e[0].min(v), e[1].max(v)]
        });
    let width = ((ends[1] - ends[0]) / INTERVALS as f64).max(f64::MIN_POSITIVE);
    let mut bins: BTreeMap<usize, [f64; 3]> = BTreeMap::new();
    for p in pairs {
        let n = (((along(p) - ends[0]) / width) as usize).min(INTERVALS - 1);
        let bin = bins.entry(n).or_default();
        let d = shown.difference(p.difference());
        *bin = [bin[0] + 1.0, bin[1] + d, bin[2] + d * d];
    }
    let (mut middle, mut lower, mut upper) = (Vec::new(), Vec::new(), Vec::new());
    for (n, [count, sum, squares]) in bins {
        let x = ends[0] + (n as f64 + 0.5) * width;
        let mean = sum / count;
        let deviation = (squares / count - mean * mean).max(0.0).sqrt();
        middle.push(DVec2::new(x, mean));
        lower.push(DVec2::new(x, mean - deviation));
        upper.push(DVec2::new(x, mean + deviation));
    }
    Plot::new(title, axis, Axis::new("difference", shown.difference))
        .band("one standard deviation", lower, upper)
        .line("mean", middle)
}

fn against_each_other(part: &Compared) -> Plot {
    let shown = part.quantity.shown();
    let every = part.pairs.len().div_ceil(DOTS).max(1);
    let dots: Vec<DVec2> = part
        .pairs
        .iter()
        .step_by(every)
        .map(|p| DVec2::new(shown.value(p.other), shown.value(p.sample.value)))
        .collect();
    let ends = dots
        .iter()
        .flat_map(|p| [p.x, p.y])
        .fold([f64::INFINITY, f64::NEG_INFINITY], |e, v| {
            [e[0].min(v), e[1].max(v)]
        });
    let caption = if every > 1 {
        format!("One of every {every} pairs.")
    } else {
        String::new()
    };
    Plot::new(
        "Against each other",
        Axis::new("other", shown.unit),
        Axis::new("table", shown.unit),
    )
    .dots("pairs", dots)
    .line("equal", ends.map(DVec2::splat).to_vec())
    .caption(&caption)
}

fn place(p: &Pair, quantity: Quantity) -> Vec<Cell> {
    let shown = quantity.shown();
    let mut row: Vec<Cell> = p.sample.place.iter().map(|v| Cell::Fixed(*v, 3)).collect();
    if quantity.is_in_time() {
        row.push(Cell::Fixed(1e3 * p.sample.time, 4));
    }
    let digits = digits(quantity);
    row.extend([
        Cell::Fixed(shown.value(p.sample.value), digits),
        Cell::Fixed(shown.value(p.other), digits),
        Cell::Fixed(shown.difference(p.difference()), digits),
    ]);
    row
}

/// Digits after the point.
fn digits(quantity: Quantity) -> usize {
    if quantity.is_temperature() { 1 } else { 3 }
}

fn tables(part: &Compared) -> Vec<Table> {
    let a = &part.apart;
    let shown = part.quantity.shown();
    let mut figures = Table::new("Difference, table less other", &["figure", "value", "unit"]);
    let mut row = |name: &str, value: Cell, unit: &str| {
        figures
            .rows
            .push(vec![Cell::text(name), value, Cell::text(unit)]);
    };
    row("samples compared", Cell::Fixed(a.pairs as f64, 0), "");
    for (name, count) in ["left out for their place", "left out for their time"]
        .iter()
        .zip(part.left_out)
    {
        row(name, Cell::Fixed(count as f64, 0), "");
    }
    if part.away.is_some() {
        let unmet = Cell::Fixed(part.unmet as f64, 0);
        row("of the other table, without a counterpart", unmet, "");
    }
    let digits = digits(part.quantity) + 1;
    let mut difference = |name: &str, value: f64| {
        let value = Cell::Fixed(shown.difference(value), digits);
        row(name, value, shown.difference);
    };
    difference("bias", a.bias);
    difference("standard deviation", a.deviation);
    difference("mean without sign", a.mean);
    for (share, value) in PERCENTILES.iter().zip(a.percentiles) {
        difference(&format!("{:.0} % stay below", 100.0 * share), value);
    }
    if part.quantity.is_temperature() {
        row(
            "mean without sign, of the temperature in °C",
            Cell::Fixed(100.0 * relative(&part.pairs), 2),
            "%",
        );
    }
    if let Some([mean, greatest]) = part.away {
        for (name, away) in [
            ("places of a pair apart, mean", mean),
            ("places of a pair apart, at most", greatest),
        ] {
            row(name, Cell::Fixed(1e3 * away, 1), "µm");
        }
    }
    let mut heads = vec!["x (mm)", "y (mm)", "z (mm)"];
    if part.quantity.is_in_time() {
        heads.push("t (ms)");
    }
    let told = ["table", "other"].map(|name| format!("{name} ({})", shown.unit));
    let apart = format!("difference ({})", shown.difference);
    heads.extend([told[0].as_str(), told[1].as_str(), apart.as_str()]);
    let mut worst = Table::new("Furthest apart", &heads);
    let mut sorted: Vec<&Pair> = part.pairs.iter().collect();
    sorted.sort_by(|a, b| b.difference().abs().total_cmp(&a.difference().abs()));
    worst.rows = sorted
        .into_iter()
        .take(10)
        .map(|p| place(p, part.quantity))
        .collect();
    let mut tables = vec![figures, worst];
    tables.extend(by_layer(part));
    tables
}

/// The figures of each layer, where there are several.
fn by_layer(part: &Compared) -> Option<Table> {
    let mut layers: BTreeMap<usize, Vec<Pair>> = BTreeMap::new();
    for (layer, pair) in part.layers.iter().zip(&part.pairs) {
        layers.entry(*layer).or_default().push(*pair);
    }
    if layers.len() < 2 {
        return None;
    }
    let shown = part.quantity.shown();
    let unit = shown.difference;
    let [bias, deviation, most] =
        ["bias", "standard deviation", "95 % stay below"].map(|name| format!("{name} ({unit})"));
    let mut table = Table::new("By layer", &["layer", "samples", &bias, &deviation, &most]);
    let digits = digits(part.quantity) + 1;
    for (layer, pairs) in layers {
        let Some(a) = apart(&pairs) else { continue };
        let difference = |value: f64| Cell::Fixed(shown.difference(value), digits);
        table.rows.push(vec![
            Cell::Fixed(layer as f64, 0),
            Cell::Fixed(a.pairs as f64, 0),
            difference(a.bias),
            difference(a.deviation),
            difference(a.percentiles[2]),
        ]);
    }
    Some(table)
}

/// One quantity; the view may show its map.
fn section(comparison: &Comparison, part: &Compared, viewed: bool) -> Section {
    let shown = part.quantity.shown();
    let differences: Vec<f64> = part
        .pairs
        .iter()
        .map(|p| shown.difference(p.difference()))
        .collect();
    let spread = Plot::new(
        "How often",
        Axis::new("difference", shown.difference),
        ["samples", ""],
    )
    .bars("samples", histogram(&differences, 60));
    let mut plots = Vec::new();
    if !viewed {
        plots.extend(flat_map(part, comparison.cell));
    }
    plots.extend([spread, against_each_other(part)]);
    if part.quantity.is_in_time() {
        let axis = Axis::new("time", "ms");
        plots.push(course("In time", axis, part, &|p| 1e3 * p.sample.time));
    }
    let axis = Axis::new("other", shown.unit);
    let title = format!("Against the {}", part.quantity.words());
    plots.push(course(&title, axis, part, &|p| shown.value(p.other)));
    let mut words = part.quantity.words().to_owned();
    words[..1].make_ascii_uppercase();
    Section::new(words, if viewed {
            "Differences are the table's less the other's. In the view: their mean and largest by place, over all times and depths."
        } else {
            "Differences are the table's less the other's."
        }
        .to_owned(), plots, tables(part))
}

/// The report.
pub fn report(comparison: &Comparison, provenance: &Provenance) -> Report {
    let samples: usize = comparison.parts.iter().map(|p| p.pairs.len()).sum();
    let viewed = viewed(comparison);
    let sections = comparison.parts.iter().enumerate();
    Report {
        title: format!("{} compared", comparison.name),
        subtitle: format!("with {} · {samples} samples", comparison.against),
        verdict: comparison.verdict.clone(),
        scene: comparison
            .parts
            .get(viewed)
            .and_then(|part| scene(comparison, part)),
        sections: sections
            .map(|(n, part)| section(comparison, part, n == viewed))
            .collect(),
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// Writes the pairs and the map of each quantity.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, comparison: &Comparison) -> Result<(), OutputError> {
    for part in &comparison.parts {
        write_pairs(folder, part)?;
        write_map(folder, part, comparison.cell)?;
    }
    Ok(())
}

fn write_pairs(folder: &OutputFolder, part: &Compared) -> Result<(), OutputError> {
    let shown = part.quantity.shown();
    let of = |f: &dyn Fn(&Pair) -> f64| part.pairs.iter().map(f).collect::<Vec<f64>>();
    let layers = part.layers.iter().map(|n| *n as f64).collect();
    let mut columns = vec![
        ("layer", "", layers),
        ("x", "mm", of(&|p| p.sample.place[0])),
        ("y", "mm", of(&|p| p.sample.place[1])),
        ("z", "mm", of(&|p| p.sample.place[2])),
    ];
    if part.quantity.is_in_time() {
        columns.push(("t", "s", of(&|p| p.sample.time)));
    }
    columns.extend([
        ("table", shown.unit, of(&|p| shown.value(p.sample.value))),
        ("other", shown.unit, of(&|p| shown.value(p.other))),
        (
            "difference",
            shown.difference,
            of(&|p| shown.difference(p.difference())),
        ),
    ]);
    write_csv(
        folder,
        &format!("pairs{}.csv", part.quantity.suffix()),
        &columns,
    )
}

fn write_map(folder: &OutputFolder, part: &Compared, cell: f64) -> Result<(), OutputError> {
    let Some(map) = map(part, cell) else {
        return Ok(());
    };
    let (suffix, unit) = (part.quantity.suffix(), part.quantity.shown().difference);
    let kept: Vec<usize> = (0..map.count.len())
        .filter(|n| map.count[*n] > 0.0)
        .collect();
    let pick = |values: &[f64]| kept.iter().map(|n| values[*n]).collect::<Vec<f64>>();
    let at = |axis: usize| {
        kept.iter()
            .map(|n| {
                let index = [n % map.grid.nx, n / map.grid.nx][axis];
                map.grid.origin[axis] + index as f64 * map.grid.cell
            })
            .collect::<Vec<f64>>()
    };
    write_csv(
        folder,
        &format!("map{suffix}.csv"),
        &[
            ("x", "mm", at(0)),
            ("y", "mm", at(1)),
            ("samples", "", pick(&map.count)),
            ("mean_difference", unit, pick(&map.mean)),
            ("largest_difference", unit, pick(&map.largest)),
        ],
    )?;
    folder.write(&format!("map{suffix}.vti"), |w| {
        let field = |name, values| Field {
            name,
            unit,
            values: FieldValues::Float64(values),
        };
        let fields = [
            field("mean difference", &map.mean),
            field("largest difference", &map.largest),
        ];
        write_height_image(w, &map.grid, 0.0, &fields).map_err(io::Error::other)
    })
}
