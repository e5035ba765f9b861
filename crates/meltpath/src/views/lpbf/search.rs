//! The recipe search in the report: the recipes that no other beats, all that were tried, and the found one as a file.

use std::fmt::Write as _;
use std::io;

use meltpath_base::number::significant;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::Section;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_report::series::SeriesError;
use meltpath_report::series::csv::write_columns;
use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::recipe::LaserDelays;
use meltpath_scan_head::search::{Candidate, Found};

use crate::lpbf::optimise::SIDE;
use crate::lpbf::result::{JUDGED, MODES, RecipeResult};

/// Rows of the table of recipes that nothing beats, at most.
const ROWS: usize = 14;

/// The search in the report.
pub(super) fn section(found: &Found) -> Section {
    let mut table = Table::new(
        "Recipes that no other beats",
        &[
            "time, s",
            "contours, mm/s",
            "fills, mm/s",
            "wait, ms",
            "jumps, %",
            "filter, %",
            "laser on, off, µs",
            "within, %",
            "99 %, µm",
            "unlit, µm",
            "stray, µm",
            "fill, %",
            "fills, J/m",
            "bounds",
        ],
    );
    let front = found.front();
    // the whole range of the front, and the neighbours of what was found
    let step = front.len().div_ceil(ROWS).max(1);
    let shown = front
        .iter()
        .enumerate()
        .filter(|(k, c)| k % step == 0 || found.best.as_ref() == Some(**c));
    for (_, c) in shown {
        table.rows.push(row(c));
    }
    let mut start = row(&found.start);
    if let Some(last) = start.last_mut() {
        *last = Cell::text(if found.start.within {
            "start: kept"
        } else {
            "start: not kept"
        });
    }
    table.rows.push(start);
    format!(
        "{} recipes tried on two squares of at most {SIDE} mm (or up to 4 s of a layer); times are those of the whole job. Wanted: {:.1} % of the way along contours within {:.0} µm, no more than {} mm of it without light, little more of light where no mark is, {:.1} % fill rate ({}). The found recipe is then run like the others. \
         Wait: after marks. Jumps: over the recipe's speeds. Filter: first filter of the mirrors over the head's. Within: way along contours within the bound; 99 % of it is below the next column. Unlit: longest stretch of contours without light. Stray: longest stretch of light where no mark is. Fills, J/m: power over speed.",
        found.tried.len(),
        100.0 * found.bounds.contour_share,
        1e3 * found.bounds.contour_error,
        significant(found.most_unlit, 3),
        100.0 * found.bounds.fill_rate,
        MODES[JUDGED].words()
    )
    .clone_into(&mut table.note);
    let dots = |name: &str, wanted: &dyn Fn(&Candidate) -> bool, of: &dyn Fn(&Candidate) -> f64| {
        Mark::Dots {
            name: name.to_owned(),
            points: found
                .tried
                .iter()
                .filter(|c| wanted(c) && of(c).is_finite())
                .map(|c| DVec2::new(c.duration, of(c)))
                .collect(),
        }
    };
    let times = padded(found.tried.iter().map(|c| c.duration));
    let plot = |title: &str, axis: Axis, bound: f64, of: &dyn Fn(&Candidate) -> f64| {
        let [low, high] = padded(found.tried.iter().map(of).chain([bound]));
        let time = Axis::new("time of the job", "s").between(times[0], times[1]);
        Plot::new(title, time, axis.between(low, high))
            .with(dots("keeps one bound there, or none", &|c| !c.within, of))
            .with(dots("within bounds there", &|c| c.within, of))
            .with(dots("found", &|c| found.best.as_ref() == Some(c), of))
            .limit("bound", bound)
    };
    Section::new(
        "A faster recipe",
        "Speeds, waits, jump speeds and the mirrors' first filter were searched, laser delays tuned for each: the shortest time within the bounds there; what was found is judged on the whole job by the verdict. \
                The head is judged, not the melt pool: power is that of the recipe, so faster marks bring less energy a millimetre.",
        vec![
            plot(
                "Time against contours",
                Axis::new("way along contours within the bound", "%"),
                100.0 * found.bounds.contour_share,
                &|c| 100.0 * c.contour_share,
            ),
            plot(
                "Time against fill",
                Axis::new("fill rate", "%"),
                100.0 * found.bounds.fill_rate,
                &|c| 100.0 * c.fill_rate,
            ),
        ],
        vec![table],
    )
}

/// The range of values with room for the dots at its ends.
fn padded(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let [low, high] = values
        .filter(|v| v.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| {
            [l.min(v), h.max(v)]
        });
    let room = 0.04 * (high - low);
    [low - room, high + room]
}

fn row(c: &Candidate) -> Vec<Cell> {
    let r = &c.recipe;
    vec![
        Cell::Fixed(c.duration, 3),
        Cell::Fixed(r.contour_speed, 0),
        Cell::Fixed(r.fill_speed, 0),
        Cell::Fixed(1e3 * r.mark_wait, 2),
        Cell::Fixed(100.0 * c.jump_factor, 0),
        Cell::Fixed(100.0 * c.filter_factor, 0),
        Cell::text(&format!(
            "{:.0}, {:.0}",
            1e6 * r.delays.on,
            1e6 * r.delays.off
        )),
        Cell::Fixed(100.0 * c.contour_share, 2),
        Cell::Fixed(1e3 * c.contour_error, 1),
        Cell::Fixed(1e3 * c.unlit, 0),
        Cell::Fixed(1e3 * c.stray, 0),
        Cell::Fixed(100.0 * c.fill_rate, 2),
        Cell::Fixed(1e3 * r.fill_power / r.fill_speed, 0),
        Cell::text(if c.within { "kept" } else { "not kept" }),
    ]
}

/// Writes every recipe that was tried, and the found one as a recipe file, with the delays that it has on the whole job.
pub(super) fn write(
    folder: &OutputFolder,
    found: &Found,
    results: &[RecipeResult<'_>],
) -> Result<(), OutputError> {
    folder.write("series/recipes-tried.csv", |w| {
        series(w, found).map_err(|e| match e {
            SeriesError::Io(e) => e,
            other => io::Error::other(other),
        })
    })?;
    if let Some(best) = found.best.as_ref().filter(|b| **b != found.start) {
        // what was found is run last; on the whole job its delays are tuned anew, or are the recipe's own
        let delays = results.last().map_or(best.recipe.delays, |r| r.delays);
        let text = recipe_file(best, delays);
        folder.write("recipe-optimised.toml", |w| w.write_all(text.as_bytes()))?;
    }
    Ok(())
}

fn series(w: &mut dyn io::Write, found: &Found) -> Result<(), SeriesError> {
    type Get = fn(&Candidate) -> f64;
    let columns: [(&str, &str, Get); 16] = [
        ("time", "s", |c| c.duration),
        ("contour speed", "mm/s", |c| c.recipe.contour_speed),
        ("fill speed", "mm/s", |c| c.recipe.fill_speed),
        ("jump between contours", "mm/s", |c| {
            c.recipe.contour_jump_speed
        }),
        ("jump to fill", "mm/s", |c| c.recipe.fill_jump_speed),
        ("wait after marks", "s", |c| c.recipe.mark_wait),
        ("wait after jumps", "s", |c| c.recipe.jump_wait),
        ("laser-on delay", "s", |c| c.recipe.delays.on),
        ("laser-off delay", "s", |c| c.recipe.delays.off),
        ("first filter", "1", |c| c.filter_factor),
        ("way along contours within", "1", |c| c.contour_share),
        ("contour error 99 %", "mm", |c| c.contour_error),
        ("longest contour without light", "mm", |c| c.unlit),
        ("longest light without mark", "mm", |c| c.stray),
        ("fill rate", "1", |c| c.fill_rate),
        ("within bounds", "", |c| f64::from(u8::from(c.within))),
    ];
    let all = |get: Get| found.tried.iter().map(get).collect::<Vec<f64>>();
    write_columns(w, &columns.map(|(name, unit, get)| (name, unit, all(get))))
}

/// The candidate as a file of `data/recipes` would be.
fn recipe_file(c: &Candidate, delays: LaserDelays) -> String {
    let r = &c.recipe;
    let mut text = String::from("# found by a recipe search; see report.html for its bounds\n");
    if c.filter_factor != 1.0 {
        // writing into a string does not fail
        let _ = writeln!(
            text,
            "# it needs the first filter of the x and y axes at {} of what the head's file says",
            c.filter_factor
        );
    }
    let _ = writeln!(text, "name = {}", toml::Value::from(r.name.as_str()));
    let mut line = |key: &str, value: f64, unit: &str| {
        let _ = writeln!(
            text,
            "{key} = {{ value = \"{value:.3} {unit}\", source = \"recipe search\" }}"
        );
    };
    for (key, value, unit) in [
        ("contour_speed", r.contour_speed, "mm/s"),
        ("fill_speed", r.fill_speed, "mm/s"),
        ("contour_jump_speed", r.contour_jump_speed, "mm/s"),
        ("fill_jump_speed", r.fill_jump_speed, "mm/s"),
        ("power", r.fill_power, "W"),
        ("jump_wait", 1e6 * r.jump_wait, "µs"),
        ("mark_wait", 1e6 * r.mark_wait, "µs"),
        ("polygon_wait", 1e6 * r.polygon_wait, "µs"),
        ("laser_on_delay", 1e6 * delays.on, "µs"),
        ("laser_off_delay", 1e6 * delays.off, "µs"),
    ] {
        line(key, value, unit);
    }
    if let PowerLaw::WithSpeed { least } = r.power_law {
        line("power_down_to", least, "W");
    }
    if let Some(sky) = r.sky_writing {
        line("run_in", 1e6 * sky.run_in, "µs");
        line("run_out", 1e6 * sky.run_out, "µs");
    }
    text
}
