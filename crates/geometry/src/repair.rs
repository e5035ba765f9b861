//! Repair of meshes: weld, drop, turn, fill; every action is told.

mod duplicates;
mod holes;

use std::{collections::HashSet, fmt};

use serde::{Deserialize, Serialize};

use meltpath_base::{Cancelled, Observer, Reporter};

use crate::{
    Mesh,
    bvh::Bvh,
    diagnosis::{majorities, measure, parents},
    math::DVec3,
    topology::{NO_SHELL, edges, half_edges, is_degenerate, rims, shells},
    weld::{drop_unused_vertices, weld},
};

/// Shells within shells followed at most: intersecting shells may seem to hold each other.
const DEEPEST_NEST: usize = 64;

/// What repair may do, and how far it goes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RepairOptions {
    /// Vertices this near are merged where edges are loose, mm.
    pub weld: f64,
    /// Holes up to this fraction of the part's diagonal across are filled.
    pub hole: f64,
    /// Shells below this fraction of the part's diagonal across are dropped.
    pub stray: f64,
}

impl Default for RepairOptions {
    fn default() -> Self {
        RepairOptions {
            weld: 1e-3,
            hole: 0.1,
            stray: 0.01,
        }
    }
}

/// One thing that repair did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RepairAction {
    /// Merged vertices.
    Welded {
        /// How many disappeared.
        vertices: u64,
        /// Within which distance, mm.
        tolerance: f64,
    },
    /// Dropped triangles that name a vertex twice.
    DroppedDegenerate {
        /// How many.
        triangles: u64,
    },
    /// Dropped triangles that repeat another and close nothing; pairs of opposite sense (walls of no thickness) went both.
    DroppedDuplicates {
        /// How many.
        triangles: u64,
        /// Middle of the first one, mm.
        place: DVec3,
    },
    /// Turned triangles to agree with most of their shell.
    TurnedTriangles {
        /// How many.
        triangles: u64,
        /// Middle of the first one, mm.
        place: DVec3,
    },
    /// Filled holes.
    FilledHoles {
        /// How many.
        holes: u64,
        /// With how many triangles.
        triangles: u64,
        /// Diagonal of the widest, mm.
        widest: f64,
        /// Middle of the widest, mm.
        place: DVec3,
    },
    /// Turned shells that had their inside out, with the cavities inside them.
    TurnedShells {
        /// How many.
        shells: u64,
        /// Middle of the first one, mm.
        place: DVec3,
    },
    /// Dropped shells that are tiny against the part.
    DroppedStrays {
        /// How many.
        shells: u64,
        /// With how many triangles.
        triangles: u64,
        /// Middle of the first one, mm.
        place: DVec3,
    },
}

impl fmt::Display for RepairAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            RepairAction::Welded {
                vertices,
                tolerance,
            } => write!(f, "welded {vertices} vertices within {tolerance} mm"),
            RepairAction::DroppedDegenerate { triangles } => {
                write!(f, "dropped {triangles} triangles that name a vertex twice")
            }
            RepairAction::DroppedDuplicates { triangles, .. } => {
                write!(f, "dropped {triangles} duplicate triangles")
            }
            RepairAction::TurnedTriangles { triangles, .. } => {
                write!(f, "turned {triangles} triangles with reversed normals")
            }
            RepairAction::FilledHoles {
                holes,
                triangles,
                widest,
                ..
            } => write!(
                f,
                "filled {holes} holes (up to {widest:.3} mm across) with {triangles} triangles"
            ),
            RepairAction::TurnedShells { shells, .. } => {
                write!(f, "turned {shells} shells that were inside out")
            }
            RepairAction::DroppedStrays {
                shells, triangles, ..
            } => write!(f, "dropped {shells} stray shells of {triangles} triangles"),
        }
    }
}

impl RepairAction {
    /// Where it was done, if in one place, mm.
    pub fn place(&self) -> Option<DVec3> {
        match *self {
            RepairAction::Welded { .. } | RepairAction::DroppedDegenerate { .. } => None,
            RepairAction::DroppedDuplicates { place, .. }
            | RepairAction::TurnedTriangles { place, .. }
            | RepairAction::FilledHoles { place, .. }
            | RepairAction::TurnedShells { place, .. }
            | RepairAction::DroppedStrays { place, .. } => Some(place),
        }
    }
}

/// Repairs a mesh in place and says what was done: nothing, for a sound mesh.
///
/// In this order: weld where edges are loose, drop degenerate and duplicate triangles, turn triangles to agree
/// within each shell, fill small holes, drop stray shells, turn shells that are inside out (outer ones by their
/// volume; what lies inside turns with the shell around it). A solid inside another and intersections are left as
/// they are, and so are triangles that solids share, each of them with vertices of its own: slicing takes their union. Each action is also a warning (`mesh-repaired`).
///
/// Vertices must be finite (a mesh with others is left alone) and indices valid.
///
/// # Errors
/// Cancellation only; the mesh is then somewhere between two steps.
pub fn repair(
    mesh: &mut Mesh,
    options: &RepairOptions,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<RepairAction>, Cancelled> {
    observer.stage("repair mesh", 0);
    let mut actions = Vec::new();
    let Some((lo, hi)) = mesh
        .bounds()
        .filter(|(lo, hi)| lo.is_finite() && hi.is_finite())
    else {
        return Ok(actions);
    };
    if mesh.vertices.iter().any(|p| !p.is_finite()) {
        return Ok(actions);
    }
    let diagonal = (hi - lo).length();
    let is_loose = edges(&half_edges(mesh)).any(|edge| edge.len() == 1);
    if is_loose {
        let welded = weld(mesh, options.weld).merged as u64;
        if welded > 0 {
            actions.push(RepairAction::Welded {
                vertices: welded,
                tolerance: options.weld,
            });
        }
    }
    observer.check()?;
    drop_degenerate(mesh, &mut actions);
    drop_duplicates(mesh, &mut actions);
    observer.check()?;
    turn_triangles(mesh, &mut actions);
    fill_holes(mesh, options.hole * diagonal, &mut actions);
    observer.check()?;
    settle_shells(mesh, options.stray * diagonal, &mut actions);
    if !actions.is_empty() {
        drop_unused_vertices(mesh);
    }
    for action in &actions {
        let place = meltpath_base::Place {
            position: action.place().map(|p| p.to_array()),
            ..meltpath_base::Place::default()
        };
        reporter.warn_at(
            "mesh-repaired",
            format!("the mesh was repaired: {action}"),
            place,
            "",
        );
    }
    Ok(actions)
}

fn middle(mesh: &Mesh, t: usize) -> DVec3 {
    mesh.corners(t).iter().sum::<DVec3>() / 3.0
}

fn drop_degenerate(mesh: &mut Mesh, actions: &mut Vec<RepairAction>) {
    let before = mesh.triangles.len();
    mesh.triangles.retain(|&v| !is_degenerate(v));
    let dropped = (before - mesh.triangles.len()) as u64;
    if dropped > 0 {
        actions.push(RepairAction::DroppedDegenerate { triangles: dropped });
    }
}

fn drop_duplicates(mesh: &mut Mesh, actions: &mut Vec<RepairAction>) {
    if let Some((triangles, place)) = duplicates::settle(mesh) {
        actions.push(RepairAction::DroppedDuplicates { triangles, place });
    }
}

fn turn_triangles(mesh: &mut Mesh, actions: &mut Vec<RepairAction>) {
    let pieces = shells(mesh, &half_edges(mesh));
    let majority = majorities(&pieces);
    let mut turned = 0;
    let mut place = None;
    for t in 0..mesh.triangles.len() {
        let shell = pieces.shell[t];
        if shell != NO_SHELL && pieces.against[t] != majority[shell as usize] {
            place.get_or_insert_with(|| middle(mesh, t));
            mesh.triangles[t].swap(1, 2);
            turned += 1;
        }
    }
    if let Some(place) = place {
        actions.push(RepairAction::TurnedTriangles {
            triangles: turned,
            place,
        });
    }
}

/// The corners in rising order: the same for every sense and start.
fn sorted_corners(mut t: [u32; 3]) -> [u32; 3] {
    t.sort_unstable();
    t
}

/// The edges of a patch that are not on its rim.
fn inner_edges(patch: &[[u32; 3]], rim: &[u32]) -> Vec<u64> {
    let key = |a: u32, b: u32| (u64::from(a.min(b)) << 32) | u64::from(a.max(b));
    let outer: HashSet<u64> = (0..rim.len())
        .map(|k| key(rim[k], rim[(k + 1) % rim.len()]))
        .collect();
    let mut inner: Vec<u64> = patch
        .iter()
        .flat_map(|t| (0..3).map(|k| key(t[k], t[(k + 1) % 3])))
        .filter(|edge| !outer.contains(edge))
        .collect();
    inner.sort_unstable();
    inner.dedup();
    inner
}

/// Fills holes up to `widest` mm across, where the patch neither repeats a triangle nor crowds an edge.
fn fill_holes(mesh: &mut Mesh, widest: f64, actions: &mut Vec<RepairAction>) {
    let sorted = half_edges(mesh);
    // what a patch must not repeat: the triangles around the rims, and any edge across a hole
    let mut known: HashSet<[u32; 3]> = edges(&sorted)
        .filter(|edge| edge.len() == 1)
        .map(|edge| sorted_corners(mesh.triangles[edge[0].triangle() as usize]))
        .collect();
    let mut across_holes: HashSet<u64> = HashSet::new();
    let (mut holes, mut triangles) = (0, 0);
    let mut largest: Option<(f64, DVec3)> = None;
    for rim in rims(mesh, &sorted) {
        let points: Vec<DVec3> = rim.iter().map(|&v| mesh.vertices[v as usize]).collect();
        let (lo, hi) = points.iter().fold((points[0], points[0]), |(lo, hi), &p| {
            (lo.min(p), hi.max(p))
        });
        let across = (hi - lo).length();
        if across > widest {
            continue;
        }
        let patch = holes::patch(&points).map(|patch| -> Vec<[u32; 3]> {
            patch.into_iter().map(|t| t.map(|k| rim[k])).collect()
        });
        if let Some(patch) = patch {
            let inner = inner_edges(&patch, &rim);
            let is_new = |key: &u64| {
                sorted.binary_search_by_key(key, |e| e.key).is_err() && !across_holes.contains(key)
            };
            if !inner.iter().all(is_new)
                || patch.iter().any(|&t| known.contains(&sorted_corners(t)))
            {
                continue;
            }
            across_holes.extend(inner);
            known.extend(patch.iter().map(|&t| sorted_corners(t)));
            holes += 1;
            triangles += patch.len() as u64;
            if largest.is_none_or(|(w, _)| across > w) {
                largest = Some((across, 0.5 * (lo + hi)));
            }
            mesh.triangles.extend(patch);
        }
    }
    if let Some((widest, place)) = largest {
        actions.push(RepairAction::FilledHoles {
            holes,
            triangles,
            widest,
            place,
        });
    }
}

/// Drops stray shells and turns those that are inside out.
fn settle_shells(mesh: &mut Mesh, smallest: f64, actions: &mut Vec<RepairAction>) {
    let sorted = half_edges(mesh);
    let pieces = shells(mesh, &sorted);
    let mut closed = vec![true; pieces.count];
    for edge in edges(&sorted) {
        if let [only] = edge {
            closed[pieces.shell[only.triangle() as usize] as usize] = false;
        }
    }
    drop(sorted);
    let majority = majorities(&pieces);
    let made = measure(mesh, &pieces, &majority, &closed);
    let across = |s: usize| (made[s].hi - made[s].lo).length();
    let place = |s: usize| 0.5 * (made[s].lo + made[s].hi);
    let stray: Vec<bool> = (0..made.len()).map(|s| across(s) < smallest).collect();

    let inside = parents(mesh, &Bvh::new(mesh), &pieces, &made);
    let turned: Vec<bool> = (0..made.len())
        .map(|s| {
            // what lies inside a shell turns with the outermost one around it
            let mut root = s;
            for _ in 0..DEEPEST_NEST {
                match inside[root] {
                    Some(parent) => root = parent as usize,
                    None => break,
                }
            }
            made[root].closed && made[root].volume < 0.0
        })
        .collect();
    for (t, &shell) in pieces.shell.iter().enumerate() {
        if shell != NO_SHELL && turned[shell as usize] {
            mesh.triangles[t].swap(1, 2);
        }
    }
    let count = |list: &[bool]| list.iter().filter(|&&x| x).count() as u64;
    let kept_turned: Vec<bool> = (0..made.len()).map(|s| turned[s] && !stray[s]).collect();
    if let Some(first) = kept_turned.iter().position(|&t| t) {
        actions.push(RepairAction::TurnedShells {
            shells: count(&kept_turned),
            place: place(first),
        });
    }
    if let Some(first) = stray.iter().position(|&s| s) {
        let mut t = 0;
        let before = mesh.triangles.len();
        mesh.triangles.retain(|_| {
            t += 1;
            let shell = pieces.shell[t - 1];
            shell == NO_SHELL || !stray[shell as usize]
        });
        actions.push(RepairAction::DroppedStrays {
            shells: count(&stray),
            triangles: (before - mesh.triangles.len()) as u64,
            place: place(first),
        });
    }
}
