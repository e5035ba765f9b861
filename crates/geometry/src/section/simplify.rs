//! Merging of collinear contour points within a tolerance, in one pass per ring
//! (the sector-bound method: Zhao & Saalfeld 1997).

use crate::math::DVec2;
use crate::region::{Region, Ring};

/// Drops repeated points, and points within `tolerance` mm of the straight line between the kept ones.
///
/// The ring is first turned to start at its lowest-x (then lowest-y) point, a corner in any case: the result
/// does not depend on where the ring began. Returns an empty ring when fewer than three points remain.
pub(super) fn simplify(ring: &mut Ring, tolerance: f64) {
    ring.dedup();
    while ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    if ring.len() < 3 {
        ring.clear();
        return;
    }
    let first = (0..ring.len())
        .min_by(|&i, &j| {
            let (a, b) = (ring[i], ring[j]);
            a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
        })
        .unwrap_or(0);
    ring.rotate_left(first);
    if tolerance > 0.0 {
        let start = ring[0];
        let mut sector = Sector::from(start);
        let mut kept = 1;
        let mut last = start;
        for i in 1..=ring.len() {
            let p = if i < ring.len() { ring[i] } else { start };
            if !sector.accepts(p, tolerance) {
                ring[kept] = last;
                kept += 1;
                sector = Sector::from(last);
                sector.accepts(p, tolerance);
            }
            last = p;
        }
        ring.truncate(kept);
    }
    if ring.len() < 3 {
        ring.clear();
    }
}

/// A region with its rings simplified; one that is thinner than the tolerance may cross itself then.
pub fn simplified(region: &Region, tolerance: f64) -> Region {
    let mut region = region.clone();
    simplify(&mut region.outer, tolerance);
    for hole in &mut region.holes {
        simplify(hole, tolerance);
    }
    region.holes.retain(|hole| !hole.is_empty());
    region
}

/// The directions from an anchor that pass within the tolerance of every point since.
struct Sector {
    anchor: DVec2,
    bounds: Option<(DVec2, DVec2)>,
    farthest: f64,
}

impl Sector {
    fn from(anchor: DVec2) -> Self {
        Sector {
            anchor,
            bounds: None,
            farthest: 0.0,
        }
    }

    /// Whether a straight line from the anchor to `p` serves all points so far; narrows the sector if so.
    fn accepts(&mut self, p: DVec2, tolerance: f64) -> bool {
        let v = p - self.anchor;
        let length = v.length();
        if length <= tolerance && self.farthest <= tolerance {
            return true;
        }
        // coming back towards the anchor is a turn, however thin
        if length < self.farthest {
            return false;
        }
        let side = v.perp() * (tolerance / length);
        let (right, left) = (v - side, v + side);
        self.bounds = match self.bounds {
            None => Some((right, left)),
            Some((r, l)) => {
                if r.perp_dot(v) < 0.0 || v.perp_dot(l) < 0.0 || v.dot(r + l) <= 0.0 {
                    return false;
                }
                Some((
                    if r.perp_dot(right) > 0.0 { right } else { r },
                    if left.perp_dot(l) > 0.0 { left } else { l },
                ))
            }
        };
        self.farthest = length;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subdivided_square_becomes_four_corners_wherever_it_starts() {
        let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 7.0], [0.0, 7.0]].map(DVec2::from);
        let fine: Ring = (0..400)
            .map(|k| {
                let (side, t) = (k / 100, f64::from(k % 100) / 100.0);
                corners[side as usize].lerp(corners[(side as usize + 1) % 4], t * t)
            })
            .collect();
        for start in [0, 1, 57, 100, 399] {
            let mut ring = fine.clone();
            ring.rotate_left(start);
            simplify(&mut ring, 1e-6);
            assert_eq!(ring, corners, "start {start}");
        }
    }

    #[test]
    fn no_dropped_point_is_farther_than_the_tolerance() {
        let circle: Ring = (0..20_000)
            .map(|k| 50.0 * DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 20_000.0))
            .collect();
        for tolerance in [1e-6, 1e-3, 0.05] {
            let mut ring = circle.clone();
            simplify(&mut ring, tolerance);
            assert!(ring.len() < 20_000 || tolerance < 1e-5);
            for w in 0..ring.len() {
                let (a, b) = (ring[w], ring[(w + 1) % ring.len()]);
                let sagitta = 50.0 - (0.5 * (a + b)).length();
                assert!(
                    sagitta <= 1.01 * tolerance + 3e-8,
                    "{sagitta} > {tolerance}"
                );
            }
        }
    }

    #[test]
    fn spikes_and_slivers_stay_or_vanish_whole() {
        let mut spike: Ring = [[0.0, 0.0], [10.0, 0.0], [5.0, 0.0], [5.0, 5.0]]
            .map(DVec2::from)
            .to_vec();
        simplify(&mut spike, 1e-6);
        assert_eq!(
            spike.len(),
            4,
            "a spike is a contour's business, not collinear"
        );
        let mut twice: Ring = vec![DVec2::ONE, DVec2::ONE, DVec2::X, DVec2::ONE];
        simplify(&mut twice, 1e-6);
        assert!(twice.is_empty());
    }
}
