//! Union, intersection and difference of regions under the non-zero rule, on an integer grid of 2⁻²⁰ mm
//! (Vatti's sweep as in Clipper2, A. Johnson).

mod crop;

use clipper2_rust::core::{FillRule, Path64, Paths64, Point64};
use clipper2_rust::engine::ClipType;
use clipper2_rust::engine_public::{Clipper64, PolyTree64};

use self::crop::Frame;
use crate::math::DVec2;
use crate::region::{Region, Ring, signed_area};

/// Grid cells per millimetre, a power of two: coordinates on the grid convert both ways without rounding.
/// A coordinate moves by at most half a cell, 0.48 nm.
pub const GRID_PER_MM: f64 = 1_048_576.0;

/// Largest coordinate that planar operations take, mm.
pub const LARGEST_COORDINATE: f64 = 1e6;

/// Why a planar operation refuses its input.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlanarError {
    /// A coordinate is NaN or infinite.
    #[error(
        "vertex {vertex} of ring {ring} of region {region} is not a number: repair or re-slice the part"
    )]
    NotFinite {
        /// Index of the region in the input.
        region: usize,
        /// Index of the ring, 0 for the outer one.
        ring: usize,
        /// Index of the vertex in the ring.
        vertex: usize,
    },
    /// A coordinate is farther than [`LARGEST_COORDINATE`] from the origin.
    #[error(
        "vertex {vertex} of ring {ring} of region {region} lies at {coordinate} mm, beyond ±{LARGEST_COORDINATE} mm: check the part's unit and place it near the origin"
    )]
    TooFar {
        /// Index of the region in the input.
        region: usize,
        /// Index of the ring, 0 for the outer one.
        ring: usize,
        /// Index of the vertex in the ring.
        vertex: usize,
        /// The offending coordinate, mm.
        coordinate: f64,
    },
    /// An offset distance, a miter limit or an arc tolerance out of its range.
    #[error("{what} must be {range}, got {value}")]
    Parameter {
        /// Which parameter.
        what: &'static str,
        /// Its range, in words.
        range: &'static str,
        /// What was given.
        value: f64,
    },
}

/// The union of all regions.
///
/// # Errors
/// [`PlanarError`] where a coordinate is not finite or too far.
pub fn union(regions: &[Region]) -> Result<Vec<Region>, PlanarError> {
    combine(ClipType::Union, regions, &[])
}

/// The part common to the union of `a` and the union of `b`.
///
/// # Errors
/// [`PlanarError`] where a coordinate is not finite or too far.
pub fn intersection(a: &[Region], b: &[Region]) -> Result<Vec<Region>, PlanarError> {
    combine(ClipType::Intersection, a, b)
}

/// The union of `a` without the union of `b`.
///
/// ```
/// use meltpath_geometry::{Region, boolean::difference, math::DVec2};
/// let square = |x: f64, s: f64| Region {
///     outer: [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(u, v)| DVec2::new(x + s * u, s * v)).to_vec(),
///     holes: vec![],
/// };
/// let rest = difference(&[square(0.0, 10.0)], &[square(8.0, 4.0)]).unwrap();
/// assert_eq!(rest.len(), 1);
/// assert!((rest[0].area() - 92.0).abs() < 1e-9);
/// ```
///
/// # Errors
/// [`PlanarError`] where a coordinate is not finite or too far.
pub fn difference(a: &[Region], b: &[Region]) -> Result<Vec<Region>, PlanarError> {
    combine(ClipType::Difference, a, b)
}

/// Closed curves on the grid that bound what they go round once or more, anticlockwise; they may cross themselves and each other.
pub(crate) struct Curves(pub(crate) Paths64);

impl Curves {
    /// The union of `regions` without what the curves go round.
    pub(crate) fn taken_from(self, regions: &[Region]) -> Result<Vec<Region>, PlanarError> {
        Ok(framed(ClipType::Difference, to_grid(regions)?, self.0))
    }

    /// The part of the union of `regions` that the curves go round.
    pub(crate) fn common_with(&self, regions: &[Region]) -> Result<Vec<Region>, PlanarError> {
        let curves = self.0.clone();
        Ok(framed(ClipType::Intersection, to_grid(regions)?, curves))
    }
}

fn combine(clip: ClipType, a: &[Region], b: &[Region]) -> Result<Vec<Region>, PlanarError> {
    Ok(framed(clip, to_grid(a)?, to_grid(b)?))
}

/// The sweep over what of both operands matters to it.
fn framed(clip: ClipType, mut subject: Paths64, mut with: Paths64) -> Vec<Region> {
    match clip {
        ClipType::Intersection => {
            let both = Frame::round(&subject).and(Frame::round(&with));
            both.crop(&mut subject);
            both.crop(&mut with);
        }
        ClipType::Difference => Frame::round(&subject).crop(&mut with),
        _ => {}
    }
    swept(clip, &subject, &with)
}

fn swept(clip: ClipType, subject: &Paths64, with: &Paths64) -> Vec<Region> {
    let mut clipper = Clipper64::new();
    clipper.add_subject(subject);
    clipper.add_clip(with);
    let (mut tree, mut open) = (PolyTree64::new(), Paths64::new());
    clipper.execute_tree(clip, FillRule::NonZero, &mut tree, &mut open);
    regions_of(&tree)
}

/// All rings of `regions` on the grid.
pub(crate) fn to_grid(regions: &[Region]) -> Result<Paths64, PlanarError> {
    let mut paths = Paths64::with_capacity(regions.iter().map(|r| 1 + r.holes.len()).sum());
    for (region, r) in regions.iter().enumerate() {
        for (ring, points) in r.rings().enumerate() {
            paths.push(ring_to_grid(points, region, ring)?);
        }
    }
    Ok(paths)
}

/// A ring of a region on the grid; refused at the first coordinate outside the grid's range.
pub(crate) fn ring_to_grid(
    points: &[DVec2],
    region: usize,
    ring: usize,
) -> Result<Path64, PlanarError> {
    let mut path = Path64::with_capacity(points.len());
    for (vertex, p) in points.iter().enumerate() {
        for coordinate in p.to_array() {
            if !coordinate.is_finite() {
                return Err(PlanarError::NotFinite {
                    region,
                    ring,
                    vertex,
                });
            }
            if coordinate.abs() > LARGEST_COORDINATE {
                return Err(PlanarError::TooFar {
                    region,
                    ring,
                    vertex,
                    coordinate,
                });
            }
        }
        path.push(Point64::new(
            (p.x * GRID_PER_MM).round() as i64,
            (p.y * GRID_PER_MM).round() as i64,
        ));
    }
    Ok(path)
}

/// A grid path in millimetres.
pub(crate) fn ring_of(path: &Path64) -> Ring {
    path.iter()
        .map(|p| DVec2::new(p.x as f64, p.y as f64) / GRID_PER_MM)
        .collect()
}

/// The regions of a clipper's tree: nodes of odd depth are outer rings, their children holes.
pub(crate) fn regions_of(tree: &PolyTree64) -> Vec<Region> {
    let mut regions = Vec::new();
    for node in 1..tree.nodes.len() {
        if tree.is_hole(node) {
            continue;
        }
        let oriented = |path: &Path64, sign: f64| {
            let mut ring = ring_of(path);
            if signed_area(&ring) * sign < 0.0 {
                ring.reverse();
            }
            ring
        };
        let outer = oriented(tree.nodes[node].polygon(), 1.0);
        if outer.len() < 3 {
            continue;
        }
        let holes = tree.nodes[node]
            .children()
            .iter()
            .map(|&hole| oriented(tree.nodes[hole].polygon(), -1.0))
            .filter(|hole| hole.len() > 2)
            .collect();
        regions.push(Region { outer, holes });
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn area(regions: &[Region]) -> f64 {
        regions.iter().map(Region::area).sum()
    }

    fn any_ring(points: &[(f64, f64)], at: f64) -> Region {
        Region {
            outer: points
                .iter()
                .map(|&(x, y)| DVec2::new(x + at, y - at))
                .collect(),
            holes: Vec::new(),
        }
    }

    proptest! {
        /// What is left out of the sweep for it lies away from the other operand changes nothing, of rings that cross themselves too.
        #[test]
        fn what_lies_away_from_the_other_operand_matters_nothing(
            one in prop::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64), 3..40),
            other in prop::collection::vec((-20.0..20.0_f64, -9.0..9.0_f64), 3..12),
            at in -60.0..60.0_f64,
        ) {
            let (one, other) = ([any_ring(&one, 0.0)], [any_ring(&other, at)]);
            for (a, b) in [(&one, &other), (&other, &one)] {
                for clip in [ClipType::Intersection, ClipType::Difference] {
                    let told = combine(clip, a, b).unwrap();
                    let whole = swept(clip, &to_grid(a).unwrap(), &to_grid(b).unwrap());
                    prop_assert!((area(&told) - area(&whole)).abs() < 1e-3, "{clip:?}");
                }
            }
        }
    }
}
