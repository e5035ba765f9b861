//! The path of a torch that turns once.

use meltpath_geometry::math::DVec2;

/// The path that was meant, mm: two legs that turn by `turn`.
pub(super) fn path(turn: f64, legs: [f64; 2]) -> [DVec2; 3] {
    [
        DVec2::X * -legs[0],
        DVec2::ZERO,
        DVec2::from_angle(turn) * legs[1],
    ]
}

/// Distance along the path from the corner, negative before it, and from it, mm.
pub(super) fn along(p: DVec2, turn: f64) -> (f64, f64) {
    let second = DVec2::from_angle(turn);
    let first = (p.x.min(0.0), p.distance(DVec2::X * p.x.min(0.0)));
    let way = p.dot(second).max(0.0);
    let then = (way, p.distance(second * way));
    if first.1 <= then.1 { first } else { then }
}
