//! Insets, outsets and strokes: what lies at least, or at most, a distance from a boundary or a line
//! (offset of every edge and vertex, then union; Clipper2, A. Johnson).

use clipper2_rust::core::Paths64;
use clipper2_rust::engine_public::PolyTree64;
use clipper2_rust::offset::{ClipperOffset, EndType, JoinType};
use rayon::prelude::*;

use crate::boolean::{
    GRID_PER_MM, LARGEST_COORDINATE, PlanarError, path_to_grid, regions_of, to_grid,
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
    /// Edges prolonged to their meeting point; cut square where that point is farther than `limit` distances.
    Miter {
        /// Farthest meeting point, in offset distances; at least 1.
        limit: f64,
    },
}

impl Join {
    fn clipper(self) -> Result<(JoinType, f64, f64), PlanarError> {
        let checked = |value: f64, least: f64, what, range| {
            // written so that NaN fails too
            if value.is_finite() && value >= least {
                Ok(value)
            } else {
                Err(PlanarError::Parameter { what, range, value })
            }
        };
        match self {
            Join::Round { arc_tolerance } => {
                let t = checked(arc_tolerance, 1e-6, "the arc tolerance", "1e-6 mm or more")?;
                Ok((JoinType::Round, 2.0, t * GRID_PER_MM))
            }
            Join::Miter { limit } => {
                let limit = checked(limit, 1.0, "the miter limit", "1 or more")?;
                Ok((JoinType::Miter, limit, 0.0))
            }
        }
    }
}

fn checked_distance(distance: f64) -> Result<f64, PlanarError> {
    if (0.0..=LARGEST_COORDINATE).contains(&distance) {
        Ok(distance)
    } else {
        Err(PlanarError::Parameter {
            what: "the offset distance",
            range: "between 0 and 1e6 mm",
            value: distance,
        })
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
    let distance = checked_distance(distance)?;
    let (kind, limit, tolerance) = join.clipper()?;
    let shrunk: Vec<Vec<Region>> = regions
        .par_iter()
        .enumerate()
        .map(|(i, region)| {
            let paths = to_grid(std::slice::from_ref(region)).map_err(|e| at_region(e, i))?;
            Ok(grown(
                &paths,
                -distance,
                kind,
                EndType::Polygon,
                limit,
                tolerance,
            ))
        })
        .collect::<Result<_, PlanarError>>()?;
    Ok(shrunk.into_iter().flatten().collect())
}

/// Everything within `distance` mm of `regions`.
///
/// # Errors
/// [`PlanarError`] where a coordinate or a parameter is out of range.
pub fn outset(regions: &[Region], distance: f64, join: Join) -> Result<Vec<Region>, PlanarError> {
    let distance = checked_distance(distance)?;
    let (kind, limit, tolerance) = join.clipper()?;
    Ok(grown(
        &to_grid(regions)?,
        distance,
        kind,
        EndType::Polygon,
        limit,
        tolerance,
    ))
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
    let distance = checked_distance(distance)?;
    let (kind, limit, tolerance) = Join::Round { arc_tolerance }.clipper()?;
    let mut paths = Paths64::with_capacity(lines.len());
    for (region, line) in lines.iter().enumerate() {
        paths.push(path_to_grid(line).map_err(|(vertex, coordinate)| {
            if coordinate.is_finite() {
                PlanarError::TooFar {
                    region,
                    ring: 0,
                    vertex,
                    coordinate,
                }
            } else {
                PlanarError::NotFinite {
                    region,
                    ring: 0,
                    vertex,
                }
            }
        })?);
    }
    Ok(grown(
        &paths,
        distance,
        kind,
        EndType::Round,
        limit,
        tolerance,
    ))
}

fn grown(
    paths: &Paths64,
    distance: f64,
    join: JoinType,
    end: EndType,
    limit: f64,
    tolerance: f64,
) -> Vec<Region> {
    let mut offset = ClipperOffset::new(limit, tolerance, false, false);
    offset.add_paths(paths, join, end);
    let mut tree = PolyTree64::new();
    offset.execute_tree(distance * GRID_PER_MM, &mut tree);
    regions_of(&tree)
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
