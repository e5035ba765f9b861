//! What bands along polylines cover of regions, tile by tile: where tiles lie whole under bands, nothing is cut out.
//!
//! A sweep over a whole layer carries all its lines at once, and its time grows with lines times ends. In a tile there are few.

mod bounds;

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use self::bounds::{Bounds, in_order};
use crate::boolean::{Curves, GRID_PER_MM, PlanarError, difference, union};
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
    Ground::new(regions.to_vec(), band)?.bare(lines)
}

/// What bands along `lines` leave bare of `regions`, which do not overlap, and how much of the bands lies outside them.
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range.
pub fn cover(regions: &[Region], lines: &[Vec<DVec2>], band: Band) -> Result<Cover, PlanarError> {
    Ground::new(regions.to_vec(), band)?.cover(lines)
}

/// Regions in tiles, for bands along the lines of many layers. A tile in which lines lie as they lay before is not looked at again: what it
/// tells hangs on where its lines lie alone, neither on the order they come in nor on where they start or which way they run.
pub struct Ground {
    regions: Vec<Region>,
    band: Band,
    /// The box round the regions.
    around: (DVec2, DVec2),
    /// All tiles round the regions; none where there are no regions.
    tiles: Option<Tiles>,
}

impl Ground {
    /// Of regions that do not overlap.
    ///
    /// # Errors
    /// [`PlanarError`] where a parameter is out of range.
    pub fn new(regions: Vec<Region>, band: Band) -> Result<Self, PlanarError> {
        // the parameters are checked where there is nothing to cover, too
        stroke(&[], band.reach, band.arc_tolerance)?;
        let around = box_round(regions.iter().flat_map(|r| &r.outer));
        let (low, high) = around;
        let tiles = (low.is_finite() && high.is_finite())
            .then(|| Tiles::new(around, regions.clone(), band));
        Ok(Ground {
            regions,
            band,
            around,
            tiles,
        })
    }

    /// What bands along `lines` leave bare.
    ///
    /// # Errors
    /// [`PlanarError`] where a coordinate is out of range.
    pub fn bare(&self, lines: &[Vec<DVec2>]) -> Result<Vec<Region>, PlanarError> {
        let Some(tiles) = &self.tiles else {
            return self.refused(lines).map(|()| Vec::new());
        };
        Ok(tiles.tell(lines, Question::Bare)?.bare)
    }

    /// What bands along `lines` leave bare, and how much of them lies outside the regions.
    ///
    /// # Errors
    /// [`PlanarError`] where a coordinate is out of range.
    pub fn cover(&self, lines: &[Vec<DVec2>]) -> Result<Cover, PlanarError> {
        let (low, high) = box_round(
            self.regions
                .iter()
                .flat_map(|r| &r.outer)
                .chain(lines.iter().flatten()),
        );
        if !(low.is_finite() && high.is_finite()) {
            return self.refused(lines).map(|()| Cover::default());
        }
        match &self.tiles {
            Some(tiles) if self.around == (low, high) => tiles.tell(lines, Question::Cover),
            _ => {
                let wider = Tiles::new((low, high), self.regions.clone(), self.band);
                wider.tell(lines, Question::Cover)
            }
        }
    }

    /// Names the vertex that is not a number, if there is one.
    fn refused(&self, lines: &[Vec<DVec2>]) -> Result<(), PlanarError> {
        let metal = stroke(lines, self.band.reach, self.band.arc_tolerance)?;
        difference(&self.regions, &metal).map(|_| ())
    }
}

/// What is asked of tiles.
#[derive(Clone, Copy, PartialEq)]
enum Question {
    Bare,
    Cover,
}

/// A tile with the lines that lie there.
struct Tile<'a> {
    bounds: Bounds,
    regions: &'a [Region],
    lines: &'a [Vec<DVec2>],
}

impl Tile<'_> {
    /// Curves whose windings are above 0 where there is metal.
    fn metal(&self, band: Band) -> Result<Curves, PlanarError> {
        band_curves(self.lines, band.reach, band.arc_tolerance)
    }

    /// What bands leave bare here; where that is asked for, their area beyond the regions, too.
    fn cover(&self, band: Band, question: Question) -> Result<Cover, PlanarError> {
        let is_wet = self.is_wet(band);
        if is_wet && (question == Question::Bare || self.is_full()) {
            return Ok(Cover::default());
        }
        let metal = self.metal(band)?;
        let all = match question {
            Question::Bare => 0.0,
            Question::Cover => area(&metal.common_with(&[self.bounds.region()])?),
        };
        let bare = if is_wet {
            Vec::new()
        } else {
            metal.taken_from(self.regions)?
        };
        let on_regions = area(self.regions) - area(&bare);
        let beyond = (all - on_regions).max(0.0);
        Ok(Cover { bare, beyond })
    }

    /// Whether the regions fill the tile.
    fn is_full(&self) -> bool {
        let [only] = self.regions else {
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
        for line in self.lines {
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
        let inside = rasterise(self.regions, &grid);
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

/// The box round points: its low and its high corner.
fn box_round<'a>(points: impl Iterator<Item = &'a DVec2>) -> (DVec2, DVec2) {
    points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| {
        (low.min(p), high.max(p))
    })
}

/// Tiles over a box and what bands reach beyond it.
struct Tiles {
    corner: DVec2,
    side: f64,
    band: Band,
    root: Node,
}

/// The tiles from one corner to another, halved as far as they are asked.
struct Node {
    from: [u64; 2],
    to: [u64; 2],
    bounds: Bounds,
    regions: Vec<Region>,
    halves: OnceLock<Result<[Box<Node>; 2], PlanarError>>,
    /// What a single tile told, with the lines it told that of.
    known: Mutex<Vec<Known>>,
}

type Known = (Vec<Vec<DVec2>>, Question, Arc<Cover>);

/// Most sets of lines that a tile knows of: more come where lines are turned from layer to layer, and seldom again.
const MOST_KNOWN: usize = 16;

impl Tiles {
    fn new((low, high): (DVec2, DVec2), regions: Vec<Region>, band: Band) -> Self {
        let side = (TILE * band.reach * GRID_PER_MM).ceil() / GRID_PER_MM;
        let corner = ((low - band.reach) * GRID_PER_MM).floor() / GRID_PER_MM;
        let count = ((high + band.reach - corner) / side).ceil().max(DVec2::ONE);
        let to = [count.x as u64, count.y as u64];
        let root = Node {
            from: [0, 0],
            to,
            bounds: bounds(corner, side, [0, 0], to),
            regions,
            halves: OnceLock::new(),
            known: Mutex::default(),
        };
        Tiles {
            corner,
            side,
            band,
            root,
        }
    }

    /// What all tiles tell of lines.
    fn tell(&self, lines: &[Vec<DVec2>], question: Question) -> Result<Cover, PlanarError> {
        let told = self.ask(&self.root, lines, question)?;
        let pieces: Vec<Region> = told.iter().flat_map(|t| &t.bare).cloned().collect();
        Ok(Cover {
            bare: union(&pieces)?,
            beyond: told.iter().map(|t| t.beyond).sum(),
        })
    }

    /// What the single tiles of a node tell of lines, in order.
    fn ask(
        &self,
        node: &Node,
        lines: &[Vec<DVec2>],
        question: Question,
    ) -> Result<Vec<Arc<Cover>>, PlanarError> {
        // ends of what is cut off lie a reach away from the tile
        let lines = node.bounds.grown(2.0 * self.band.reach).clipped(lines);
        if node.regions.is_empty() && (lines.is_empty() || question == Question::Bare) {
            return Ok(Vec::new());
        }
        if node.to == [node.from[0] + 1, node.from[1] + 1] {
            return Ok(vec![node.told(in_order(lines), self.band, question)?]);
        }
        let halves = node.halves.get_or_init(|| self.halved(node));
        let [one, other] = halves.as_ref().map_err(|&error| error)?;
        let (first, second) = rayon::join(
            || self.ask(one, &lines, question),
            || self.ask(other, &lines, question),
        );
        let (mut told, more) = (first?, second?);
        told.extend(more);
        Ok(told)
    }

    fn halved(&self, node: &Node) -> Result<[Box<Node>; 2], PlanarError> {
        let (from, to) = (node.from, node.to);
        let many = [to[0] - from[0], to[1] - from[1]];
        let axis = usize::from(many[1] > many[0]);
        let (mut end, mut start) = (to, from);
        end[axis] = from[axis] + many[axis] / 2;
        start[axis] = end[axis];
        let half = |from, to| {
            let bounds = bounds(self.corner, self.side, from, to);
            Ok(Box::new(Node {
                from,
                to,
                bounds,
                regions: bounds.part_of(&node.regions)?,
                halves: OnceLock::new(),
                known: Mutex::default(),
            }))
        };
        Ok([half(from, end)?, half(start, to)?])
    }
}

fn bounds(corner: DVec2, side: f64, from: [u64; 2], to: [u64; 2]) -> Bounds {
    let at = |i: [u64; 2]| corner + DVec2::new(i[0] as f64, i[1] as f64) * side;
    Bounds {
        low: at(from),
        high: at(to),
    }
}

impl Node {
    /// What the tile tells of lines in order.
    fn told(
        &self,
        lines: Vec<Vec<DVec2>>,
        band: Band,
        question: Question,
    ) -> Result<Arc<Cover>, PlanarError> {
        let known = || self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let before = known()
            .iter()
            .find(|(of, asked, _)| *asked == question && *of == lines)
            .map(|(_, _, told)| told.clone());
        if let Some(told) = before {
            return Ok(told);
        }
        let tile = Tile {
            bounds: self.bounds,
            regions: &self.regions,
            lines: &lines,
        };
        let told = Arc::new(tile.cover(band, question)?);
        let mut known = known();
        if known.len() < MOST_KNOWN {
            known.push((lines, question, told.clone()));
        }
        Ok(told)
    }
}

fn area(regions: &[Region]) -> f64 {
    regions.iter().map(Region::area).sum()
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

    /// What a tile told of lines it tells of them again, in whatever order, from wherever and whichever way they run; of others it does not.
    #[test]
    fn a_ground_tells_the_same_of_the_same_lines() {
        let band = Band {
            reach: 2.4,
            arc_tolerance: 0.01,
        };
        let contour: Vec<DVec2> = (0..=40)
            .map(|i| DVec2::from_angle(std::f64::consts::TAU * f64::from(i % 40) / 40.0) * 25.0)
            .collect();
        let line = |y: f64| vec![DVec2::new(-24.0, y), DVec2::new(24.0, y + 1.0)];
        let lines = vec![contour.clone(), line(-7.0), line(9.0)];
        let mut turned = contour[..40].to_vec();
        turned.rotate_left(13);
        turned.push(turned[0]);
        turned.reverse();
        let mut again = vec![line(9.0), turned, line(-7.0)];
        again[2].reverse();
        let regions = [ring(30.0, 4.0, 60)];
        let ground = Ground::new(regions.to_vec(), band).unwrap();
        let first = ground.cover(&lines).unwrap();
        assert_eq!(ground.cover(&again).unwrap(), first);
        assert_eq!(cover(&regions, &again, band).unwrap(), first);
        assert_eq!(
            ground.bare(&again).unwrap(),
            bare(&regions, &lines, band).unwrap()
        );
        let fewer = ground.cover(&again[..2]).unwrap();
        assert_eq!(fewer, cover(&regions, &again[..2], band).unwrap());
        assert!(area(&fewer.bare) > area(&first.bare) + 100.0);
    }
}
