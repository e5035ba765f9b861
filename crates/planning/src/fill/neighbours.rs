//! Which beads lie beside each bead, on which side, from where to where.

use meltpath_geometry::Plane;
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::{Layer, Neighbour, Side};

use crate::fill::outline::nearest_share;

/// Beads farther apart than this many widths are no neighbours.
const REACH_IN_WIDTHS: f64 = 1.2;
/// Samples per bead width along a bead.
const SAMPLES_PER_WIDTH: f64 = 4.0;
/// Samples that look for beads beside them together, as far as these lie on one straight stretch.
const TOGETHER: usize = 8;
/// Way along the bead, in distances across, that separates a neighbouring stretch of the same bead from its own next.
const OWN_WAY: f64 = 1.3;

struct Segment {
    pass: usize,
    a: DVec2,
    b: DVec2,
    /// Arc length at `a`, mm.
    along: f64,
}

/// Segments by the square cells they touch.
struct Index {
    cell: f64,
    segments: Vec<Segment>,
    /// Cells with the segments that touch them, in order.
    cells: Vec<([i64; 2], u32)>,
}

impl Index {
    fn key(&self, p: DVec2) -> [i64; 2] {
        (p / self.cell).floor().to_array().map(|k| k as i64)
    }

    fn new(cell: f64, segments: Vec<Segment>) -> Self {
        let mut index = Index {
            cell,
            segments,
            cells: Vec::new(),
        };
        for i in 0..index.segments.len() {
            let (a, b) = (index.segments[i].a, index.segments[i].b);
            // every cell of each piece no longer than a cell
            let n = (a.distance(b) / cell).ceil().max(1.0) as usize;
            for k in 0..n {
                let (p, q) = (
                    a.lerp(b, k as f64 / n as f64),
                    a.lerp(b, (k + 1) as f64 / n as f64),
                );
                let (low, high) = (index.key(p.min(q)), index.key(p.max(q)));
                for x in low[0]..=high[0] {
                    index
                        .cells
                        .extend((low[1]..=high[1]).map(|y| ([x, y], i as u32)));
                }
            }
        }
        index.cells.sort_unstable();
        index.cells.dedup();
        index
    }

    /// Indices of the segments in the cells within a cell of the box from `low` to `high`, in order.
    fn near(&self, low: DVec2, high: DVec2, found: &mut Vec<u32>) {
        found.clear();
        let (low, high) = (self.key(low - self.cell), self.key(high + self.cell));
        for x in low[0]..=high[0] {
            let first = self.cells.partition_point(|(key, _)| *key < [x, low[1]]);
            let column = self.cells[first..].iter();
            let column = column.take_while(|(key, _)| *key <= [x, high[1]]);
            found.extend(column.map(|&(_, segment)| segment));
        }
        found.sort_unstable();
        found.dedup();
    }

    /// Of the segments near a straight way from `a` to `b`, those that run along it.
    fn along(&self, a: DVec2, b: DVec2, way: DVec2, found: &mut Vec<u32>) {
        self.near(a.min(b), a.max(b), found);
        found.retain(|&i| {
            let other = &self.segments[i as usize];
            let e = other.b - other.a;
            way.dot(e).abs() >= 0.7 * e.length()
        });
    }
}

/// A pass as a polyline in the layer's coordinates, mm, and the arc length at its points, mm.
type Line = (Vec<DVec2>, Vec<f64>);

fn flattened(path: &Layer, plane: &Plane, tolerance: f64) -> Vec<Line> {
    let local = |points: Vec<_>| -> Vec<DVec2> {
        let points = points.iter();
        points.map(|&p| plane.to_local(p).truncate()).collect()
    };
    path.passes()
        .map(|pass| {
            let (points, along) = pass.flatten(tolerance);
            (local(points), along)
        })
        .collect()
}

/// The straight stretches of lines, those without length left out.
fn segments(lines: &[Line]) -> Vec<Segment> {
    let all = lines.iter().enumerate();
    all.flat_map(|(pass, (points, along))| {
        let stretches = points.windows(2).zip(along);
        stretches.map(move |(s, &along)| Segment {
            pass,
            a: s[0],
            b: s[1],
            along,
        })
    })
    .filter(|s| s.a != s.b)
    .collect()
}

/// Fills in the neighbours of all passes of a layer.
pub(crate) fn find(path: &mut Layer, plane: &Plane, width: f64, tolerance: f64) {
    let reach = REACH_IN_WIDTHS * width;
    let lines = flattened(path, plane, tolerance);
    let index = Index::new(reach, segments(&lines));
    let mut found = Vec::new();
    let ids: Vec<_> = path.passes().map(|p| p.head.id).collect();
    let mut all = Vec::new();
    for (me, (points, along)) in lines.iter().enumerate() {
        let total = along.last().copied().unwrap_or(0.0);
        let n = (total / width * SAMPLES_PER_WIDTH).ceil().max(1.0) as usize;
        let step = total / n as f64;
        let mut runs: [Option<Run>; 2] = [None, None];
        let mut mine = Vec::new();
        let mut at = 0;
        let mut looked_at = (usize::MAX, 0);
        for k in 0..n {
            let s = (k as f64 + 0.5) * step;
            while at + 2 < along.len() && along[at + 1] < s {
                at += 1;
            }
            let (a, b) = (points[at], points[at + 1]);
            let t = (b - a).normalize_or_zero();
            let p = a + t * (s - along[at]);
            if (at, k / TOGETHER) != looked_at {
                looked_at = (at, k / TOGETHER);
                let last = (s + (TOGETHER - 1 - k % TOGETHER) as f64 * step).min(along[at + 1]);
                index.along(
                    p,
                    a + t * (last - along[at]).max(s - along[at]),
                    t,
                    &mut found,
                );
            }
            let here = Here { pass: me, p, t, s };
            let nearest = nearest(&index, &found, &here, reach);
            let interval = (s - 0.5 * step, s + 0.5 * step);
            for side in 0..2 {
                let goes_on = match (&runs[side], nearest[side]) {
                    (Some(run), Some((d, pass))) => {
                        run.pass == pass && (d - run.last).abs() < 0.3 * width
                    }
                    _ => false,
                };
                if !goes_on {
                    mine.extend(runs[side].take().map(|r| (side, r)));
                }
                if let Some((d, pass)) = nearest[side] {
                    let run = runs[side].get_or_insert(Run {
                        pass,
                        from: interval.0,
                        to: interval.0,
                        sum: 0.0,
                        count: 0,
                        last: d,
                    });
                    run.to = interval.1;
                    run.sum += d;
                    run.count += 1;
                    run.last = d;
                }
            }
        }
        for (side, run) in runs.into_iter().enumerate() {
            mine.extend(run.map(|r| (side, r)));
        }
        mine.sort_by(|a, b| a.1.from.total_cmp(&b.1.from).then(a.0.cmp(&b.0)));
        all.extend(mine.into_iter().map(|(side, run)| {
            let beside = Neighbour {
                from: run.from,
                to: run.to,
                side: if side == 0 { Side::Left } else { Side::Right },
                pass: ids[run.pass],
                distance: run.sum / f64::from(run.count),
                layer: path.number,
            };
            (me as u32, beside)
        }));
    }
    path.set_neighbours(all);
}

/// A place on a pass.
struct Here {
    pass: usize,
    p: DVec2,
    /// Direction of travel.
    t: DVec2,
    /// Arc length, mm.
    s: f64,
}

/// Distance and pass of the nearest bead to the left and to the right of a place, within `reach`, of the segments `found`, which run along it.
fn nearest(index: &Index, found: &[u32], here: &Here, reach: f64) -> [Option<(f64, usize)>; 2] {
    let mut nearest: [Option<(f64, usize)>; 2] = [None, None];
    for &i in found {
        let other = &index.segments[i as usize];
        let e = other.b - other.a;
        let share = nearest_share(here.p, other.a, other.b);
        let v = other.a + e * share - here.p;
        let distance = v.length();
        let lateral = here.t.perp_dot(v);
        let own = other.pass == here.pass
            && (other.along + share * e.length() - here.s).abs() < OWN_WAY * distance.max(1e-9);
        if own || distance > reach || distance < 1e-6 || lateral.abs() < 0.9 * distance {
            continue;
        }
        let side = usize::from(lateral < 0.0);
        if nearest[side].is_none_or(|(d, _)| distance < d) {
            nearest[side] = Some((distance, other.pass));
        }
    }
    nearest
}

/// A stretch along which one pass is the nearest on one side.
struct Run {
    pass: usize,
    from: f64,
    to: f64,
    sum: f64,
    count: u32,
    last: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within a cell of a place every segment is found, beyond its end too.
    #[test]
    fn segments_are_found_from_a_cell_beyond_their_ends() {
        let long = Segment {
            pass: 0,
            a: DVec2::new(0.5, 0.5),
            b: DVec2::new(0.5, 2.05),
            along: 0.0,
        };
        let index = Index::new(1.0, vec![long]);
        let mut found = Vec::new();
        for (y, wanted) in [(-0.4, 1), (1.3, 1), (3.0, 1), (4.5, 0)] {
            let place = DVec2::new(0.5, y);
            index.near(place, place, &mut found);
            assert_eq!(found.len(), wanted, "at {y}");
        }
    }
}
