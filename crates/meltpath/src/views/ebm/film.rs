//! Temperatures of the last layer in time: the grid of the pictures of the build plane, and the plots of the sections.

use meltpath_geometry::math::DVec2;
use meltpath_report::colour::ColourMap;
use meltpath_report::plot::{Axis, Film as Shots, Map, Mark, Plot, Shot};
use meltpath_report::scene;
use meltpath_thermal::material::CELSIUS;

use crate::ebm::preview::film::{Cut, Film};

/// The cells of the pictures of the build plane.
pub(super) fn plane(film: &Film) -> scene::Grid {
    let [nx, ny] = film.cells();
    let cell = film.block as f64 * film.grid.edge[0];
    scene::Grid {
        origin: DVec2::new(
            film.grid.origin.x + 0.5 * cell,
            film.grid.origin.y + 0.5 * film.block as f64 * film.grid.edge[1],
        ),
        cell,
        nx,
        ny,
    }
}

/// The sections in time, each with a slider.
pub(super) fn plots(film: &Film) -> Vec<Plot> {
    let cuts = film.cuts.iter().enumerate();
    cuts.map(|(n, cut)| plot(film, n, cut)).collect()
}

fn plot(film: &Film, n: usize, cut: &Cut) -> Plot {
    let grid = &film.grid;
    let axis = cut.along.axis();
    let columns = grid.cells[axis].div_ceil(cut.block);
    let low = grid.origin[axis];
    let end = low + (columns * cut.block) as f64 * grid.edge[axis];
    let all = || film.frames.iter().flat_map(|f| &f.sections[n]);
    let hottest = all().copied().fold(f32::MIN, f32::max);
    let coldest = all().copied().fold(f32::MAX, f32::min);
    let range = [coldest, hottest].map(|k| f64::from(k) - CELSIUS);
    let shots = film.frames.iter().map(|frame| Shot {
        label: format!("{:.2} ms", 1e3 * frame.time),
        map: Map {
            name: "temperature".to_owned(),
            unit: "°C".to_owned(),
            corners: [DVec2::new(low, grid.origin.z), DVec2::new(end, grid.top())],
            columns,
            values: frame.sections[n]
                .iter()
                .map(|k| f64::from(*k) - CELSIUS)
                .collect(),
            range: (range[0] < range[1]).then_some(range),
            colours: ColourMap::Sequential,
        },
    });
    let across = cut.along.other();
    let (i, j) = cut.along.cell(0, cut.row);
    let at = grid.centre(i, j, 0)[across.axis()];
    Plot::new(
        &format!("In time along {} through {}", cut.along.name(), cut.name),
        Axis::new(cut.along.name(), "mm").between(low, end),
        Axis::new("z", "mm").between(grid.origin.z, grid.top()),
    )
    .with(Mark::Film(Shots {
        name: "time".to_owned(),
        shots: shots.collect(),
    }))
    .caption(&format!("At {} = {at:.2} mm, on charts.", across.name()))
}
