//! Welding of vertices: exact (as files are read) and within a distance (as meshes are repaired).

use crate::{
    Mesh,
    math::{DVec3, IVec3},
};

/// Marks an empty slot of the table.
const EMPTY: u32 = u32::MAX;

/// Gives each distinct position one index, in order of first appearance.
///
/// An open-addressing table of vertex indices: 4 bytes a slot beside the vertices themselves, so that ten
/// million triangles weld in a few hundred megabytes. −0.0 and 0.0 are the same position.
#[derive(Debug, Default)]
pub(crate) struct VertexIndex {
    vertices: Vec<DVec3>,
    slots: Vec<u32>,
}

impl VertexIndex {
    /// Room for about `vertices` positions.
    pub(crate) fn with_capacity(vertices: usize) -> Self {
        VertexIndex {
            vertices: Vec::with_capacity(vertices),
            slots: vec![EMPTY; (2 * vertices).next_power_of_two().max(16)],
        }
    }

    /// The index of `p`, new or old; `None` when 2³²−1 vertices are reached.
    pub(crate) fn index(&mut self, p: DVec3) -> Option<u32> {
        // adding zero turns −0.0 into 0.0
        let p = p + DVec3::ZERO;
        if 2 * (self.vertices.len() + 1) > self.slots.len() {
            self.grow();
        }
        let mask = self.slots.len() - 1;
        let mut at = hash(p) as usize & mask;
        loop {
            let slot = self.slots[at];
            if slot == EMPTY {
                let new = u32::try_from(self.vertices.len())
                    .ok()
                    .filter(|&v| v != EMPTY)?;
                self.slots[at] = new;
                self.vertices.push(p);
                return Some(new);
            }
            if self.vertices[slot as usize] == p {
                return Some(slot);
            }
            at = (at + 1) & mask;
        }
    }

    /// The distinct positions, in order of first appearance.
    pub(crate) fn into_vertices(self) -> Vec<DVec3> {
        self.vertices
    }

    fn grow(&mut self) {
        let size = (2 * self.slots.len()).max(16);
        self.slots = vec![EMPTY; size];
        for (i, &p) in self.vertices.iter().enumerate() {
            let mut at = hash(p) as usize & (size - 1);
            while self.slots[at] != EMPTY {
                at = (at + 1) & (size - 1);
            }
            self.slots[at] = i as u32;
        }
    }
}

/// Mixes three coordinates into a well-spread word.
fn hash(p: DVec3) -> u64 {
    let mix = |h: u64, x: f64| {
        let h = (h ^ x.to_bits()).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        h ^ (h >> 29)
    };
    let h = mix(mix(mix(0, p.x), p.y), p.z).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h ^ (h >> 32)
}

/// What a weld did.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Welded {
    /// Vertices that were merged into another.
    pub merged: usize,
}

/// Merges vertices nearer than `tolerance` mm to an earlier one (0: identical positions only), and drops
/// vertices that no triangle uses. Triangles keep their order; those that lose a corner stay, degenerate.
///
/// Each vertex joins the first kept vertex within reach, so chains of near vertices do not collapse into one.
/// A tolerance that is not a positive number is taken as 0.
pub fn weld(mesh: &mut Mesh, tolerance: f64) -> Welded {
    let tolerance = if tolerance.is_finite() {
        tolerance.max(0.0)
    } else {
        0.0
    };
    let mut used = vec![false; mesh.vertices.len()];
    for &v in mesh.triangles.iter().flatten() {
        used[v as usize] = true;
    }
    let mut kept = Kept::new(tolerance, mesh.vertices.len());
    let mut renumber = vec![EMPTY; mesh.vertices.len()];
    let mut merged = 0;
    for (i, &p) in mesh.vertices.iter().enumerate() {
        if used[i] {
            let before = kept.vertices.len();
            renumber[i] = kept.index(p);
            merged += usize::from(kept.vertices.len() == before);
        }
    }
    for v in mesh.triangles.iter_mut().flatten() {
        *v = renumber[*v as usize];
    }
    mesh.vertices = kept.vertices;
    Welded { merged }
}

/// Drops vertices that no triangle uses; the others keep their order, and stay apart where they coincide.
pub fn drop_unused_vertices(mesh: &mut Mesh) {
    let mut renumber = vec![EMPTY; mesh.vertices.len()];
    for &v in mesh.triangles.iter().flatten() {
        renumber[v as usize] = 0;
    }
    let mut kept = 0;
    for number in &mut renumber {
        if *number != EMPTY {
            *number = kept;
            kept += 1;
        }
    }
    let mut v = 0;
    mesh.vertices.retain(|_| {
        v += 1;
        renumber[v - 1] != EMPTY
    });
    for v in mesh.triangles.iter_mut().flatten() {
        *v = renumber[*v as usize];
    }
}

/// Kept vertices in a hashed grid of cubes as large as the tolerance.
struct Kept {
    vertices: Vec<DVec3>,
    /// First vertex of each bucket, then the next of the same bucket.
    heads: Vec<u32>,
    next: Vec<u32>,
    tolerance: f64,
}

impl Kept {
    fn new(tolerance: f64, expected: usize) -> Self {
        Kept {
            vertices: Vec::new(),
            heads: vec![EMPTY; (2 * expected).next_power_of_two().max(16)],
            next: Vec::new(),
            tolerance,
        }
    }

    fn cube(&self, p: DVec3) -> DVec3 {
        if self.tolerance > 0.0 {
            (p / self.tolerance).floor() + DVec3::ZERO
        } else {
            p + DVec3::ZERO
        }
    }

    fn index(&mut self, p: DVec3) -> u32 {
        let mask = self.heads.len() - 1;
        let cube = self.cube(p);
        let reach = i32::from(self.tolerance > 0.0);
        let mut best = EMPTY;
        for dx in -reach..=reach {
            for dy in -reach..=reach {
                for dz in -reach..=reach {
                    let near = cube + IVec3::new(dx, dy, dz).as_dvec3();
                    let mut at = self.heads[hash(near) as usize & mask];
                    while at != EMPTY {
                        if self.vertices[at as usize].distance(p) <= self.tolerance {
                            best = best.min(at);
                        }
                        at = self.next[at as usize];
                    }
                }
            }
        }
        if best != EMPTY {
            return best;
        }
        let new = self.vertices.len() as u32;
        let bucket = hash(cube) as usize & mask;
        self.next.push(self.heads[bucket]);
        self.heads[bucket] = new;
        self.vertices.push(p);
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_index_keeps_first_appearance_and_merges_signed_zeros() {
        let mut index = VertexIndex::default();
        let ids: Vec<_> = [DVec3::X, DVec3::ZERO, -DVec3::ZERO, DVec3::X, DVec3::Y]
            .map(|p| index.index(p).unwrap())
            .to_vec();
        assert_eq!(ids, [0, 1, 1, 0, 2]);
        for k in 0..10_000 {
            index.index(DVec3::splat(f64::from(k % 5000))).unwrap();
        }
        assert_eq!(index.into_vertices().len(), 3 + 4999);
    }

    #[test]
    fn welding_within_a_distance_merges_neighbours_only() {
        let p = |x: f64| DVec3::new(x, 0.0, 0.0);
        let mut mesh = Mesh {
            vertices: vec![p(0.0), p(0.9), p(1.8), DVec3::Y * 50.0, DVec3::Y, p(0.05)],
            triangles: vec![[0, 2, 4], [5, 1, 4]],
        };
        let welded = weld(&mut mesh, 1.0);
        assert_eq!(
            welded.merged, 3,
            "0.9, 0.05 and (0, 1, 0) join 0; 1.8 stays"
        );
        assert_eq!(mesh.vertices, [p(0.0), p(1.8)]);
        assert_eq!(mesh.triangles, [[0, 1, 0], [0, 0, 0]]);
    }
}
