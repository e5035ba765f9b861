//! The better path as people look at it: rounds, trials, what the beam does along lines, shares on the reference solver.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::Section;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_report::table::{Cell, Table};
use meltpath_thermal::beam::{BeamPath, BeamPoint};
use meltpath_thermal::material::CELSIUS;

use super::histogram;
use super::rounds::Told;
use super::shares::Shares;
use crate::ebm::optimise::search::{Found, OnReference, Trial};
use crate::ebm::plan::Plan;
use crate::ebm::simulate::Outcome;
use crate::job::ebm::Change;

/// What the figures of a search are.
const COUNTED: &str = "Of what melts inside the contour, the rim (region.inside) left out, on the cells of the search: the judge counts the whole section, on its own.";

pub(super) type Quantity<'a> = &'a dyn Fn(&BeamPoint, f64) -> f64;

/// What there is to tell of the rounds on the judge's solver, where they were drawn there.
fn told(found: &Found) -> Option<Told<'_>> {
    let told = Told {
        rounds: &found.rounds,
        kept: found.kept,
        ceiling: None,
        file: "series/search.csv",
    };
    (!found.rounds.is_empty()).then_some(told)
}

/// Writes every round on the judge's solver.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    told(found).map_or(Ok(()), |told| told.write(folder))
}

/// What was found on the judge's solver.
fn on_judge(found: &Found, told: &Told<'_>, plan: &Plan) -> Section {
    let change = plan.settings.optimise.as_ref().map(|o| o.change);
    let change = change.unwrap_or(Change::Speed);
    let along = along_the_path(&found.path, change, plan);
    let handed = match found.kept {
        0 => " None was better than the path as given, which is handed back.",
        _ => "",
    };
    let robust = plan.settings.optimise.as_ref().and_then(|o| o.robust);
    let worth = robust
        .zip(told.rounds.get(found.kept))
        .map_or(String::new(), |(drift, round)| {
            format!(
                " A path is worth the least that it does with {:.1} % less power, as set, and with as much more: {:.1} % of the section in the window of the kept one.",
                100.0 * drift,
                100.0 * round.in_window()
            )
        });
    let cell = told.rounds.first().map_or(0.0, |round| 1e3 * round.cell);
    Section::new(
        "Better path",
        format!(
            "Looked for on the judge's solver, on cells of {cell:.1} µm, over the whole section. Paths that melt no more than {:.1} % of its area beyond the rim (checks.outside, checks.rim) come first, of these the one with most of the section in the window.{handed}{worth}",
            100.0 * plan.settings.job.checks.outside.0
        ),
        vec![
            told.by_round(),
            told.window_against_shape(plan),
            told.frontier(),
            along,
        ],
        trials(found).into_iter().chain([told.table()]).collect(),
    )
}

/// What was found.
pub(super) fn section(found: &Found, plan: &Plan, outcome: &Outcome) -> Section {
    let mut section = match told(found) {
        Some(told) => on_judge(found, &told, plan),
        None => elsewhere(found, plan),
    };
    if outcome.withdrawn {
        section.intro.push_str(
            " On the judge's own cells the path that was found is worse than the given one, which is handed back.",
        );
    }
    section
}

/// What was found on charts or on even cells.
fn elsewhere(found: &Found, plan: &Plan) -> Section {
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
    tables.extend(trials(found));
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

/// What was tried before, where anything was.
fn trials(found: &Found) -> Option<Table> {
    let outside = |trial: &Trial, n: usize| {
        let share = trial.outside.map(|shares| shares[n]);
        share.map_or(Cell::Empty, |share| Cell::Fixed(100.0 * share, 2))
    };
    let rows = found.trials.iter().map(|trial| {
        [
            ("path", Cell::text(&trial.name)),
            ("as drawn (%)", Cell::Fixed(100.0 * trial.shares[0], 1)),
            (
                "after a few rounds (%)",
                Cell::Fixed(100.0 * trial.shares[1], 1),
            ),
            ("molten outside, as drawn (%)", outside(trial, 0)),
            ("after a few rounds, outside (%)", outside(trial, 1)),
        ]
    });
    let table = Table::of("Orders and strategies tried", rows);
    let note = if found.rounds.is_empty() {
        format!(
            "Share of the molten voxels in the window; the best one was gone on with. {COUNTED}"
        )
    } else {
        "Share of the section in the window on the coarse cells of the judge's solver; the best one was gone on with, shape first.".to_owned()
    };
    (!found.trials.is_empty()).then(|| table.noted(&note))
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
