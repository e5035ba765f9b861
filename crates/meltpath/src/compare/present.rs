//! What a comparison looks like: map, histogram, course in time and temperature, the pairs as a table.

use std::collections::BTreeMap;
use std::io;

use meltpath_base::Provenance;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::{Fact, Report, Section};
use meltpath_report::plot::{Axis, Mark, Plot, histogram};
use meltpath_report::scene::{Grid, HeightLayers, Scalar, Scene};
use meltpath_report::series::csv::write_columns;
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::{Field, Values as FieldValues, write_height_image};
use meltpath_thermal::comparison::{PERCENTILES, Pair, apart};
use meltpath_thermal::material::CELSIUS;

use super::Comparison;

/// Dots drawn of temperature against temperature, at most.
const DOTS: usize = 3000;
/// Intervals of the courses.
const INTERVALS: usize = 40;
/// Cells of the map, at most.
const CELLS: f64 = 1e6;
/// Samples in a cell of the map, in the mean and at least.
const PER_CELL: f64 = 4.0;

/// Differences by place of the plan.
struct Map {
    grid: Grid,
    count: Vec<f64>,
    mean: Vec<f64>,
    largest: Vec<f64>,
}

fn map(comparison: &Comparison) -> Option<Map> {
    let mut low = DVec2::splat(f64::INFINITY);
    let mut high = DVec2::splat(f64::NEG_INFINITY);
    for p in &comparison.pairs {
        let at = DVec2::new(p.sample.place[0], p.sample.place[1]);
        (low, high) = (low.min(at), high.max(at));
    }
    let size = high - low;
    // some samples in each cell, so that a sparse table still gives a map
    let cells = (comparison.pairs.len() as f64 / PER_CELL).clamp(1.0, CELLS);
    let least = (size.x * size.y / cells).sqrt();
    let cell = comparison.cell.max(least);
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
    let mut map = Map {
        grid,
        count: vec![0.0; cells],
        mean: vec![0.0; cells],
        largest: vec![f64::NAN; cells],
    };
    for p in &comparison.pairs {
        let index = |a: usize, n: usize| {
            let x = (p.sample.place[a] - low[a]) / cell;
            (x.round().max(0.0) as usize).min(n - 1)
        };
        let n = index(1, grid.ny) * grid.nx + index(0, grid.nx);
        map.count[n] += 1.0;
        map.mean[n] += p.difference();
        if map.largest[n].is_nan() || p.difference().abs() > map.largest[n].abs() {
            map.largest[n] = p.difference();
        }
    }
    for (mean, count) in map.mean.iter_mut().zip(&map.count) {
        *mean /= count;
    }
    Some(map)
}

/// The limits of the colours: what 99 % of the differences stay below.
fn limit(comparison: &Comparison) -> f64 {
    comparison.apart.percentiles[3].max(1.0)
}

fn scene(comparison: &Comparison) -> Option<Scene> {
    let map = map(comparison)?;
    let most = limit(comparison);
    let scalar = |name: &str| Scalar::new(name, "K", Vec::new()).diverging(most);
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
    })
}

/// Mean difference and its standard deviation over intervals of `along`.
fn course(title: &str, axis: Axis, pairs: &[Pair], along: &dyn Fn(&Pair) -> f64) -> Plot {
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
        let d = p.difference();
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
    Plot::new(title, axis, Axis::new("difference", "K"))
        .with(Mark::Band {
            name: "one standard deviation".to_owned(),
            lower,
            upper,
        })
        .with(Mark::Line {
            name: "mean".to_owned(),
            points: middle,
        })
}

fn against_each_other(pairs: &[Pair]) -> Plot {
    let every = pairs.len().div_ceil(DOTS).max(1);
    let dots: Vec<DVec2> = pairs
        .iter()
        .step_by(every)
        .map(|p| DVec2::new(p.other - CELSIUS, p.sample.kelvin - CELSIUS))
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
        "Temperature against temperature",
        Axis::new("other", "°C"),
        Axis::new("table", "°C"),
    )
    .with(Mark::Dots {
        name: "pairs".to_owned(),
        points: dots,
    })
    .with(Mark::Line {
        name: "equal".to_owned(),
        points: ends.map(DVec2::splat).to_vec(),
    })
    .caption(&caption)
}

fn place(p: &Pair) -> Vec<Cell> {
    vec![
        Cell::Fixed(p.sample.place[0], 3),
        Cell::Fixed(p.sample.place[1], 3),
        Cell::Fixed(p.sample.place[2], 3),
        Cell::Fixed(1e3 * p.sample.time, 4),
        Cell::Fixed(p.sample.kelvin - CELSIUS, 1),
        Cell::Fixed(p.other - CELSIUS, 1),
        Cell::Fixed(p.difference(), 1),
    ]
}

fn tables(comparison: &Comparison) -> Vec<Table> {
    let a = &comparison.apart;
    let mut figures = Table::new("Difference, table less other", &["figure", "value", "unit"]);
    let mut row = |name: &str, value: Cell, unit: &str| {
        figures
            .rows
            .push(vec![Cell::text(name), value, Cell::text(unit)]);
    };
    row("samples compared", Cell::Fixed(a.pairs as f64, 0), "");
    for (name, count) in ["left out for their place", "left out for their time"]
        .iter()
        .zip(comparison.left_out)
    {
        row(name, Cell::Fixed(count as f64, 0), "");
    }
    row("bias", Cell::Fixed(a.bias, 2), "K");
    row("standard deviation", Cell::Fixed(a.deviation, 2), "K");
    row("mean without sign", Cell::Fixed(a.mean, 2), "K");
    row(
        "the same of the temperature in °C",
        Cell::Fixed(100.0 * a.relative, 2),
        "%",
    );
    for (share, value) in PERCENTILES.iter().zip(a.percentiles) {
        row(
            &format!("{:.0} % stay below", 100.0 * share),
            Cell::Fixed(value, 1),
            "K",
        );
    }
    let mut worst = Table::new(
        "Furthest apart",
        &[
            "x (mm)",
            "y (mm)",
            "z (mm)",
            "t (ms)",
            "table (°C)",
            "other (°C)",
            "difference (K)",
        ],
    );
    let mut sorted: Vec<&Pair> = comparison.pairs.iter().collect();
    sorted.sort_by(|a, b| b.difference().abs().total_cmp(&a.difference().abs()));
    worst.rows = sorted.into_iter().take(10).map(place).collect();
    let mut tables = vec![figures, worst];
    tables.extend(by_layer(comparison));
    tables
}

/// The figures of each layer, where there are several.
fn by_layer(comparison: &Comparison) -> Option<Table> {
    let mut layers: BTreeMap<usize, Vec<Pair>> = BTreeMap::new();
    for (layer, pair) in comparison.layers.iter().zip(&comparison.pairs) {
        layers.entry(*layer).or_default().push(*pair);
    }
    if layers.len() < 2 {
        return None;
    }
    let mut table = Table::new(
        "By layer",
        &[
            "layer",
            "samples",
            "bias (K)",
            "standard deviation (K)",
            "95 % stay below (K)",
        ],
    );
    for (layer, pairs) in layers {
        let Some(a) = apart(&pairs) else { continue };
        table.rows.push(vec![
            Cell::Fixed(layer as f64, 0),
            Cell::Fixed(a.pairs as f64, 0),
            Cell::Fixed(a.bias, 2),
            Cell::Fixed(a.deviation, 2),
            Cell::Fixed(a.percentiles[2], 1),
        ]);
    }
    Some(table)
}

/// The report.
pub fn report(table: &str, comparison: &Comparison, provenance: &Provenance) -> Report {
    let pairs = &comparison.pairs;
    let differences: Vec<f64> = pairs.iter().map(Pair::difference).collect();
    let a = &comparison.apart;
    let spread = Plot::new(
        "How often",
        Axis::new("difference", "K"),
        Axis::new("samples", ""),
    )
    .with(Mark::Bars {
        name: "samples".to_owned(),
        bars: histogram(&differences, 60),
    });
    Report {
        title: format!("{table} compared"),
        subtitle: format!("with {} · {} samples", comparison.against, a.pairs),
        verdict: comparison.verdict.clone(),
        facts: vec![
            Fact::new("bias", &format!("{:.1} K", a.bias)),
            Fact::new("standard deviation", &format!("{:.1} K", a.deviation)),
            Fact::new(
                "mean without sign",
                &format!("{:.1} K, {:.2} %", a.mean, 100.0 * a.relative),
            ),
            Fact::new("95 % stay below", &format!("{:.0} K", a.percentiles[2])),
        ],
        scene: scene(comparison),
        sections: vec![Section {
            title: "How far apart".to_owned(),
            intro: "Differences are the table's temperature less the other's. In the view: their mean and largest by place, over all times and depths.".to_owned(),
            plots: vec![
                spread,
                against_each_other(pairs),
                course(
                    "In time",
                    Axis::new("time", "ms"),
                    pairs,
                    &|p| 1e3 * p.sample.time,
                ),
                course(
                    "Against temperature",
                    Axis::new("other", "°C"),
                    pairs,
                    &|p| p.other - CELSIUS,
                ),
            ],
            tables: tables(comparison),
        }],
        sheet: None,
        provenance: provenance.clone(),
    }
}

fn as_io(error: impl std::error::Error + Send + Sync + 'static) -> io::Error {
    io::Error::other(error)
}

fn write_csv(
    folder: &OutputFolder,
    name: &str,
    columns: &[(&str, &str, Vec<f64>)],
) -> Result<(), OutputError> {
    folder.write(name, |out| write_columns(out, columns).map_err(as_io))
}

/// Writes the pairs, the map and the verdict.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, comparison: &Comparison) -> Result<(), OutputError> {
    let of = |f: &dyn Fn(&Pair) -> f64| comparison.pairs.iter().map(f).collect::<Vec<f64>>();
    write_csv(
        folder,
        "pairs.csv",
        &[
            (
                "layer",
                "",
                comparison.layers.iter().map(|n| *n as f64).collect(),
            ),
            ("x", "mm", of(&|p| p.sample.place[0])),
            ("y", "mm", of(&|p| p.sample.place[1])),
            ("z", "mm", of(&|p| p.sample.place[2])),
            ("t", "s", of(&|p| p.sample.time)),
            ("table", "°C", of(&|p| p.sample.kelvin - CELSIUS)),
            ("other", "°C", of(&|p| p.other - CELSIUS)),
            ("difference", "K", of(&Pair::difference)),
        ],
    )?;
    folder.write("verdict.json", |w| {
        serde_json::to_writer_pretty(&mut *w, &comparison.verdict.to_json())?;
        w.write_all(b"\n")
    })?;
    let Some(map) = map(comparison) else {
        return Ok(());
    };
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
        "map.csv",
        &[
            ("x", "mm", at(0)),
            ("y", "mm", at(1)),
            ("samples", "", pick(&map.count)),
            ("mean_difference", "K", pick(&map.mean)),
            ("largest_difference", "K", pick(&map.largest)),
        ],
    )?;
    folder.write("map.vti", |w| {
        let field = |name, values| Field {
            name,
            unit: "K",
            values: FieldValues::Float64(values),
        };
        let fields = [
            field("mean difference", &map.mean),
            field("largest difference", &map.largest),
        ];
        write_height_image(w, &map.grid, 0.0, &fields).map_err(as_io)
    })
}
