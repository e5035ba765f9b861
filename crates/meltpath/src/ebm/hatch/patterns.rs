//! Patterns that are no single fill: islands of a checkerboard, nested contours of an energy field, spots.

use meltpath_base::Reporter;
use meltpath_geometry::Region;
use meltpath_geometry::boolean::intersection;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::raster::{Grid, rasterise};
use meltpath_planning::PassIds;
use meltpath_planning::powder::nested::EnergyField;
use meltpath_toolpath::{Move, Pass, Role, Tag};

use super::{Hatch, HatchError};

impl Hatch {
    pub(super) fn islands(
        &self,
        region: &Region,
        number: u32,
        angle: f64,
        reporter: &Reporter,
    ) -> Result<Vec<Pass>, HatchError> {
        let [low, size] = bounds(region);
        let counts = (size / self.island).ceil();
        if counts.x * counts.y > 1e5 {
            return Err(too_small("islands", self.island, size));
        }
        // squares share out what a whole number of them leaves over
        let edge = size / counts.max(DVec2::ONE);
        let ids = PassIds { part: 0 };
        let mut passes = Vec::new();
        for colour in 0..2_u32 {
            let mut squares = Vec::new();
            for j in 0..counts.y as u32 {
                for i in (0..counts.x as u32).filter(|i| (i + j) % 2 == colour) {
                    let a = low + edge * DVec2::new(f64::from(i), f64::from(j));
                    let b = a + edge;
                    let outer = vec![a, DVec2::new(b.x, a.y), b, DVec2::new(a.x, b.y)];
                    squares.push(Region {
                        outer,
                        holes: Vec::new(),
                    });
                }
            }
            let islands = intersection(std::slice::from_ref(region), &squares)?;
            let turned = angle + f64::from(colour) * std::f64::consts::FRAC_PI_2;
            for mut pass in self.plan(&islands, self.fill(turned, 0), number, reporter)? {
                pass.id = ids.id(number, passes.len())?;
                pass.neighbours.clear();
                passes.push(pass);
            }
        }
        Ok(passes)
    }

    /// Nested contours from the boundary inwards; each begins near the end of the one before and runs against it.
    pub(super) fn nested(&self, field: &EnergyField, number: u32) -> Result<Vec<Pass>, HatchError> {
        let ids = PassIds { part: 0 };
        let tag = Tag {
            part: 0,
            layer: number,
            entity: 0,
        };
        let mut passes: Vec<Pass> = Vec::new();
        for (level, mut rings) in field
            .contours(self.power / (self.speed * self.layer))
            .into_iter()
            .enumerate()
        {
            while !rings.is_empty() {
                let end = passes.last().and_then(|p| p.points.last().copied());
                let end = end.map_or(rings[0][0], DVec3::truncate);
                let near = |ring: &Vec<DVec2>| {
                    let far = |n: &usize| ring[*n].distance_squared(end);
                    let best = (0..ring.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                    best.map_or((f64::INFINITY, 0), |n| (far(&n), n))
                };
                let choice = (0..rings.len()).min_by(|a, b| {
                    let [a, b] = [a, b].map(|n| near(&rings[*n]).0);
                    a.total_cmp(&b)
                });
                let mut ring = rings.swap_remove(choice.unwrap_or_default());
                let start = near(&ring).1;
                ring.pop();
                let start = start % ring.len();
                ring.rotate_left(start);
                ring.push(ring[0]);
                if level % 2 == 1 {
                    ring.reverse();
                }
                let id = ids.id(number, passes.len())?;
                let points = ring.iter().map(|p| p.extend(0.0)).collect();
                passes.push(Pass::polyline(id, Role::Contour, tag, points));
            }
        }
        Ok(passes)
    }

    /// One pass of spots, ordered so that each lies far from those just before: of every fourth column and row first, the
    /// sixteen such grids one after the other in the order of a dispersed dot screen.
    pub(super) fn spots(
        &self,
        region: &Region,
        number: u32,
        angle: f64,
    ) -> Result<Vec<Pass>, HatchError> {
        let back = DVec2::from_angle(-angle);
        let turned = |ring: &Vec<DVec2>| ring.iter().map(|p| back.rotate(*p)).collect();
        let flat = Region {
            outer: turned(&region.outer),
            holes: region.holes.iter().map(turned).collect(),
        };
        let [low, size] = bounds(&flat);
        let counts = (size / self.spacing).round().max(DVec2::ONE);
        if counts.x * counts.y > 4e6 {
            return Err(too_small("spots", self.spacing, size));
        }
        let grid = Grid {
            origin: low + 0.5 * (size - (counts - DVec2::ONE) * self.spacing),
            cell: self.spacing,
            nx: counts.x as usize,
            ny: counts.y as usize,
        };
        let mut cells: Vec<(usize, usize)> = rasterise(&[flat], &grid).cells().collect();
        cells.sort_by_key(|&(i, j)| (DISPERSED[j % 4][i % 4], j, i));
        let forth = DVec2::from_angle(angle);
        let mut points: Vec<DVec3> = cells
            .iter()
            .map(|&(i, j)| grid.origin + self.spacing * DVec2::new(i as f64, j as f64))
            .map(|p| forth.rotate(p).extend(0.0))
            .collect();
        let Some(first) = points.first().copied() else {
            return Ok(Vec::new());
        };
        let moves = vec![Move::Spot { time: self.dwell }; points.len()];
        points.insert(0, first);
        let tag = Tag {
            part: 0,
            layer: number,
            entity: 0,
        };
        let id = PassIds { part: 0 }.id(number, 0)?;
        let mut pass = Pass::polyline(id, Role::Fill, tag, points);
        pass.moves = moves;
        Ok(vec![pass])
    }
}

fn too_small(what: &'static str, size: f64, region: DVec2) -> HatchError {
    HatchError::TooSmall {
        what,
        size,
        width: region.x,
        height: region.y,
    }
}

/// Bayer's order of the sixteen cells of a 4 x 4 tile: each far from the one before (public since 1973).
const DISPERSED: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

/// Lower corner and size of a region's bounding box, mm.
fn bounds(region: &Region) -> [DVec2; 2] {
    let low = region.outer.iter().copied().reduce(DVec2::min);
    let high = region.outer.iter().copied().reduce(DVec2::max);
    let low = low.unwrap_or_default();
    [low, high.unwrap_or_default() - low]
}
