//! Cutting of triangles until no edge is longer than asked, the surface the same.

use std::collections::HashMap;

use crate::Mesh;
use crate::math::DVec3;

/// Halves edges longer than `longest` mm until none is left; `None` where that takes more than `most` triangles.
pub fn subdivide(mesh: &mut Mesh, longest: f64, most: usize) -> Option<()> {
    // an edge halves each time: rounds end long before this with any finite lengths
    let area = mesh.area();
    if area / (longest * longest) > 4.0 * most as f64 {
        return None;
    }
    loop {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut cut = Vec::with_capacity(mesh.triangles.len());
        for t in 0..mesh.triangles.len() {
            let v = mesh.triangles[t];
            let middle = [0, 1, 2].map(|k| {
                let (a, b) = (v[k], v[(k + 1) % 3]);
                let [p, q] = [a, b].map(|v| mesh.vertices[v as usize]);
                (p.distance(q) > longest).then(|| {
                    *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        mesh.vertices.push(p.midpoint(q));
                        mesh.vertices.len() as u32 - 1
                    })
                })
            });
            pieces(v, middle, &mesh.vertices, &mut cut);
            if cut.len() > most {
                return None;
            }
        }
        mesh.triangles = cut;
        if middles.is_empty() {
            return Some(());
        }
    }
}

/// The triangles that a triangle is cut into where its sides have middles.
fn pieces(v: [u32; 3], middle: [Option<u32>; 3], at: &[DVec3], to: &mut Vec<[u32; 3]>) {
    match middle {
        [None, None, None] => to.push(v),
        [Some(x), Some(y), Some(z)] => {
            to.extend([[v[0], x, z], [x, v[1], y], [z, y, v[2]], [x, y, z]]);
        }
        _ => {
            // turned so that the sides with middles come first
            let turns = (0..3).find(|&k| middle[k].is_some() && middle[(k + 2) % 3].is_none());
            let k = turns.unwrap_or(0);
            let [a, b, c] = [v[k], v[(k + 1) % 3], v[(k + 2) % 3]];
            match (middle[k], middle[(k + 1) % 3]) {
                (Some(x), None) => to.extend([[a, x, c], [x, b, c]]),
                (Some(x), Some(y)) => {
                    to.push([x, b, y]);
                    let across = |p: u32, q: u32| at[p as usize].distance_squared(at[q as usize]);
                    // the shorter way over what is left
                    if across(a, y) <= across(x, c) {
                        to.extend([[a, x, y], [a, y, c]]);
                    } else {
                        to.extend([[a, x, c], [x, y, c]]);
                    }
                }
                _ => to.push(v),
            }
        }
    }
}
