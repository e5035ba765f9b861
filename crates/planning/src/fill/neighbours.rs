//! Which beads lie beside each bead, on which side, from where to where.

use std::collections::HashMap;

use meltpath_geometry::Plane;
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::{Layer, Neighbour, Side};

use crate::fill::outline::nearest_share;

/// Beads farther apart than this many widths are no neighbours.
const REACH_IN_WIDTHS: f64 = 1.2;
/// Samples per bead width along a bead.
const SAMPLES_PER_WIDTH: f64 = 4.0;
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
    cells: HashMap<(i64, i64), Vec<u32>>,
}

impl Index {
    fn key(&self, p: DVec2) -> (i64, i64) {
        let k = (p / self.cell).floor();
        (k.x as i64, k.y as i64)
    }

    fn new(cell: f64, segments: Vec<Segment>) -> Self {
        let mut index = Index {
            cell,
            segments,
            cells: HashMap::new(),
        };
        for i in 0..index.segments.len() {
            let (a, b) = (index.segments[i].a, index.segments[i].b);
            // every cell of each piece no longer than a cell
            let n = (a.distance(b) / cell).ceil().max(1.0) as usize;
            let mut keys = Vec::new();
            for k in 0..n {
                let (p, q) = (
                    a.lerp(b, k as f64 / n as f64),
                    a.lerp(b, (k + 1) as f64 / n as f64),
                );
                let (low, high) = (index.key(p.min(q)), index.key(p.max(q)));
                keys.extend((low.0..=high.0).flat_map(|x| (low.1..=high.1).map(move |y| (x, y))));
            }
            keys.sort_unstable();
            keys.dedup();
            for key in keys {
                index.cells.entry(key).or_default().push(i as u32);
            }
        }
        index
    }

    /// Indices of the segments in the cells round `p`, in order.
    fn near(&self, p: DVec2, found: &mut Vec<u32>) {
        found.clear();
        let (x, y) = self.key(p);
        for key in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (x + i, y + j))) {
            found.extend(self.cells.get(&key).into_iter().flatten());
        }
        found.sort_unstable();
        found.dedup();
    }
}

/// Fills in the neighbours of all passes of a layer.
pub(crate) fn find(path: &mut Layer, plane: &Plane, width: f64, tolerance: f64) {
    let reach = REACH_IN_WIDTHS * width;
    let lines: Vec<(Vec<DVec2>, Vec<f64>)> = path
        .passes()
        .map(|pass| {
            let (points, along) = pass.flatten(tolerance);
            (
                points
                    .iter()
                    .map(|&p| plane.to_local(p).truncate())
                    .collect(),
                along,
            )
        })
        .collect();
    let segments = lines
        .iter()
        .enumerate()
        .flat_map(|(pass, (points, along))| {
            points
                .windows(2)
                .zip(along)
                .map(move |(s, &along)| Segment {
                    pass,
                    a: s[0],
                    b: s[1],
                    along,
                })
        })
        .filter(|s| s.a != s.b)
        .collect();
    let index = Index::new(reach, segments);
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
        for k in 0..n {
            let s = (k as f64 + 0.5) * step;
            while at + 2 < along.len() && along[at + 1] < s {
                at += 1;
            }
            let (a, b) = (points[at], points[at + 1]);
            let t = (b - a).normalize_or_zero();
            let p = a + t * (s - along[at]);
            index.near(p, &mut found);
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

/// Distance and pass of the nearest bead to the left and to the right of a place, within `reach`, of the segments `found`.
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
        if own
            || distance > reach
            || distance < 1e-6
            || lateral.abs() < 0.9 * distance
            || here.t.dot(e).abs() < 0.7 * e.length()
        {
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
            index.near(DVec2::new(0.5, y), &mut found);
            assert_eq!(found.len(), wanted, "at {y}");
        }
    }
}
