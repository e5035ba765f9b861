//! The volume that shells enclose together: what several of them cover counts once, as slices take it.

use crate::Mesh;
use crate::math::DVec2;

/// Columns along x and y.
const COLUMNS: usize = 256;

/// A volume by columns of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnionVolume {
    /// The volume, mm³.
    pub volume: f64,
    /// Its standard uncertainty, mm³.
    pub sigma: f64,
}

/// The volume of all points with a winding number other than zero, along columns in z, one at a random place of each of 256 x 256
/// cells; the same bits each time.
///
/// The mesh must be closed. The uncertainty takes the scatter of four neighbouring columns for that of each: more than it is, at edges.
///
/// ```
/// use meltpath_geometry::{shapes::thin_wall, union::union_volume};
/// let mut walls = thin_wall(60.0, 10.0, 20.0);
/// // the same wall once more, half its length on
/// let mut again = walls.clone();
/// again.vertices.iter_mut().for_each(|v| v.x += 30.0);
/// walls.add(&again);
/// let found = union_volume(&walls);
/// assert!((found.volume - 18_000.0).abs() < 3.0 * found.sigma.max(1.0), "{found:?}");
/// ```
pub fn union_volume(mesh: &Mesh) -> UnionVolume {
    let nothing = UnionVolume {
        volume: 0.0,
        sigma: 0.0,
    };
    let Some((lo, hi)) = mesh.bounds() else {
        return nothing;
    };
    let cell = (hi - lo).truncate() / COLUMNS as f64;
    if cell.min_element() <= 0.0 {
        return nothing;
    }
    // crossings of each column: height, and the change of the winding number on the way up
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); COLUMNS * COLUMNS];
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let flat = [a, b, c].map(glam::DVec3::truncate);
        let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
        if area == 0.0 {
            continue;
        }
        let low = (flat[0].min(flat[1]).min(flat[2]) - lo.truncate()) / cell;
        let high = (flat[0].max(flat[1]).max(flat[2]) - lo.truncate()) / cell;
        let last = COLUMNS - 1;
        for j in (low.y as usize).min(last)..=(high.y as usize).min(last) {
            for i in (low.x as usize).min(last)..=(high.x as usize).min(last) {
                let at = lo.truncate() + cell * (DVec2::new(i as f64, j as f64) + place(i, j));
                let weight = |p: DVec2, q: DVec2| (q - p).perp_dot(at - p) / area;
                let w = [
                    weight(flat[1], flat[2]),
                    weight(flat[2], flat[0]),
                    weight(flat[0], flat[1]),
                ];
                if w.iter().all(|w| *w >= 0.0) {
                    let z = w[0] * a.z + w[1] * b.z + w[2] * c.z;
                    // a face that looks down is entered
                    let change = if area < 0.0 { 1 } else { -1 };
                    crossings[j * COLUMNS + i].push((z, change));
                }
            }
        }
    }
    let inside: Vec<f64> = crossings.into_iter().map(length_inside).collect();
    let volume = inside.iter().sum::<f64>() * cell.x * cell.y;
    let mut variance = 0.0;
    for j in (0..COLUMNS).step_by(2) {
        for i in (0..COLUMNS).step_by(2) {
            let four = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
            let four = four.map(|(i, j)| inside[j * COLUMNS + i]);
            let mean = four.iter().sum::<f64>() / 4.0;
            let squares: f64 = four.iter().map(|l| (l - mean).powi(2)).sum();
            variance += 4.0 * squares / 3.0;
        }
    }
    UnionVolume {
        volume,
        sigma: variance.sqrt() * cell.x * cell.y,
    }
}

/// Length of a column with a winding number other than zero, of its crossings.
fn length_inside(mut crossings: Vec<(f64, i32)>) -> f64 {
    crossings.sort_by(|p, q| p.0.total_cmp(&q.0));
    let (mut winding, mut from, mut inside) = (0, 0.0, 0.0);
    for (z, change) in crossings {
        if winding != 0 {
            inside += z - from;
        }
        winding += change;
        from = z;
    }
    inside
}

/// Where in its cell a column stands, 0 to 1 both ways: a hash of its numbers (the finaliser of `splitmix64`).
fn place(i: usize, j: usize) -> DVec2 {
    let hash = |n: u64| {
        let n = (n ^ (n >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let n = (n ^ (n >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        n ^ (n >> 31)
    };
    let unit =
        |n: u64| (hash(n.wrapping_mul(0x9e37_79b9_7f4a_7c15)) >> 11) as f64 / (1_u64 << 53) as f64;
    let n = 2 * (j * COLUMNS + i) as u64 + 1;
    DVec2::new(unit(n), unit(n + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::shapes;

    fn joined(parts: &[(Mesh, DVec3)]) -> Mesh {
        let mut all = Mesh::default();
        for (part, by) in parts {
            let mut part = part.clone();
            part.vertices.iter_mut().for_each(|v| *v += *by);
            all.add(&part);
        }
        all
    }

    #[test]
    fn what_overlaps_counts_once_and_holes_do_not_count() {
        let block = |x: f64, y: f64, z: f64| shapes::thin_wall(x, y, z);
        let mut hole = block(20.0, 4.0, 10.0);
        for t in &mut hole.triangles {
            t.swap(1, 2);
        }
        let up = |z: f64| DVec3::new(0.0, 0.0, z);
        let whole = (block(60.0, 10.0, 20.0), DVec3::ZERO);
        for (parts, volume) in [
            (vec![whole.clone()], 12_000.0),
            // one inside the other
            (
                vec![whole.clone(), (block(20.0, 4.0, 10.0), up(5.0))],
                12_000.0,
            ),
            // a cavity
            (vec![whole.clone(), (hole, up(5.0))], 11_200.0),
            // a cross
            (
                vec![whole.clone(), (block(10.0, 60.0, 20.0), DVec3::ZERO)],
                22_000.0,
            ),
            // the same thing twice
            (vec![whole.clone(), whole], 12_000.0),
        ] {
            let found = union_volume(&joined(&parts));
            let off = (found.volume - volume).abs();
            assert!(
                off < 4.0 * found.sigma + 1e-6 * volume,
                "{volume}: {found:?}"
            );
            assert!(found.sigma < 2e-3 * volume, "{volume}: {found:?}");
        }
    }

    /// Slopes: a cone, whose mesh knows its volume.
    #[test]
    fn slopes_are_met_within_the_error_that_is_told() {
        let cone = shapes::cone(50.0, 35.0, 40.0);
        let found = union_volume(&cone);
        assert!(
            (found.volume - cone.volume()).abs() < 4.0 * found.sigma,
            "{found:?}"
        );
        assert!(found.sigma < 1e-3 * cone.volume());
    }

    /// A step between two groups of four columns scatters within neither.
    #[test]
    fn a_group_of_columns_is_four_neighbours() {
        let low = (shapes::thin_wall(64.0, 8.0, 10.0), DVec3::ZERO);
        let high = (
            shapes::thin_wall(64.0, 8.0, 20.0),
            DVec3::new(64.0, 0.0, 0.0),
        );
        let found = union_volume(&joined(&[low, high]));
        assert!((found.volume - 15_360.0).abs() < 1e-6, "{found:?}");
        assert!(found.sigma < 1e-6, "{found:?}");
    }
}
