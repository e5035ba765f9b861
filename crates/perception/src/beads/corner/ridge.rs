//! The crest of a bead: where the surface is highest across the direction in which it bends most.
//!
//! Source: Rouchon 2022, §3.3.2, the rigorous definition: the gradient of the height changes its sign along a principal direction of
//! curvature. The thesis itself took points without a gradient, which are few where a bead is level along its way.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_numerics::least_squares::Regression;

use crate::beads::clusters::cell;

/// Cells of the grid on which the surface is taken, mm.
const CELL: f64 = 0.25;
/// Least curvature across a crest, 1/mm.
const BENT: f64 = 0.02;
/// Where the surface bends by more than this share as much along as across, no direction is across.
const ROUND: f64 = 0.8;
/// Least cells of a fit of six numbers.
const LEAST: usize = 16;

/// Points of the crest of a cluster, about one for each cell that it crosses, on places higher than a share of the cluster's usual top.
/// The surface round each cell is the quadratic of least squares of what lies within `window` mm.
pub(super) fn crest(points: &[DVec3], window: f64, high: f64) -> Vec<DVec2> {
    let mut cells: BTreeMap<[i64; 2], (DVec3, f64)> = BTreeMap::new();
    for p in points {
        let sum = cells.entry(cell(*p, CELL)).or_default();
        *sum = (sum.0 + *p, sum.1 + 1.0);
    }
    let means: BTreeMap<[i64; 2], DVec3> = cells
        .into_iter()
        .map(|(at, (sum, n))| (at, sum / n))
        .collect();
    let mut heights: Vec<f64> = means.values().map(|p| p.z).collect();
    heights.sort_by(f64::total_cmp);
    let Some(top) = heights.get(heights.len() * 4 / 5) else {
        return Vec::new();
    };
    let least = high * top;
    let reach = (window / CELL).ceil() as i64;
    // a crest may run between the rows of a scan, over cells without points
    let tall = means.iter().filter(|(_, p)| p.z > least);
    let looked: BTreeSet<[i64; 2]> = tall
        .flat_map(|([i, j], _)| {
            (-1..=1).flat_map(move |di| (-1..=1).map(move |dj| [i + di, j + dj]))
        })
        .collect();
    looked
        .into_iter()
        .filter_map(|[i, j]| {
            let middle = CELL * DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
            let around = (-reach..=reach)
                .flat_map(|row| means.range([i + row, j - reach]..=[i + row, j + reach]));
            let within = around.filter_map(|(_, p)| {
                let d = p.truncate() - middle;
                let share = d.length_squared() / (window * window);
                (share < 1.0).then_some((d, p.z, 1.0 - share))
            });
            let (top, height) = top_across(within)?;
            let own = top.abs().max_element() <= 0.5 * CELL && height > least;
            own.then_some(middle + top)
        })
        .collect()
}

/// Where the quadratic through places, heights and weights is highest across its strongest bend, and its height in the middle.
fn top_across(points: impl Iterator<Item = (DVec2, f64, f64)>) -> Option<(DVec2, f64)> {
    let mut fit = Regression::new(6);
    let mut count = 0;
    for (d, z, weight) in points {
        let row = [1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y];
        fit.push(row.map(|v| weight * v), weight * z);
        count += 1;
    }
    if count < LEAST {
        return None;
    }
    let found = fit.solve().ok()?;
    let [height, gx, gy, xx, xy, yy] = found.values[..] else {
        return None;
    };
    // the matrix of second derivatives [2xx, xy; xy, 2yy]
    let (mean, half) = (xx + yy, (xx - yy).hypot(xy));
    let (across, along) = (mean - half, mean + half);
    if across > -BENT || along < ROUND * across {
        return None;
    }
    let angle = 0.5 * xy.atan2(xx - yy) + std::f64::consts::FRAC_PI_2;
    let direction = DVec2::from_angle(angle);
    let top = -DVec2::new(gx, gy).dot(direction) / across * direction;
    Some((top, height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    #[test]
    fn the_crest_of_a_bent_bead_is_its_middle() {
        let mut random = Random::new(2);
        let radius = 12.0;
        for noise in [0.0, 0.05] {
            let mut points = Vec::new();
            for _ in 0..60_000 {
                let p = DVec2::new(random.between(-16.0, 16.0), random.between(-16.0, 16.0));
                let z = 2.0 * (1.0 - ((p.length() - radius) / 3.5).powi(2));
                if z > 0.2 {
                    points.push(p.extend(z + noise * random.normal()));
                }
            }
            let crest = crest(&points, 1.4, 0.5);
            let way = 2.0 * std::f64::consts::PI * radius;
            assert!(crest.len() as f64 > 2.0 * way, "{}", crest.len());
            let off = |p: &DVec2| p.length() - radius;
            let n = crest.len() as f64;
            let mean = crest.iter().map(off).sum::<f64>() / n;
            let rms = (crest.iter().map(|p| off(p).powi(2)).sum::<f64>() / n).sqrt();
            assert!(mean.abs() < 0.02 && rms < 0.05, "{noise}: {mean} {rms}");
        }
    }

    /// Rows of a scan 0.3 mm apart leave rows of cells empty: a crest that runs along one of them is seen all the same.
    #[test]
    fn a_crest_between_rows_of_a_scan_is_seen() {
        for middle in 0..12 {
            let middle = 0.05 * f64::from(middle);
            let mut points = Vec::new();
            for i in 0..100 {
                for j in -15..=15 {
                    let (x, y) = (0.3 * f64::from(i), 0.3 * f64::from(j));
                    let z = 2.0 * (1.0 - ((y - middle) / 3.5).powi(2));
                    if z > 0.2 {
                        points.push(DVec3::new(x, y, z));
                    }
                }
            }
            let crest = crest(&points, 1.5, 0.5);
            assert!(crest.len() > 80, "{middle}: {}", crest.len());
            assert!(crest.iter().all(|p| (p.y - middle).abs() < 0.02));
        }
    }

    #[test]
    fn a_dome_and_a_plane_have_no_crest() {
        let mut points = Vec::new();
        for i in -60..60 {
            for j in -60..60 {
                let p = 0.1 * DVec2::new(f64::from(i), f64::from(j));
                points.push(p.extend(3.0 - 0.05 * p.length_squared()));
            }
        }
        assert!(crest(&points, 1.5, 0.5).is_empty());
        for p in &mut points {
            p.z = 1.0 + 0.1 * p.x;
        }
        assert!(crest(&points, 1.5, 0.5).is_empty());
    }
}
