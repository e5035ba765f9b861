//! What a person sees of a scan-head run.

use std::path::Path;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Provenance, Verdict};
use meltpath_geometry::math::DVec2;
use meltpath_machine::scan_head::contour_error::{Histogram, distance_to_segment};
use meltpath_machine::scan_head::recipe_search::Found;
use meltpath_report::html::{Fact, Report, ReportError, Section, write_html};
use meltpath_report::plot::{Aspect, Axis, Bar, Mark, Plot};
use meltpath_report::scene::{LineSet, Polyline, Scalar, Scene, Stroke, Visibility};
use meltpath_report::table::{Cell, Table};

use super::optimise;
use super::run::{MODES, RecipeResult};
use super::settings::Settings;
use super::work::Work;

/// Side of the corner that is drawn, mm.
const CORNER: f64 = 1.2;

/// The run's name: the job file's, or its folder's.
pub(super) fn title(job: &Path) -> String {
    let stem = job
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .filter(|s| s != "job");
    let folder = || {
        job.parent()
            .and_then(Path::file_name)
            .map(|n| n.to_string_lossy().into_owned())
    };
    stem.or_else(folder)
        .unwrap_or_else(|| "scan head".to_owned())
}

/// What is told.
pub(super) struct Told<'a> {
    pub(super) settings: &'a Settings,
    pub(super) results: &'a [RecipeResult<'a>],
    pub(super) found: Option<&'a Found>,
}

/// Writes the report, the verdict, the provenance and the marked paths.
pub(super) fn write(
    folder: &OutputFolder,
    title: &str,
    told: &Told<'_>,
    verdict: &Verdict,
    provenance: &Provenance,
) -> Result<(), OutputError> {
    let (settings, results) = (told.settings, told.results);
    let report = Report {
        title: title.to_owned(),
        subtitle: format!("{} · {}", settings.data.head.name, settings.work.words()),
        verdict: verdict.clone(),
        facts: facts(results),
        scene: results.first().map(scene),
        sections: {
            let mut all = sections(settings, results);
            if let Some(found) = told.found {
                all.insert(1, optimise::section(found));
            }
            all
        },
        sheet: None,
        provenance: provenance.clone(),
    };
    folder.write("report.html", |w| {
        write_html(w, &report).map_err(|e| match e {
            ReportError::Io(e) => e,
            ReportError::Scene(e) => std::io::Error::other(e),
        })
    })?;
    crate::outcome::json(folder, "verdict.json", &verdict.to_json())?;
    // plain structs of numbers and strings: their JSON exists
    let provenance = serde_json::to_value(provenance).unwrap_or_default();
    crate::outcome::json(folder, "provenance.json", &provenance)?;
    if let Some(found) = told.found {
        optimise::write(folder, found)?;
    }
    for (k, r) in results.iter().enumerate() {
        if !r.front.is_empty() {
            folder.write(&format!("series/delays-{}.csv", k + 1), |w| {
                writeln!(w, "laser-on [s],laser-off [s],spurious [mm],missing [mm]")?;
                for s in &r.front {
                    let (on, off) = (s.delays.on, s.delays.off);
                    writeln!(w, "{on},{off},{:.4},{:.4}", s.spurious(), s.missing())?;
                }
                Ok(())
            })?;
        }
        folder.write(&format!("marked-path-{}.csv", k + 1), |w| {
            writeln!(w, "x [mm],y [mm],lit,vector")?;
            let p = &r.path;
            for ((hit, lit), vector) in p.hits.iter().zip(&p.lit).zip(&p.vectors) {
                writeln!(w, "{:.6},{:.6},{},{vector}", hit.x, hit.y, u8::from(*lit))?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

fn facts(results: &[RecipeResult<'_>]) -> Vec<Fact> {
    let mut facts: Vec<Fact> = results
        .iter()
        .map(|r| Fact::new(&r.recipe.name, &format!("{:.3} s", r.duration)))
        .collect();
    if let [first, second, ..] = results {
        let saving = 100.0 * (1.0 - second.duration / first.duration);
        facts.push(Fact::new(
            "time saved by the second",
            &format!("{saving:.1} %"),
        ));
    }
    facts
}

fn sections(settings: &Settings, results: &[RecipeResult<'_>]) -> Vec<Section> {
    vec![
        Section {
            title: "Recipes compared".to_owned(),
            intro: "One layer. Contours are judged by the distance of lit points to the commanded marks, fills by the share of cells reached; \
                    cells are as wide as the spot. Motors, gains, friction and geometry of the shipped heads are not printed in their source: \
                    they are reference values, some fitted to it (see the data files)."
                .to_owned(),
            tables: tables(settings, results),
            plots: vec![
                bars("Contour errors of contours", "contour error", "µm", 1e3, results, |r| &r.errors.contour, 120.0),
                bars("Contour errors of fills", "contour error", "µm", 1e3, results, |r| &r.errors.fill, 120.0),
                bars("Tracking error of X on marks", "set-point − angle", "deg", 1.0, results, |r| &r.errors.tracking[0], 0.06),
                bars("Tracking error of Y on marks", "set-point − angle", "deg", 1.0, results, |r| &r.errors.tracking[1], 0.06),
            ],
        },
        Section {
            title: "Where the laser goes".to_owned(),
            intro: "The lower right corner of the first square, or the sharpest corner of the first layer: commanded marks, and the path with the laser on.".to_owned(),
            plots: results.iter().map(|r| corner(settings, r)).collect(),
            tables: Vec::new(),
        },
        Section {
            title: "Laser delays".to_owned(),
            intro: "Spurious: lit path farther than the spot's radius from where the marks run. Missing: marks that no lit point reaches. \
                    The shortest on-delay with the least spurious light at starts, then the shortest off-delay with the least missing at ends."
                .to_owned(),
            plots: results.iter().flat_map(delay_plots).collect(),
            tables: std::iter::once(delay_table(settings, results))
                .chain(results.iter().filter_map(front_table))
                .collect(),
        },
    ]
}

fn tables(settings: &Settings, results: &[RecipeResult<'_>]) -> Vec<Table> {
    match &settings.work {
        Work::Plate(_) => vec![comparison(results), thesis()],
        Work::Layers(_) => {
            let mut tables = vec![comparison(results)];
            tables.extend(results.iter().map(layer_table));
            tables
        }
    }
}

/// The layers of a file under one recipe.
fn layer_table(r: &RecipeResult<'_>) -> Table {
    use meltpath_machine::scan_head::job::VectorKind::{Contour, Fill};
    let mut columns = vec!["layer", "height, mm", "vectors", "mark length, m"];
    let modes = MODES.map(|m| format!("fill rate, {}, %", m.words()));
    columns.extend(modes.iter().map(String::as_str));
    let mut table = Table::new(&format!("Layers, {}", r.recipe.name), &columns);
    for (k, layer) in r.layers.iter().enumerate() {
        let from = layer.first as usize;
        let to = r
            .layers
            .get(k + 1)
            .map_or(r.job.vectors.len(), |l| l.first as usize);
        let piece = r.job.slice(from..to);
        let mut row = vec![
            Cell::Fixed(f64::from(layer.number), 0),
            Cell::Fixed(layer.height, 3),
            Cell::Fixed((to - from) as f64, 0),
            Cell::Fixed((piece.length(Contour) + piece.length(Fill)) / 1000.0, 2),
        ];
        let rates = r.rates.get(k).map_or(&[][..], Vec::as_slice);
        row.extend(rates.iter().map(|rate| Cell::Fixed(100.0 * rate, 2)));
        table.rows.push(row);
    }
    "The surface to fill lies within half a hatch distance beside the fill lines."
        .clone_into(&mut table.note);
    table
}

fn comparison(results: &[RecipeResult<'_>]) -> Table {
    let mut columns = vec!["quantity"];
    columns.extend(results.iter().map(|r| r.recipe.name.as_str()));
    let mut table = Table::new("This run", &columns);
    let mut row = |name: &str, cell: &dyn Fn(&RecipeResult<'_>) -> Cell| {
        let mut cells = vec![Cell::text(name)];
        cells.extend(results.iter().map(cell));
        table.rows.push(cells);
    };
    row("time, s", &|r| Cell::Fixed(r.duration, 3));
    row("mark length, m", &|r| {
        use meltpath_machine::scan_head::job::VectorKind::{Contour, Fill};
        Cell::Fixed((r.job.length(Contour) + r.job.length(Fill)) / 1000.0, 2)
    });
    row("laser-on delay, µs", &|r| {
        Cell::Fixed(1e6 * r.delays.on, 0)
    });
    row("laser-off delay, µs", &|r| {
        Cell::Fixed(1e6 * r.delays.off, 0)
    });
    for limit in [10.0, 20.0, 30.0, 100.0] {
        row(&format!("contour points below {limit:.0} µm, %"), &|r| {
            Cell::Fixed(100.0 * r.errors.contour.share_below(1e-3 * limit), 2)
        });
    }
    row("largest contour error, µm", &|r| {
        Cell::Fixed(1e3 * r.errors.contour.largest, 1)
    });
    for (axis, name) in ["X", "Y"].into_iter().enumerate() {
        row(
            &format!("tracking error of {name} on marks, median, deg"),
            &|r| Cell::Fixed(r.errors.tracking[axis].quantile(0.5), 4),
        );
    }
    row("focus error, 99 % of lit points, mm", &|r| {
        Cell::Fixed(r.errors.focus.quantile(0.99), 3)
    });
    for (m, mode) in MODES.iter().enumerate() {
        row(&format!("fill rate, {}, %", mode.words()), &|r| {
            Cell::Fixed(100.0 * r.fill[m], 2)
        });
    }
    for (q, name) in [(0.5, "median"), (0.99, "99 % of pieces below")] {
        row(
            &format!("energy a millimetre, contours, {name}, % of power over speed"),
            &|r| Cell::Fixed(100.0 * r.energy.contour.quantile(q), 1),
        );
        row(
            &format!("energy a millimetre, fills, {name}, % of power over speed"),
            &|r| Cell::Fixed(100.0 * r.energy.fill.quantile(q), 1),
        );
    }
    row("energy a millimetre, most, % of power over speed", &|r| {
        let energy = &r.energy;
        Cell::Fixed(100.0 * energy.contour.largest.max(energy.fill.largest), 0)
    });
    table
}

/// Rasoanarivo 2020, table 3.1, conventional control, three-axis simulator.
fn thesis() -> Table {
    let mut table = Table::new(
        "The thesis, three-axis simulator, conventional control, 300 squares (Rasoanarivo 2020, table 3.1)",
        &["quantity", "recipe 1", "recipe 2", "recipe 3"],
    );
    for (name, values) in [
        ("time, s", [354.326, 263.441, 131.928]),
        ("contour points below 10 µm, %", [93.51, 93.53, 87.58]),
        ("contour points below 20 µm, %", [98.3, 96.94, 91.56]),
        ("contour points below 30 µm, %", [99.32, 99.36, 94.67]),
        ("fill rate, %", [97.16, 96.75, 91.33]),
    ] {
        let mut row = vec![Cell::text(name)];
        row.extend(values.map(|v| Cell::Fixed(v, 2)));
        table.rows.push(row);
    }
    "The thesis states neither its motors nor its friction nor the mode of its fill rates; its own § 2.6.2 gives other contour shares for the same runs."
        .clone_into(&mut table.note);
    table
}

fn bars(
    title: &str,
    label: &str,
    unit: &str,
    scale: f64,
    results: &[RecipeResult<'_>],
    of: impl for<'a> Fn(&'a RecipeResult<'_>) -> &'a Histogram,
    end: f64,
) -> Plot {
    const BARS: usize = 40;
    let mut plot = Plot::new(
        title,
        Axis::new(label, unit),
        Axis::new("share of points", "%"),
    );
    for r in results {
        let h = of(r);
        let total = h.total().max(1) as f64;
        let width = end / BARS as f64;
        let mut shares = vec![0.0; BARS];
        for (k, &count) in h.counts.iter().enumerate() {
            let at = ((k as f64 + 0.5) * h.bin * scale / width) as usize;
            shares[at.min(BARS - 1)] += 100.0 * count as f64 / total;
        }
        let bars = shares
            .iter()
            .enumerate()
            .map(|(k, &value)| Bar {
                from: k as f64 * width,
                to: (k + 1) as f64 * width,
                value,
            })
            .collect();
        plot = plot.with(Mark::Bars {
            name: r.recipe.name.clone(),
            bars,
        });
    }
    plot.caption("The last bar holds what lies beyond.")
}

/// Where the picture of a recipe is taken, and the last vector of the area that it shows.
fn pictured(settings: &Settings, r: &RecipeResult<'_>) -> (DVec2, usize) {
    match &settings.work {
        Work::Plate(plate) => {
            let corner = plate.centre(0) + DVec2::new(0.5, -0.5) * plate.side;
            let last = r.job.vectors.iter().take_while(|v| v.block == 0).count();
            (corner - DVec2::new(0.4, -0.4) * CORNER, last)
        }
        Work::Layers(_) => {
            let last = r
                .path
                .vectors
                .last()
                .map_or(0, |&v| v as usize + 1)
                .min(r.job.vectors.len());
            let turn = |i: &usize| {
                let (a, b) = (&r.job.vectors[i - 1], &r.job.vectors[*i]);
                let (from, at, to) = (r.job.start_of(i - 1), a.end, b.end);
                let cosine = (at - from)
                    .normalize_or_zero()
                    .dot((to - at).normalize_or_zero());
                (a.kind.is_mark() && b.kind.is_mark()).then_some(cosine)
            };
            let sharpest = (1..last)
                .filter_map(|i| Some((turn(&i)?, i)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let corner = sharpest.map_or_else(|| r.job.first_mark(), |(_, i)| r.job.start_of(i));
            (corner.truncate(), last)
        }
    }
}

fn corner(settings: &Settings, r: &RecipeResult<'_>) -> Plot {
    let (middle, last) = pictured(settings, r);
    let window = |p: DVec2| (p - middle).abs().max_element() < 0.6 * CORNER;
    let gap = DVec2::splat(f64::NAN);
    let mut asked = Vec::new();
    for i in 0..last {
        let v = &r.job.vectors[i];
        if v.kind.is_mark() {
            let (a, b) = (r.job.start_of(i).truncate(), v.end.truncate());
            let steps = (a.distance(b) / 0.02).ceil().max(1.0) as usize;
            let inside = (0..=steps)
                .map(|k| a.lerp(b, k as f64 / steps as f64))
                .filter(|p| window(*p));
            asked.extend(inside);
            asked.push(gap);
        }
    }
    let mut done = Vec::new();
    for (hit, lit) in r.path.hits.iter().zip(&r.path.lit) {
        let point = if *lit && window(*hit) { *hit } else { gap };
        if point.is_finite() || done.last().is_some_and(|p: &DVec2| p.is_finite()) {
            done.push(point);
        }
    }
    let mut plot = Plot::new(&r.recipe.name, Axis::new("x", "mm"), Axis::new("y", "mm"))
        .with(Mark::Line {
            name: "commanded".to_owned(),
            points: asked,
        })
        .with(Mark::Line {
            name: "marked".to_owned(),
            points: done,
        });
    plot.aspect = Aspect::Equal;
    plot
}

fn delay_plots(r: &RecipeResult<'_>) -> Vec<Plot> {
    let Some(tuned) = &r.tuned else {
        return Vec::new();
    };
    let line = |name: &str, points: Vec<DVec2>| Mark::Line {
        name: name.to_owned(),
        points,
    };
    let on = |f: &dyn Fn(&meltpath_machine::scan_head::delays::DelayScore) -> f64| {
        tuned
            .on_table
            .iter()
            .map(|s| DVec2::new(1e6 * s.delays.on, f(s)))
            .collect()
    };
    let off = |f: &dyn Fn(&meltpath_machine::scan_head::delays::DelayScore) -> f64| {
        tuned
            .off_table
            .iter()
            .map(|s| DVec2::new(1e6 * s.delays.off, f(s)))
            .collect()
    };
    vec![
        Plot::new(
            &format!("{}: starts of marks", r.recipe.name),
            Axis::new("laser-on delay", "µs"),
            Axis::new("length", "mm"),
        )
        .with(line("spurious", on(&|s| s.spurious_start)))
        .with(line("missing", on(&|s| s.missing_start))),
        Plot::new(
            &format!("{}: ends of marks", r.recipe.name),
            Axis::new("laser-off delay", "µs"),
            Axis::new("length", "mm"),
        )
        .with(line("spurious", off(&|s| s.spurious_end)))
        .with(line("missing", off(&|s| s.missing_end))),
    ]
}

fn delay_table(settings: &Settings, results: &[RecipeResult<'_>]) -> Table {
    let mut table = Table::new(
        "Delays",
        &[
            "recipe",
            "on, µs",
            "off, µs",
            "spurious, mm",
            "missing, mm",
            "recipe's own on, µs",
            "recipe's own off, µs",
        ],
    );
    for r in results {
        let own = r.recipe.delays;
        let (spurious, missing) = r.tuned.as_ref().map_or((Cell::Empty, Cell::Empty), |t| {
            (
                Cell::Fixed(t.best.spurious(), 2),
                Cell::Fixed(t.best.missing(), 2),
            )
        });
        table.rows.push(vec![
            Cell::text(&r.recipe.name),
            Cell::Fixed(1e6 * r.delays.on, 0),
            Cell::Fixed(1e6 * r.delays.off, 0),
            spurious,
            missing,
            Cell::Fixed(1e6 * own.on, 0),
            Cell::Fixed(1e6 * own.off, 0),
        ]);
    }
    if matches!(settings.work, Work::Plate(_)) {
        for (name, on, off) in [
            (
                "thesis, recipe 1 (industrial, standard values)",
                395.0,
                107.0,
            ),
            ("thesis, recipe 2 (uniform, tuned by trial)", 341.0, 53.0),
        ] {
            let mut row = vec![Cell::text(name), Cell::Fixed(on, 0), Cell::Fixed(off, 0)];
            row.resize(7, Cell::Empty);
            table.rows.push(row);
        }
    }
    "Lengths are those of the piece that the tuning runs: two squares, or up to 4 s of a layer."
        .clone_into(&mut table.note);
    table
}

/// Pairs of delays that no other beats in both lengths, at most a dozen.
fn front_table(r: &RecipeResult<'_>) -> Option<Table> {
    const ROWS: usize = 12;
    if r.front.is_empty() {
        return None;
    }
    let mut table = Table::new(
        &format!("{}: trade-offs of delays", r.recipe.name),
        &["on, µs", "off, µs", "spurious, mm", "missing, mm"],
    );
    let step = r.front.len().div_ceil(ROWS);
    for s in r.front.iter().step_by(step) {
        table.rows.push(vec![
            Cell::Fixed(1e6 * s.delays.on, 0),
            Cell::Fixed(1e6 * s.delays.off, 0),
            Cell::Fixed(s.spurious(), 2),
            Cell::Fixed(s.missing(), 2),
        ]);
    }
    "Less spurious light costs more missing marks; no other pair is better in both. All of them are in series/delays-N.csv."
        .clone_into(&mut table.note);
    Some(table)
}

/// The first square or layer as marked, coloured by its contour error.
fn scene(r: &RecipeResult<'_>) -> Scene {
    let mut lit = LineSet {
        name: format!("marked, {}", r.recipe.name),
        points: Vec::new(),
        polylines: Vec::new(),
        scalars: Vec::new(),
        stroke: Stroke::Bead(0.07),
        visibility: Visibility::Shown,
    };
    let mut errors = Vec::new();
    let mut open = false;
    for ((hit, on), &vector) in r.path.hits.iter().zip(&r.path.lit).zip(&r.path.vectors) {
        if !on {
            open = false;
            continue;
        }
        if !open {
            // a polyline of one point is none
            if lit
                .polylines
                .last()
                .is_some_and(|p| p.first + 1 == lit.points.len())
            {
                lit.points.pop();
                errors.pop();
                lit.polylines.pop();
            }
            lit.polylines.push(Polyline {
                first: lit.points.len(),
                layer: 1,
            });
            open = true;
        }
        let near = (vector.saturating_sub(3)..=vector)
            .map(|i| i as usize)
            .filter(|&i| r.job.vectors[i].kind.is_mark())
            .map(|i| {
                distance_to_segment(
                    *hit,
                    r.job.start_of(i).truncate(),
                    r.job.vectors[i].end.truncate(),
                )
            })
            .fold(f64::INFINITY, f64::min);
        lit.points.push(hit.extend(0.0));
        errors.push(if near.is_finite() {
            (1e3 * near) as f32
        } else {
            f32::NAN
        });
    }
    if lit
        .polylines
        .last()
        .is_some_and(|p| p.first + 1 == lit.points.len())
    {
        lit.points.pop();
        errors.pop();
        lit.polylines.pop();
    }
    lit.scalars.push(Scalar::new("contour error", "µm", errors));
    Scene {
        lines: vec![lit],
        surfaces: Vec::new(),
        heights: None,
    }
}
