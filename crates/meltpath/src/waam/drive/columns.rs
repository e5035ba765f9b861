//! Beads as columns down to the plate: no less than their metal, for collisions.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::{HeightMap, WorkpieceError};
use meltpath_robot::collision::Metal;

/// Side of the columns, mm; of a wide part there are so many along it at most.
const COLUMN: f64 = 2.0;
const COLUMNS: f64 = 250.0;

/// The metal after each layer or pass, of pieces of beads in their order with its number: `half` mm to either side, `high` over them.
///
/// # Errors
/// [`WorkpieceError`] where there is nothing, or no room for it.
pub(in crate::waam) fn columns(
    pieces: &[(u32, [DVec3; 2])],
    (half, high): (f64, f64),
) -> Result<Vec<(u32, Metal)>, WorkpieceError> {
    let points = pieces.iter().flat_map(|p| p.1);
    let (low, high_end) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
        let p = p.truncate();
        (low.min(p), high.max(p))
    });
    let room = DVec2::splat(6.0 * half);
    let side = side_of(high_end - low);
    let mut map = HeightMap::new(low - room, high_end + room, side, 0.0)?;
    let mut metal = Vec::new();
    for group in pieces.chunk_by(|a, b| a.0 == b.0) {
        for (_, [a, b]) in group {
            let steps = (a.distance(*b) / (0.5 * side)).ceil().max(1.0) as u32;
            for i in 0..=steps {
                let at = a.lerp(*b, f64::from(i) / f64::from(steps));
                raise(&mut map, at + high * DVec3::Z, half);
            }
        }
        metal.push((group[0].0, Metal::of(&map, side)));
    }
    Ok(metal)
}

/// The side of columns that stand for the metal of a map, mm.
pub(in crate::waam) fn side(map: &HeightMap) -> f64 {
    let (low, high) = map.bounds();
    side_of(high - low)
}

fn side_of(size: DVec2) -> f64 {
    COLUMN.max(size.max_element() / COLUMNS)
}

/// Raises the cells within `radius` of a point to its height.
fn raise(map: &mut HeightMap, p: DVec3, radius: f64) {
    let at = |x: f64| (x / map.cell).floor().max(0.0) as usize;
    let near = p.truncate() - map.origin;
    let (x0, x1) = (at(near.x - radius), at(near.x + radius));
    let (y0, y1) = (at(near.y - radius), at(near.y + radius));
    for iy in y0..=y1.min(map.ny.saturating_sub(1)) {
        for ix in x0..=x1.min(map.nx.saturating_sub(1)) {
            let index = map.index(ix, iy);
            map.z[index] = map.z[index].max(p.z);
        }
    }
}
