//! What bands along polylines cover of regions, tile by tile: where tiles lie whole under bands, nothing is cut out.
//!
//! A sweep over a whole layer carries all its lines at once, and its time grows with lines times ends. In a tile there are few.

use rayon::prelude::*;

use crate::boolean::{Curves, GRID_PER_MM, PlanarError, difference, intersection, union};
use crate::math::DVec2;
use crate::offset::{band_curves, stroke};
use crate::raster::{Grid, rasterise};
use crate::region::Region;

/// Side of a tile, in reaches of the band: a few lines wide.
const TILE: f64 = 6.0;
/// Side of a cell in which a tile is looked at first, in reaches.
const CELL: f64 = 0.12;

/// Bands with round ends along polylines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// From the line to the band's edge, mm.
    pub reach: f64,
    /// Largest distance of round edges to their chords, mm.
    pub arc_tolerance: f64,
}

/// What bands cover.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cover {
    /// What no band covers of the regions.
    pub bare: Vec<Region>,
    /// Area of the bands outside the regions, mm².
    pub beyond: f64,
}

/// What bands along `lines` leave bare of `regions`, which do not overlap.
///
/// ```
/// use meltpath_geometry::{cover::{Band, bare}, math::DVec2, shapes::ring};
/// let lines = [vec![DVec2::new(-30.0, 0.0), DVec2::new(30.0, 0.0)]];
/// let band = Band { reach: 2.0, arc_tolerance: 0.01 };
/// let halves = bare(&[ring(20.0, 10.0, 200)], &lines, band).unwrap();
/// assert_eq!(halves.len(), 2);
/// ```
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range.
pub fn bare(
    regions: &[Region],
    lines: &[Vec<DVec2>],
    band: Band,
) -> Result<Vec<Region>, PlanarError> {
    let some = |regions: &[Region], _: &[Vec<DVec2>]| !regions.is_empty();
    let pieces: Vec<Vec<Region>> = tiles(regions, lines, band, some)?
        .into_par_iter()
        .filter(|tile| !tile.is_wet(band))
        .map(|tile| tile.bare(tile.metal(band)?))
        .collect::<Result<_, _>>()?;
    union(&pieces.concat())
}

/// What bands along `lines` leave bare of `regions`, which do not overlap, and how much of the bands lies outside them.
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range.
pub fn cover(regions: &[Region], lines: &[Vec<DVec2>], band: Band) -> Result<Cover, PlanarError> {
    let some = |regions: &[Region], lines: &[Vec<DVec2>]| !(regions.is_empty() && lines.is_empty());
    let pieces: Vec<(Vec<Region>, f64)> = tiles(regions, lines, band, some)?
        .into_par_iter()
        .filter_map(|tile| {
            let wet = tile.is_wet(band);
            (!(wet && tile.is_full())).then(|| tile.cover(band, wet))
        })
        .collect::<Result<_, _>>()?;
    let beyond = pieces.iter().map(|p| p.1).sum();
    let bare: Vec<Region> = pieces.into_iter().flat_map(|p| p.0).collect();
    Ok(Cover {
        bare: union(&bare)?,
        beyond,
    })
}

/// A rectangle, its corners on the grid of planar operations.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    fn grown(self, by: f64) -> Bounds {
        Bounds {
            low: self.low - by,
            high: self.high + by,
        }
    }

    fn region(self) -> Region {
        Region::rectangle(self.low, self.high)
    }

    fn area(self) -> f64 {
        let size = self.high - self.low;
        size.x * size.y
    }

    /// The part of regions inside; a sweep cuts only those that cross its edge.
    fn part_of(self, regions: &[Region]) -> Result<Vec<Region>, PlanarError> {
        let mut inside = Vec::new();
        let mut crossing = Vec::new();
        for region in regions {
            if region.holes.is_empty() && is_around(&region.outer, self) {
                inside.push(self.region());
                continue;
            }
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            for &p in &region.outer {
                (low, high) = (low.min(p), high.max(p));
            }
            if low.cmpge(self.low).all() && high.cmple(self.high).all() {
                inside.push(region.clone());
            } else if low.cmplt(self.high).all() && high.cmpgt(self.low).all() {
                crossing.push(region.clone());
            }
        }
        if !crossing.is_empty() {
            inside.extend(intersection(&crossing, &[self.region()])?);
        }
        Ok(inside)
    }

    /// The part of a stretch inside, as shares of its way (Liang and Barsky).
    fn clip(self, a: DVec2, b: DVec2) -> Option<(f64, f64)> {
        let way = b - a;
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (p, q) in [
            (-way.x, a.x - self.low.x),
            (way.x, self.high.x - a.x),
            (-way.y, a.y - self.low.y),
            (way.y, self.high.y - a.y),
        ] {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                from = from.max(q / p);
            } else {
                to = to.min(q / p);
            }
        }
        (from <= to).then_some((from, to))
    }

    /// What lies inside of polylines, each cut where it leaves.
    fn clipped(self, lines: &[Vec<DVec2>]) -> Vec<Vec<DVec2>> {
        let mut inside = Vec::new();
        for line in lines {
            if let [dot] = line[..] {
                inside.extend(self.clip(dot, dot).map(|_| vec![dot]));
                continue;
            }
            let mut piece: Vec<DVec2> = Vec::new();
            for side in line.windows(2) {
                let Some((from, to)) = self.clip(side[0], side[1]) else {
                    inside.extend((!piece.is_empty()).then(|| std::mem::take(&mut piece)));
                    continue;
                };
                if piece.is_empty() || from > 0.0 {
                    inside.extend((!piece.is_empty()).then(|| std::mem::take(&mut piece)));
                    piece.push(side[0].lerp(side[1], from));
                }
                piece.push(if to < 1.0 {
                    side[0].lerp(side[1], to)
                } else {
                    side[1]
                });
                if to < 1.0 {
                    inside.push(std::mem::take(&mut piece));
                }
            }
            inside.extend((!piece.is_empty()).then_some(piece));
        }
        inside
    }
}

/// A tile that may be bare somewhere, or into which bands reach from outside the regions.
struct Tile {
    bounds: Bounds,
    regions: Vec<Region>,
    lines: Vec<Vec<DVec2>>,
}

impl Tile {
    /// Curves whose windings are above 0 where there is metal.
    fn metal(&self, band: Band) -> Result<Curves, PlanarError> {
        band_curves(&self.lines, band.reach, band.arc_tolerance)
    }

    /// What is bare here.
    fn bare(&self, metal: Curves) -> Result<Vec<Region>, PlanarError> {
        metal.taken_from(&self.regions)
    }

    /// What is bare here, and the area of the bands beyond the regions.
    fn cover(&self, band: Band, is_wet: bool) -> Result<(Vec<Region>, f64), PlanarError> {
        let metal = self.metal(band)?;
        let all = area(&metal.common_with(&[self.bounds.region()])?);
        let bare = if is_wet {
            Vec::new()
        } else {
            self.bare(metal)?
        };
        let on_regions = area(&self.regions) - area(&bare);
        Ok((bare, (all - on_regions).max(0.0)))
    }

    /// Whether the regions fill the tile.
    fn is_full(&self) -> bool {
        let [only] = &self.regions[..] else {
            return false;
        };
        only.holes.is_empty() && only.outer.len() == 4 && only.area() >= self.bounds.area()
    }

    /// Whether bands cover the regions in the tile, seen by cells.
    fn is_wet(&self, band: Band) -> bool {
        let Bounds { low, high } = self.bounds;
        let cell = CELL * band.reach;
        let size = (high - low) / cell;
        let grid = Grid {
            origin: low + 0.5 * cell,
            cell,
            nx: size.x.ceil() as usize,
            ny: size.y.ceil() as usize,
        };
        // from a cell's centre to its corner
        let corner = cell * std::f64::consts::FRAC_1_SQRT_2;
        let mut wet = vec![false; grid.nx * grid.ny];
        for line in &self.lines {
            let within = band.reach - band.arc_tolerance - corner;
            match line[..] {
                [dot] => stamp(&mut wet, &grid, dot, dot, within),
                _ => line
                    .windows(2)
                    .for_each(|side| stamp(&mut wet, &grid, side[0], side[1], within)),
            }
        }
        if wet.iter().all(|&wet| wet) {
            return true;
        }
        // cells that a region has a part of: their centres lie inside, or its boundary comes as near as their corners
        let inside = rasterise(&self.regions, &grid);
        if inside.cells().any(|(ix, iy)| !wet[iy * grid.nx + ix]) {
            return false;
        }
        let mut met = vec![false; grid.nx * grid.ny];
        for ring in self.regions.iter().flat_map(Region::rings) {
            for (i, &a) in ring.iter().enumerate() {
                let b = ring[(i + 1) % ring.len()];
                stamp(&mut met, &grid, a, b, corner * (1.0 + 1e-9));
            }
        }
        met.iter().zip(&wet).all(|(met, wet)| !met || *wet)
    }
}

/// Marks the cells whose centres lie within `within` of the stretch from `a` to `b`, mm.
fn stamp(cells: &mut [bool], grid: &Grid, a: DVec2, b: DVec2, within: f64) {
    for (iy, row) in grid.rows_beside(a, b, within) {
        cells[iy * grid.nx..][row].fill(true);
    }
}

/// The tiles over regions and bands that count by what of them lies there, and are not whole under bands.
fn tiles(
    regions: &[Region],
    lines: &[Vec<DVec2>],
    band: Band,
    counts: impl Fn(&[Region], &[Vec<DVec2>]) -> bool + Copy + Sync,
) -> Result<Vec<Tile>, PlanarError> {
    // its parameters and lines are checked where it is empty, too
    stroke(&[], band.reach, band.arc_tolerance)?;
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for &p in regions
        .iter()
        .flat_map(|r| &r.outer)
        .chain(lines.iter().flatten())
    {
        (low, high) = (low.min(p), high.max(p));
    }
    if !(low.is_finite() && high.is_finite()) {
        // names the vertex that is not a number
        let metal = stroke(lines, band.reach, band.arc_tolerance)?;
        return difference(regions, &metal).map(|_| Vec::new());
    }
    let side = (TILE * band.reach * GRID_PER_MM).ceil() / GRID_PER_MM;
    let corner = ((low - band.reach) * GRID_PER_MM).floor() / GRID_PER_MM;
    let count = ((high + band.reach - corner) / side).ceil().max(DVec2::ONE);
    let all = Tiles {
        corner,
        side,
        band,
        counts,
    };
    all.over([0, 0], [count.x as u64, count.y as u64], regions, lines)
}

#[derive(Clone, Copy)]
struct Tiles<C> {
    corner: DVec2,
    side: f64,
    band: Band,
    counts: C,
}

impl<C: Fn(&[Region], &[Vec<DVec2>]) -> bool + Copy + Sync> Tiles<C> {
    fn bounds(self, from: [u64; 2], to: [u64; 2]) -> Bounds {
        let at = |i: [u64; 2]| self.corner + DVec2::new(i[0] as f64, i[1] as f64) * self.side;
        Bounds {
            low: at(from),
            high: at(to),
        }
    }

    /// The tiles from one corner to the other, halved until they are single.
    fn over(
        self,
        from: [u64; 2],
        to: [u64; 2],
        regions: &[Region],
        lines: &[Vec<DVec2>],
    ) -> Result<Vec<Tile>, PlanarError> {
        let bounds = self.bounds(from, to);
        // ends of what is cut off lie a reach away from the tile
        let lines = bounds.grown(2.0 * self.band.reach).clipped(lines);
        let regions = bounds.part_of(regions)?;
        if !(self.counts)(&regions, &lines) {
            return Ok(Vec::new());
        }
        let many = [to[0] - from[0], to[1] - from[1]];
        if many == [1, 1] {
            let tile = Tile {
                bounds,
                regions,
                lines,
            };
            return Ok(vec![tile]);
        }
        let axis = usize::from(many[1] > many[0]);
        let (mut end, mut start) = (to, from);
        end[axis] = from[axis] + many[axis] / 2;
        start[axis] = end[axis];
        let (first, second) = rayon::join(
            || self.over(from, end, &regions, &lines),
            || self.over(start, to, &regions, &lines),
        );
        let (mut tiles, more) = (first?, second?);
        tiles.extend(more);
        Ok(tiles)
    }
}

fn area(regions: &[Region]) -> f64 {
    regions.iter().map(Region::area).sum()
}

/// Whether a ring is a rectangle along the axes round `bounds`.
fn is_around(ring: &[DVec2], bounds: Bounds) -> bool {
    ring.len() == 4
        && ring.iter().all(|p| {
            (p.x <= bounds.low.x || p.x >= bounds.high.x)
                && (p.y <= bounds.low.y || p.y >= bounds.high.y)
        })
        && (0..4).all(|i| ring[i].x == ring[(i + 1) % 4].x || ring[i].y == ring[(i + 1) % 4].y)
        && ring
            .iter()
            .any(|p| p.x <= bounds.low.x && p.y <= bounds.low.y)
        && ring
            .iter()
            .any(|p| p.x >= bounds.high.x && p.y >= bounds.high.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::ring;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// Tiles tell what one sweep over everything tells.
        #[test]
        fn tiles_tell_what_one_sweep_tells(
            turn in 0.0..3.2_f64,
            apart in 2.0..7.0_f64,
            outer in 20.0..70.0_f64,
            hole in 2.0..15.0_f64,
            dots in prop::collection::vec((-60.0..60.0_f64, -60.0..60.0_f64), 0..5),
        ) {
            let regions = [ring(outer, hole, 60)];
            let along = DVec2::from_angle(turn);
            let mut lines: Vec<Vec<DVec2>> = (-12..12)
                .map(|i| {
                    let aside = along.perp() * (f64::from(i) * apart);
                    [-60.0, -7.0, 3.0, 55.0].map(|t| along * t + aside + along.perp() * t.sin()).to_vec()
                })
                .collect();
            lines.extend(dots.into_iter().map(|(x, y)| vec![DVec2::new(x, y)]));
            let band = Band { reach: 2.4, arc_tolerance: 0.01 };
            let metal = stroke(&lines, band.reach, band.arc_tolerance).unwrap();
            let told = cover(&regions, &lines, band).unwrap();
            let wanted = difference(&regions, &metal).unwrap();
            // chords of round ends begin elsewhere
            let ends = lines.len() as f64 * 4.0 * 3.0 * band.arc_tolerance;
            prop_assert!((area(&told.bare) - area(&wanted)).abs() < ends);
            let beyond = area(&difference(&metal, &regions).unwrap());
            prop_assert!((told.beyond - beyond).abs() < ends);
        }
    }
}
