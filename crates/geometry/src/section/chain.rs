//! From the segments that a plane cuts out of triangles to closed loops, by mesh edges.

use crate::{math::DVec2, region::Ring};

/// Marks "none" among segment numbers.
const NONE: u32 = u32::MAX;

/// The cut of one triangle: from the edge it enters by to the edge it leaves by, solid on the left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// Edge of the start: both vertex numbers in one word, the smaller one high.
    pub(super) from: u64,
    /// Edge of the end.
    pub(super) to: u64,
    /// Where the plane cuts `from`.
    pub(super) start: DVec2,
    /// Along the lines that all such planes cut out of the triangle, of any length; 0 for a triangle without area.
    pub(super) along: DVec2,
}

impl Segment {
    /// Whether both were cut out of one flat face: where they meet is then no corner, but a place on an edge inside that face,
    /// which wanders with the height of the plane.
    fn runs_on(&self, next: &Segment) -> bool {
        let (a, b) = (self.along, next.along);
        let dot = a.dot(b);
        dot > 0.0 && a.perp_dot(b).abs() <= FLAT * dot
    }
}

/// Turn between two triangles up to which they are one flat face, rad: rounding of coordinates in f64.
const FLAT: f64 = 1e-12;

/// A chain of segments that does not close.
#[derive(Debug, Clone)]
pub(super) struct OpenChain {
    /// Its points but the last.
    pub(super) points: Vec<DVec2>,
    /// Edge of the last point.
    pub(super) last_edge: u64,
}

/// Working memory of one plane, kept from plane to plane.
#[derive(Debug, Default)]
pub(super) struct Chainer {
    pub(super) segments: Vec<Segment>,
    slots: Vec<u32>,
    successor: Vec<u32>,
    has_predecessor: Vec<bool>,
    visited: Vec<bool>,
}

fn hash(edge: u64) -> usize {
    let h = edge.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    (h ^ (h >> 32)) as usize
}

impl Chainer {
    /// Chains `self.segments` into closed rings and open chains, in the order of the segments.
    ///
    /// A segment goes on in the first segment, not taken yet, that starts on the edge where it ends. On a
    /// closed, consistently oriented mesh every edge has exactly one of each: all chains close. Where more
    /// than two triangles share an edge, any pairing closes and has the same winding numbers.
    pub(super) fn chain(&mut self) -> (Vec<Ring>, Vec<OpenChain>) {
        let count = self.segments.len();
        let size = (2 * count).next_power_of_two().max(16);
        let mask = size - 1;
        self.slots.clear();
        self.slots.resize(size, NONE);
        for (i, segment) in self.segments.iter().enumerate() {
            let mut at = hash(segment.from) & mask;
            while self.slots[at] != NONE {
                at = (at + 1) & mask;
            }
            self.slots[at] = i as u32;
        }
        self.successor.clear();
        self.successor.resize(count, NONE);
        self.has_predecessor.clear();
        self.has_predecessor.resize(count, false);
        for (i, segment) in self.segments.iter().enumerate() {
            let mut at = hash(segment.to) & mask;
            while self.slots[at] != NONE {
                let next = self.slots[at] as usize;
                if self.segments[next].from == segment.to && !self.has_predecessor[next] {
                    self.successor[i] = next as u32;
                    self.has_predecessor[next] = true;
                    break;
                }
                at = (at + 1) & mask;
            }
        }
        self.visited.clear();
        self.visited.resize(count, false);
        let mut open = Vec::new();
        for head in 0..count {
            if !self.has_predecessor[head] {
                let (points, last) = self.follow(head);
                open.push(OpenChain {
                    points,
                    last_edge: self.segments[last].to,
                });
            }
        }
        let mut closed = Vec::new();
        for head in 0..count {
            if !self.visited[head] {
                closed.push(self.follow(head).0);
            }
        }
        (closed, open)
    }

    /// The starts along a chain from `head` to its end, but those inside flat faces, and the last segment.
    fn follow(&mut self, head: usize) -> (Vec<DVec2>, usize) {
        let mut points = vec![self.segments[head].start];
        let mut at = head;
        loop {
            self.visited[at] = true;
            let next = self.successor[at];
            if next == NONE || self.visited[next as usize] {
                if next as usize == head && self.segments[at].runs_on(&self.segments[head]) {
                    points.remove(0);
                }
                return (points, at);
            }
            let next = next as usize;
            if !self.segments[at].runs_on(&self.segments[next]) {
                points.push(self.segments[next].start);
            }
            at = next;
        }
    }
}

/// A path that could not be closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Gap {
    /// Where it ends.
    pub(super) end: DVec2,
    /// From its end to its start, mm.
    pub(super) width: f64,
}

/// What joining the open chains of one plane gave.
#[derive(Debug, Default)]
pub(super) struct Joined {
    /// Rings closed over gaps.
    pub(super) rings: Vec<Ring>,
    /// Widest gap that was closed, mm.
    pub(super) widest: f64,
    /// Where the widest closed gap was.
    pub(super) place: Option<DVec2>,
    /// Chains left open.
    pub(super) open: Vec<Gap>,
}

/// Joins open chains whose ends lie within `reach` mm: nearest pairs first, an end to a start before an end to
/// an end. A ring made of chains of both senses takes the sense of the greater length.
///
/// Each chain is given with its last point. Ends that find no partner leave their path open.
pub(super) fn join(chains: &[Vec<DVec2>], reach: f64) -> Joined {
    // end points: 2k is the start of chain k, 2k + 1 its end
    let point = |e: usize| {
        let chain = &chains[e / 2];
        if e.is_multiple_of(2) {
            chain[0]
        } else {
            chain[chain.len() - 1]
        }
    };
    let mut order: Vec<usize> = (0..2 * chains.len()).collect();
    order.sort_by(|&a, &b| point(a).x.total_cmp(&point(b).x).then(a.cmp(&b)));
    let mut pairs: Vec<(bool, f64, usize, usize)> = Vec::new();
    for (k, &a) in order.iter().enumerate() {
        for &b in &order[k + 1..] {
            if point(b).x - point(a).x > reach {
                break;
            }
            let distance = point(a).distance(point(b));
            if distance <= reach {
                pairs.push((a % 2 == b % 2, distance, a.min(b), a.max(b)));
            }
        }
    }
    pairs.sort_by(|p, q| {
        (p.0.cmp(&q.0))
            .then(p.1.total_cmp(&q.1))
            .then((p.2, p.3).cmp(&(q.2, q.3)))
    });
    let mut mate = vec![None; 2 * chains.len()];
    let mut joined = Joined::default();
    for (_, distance, a, b) in pairs {
        if mate[a].is_none() && mate[b].is_none() {
            mate[a] = Some(b);
            mate[b] = Some(a);
            if joined.place.is_none() || distance > joined.widest {
                joined.widest = distance;
                joined.place = Some(point(a));
            }
        }
    }
    let mut visited = vec![false; chains.len()];
    // paths with loose ends first, then what is left closes
    let loose = (0..mate.len()).filter(|&e| mate[e].is_none());
    for start in loose.chain(0..mate.len()).collect::<Vec<_>>() {
        if visited[start / 2] {
            continue;
        }
        let is_loose = mate[start].is_none();
        let mut ring: Ring = Vec::new();
        let (mut along, mut against) = (0.0, 0.0);
        let mut enter = start;
        let last = loop {
            let chain = &chains[enter / 2];
            visited[enter / 2] = true;
            let length: f64 = chain.windows(2).map(|w| w[0].distance(w[1])).sum();
            if enter % 2 == 0 {
                ring.extend(chain);
                along += length;
            } else {
                ring.extend(chain.iter().rev());
                against += length;
            }
            let leave = enter ^ 1;
            match mate[leave] {
                Some(next) if !visited[next / 2] => enter = next,
                _ => break leave,
            }
        };
        if is_loose {
            joined.open.push(Gap {
                end: point(last),
                width: point(last).distance(point(start)),
            });
        } else {
            if against > along {
                ring.reverse();
            }
            joined.rings.push(ring);
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(points: &[[f64; 2]]) -> Vec<DVec2> {
        points.iter().map(|&p| DVec2::from(p)).collect()
    }

    #[test]
    fn a_square_in_two_pieces_closes_over_small_gaps() {
        let chains = [
            chain(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]),
            chain(&[[10.0, 10.02], [0.0, 10.0], [0.0, 0.01]]),
        ];
        let joined = join(&chains, 0.1);
        assert_eq!(joined.rings.len(), 1);
        assert!(joined.open.is_empty());
        assert!((joined.widest - 0.02).abs() < 1e-9);
        let area = crate::region::signed_area(&joined.rings[0]);
        assert!((area - 100.0).abs() < 0.2, "{area}");
    }

    #[test]
    fn a_reversed_piece_is_turned_and_a_wide_gap_stays_open() {
        let chains = [
            chain(&[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]),
            chain(&[[0.0, 0.01], [0.0, 5.0], [9.99, 10.0]]),
            chain(&[[30.0, 0.0], [35.0, 0.0], [35.0, 5.0]]),
        ];
        let joined = join(&chains, 0.1);
        assert_eq!(joined.rings.len(), 1);
        assert!(crate::region::signed_area(&joined.rings[0]) > 0.0);
        assert_eq!(joined.open.len(), 1);
        assert!((joined.open[0].width - 50.0_f64.sqrt()).abs() < 1e-12);
    }
}
