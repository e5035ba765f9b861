//! Temperatures of the last layer in time: the build plane, and vertical sections through it. What they hold is bounded, however
//! large the layer is.

use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::grid::Grid;

use crate::ebm::plan::Plan;
use crate::ebm::preview::along::{Along, index};

/// Values of all pictures of the build plane at most, for each of the two quantities: 128 MB of memory.
const PLANE_VALUES: usize = 32_000_000;
/// Values of all vertical sections of all pictures at most: 5 MB of page where no two neighbours are alike.
const SECTION_VALUES: usize = 200_000;

/// One picture.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Time since the last layer began, s.
    pub time: f64,
    /// Temperatures of the build plane, K; the mean of the voxels in a cell of the picture.
    pub now: Vec<f32>,
    /// Highest so far, K; the highest of the voxels in a cell.
    pub highest: Vec<f32>,
    /// Temperatures of each section, K, row by row from below; the highest of the voxels in a cell.
    pub(crate) sections: Vec<Vec<f32>>,
}

/// A vertical section.
#[derive(Debug, Clone)]
pub(crate) struct Cut {
    pub(crate) name: String,
    pub(crate) along: Along,
    /// The voxel that it goes through, across.
    pub(crate) row: usize,
    /// Voxels in a cell of the picture.
    pub(crate) block: usize,
}

/// Where sections in time go: through the middle of the region and the places of the job.
pub(crate) fn places(plan: &Plan) -> Vec<(String, [f64; 2])> {
    let middle = (
        "the middle of the region".to_owned(),
        plan.contour.deepest(),
    );
    let chosen = plan.settings.job.simulation.sections.iter();
    let chosen = chosen
        .map(|place| place.map(|v| v.0))
        .map(|[x, y]| (format!("x {x} mm, y {y} mm"), [x, y]));
    std::iter::once(middle).chain(chosen).collect()
}

/// The pictures of a drawing.
#[derive(Debug, Clone)]
pub struct Film {
    pub(crate) grid: Grid,
    /// Voxels along each edge of a picture's cell.
    pub(crate) block: usize,
    pub(crate) cuts: Vec<Cut>,
    /// In order of time.
    pub frames: Vec<Frame>,
}

impl Film {
    /// No picture yet of a simulation on `grid` from which `frames` will be taken, with sections through `places`.
    pub(crate) fn new(grid: &Grid, frames: usize, places: &[(String, [f64; 2])]) -> Self {
        let [nx, ny] = grid.cells;
        let frames = frames.max(1);
        let fits = |block: &usize| {
            let cells = nx.div_ceil(*block) * ny.div_ceil(*block);
            cells * frames <= PLANE_VALUES
        };
        let mut cuts = Vec::new();
        for (name, place) in places {
            for along in [Along::X, Along::Y] {
                let across = along.other().axis();
                let inside = index(grid, along.axis(), place[along.axis()]).is_some();
                if let Some(row) = index(grid, across, place[across]).filter(|_| inside) {
                    cuts.push(Cut {
                        name: name.clone(),
                        along,
                        row,
                        block: 1,
                    });
                }
            }
        }
        // all sections get the same share of what there is
        let each = SECTION_VALUES / (cuts.len() * frames * grid.planes()).max(1);
        for cut in &mut cuts {
            cut.block = grid.cells[cut.along.axis()].div_ceil(each.max(1));
        }
        Film {
            grid: grid.clone(),
            block: (1..=nx.max(ny)).find(fits).unwrap_or(1),
            cuts,
            frames: Vec::new(),
        }
    }

    /// Takes a picture `time` s after the layer began.
    pub(crate) fn take(&mut self, time: f64, s: &ChartSimulation) {
        let frame = Frame {
            time,
            now: self.blocks(&s.surface_temperature(), mean),
            highest: self.blocks(&s.surface_highest(), largest),
            sections: self.cuts.iter().map(|c| self.section(c, s)).collect(),
        };
        self.frames.push(frame);
    }

    /// Cells of a picture of the build plane.
    pub(crate) fn cells(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.grid.cells[axis].div_ceil(self.block))
    }

    /// One value for each cell of a picture, from those of its voxels.
    fn blocks(&self, values: &[f32], of: fn(&[f32]) -> f32) -> Vec<f32> {
        if self.block == 1 {
            return values.to_vec();
        }
        let [nx, ny] = self.grid.cells;
        let mut inside = Vec::with_capacity(self.block * self.block);
        let mut out = Vec::new();
        for j in (0..ny).step_by(self.block) {
            for i in (0..nx).step_by(self.block) {
                inside.clear();
                for row in j..(j + self.block).min(ny) {
                    inside.extend(&values[row * nx + i..row * nx + (i + self.block).min(nx)]);
                }
                out.push(of(&inside));
            }
        }
        out
    }

    fn section(&self, cut: &Cut, s: &ChartSimulation) -> Vec<f32> {
        let length = self.grid.cells[cut.along.axis()];
        let mut out = Vec::new();
        for k in 0..self.grid.planes() {
            let row: Vec<f32> = (0..length)
                .map(|n| {
                    let (i, j) = cut.along.cell(n, cut.row);
                    s.temperature_at(i, j, k) as f32
                })
                .collect();
            out.extend(row.chunks(cut.block).map(largest));
        }
        out
    }
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

fn largest(values: &[f32]) -> f32 {
    values.iter().copied().fold(f32::MIN, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;

    fn film(size: f64, frames: usize) -> Film {
        let (low, high) = (
            DVec3::new(0.0, 0.0, -0.35),
            DVec3::new(size, 0.5 * size, 0.0),
        );
        let grid = Grid::covering(low, high, DVec3::new(0.05, 0.05, 0.05)).unwrap();
        let places: Vec<(String, [f64; 2])> = [[0.2, 0.2], [0.4, 0.1], [9e3, 0.0]]
            .iter()
            .map(|p| (format!("{p:?}"), *p))
            .collect();
        Film::new(&grid, frames, &places)
    }

    /// Whatever the layer's size, pictures hold what they may hold.
    #[test]
    fn pictures_stay_bounded() {
        for (size, frames) in [(1.0, 24), (40.0, 24), (400.0, 500)] {
            let film = film(size, frames);
            let [nx, ny] = film.cells();
            assert!(nx * ny * frames <= PLANE_VALUES, "{size}");
            // the place outside has no section
            assert_eq!(film.cuts.len(), 4);
            let of = |c: &Cut| film.grid.cells[c.along.axis()].div_ceil(c.block);
            let cells: usize = film.cuts.iter().map(of).sum();
            assert!(
                cells * film.grid.planes() * frames <= SECTION_VALUES,
                "{size}"
            );
        }
        assert_eq!(film(1.0, 24).block, 1);
    }

    #[test]
    fn a_cell_of_a_picture_is_made_of_its_voxels() {
        let mut film = film(0.25, 1);
        assert_eq!(film.grid.cells, [5, 3]);
        film.block = 2;
        let values: Vec<f32> = (0..15).map(|n| n as f32).collect();
        assert_eq!(
            film.blocks(&values, largest),
            [6.0, 8.0, 9.0, 11.0, 13.0, 14.0]
        );
        assert_eq!(film.blocks(&values, mean)[0], 3.0);
        assert_eq!(film.cells(), [3, 2]);
    }
}
