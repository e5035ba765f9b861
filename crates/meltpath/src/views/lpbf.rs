//! What a person sees of a scan-head run.

mod comparison;
mod heat;
mod search;

use std::path::Path;

use meltpath_base::number::significant;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Fact, Measure, Provenance, Verdict};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::{Aspect, Axis, Plot};
use meltpath_report::scene::{LineSet, Polyline, Scalar, Scene, Stroke, Visibility};
use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::measures::delays::{DelayScore, Tuned};
use meltpath_scan_head::measures::histogram::Histogram;
use meltpath_scan_head::measures::segment::distance_to_segment;
use meltpath_scan_head::search::Found;

use crate::lpbf::defocus::in_focus;
use crate::lpbf::friction;
use crate::lpbf::left_out;
use crate::lpbf::paced;
use crate::lpbf::plan::Plan;
use crate::lpbf::plan::work::Work;
use crate::lpbf::result::{JUDGED, MODES, RecipeResult, fill_words};
use crate::lpbf::strays;
use crate::views::lpbf::comparison::Comparison;

/// Side of the corner that is drawn, mm.
const CORNER: f64 = 1.2;

/// The run's name: the job file's, or its folder's.
pub(crate) fn title(job: &Path) -> String {
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
pub(crate) struct Told<'a> {
    pub(crate) plan: &'a Plan,
    pub(crate) results: &'a [RecipeResult<'a>],
    pub(crate) found: Option<&'a Found>,
}

/// Writes the report, the verdict, the provenance and the marked paths.
pub(crate) fn write(
    folder: &OutputFolder,
    title: &str,
    told: &Told<'_>,
    verdict: &Verdict,
    provenance: &Provenance,
) -> Result<(), OutputError> {
    let (plan, results) = (told.plan, told.results);
    let settings = &plan.settings;
    let report = Report {
        title: title.to_owned(),
        subtitle: format!("{} · {}", settings.data.head.name, plan.work.words()),
        verdict: verdict.clone(),
        scene: (!results.is_empty()).then(|| scene(results)),
        sections: {
            let mut all = sections(plan, results);
            if let Some(heat) = &settings.heat {
                all.insert(2, heat::section(heat, results));
            }
            if let Some(found) = told.found {
                all.insert(1, search::section(found));
            }
            all
        },
        sheet: None,
        provenance: provenance.clone(),
    };
    crate::outcome::tell(folder, &report)?;
    Comparison::new(plan, results).write(folder)?;
    if let Some(found) = told.found {
        search::write(folder, found, results)?;
    }
    for (k, r) in results.iter().enumerate() {
        if let Some(heat) = &r.heat {
            heat::write(folder, k + 1, heat)?;
        }
        if !r.front.is_empty() {
            folder.write(&format!("series/delays-{}.csv", k + 1), |w| {
                writeln!(w, "laser_on_s,laser_off_s,spurious_mm,missing_mm")?;
                for s in &r.front {
                    let (on, off) = (s.delays.on, s.delays.off);
                    writeln!(w, "{on},{off},{:.4},{:.4}", s.spurious(), s.missing())?;
                }
                Ok(())
            })?;
        }
        folder.write(&format!("marked-path-{}.csv", k + 1), |w| {
            writeln!(w, "x_mm,y_mm,lit,vector")?;
            let p = &r.path;
            for ((hit, lit), vector) in p.hits.iter().zip(&p.lit).zip(&p.vectors) {
                writeln!(w, "{:.6},{:.6},{},{vector}", hit.x, hit.y, u8::from(*lit))?;
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Share of the commanded contours from which on it is told that less is lit.
const CUT: f64 = 0.01;

/// What is told of the recipes beside the checks: their times, how much of contours is cut away, and the fill rates where the job sets no
/// limit.
pub(crate) fn facts(plan: &Plan, results: &[RecipeResult<'_>]) -> Vec<Fact> {
    let mut facts: Vec<Fact> = left_out::fact(&plan.work).into_iter().collect();
    facts.extend(friction::fact(&plan.settings.data));
    for (k, r) in results.iter().enumerate() {
        let number = k + 1;
        facts.push(Fact::new(
            &format!("time-{number}"),
            &format!("{}: time of the job", r.recipe.name),
            Measure::exact(r.duration, "s"),
            &paced::words(r.survey).unwrap_or_default(),
        ));
        let (commanded, lit) = (r.errors.dark().commanded, r.errors.lit_way());
        if commanded - lit > CUT * commanded {
            facts.push(Fact::new(
                &format!("contour-way-{number}"),
                &format!("{}: way in light along contours", r.recipe.name),
                Measure::exact(100.0 * lit / commanded, "%"),
                &format!(
                    "{} mm of the {} mm that are commanded: corners are cut, or the light comes late",
                    significant(lit, 3),
                    significant(commanded, 3)
                ),
            ));
        }
        let told = plan.settings.job.checks.fill_rate.is_none();
        // of a surface that is not known nothing is told
        let told = told && plan.enclosed.doubt.is_none() && in_focus(&plan.settings, r.survey);
        if let Some(fill) = r.fill(JUDGED).filter(|_| told) {
            let rate = strays::rate(plan, r, &fill);
            facts.push(Fact::new(
                &format!("fill-{number}"),
                &r.fill_title(),
                Measure::new(100.0 * rate.share, 100.0 * rate.doubt, "%"),
                &fill_words(&fill).unwrap_or_default(),
            ));
        }
    }
    if let [first, second, ..] = results {
        let saving = 100.0 * (1.0 - second.duration / first.duration);
        facts.push(Fact::new(
            "time-saved",
            "time saved by the second recipe",
            Measure::exact(saving, "%"),
            "",
        ));
    }
    facts
}

fn sections(plan: &Plan, results: &[RecipeResult<'_>]) -> Vec<Section> {
    vec![
        Section::new(
            "Recipes compared",
            "One layer. Contours are judged by the distance of lit points to the commanded marks, fills by the share of cells reached, which are as wide as the spot, \
                    and of the surface itself, which is what the verdict judges. What a figure of the head rests on stands in its file.",
            vec![
                shares("Contour errors of contours", results, |r| &r.errors.contour),
                shares("Contour errors of fills", results, |r| &r.errors.fill),
                steps(
                    "Tracking error of X on marks",
                    "set-point − angle",
                    "deg",
                    1.0,
                    results,
                    |r| &r.errors.tracking[0],
                ),
                steps(
                    "Tracking error of Y on marks",
                    "set-point − angle",
                    "deg",
                    1.0,
                    results,
                    |r| &r.errors.tracking[1],
                ),
                steps(
                    "Energy a millimetre, fills",
                    "energy over power and speed of the mark",
                    "%",
                    100.0,
                    results,
                    |r| &r.energy.fill,
                ),
            ],
            tables(plan, results),
        ),
        Section::new(
            "Where the laser goes",
            "The lower right corner of the first square, or the sharpest corner of the first layer: commanded marks (dashed), and the path with the laser on (where the solid line ends, the laser is off). \
                    The view in space shows the first recipe; the others are in its list.",
            results.iter().map(|r| corner(plan, r)).collect(),
            vec![],
        ),
        Section::new(
            "Laser delays",
            "Spurious: lit path farther than the spot's radius from where the marks run. Missing: marks that no lit point reaches. \
                    The shortest on-delay with the least spurious light at starts, then the shortest off-delay with the least missing at ends.",
            delay_plots(results),
            std::iter::once(delay_table(results))
                .chain(results.iter().filter_map(front_table))
                .collect(),
        ),
    ]
}

fn tables(plan: &Plan, results: &[RecipeResult<'_>]) -> Vec<Table> {
    let compared = Comparison::new(plan, results).table();
    match &plan.work {
        Work::Plate(_) => vec![compared],
        Work::Layers(_) => std::iter::once(compared)
            .chain(results.iter().map(layer_table))
            .collect(),
    }
}

/// The layers of a file under one recipe.
fn layer_table(r: &RecipeResult<'_>) -> Table {
    let mut columns = vec!["layer", "height, mm", "vectors", "mark length, m"];
    let modes = MODES.map(|m| format!("fill rate, {}, %", m.words()));
    columns.extend(modes.iter().map(String::as_str));
    let mut table = Table::new(&format!("Layers, {}", r.recipe.name), &columns);
    for (k, layer) in r.survey.layers.iter().enumerate() {
        let mut row = vec![
            Cell::Fixed(f64::from(layer.number), 0),
            Cell::Fixed(layer.height, 3),
            Cell::Fixed(f64::from(layer.vectors), 0),
            Cell::Fixed(layer.marked / 1000.0, 2),
        ];
        let rates = r.areas.get(k).map_or(&[][..], |area| &area.rates);
        row.extend(rates.iter().map(|rate| Cell::Fixed(100.0 * rate.share, 2)));
        row.resize(columns.len(), Cell::Empty);
        table.rows.push(row);
    }
    "The surface to fill lies within half a hatch distance beside the fill lines."
        .clone_into(&mut table.note);
    table
}

/// The value below which all but 0.5 % of the points of each recipe lie.
fn reach(
    results: &[RecipeResult<'_>],
    of: &impl for<'a> Fn(&'a RecipeResult<'_>) -> &'a Histogram,
) -> f64 {
    let ends = results.iter().map(|r| of(r).quantile(0.995));
    ends.fold(0.0, f64::max)
}

/// Where such a plot ends, in words.
const REACH: &str = "Up to where all but 0.5 % of the points of each recipe lie.";

/// The share of points below each contour error, one line a recipe.
fn shares(
    title: &str,
    results: &[RecipeResult<'_>],
    of: impl for<'a> Fn(&'a RecipeResult<'_>) -> &'a Histogram,
) -> Plot {
    let reach = reach(results, &of);
    let mut plot = Plot::new(
        title,
        Axis::new("contour error", "µm").between(0.0, 1e3 * reach),
        Axis::new("share of points below", "%").between(0.0, 100.0),
    );
    for r in results {
        let h = of(r);
        let share = 100.0 / h.total().max(1) as f64;
        let mut below = 0;
        let mut points = vec![DVec2::ZERO];
        for (k, &count) in h.counts.iter().enumerate() {
            let end = (k + 1) as f64 * h.bin;
            below += count;
            points.push(DVec2::new(1e3 * end, share * below as f64));
            if end > reach {
                break;
            }
        }
        plot = plot.line(r.recipe.name.clone(), points);
    }
    plot.caption(REACH)
}

/// Shares of a histogram over its values, one stepped line a recipe.
fn steps(
    title: &str,
    label: &str,
    unit: &str,
    scale: f64,
    results: &[RecipeResult<'_>],
    of: impl for<'a> Fn(&'a RecipeResult<'_>) -> &'a Histogram,
) -> Plot {
    const STEPS: f64 = 40.0;
    let reach = reach(results, &of);
    let finest = results.iter().map(|r| of(r).bin).fold(0.0, f64::max);
    // whole bins of the histograms, so that no step falls between two
    let bins = (reach / finest / STEPS).ceil().max(1.0) as usize;
    let width = scale * finest * bins as f64;
    let count = (reach / (finest * bins as f64)).ceil().max(1.0) as usize;
    let mut plot = Plot::new(
        title,
        Axis::new(label, unit).between(0.0, count as f64 * width),
        ["share of points", "%"],
    );
    for r in results {
        let h = of(r);
        let share = 100.0 / h.total().max(1) as f64;
        let mut points = Vec::with_capacity(2 * count);
        for k in 0..count {
            let inside = h.counts.iter().skip(k * bins).take(bins).sum::<u64>();
            let value = share * inside as f64;
            points.push(DVec2::new(k as f64 * width, value));
            points.push(DVec2::new((k + 1) as f64 * width, value));
        }
        plot = plot.line(r.recipe.name.clone(), points);
    }
    plot.caption(REACH)
}

/// Where the picture of a recipe is taken, and the last vector of the area that it shows.
fn pictured(plan: &Plan, r: &RecipeResult<'_>) -> (DVec2, usize) {
    match &plan.work {
        Work::Plate(plate) => {
            let corner = plate.centre(0) + DVec2::new(0.5, -0.5) * plate.side;
            let last = r.first.vectors.len();
            (corner - DVec2::new(0.4, -0.4) * CORNER, last)
        }
        Work::Layers(_) => {
            let last = r
                .path
                .vectors
                .last()
                .map_or(0, |&v| v as usize + 1)
                .min(r.first.vectors.len());
            let turn = |i: &usize| {
                let (a, b) = (&r.first.vectors[i - 1], &r.first.vectors[*i]);
                let (from, at, to) = (r.first.start_of(i - 1), a.end, b.end);
                let cosine = (at - from)
                    .normalize_or_zero()
                    .dot((to - at).normalize_or_zero());
                (a.kind.deposits() && b.kind.deposits()).then_some(cosine)
            };
            let sharpest = (1..last)
                .filter_map(|i| Some((turn(&i)?, i)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let corner =
                sharpest.map_or_else(|| r.first.first_mark(), |(_, i)| r.first.start_of(i));
            (corner.truncate(), last)
        }
    }
}

fn corner(plan: &Plan, r: &RecipeResult<'_>) -> Plot {
    let (middle, last) = pictured(plan, r);
    let window = |p: DVec2| (p - middle).abs().max_element() < 0.6 * CORNER;
    let gap = DVec2::splat(f64::NAN);
    let mut asked = Vec::new();
    for i in 0..last {
        let v = &r.first.vectors[i];
        if v.kind.deposits() {
            let (a, b) = (r.first.start_of(i).truncate(), v.end.truncate());
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
    let mut plot = Plot::new(&r.recipe.name, ["x", "mm"], ["y", "mm"])
        .line("marked, laser on", done)
        .line("commanded marks", asked);
    plot.aspect = Aspect::Equal;
    plot
}

/// What each delay costs, for all recipes: spurious light and missing marks apart, as they differ by orders.
fn delay_plots(results: &[RecipeResult<'_>]) -> Vec<Plot> {
    type Cost = fn(&DelayScore) -> f64;
    type Side = fn(&Tuned) -> &[DelayScore];
    let on: (&str, Side, Cost) = ("laser-on delay", |t| &t.on_table, |s| s.delays.on);
    let off: (&str, Side, Cost) = ("laser-off delay", |t| &t.off_table, |s| s.delays.off);
    let plots: [(&str, _, Cost); 4] = [
        ("Starts: light beside marks", on, |s| s.spurious_start),
        ("Starts: marks missed", on, |s| s.missing_start),
        ("Ends: light beside marks", off, |s| s.spurious_end),
        ("Ends: marks missed", off, |s| s.missing_end),
    ];
    if results.iter().all(|r| r.tuned.is_none()) {
        return Vec::new();
    }
    let draw = |(title, (label, table, delay), cost): (&str, (&str, Side, Cost), Cost)| {
        let mut plot = Plot::new(title, Axis::new(label, "µs"), ["length", "mm"]);
        let mut chosen = Vec::new();
        for r in results {
            let Some(tuned) = &r.tuned else { continue };
            let point = |s: &DelayScore| DVec2::new(1e6 * delay(s), cost(s));
            plot = plot.line(
                r.recipe.name.clone(),
                table(tuned).iter().map(point).collect(),
            );
            chosen.push(point(&tuned.best));
        }
        plot.dots("chosen", chosen)
    };
    plots.map(draw).into()
}

fn delay_table(results: &[RecipeResult<'_>]) -> Table {
    let table = Table::of(
        "Delays",
        results.iter().map(|r| {
            let own = r.recipe.delays;
            let (spurious, missing) = r.tuned.as_ref().map_or((Cell::Empty, Cell::Empty), |t| {
                (
                    Cell::Fixed(t.best.spurious(), 2),
                    Cell::Fixed(t.best.missing(), 2),
                )
            });
            [
                ("recipe", Cell::text(&r.recipe.name)),
                ("on, µs", Cell::Fixed(1e6 * r.delays.on, 0)),
                ("off, µs", Cell::Fixed(1e6 * r.delays.off, 0)),
                ("spurious, mm", spurious),
                ("missing, mm", missing),
                ("recipe's own on, µs", Cell::Fixed(1e6 * own.on, 0)),
                ("recipe's own off, µs", Cell::Fixed(1e6 * own.off, 0)),
            ]
        }),
    );
    table.noted("Lengths are those of the piece that the tuning runs: two squares, or up to 4 s of a layer.")
}

/// Pairs of delays that no other beats in both lengths, at most a dozen.
fn front_table(r: &RecipeResult<'_>) -> Option<Table> {
    const ROWS: usize = 12;
    if r.front.is_empty() {
        return None;
    }
    let step = r.front.len().div_ceil(ROWS);
    let table = Table::of(
        &format!("{}: trade-offs of delays", r.recipe.name),
        r.front.iter().step_by(step).map(|s| {
            [
                ("on, µs", Cell::Fixed(1e6 * s.delays.on, 0)),
                ("off, µs", Cell::Fixed(1e6 * s.delays.off, 0)),
                ("spurious, mm", Cell::Fixed(s.spurious(), 2)),
                ("missing, mm", Cell::Fixed(s.missing(), 2)),
            ]
        }),
    );
    Some(table.noted("Less spurious light costs more missing marks; no other pair is better in both. All of them are in series/delays-N.csv."))
}

/// The first square or layer as marked by each recipe, coloured by its contour error; the first recipe is shown.
fn scene(results: &[RecipeResult<'_>]) -> Scene {
    let mut lines: Vec<LineSet> = results.iter().map(marked).collect();
    for other in lines.iter_mut().skip(1) {
        other.visibility = Visibility::Hidden;
    }
    Scene {
        lines,
        surfaces: Vec::new(),
        heights: None,
        machine: None,
    }
}

/// A polyline of one point is none.
fn drop_single(lines: &mut LineSet, scalars: &mut Vec<f32>) {
    let single = |p: &Polyline| p.first + 1 == lines.points.len();
    if lines.polylines.last().is_some_and(single) {
        lines.points.pop();
        scalars.pop();
        lines.polylines.pop();
    }
}

fn marked(r: &RecipeResult<'_>) -> LineSet {
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
            drop_single(&mut lit, &mut errors);
            lit.polylines.push(Polyline {
                first: lit.points.len(),
                layer: 1,
            });
            open = true;
        }
        let near = (vector.saturating_sub(3)..=vector)
            .map(|i| i as usize)
            .filter(|&i| r.first.vectors[i].kind.deposits())
            .map(|i| {
                distance_to_segment(
                    *hit,
                    r.first.start_of(i).truncate(),
                    r.first.vectors[i].end.truncate(),
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
    drop_single(&mut lit, &mut errors);
    lit.scalars.push(Scalar::new("contour error", "µm", errors));
    lit
}
