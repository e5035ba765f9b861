//! Unions and differences of rings, on an integer grid of one nanometre.

use clipper2_rust::{
    ClipType, Clipper64, EndType, FillRule, JoinType, Path64, Paths64, Point64, PolyTree64,
    inflate_paths_64, poly_tree_to_faces64,
};

use crate::{
    math::DVec2,
    region::{Region, Ring},
};

/// Grid points per mm.
const SCALE: f64 = 1e6;
/// Largest coordinate that the grid carries, mm (a thousand kilometres: nothing real is lost).
const LARGEST: f64 = 1e9;

fn to_grid<'a>(rings: impl IntoIterator<Item = &'a Ring>) -> Paths64 {
    let on_grid = |x: f64| (x.clamp(-LARGEST, LARGEST) * SCALE).round() as i64;
    rings
        .into_iter()
        .map(|ring| {
            ring.iter()
                .map(|p| Point64::new(on_grid(p.x), on_grid(p.y)))
                .collect()
        })
        .collect()
}

fn from_grid(path: &Path64) -> Ring {
    path.iter()
        .map(|p| DVec2::new(p.x as f64, p.y as f64) / SCALE)
        .collect()
}

fn run(operation: ClipType, subjects: &Paths64, clips: &Paths64) -> Vec<Region> {
    let mut clipper = Clipper64::new();
    clipper.add_subject(subjects);
    clipper.add_clip(clips);
    let mut tree = PolyTree64::new();
    let mut open = Paths64::new();
    clipper.execute_tree(operation, FillRule::NonZero, &mut tree, &mut open);
    poly_tree_to_faces64(&tree)
        .iter()
        .map(|face| Region {
            outer: from_grid(&face.outer),
            holes: face.holes.iter().map(from_grid).collect(),
        })
        .collect()
}

/// Everything with a winding number other than zero, as regions with holes.
pub(crate) fn union(rings: &[Ring]) -> Vec<Region> {
    run(ClipType::Union, &to_grid(rings), &Paths64::new())
}

/// Everything within `distance` mm of `regions`, with round corners (chord error 2 µm).
pub(crate) fn grown(regions: &[Region], distance: f64) -> Vec<Region> {
    let rings = to_grid(regions.iter().flat_map(Region::rings));
    let grown = inflate_paths_64(
        &rings,
        distance * SCALE,
        JoinType::Round,
        EndType::Polygon,
        2.0,
        0.002 * SCALE,
    );
    run(ClipType::Union, &grown, &Paths64::new())
}

/// What lies in `regions` and not in `removed`.
pub(crate) fn difference(regions: &[Region], removed: &[Region]) -> Vec<Region> {
    run(
        ClipType::Difference,
        &to_grid(regions.iter().flat_map(Region::rings)),
        &to_grid(removed.iter().flat_map(Region::rings)),
    )
}
