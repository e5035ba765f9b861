//! Lines and dots reduced to what the frame can show: in each column of a third of a pixel the first, lowest, highest and
//! last points stay, so that no peak is lost (the M4 rule of Jugel et al. 2014).

use std::fmt::Write as _;

use meltpath_geometry::math::DVec2;

use super::frame::Frame;

/// SVG path of a line with gaps where a point is not finite.
pub(super) fn line_path(points: &[DVec2], frame: &Frame) -> String {
    points
        .split(|p| !p.is_finite())
        .filter(|run| !run.is_empty())
        .map(|run| {
            let placed: Vec<DVec2> = run.iter().map(|&p| frame.place(p)).collect();
            let forward = placed.windows(2).all(|w| w[1].x >= w[0].x);
            if forward {
                polyline(&columns(&placed))
            } else {
                polyline(&spaced(&placed))
            }
        })
        .collect()
}

/// SVG path of an outline, left open; points that are not finite are left out.
pub(super) fn outline_path<'a>(edge: impl Iterator<Item = &'a DVec2>, frame: &Frame) -> String {
    let placed: Vec<DVec2> = edge
        .filter(|p| p.is_finite())
        .map(|&p| frame.place(p))
        .collect();
    polyline(&spaced(&placed))
}

fn polyline(points: &[DVec2]) -> String {
    let mut d = String::with_capacity(12 * points.len());
    for (i, p) in points.iter().enumerate() {
        let _ = write!(d, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, p.x, p.y);
    }
    d
}

/// First, lowest, highest and last point of each column a third of a pixel wide; points run from left to right.
fn columns(points: &[DVec2]) -> Vec<DVec2> {
    let column = |p: &DVec2| (3.0 * p.x).floor();
    let mut kept = Vec::new();
    for run in points.chunk_by(|a, b| column(a) == column(b)) {
        if run.len() <= 4 {
            kept.extend_from_slice(run);
            continue;
        }
        let last = run.len() - 1;
        let (mut low, mut high) = (0, 0);
        for (i, p) in run.iter().enumerate() {
            if p.y < run[low].y {
                low = i;
            }
            if p.y > run[high].y {
                high = i;
            }
        }
        let mut places = [0, low.min(high), low.max(high), last].to_vec();
        places.dedup();
        kept.extend(places.into_iter().map(|i| run[i]));
    }
    kept
}

/// Leaves out points nearer than a third of a pixel to the last one kept.
fn spaced(points: &[DVec2]) -> Vec<DVec2> {
    let mut kept: Vec<DVec2> = Vec::new();
    for (i, &p) in points.iter().enumerate() {
        let far = kept.last().is_none_or(|last| last.distance(p) > 1.0 / 3.0);
        if far || i + 1 == points.len() {
            kept.push(p);
        }
    }
    kept
}

/// Dots that do not hide one another, in the frame's pixels.
pub(super) fn distinct(points: &[DVec2], frame: &Frame) -> Vec<DVec2> {
    let mut seen = std::collections::HashSet::new();
    points
        .iter()
        .filter(|p| p.is_finite())
        .map(|&p| frame.place(p))
        .filter(|p| seen.insert(((2.0 * p.x).round() as i64, (2.0 * p.y).round() as i64)))
        .collect()
}
