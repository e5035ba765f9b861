//! Edges as polylines: each is cut once and shared by the faces beside it.

use super::tolerance::Tolerance;
use crate::brep::{Curve, Edge, Solid};
use crate::math::DVec3;
use crate::segments::nearest_share;

/// Deepest halving of one smooth piece of an edge.
const DEPTH: u32 = 14;
/// Chords that one edge may take.
pub(super) const MOST_CHORDS: usize = 1_000_000;

/// The samples of one edge, from start to end.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Samples {
    /// Curve parameters, both ends included.
    pub(super) t: Vec<f64>,
    /// Points; the first and last are the edge's vertices.
    pub(super) points: Vec<DVec3>,
}

/// Cuts an edge so that no chord is farther than `tolerance.chord` from it and none turns by more
/// than `tolerance.angle`.
pub(super) fn discretise(solid: &Solid, edge: &Edge, tolerance: &Tolerance) -> Samples {
    let [from, to] = edge.range;
    let mut t = vec![from];
    match edge.curve.as_ref() {
        Curve::Line { .. } => t.push(to),
        Curve::Circle { radius, .. } => {
            let sweep = (to - from).abs();
            // sagitta of a chord that spans 2h: radius (1 - cos h) = 2 radius sin² h/2
            let half = 2.0 * (0.5 * tolerance.chord / radius).sqrt().min(1.0).asin();
            let parts = (sweep / (2.0 * half).min(tolerance.angle)).ceil().max(1.0);
            let parts = parts.min(MOST_CHORDS as f64 + 1.0) as usize;
            t.extend((1..=parts).map(|i| from + (to - from) * i as f64 / parts as f64));
        }
        _ => {
            for end in smooth_ends(edge) {
                let start = t.last().copied().unwrap_or(from);
                halve(edge, [start, end], tolerance, DEPTH, &mut t);
            }
        }
    }
    with_points(solid, edge, t)
}

/// Adds samples at parameters `more`.
pub(super) fn split(solid: &Solid, edge: &Edge, samples: &Samples, more: &[f64]) -> Samples {
    let mut t = samples.t.clone();
    t.extend_from_slice(more);
    let rising = edge.range[0] <= edge.range[1];
    t.sort_by(|a, b| {
        if rising {
            a.total_cmp(b)
        } else {
            b.total_cmp(a)
        }
    });
    let close = 1e-13 * (edge.range[1] - edge.range[0]).abs();
    t.dedup_by(|b, a| (*b - *a).abs() <= close);
    with_points(solid, edge, t)
}

fn with_points(solid: &Solid, edge: &Edge, t: Vec<f64>) -> Samples {
    let mut points: Vec<DVec3> = t.iter().map(|&t| edge.derivatives(t)[0]).collect();
    let ends = edge.vertices.map(|v| solid.vertices[v as usize]);
    if let Some(first) = points.first_mut() {
        *first = ends[0];
    }
    if let Some(last) = points.last_mut() {
        *last = ends[1];
    }
    Samples { t, points }
}

/// Parameters that end the smooth pieces of an edge, in its own direction, its end last.
fn smooth_ends(edge: &Edge) -> Vec<f64> {
    let [from, to] = edge.range;
    let (lo, hi) = (from.min(to), from.max(to));
    let margin = 1e-9 * (hi - lo);
    let mut breaks = edge.curve.breaks();
    if let Some(period) = edge.period {
        let again: Vec<f64> = [-period, period]
            .iter()
            .flat_map(|shift| breaks.iter().map(move |b| b + shift))
            .collect();
        breaks.extend(again);
    }
    breaks.retain(|b| *b > lo + margin && *b < hi - margin);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup_by(|b, a| *b - *a <= margin);
    if from > to {
        breaks.reverse();
    }
    breaks.push(to);
    breaks
}

/// Halves a smooth piece until its chords are good, and pushes their ends.
fn halve(edge: &Edge, [a, b]: [f64; 2], tolerance: &Tolerance, depth: u32, out: &mut Vec<f64>) {
    let mid = 0.5 * (a + b);
    if depth > 0 && !chord_is_good(edge, [a, b], tolerance) {
        halve(edge, [a, mid], tolerance, depth - 1, out);
        halve(edge, [mid, b], tolerance, depth - 1, out);
    } else {
        out.push(b);
    }
}

fn chord_is_good(edge: &Edge, [a, b]: [f64; 2], tolerance: &Tolerance) -> bool {
    let [p, dp, _] = edge.derivatives(a);
    let [q, dq, _] = edge.derivatives(b);
    let mut off: f64 = 0.0;
    let mut turn: f64 = 0.0;
    let mut before = dp;
    for i in 1..4 {
        let t = a + (b - a) * f64::from(i) / 4.0;
        let [m, d, _] = edge.derivatives(t);
        off = off.max(distance_to_segment(m, p, q));
        turn += angle(before, d);
        before = d;
    }
    turn += angle(before, dq);
    // a straight piece of a spline may run unevenly: its tangents still do not turn
    off <= tolerance.chord && (turn <= tolerance.angle || off <= 1e-9)
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    if a.length_squared() < 1e-24 || b.length_squared() < 1e-24 {
        0.0
    } else {
        a.angle_between(b)
    }
}

/// Distance of a point from a segment.
pub(super) fn distance_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let d = b - a;
    p.distance(a + nearest_share((p - a).dot(d), d.length_squared()) * d)
}
