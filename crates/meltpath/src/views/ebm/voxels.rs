//! Voxels of the build plane that melted, and temperatures in time, as tables: those of charts and of the reference solver
//! alike, so that `meltpath compare` takes either.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_thermal::criteria::gradient;
use meltpath_thermal::grid::Field;
use meltpath_thermal::grid::sample::Sample;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::watch::Freezing;

use crate::ebm::judge::{JudgedPath, TEMPERATURES_REFERENCE, VOXELS_REFERENCE};
use crate::ebm::plan::Plan;
use crate::ebm::simulate::{Outcome, top};
use crate::views::write_csv;

/// Voxels that melted, of the charts.
const VOXELS: &str = "series/voxels.csv";

/// What is told of the voxels; each field's top plane is that of the build.
struct Voxels<'a> {
    highest: &'a Field,
    /// How far under the build plane temperatures are read, mm; those of charts in the middle of their uppermost voxels.
    depth: Option<f64>,
    freezing: &'a Freezing,
}

/// Writes the tables of the path that the run shows.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(
    folder: &OutputFolder,
    plan: &Plan,
    outcome: &Outcome,
) -> Result<(), OutputError> {
    let liquidus = plan.settings.material.liquidus;
    if let Some(preview) = &outcome.preview {
        let shown = preview.shown();
        let of_charts = Voxels {
            highest: &shown.highest,
            depth: None,
            freezing: &shown.simulation.freezing(),
        };
        voxels(folder, VOXELS, &of_charts, liquidus)?;
    }
    let Some(judged) = &outcome.judged else {
        return Ok(());
    };
    let path: &JudgedPath = judged.better.as_ref().unwrap_or(&judged.given);
    let seen = &path.watched;
    let of_solver = Voxels {
        highest: &path.highest,
        depth: plan.settings.judge.as_ref().map(|j| j.depth),
        freezing: &seen.freezing,
    };
    voxels(folder, VOXELS_REFERENCE, &of_solver, liquidus)?;
    if seen.samples.is_empty() {
        return Ok(());
    }
    let begin = outcome.path(plan).begin();
    let of = |f: &dyn Fn(&Sample) -> f64| seen.samples.iter().map(f).collect::<Vec<f64>>();
    write_csv(
        folder,
        TEMPERATURES_REFERENCE,
        &[
            ("x", "mm", of(&|s| s.place[0])),
            ("y", "mm", of(&|s| s.place[1])),
            ("z", "mm", of(&|s| s.place[2])),
            ("t", "s", of(&|s| s.time + begin)),
            ("T", "°C", of(&|s| s.value - CELSIUS)),
        ],
    )
}

/// The voxels of the build plane that melted, one a line.
fn voxels(
    folder: &OutputFolder,
    name: &str,
    voxels: &Voxels<'_>,
    liquidus: f64,
) -> Result<(), OutputError> {
    let Freezing { above, fell, rate } = voxels.freezing;
    let steep = gradient(fell, rate);
    let kelvin = top(voxels.highest);
    let kept: Vec<usize> = (0..kelvin.len())
        .filter(|n| kelvin[*n] >= liquidus)
        .collect();
    let grid = &voxels.highest.grid;
    let (nx, plane) = (grid.cells[0], grid.planes() - 1);
    let pick = |field: &Field| {
        let values = top(field);
        kept.iter().map(|n| values[*n]).collect::<Vec<f64>>()
    };
    let centre = |axis: usize| {
        let at = kept
            .iter()
            .map(|n| grid.centre(n % nx, n / nx, plane)[axis]);
        at.collect::<Vec<f64>>()
    };
    let height = match voxels.depth {
        None => centre(2),
        Some(depth) => {
            let build = grid.origin.z + grid.heights.iter().sum::<f64>();
            vec![build - depth; kept.len()]
        }
    };
    let columns = [
        ("x", "mm", centre(0)),
        ("y", "mm", centre(1)),
        ("z", "mm", height),
        (
            "highest_temperature",
            "°C",
            kept.iter().map(|n| kelvin[*n] - CELSIUS).collect(),
        ),
        ("time_molten", "s", pick(above)),
        ("solidified", "s", pick(fell)),
        ("cooling_rate", "K/s", pick(rate)),
        ("gradient", "K/mm", pick(&steep)),
    ];
    write_csv(folder, name, &columns)
}
