//! Lines side by side as zigzags, where the way from one to the next is short and over what they fill.

use meltpath_geometry::math::DVec3;

/// A line with the number of its row.
pub(super) struct Line {
    pub(super) row: usize,
    pub(super) points: Vec<DVec3>,
}

/// Zigzags: each line goes on in one of the next row whose end is within `reach` mm, where the way there is `free`.
pub(super) fn chained(
    mut lines: Vec<Line>,
    reach: f64,
    free: impl Fn(DVec3, DVec3) -> bool,
) -> Vec<Vec<DVec3>> {
    let mut chains = Vec::new();
    while !lines.is_empty() {
        let Line {
            mut row,
            mut points,
        } = lines.remove(0);
        while let Some(&here) = points.last() {
            let ends = lines.iter().enumerate().filter(|(_, l)| l.row == row + 1);
            let ends = ends.flat_map(|(i, l)| {
                let first = l.points.first().map(|p| (here.distance(*p), i, false, *p));
                let last = l.points.last().map(|p| (here.distance(*p), i, true, *p));
                first.into_iter().chain(last)
            });
            let nearest = ends.min_by(|a, b| a.0.total_cmp(&b.0));
            let next = nearest.filter(|n| n.0 <= reach && free(here, n.3));
            let Some((_, i, turned, _)) = next else { break };
            let mut line = lines.remove(i);
            if turned {
                line.points.reverse();
            }
            points.append(&mut line.points);
            row += 1;
        }
        chains.push(points);
    }
    chains
}
