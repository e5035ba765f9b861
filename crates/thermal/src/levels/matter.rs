//! What stays of a layer on the finest cells: relative density, highest enthalpies, how metal froze. Tiles forget them when they
//! become coarser; here they are kept.

use crate::levels::tile::{FOLLOWED, N, PLANE, Tile};
use crate::solver::State;
use serde::{Deserialize, Serialize};

/// Columns of finest cells.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Lowest corner, mm.
    pub origin: [f64; 2],
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Edge of a cell, mm.
    pub edge: f64,
}

/// State of matter of the ground and of the layers on it, on the finest columns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Matter {
    pub(crate) frame: Frame,
    /// Height of a plane of a layer, mm.
    height: f64,
    /// Relative density of the planes that were drawn, highest first.
    planes: Vec<Vec<f32>>,
    /// Relative density below all of them.
    ground: Vec<f32>,
    /// Of fresh powder.
    fresh: f32,
}

impl Matter {
    /// The ground: metal, or powder of relative density `fresh`. Planes of layers will be `height` mm high; of `tracked` planes
    /// what becomes of them is kept.
    pub(crate) fn new(
        frame: Frame,
        [height, tracked]: [f64; 2],
        fresh: f32,
        ground: &dyn Fn([f64; 2]) -> State,
    ) -> Self {
        let [nx, ny] = frame.cells;
        let of = |n: usize| {
            let at = |a: usize, i: usize| frame.origin[a] + (i as f64 + 0.5) * frame.edge;
            match ground([at(0, n % nx), at(1, n / nx)]) {
                State::Dense => 1.0,
                State::Powder => fresh,
            }
        };
        let ground: Vec<f32> = (0..nx * ny).map(of).collect();
        Matter {
            frame,
            height,
            planes: vec![ground.clone(); (tracked / height).round() as usize],
            ground,
            fresh,
        }
    }

    /// Fresh powder on top, `planes` planes of it; `keep` planes are kept.
    pub(crate) fn add(&mut self, planes: usize, keep: usize) {
        let columns = self.ground.len();
        for _ in 0..planes {
            self.planes.insert(0, vec![self.fresh; columns]);
        }
        self.planes.truncate(keep);
    }

    /// Mean relative density of a block of columns, `edge` cells wide, from `depth` mm to `bottom` mm.
    pub(crate) fn mean(&self, first: [usize; 2], edge: usize, [depth, bottom]: [f64; 2]) -> f32 {
        let nx = self.frame.cells[0];
        let block = |values: &[f32]| {
            if edge == 1 {
                return f64::from(values[first[1] * nx + first[0]]);
            }
            let mut sum = 0.0;
            for j in first[1]..first[1] + edge {
                sum += values[j * nx + first[0]..][..edge]
                    .iter()
                    .map(|v| f64::from(*v))
                    .sum::<f64>();
            }
            sum / (edge * edge) as f64
        };
        let (mut sum, mut done) = (0.0, depth);
        let skip = ((depth / self.height + 1e-6).floor() as usize).min(self.planes.len());
        for (q, plane) in self.planes.iter().enumerate().skip(skip) {
            let end = ((q + 1) as f64 * self.height).min(bottom);
            if end <= done + 1e-9 {
                break;
            }
            sum += (end - done) * block(plane);
            done = end;
        }
        if done < bottom - 1e-9 {
            sum += (bottom - done) * block(&self.ground);
        }
        (sum / (bottom - depth)) as f32
    }
}

/// What becomes of the layer that is drawn.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    /// Highest enthalpies of the highest planes, bottom first.
    pub(crate) peak: Vec<f32>,
    /// Highest `θ` of the build plane, W/mm.
    pub(crate) skin: Vec<f32>,
    pub(crate) above: Vec<f32>,
    pub(crate) fell: Vec<f32>,
    pub(crate) rate: Vec<f32>,
}

impl Record {
    pub(crate) fn new(columns: usize, tracked: usize) -> Self {
        let followed = columns * FOLLOWED.min(tracked);
        Record {
            peak: vec![0.0; columns * tracked],
            skin: vec![0.0; columns],
            above: vec![0.0; followed],
            fell: vec![f32::NAN; followed],
            rate: vec![f32::NAN; followed],
        }
    }

    /// Writes down what a tile knows whose cells are `edge` finest ones wide; it begins anew.
    pub(crate) fn take(&mut self, tile: &mut Tile, edge: usize, matter: &mut Matter) {
        let tracked = tile.peak.len() / PLANE;
        let planes = tile.enthalpy.len() / PLANE;
        let nx = matter.frame.cells[0];
        let columns = matter.ground.len();
        let corner = tile.at.map(|t| t * N * edge);
        for p in 0..tracked {
            let k = planes - tracked + p;
            let followed = (p + FOLLOWED.min(tracked)).checked_sub(tracked);
            for n in 0..PLANE {
                let first = [corner[0] + n % N * edge, corner[1] + n / N * edge];
                let (peak, r) = (tile.peak[p * PLANE + n], tile.density[k * PLANE + n]);
                let density = &mut matter.planes[tracked - 1 - p];
                lift(density, nx, first, edge, r);
                let seen = followed.map(|q| q * PLANE + n);
                let molten = seen.filter(|m| tile.froze.above[*m] > 0.0);
                for j in first[1]..first[1] + edge {
                    let row = j * nx + first[0];
                    for v in &mut self.peak[p * columns + row..][..edge] {
                        *v = v.max(peak);
                    }
                    let (Some(m), Some(q)) = (molten, followed) else {
                        continue;
                    };
                    for at in q * columns + row..q * columns + row + edge {
                        self.above[at] += tile.froze.above[m];
                        if !tile.froze.fell[m].is_nan() {
                            self.fell[at] = tile.froze.fell[m];
                            self.rate[at] = tile.froze.rate[m];
                        }
                    }
                }
            }
        }
        if tracked > 0 {
            for (n, peak) in tile.skin.peak.iter().enumerate() {
                let first = [corner[0] + n % N * edge, corner[1] + n / N * edge];
                for j in first[1]..first[1] + edge {
                    for v in &mut self.skin[j * nx + first[0]..][..edge] {
                        *v = v.max(*peak);
                    }
                }
            }
        }
        let froze = &mut tile.froze;
        froze.above.fill(0.0);
        froze.fell.fill(f32::NAN);
        froze.rate.fill(f32::NAN);
        tile.begin_anew();
    }
}

/// A block of columns becomes as dense in the mean as the coarse cell that stood for it.
fn lift(density: &mut [f32], nx: usize, first: [usize; 2], edge: usize, r: f32) {
    if edge == 1 {
        density[first[1] * nx + first[0]] = r;
        return;
    }
    let rows = first[1]..first[1] + edge;
    let mut sum = 0.0;
    for j in rows.clone() {
        sum += density[j * nx + first[0]..][..edge].iter().sum::<f32>();
    }
    let mean = sum / (edge * edge) as f32;
    if r <= mean + 1e-6 {
        return;
    }
    for j in rows {
        for v in &mut density[j * nx + first[0]..][..edge] {
            *v = lifted(*v, mean, r);
        }
    }
}

/// Relative density of one of several cells whose mean was `mean` and is now `r`.
pub(crate) fn lifted(v: f32, mean: f32, r: f32) -> f32 {
    if r >= 1.0 {
        1.0
    } else if r > mean {
        (v + (1.0 - v) * (r - mean) / (1.0 - mean)).min(1.0)
    } else {
        v
    }
}
