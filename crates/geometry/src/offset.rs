//! Insets, outsets and strokes: what lies at least, or at most, a distance from a boundary or a line.
//!
//! Every edge is moved by the distance and the moved edges are joined: by an arc or a miter on the far side of a
//! vertex, by the short chord on its near side. The curve so made winds `1 - χ(D ∩ Pᶜ)` times round the centre of a
//! disc `D` of that radius (χ: pieces less holes; `P` the region), so that its positive part is the inset wherever no
//! whole region fits into a disc; the chords only take away from what is outside already. The outset follows by
//! symmetry. Chords instead of the customary detour by the vertex keep the sweep's list of active edges short.

use clipper2_rust::core::{FillRule, Path64, Paths64, Point64};
use clipper2_rust::engine::ClipType;
use clipper2_rust::engine_public::{Clipper64, PolyTree64};
use clipper2_rust::offset::{ClipperOffset, EndType, JoinType};
use rayon::prelude::*;

use crate::boolean::{
    Curves, GRID_PER_MM, LARGEST_COORDINATE, PlanarError, regions_of, ring_to_grid, to_grid,
};
use crate::math::DVec2;
use crate::region::Region;

/// How an offset turns round a vertex on its far side: convex ones when it grows, re-entrant ones when it shrinks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Join {
    /// An arc at exactly the offset distance, as chords within the arc tolerance.
    Round {
        /// Largest distance between the arc and its chords, mm.
        arc_tolerance: f64,
    },
    /// Edges prolonged to their meeting point; cut across where that point is farther than `limit` distances.
    Miter {
        /// Farthest meeting point, in offset distances; at least 1.
        limit: f64,
    },
}

fn checked(
    value: f64,
    least: f64,
    what: &'static str,
    range: &'static str,
) -> Result<(), PlanarError> {
    // a NaN lies in no range
    if (least..=LARGEST_COORDINATE).contains(&value) {
        Ok(())
    } else {
        Err(PlanarError::Parameter { what, range, value })
    }
}

fn check(distance: f64, join: Join) -> Result<(), PlanarError> {
    checked(distance, 0.0, "the offset distance", "between 0 and 1e6 mm")?;
    match join {
        Join::Round { arc_tolerance: t } => {
            checked(t, 1e-6, "the arc tolerance", "between 1e-6 and 1e6 mm")
        }
        Join::Miter { limit } => checked(limit, 1.0, "the miter limit", "between 1 and 1e6"),
    }
}

/// The points of `regions` farther than `distance` mm from every boundary. Regions that overlap are not joined
/// first; each is shrunk for itself, in parallel, and the result keeps the order of the input.
///
/// ```
/// use meltpath_geometry::{Region, math::DVec2, offset::{Join, inset}};
/// let square = [(0., 0.), (10., 0.), (10., 10.), (0., 10.)].map(|(x, y)| DVec2::new(x, y)).to_vec();
/// let square = Region { outer: square, holes: vec![] };
/// let smaller = inset(&[square.clone()], 2.0, Join::Round { arc_tolerance: 0.01 }).unwrap();
/// assert!((smaller[0].area() - 36.0).abs() < 1e-6);
/// assert!(inset(&[square], 5.1, Join::Round { arc_tolerance: 0.01 }).unwrap().is_empty());
/// ```
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range.
pub fn inset(regions: &[Region], distance: f64, join: Join) -> Result<Vec<Region>, PlanarError> {
    check(distance, join)?;
    let shrunk: Vec<Vec<Region>> = regions
        .par_iter()
        .enumerate()
        .map(|(i, region)| {
            let paths = to_grid(std::slice::from_ref(region)).map_err(|e| at_region(e, i))?;
            if paths.first().is_none_or(|outer| fits_in(outer, distance)) {
                return Ok(Vec::new());
            }
            Ok(moved(&paths, -distance, join))
        })
        .collect::<Result<_, PlanarError>>()?;
    Ok(shrunk.into_iter().flatten().collect())
}

/// Everything within `distance` mm of `regions`, joined where it meets.
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range.
pub fn outset(regions: &[Region], distance: f64, join: Join) -> Result<Vec<Region>, PlanarError> {
    check(distance, join)?;
    let mut paths = to_grid(regions)?;
    let mut holes = regions
        .iter()
        .flat_map(|r| std::iter::once(false).chain(std::iter::repeat_n(true, r.holes.len())));
    paths.retain(|path| !(holes.next() == Some(true) && fits_in(path, distance)));
    Ok(moved(&paths, distance, join))
}

/// Whether the bounding box is at most two distances wide: then no disc of that radius has room inside.
fn fits_in(path: &Path64, distance: f64) -> bool {
    let extent = |coordinate: fn(&Point64) -> i64| {
        let (low, high) = path
            .iter()
            .map(coordinate)
            .fold((i64::MAX, i64::MIN), |(l, h), c| (l.min(c), h.max(c)));
        high.saturating_sub(low)
    };
    (extent(|p| p.x).min(extent(|p| p.y)) as f64) <= 2.0 * distance * GRID_PER_MM
}

/// The region bounded by the moved edges: `distance` in mm, positive outwards.
fn moved(paths: &Paths64, distance: f64, join: Join) -> Vec<Region> {
    let distance = distance * GRID_PER_MM;
    let curves = paths
        .iter()
        .map(|path| moved_ring(path, distance, join))
        .collect();
    let mut clipper = Clipper64::new();
    clipper.set_preserve_collinear(false);
    clipper.add_subject(&curves);
    let (mut tree, mut open) = (PolyTree64::new(), Paths64::new());
    clipper.execute_tree(ClipType::Union, FillRule::Positive, &mut tree, &mut open);
    regions_of(&tree)
}

/// The edges of one ring moved to their right by `distance` (grid units; negative to their left) and joined.
fn moved_ring(path: &Path64, distance: f64, join: Join) -> Path64 {
    let mut points = apart(path);
    while points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    if points.len() < 3 {
        return Path64::new();
    }
    moved_edges(&points, distance, join)
}

/// Points of a path, none twice in a row.
fn apart(path: &Path64) -> Vec<DVec2> {
    let at = |p: &Point64| DVec2::new(p.x as f64, p.y as f64);
    let mut points: Vec<DVec2> = path.iter().map(at).collect();
    points.dedup();
    points
}

/// The edges from each of at least two points to the next and from the last to the first, moved and joined.
fn moved_edges(points: &[DVec2], distance: f64, join: Join) -> Path64 {
    let n = points.len();
    let normals: Vec<DVec2> = (0..n)
        .map(|i| {
            let edge = points[(i + 1) % n] - points[i];
            DVec2::new(edge.y, -edge.x).normalize_or_zero()
        })
        .collect();
    let step = match join {
        Join::Round { arc_tolerance } => {
            let share = arc_tolerance * GRID_PER_MM / distance.abs().max(1.0);
            2.0 * (1.0 - share.min(1.0)).acos()
        }
        Join::Miter { .. } => 0.0,
    };
    let mut curve = Path64::with_capacity(2 * n);
    let mut push = |p: DVec2| {
        let p = Point64::new(p.x.round() as i64, p.y.round() as i64);
        if curve.last() != Some(&p) {
            curve.push(p);
        }
    };
    for i in 0..n {
        let (before, after) = (normals[(i + n - 1) % n], normals[i]);
        let (sin, cos) = (before.perp_dot(after), before.dot(after));
        let (from, to) = (points[i] + before * distance, points[i] + after * distance);
        if sin * distance <= 0.0 && cos > -0.999_999 {
            // the near side: the moved edges overlap
            push(from);
            push(to);
            continue;
        }
        let meeting = points[i] + (before + after) * (distance / (1.0 + cos));
        match join {
            Join::Round { .. } => {
                let turn = sin.atan2(cos);
                // a reversal turns round the far side, whatever the sign of its rounding
                let turn = if turn * distance < 0.0 { -turn } else { turn };
                if turn.abs() <= step {
                    push(meeting);
                    continue;
                }
                let steps = (turn.abs() / step).ceil();
                push(from);
                let rotation = DVec2::from_angle(turn / steps);
                let mut radius = before * distance;
                for _ in 1..steps as usize {
                    radius = rotation.rotate(radius);
                    push(points[i] + radius);
                }
                push(to);
            }
            Join::Miter { limit } => {
                if cos > -1.0 && 2.0 <= limit * limit * (1.0 + cos) {
                    push(meeting);
                } else {
                    push(from);
                    push(to);
                }
            }
        }
    }
    curve
}

/// Everything within `distance` mm of the polylines `lines`, with round ends. A line of a single point gives a disc.
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range; its `region` counts lines.
pub fn stroke(
    lines: &[Vec<DVec2>],
    distance: f64,
    arc_tolerance: f64,
) -> Result<Vec<Region>, PlanarError> {
    check(distance, Join::Round { arc_tolerance })?;
    let paths = lines_to_grid(lines)?;
    let mut offset = ClipperOffset::new(2.0, arc_tolerance * GRID_PER_MM, false, false);
    offset.add_paths(&paths, JoinType::Round, EndType::Round);
    let mut tree = PolyTree64::new();
    offset.execute_tree(distance * GRID_PER_MM, &mut tree);
    Ok(regions_of(&tree))
}

/// Curves round everything within `distance` mm of the polylines `lines`, as [`stroke`] has it, before they are joined: each line there
/// and back with its sides moved out. Round a point they wind as often as a disc about it meets the lines.
///
/// # Errors
/// See [`stroke`].
pub(crate) fn band_curves(
    lines: &[Vec<DVec2>],
    distance: f64,
    arc_tolerance: f64,
) -> Result<Curves, PlanarError> {
    let join = Join::Round { arc_tolerance };
    check(distance, join)?;
    let distance = distance * GRID_PER_MM;
    let curve = |line: &Path64| {
        let mut points = apart(line);
        if let [dot] = points[..] {
            // so short a way that its two ends make one disc
            points.push(dot + DVec2::X);
        }
        let back: Vec<DVec2> = points.iter().rev().skip(1).copied().collect();
        points.extend(back);
        points.pop();
        if points.is_empty() {
            return Path64::new();
        }
        moved_edges(&points, distance, join)
    };
    Ok(Curves(lines_to_grid(lines)?.iter().map(curve).collect()))
}

fn lines_to_grid(lines: &[Vec<DVec2>]) -> Result<Paths64, PlanarError> {
    let lines = lines.iter().enumerate();
    lines.map(|(i, line)| ring_to_grid(line, i, 0)).collect()
}

fn at_region(error: PlanarError, index: usize) -> PlanarError {
    match error {
        PlanarError::NotFinite { ring, vertex, .. } => PlanarError::NotFinite {
            region: index,
            ring,
            vertex,
        },
        PlanarError::TooFar {
            ring,
            vertex,
            coordinate,
            ..
        } => PlanarError::TooFar {
            region: index,
            ring,
            vertex,
            coordinate,
        },
        other @ PlanarError::Parameter { .. } => other,
    }
}
