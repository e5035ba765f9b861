//! Maps of the last layer on the reference solver: how its metal froze, and where it does not melt down to what lies below.

use std::io;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::DVec3;
use meltpath_report::vtk::{Field as Array, Volume, write_volume};
use meltpath_thermal::criteria::{front_speed, gradient};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::CELSIUS;

use crate::ebm::simulate::Outcome;

/// The maps.
const FRONT: &str = "fields/front-reference.vti";

/// Writes the maps of the path that the run judges, one plane of cells; not a number where nothing melted.
///
/// # Errors
/// [`OutputError`].
pub(super) fn write(folder: &OutputFolder, outcome: &Outcome) -> Result<(), OutputError> {
    let Some(judged) = &outcome.judged else {
        return Ok(());
    };
    let path = judged.better.as_ref().unwrap_or(&judged.given);
    let frozen = &path.watched.freezing;
    let (steep, speed) = (
        gradient(&frozen.fell, &frozen.rate),
        front_speed(&frozen.fell),
    );
    let grid = &frozen.fell.grid;
    let columns = grid.cells[0] * grid.cells[1];
    let top = |field: &Field| field.values[field.values.len() - columns..].to_vec();
    let lower = grid.heights[..grid.planes() - 1].iter().sum::<f64>();
    let volume = Volume {
        origin: grid.origin + DVec3::new(0.0, 0.0, lower),
        spacing: DVec3::new(grid.edge[0], grid.edge[1], grid.heights[grid.planes() - 1]),
        cells: [grid.cells[0], grid.cells[1], 1],
    };
    let celsius = |field: &Field| -> Vec<f32> {
        let kelvin = top(field);
        kelvin.iter().map(|k| k - CELSIUS as f32).collect()
    };
    let arrays = [
        ("gradient", "K/mm", top(&steep)),
        ("front speed", "mm/s", top(&speed)),
        ("cooling rate", "K/s", top(&frozen.rate)),
        ("time molten", "s", top(&frozen.above)),
        ("solidified", "s", top(&frozen.fell)),
        ("highest temperature", "°C", celsius(&path.highest)),
        ("highest temperature at the foot", "°C", celsius(&path.foot)),
    ];
    folder.write(FRONT, |w| {
        let fields = arrays.iter();
        let fields: Vec<Array> = fields
            .map(|(name, unit, values)| Array::floats(name, unit, values))
            .collect();
        write_volume(w, &volume, &fields).map_err(io::Error::other)
    })
}
