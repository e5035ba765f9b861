//! Patterns that are no single fill: islands of a checkerboard, nested contours of an energy field, spots.

use meltpath_geometry::Region;
use meltpath_geometry::boolean::intersection;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::raster::{Grid, rasterise};
use meltpath_toolpath::{Layer, Move, PassHead, Role};

use crate::fill::PassIds;
use crate::powder::error::HatchError;
use crate::powder::nested::EnergyField;

/// The islands of a region, squares of about `island` mm like the fields of a chessboard: those of one colour, then the others.
pub(super) fn islands(region: &Region, island: f64) -> Result<[Vec<Region>; 2], HatchError> {
    let [low, size] = bounds(region);
    let counts = (size / island).ceil();
    if counts.x * counts.y > 1e5 {
        return Err(too_small("islands", island, size));
    }
    // squares share out what a whole number of them leaves over
    let edge = size / counts.max(DVec2::ONE);
    let of_colour = |colour: u32| {
        let mut squares = Vec::new();
        for j in 0..counts.y as u32 {
            for i in (0..counts.x as u32).filter(|i| (i + j) % 2 == colour) {
                let a = low + edge * DVec2::new(f64::from(i), f64::from(j));
                squares.push(Region::rectangle(a, a + edge));
            }
        }
        intersection(std::slice::from_ref(region), &squares)
    };
    Ok([of_colour(0)?, of_colour(1)?])
}

/// Nested contours of passes that bring `per_area` J/mm², from the boundary inwards; each begins near the end of the one before
/// and runs against it.
pub(super) fn nested(field: &EnergyField, per_area: f64, number: u32) -> Result<Layer, HatchError> {
    let ids = PassIds { part: 0 };
    let mut path = Layer::new(number, 0.0);
    for (level, mut rings) in field.contours(per_area).into_iter().enumerate() {
        while !rings.is_empty() {
            let last = path.passes().next_back();
            let end = last.and_then(|p| p.points.last().copied());
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
            let head = PassHead {
                id: ids.id(number, path.len())?,
                role: Role::Contour,
                ..PassHead::default()
            };
            path.polyline(head, ring.iter().map(|p| p.extend(0.0)));
        }
    }
    Ok(path)
}

/// One pass of spots `spacing` mm apart, `dwell` s on each, ordered so that each lies far from those just before: of every
/// fourth column and row first, the sixteen such grids one after the other in the order of a dispersed dot screen.
pub(super) fn spots(
    region: &Region,
    spacing: f64,
    dwell: f64,
    angle: f64,
    number: u32,
) -> Result<Layer, HatchError> {
    let back = DVec2::from_angle(-angle);
    let turned = |ring: &Vec<DVec2>| ring.iter().map(|p| back.rotate(*p)).collect();
    let flat = Region {
        outer: turned(&region.outer),
        holes: region.holes.iter().map(turned).collect(),
    };
    let [low, size] = bounds(&flat);
    let counts = (size / spacing).round().max(DVec2::ONE);
    if counts.x * counts.y > 4e6 {
        return Err(too_small("spots", spacing, size));
    }
    let grid = Grid {
        origin: low + 0.5 * (size - (counts - DVec2::ONE) * spacing),
        cell: spacing,
        nx: counts.x as usize,
        ny: counts.y as usize,
    };
    let mut cells: Vec<(usize, usize)> = rasterise(&[flat], &grid).cells().collect();
    cells.sort_by_key(|&(i, j)| (DISPERSED[j % 4][i % 4], j, i));
    let forth = DVec2::from_angle(angle);
    let mut points = cells
        .iter()
        .map(|&(i, j)| grid.origin + spacing * DVec2::new(i as f64, j as f64))
        .map(|p| forth.rotate(p).extend(0.0))
        .peekable();
    let mut path = Layer::new(number, 0.0);
    let Some(first) = points.peek().copied() else {
        return Ok(path);
    };
    let head = PassHead {
        id: PassIds { part: 0 }.id(number, 0)?,
        role: Role::Fill,
        ..PassHead::default()
    };
    let mut pass = path.begin(head, first);
    for point in points {
        pass.go(Move::Spot { time: dwell }, point);
    }
    Ok(path)
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
