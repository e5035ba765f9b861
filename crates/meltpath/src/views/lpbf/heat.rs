//! What a person sees of what the laser melted.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::Section;
use meltpath_report::plot::{Aspect, Axis, Plot};
use meltpath_report::scene::Grid;
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::{Field, write_height_image};
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::pool::fusion::{FusionMap, TracePoint};

use crate::lpbf::heat::{Cold, HeatSettings, RecipeHeat, dug};
use crate::lpbf::result::RecipeResult;
use meltpath_toolpath::Role;

/// Bars of histograms.
const BARS: usize = 40;

/// The section of the report.
pub(super) fn section(settings: &HeatSettings, results: &[RecipeResult<'_>]) -> Section {
    let heats: Vec<(&str, &RecipeHeat)> = results
        .iter()
        .filter_map(|r| Some((r.recipe.name.as_str(), r.heat.as_ref()?)))
        .collect();
    let mut plots: Vec<Plot> = heats
        .iter()
        .map(|(name, heat)| places(name, heat))
        .collect();
    plots.push(pools(&heats, "Depth of the pool", "depth", |t| {
        t.pool.depth
    }));
    plots.push(pools(&heats, "Width of the pool", "width", |t| {
        t.pool.width
    }));
    Section::new(
        "What melts",
        format!(
            "One square, or the layer that melts the least, drawn by the semi-analytic heat engine as commanded and as marked: a place is melted through \
             where the metal was liquid as deep as a layer is thick. {}, absorptivity {:.0} %, bed at {:.0} °C, spot {:.0} µm. Conduction in dense metal with mean \
             properties: powder, flow in the pool and vapour are left out, so that a keyhole is deeper than told here. A boiling number \
             (normalised enthalpy over its threshold, King et al. 2014) well below 1 means that this holds; near 1 vapour deepens the pool, above it a keyhole forms.",
            settings.material.name,
            100.0 * settings.absorptivity,
            settings.medium.ambient - CELSIUS,
            1e3 * settings.spot
        ),
        plots,
        heats.iter().map(|(name, heat)| table(name, heat)).collect(),
    )
}

fn quantile(sorted: &[f64], q: f64) -> Cell {
    match sorted.len() {
        0 => Cell::Empty,
        n => Cell::Fixed(1e3 * sorted[((n - 1) as f64 * q).round() as usize], 0),
    }
}

fn sizes(trace: &[TracePoint], of: fn(&TracePoint) -> f64) -> Vec<f64> {
    let mut all: Vec<f64> = trace.iter().map(of).collect();
    all.sort_by(f64::total_cmp);
    all
}

fn table(name: &str, heat: &RecipeHeat) -> Table {
    let table = Table::of(
        &format!("Melted, {name}"),
        heat.drawings.iter().map(|d| {
            let width = sizes(&d.trace, |t| t.pool.width);
            let depth = sizes(&d.trace, |t| t.pool.depth);
            [
                ("drawing", Cell::text(d.name)),
                ("melted through, mm²", Cell::Fixed(d.area, 3)),
                ("of the surface, %", Cell::Fixed(100.0 * d.share, 2)),
                ("pool width, median, µm", quantile(&width, 0.5)),
                ("pool depth, 1 %, µm", quantile(&depth, 0.01)),
                ("pool depth, median, µm", quantile(&depth, 0.5)),
                ("pool depth, 99 %, µm", quantile(&depth, 0.99)),
            ]
        }),
    );

    let numbers: Vec<String> = heat
        .boiling
        .iter()
        .map(|b| {
            let kind = match b.kind {
                Role::Contour => "contours",
                _ => "fills",
            };
            let layer = match b.layer {
                Some(layer) if heat.choice.of > 1 => format!(" (layer {layer})"),
                _ => String::new(),
            };
            format!("{kind}{layer} {:.2}; {}", b.number, dug(b))
        })
        .collect();
    let choice = &heat.choice;
    let drawn = match choice.layer {
        Some(layer) => format!("Layer {layer} of {} that are marked", choice.of),
        None => "The first square".to_owned(),
    };
    let surface = format!(
        "{drawn}, {:.0} µm thick. The surface, {:.3} mm², is half a hatch beside the commanded lines and what these melt through, with the gaps between.",
        1e3 * choice.depth,
        heat.surface
    );
    table.noted(&if numbers.is_empty() {
        format!("{surface} The material's file has no boiling point: nothing is said of keyholes.")
    } else {
        format!("{surface} Boiling number: {}.", numbers.join("; "))
    })
}

/// Where the marked path leaves powder.
fn places(name: &str, heat: &RecipeHeat) -> Plot {
    let some = |from: f64, to: f64| -> Vec<DVec2> {
        heat.cold
            .iter()
            .filter(|l| l.share > from && l.share <= to)
            .map(|l| DVec2::from_array(l.place))
            .collect()
    };
    let mut plot = Plot::new(
        &format!("Not melted through, {name}"),
        ["x", "mm"],
        ["y", "mm"],
    );
    plot.aspect = Aspect::Equal;
    plot = plot.line("edge of the map", outline(&heat.drawings[0].map));
    for (from, to, words) in [
        (0.5, 1.0, "more than half of a square"),
        (0.1, 0.5, "10 to 50 %"),
    ] {
        let points = some(from, to);
        if !points.is_empty() {
            plot = plot.dots(words.to_owned(), points);
        }
    }
    let few = heat.cold.iter().filter(|l| l.share <= 0.1).count();
    plot.caption(&format!(
        "Squares of {:.0} µm in which the marked path leaves powder on the surface; {few} more keep a tenth or less of it.",
        1e3 * Cold::SIDE
    ))
}

fn outline(map: &FusionMap) -> Vec<DVec2> {
    let low = DVec2::from_array(map.origin);
    let size = DVec2::new(map.cells[0] as f64, map.cells[1] as f64) * map.cell;
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]
        .map(|c| low + size * DVec2::from_array(c))
        .to_vec()
}

/// Shares of the marked path by the size of its pool, as lines: one a recipe, on the same bars.
fn pools(
    heats: &[(&str, &RecipeHeat)],
    title: &str,
    label: &str,
    of: fn(&TracePoint) -> f64,
) -> Plot {
    let mut plot = Plot::new(title, Axis::new(label, "µm"), ["share of the path", "%"]);
    let end = heats
        .iter()
        .filter_map(|(_, h)| sizes(&h.drawings[1].trace, of).last().copied())
        .fold(1e-3, f64::max);
    let bar = 1e3 * end / BARS as f64;
    for (name, heat) in heats {
        let trace = &heat.drawings[1].trace;
        let mut counts = [0_u32; BARS + 1];
        for t in trace {
            counts[((1e3 * of(t) / bar) as usize).min(BARS)] += 1;
        }
        let total = trace.len().max(1) as f64;
        let points = counts
            .iter()
            .enumerate()
            .map(|(k, n)| DVec2::new((k as f64 + 0.5) * bar, 100.0 * f64::from(*n) / total))
            .collect();
        plot = plot.line((*name).to_owned(), points);
    }
    plot.caption("As marked, at equal distances along the path. Small pools: starts of lines, and places where the laser came on late.")
}

/// Writes maps for ParaView and the pools along the path.
pub(super) fn write(
    folder: &OutputFolder,
    number: usize,
    heat: &RecipeHeat,
) -> Result<(), OutputError> {
    let map = &heat.drawings[0].map;
    let grid = Grid {
        origin: DVec2::from_array(map.origin) + DVec2::splat(0.5 * map.cell),
        cell: map.cell,
        nx: map.cells[0],
        ny: map.cells[1],
    };
    let celsius =
        |map: &FusionMap| -> Vec<f32> { map.highest.iter().map(|t| t - CELSIUS as f32).collect() };
    let [asked, marked] = [0, 1].map(|n| celsius(&heat.drawings[n].map));
    folder.write(&format!("fields/melted-{number}.vti"), |w| {
        let fields = [
            Field::floats("highest temperature as commanded", "°C", &asked),
            Field::floats("highest temperature as marked", "°C", &marked),
        ];
        write_height_image(w, &grid, -map.depth, &fields).map_err(std::io::Error::other)
    })?;
    folder.write(&format!("series/pools-{number}.csv"), |w| {
        writeln!(w, "time_s,x_mm,y_mm,width_mm,depth_mm,length_mm")?;
        for t in &heat.drawings[1].trace {
            let [x, y] = t.place;
            let p = &t.pool;
            writeln!(
                w,
                "{:.7},{x:.5},{y:.5},{:.5},{:.5},{:.5}",
                t.time, p.width, p.depth, p.length
            )?;
        }
        Ok(())
    })
}
