//! Bends of centre lines. The medial axis rounds the bend between two walls; a bead follows the walls' middle lines to
//! where they meet, so that the outer corner is filled.

use meltpath_geometry::Region;
use meltpath_geometry::fit::{Shape, Tolerance, fit};
use meltpath_geometry::math::DVec2;

use crate::fill::outline::{clearance, contains, length, nearest_share};
use crate::fill::settings::FillSettings;

/// Bends sharper than this between straight walls get a corner, rad (20°), and up to the second (130°).
const BENDS: std::ops::RangeInclusive<f64> = 0.349..=2.269;
/// The corner keeps at least this share of the bead width to the boundary.
const CLEARANCE: f64 = 0.3;

/// The line with the bends between straight stretches made corners where the section is that of two walls meeting.
pub(crate) fn with_corners(line: &[DVec2], region: &Region, settings: &FillSettings) -> Vec<DVec2> {
    let closed = line.len() > 3 && line.first() == line.last();
    let line = if closed {
        begun_on_longest(line, settings)
    } else {
        line.to_vec()
    };
    let stretches = straight_stretches(&line, settings);
    let mut out: Vec<DVec2> = Vec::with_capacity(line.len());
    let mut at = 0;
    for pair in stretches.windows(2) {
        let ((a0, a1), (b0, b1)) = (pair[0], pair[1]);
        let (u, v) = (
            (line[a1] - line[a0]).normalize_or_zero(),
            (line[b1] - line[b0]).normalize_or_zero(),
        );
        let bend = length(&line[a1..=b0]);
        if b0 <= a1 || bend > 2.0 * settings.width || !BENDS.contains(&u.angle_to(v).abs()) {
            continue;
        }
        let det = u.perp_dot(v);
        let corner = line[a1] + u * ((line[b0] - line[a1]).perp_dot(v) / det);
        let ahead = (corner - line[a1]).dot(u) >= -1e-6 && (line[b0] - corner).dot(v) >= -1e-6;
        if ahead
            && corner.distance(line[a1]) <= 2.0 * settings.width
            && contains(std::slice::from_ref(region), corner)
            && is_roomy(region, line[a1], corner, settings)
            && is_roomy(region, corner, line[b0], settings)
        {
            out.extend_from_slice(&line[at..=a1]);
            out.push(corner);
            at = b0;
        }
    }
    out.extend_from_slice(&line[at..]);
    out
}

/// Whether a bead has room on the straight way between two points: where a bend is narrow, the way to its corner cuts it short.
fn is_roomy(region: &Region, a: DVec2, b: DVec2, settings: &FillSettings) -> bool {
    let n = (a.distance(b) / (0.1 * settings.width)).ceil().max(1.0) as usize;
    let least = CLEARANCE * settings.width - settings.tolerance;
    (0..=n).all(|i| clearance(region, a.lerp(b, i as f64 / n as f64)) >= least)
}

/// Index ranges of the stretches straight over at least half a bead width.
fn straight_stretches(line: &[DVec2], settings: &FillSettings) -> Vec<(usize, usize)> {
    let tolerance = Tolerance {
        distance: 0.25 * settings.tolerance,
        facet: 0.25 * settings.tolerance,
        corner: 0.1,
    };
    let mut stretches = Vec::new();
    let mut from = 0;
    for piece in fit(line, tolerance) {
        let to = (from..line.len())
            .find(|&i| i > from && line[i] == piece.end)
            .unwrap_or(from);
        if piece.shape == Shape::Line && line[from].distance(line[to]) >= 0.5 * settings.width {
            stretches.push((from, to));
        }
        from = to;
    }
    stretches
}

/// A closed line begun in the middle of its longest straight stretch, so that no bend lies across its seam.
fn begun_on_longest(line: &[DVec2], settings: &FillSettings) -> Vec<DVec2> {
    let longest = straight_stretches(line, settings)
        .into_iter()
        .max_by(|a, b| {
            let long = |s: &(usize, usize)| line[s.0].distance(line[s.1]);
            long(a).total_cmp(&long(b))
        });
    let Some((from, to)) = longest else {
        return line.to_vec();
    };
    let middle = 0.5 * (line[from] + line[to]);
    let edge = (from..to)
        .min_by(|&i, &j| {
            let away = |i: usize| {
                middle.distance(
                    line[i].lerp(line[i + 1], nearest_share(middle, line[i], line[i + 1])),
                )
            };
            away(i).total_cmp(&away(j))
        })
        .unwrap_or(from);
    let mut begun = vec![middle];
    begun.extend_from_slice(&line[edge + 1..]);
    begun.extend_from_slice(&line[1..=edge]);
    begun.push(middle);
    begun
}
