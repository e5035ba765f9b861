//! Points left out of a line that say nothing of its course.

use crate::math::DVec3;
use crate::segments::nearest_share;

/// Which points stay so that every one left out lies within `tolerance` mm of the chord that spans it; the ends stay
/// (after Ramer 1972 and Douglas, Peucker 1973).
pub fn thinned(points: &[DVec3], tolerance: f64) -> Vec<bool> {
    let mut stays = vec![false; points.len()];
    let Some(last) = points.len().checked_sub(1) else {
        return stays;
    };
    (stays[0], stays[last]) = (true, true);
    let mut open = vec![(0, last)];
    // a closed line has no chord of its own: it is halved first
    if points.len() > 3 && points[0] == points[last] {
        let far = |i: &usize| points[*i].distance_squared(points[0]);
        let middle = (1..last)
            .max_by(|a, b| far(a).total_cmp(&far(b)))
            .unwrap_or(1);
        stays[middle] = true;
        open = vec![(0, middle), (middle, last)];
    }
    while let Some((a, b)) = open.pop() {
        let (from, way) = (points[a], points[b] - points[a]);
        let off = |i: usize| {
            let p = points[i] - from;
            p.distance(nearest_share(p.dot(way), way.length_squared()) * way)
        };
        let worst = (a + 1..b)
            .map(|i| (i, off(i)))
            .max_by(|x, y| x.1.total_cmp(&y.1));
        if let Some((i, off)) = worst
            && off > tolerance
        {
            stays[i] = true;
            open.extend([(a, i), (i, b)]);
        }
    }
    stays
}
