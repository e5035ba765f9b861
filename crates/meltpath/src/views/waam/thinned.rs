//! A mesh of few triangles that looks like one of many.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;

/// A mesh of at most `most` triangles, made to be seen: its vertices are drawn together in cubes, as large as it takes.
pub(super) fn thinned(mesh: &Mesh, most: usize) -> Mesh {
    let Some((low, high)) = mesh.bounds() else {
        return Mesh::default();
    };
    if mesh.triangles.len() <= most {
        return mesh.clone();
    }
    // a surface crosses about four cubes a side squared
    let mut cubes = (most as f64).sqrt();
    loop {
        let side = ((high - low).max_element() / cubes).max(f64::MIN_POSITIVE);
        let found = drawn_together(mesh, low, side);
        if found.triangles.len() <= most || cubes < 2.0 {
            return found;
        }
        cubes *= 0.8;
    }
}

/// A mesh whose vertices within a cube are one, in their mean.
fn drawn_together(mesh: &Mesh, low: DVec3, side: f64) -> Mesh {
    let mut cubes: BTreeMap<[i64; 3], u32> = BTreeMap::new();
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    let of: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|v| {
            let cube = ((*v - low) / side).to_array().map(|c| c.floor() as i64);
            let next = sums.len() as u32;
            let own = *cubes.entry(cube).or_insert(next);
            if own == next {
                sums.push((DVec3::ZERO, 0.0));
            }
            let (sum, count) = &mut sums[own as usize];
            (*sum, *count) = (*sum + *v, *count + 1.0);
            own
        })
        .collect();
    let mut seen = BTreeSet::new();
    let mut triangles = Vec::new();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| of[v as usize]);
        let mut sorted = [a, b, c];
        sorted.sort_unstable();
        if a != b && b != c && c != a && seen.insert(sorted) {
            triangles.push([a, b, c]);
        }
    }
    Mesh {
        vertices: sums.iter().map(|(sum, count)| *sum / *count).collect(),
        triangles,
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::math::DVec2;
    use meltpath_geometry::shapes::revolve;

    use super::*;

    #[test]
    fn a_mesh_of_few_triangles_is_as_large_as_one_of_many() {
        let ring = |i: u32| DVec2::new(50.0 + 10.0 * f64::from(i % 7), 3.0 * f64::from(i));
        let profile: Vec<DVec2> = (0..100).map(ring).collect();
        let many = revolve(&profile, 200);
        let few = thinned(&many, 2000);
        assert!(
            (500..=2000).contains(&few.triangles.len()),
            "{}",
            few.triangles.len()
        );
        let size = |m: &Mesh| m.bounds().map_or(DVec3::ZERO, |(low, high)| high - low);
        assert!((size(&few) - size(&many)).abs().max_element() < 15.0);
        assert!(
            few.triangles
                .iter()
                .flatten()
                .all(|v| (*v as usize) < few.vertices.len())
        );
        assert_eq!(thinned(&few, 2000), few);
    }
}
