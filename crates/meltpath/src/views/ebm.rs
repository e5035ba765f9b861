//! From temperatures to what people look at: the report, ParaView fields, tables.

mod corrected;
mod drift;
mod film;
mod found;
mod front;
mod histogram;
mod layers;
mod part;
mod rounds;
mod sections;
mod shares;
mod voxels;

use std::fmt::Write as _;
use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Provenance, Verdict};
use meltpath_geometry::math::DVec3;
use meltpath_gun::record::Record;
use meltpath_report::html::{Report, Section};
use meltpath_report::scene::{
    HeightLayers, LineSet, Polyline, Scalar, Scene, SceneError, Stroke, Visibility,
};
use meltpath_report::table::{Cell, Table};
use meltpath_report::vtk::{Field as Image, write_collection, write_height_image};
use meltpath_thermal::criteria::Class;
use meltpath_thermal::material::CELSIUS;

use self::shares::Shares;
use crate::ebm::judge::of_all;
use crate::ebm::plan::Plan;
use crate::ebm::plan::path_file::write_parquet;
use crate::ebm::preview::drawn::Drawn;
use crate::ebm::settings::Good;
use crate::ebm::simulate::{Outcome, Preview};

fn celsius(kelvin: &[f32]) -> Vec<f32> {
    kelvin.iter().map(|k| k - CELSIUS as f32).collect()
}

/// Temperatures of the build plane in time; the slider of the view goes through the frames.
fn heights(drawn: &Drawn) -> Result<HeightLayers, SceneError> {
    let grid = film::plane(&drawn.film);
    let frames = &drawn.film.frames;
    let mut layers = HeightLayers::new("build plane", grid, frames.len())?
        .with_scalar(Scalar::new("highest temperature so far", "°C", Vec::new()))
        .with_scalar(Scalar::new("temperature", "°C", Vec::new()));
    let flat = vec![drawn.highest.grid.top(); grid.nx * grid.ny];
    let shown =
        |kelvin: &[f32]| -> Vec<f64> { kelvin.iter().map(|k| f64::from(*k) - CELSIUS).collect() };
    for (n, frame) in frames.iter().enumerate() {
        let (highest, now) = (shown(&frame.highest), shown(&frame.now));
        layers.push(n as u32 + 1, &flat, &[&highest, &now])?;
    }
    Ok(layers)
}

/// The beam path while the beam is on, coloured by speed, cut at the frames.
fn beam_lines(drawn: &Drawn) -> LineSet {
    let z = drawn.highest.grid.top() + 0.01;
    let path = &drawn.path;
    let (mut points, mut speeds, mut polylines) = (Vec::new(), Vec::new(), Vec::new());
    let mut before: Option<(u32, DVec3)> = None;
    for w in path
        .points()
        .windows(2)
        .filter(|w| w[0].is_on() && w[1].time > w[0].time)
    {
        let (a, b) = (DVec3::new(w[0].x, w[0].y, z), DVec3::new(w[1].x, w[1].y, z));
        let time = w[0].time - path.begin();
        let frame = drawn.film.frames.partition_point(|f| f.time < time) as u32 + 1;
        let speed = (a.distance(b) / (w[1].time - w[0].time)) as f32;
        if before != Some((frame, a)) {
            polylines.push(Polyline {
                first: points.len(),
                layer: frame,
            });
            points.push(a);
            speeds.push(speed);
        }
        points.push(b);
        speeds.push(speed);
        before = Some((frame, b));
    }
    LineSet {
        name: "beam".to_owned(),
        points,
        polylines,
        scalars: vec![Scalar::new("speed", "mm/s", speeds)],
        stroke: Stroke::Hairline,
        visibility: Visibility::Shown,
    }
}

fn share_table(preview: &Preview) -> Table {
    fn row<'a>(name: &'static str, drawn: &'a Drawn) -> Shares<'a> {
        Shares {
            name,
            time: drawn.path.end() - drawn.path.begin(),
            tally: &drawn.tally,
        }
    }
    let better = preview.better.as_ref().map(|d| row("better path", d));
    let rows = std::iter::once(row("as given", &preview.given)).chain(better);
    let mut table = Shares::table("Voxels of the region", rows);
    let grid = preview.given.simulation.grid();
    table.note = format!(
        "Chart simulation; voxels of {:.0} x {:.0} x {:.0} µm, steps of {:.2} µs. Shares of the molten voxels, unmelted of all.",
        1e3 * grid.edge[0],
        1e3 * grid.edge[1],
        1e3 * grid.heights[0],
        1e6 * preview.given.simulation.settings().step
    );
    table
}

/// How the window of each run lies, and what is told where power drifts, in words.
fn on_its_window(window: &Good) -> [&'static str; 2] {
    match window {
        Good::Limits { .. } => [
            "Every run has the same window: an error of the efficiency or of the power's reading moves the temperatures alone.",
            "",
        ],
        Good::Path { .. } | Good::Body { .. } => [
            "Every run has its own window, round the good body drawn with the same cell, step, ground and power: an error of the efficiency or of the power's reading hits both.",
            " In the window as it was: what is left where the power changes after the good body was built.",
        ],
    }
}

/// Shares on the reference solver, each with what moves it.
fn judged_table(plan: &Plan, outcome: &Outcome) -> Option<Table> {
    let judged = outcome.judged.as_ref()?;
    let mut table = Table::new(
        "Judged on the reference solver",
        &[
            "run",
            "cell (µm)",
            "step (µs)",
            "voxels",
            "unmelted (%)",
            "below the window (%)",
            "in window (%)",
            "above it (%)",
            "not fused to the metal below (%)",
            "molten outside (%)",
            "farthest (mm)",
            "change (points)",
            "in the window as it was (%)",
            "mean (°C)",
            "vapour (% of the heat)",
            "error of the heat (%)",
        ],
    );
    let height = plan.settings.job.ebm.layer.0;
    let cell =
        |edge: f64, height: f64| Cell::text(&format!("{:.1} x {:.1}", 1e3 * edge, 1e3 * height));
    let paths = [
        ("as given", Some(&judged.given)),
        ("better path", judged.better.as_ref()),
    ];
    for (name, path) in paths.into_iter().filter_map(|(n, p)| Some((n, p?))) {
        let share = path.in_window();
        for (n, run) in path.runs.iter().enumerate() {
            let change = n.checked_sub(1).map(|n| 100.0 * share.changes[n].1);
            let words = match (n, share.converged(), share.robust()) {
                (0, ..) if share.changes.is_empty() => format!("{name}, one run"),
                (0, true, true) => format!("{name}, converged"),
                (0, true, false) => format!("{name}, converged, NOT ROBUST"),
                (0, false, _) => format!("{name}, NOT CONVERGED"),
                _ => run.variant.words().to_owned(),
            };
            let t = &run.tally;
            let of = |class| Cell::Fixed(100.0 * of_all(t, class), 1);
            table.rows.push(vec![
                Cell::Text(words),
                cell(
                    run.resolution.cell,
                    height / f64::from(run.resolution.planes),
                ),
                Cell::Fixed(1e6 * run.resolution.step, 2),
                Cell::Fixed(t.voxels as f64, 0),
                of(Class::Unmelted),
                of(Class::Porous),
                of(Class::Good),
                of(Class::Overheated),
                run.unfused
                    .map_or(Cell::Empty, |share| Cell::Fixed(100.0 * share, 1)),
                Cell::Fixed(100.0 * run.outside.share, 1),
                Cell::Fixed(run.outside.farthest, 2),
                change.map_or(Cell::Empty, |c| Cell::Fixed(c, 1)),
                Cell::Fixed(100.0 * of_all(&run.as_it_was, Class::Good), 1),
                Cell::Fixed(t.mean - CELSIUS, 0),
                Cell::Fixed(100.0 * run.ledger.vapour_share(), 1),
                Cell::Fixed(100.0 * run.residual, 4),
            ]);
        }
        let Some((t, preview)) = path.on_charts.as_ref().zip(outcome.preview.as_ref()) else {
            continue;
        };
        let simulation = &preview.given.simulation;
        table.rows.push(vec![
            Cell::text("same voxels on charts"),
            cell(simulation.grid().edge[0], height),
            Cell::Fixed(1e6 * simulation.settings().step, 2),
            Cell::Fixed(t.voxels as f64, 0),
            Cell::Fixed(100.0 * of_all(t, Class::Unmelted), 1),
            Cell::Fixed(100.0 * of_all(t, Class::Porous), 1),
            Cell::Fixed(100.0 * of_all(t, Class::Good), 1),
            Cell::Fixed(100.0 * of_all(t, Class::Overheated), 1),
            Cell::Empty,
            Cell::Empty,
            Cell::Empty,
            Cell::Empty,
            Cell::Empty,
            Cell::Fixed(t.mean - CELSIUS, 0),
        ]);
    }
    let [low, high] = judged.classes.window.map(|k| k - CELSIUS);
    let [placed, drifts] = on_its_window(&plan.settings.window);
    table.note = format!(
        "Solver for whole layers: finite volumes in enthalpy on levels of cells, explicit, 32-bit fields; the first change is against the run as set, all others against the run with twice the cell; window of the run as set {low:.0} to {high:.0} °C on its scale. Shares of all points of the section, at the depth of judge.depth; what is molten beyond the rim outside the contour as a share of the section. {placed} A share that moves by more than 5 points with cell, step, planes or ground is not converged: compare it with shares of the same cell and step only. One that so much power moves is not robust.{drifts}"
    );
    Some(table)
}

/// The report.
pub fn report(
    title: &str,
    plan: &Plan,
    outcome: &Outcome,
    verdict: &Verdict,
    provenance: &Provenance,
) -> Report {
    let shown = outcome.preview.as_ref().map(Preview::shown);
    let scene = shown.and_then(|drawn| {
        let heights = heights(drawn).ok()?;
        Some(Scene {
            lines: vec![beam_lines(drawn)],
            surfaces: Vec::new(),
            heights: Some(heights),
            machine: None,
        })
    });
    let mut sections: Vec<Section> = outcome.preview.iter().map(|p| highest(p, plan)).collect();
    if let Some(table) = judged_table(plan, outcome) {
        sections.push(Section::new(
            "The judge",
            "The paths drawn on the reference solver, and what moves the share.",
            outcome
                .judged
                .iter()
                .flat_map(|j| [histogram::judged(j, plan), drift::plot(j)])
                .collect(),
            std::iter::once(table)
                .chain(outcome.judged.iter().map(drift::table))
                .chain(layers::table(outcome))
                .collect(),
        ));
    }
    let found = outcome.found.iter();
    sections.extend(found.map(|f| found::section(f, plan, outcome)));
    sections.extend(
        outcome
            .corrected
            .iter()
            .map(|c| corrected::section(c, plan)),
    );
    sections.push(sections::section(&plan.settings, outcome));
    sections.extend(part::section(plan));
    Report {
        title: title.to_owned(),
        subtitle: subtitle(plan, outcome),
        verdict: verdict.clone(),
        scene,
        sections,
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// What was drawn, in a line.
fn subtitle(plan: &Plan, outcome: &Outcome) -> String {
    let mut told = plan.settings.material.name.clone();
    let window = |w: [f64; 2]| {
        format!(
            " · window {:.0} to {:.0} °C",
            w[0] - CELSIUS,
            w[1] - CELSIUS
        )
    };
    if let Some(preview) = &outcome.preview {
        let voxels = preview.given.simulation.grid().len();
        let _ = write!(told, " · {voxels} voxels");
        told.push_str(&window(preview.classes.window));
    } else if let Some(judged) = &outcome.judged {
        told.push_str(&window(judged.classes.window));
    }
    told
}

/// How hot each voxel became on charts.
fn highest(preview: &Preview, plan: &Plan) -> Section {
    Section::new(
        "Highest temperatures",
        "How hot each voxel of the last layer became. In the view above the slider goes through time; its steps are pictures, not layers.",
        vec![histogram::plot(
            "Highest temperatures",
            &preview.given.highest,
            preview.better.as_ref().map(|b| &b.highest),
            &preview.classes,
            plan,
        )],
        vec![share_table(preview)],
    )
}

/// Writes ParaView fields, the voxels' table and the paths.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(
    folder: &OutputFolder,
    plan: &Plan,
    outcome: &Outcome,
) -> Result<(), OutputError> {
    if let Some(preview) = &outcome.preview {
        write_frames(folder, preview.shown())?;
    }
    let path = outcome.path(plan);
    let record = || Record::of(&path.motion(), &plan.gun).map_err(io::Error::other);
    folder.write("path.csv", |w| w.write_all(record()?.to_csv().as_bytes()))?;
    folder.write("path.parquet", |w| write_parquet(&record()?, w))?;
    if let Some(last) = outcome.gun.as_ref().and_then(|gun| gun.drawn.last()) {
        let drawn = || Record::of(&last.motion, &plan.gun).map_err(io::Error::other);
        folder.write("drawn.csv", |w| w.write_all(drawn()?.to_csv().as_bytes()))?;
    }
    if let Some(found) = &outcome.found {
        found::write(folder, found)?;
    }
    if let Some(found) = &outcome.corrected {
        corrected::write(folder, found)?;
    }
    sections::write_volumes(folder, outcome)?;
    front::write(folder, outcome)?;
    layers::write(folder, outcome)?;
    voxels::write(folder, plan, outcome)
}

/// Pictures of the build plane in time.
fn write_frames(folder: &OutputFolder, shown: &Drawn) -> Result<(), OutputError> {
    let grid = film::plane(&shown.film);
    let mut entries = Vec::new();
    for (n, frame) in shown.film.frames.iter().enumerate() {
        let name = format!("frames/{:03}.vti", n + 1);
        let (now, highest) = (celsius(&frame.now), celsius(&frame.highest));
        folder.write(&format!("fields/{name}"), |w| {
            let fields = [
                Image::floats("temperature", "°C", &now),
                Image::floats("highest temperature", "°C", &highest),
            ];
            write_height_image(w, &grid, shown.highest.grid.top(), &fields)
                .map_err(io::Error::other)
        })?;
        entries.push((frame.time, name));
    }
    folder.write("fields/temperature.pvd", |w| write_collection(w, &entries))
}
