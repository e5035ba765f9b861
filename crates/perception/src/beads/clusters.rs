//! Points that hang together, and how far they reach.

use std::collections::BTreeMap;

use meltpath_geometry::math::{DVec2, DVec3};

/// Points of one bead are no farther apart than this, mm, or three times the usual distance between points.
const TOGETHER: f64 = 1.0;
/// Least and greatest value.
pub(super) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    })
}

/// Least and greatest coordinates.
pub(super) fn spread(points: impl Iterator<Item = DVec2>) -> [DVec2; 2] {
    points.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| {
        [low.min(p), high.max(p)]
    })
}

/// The cell of a plane that a point lies over.
pub(super) fn cell(p: DVec3, size: f64) -> [i64; 2] {
    [(p.x / size).floor() as i64, (p.y / size).floor() as i64]
}

/// Points that hang together, the largest cluster first.
pub(super) fn clusters(points: &[DVec3]) -> Vec<Vec<DVec3>> {
    let count = |size: f64| {
        let mut cells: Vec<[i64; 2]> = points.iter().map(|p| cell(*p, size)).collect();
        cells.sort_unstable();
        cells.dedup();
        cells.len()
    };
    // the usual distance between points: an area of the plate for each
    let pitch = TOGETHER * (count(TOGETHER) as f64 / points.len().max(1) as f64).sqrt();
    let size = TOGETHER.max(3.0 * pitch.min(TOGETHER));
    let mut cells: BTreeMap<[i64; 2], Vec<DVec3>> = BTreeMap::new();
    for p in points {
        cells.entry(cell(*p, size)).or_default().push(*p);
    }
    let mut clusters = Vec::new();
    while let Some((first, own)) = cells.pop_first() {
        let (mut cluster, mut open) = (own, vec![first]);
        while let Some([x, y]) = open.pop() {
            for next in (-1..=1).flat_map(|i| (-1..=1).map(move |j| [x + i, y + j])) {
                if let Some(own) = cells.remove(&next) {
                    cluster.extend(own);
                    open.push(next);
                }
            }
        }
        clusters.push(cluster);
    }
    clusters.sort_by_key(|c| std::cmp::Reverse(c.len()));
    clusters
}
