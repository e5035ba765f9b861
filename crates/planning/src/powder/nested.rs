//! Nested contours of any region with holes, nearer together where more energy is wanted: level sets of a field that counts
//! passes.
//!
//! Béraud 2016, section 2.4.2; the rule for general zones is ours: |∇N| = q / Q with N = 0 on the
//! boundary, Q the energy of a pass per length and layer, contours at N = ½, 1½, … The field is found by fast marching
//! (Sethian 1996, first order, upwind).

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::slice;

use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::overhang::distance;
use meltpath_geometry::raster::{Grid, Mask, rasterise};

use crate::powder::modulation::Modulation;

/// Wanted energy per volume on a raster over a region.
#[derive(Debug, Clone)]
pub struct EnergyField {
    region: Region,
    grid: Grid,
    inside: Mask,
    /// Energy per volume of each cell, J/mm³, row by row; 0 outside.
    energy: Vec<f64>,
}

/// Cells of a raster at most; beyond it the cell is made larger.
const MOST_CELLS: f64 = 4e6;

impl EnergyField {
    /// The energy that `modulation` wants in `region`, beside which powder lies, where `depth` mm of metal lie under a point
    /// (eq. 2.4.1). `cell` is the edge of the raster, mm: a tenth of a spacing is fine.
    pub fn new(
        region: &Region,
        modulation: &Modulation,
        cell: f64,
        depth: &dyn Fn(DVec2) -> f64,
    ) -> Self {
        let low = region.outer.iter().copied().reduce(DVec2::min);
        let high = region.outer.iter().copied().reduce(DVec2::max);
        let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
        let size = high - low;
        let cell = cell.max((size.x * size.y / MOST_CELLS).sqrt());
        // two cells beyond the region on all sides, so that contours close
        let grid = Grid {
            origin: low - 1.5 * cell,
            cell,
            nx: (size.x / cell).ceil() as usize + 4,
            ny: (size.y / cell).ceil() as usize + 4,
        };
        let inside = rasterise(std::slice::from_ref(region), &grid);
        let (nx, ny) = (grid.nx, grid.ny);
        let mut free = vec![false; nx * ny];
        inside.cells().for_each(|(i, j)| free[j * nx + i] = true);
        let mut across = vec![[f64::INFINITY; 2]; nx * ny];
        runs(&mut across, &free, 0, [nx, ny], [1, nx], cell);
        runs(&mut across, &free, 1, [ny, nx], [nx, 1], cell);
        let energy = (0..nx * ny)
            .map(|n| {
                if !free[n] {
                    return 0.0;
                }
                let at = centre(&grid, n % nx, n / nx);
                modulation.energy([across[n][0], across[n][1], depth(at)])
            })
            .collect();
        EnergyField {
            region: region.clone(),
            grid,
            inside,
            energy,
        }
    }

    /// Wanted energy per volume at a point, J/mm³: that of its cell; of the nearest cell inside within two cells, else 0.
    pub fn at(&self, point: DVec2) -> f64 {
        let g = (point - self.grid.origin) / self.grid.cell;
        let (i, j) = (g.x.round() as isize, g.y.round() as isize);
        let mut best = (f64::INFINITY, 0.0);
        for (dj, di) in (-2..=2).flat_map(|a| (-2..=2).map(move |b| (a, b))) {
            let (Ok(x), Ok(y)) = (usize::try_from(i + di), usize::try_from(j + dj)) else {
                continue;
            };
            if x >= self.grid.nx || y >= self.grid.ny {
                continue;
            }
            let energy = self.energy[y * self.grid.nx + x];
            let far = (g - DVec2::new(x as f64, y as f64)).length_squared();
            if energy > 0.0 && far < best.0 {
                best = (far, energy);
            }
        }
        best.1
    }

    /// Contours of passes that bring `per_area` J/mm² each (beam power over speed and layer): level by level from the
    /// boundary inwards, closed, the first point repeated, outer rings counter-clockwise.
    pub fn contours(&self, per_area: f64) -> Vec<Vec<Vec<DVec2>>> {
        let passes = self.passes(per_area);
        let most = passes
            .iter()
            .copied()
            .filter(|n| n.is_finite())
            .fold(0.0, f64::max);
        let mut levels = Vec::new();
        let mut level = 0.5;
        while level < most {
            let rings = rings(&passes, &self.grid, level);
            if !rings.is_empty() {
                levels.push(rings);
            }
            level += 1.0;
        }
        levels
    }

    /// Number of passes between the boundary and each cell; below zero outside.
    fn passes(&self, per_area: f64) -> Vec<f64> {
        let (nx, h) = (self.grid.nx, self.grid.cell);
        let slow: Vec<f64> = self.energy.iter().map(|q| q / per_area).collect();
        let mut found = vec![f64::INFINITY; slow.len()];
        let mut fixed = vec![false; slow.len()];
        let mut heap = BinaryHeap::new();
        // beside the boundary the distance itself counts, outside with the density inside
        let steep = slow.iter().copied().fold(0.0, f64::max);
        for j in 0..self.grid.ny {
            for i in 0..nx {
                let n = j * nx + i;
                let inside = self.inside.contains(i, j);
                let border = beside(i, j, nx, self.grid.ny)
                    .any(|(x, y)| self.inside.contains(x, y) != inside);
                if !inside {
                    found[n] = -steep * h;
                    fixed[n] = true;
                }
                if border {
                    let far = distance(slice::from_ref(&self.region), centre(&self.grid, i, j));
                    found[n] = if inside { far * slow[n] } else { -far * steep };
                    fixed[n] = true;
                    if inside {
                        heap.push(Front { value: found[n], n });
                    }
                }
            }
        }
        while let Some(Front { value, n }) = heap.pop() {
            if value > found[n] {
                continue;
            }
            fixed[n] = true;
            for (x, y) in beside(n % nx, n / nx, nx, self.grid.ny) {
                let m = y * nx + x;
                if fixed[m] {
                    continue;
                }
                // the smaller neighbour along each axis, upwind
                let least = |a: usize, b: usize| found[a].max(0.0).min(found[b].max(0.0));
                let (a, b) = (least(m - 1, m + 1), least(m - nx, m + nx));
                let step = slow[m] * h;
                let next = if (a - b).abs() < step {
                    0.5 * (a + b + (2.0 * step * step - (a - b) * (a - b)).sqrt())
                } else {
                    a.min(b) + step
                };
                if next < found[m] {
                    found[m] = next;
                    heap.push(Front { value: next, n: m });
                }
            }
        }
        found
    }
}

/// A cell whose value may spread; the smallest comes first out of the heap.
struct Front {
    value: f64,
    n: usize,
}

impl PartialEq for Front {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Front {}
impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Front {
    fn cmp(&self, other: &Self) -> Ordering {
        // equal values by cell, so that the order is one
        other
            .value
            .total_cmp(&self.value)
            .then(other.n.cmp(&self.n))
    }
}

fn centre(grid: &Grid, i: usize, j: usize) -> DVec2 {
    grid.origin + grid.cell * DVec2::new(i as f64, j as f64)
}

fn beside(i: usize, j: usize, nx: usize, ny: usize) -> impl Iterator<Item = (usize, usize)> {
    [(-1, 0), (1, 0), (0, -1), (0, 1)]
        .into_iter()
        .filter_map(move |(di, dj): (isize, isize)| {
            let (x, y) = (i.checked_add_signed(di)?, j.checked_add_signed(dj)?);
            (x < nx && y < ny).then_some((x, y))
        })
}

/// Distance to the nearer end of the run of inside cells along one axis, mm, from the cells' borders.
fn runs(
    out: &mut [[f64; 2]],
    inside: &[bool],
    axis: usize,
    [along, lines]: [usize; 2],
    [step, next]: [usize; 2],
    cell: f64,
) {
    for line in 0..lines {
        let mut from = 0;
        while from < along {
            if !inside[line * next + from * step] {
                from += 1;
                continue;
            }
            let mut to = from;
            while to < along && inside[line * next + to * step] {
                to += 1;
            }
            for n in from..to {
                let nearer = (n - from).min(to - 1 - n);
                out[line * next + n * step][axis] = (nearer as f64 + 0.5) * cell;
            }
            from = to;
        }
    }
}

/// Closed contours of `values` at `level`, by marching squares with straight interpolation; the higher side on the left.
fn rings(values: &[f64], grid: &Grid, level: f64) -> Vec<Vec<DVec2>> {
    let nx = grid.nx;
    // an edge by its lower cell: even along x, odd along y
    let cross = |edge: usize| {
        let n = edge / 2;
        let m = n + if edge.is_multiple_of(2) { 1 } else { nx };
        let (a, b) = (values[n], values[m]);
        let t = ((level - a) / (b - a)).clamp(0.0, 1.0);
        let [p, q] = [n, m].map(|n| centre(grid, n % nx, n / nx));
        p + t * (q - p)
    };
    // from which edge each contour goes on to which, at most two squares an edge
    let mut next = std::collections::BTreeMap::new();
    for j in 0..grid.ny - 1 {
        for i in 0..nx - 1 {
            let n = j * nx + i;
            let corners = [n, n + 1, n + nx + 1, n + nx];
            let high = corners.map(|c| values[c] > level);
            // bottom, right, top, left
            let edges = [2 * n, 2 * (n + 1) + 1, 2 * (n + nx), 2 * n + 1];
            let mut entries = Vec::new();
            let mut exits = Vec::new();
            for side in 0..4 {
                // walking round counter-clockwise: from high to low a contour with its high side on the left comes in
                match (high[side], high[(side + 1) % 4]) {
                    (true, false) => entries.push(side),
                    (false, true) => exits.push(side),
                    _ => (),
                }
            }
            let saddle =
                entries.len() == 2 && corners.iter().map(|c| values[*c]).sum::<f64>() < 4.0 * level;
            for entry in entries {
                // along the high corner's border; at a low saddle round it instead
                let turn = if saddle { 3 } else { 1 };
                let mut side = (entry + turn) % 4;
                while !exits.contains(&side) {
                    side = (side + turn) % 4;
                }
                next.insert(edges[entry], edges[side]);
            }
        }
    }
    let mut found = Vec::new();
    while let Some((&start, _)) = next.iter().next() {
        let mut ring = vec![cross(start)];
        let mut edge = start;
        while let Some(to) = next.remove(&edge) {
            ring.push(cross(to));
            edge = to;
            if edge == start {
                break;
            }
        }
        if edge == start && ring.len() > 3 {
            found.push(ring);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::powder::modulation::Ramp;
    use meltpath_geometry::region::signed_area;
    use proptest::prelude::*;

    fn flat() -> Modulation {
        let one = Ramp {
            least: 1.0,
            length: 1.0,
        };
        Modulation {
            nominal: 49.0,
            across: one,
            along: one,
        }
    }

    fn rectangle(width: f64, height: f64) -> Region {
        Region {
            outer: vec![
                DVec2::ZERO,
                DVec2::new(width, 0.0),
                DVec2::new(width, height),
                DVec2::new(0.0, height),
            ],
            holes: Vec::new(),
        }
    }

    fn length(levels: &[Vec<Vec<DVec2>>]) -> f64 {
        let rings = levels.iter().flatten();
        rings
            .flat_map(|r| r.windows(2))
            .map(|w| w[0].distance(w[1]))
            .sum()
    }

    /// Constant energy: contours a spacing apart, the first half a spacing inside.
    #[test]
    fn constant_energy_gives_constant_spacing() {
        let per_area = 0.125 * 49.0;
        let field = EnergyField::new(&rectangle(6.0, 4.0), &flat(), 0.0125, &|_| 9.0);
        let levels = field.contours(per_area);
        assert_eq!(levels.len(), 16);
        for (k, level) in levels.iter().enumerate().take(12) {
            assert_eq!(level.len(), 1);
            let inset = (k as f64 + 0.5) * 0.125;
            let area = signed_area(&level[0][1..]);
            let expected = (6.0 - 2.0 * inset) * (4.0 - 2.0 * inset);
            assert!(
                (area / expected - 1.0).abs() < 0.01,
                "{k}: {area} {expected}"
            );
        }
    }

    /// Offsets of the passes from the rim of a long zone `width` mm across, powder beside it and `depth` mm of metal below, from the
    /// law alone: each brings `per_area` J/mm², the first lies where half of that is used up.
    fn offsets(m: &Modulation, width: f64, depth: f64, per_area: f64) -> Vec<f64> {
        let step = 1e-3;
        let (mut found, mut sum, mut next) = (Vec::new(), 0.0, 0.5 * per_area);
        for k in 0..(0.5 * width / step) as u32 {
            let s = f64::from(k) * step;
            let wanted = m.nominal * m.across.at(s + 0.5 * step) * m.along.at(depth);
            sum += wanted * step;
            if sum >= next {
                found.push(s + step * (1.0 - (sum - next) / (wanted * step)));
                next += per_area;
            }
        }
        found
    }

    /// In a long zone the level sets are the offsets of one side.
    #[test]
    fn ebm_q10_contours_lie_farther_apart_near_powder() {
        let (m, per_area) = (Modulation::STARTING, 300.0 / (980.0 * 0.05));
        let zone = rectangle(30.0, 6.0);
        let field = EnergyField::new(&zone, &m, 0.0125, &|_| 5.0);
        let levels = field.contours(per_area);
        let offsets = offsets(&m, 6.0, 5.0, per_area);
        for (level, offset) in levels.iter().zip(&offsets) {
            // where the lower side of the contour crosses the middle of the zone
            let low = level
                .iter()
                .flatten()
                .filter(|p| (p.x - 15.0).abs() < 0.1)
                .map(|p| p.y)
                .fold(f64::INFINITY, f64::min);
            assert!((low - offset).abs() < 0.02, "{low} {offset}");
        }
        let constant = EnergyField::new(&zone, &flat(), 0.0125, &|_| 5.0).contours(per_area);
        let (some, all) = (length(&levels), length(&constant));
        assert!(some < 0.99 * all, "{some} {all}");
    }

    /// The energy of all passes is the energy wanted, whatever the shape.
    #[test]
    fn energy_is_kept_in_a_region_with_a_hole() {
        let mut region = rectangle(8.0, 6.0);
        region.holes = vec![vec![
            DVec2::new(3.0, 2.0),
            DVec2::new(3.5, 4.0),
            DVec2::new(5.0, 3.0),
        ]];
        let m = Modulation::STARTING;
        // powder under the right half
        let depth = |p: DVec2| if p.x > 4.0 { 0.0 } else { 9.0 };
        let field = EnergyField::new(&region, &m, 0.0125, &depth);
        let wanted: f64 = field.energy.iter().sum::<f64>() * field.grid.cell.powi(2);
        let per_area = 300.0 / (980.0 * 0.05);
        let given = per_area * length(&field.contours(per_area));
        assert!((given / wanted - 1.0).abs() < 0.04, "{given} {wanted}");
        assert!((field.at(DVec2::new(2.0, 3.0)) - 49.0).abs() < 1.0);
        assert!(field.at(DVec2::new(7.0, 3.0)) < 0.65 * 49.0);
    }

    proptest! {
        /// Any quadrilateral: contours close and stay inside.
        #[test]
        fn contours_close_and_stay_inside(x in 2.0..6.0_f64, y in 2.0..6.0_f64, u in 0.5..1.5_f64, v in 0.5..1.5_f64) {
            let region = Region {
                outer: vec![DVec2::ZERO, DVec2::new(x, 0.0), DVec2::new(x * u, y), DVec2::new(0.0, y * v)],
                holes: Vec::new(),
            };
            prop_assume!(signed_area(&region.outer) > 1.0);
            let field = EnergyField::new(&region, &Modulation::STARTING, 0.05, &|_| 9.0);
            for ring in field.contours(6.0).iter().flatten() {
                prop_assert_eq!(ring.first(), ring.last());
                for p in ring {
                    let near = distance(slice::from_ref(&region), *p);
                    let inside = rasterise(std::slice::from_ref(&region), &Grid { origin: *p, cell: 1.0, nx: 1, ny: 1 }).count();
                    prop_assert!(inside == 1 || near < 0.05);
                }
            }
        }
    }

    #[test]
    fn a_field_has_so_many_cells_that_memory_holds_it() {
        let law = flat();
        let field = EnergyField::new(&rectangle(900.0, 700.0), &law, 0.01, &|_| 1.0);
        let cells = (field.grid.nx * field.grid.ny) as f64;
        assert!(
            (0.9 * MOST_CELLS..1.1 * MOST_CELLS).contains(&cells),
            "{cells}"
        );
    }
}
