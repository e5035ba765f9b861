//! Sparse voxels with fill fractions: metal of any shape, on whatever is there already. Memory is that of the surface and of what
//! was laid; whole and empty blocks cost nothing.

mod column;
mod fill;
mod surface;

use meltpath_base::parallel;
use thiserror::Error;

use crate::math::DVec3;

pub use column::{Column, Columns};
pub use fill::MeshFill;

/// Voxels along an edge of a block.
const EDGE: usize = 16;
/// Voxels of a block.
const COUNT: usize = EDGE * EDGE * EDGE;
/// The same as a step of voxel numbers.
const STEP: i64 = 16;
/// Entries of the table for blocks that hold one value throughout.
const EMPTY: u32 = u32::MAX;
const FULL: u32 = u32::MAX - 1;
/// Largest table of blocks, 256 MB: 3.2 m a side in voxels of 0.5 mm.
const MAX_TABLE: f64 = 67_108_864.0;
/// Most blocks with values of their own: 1 GiB.
const MAX_BLOCKS: usize = 65_536;

/// Why voxels could not be made or filled.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum VoxelsError {
    /// The side of a voxel is not a positive number.
    #[error("voxels: the side {cell} mm must be a positive number")]
    Cell {
        /// The value given, mm.
        cell: f64,
    },
    /// The bounds are not finite, or reversed.
    #[error(
        "voxels: bounds from ({}, {}, {}) to ({}, {}, {}) mm are not finite or are reversed",
        lo.x, lo.y, lo.z, hi.x, hi.y, hi.z
    )]
    Bounds {
        /// Lower corner given, mm.
        lo: DVec3,
        /// Upper corner given, mm.
        hi: DVec3,
    },
    /// The domain or what is in it would not fit in memory.
    #[error(
        "voxels of {cell} mm: the space or the surface in it is too large for 1 GiB; use voxels of {remedy:.2} mm or more, or check \
         the part's unit"
    )]
    TooLarge {
        /// Side of a voxel, mm.
        cell: f64,
        /// Side that is likely to fit, mm.
        remedy: f64,
    },
}

/// Metal in space: the share of each cubic voxel that is filled, 0 to 1, in a box of the part frame (mm). Nothing is outside.
///
/// - Structure: blocks of 16³ voxels in a table; blocks that are all metal or all air hold no values. Voxel (i, j, k) has its centre
///   at `origin + cell * (i, j, k)`.
/// - Volumes are sums of shares. Each addition gives back what found no room, with the rounding of the stored share, so that
///   nothing is lost.
///
/// ```
/// use meltpath_geometry::{math::DVec3, workpiece::Voxels};
/// let mut metal = Voxels::new(DVec3::splat(-5.0), DVec3::splat(15.0), 0.5).unwrap();
/// metal.fill_box(DVec3::ZERO, DVec3::new(10.0, 4.0, 2.3)).unwrap();
/// assert!((metal.volume() - 92.0).abs() < 1e-3);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Voxels {
    origin: DVec3,
    cell: f64,
    /// Blocks along each axis.
    blocks_along: [u32; 3],
    table: Vec<u32>,
    blocks: Vec<Box<[f32]>>,
}

impl Voxels {
    /// An empty box that covers `lo` to `hi` with voxels of side `cell`, mm; it overshoots by less than a block.
    ///
    /// # Errors
    /// A side or bounds that make no sense, or a box too large.
    pub fn new(lo: DVec3, hi: DVec3, cell: f64) -> Result<Self, VoxelsError> {
        if !(cell.is_finite() && cell > 0.0) {
            return Err(VoxelsError::Cell { cell });
        }
        let size = hi - lo;
        if !(lo.is_finite() && hi.is_finite() && size.is_finite()) || size.min_element() < 0.0 {
            return Err(VoxelsError::Bounds { lo, hi });
        }
        let blocks = (size / (cell * EDGE as f64) - 1e-9).ceil().max(DVec3::ONE);
        let table = blocks.element_product();
        if table > MAX_TABLE {
            let remedy = 1.01 * cell * (table / MAX_TABLE).cbrt();
            return Err(VoxelsError::TooLarge { cell, remedy });
        }
        Ok(Voxels {
            origin: lo + DVec3::splat(0.5 * cell),
            cell,
            blocks_along: blocks.to_array().map(|n| n as u32),
            table: vec![EMPTY; table as usize],
            blocks: Vec::new(),
        })
    }

    /// Side of a voxel, mm.
    pub fn cell(&self) -> f64 {
        self.cell
    }

    /// The corners of the box, mm.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let lo = self.origin - DVec3::splat(0.5 * self.cell);
        let size = self
            .blocks_along
            .map(|n| f64::from(n) * EDGE as f64 * self.cell);
        (lo, lo + DVec3::from_array(size))
    }

    /// Memory held, bytes.
    pub fn memory(&self) -> usize {
        4 * (self.table.len() + COUNT * self.blocks.len())
    }

    /// The centre of the voxel nearest to a point, mm.
    pub fn centre_near(&self, p: DVec3) -> DVec3 {
        self.origin + self.cell * ((p - self.origin) / self.cell).round()
    }

    /// Metal, mm³. Summed block by block in the table's order: the same bits on any number of threads.
    pub fn volume(&self) -> f64 {
        let of_block = |entry: &u32| match *entry {
            EMPTY => 0.0,
            FULL => COUNT as f64,
            b => self.blocks[b as usize].iter().map(|f| f64::from(*f)).sum(),
        };
        parallel::sum(&self.table, of_block) * self.cell.powi(3)
    }

    /// Whether every share is between 0 and 1 and every block has its place.
    ///
    /// # Errors
    /// What is wrong first.
    pub fn sanity_check(&self) -> Result<(), String> {
        let mut used = vec![false; self.blocks.len()];
        for entry in self.table.iter().filter(|e| **e != EMPTY && **e != FULL) {
            match used.get_mut(*entry as usize) {
                Some(u) if !*u => *u = true,
                _ => return Err(format!("block {entry} is missing or has two places")),
            }
        }
        if used.contains(&false) {
            return Err("a block has no place".to_owned());
        }
        let odd = |f: &&f32| !(0.0..=1.0).contains(*f);
        match self.blocks.iter().flatten().find(odd) {
            Some(f) => Err(format!("a voxel is filled to {f}")),
            None => Ok(()),
        }
    }

    /// Where voxel `v` is: the entry of its block and its place there; `None` outside the box.
    #[inline]
    fn place(&self, v: [i64; 3]) -> Option<(usize, usize)> {
        let [nx, ny, nz] = self.blocks_along;
        let (nx, ny, nz) = (nx as usize, ny as usize, nz as usize);
        // a negative number becomes larger than any box
        let (i, j, k) = (v[0] as usize, v[1] as usize, v[2] as usize);
        let (bi, bj, bk) = (i / EDGE, j / EDGE, k / EDGE);
        if bi >= nx || bj >= ny || bk >= nz {
            return None;
        }
        let local = ((k % EDGE) * EDGE + j % EDGE) * EDGE + i % EDGE;
        Some(((bk * ny + bj) * nx + bi, local))
    }

    /// Share of voxel `v` that is filled.
    #[inline]
    fn at(&self, v: [i64; 3]) -> f64 {
        match self.place(v) {
            None => 0.0,
            Some((block, local)) => match self.table[block] {
                EMPTY => 0.0,
                FULL => 1.0,
                b => f64::from(self.blocks[b as usize][local]),
            },
        }
    }

    /// Share filled about a point: trilinear between the centres of voxels.
    pub fn sample(&self, p: DVec3) -> f64 {
        self.sample_at((p - self.origin) / self.cell)
    }

    /// The same at a place counted in voxels from the first.
    fn sample_at(&self, g: DVec3) -> f64 {
        let (i, j, k) = (whole(g.x), whole(g.y), whole(g.z));
        let (x, y, z) = (g.x - i as f64, g.y - j as f64, g.z - k as f64);
        let last = STEP - 1;
        let inside = i & last != last && j & last != last && k & last != last;
        let mut c = [0.0; 8];
        match self.place([i, j, k]).filter(|_| inside) {
            Some((block, local)) => match self.table[block] {
                EMPTY => return 0.0,
                FULL => return 1.0,
                b => {
                    let values = &self.blocks[b as usize];
                    for (row, step) in [0, EDGE, EDGE * EDGE, EDGE * EDGE + EDGE]
                        .into_iter()
                        .enumerate()
                    {
                        c[2 * row] = f64::from(values[local + step]);
                        c[2 * row + 1] = f64::from(values[local + step + 1]);
                    }
                }
            },
            None => {
                for (n, corner) in (0..).zip(&mut c) {
                    *corner = self.at([i + (n & 1), j + (n >> 1 & 1), k + (n >> 2)]);
                }
            }
        }
        let low = (1.0 - y) * (c[0] + x * (c[1] - c[0])) + y * (c[2] + x * (c[3] - c[2]));
        let high = (1.0 - y) * (c[4] + x * (c[5] - c[4])) + y * (c[6] + x * (c[7] - c[6]));
        low + z * (high - low)
    }

    /// The values of a block, made where there were none; `None` where memory is used up.
    fn values(&mut self, block: usize) -> Option<&mut [f32]> {
        let entry = self.table[block];
        let b = if entry == EMPTY || entry == FULL {
            if self.blocks.len() >= MAX_BLOCKS {
                return None;
            }
            let value = if entry == FULL { 1.0 } else { 0.0 };
            self.blocks.push(vec![value; COUNT].into_boxed_slice());
            self.table[block] = (self.blocks.len() - 1) as u32;
            self.blocks.len() - 1
        } else {
            entry as usize
        };
        Some(&mut self.blocks[b])
    }

    /// Fills voxel `v` by `share` more, as far as there is room; returns by how much it rose.
    fn add(&mut self, v: [i64; 3], share: f64) -> f64 {
        let Some((block, local)) = self.place(v) else {
            return 0.0;
        };
        if self.table[block] == FULL {
            return 0.0;
        }
        let Some(values) = self.values(block) else {
            return 0.0;
        };
        let old = values[local];
        let new = (f64::from(old) + share).clamp(0.0, 1.0) as f32;
        values[local] = new;
        f64::from(new) - f64::from(old)
    }

    fn too_large(&self) -> VoxelsError {
        VoxelsError::TooLarge {
            cell: self.cell,
            remedy: 2.0 * self.cell,
        }
    }
}

/// The whole number at or below `x`: `floor` is a call where the processor is not known.
#[inline]
fn whole(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(towards_zero as f64 > x)
}
