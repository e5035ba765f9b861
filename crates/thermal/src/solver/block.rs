//! A block of cells in memory: enthalpy, relative density, highest enthalpy, and the passes of a time step over them.

use std::ops::Range;

use rayon::prelude::*;

use crate::material::enthalpy::Formulas;
use crate::numeric::real::Real;
use crate::solver::kernel::{Advance, HeatRow, Neighbourhood, PlaneStep, Refresh};
use crate::solver::source::Footprint;
use meltpath_numerics::vector::Level;

/// Cells below which one thread is faster than handing work to others.
const WORTH_SHARING: usize = 60_000;

/// What lies beyond a face of the block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Beyond {
    /// No heat flows.
    Nothing,
    /// `θ` is imposed on the face, W/mm.
    Imposed(f64),
}

/// Sizes of the cells of a block.
#[derive(Debug, Clone)]
pub(crate) struct Shape {
    pub(crate) cells: [usize; 2],
    pub(crate) edge: [f64; 2],
    pub(crate) heights: Vec<f64>,
}

/// State of the cells. Arrays of one value per cell, except `theta` and `conduction`, which carry one ghost cell on each
/// side in x and y, and `powder`, one flag per row with one ghost row on each side.
#[derive(Debug, Clone)]
pub(crate) struct Block<R> {
    pub(crate) shape: Shape,
    pub(crate) formulas: Formulas<R>,
    pub(crate) enthalpy: Vec<R>,
    pub(crate) density: Vec<R>,
    pub(crate) highest: Vec<R>,
    pub(crate) theta: Vec<R>,
    pub(crate) conduction: Vec<R>,
    pub(crate) powder: Vec<bool>,
    /// Heat that arrived on the highest plane since it last lost any, J/mm².
    pub(crate) arrived: Vec<R>,
    still: Vec<bool>,
    /// Planes below this one are kept but not computed.
    pub(crate) frozen: usize,
    /// Rows along x that are computed, in every plane; the others keep their state and exchange nothing with these.
    pub(crate) awake: Vec<Range<usize>>,
    /// The centres of the first column and the first row lie on planes of symmetry: a quarter of what is meant is kept. The
    /// solver's ledger does not close then: it counts these planes as faces.
    pub(crate) quarter: bool,
    pub(crate) level: Level,
}

impl<R: Real> Block<R> {
    /// A block of dense cells at the start temperature.
    pub(crate) fn new(shape: &Shape, formulas: Formulas<R>) -> Self {
        let mut block = Block {
            shape: Shape {
                heights: Vec::new(),
                ..*shape
            },
            formulas,
            enthalpy: Vec::new(),
            density: Vec::new(),
            highest: Vec::new(),
            theta: Vec::new(),
            conduction: Vec::new(),
            powder: Vec::new(),
            arrived: vec![R::ZERO; shape.cells[0] * shape.cells[1]],
            still: Vec::new(),
            frozen: 0,
            awake: std::iter::once(0..shape.cells[1]).collect(),
            quarter: false,
            level: Level::widest(),
        };
        block.append(&shape.heights);
        block
    }

    /// Adds dense planes at the start temperature on top.
    pub(crate) fn append(&mut self, heights: &[f64]) {
        self.shape.heights.extend_from_slice(heights);
        let n = self.shape.heights.len();
        let ny = self.shape.cells[1];
        self.enthalpy.resize(n * self.plane(), R::ZERO);
        self.density.resize(n * self.plane(), R::ONE);
        self.highest.resize(n * self.plane(), R::ZERO);
        self.theta.resize(n * self.ghost_plane(), R::ZERO);
        self.conduction.resize(n * self.ghost_plane(), R::ONE);
        self.powder.resize(n * (ny + 2), false);
        self.still.resize(n * ny, false);
    }

    /// Cells of a plane.
    pub(crate) fn plane(&self) -> usize {
        self.shape.cells[0] * self.shape.cells[1]
    }

    /// Cells of a plane with its ghosts.
    pub(crate) fn ghost_plane(&self) -> usize {
        (self.shape.cells[0] + 2) * (self.shape.cells[1] + 2)
    }

    pub(crate) fn planes(&self) -> usize {
        self.shape.heights.len()
    }

    /// Marks the rows that hold powder, after densities were set.
    pub(crate) fn mark_powder(&mut self) {
        let [nx, ny] = self.shape.cells;
        for (row, cells) in self.density.chunks(nx).enumerate() {
            self.powder[row / ny * (ny + 2) + row % ny + 1] = cells.iter().any(|r| *r < R::ONE);
        }
        // rows without powder are never refreshed: their share is one
        self.conduction.fill(R::ONE);
    }

    /// Rows of a plane that are computed.
    pub(crate) fn awake_rows(&self) -> usize {
        self.awake.iter().map(ExactSizeIterator::len).sum()
    }

    fn shares_work(&self) -> bool {
        (self.planes() - self.frozen) * self.awake_rows() * self.shape.cells[0] >= WORTH_SHARING
            && rayon::current_num_threads() > 1
    }

    /// First pass: `θ`, conduction and highest enthalpy from the state, and the ghosts of faces that are not neighbours.
    pub(crate) fn refresh(&mut self, sides: Beyond) {
        let share = self.shares_work();
        let (plane, ghost, ny) = (self.plane(), self.ghost_plane(), self.shape.cells[1]);
        let (cells, f, level) = (self.shape.cells, self.formulas, self.level);
        let (from, rows, quarter) = (self.frozen, &self.awake, self.quarter);
        #[expect(
            clippy::type_complexity,
            reason = "the six arrays of a plane, as the iterators zip them"
        )]
        let work = |(((((g, r), p), h), t), c): (
            ((((&[R], &[R]), &[bool]), &mut [R]), &mut [R]),
            &mut [R],
        )| {
            level.run(Refresh {
                formulas: &f,
                cells,
                rows,
                enthalpy: g,
                density: r,
                powder: p,
                highest: h,
                theta: &mut *t,
                conduction: &mut *c,
            });
            fill_ghosts(cells, rows, sides, t, c);
            if quarter {
                mirror(cells, t, c);
            }
            separate(cells, rows, t);
        };
        if share {
            self.enthalpy[from * plane..]
                .par_chunks(plane)
                .zip(self.density[from * plane..].par_chunks(plane))
                .zip(self.powder[from * (ny + 2)..].par_chunks(ny + 2))
                .zip(self.highest[from * plane..].par_chunks_mut(plane))
                .zip(self.theta[from * ghost..].par_chunks_mut(ghost))
                .zip(self.conduction[from * ghost..].par_chunks_mut(ghost))
                .for_each(work);
        } else {
            self.enthalpy[from * plane..]
                .chunks(plane)
                .zip(self.density[from * plane..].chunks(plane))
                .zip(self.powder[from * (ny + 2)..].chunks(ny + 2))
                .zip(self.highest[from * plane..].chunks_mut(plane))
                .zip(self.theta[from * ghost..].chunks_mut(ghost))
                .zip(self.conduction[from * ghost..].chunks_mut(ghost))
                .for_each(work);
        }
    }

    /// Whether a cell of row `j` differs from nothing by more than `enthalpy`, in any plane that is computed.
    pub(crate) fn row_differs(&self, j: usize, enthalpy: R) -> bool {
        let [nx, ny] = self.shape.cells;
        (self.frozen..self.planes()).any(|k| {
            self.enthalpy[(k * ny + j) * nx..][..nx]
                .iter()
                .fold(0_u32, |any, g| {
                    any | u32::from(*g > enthalpy) | u32::from(R::ZERO - *g > enthalpy)
                })
                != 0
        })
    }

    /// Second pass: one explicit step of `dt` seconds of conduction.
    pub(crate) fn advance(&mut self, dt: f64, bottom: Beyond) {
        let share = self.shares_work();
        let (plane, ghost) = (self.plane(), self.ghost_plane());
        let [nx, ny] = self.shape.cells;
        let (f, level, from, awake) = (self.formulas, self.level, self.frozen, &self.awake);
        let last = self.planes() - 1;
        let [dx, dy] = self.shape.edge;
        let floor = match bottom {
            Beyond::Imposed(theta) => vec![R::of(theta); ghost],
            Beyond::Nothing => Vec::new(),
        };
        let (heights, theta, conduction, powder) = (
            &self.shape.heights,
            &self.theta,
            &self.conduction,
            &self.powder,
        );
        #[expect(
            clippy::type_complexity,
            reason = "the three arrays of a plane, as the iterators zip them"
        )]
        let work = |(k, ((g, r), still)): (usize, ((&mut [R], &mut [R]), &mut [bool]))| {
            let k = k + from;
            let slice = |k: usize| &theta[k * ghost..][..ghost];
            let shares = |k: usize| &conduction[k * ghost..][..ghost];
            let rows = |k: usize| &powder[k * (ny + 2)..][..ny + 2];
            let imposed = k == from && matches!(bottom, Beyond::Imposed(_));
            let below = if k > from { k - 1 } else { k };
            let above = if k < last { k + 1 } else { k };
            let flows = |open: bool| {
                if open {
                    R::of(2.0 * dt / heights[k])
                } else {
                    R::ZERO
                }
            };
            let step = PlaneStep {
                cells: [nx, ny],
                across: [R::of(dt / (dx * dx)), R::of(dt / (dy * dy))],
                along: [flows(k > from || imposed), flows(k < last)],
                height: R::of(heights[k]),
                heights: [
                    if imposed {
                        R::ZERO
                    } else {
                        R::of(heights[below])
                    },
                    R::of(heights[above]),
                ],
            };
            let around = Neighbourhood {
                theta: [
                    if imposed { &floor } else { slice(below) },
                    slice(k),
                    slice(above),
                ],
                conduction: [shares(below), shares(k), shares(above)],
                powder: [rows(below), rows(k), rows(above)],
            };
            level.run(Advance {
                formulas: &f,
                rows: awake,
                step,
                around,
                enthalpy: g,
                density: r,
                still,
            });
        };
        if share {
            self.enthalpy[from * plane..]
                .par_chunks_mut(plane)
                .zip(self.density[from * plane..].par_chunks_mut(plane))
                .zip(self.still[from * ny..].par_chunks_mut(ny))
                .enumerate()
                .for_each(work);
        } else {
            self.enthalpy[from * plane..]
                .chunks_mut(plane)
                .zip(self.density[from * plane..].chunks_mut(plane))
                .zip(self.still[from * ny..].chunks_mut(ny))
                .enumerate()
                .for_each(work);
        }
        // a row that has just become dense is not refreshed any more: its share of the conductivity is one from here on
        for k in from..=last {
            for j in self.awake.iter().cloned().flatten() {
                let row = &mut self.powder[k * (ny + 2) + j + 1];
                if *row && !self.still[k * ny + j] {
                    *row = false;
                    let start = k * ghost + (j + 1) * (nx + 2);
                    self.conduction[start..start + nx + 2].fill(R::ONE);
                }
            }
        }
    }

    /// Adds `joules` of heat spread as `footprint` says.
    pub(crate) fn heat(&mut self, footprint: &Footprint, joules: f64) {
        let [nx, ny] = self.shape.cells;
        let plane = self.plane();
        let [i0, j0] = footprint.first;
        let across: Vec<R> = footprint.across[0].iter().map(|s| R::of(*s)).collect();
        if across.is_empty() {
            return;
        }
        let (f, level) = (self.formulas, self.level);
        let [dx, dy] = self.shape.edge;
        for (j, sy) in (j0..).zip(&footprint.across[1]) {
            let of_row = R::of(joules * sy / (dx * dy));
            let row = &mut self.arrived[j * nx + i0..][..across.len()];
            for (arrived, share) in row.iter_mut().zip(&across) {
                *arrived += of_row * *share;
            }
        }
        for k in self.frozen..self.planes() {
            let share = footprint.along[k];
            if share == 0.0 {
                continue;
            }
            let per_volume = joules * share / (dx * dy * self.shape.heights[k]);
            for (j, sy) in (j0..).zip(&footprint.across[1]) {
                let start = k * plane + j * nx + i0;
                let powder = self.powder[k * (ny + 2) + j + 1];
                let g = &mut self.enthalpy[start..start + across.len()];
                let r = &mut self.density[start..start + across.len()];
                level.run(HeatRow {
                    formulas: &f,
                    share: &across,
                    scale: R::of(per_volume * sy),
                    powder,
                    enthalpy: g,
                    density: r,
                });
            }
        }
    }
}

/// Rows beside awake ones show the same `θ`, so that nothing flows between: what sleeps keeps its heat.
fn separate<R: Real>([nx, ny]: [usize; 2], rows: &[Range<usize>], theta: &mut [R]) {
    let stride = nx + 2;
    for awake in rows {
        if awake.start > 0 {
            let inner = (awake.start + 1) * stride;
            theta.copy_within(inner..inner + stride, inner - stride);
        }
        if awake.end < ny {
            let inner = awake.end * stride;
            theta.copy_within(inner..inner + stride, inner + stride);
        }
    }
}

/// Ghosts before the first column and the first row: what lies as far on the other side of their centres.
fn mirror<R: Real>([nx, ny]: [usize; 2], theta: &mut [R], conduction: &mut [R]) {
    let stride = nx + 2;
    for values in [theta, conduction] {
        for j in 1..=ny {
            values[j * stride] = values[j * stride + 2];
        }
        values.copy_within(2 * stride..3 * stride, 0);
    }
}

/// Ghost cells of a plane at faces that are not neighbours, beside awake rows: mirrored, so that the face is insulated or at
/// `θ`.
fn fill_ghosts<R: Real>(
    [nx, ny]: [usize; 2],
    rows: &[Range<usize>],
    sides: Beyond,
    theta: &mut [R],
    conduction: &mut [R],
) {
    let reflect = |t: R| match sides {
        Beyond::Nothing => t,
        Beyond::Imposed(value) => R::of(2.0 * value) - t,
    };
    let stride = nx + 2;
    for j in rows.iter().cloned().flatten() {
        let row = (j + 1) * stride;
        for (ghost, inner) in [(row, row + 1), (row + nx + 1, row + nx)] {
            theta[ghost] = reflect(theta[inner]);
            conduction[ghost] = conduction[inner];
        }
    }
    let awake = |j: usize| rows.iter().any(|r| r.contains(&j));
    for (ghost, inner) in [(0, 1), (ny + 1, ny)] {
        if awake(inner - 1) {
            for i in 1..=nx {
                theta[ghost * stride + i] = reflect(theta[inner * stride + i]);
                conduction[ghost * stride + i] = conduction[inner * stride + i];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::material::tests::titanium;
    use crate::material::{CELSIUS, Material};
    use crate::solver::source::{Depth, Spot};
    use crate::solver::surface::Surface;
    use crate::solver::{Face, Faces, Solver};
    use meltpath_geometry::math::DVec3;

    fn faces(material: &Material) -> Faces {
        Faces {
            top: Surface::Evaporating {
                surroundings: 300.0 + CELSIUS,
                ambient: 0.2,
            },
            sides: Face::Imposed(material.start),
            bottom: Face::Imposed(material.start),
        }
    }

    /// A beam that melts and evaporates, under these registers.
    fn melted(level: Level) -> Vec<f32> {
        let material = titanium();
        let low = DVec3::new(-0.4, -0.4, -0.3);
        let grid = Grid::covering(low, DVec3::new(0.6, 0.4, 0.0), DVec3::splat(0.04)).unwrap();
        let mut solver = Solver::<f32>::new(grid, material.clone(), faces(&material)).unwrap();
        solver.block.level = level;
        for _ in 0..300 {
            let spot = Spot {
                centre: [0.0, 0.0],
                diameter: 0.4,
                power: 270.0,
                depth: Depth::Surface,
            };
            solver.step(2e-6, &[spot]).unwrap();
        }
        assert!(solver.ledger().evaporated > 0.0);
        solver.temperature().values
    }

    #[test]
    fn a_row_differs_by_a_warmer_or_a_colder_cell() {
        let grid = Grid::covering(DVec3::splat(-0.2), DVec3::ZERO, DVec3::splat(0.04)).unwrap();
        let material = titanium();
        let mut solver = Solver::<f64>::new(grid, material.clone(), faces(&material)).unwrap();
        let block = &mut solver.block;
        assert!(!block.row_differs(1, 0.5));
        for (cell, row) in [(0.6, true), (-0.6, true), (0.4, false), (-0.4, false)] {
            block.enthalpy[block.shape.cells[0] + 2] = cell;
            assert_eq!([0, 1].map(|j| block.row_differs(j, 0.5)), [false, row]);
        }
    }

    #[test]
    fn the_bits_do_not_depend_on_registers() {
        assert_eq!(melted(Level::PORTABLE), melted(Level::widest()));
    }
}
