//! From closed loops to regions with holes, by the non-zero rule; and the test whether loops touch.
//!
//! Loops that touch nothing nest as a forest: winding numbers follow from containment, no clipping is needed.
//! Contacts are found on chains of edges that are monotone in x and y, whose bounding boxes follow from their
//! ends (as in the JTS topology suite's index).

use robust::{Coord, orient2d};

use crate::{
    boolean::{PlanarError, union},
    math::DVec2,
    region::{Region, Ring, signed_area},
};

/// Regions from loops, and what it took.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Nested {
    /// The regions, largest outer ring first (or as the union gives them).
    pub(super) regions: Vec<Region>,
    /// Loops crossed or touched, so that their union was taken.
    pub(super) united: bool,
    /// Loops left out because both sides are solid.
    pub(super) absorbed: usize,
}

/// Nests `loops` (any sense of rotation) by the non-zero rule.
///
/// # Errors
/// Loops that touch, too far from the origin for the union.
pub(super) fn nest(loops: &[Ring]) -> Result<Nested, PlanarError> {
    if touch(loops) {
        // the union keeps the sense of each ring as it stands: one ring a region, whatever its sense
        let rings: Vec<Region> = loops
            .iter()
            .map(|ring| Region {
                outer: ring.clone(),
                holes: Vec::new(),
            })
            .collect();
        return Ok(Nested {
            regions: union(&rings)?,
            united: true,
            absorbed: 0,
        });
    }
    let mut frames: Vec<Frame> = loops
        .iter()
        .enumerate()
        .map(|(index, ring)| Frame::of(index, ring))
        .collect();
    frames.sort_by(|a, b| (b.area.abs().total_cmp(&a.area.abs())).then(a.index.cmp(&b.index)));
    let mut regions: Vec<Region> = Vec::new();
    let mut absorbed = 0;
    // winding number inside each loop, and the region that its inside belongs to
    let mut inside: Vec<(i32, Option<usize>)> = Vec::with_capacity(frames.len());
    for (k, frame) in frames.iter().enumerate() {
        let ring = &loops[frame.index];
        let probe = ring[0];
        // loops that do not touch: one point decides; the nearest smaller container is the parent
        let parent = (0..k).rev().find(|&j| {
            frames[j].lo.cmple(frame.lo).all()
                && frames[j].hi.cmpge(frame.hi).all()
                && holds(&loops[frames[j].index], probe)
        });
        let (outer_winding, outer_region) = parent.map_or((0, None), |j| inside[j]);
        let winding = outer_winding + if frame.area > 0.0 { 1 } else { -1 };
        let region = match (outer_winding != 0, winding != 0) {
            (false, true) => {
                let mut outer = ring.clone();
                if frame.area < 0.0 {
                    outer.reverse();
                }
                regions.push(Region {
                    outer,
                    holes: Vec::new(),
                });
                Some(regions.len() - 1)
            }
            (true, false) => {
                if let Some(region) = outer_region {
                    let mut hole = ring.clone();
                    if frame.area > 0.0 {
                        hole.reverse();
                    }
                    regions[region].holes.push(hole);
                }
                None
            }
            (_, _) => {
                absorbed += 1;
                outer_region
            }
        };
        inside.push((winding, region));
    }
    Ok(Nested {
        regions,
        united: false,
        absorbed,
    })
}

/// A loop's place and size.
struct Frame {
    index: usize,
    area: f64,
    lo: DVec2,
    hi: DVec2,
}

impl Frame {
    fn of(index: usize, ring: &Ring) -> Self {
        let first = ring[0];
        let (lo, hi) = ring
            .iter()
            .fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        Frame {
            index,
            area: signed_area(ring),
            lo,
            hi,
        }
    }
}

/// Twice the signed area of a triangle; the sign is exact.
fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Whether a ring holds a point that does not lie on it.
fn holds(ring: &Ring, p: DVec2) -> bool {
    let mut inside = false;
    let mut a = ring[ring.len() - 1];
    for &b in ring {
        if (a.y > p.y) != (b.y > p.y) {
            let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
            if orient(low, high, p) > 0.0 {
                inside = !inside;
            }
        }
        a = b;
    }
    inside
}

/// A run of edges of one loop along which x and y never change direction.
#[derive(Debug, Clone, Copy)]
struct Run {
    ring: usize,
    /// First edge, and the one after the last; edge k goes from point k to point k + 1.
    first: usize,
    past: usize,
}

/// Whether any two loops, or one loop with itself, share a point other than that between two edges in a row.
fn touch(loops: &[Ring]) -> bool {
    let mut runs: Vec<(DVec2, DVec2, Run)> = Vec::new();
    for (ring, points) in loops.iter().enumerate() {
        let sign = |k: usize| {
            let d = points[(k + 1) % points.len()] - points[k];
            (d.x >= 0.0, d.y >= 0.0)
        };
        let mut first = 0;
        while first < points.len() {
            let kind = sign(first);
            let mut past = first + 1;
            while past < points.len() && sign(past) == kind {
                past += 1;
            }
            let run = Run { ring, first, past };
            let (lo, hi) = bounds(points, run);
            runs.push((lo, hi, run));
            first = past;
        }
    }
    runs.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
    for (i, (_, hi, a)) in runs.iter().enumerate() {
        for (lo, _, b) in &runs[i + 1..] {
            if lo.x > hi.x {
                break;
            }
            if runs_touch(loops, *a, *b) {
                return true;
            }
        }
    }
    false
}

/// The bounding box of a run: that of its two ends.
fn bounds(points: &Ring, run: Run) -> (DVec2, DVec2) {
    let (a, b) = (points[run.first], points[run.past % points.len()]);
    (a.min(b), a.max(b))
}

fn runs_touch(loops: &[Ring], a: Run, b: Run) -> bool {
    let (alo, ahi) = bounds(&loops[a.ring], a);
    let (blo, bhi) = bounds(&loops[b.ring], b);
    if alo.cmpgt(bhi).any() || blo.cmpgt(ahi).any() {
        return false;
    }
    let (na, nb) = (a.past - a.first, b.past - b.first);
    if na == 1 && nb == 1 {
        return edges_touch(loops, (a.ring, a.first), (b.ring, b.first));
    }
    let halves = |run: Run| {
        let middle = usize::midpoint(run.first, run.past);
        [
            Run {
                past: middle,
                ..run
            },
            Run {
                first: middle,
                ..run
            },
        ]
    };
    if na >= nb {
        halves(a).into_iter().any(|half| runs_touch(loops, half, b))
    } else {
        halves(b).into_iter().any(|half| runs_touch(loops, a, half))
    }
}

/// Whether two edges share a point; neighbours in a ring only if they fold back on each other.
fn edges_touch(loops: &[Ring], (ra, ea): (usize, usize), (rb, eb): (usize, usize)) -> bool {
    let edge = |r: usize, e: usize| {
        let ring = &loops[r];
        (ring[e], ring[(e + 1) % ring.len()])
    };
    let ((a, b), (c, d)) = (edge(ra, ea), edge(rb, eb));
    if ra == rb {
        let n = loops[ra].len();
        let folds = |before: DVec2, corner: DVec2, after: DVec2| {
            orient(before, corner, after) == 0.0 && (before - corner).dot(after - corner) > 0.0
        };
        if (ea + 1) % n == eb {
            return folds(a, b, d) || ((eb + 1) % n == ea && folds(c, d, b));
        }
        if (eb + 1) % n == ea {
            return folds(c, d, b);
        }
    }
    let (o1, o2) = (orient(a, b, c), orient(a, b, d));
    let (o3, o4) = (orient(c, d, a), orient(c, d, b));
    if (o1 > 0.0 && o2 > 0.0) || (o1 < 0.0 && o2 < 0.0) {
        return false;
    }
    if (o3 > 0.0 && o4 > 0.0) || (o3 < 0.0 && o4 < 0.0) {
        return false;
    }
    if o1 == 0.0 && o2 == 0.0 {
        // on one line: their extents must meet
        let (lo, hi) = (a.min(b), a.max(b));
        let (lo2, hi2) = (c.min(d), c.max(d));
        return lo.cmple(hi2).all() && lo2.cmple(hi).all();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Ring {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|p| DVec2::new(x, y) + side * DVec2::from(p))
            .to_vec()
    }

    fn reversed(mut ring: Ring) -> Ring {
        ring.reverse();
        ring
    }

    #[test]
    fn holes_and_islands_nest() {
        let nested = nest(&[
            square(2.0, 2.0, 1.0),
            reversed(square(1.0, 1.0, 8.0)),
            square(0.0, 0.0, 10.0),
            square(20.0, 0.0, 1.0),
        ])
        .unwrap();
        assert!(!nested.united);
        let areas: Vec<f64> = nested.regions.iter().map(Region::area).collect();
        assert_eq!(areas, [36.0, 1.0, 1.0]);
        assert_eq!(nested.regions[0].holes.len(), 1);
    }

    #[test]
    fn inside_out_loops_fill_and_inner_solids_are_absorbed() {
        let nested = nest(&[reversed(square(0.0, 0.0, 10.0)), square(1.0, 1.0, 8.0)]).unwrap();
        assert_eq!(nested.regions.len(), 1);
        assert_eq!(nested.regions[0].area(), 36.0);
        assert!(signed_area(&nested.regions[0].outer) > 0.0);
        let nested = nest(&[square(0.0, 0.0, 10.0), square(1.0, 1.0, 8.0)]).unwrap();
        assert_eq!((nested.regions[0].area(), nested.absorbed), (100.0, 1));
    }

    #[test]
    fn crossing_and_touching_loops_are_united() {
        let nested = nest(&[square(0.0, 0.0, 10.0), square(5.0, 5.0, 10.0)]).unwrap();
        assert!(nested.united);
        assert_eq!(nested.regions.len(), 1);
        assert!((nested.regions[0].area() - 175.0).abs() < 1e-4);
        assert!(touch(&[square(0.0, 0.0, 1.0), square(1.0, 1.0, 1.0)]));
        assert!(touch(&[square(0.0, 0.0, 1.0), square(1.0, 0.25, 0.5)]));
        assert!(!touch(&[
            square(0.0, 0.0, 1.0),
            square(1.000_001, 0.0, 1.0)
        ]));
        let bow: Ring = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]
            .map(DVec2::from)
            .to_vec();
        assert!(touch(&[bow]));
    }
}
