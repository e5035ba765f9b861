//! The better path as people look at it: rounds, trials, what the beam does along lines, shares on the reference solver.

use meltpath_geometry::math::DVec2;
use meltpath_report::html::Section;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::material::CELSIUS;

use super::histogram;
use super::shares::Shares;
use crate::ebm::optimise::search::{Found, OnReference};
use crate::ebm::plan::Plan;
use crate::job::ebm::Change;

/// What the figures of a search are.
const COUNTED: &str = "Of what melts inside the contour, the rim (region.inside) left out, on the cells of the search: the judge counts the whole section, on its own.";

pub(super) type Quantity<'a> = &'a dyn Fn(&BeamPoint, f64) -> f64;

/// What was found.
pub(super) fn section(found: &Found, plan: &Plan) -> Section {
    let points = (0..)
        .zip(&found.scores)
        .map(|(n, s)| DVec2::new(f64::from(n), 100.0 * s))
        .collect();
    let rounds = Plot::new(
        "Share in the window as the search counts",
        ["round", ""],
        ["share", "%"],
    )
    .line("share", points)
    .caption(COUNTED);
    let change = plan
        .settings
        .optimise
        .as_ref()
        .map_or(Change::Speed, |o| o.change);
    let mut plots = vec![rounds, along_the_path(&found.path, change, plan)];
    let mut tables = Vec::new();
    if !found.trials.is_empty() {
        tables.push(trials(found));
    }
    let intro = match &found.reference {
        Some(r) => {
            plots.push(histogram::plot(
                "Highest temperatures on the reference solver",
                &r.given.0,
                Some(&r.better.0),
                &r.classes,
                plan,
            ));
            tables.push(shares(r, found, plan));
            r.told()
        }
        None => "Found on the charts, not judged on the reference solver here.".to_owned(),
    };
    Section::new("Better path", intro, plots, tables)
}

fn trials(found: &Found) -> Table {
    let mut table = Table::new(
        "Orders and strategies tried",
        &["path", "as drawn (%)", "after a few rounds (%)"],
    );
    for trial in &found.trials {
        table.rows.push(vec![
            Cell::text(&trial.name),
            Cell::Fixed(100.0 * trial.shares[0], 1),
            Cell::Fixed(100.0 * trial.shares[1], 1),
        ]);
    }
    table.note = format!(
        "Share of the molten voxels in the window; the best one was gone on with. {COUNTED}"
    );
    table
}

fn shares(r: &OnReference, found: &Found, plan: &Plan) -> Table {
    let rows = [
        ("as given", &plan.path, &r.given.1),
        ("better path", &found.path, &r.better.1),
    ];
    let rows = rows.map(|(name, path, tally)| Shares {
        name,
        time: path.end() - path.begin(),
        tally,
    });
    let mut table = Shares::table(
        "What the search saw: voxels inside the contour, its rim left out",
        rows,
    );
    let [low, high] = r.classes.window.map(|k| k - CELSIUS);
    table.note = format!(
        "{COUNTED} Window {low:.0} to {high:.0} °C, found on the same solver. Half the cell, half the step and 5 % of power are not tried here: see [judge]."
    );
    table
}

/// What is changed: along lines, or from spot to spot where the path is made of spots.
fn along_the_path(path: &BeamPath, change: Change, plan: &Plan) -> Plot {
    let spots = path.rests().next().is_some();
    let what = match change {
        Change::Speed | Change::Dwell if spots => "Time",
        Change::Speed | Change::Dwell => "Speed",
        Change::Current => "Beam current",
        Change::Focus => "Focus current",
    };
    let (axis, of): (Axis, Quantity<'_>) = match change {
        Change::Speed | Change::Dwell => (Axis::new("speed", "mm/s"), &|_, speed| speed),
        Change::Current => (Axis::new("beam current", "mA"), &|p, _| {
            1e3 * plan.gun.current(p.power)
        }),
        Change::Focus => (Axis::new("focus current", "mA"), &|p, _| {
            1e3 * plan.gun.coil(p.spot)
        }),
    };
    if !spots {
        return along_lines(path, &format!("{what} along lines"), axis, of);
    }
    let timed = matches!(change, Change::Speed | Change::Dwell);
    let axis = if timed {
        Axis::new("time on a spot", "µs")
    } else {
        axis
    };
    let points = path.rests().map(|[from, to]| {
        let p = path.at(from);
        let value = if timed {
            1e6 * (to - from)
        } else {
            of(&p, 0.0)
        };
        DVec2::new(plan.contour.depth([p.x, p.y]), value)
    });
    let dots = Mark::Dots {
        name: "spot".to_owned(),
        points: points.collect(),
    };
    let inside = Axis::new("distance to the contour", "mm");
    Plot::new(&format!("{what} on each spot"), inside, axis).with(dots)
}

/// A quantity along chosen lines of the path: near the beginning, in the middle, near the end.
pub(super) fn along_lines(path: &BeamPath, title: &str, axis: Axis, of: Quantity<'_>) -> Plot {
    let mut plot = Plot::new(title, ["x", "mm"], axis);
    for (name, share) in [("a tenth", 0.1), ("half", 0.5), ("nine tenths", 0.9)] {
        let points = line_at(path, path.begin() + share * (path.end() - path.begin()), of);
        plot = plot.line(format!("after {name} of the time"), points);
    }
    plot.caption("Each line of the path that is drawn at that time, over its whole length.")
}

/// A move with the beam on.
struct Stretch {
    time: f64,
    ends: [DVec2; 2],
    value: f64,
}

/// The straight run through the point at `time`: from turn to turn.
fn line_at(path: &BeamPath, time: f64, of: Quantity<'_>) -> Vec<DVec2> {
    let moves: Vec<Stretch> = path
        .points()
        .windows(2)
        .filter(|w| w[0].is_on() && w[1].time > w[0].time)
        .map(|w| {
            let ends = [DVec2::new(w[0].x, w[0].y), DVec2::new(w[1].x, w[1].y)];
            let speed = ends[0].distance(ends[1]) / (w[1].time - w[0].time);
            Stretch {
                time: w[0].time,
                ends,
                value: of(&w[0], speed),
            }
        })
        .collect();
    let Some(last) = moves.len().checked_sub(1) else {
        return Vec::new();
    };
    let here = moves.partition_point(|m| m.time <= time).saturating_sub(1);
    let joined = |a: &Stretch, b: &Stretch| {
        let [u, v] = [a, b].map(|m| m.ends[1] - m.ends[0]);
        a.ends[1].distance(b.ends[0]) < 1e-6 && u.dot(v) > 0.99 * u.length() * v.length()
    };
    let mut from = here;
    while from > 0 && joined(&moves[from - 1], &moves[from]) {
        from -= 1;
    }
    let mut to = here;
    while to < last && joined(&moves[to], &moves[to + 1]) {
        to += 1;
    }
    moves[from..=to]
        .iter()
        .map(|m| DVec2::new(0.5 * (m.ends[0].x + m.ends[1].x), m.value))
        .collect()
}
