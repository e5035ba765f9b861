//! Spiral: between successive contours the path goes over from one to the next in one turn. Where the contours
//! branch, each branch is a spiral of its own; each begins and ends with a full turn, so that no boundary stays open.

use meltpath_geometry::math::DVec2;

use crate::fill::contour::aligned_family;
use crate::fill::outline::{length, nearest_share};
use crate::fill::rings::{Contour, families};
use crate::fill::settings::{ContourOrder, FillSettings};

/// The spirals of nested contours.
pub(crate) fn spirals(
    contours: &[Contour],
    order: ContourOrder,
    layer: u32,
    settings: &FillSettings,
) -> Vec<Vec<DVec2>> {
    let mut beads: Vec<Vec<DVec2>> = families(contours)
        .iter()
        .map(|family| {
            let turns = aligned_family(contours, family, layer, settings);
            let mut bead: Vec<DVec2> = turns.first().cloned().unwrap_or_default();
            for pair in turns.windows(2) {
                bead.extend(transition(&pair[0], &pair[1]));
            }
            if turns.len() > 1
                && let Some(last) = turns.last()
            {
                bead.extend(last);
            }
            if order == ContourOrder::InsideOut {
                bead.reverse();
            }
            bead
        })
        .collect();
    if order == ContourOrder::InsideOut {
        beads.reverse();
    }
    beads
}

/// One turn from the closed polyline `outer` to `inner`: each point moves towards its nearest one on `inner` by the
/// share of the turn done. Along parallel edges that is a straight line.
fn transition(outer: &[DVec2], inner: &[DVec2]) -> Vec<DVec2> {
    let total = length(outer).max(f64::MIN_POSITIVE);
    let mut done = 0.0;
    let mut near = 0;
    let mut points = Vec::with_capacity(outer.len());
    for (i, &p) in outer.iter().enumerate() {
        if i > 0 {
            done += p.distance(outer[i - 1]);
        }
        let share = (done / total).min(1.0);
        let q = nearest(p, inner, &mut near, i == 0);
        points.push(p.lerp(q, share));
    }
    points
}

/// The nearest point of a closed polyline, searched forwards and backwards from the edge found last.
fn nearest(p: DVec2, line: &[DVec2], last: &mut usize, everywhere: bool) -> DVec2 {
    let n = line.len() - 1;
    let reach = if everywhere {
        n
    } else {
        (n / 8).max(64).min(n)
    };
    let mut best = (f64::INFINITY, line[0]);
    let start = *last;
    for k in 0..reach {
        // edges at alternating distances before and behind
        let j = if k % 2 == 0 {
            (start + k / 2) % n
        } else {
            (start + n - (k / 2 + 1) % n) % n
        };
        let (a, b) = (line[j], line[j + 1]);
        let q = a.lerp(b, nearest_share(p, a, b));
        let away = p.distance(q);
        if away < best.0 - 1e-12 {
            best = (away, q);
            *last = j;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of 24 edges: wherever the search begins, the nearest edge is found before it and behind it.
    #[test]
    fn the_nearest_point_is_found_before_and_behind() {
        let at = |k: usize| DVec2::from_angle(std::f64::consts::TAU * k as f64 / 24.0);
        let ring: Vec<DVec2> = (0..=24).map(|k| at(k % 24)).collect();
        for start in 0..24 {
            for edge in 0..24 {
                let middle = at(edge).midpoint(at(edge + 1));
                let mut last = start;
                let found = nearest(1.5 * middle, &ring, &mut last, true);
                assert!(found.distance(middle) < 1e-9, "from {start} to {edge}");
                assert_eq!(last, edge);
            }
        }
    }

    #[test]
    fn the_nearest_point_lies_between_corners_too() {
        let corners = [
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 10.0],
            [0.0, 10.0],
            [0.0, 0.0],
        ];
        let line = corners.map(DVec2::from_array);
        let mut last = 0;
        let found = nearest(DVec2::new(12.0, 4.0), &line, &mut last, true);
        assert_eq!((found, last), (DVec2::new(10.0, 4.0), 1));
    }
}
