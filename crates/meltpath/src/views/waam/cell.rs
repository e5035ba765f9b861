//! The robot cell in the report: what the 3D view moves, where its axes stand, pictures of its key moments.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec2;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::{self, Mark, Plot};
use meltpath_robot::cell::{Cell, Values};
use meltpath_robot::kinematics::Limits;
use meltpath_robot::summary::CommandRecord;

use super::machine::machine;
use super::{joints, pictures};
use crate::waam::drive::film::{Film, Moment, moments, timed};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;

/// Points of a line that a plot shows at most.
const PLOTTED: usize = 2000;

/// Where each axis stands within its limits, along the build.
fn section(cell: &Cell, moments: &[Moment]) -> Section {
    let every = moments.len().div_ceil(PLOTTED).max(1);
    let shown = || moments.iter().step_by(every);
    // from -100 % at the lower limit to 100 % at the upper one
    let line = |name: &str, limits: Limits, value: &dyn Fn(&Values) -> f64| Mark::Line {
        name: name.to_owned(),
        points: shown()
            .map(|m| {
                let middle = 0.5 * (limits.low + limits.high);
                let share = (value(&m.values) - middle) / (0.5 * (limits.high - limits.low));
                DVec2::new(m.time / 60.0, 100.0 * share)
            })
            .collect(),
    };
    let arm = cell.arm.chain.joints.iter().enumerate();
    let arm = arm.map(|(i, j)| line(&j.name, j.limits, &move |v| cell.arm.shown(v.arm)[i]));
    let mut plots = vec![within("Joints of the arm", arm.collect())];
    let track = cell.track.iter().flat_map(|t| &t.joints);
    let track = track.map(|j| line(&j.name, j.limits, &|v| v.track));
    let positioner = cell.positioner.iter().flat_map(|p| &p.joints).enumerate();
    let positioner = positioner.map(|(i, j)| line(&j.name, j.limits, &move |v| v.positioner[i]));
    let beside: Vec<Mark> = track.chain(positioner).collect();
    if !beside.is_empty() {
        plots.push(within("Track and positioner", beside));
    }
    Section {
        title: "Robot".to_owned(),
        intro: "Where each axis stands within its limits: 0 % in the middle, 100 % at a limit."
            .to_owned(),
        plots,
        tables: Vec::new(),
    }
}

fn within(title: &str, lines: Vec<Mark>) -> Plot {
    let plot = Plot::new(
        title,
        plot::Axis::new("time", "min"),
        plot::Axis::new("of the way to a limit", "%").between(-105.0, 105.0),
    );
    let limits = [-100.0, 100.0].map(|value| Mark::Limit {
        name: "limit".to_owned(),
        value,
    });
    lines.into_iter().chain(limits).fold(plot, Plot::with)
}

/// Adds the cell to a report, and its joints and pictures of its key moments to the run's folder, where the way of its axes is known.
///
/// # Errors
/// [`OutputError`].
pub(crate) fn show(
    folder: &OutputFolder,
    report: &mut Report,
    settings: &Settings,
    (film, records): (&Film, &[CommandRecord]),
    (commands, body): (&Commands, Option<&Mesh>),
) -> Result<(), OutputError> {
    let cell = settings.robot.as_ref();
    let Some(cell) = cell.filter(|_| !film.steps.is_empty()) else {
        return Ok(());
    };
    let moments = moments(&film.steps, records, &commands.layer_of_command);
    if let Some(scene) = &mut report.scene {
        scene.machine = Some(machine(cell, &moments));
    }
    let mut section = section(cell, &moments);
    let build = pictures::Build {
        cell,
        settings,
        commands,
        records,
        body,
    };
    section.tables.push(pictures::write(folder, &build, film)?);
    report.sections.push(section);
    joints::write(folder, cell, timed(&film.steps, records), commands)
}
