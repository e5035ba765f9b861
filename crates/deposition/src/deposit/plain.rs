//! Double half-ellipsoid stamps, Rouchon 2022, eq. 3.10-3.13: in a straight line their sum is exactly a parabola of
//! width 2b, height 3λS_f/(4b) and area λS_f.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;

use super::Station;
use crate::bead::PoolModel;

/// Adds one stamp of `volume` mm³, renormalised on the cells so that the volume is exact. Returns the volume that
/// found no cell (off the map), which is 0 or `volume`.
pub(crate) fn stamp(
    map: &mut HeightMap,
    weights: &mut Vec<(u32, f64)>,
    pool: &PoolModel,
    at: &Station,
    volume: f64,
) -> f64 {
    let reach = pool.front.max(pool.rear).max(pool.half_width);
    // bounding box of the two half-ellipses, not of the circle round them
    let back = at.centre - pool.rear * at.heading;
    let ahead = at.centre + pool.front * at.heading;
    let side = pool.half_width * at.heading.perp().abs() + DVec2::splat(1e-9 * reach);
    let along = pool.half_width.min(reach) * DVec2::ONE;
    let lo = (back.min(ahead) - side).min(at.centre - along);
    let hi = (back.max(ahead) + side).max(at.centre + along);
    let (columns, rows) = map.cells_within(lo, hi);
    weights.clear();
    let mut sum = 0.0;
    let (inverse_b, inverse_f, inverse_r) =
        (1.0 / pool.half_width, 1.0 / pool.front, 1.0 / pool.rear);
    let left = at.heading.perp();
    for iy in rows {
        let row = iy * map.nx;
        for ix in columns.clone() {
            let d = map.centre(ix, iy) - at.centre;
            let u = d.dot(at.heading);
            let s = u * if u >= 0.0 { inverse_f } else { inverse_r };
            let t = d.dot(left) * inverse_b;
            let rest = 1.0 - s * s - t * t;
            if rest > 0.0 {
                let f = rest.sqrt();
                sum += f;
                weights.push(((row + ix) as u32, f));
            }
        }
    }
    if sum == 0.0 {
        return volume;
    }
    let scale = volume / (sum * map.cell * map.cell);
    for &(i, f) in weights.iter() {
        map.z[i as usize] += scale * f;
    }
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bead::PursuitLength;

    const POOL: PoolModel = PoolModel {
        front: 3.6,
        rear: 10.8,
        half_width: 3.6,
        offset: 1.66,
        pursuit: PursuitLength::Fixed(4.0),
    };

    #[test]
    fn waam_ac21_a_stamp_has_its_volume_at_any_angle() {
        for angle in [0.0, 0.3, 1.0, 2.5, 4.0] {
            let mut map =
                HeightMap::new(DVec2::splat(-15.0), DVec2::splat(15.0), 0.5, 0.0).unwrap();
            let at = Station {
                centre: DVec2::new(0.13, -0.27),
                heading: DVec2::from_angle(angle),
                travelled: 0.0,
                rise: 0.0,
            };
            let lost = stamp(&mut map, &mut Vec::new(), &POOL, &at, 2.5);
            assert_eq!(lost, 0.0);
            assert!((map.volume() - 2.5).abs() < 1e-12);
            // nothing was cut by the box: the stamp reaches its own tips
            let (rear, front) = (at.centre - 10.2 * at.heading, at.centre + 3.1 * at.heading);
            assert!(map.height(rear) > 0.0 && map.height(front) > 0.0);
        }
    }
}
