//! Triangles on the same three vertices: copies go, walls of no thickness go, and what closes a solid of its own stays.
//!
//! Solids that share faces hold the same triangles once each: which of them are mere copies is told by how they hang together. Round
//! each edge triangles of opposite sense are joined, first copies with first ones; a piece that is left open and repeats others in all
//! its triangles is a copy, and so is a piece that repeats another one whole.

use std::collections::HashMap;

use crate::Mesh;
use crate::diagnosis::duplicates;
use crate::math::DVec3;
use crate::topology::{HalfEdge, edges, half_edges};

/// Drops what is surplus, and gives what is left of each group vertices of its own; how many triangles went, and the middle of the first.
pub(super) fn settle(mesh: &mut Mesh) -> Option<(u64, DVec3)> {
    let groups = duplicates(mesh);
    if groups.is_empty() {
        return None;
    }
    let mut gone = vec![false; mesh.triangles.len()];
    drop_copies(mesh, &groups, &mut gone);
    drop_opposites(mesh, &groups, &mut gone);
    let dropped = drop_gone(mesh, &gone);
    let kept = duplicates(mesh);
    if kept.is_empty() {
        return dropped;
    }
    separate(mesh, &kept);
    // what hangs together round all three corners cannot be told apart
    let mut gone = vec![false; mesh.triangles.len()];
    for t in duplicates(mesh).iter().flat_map(|group| &group[1..]) {
        gone[*t as usize] = true;
    }
    match (dropped, drop_gone(mesh, &gone)) {
        (Some((n, place)), Some((more, _))) => Some((n + more, place)),
        (first, second) => first.or(second),
    }
}

/// Takes out the triangles that are marked; how many, and the middle of the first.
fn drop_gone(mesh: &mut Mesh, gone: &[bool]) -> Option<(u64, DVec3)> {
    let first = gone.iter().position(|&g| g)?;
    let place = mesh.corners(first).iter().sum::<DVec3>() / 3.0;
    let mut t = 0;
    mesh.triangles.retain(|_| {
        t += 1;
        !gone[t - 1]
    });
    Some((gone.iter().filter(|&&g| g).count() as u64, place))
}

/// Whether two triangles on the same vertices run the same way around.
fn same_sense(a: [u32; 3], b: [u32; 3]) -> bool {
    (0..3).any(|k| [b[k], b[(k + 1) % 3], b[(k + 2) % 3]] == a)
}

/// Which copy of its group each triangle is, in mesh order from 0; 0 for those of which there is one.
fn copies(mesh: &Mesh, groups: &[Vec<u32>]) -> Vec<u32> {
    let mut copy = vec![0; mesh.triangles.len()];
    for group in groups {
        for (k, &t) in group.iter().enumerate() {
            copy[t as usize] = k as u32;
        }
    }
    copy
}

/// Calls `join` for half-edges that meet, and `lone` for those that have no other: two round an edge meet however they run, of more each
/// with one that runs the other way, first copies first, in mesh order.
fn meet(
    mesh: &Mesh,
    copy: &[u32],
    mut join: impl FnMut(HalfEdge, HalfEdge),
    mut lone: impl FnMut(HalfEdge, HalfEdge),
) {
    for edge in edges(&half_edges(mesh)) {
        if let &[a, b] = edge {
            join(a, b);
            continue;
        }
        let (mut rising, mut falling): (Vec<HalfEdge>, Vec<HalfEdge>) =
            edge.iter().partition(|e| e.is_rising(mesh));
        for side in [&mut rising, &mut falling] {
            side.sort_unstable_by_key(|e| (copy[e.triangle() as usize], e.corner));
        }
        for (a, b) in rising.iter().zip(&falling) {
            join(*a, *b);
        }
        let met = rising.len().min(falling.len());
        for e in rising.iter().skip(met).chain(falling.iter().skip(met)) {
            lone(*e, edge[0]);
        }
    }
}

/// Marks pieces that only repeat others: open ones, and those that repeat another piece whole.
fn drop_copies(mesh: &Mesh, groups: &[Vec<u32>], gone: &mut [bool]) {
    let n = mesh.triangles.len();
    let mut forest = Forest::new(n);
    let mut is_open = vec![false; n];
    meet(
        mesh,
        &copies(mesh, groups),
        |a, b| forest.join(a.triangle(), b.triangle()),
        |e, _| is_open[e.triangle() as usize] = true,
    );
    let piece: Vec<u32> = (0..n as u32).map(|t| forest.root(t)).collect();
    let mut group_of = vec![None; n];
    for (g, group) in groups.iter().enumerate() {
        for &t in group {
            group_of[t as usize] = Some(g);
        }
    }
    let mut members: HashMap<u32, Vec<u32>> = HashMap::new();
    for (t, &root) in piece.iter().enumerate() {
        members.entry(root).or_default().push(t as u32);
    }
    let mut left: Vec<usize> = groups.iter().map(Vec::len).collect();
    let mut pieces: Vec<(u32, Vec<u32>)> = members.into_iter().collect();
    // later ones are the copies
    pieces.sort_unstable_by_key(|(root, _)| std::cmp::Reverse(*root));
    for (root, own) in pieces {
        let Some(of) = own
            .iter()
            .map(|&t| group_of[t as usize])
            .collect::<Option<Vec<usize>>>()
        else {
            continue;
        };
        for &g in &of {
            left[g] -= 1;
        }
        let open = own.iter().any(|&t| is_open[t as usize]);
        let is_copy = of.iter().all(|&g| left[g] > 0)
            && (open || repeats(mesh, &own, root, |t| (&groups[of[t]], &piece)));
        if is_copy {
            for &t in &own {
                gone[t as usize] = true;
            }
        } else {
            for &g in &of {
                left[g] += 1;
            }
        }
    }
}

/// Whether one earlier piece holds all triangles of this one, in the same sense; `near` tells the group of the n-th, and all pieces.
fn repeats<'a>(
    mesh: &Mesh,
    own: &[u32],
    root: u32,
    near: impl Fn(usize) -> (&'a Vec<u32>, &'a Vec<u32>),
) -> bool {
    let twin = |k: usize, fits: &dyn Fn(u32) -> bool| {
        let (group, piece) = near(k);
        let triangle = mesh.triangles[own[k] as usize];
        let mut others = group.iter().copied();
        others
            .find(|&t| fits(piece[t as usize]) && same_sense(triangle, mesh.triangles[t as usize]))
            .map(|t| piece[t as usize])
    };
    let Some(other) = twin(0, &|p| p < root) else {
        return false;
    };
    (1..own.len()).all(|k| twin(k, &|p| p == other).is_some())
}

/// Marks pairs of opposite sense, walls of no thickness: nothing is opened where both go.
fn drop_opposites(mesh: &Mesh, groups: &[Vec<u32>], gone: &mut [bool]) {
    for group in groups {
        let left: Vec<u32> = group
            .iter()
            .copied()
            .filter(|&t| !gone[t as usize])
            .collect();
        let Some(&first) = left.first() else {
            continue;
        };
        let first = mesh.triangles[first as usize];
        let (same, other): (Vec<u32>, Vec<u32>) = left
            .iter()
            .partition(|&&t| same_sense(first, mesh.triangles[t as usize]));
        for &t in same.iter().zip(&other).flat_map(|(a, b)| [a, b]) {
            gone[t as usize] = true;
        }
    }
}

/// Gives each fan of triangles round a vertex of a group a vertex of its own: shells that share triangles no longer share edges.
fn separate(mesh: &mut Mesh, groups: &[Vec<u32>]) {
    let mut forest = Forest::new(3 * mesh.triangles.len());
    let mut together = |a: HalfEdge, b: HalfEdge| {
        let ends = |e: HalfEdge| {
            let (t, k) = (e.corner / 3, e.corner % 3);
            let next = 3 * t + (k + 1) % 3;
            if e.is_rising(mesh) {
                [e.corner, next]
            } else {
                [next, e.corner]
            }
        };
        let (a, b) = (ends(a), ends(b));
        forest.join(a[0], b[0]);
        forest.join(a[1], b[1]);
    };
    let mut lone = Vec::new();
    meet(mesh, &copies(mesh, groups), &mut together, |e, first| {
        lone.push((e, first));
    });
    // what meets nothing stays where it was
    for (e, first) in lone {
        together(e, first);
    }
    let mut shared = vec![false; mesh.vertices.len()];
    for &t in groups.iter().flatten() {
        for v in mesh.triangles[t as usize] {
            shared[v as usize] = true;
        }
    }
    // the first fan keeps the vertex
    let mut taken = vec![false; mesh.vertices.len()];
    let mut own: HashMap<u32, u32> = HashMap::new();
    for t in 0..mesh.triangles.len() {
        for k in 0..3 {
            let v = mesh.triangles[t][k];
            if !shared[v as usize] {
                continue;
            }
            let fan = forest.root((3 * t + k) as u32);
            let vertex = *own.entry(fan).or_insert_with(|| {
                if std::mem::replace(&mut taken[v as usize], true) {
                    mesh.vertices.push(mesh.vertices[v as usize]);
                    mesh.vertices.len() as u32 - 1
                } else {
                    v
                }
            });
            mesh.triangles[t][k] = vertex;
        }
    }
}

/// Sets of numbers, each by its smallest.
struct Forest {
    parent: Vec<u32>,
}

impl Forest {
    fn new(count: usize) -> Self {
        Forest {
            parent: (0..count as u32).collect(),
        }
    }

    fn root(&mut self, mut n: u32) -> u32 {
        while self.parent[n as usize] != n {
            let above = self.parent[self.parent[n as usize] as usize];
            self.parent[n as usize] = above;
            n = above;
        }
        n
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
