//! What lies of regions and lines in a rectangle, whatever order lines come in and whichever way they run.

use std::cmp::Ordering;

use crate::boolean::{PlanarError, intersection};
use crate::math::DVec2;
use crate::region::Region;

/// A rectangle, its corners on the grid of planar operations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    pub(super) low: DVec2,
    pub(super) high: DVec2,
}

impl Bounds {
    pub(super) fn grown(self, by: f64) -> Bounds {
        Bounds {
            low: self.low - by,
            high: self.high + by,
        }
    }

    pub(super) fn region(self) -> Region {
        Region::rectangle(self.low, self.high)
    }

    pub(super) fn area(self) -> f64 {
        let size = self.high - self.low;
        size.x * size.y
    }

    /// The part of regions inside; a sweep cuts only those that cross its edge.
    pub(super) fn part_of(self, regions: &[Region]) -> Result<Vec<Region>, PlanarError> {
        let mut inside = Vec::new();
        let mut crossing = Vec::new();
        for region in regions {
            if region.holes.is_empty() && is_around(&region.outer, self) {
                inside.push(self.region());
                continue;
            }
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            for &p in &region.outer {
                (low, high) = (low.min(p), high.max(p));
            }
            if low.cmpge(self.low).all() && high.cmple(self.high).all() {
                inside.push(region.clone());
            } else if low.cmplt(self.high).all() && high.cmpgt(self.low).all() {
                crossing.push(region.clone());
            }
        }
        if !crossing.is_empty() {
            inside.extend(intersection(&crossing, &[self.region()])?);
        }
        Ok(inside)
    }

    /// The part of a stretch inside (Liang and Barsky): its ends, and whether each was cut off. The same points whichever way it runs.
    fn clip(self, a: DVec2, b: DVec2) -> Option<[(DVec2, bool); 2]> {
        if before(b, a).is_lt() {
            return self.clip(b, a).map(|[start, end]| [end, start]);
        }
        let way = b - a;
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (p, q) in [
            (-way.x, a.x - self.low.x),
            (way.x, self.high.x - a.x),
            (-way.y, a.y - self.low.y),
            (way.y, self.high.y - a.y),
        ] {
            if p == 0.0 {
                if q < 0.0 {
                    return None;
                }
            } else if p < 0.0 {
                from = from.max(q / p);
            } else {
                to = to.min(q / p);
            }
        }
        let start = if from > 0.0 { a.lerp(b, from) } else { a };
        let end = if to < 1.0 { a.lerp(b, to) } else { b };
        (from <= to).then_some([(start, from > 0.0), (end, to < 1.0)])
    }

    /// What lies inside of polylines, each cut where it leaves; a closed one is not cut where it starts.
    pub(super) fn clipped(self, lines: &[Vec<DVec2>]) -> Vec<Vec<DVec2>> {
        let mut inside = Vec::new();
        for line in lines {
            let first = inside.len();
            if let [dot] = line[..] {
                inside.extend(self.clip(dot, dot).map(|_| vec![dot]));
                continue;
            }
            let mut piece: Vec<DVec2> = Vec::new();
            let mut starts_inside = false;
            for (i, side) in line.windows(2).enumerate() {
                let Some([start, end]) = self.clip(side[0], side[1]) else {
                    inside.extend((!piece.is_empty()).then(|| std::mem::take(&mut piece)));
                    continue;
                };
                starts_inside |= i == 0 && !start.1;
                if piece.is_empty() || start.1 {
                    inside.extend((!piece.is_empty()).then(|| std::mem::take(&mut piece)));
                    piece.push(start.0);
                }
                piece.push(end.0);
                if end.1 {
                    inside.push(std::mem::take(&mut piece));
                }
            }
            if piece.is_empty() {
                continue;
            }
            if starts_inside && inside.len() > first && line.first() == line.last() {
                piece.extend(inside[first].drain(1..));
                inside[first] = piece;
            } else {
                inside.push(piece);
            }
        }
        inside
    }
}

/// The order of points from left to right, then upwards.
fn before(a: DVec2, b: DVec2) -> Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

/// Lines in one order whatever order they came in, each running one way, closed ones from one of their points.
pub(super) fn in_order(mut lines: Vec<Vec<DVec2>>) -> Vec<Vec<DVec2>> {
    for line in &mut lines {
        let last = line.len() - 1;
        if last > 1 && line[0] == line[last] {
            line.pop();
            let lowest = (0..last).min_by(|&i, &j| before(line[i], line[j]));
            line.rotate_left(lowest.unwrap_or(0));
            if before(line[last - 1], line[1]).is_lt() {
                line[1..].reverse();
            }
            line.push(line[0]);
        } else if before(line[last], line[0]).is_lt() {
            line.reverse();
        }
    }
    let order = |a: &Vec<DVec2>, b: &Vec<DVec2>| {
        let points = a.iter().zip(b).map(|(&p, &q)| before(p, q));
        let differ = points.into_iter().find(|order| order.is_ne());
        differ.unwrap_or(a.len().cmp(&b.len()))
    };
    lines.sort_by(order);
    lines
}

/// Whether a ring is a rectangle along the axes round `bounds`.
fn is_around(ring: &[DVec2], bounds: Bounds) -> bool {
    ring.len() == 4
        && ring.iter().all(|p| {
            (p.x <= bounds.low.x || p.x >= bounds.high.x)
                && (p.y <= bounds.low.y || p.y >= bounds.high.y)
        })
        && (0..4).all(|i| ring[i].x == ring[(i + 1) % 4].x || ring[i].y == ring[(i + 1) % 4].y)
        && ring
            .iter()
            .any(|p| p.x <= bounds.low.x && p.y <= bounds.low.y)
        && ring
            .iter()
            .any(|p| p.x >= bounds.high.x && p.y >= bounds.high.y)
}
