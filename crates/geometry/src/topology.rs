//! How triangles hang together: edges with their triangles, shells, consistent orientation.

use std::{collections::HashMap, ops::Range};

use rayon::prelude::*;

use crate::Mesh;

/// One side of a triangle: `corner` is 3 × triangle + k for the side from corner k to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    /// Both vertices in one word, the smaller one high.
    pub(crate) key: u64,
    pub(crate) corner: u32,
}

impl HalfEdge {
    pub(crate) fn triangle(self) -> u32 {
        self.corner / 3
    }

    /// From which vertex to which it runs.
    pub(crate) fn ends(self, mesh: &Mesh) -> (u32, u32) {
        let (t, k) = ((self.corner / 3) as usize, (self.corner % 3) as usize);
        (mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3])
    }

    /// Whether it runs from the smaller vertex number to the greater.
    pub(crate) fn is_rising(self, mesh: &Mesh) -> bool {
        let (a, b) = self.ends(mesh);
        a < b
    }
}

/// Whether a triangle names a vertex twice.
pub(crate) fn is_degenerate(t: [u32; 3]) -> bool {
    t[0] == t[1] || t[1] == t[2] || t[2] == t[0]
}

/// All sides of all triangles (degenerate ones left out), sorted by edge, then by triangle.
pub(crate) fn half_edges(mesh: &Mesh) -> Vec<HalfEdge> {
    let mut all = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, &v) in mesh.triangles.iter().enumerate() {
        if is_degenerate(v) {
            continue;
        }
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            all.push(HalfEdge {
                key: (u64::from(a.min(b)) << 32) | u64::from(a.max(b)),
                corner: 3 * t as u32 + k as u32,
            });
        }
    }
    all.par_sort_unstable();
    all
}

/// The runs of half-edges on the same edge.
pub(crate) fn edges(sorted: &[HalfEdge]) -> impl Iterator<Item = &[HalfEdge]> {
    sorted.chunk_by(|a, b| a.key == b.key)
}

/// Triangles grouped into shells: pieces joined by edges of exactly two triangles, each triangle with its sense
/// relative to the others of its shell.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shells {
    /// Shell of each triangle; `NO_SHELL` for degenerate ones.
    pub(crate) shell: Vec<u32>,
    /// Whether each triangle runs against the first triangle of its shell.
    pub(crate) against: Vec<bool>,
    /// Number of shells, numbered by their first triangle.
    pub(crate) count: usize,
    /// Edges at which no choice of sense is consistent (one-sided surfaces).
    pub(crate) one_sided: Vec<u64>,
}

/// The shell of a degenerate triangle.
pub(crate) const NO_SHELL: u32 = u32::MAX;

/// Finds shells by union with relative sense (a disjoint-set forest with parity).
pub(crate) fn shells(mesh: &Mesh, sorted: &[HalfEdge]) -> Shells {
    let n = mesh.triangles.len();
    let mut forest = Forest {
        parent: (0..n as u32).collect(),
        against: vec![false; n],
    };
    let mut one_sided = Vec::new();
    for edge in edges(sorted) {
        if let &[a, b] = edge {
            // two triangles agree when they run along their edge in opposite ways
            let against = a.is_rising(mesh) == b.is_rising(mesh);
            if !forest.join(a.triangle(), b.triangle(), against) {
                one_sided.push(a.key);
            }
        }
    }
    let mut number = vec![NO_SHELL; n];
    let mut shell = vec![NO_SHELL; n];
    let mut against = vec![false; n];
    let mut first_against = Vec::new();
    for t in 0..n {
        if is_degenerate(mesh.triangles[t]) {
            continue;
        }
        let (root, sense) = forest.find(t as u32);
        let slot = &mut number[root as usize];
        if *slot == NO_SHELL {
            *slot = first_against.len() as u32;
            first_against.push(sense);
        }
        shell[t] = *slot;
        against[t] = sense != first_against[*slot as usize];
    }
    Shells {
        shell,
        against,
        count: first_against.len(),
        one_sided,
    }
}

struct Forest {
    parent: Vec<u32>,
    /// Sense relative to the parent.
    against: Vec<bool>,
}

impl Forest {
    /// The root of `t`, and the sense of `t` relative to it; shortens the path on the way.
    fn find(&mut self, t: u32) -> (u32, bool) {
        let mut root = t;
        let mut sense = false;
        while self.parent[root as usize] != root {
            sense ^= self.against[root as usize];
            root = self.parent[root as usize];
        }
        let (mut at, mut rest) = (t, sense);
        while self.parent[at as usize] != root && at != root {
            let next = self.parent[at as usize];
            let own = self.against[at as usize];
            self.parent[at as usize] = root;
            self.against[at as usize] = rest;
            rest ^= own;
            at = next;
        }
        (root, sense)
    }

    /// Joins two triangles; `false` when they are joined already with the other sense.
    fn join(&mut self, a: u32, b: u32, against: bool) -> bool {
        let ((ra, sa), (rb, sb)) = (self.find(a), self.find(b));
        let relation = sa ^ sb ^ against;
        if ra == rb {
            return !relation;
        }
        // the smaller root wins: numbering does not depend on the order of edges
        let (root, child) = (ra.min(rb), ra.max(rb));
        self.parent[child as usize] = root;
        self.against[child as usize] = relation;
        true
    }
}

/// The rims of holes: loops of edges that have one triangle only, run so that a patch along them agrees with
/// the mesh around. Vertices in order, each loop closed; open chains (around one-sided places) are left out.
pub(crate) fn rims(mesh: &Mesh, sorted: &[HalfEdge]) -> Vec<Vec<u32>> {
    let mut loose: Vec<(u32, u32)> = edges(sorted)
        .filter(|edge| edge.len() == 1)
        .map(|edge| {
            let (a, b) = edge[0].ends(mesh);
            (b, a)
        })
        .collect();
    loose.sort_unstable();
    let mut taken = vec![false; loose.len()];
    let from = |v: u32| -> Range<usize> {
        loose.partition_point(|e| e.0 < v)..loose.partition_point(|e| e.0 <= v)
    };
    let mut loops = Vec::new();
    for start in 0..loose.len() {
        if taken[start] {
            continue;
        }
        let mut path = vec![start];
        // where on the path each of its vertices starts an edge
        let mut at = HashMap::from([(loose[start].0, 0)]);
        taken[start] = true;
        while let Some(&last) = path.last() {
            let end = loose[last].1;
            // where rims meet in one vertex, each visit to it closes a loop of its own
            if let Some(&k) = at.get(&end) {
                let rim: Vec<u32> = path.drain(k..).map(|e| loose[e].0).collect();
                for v in &rim {
                    at.remove(v);
                }
                loops.push(rim);
                continue;
            }
            match from(end).find(|&e| !taken[e]) {
                Some(next) => {
                    taken[next] = true;
                    at.insert(end, path.len());
                    path.push(next);
                }
                None => break,
            }
        }
    }
    loops
}
