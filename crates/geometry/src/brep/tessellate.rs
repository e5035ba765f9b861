//! Meshes of boundary representations: shared edges, faces triangulated in their parameter planes.
//!
//! Every edge is cut into chords once, for both its faces, so that the mesh of a closed shell is
//! closed. A face's boundary is carried into the parameter plane of its surface, seams and poles
//! included, triangulated there (constrained Delaunay, in coordinates stretched so that one unit is
//! one allowed chord) and refined inside until the chord error holds. Where chords of neighbouring
//! edges would cross in the plane, the edges are cut more finely and the faces done again.

mod chart;
mod cut;
mod edges;
mod error;
mod fill;
mod outline;
mod tolerance;
mod trim;
mod warp;

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

use meltpath_base::{Observer, Reporter};
use rayon::prelude::*;

use super::{BrepModel, Sense, ShellRole, Solid};
use crate::Mesh;
use crate::math::{DAffine3, DVec3};
use chart::Chart;
use edges::Samples;
use error::FaceIssue;
pub use error::TessellateError;
use fill::FaceMesh;
use outline::Node;
pub use tolerance::Tolerance;

/// Rounds of cutting edges more finely before a face is given up.
const ROUNDS: usize = 16;

/// All faces of a solid, triangulated over the same samples.
#[derive(Debug)]
struct Parts {
    samples: Vec<Samples>,
    faces: Vec<FaceMesh>,
}

/// The mesh of all solids in their places, solid after solid, normals out of the metal.
///
/// The mesh of a closed shell is closed: every side of a triangle is the side of one other, the
/// other way round. Shells that are inside out in the file are turned, with a warning.
///
/// # Errors
/// [`TessellateError`]: a face that cannot be done is named, never left out.
pub fn tessellate(
    model: &BrepModel,
    tolerance: &Tolerance,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, TessellateError> {
    let faces: usize = model.solids.iter().map(|s| s.solid.faces.len()).sum();
    observer.stage("tessellate", faces as u64);
    let mut done: HashMap<*const Solid, Mesh> = HashMap::new();
    let mut mesh = Mesh::default();
    for placed in &model.solids {
        let key = std::sync::Arc::as_ptr(&placed.solid);
        let own = match done.entry(key) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(slot) => slot.insert(at_some_chord(
                &placed.solid,
                &placed.name,
                tolerance,
                reporter,
                observer,
            )?),
        };
        append(&mut mesh, own, &placed.part_from_solid).ok_or_else(|| {
            TessellateError::TooFine {
                solid: placed.name.clone(),
                chord: tolerance.chord,
            }
        })?;
        observer.advance(placed.solid.faces.len() as u64);
    }
    Ok(mesh)
}

/// Other chord errors at which a solid is tried whose faces fail at the one asked for, as parts of it: edges of kernels lie some µm
/// off their surfaces, and what crosses at one chord does not at another.
const OTHER_CHORDS: [f64; 4] = [0.25, 4.0, 0.0625, 16.0];

/// The mesh of one solid at the chord error asked for, else at another one; a coarser one is told.
fn at_some_chord(
    solid: &Solid,
    name: &str,
    tolerance: &Tolerance,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, TessellateError> {
    let asked = tessellate_solid(solid, name, tolerance, reporter, observer);
    // what has too many points has more of them at a finer chord
    let finest = match &asked {
        Err(TessellateError::Face { .. }) => 0.0,
        Err(TessellateError::TooFine { .. }) => 1.0,
        _ => return asked,
    };
    for part in OTHER_CHORDS.into_iter().filter(|part| *part > finest) {
        let other = Tolerance {
            chord: part * tolerance.chord,
            ..*tolerance
        };
        match tessellate_solid(solid, name, &other, reporter, observer) {
            Ok(mesh) if part > 1.0 => {
                reporter.warn(
                    "brep-coarser",
                    format!(
                        "`{name}` has no mesh with a chord error of {} mm: it has one with {} mm, which is taken",
                        tolerance.chord, other.chord
                    ),
                    "ask for that chord error, or heal the solid in the program that wrote it",
                );
                return Ok(mesh);
            }
            Ok(mesh) => return Ok(mesh),
            Err(TessellateError::Cancelled(c)) => return Err(c.into()),
            Err(_) => {}
        }
    }
    asked
}

/// The mesh of one solid in its own frame; `name` is for messages.
///
/// # Errors
/// As [`tessellate`].
pub fn tessellate_solid(
    solid: &Solid,
    name: &str,
    tolerance: &Tolerance,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, TessellateError> {
    let parts = triangulate(solid, name, tolerance, observer)?;
    assemble(solid, name, &parts, tolerance, reporter)
}

/// Appends a placed copy of a mesh; `None` if the vertices outgrow their indices.
fn append(mesh: &mut Mesh, own: &Mesh, pose: &DAffine3) -> Option<()> {
    let offset = u32::try_from(mesh.vertices.len()).ok()?;
    u32::try_from(mesh.vertices.len() + own.vertices.len()).ok()?;
    mesh.vertices
        .extend(own.vertices.iter().map(|&v| pose.transform_point3(v)));
    let mirrored = pose.matrix3.determinant() < 0.0;
    mesh.triangles
        .extend(own.triangles.iter().map(|&[a, b, c]| {
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            [a + offset, b + offset, c + offset]
        }));
    Some(())
}

/// Cuts all edges and triangulates all faces, again and again until no face asks for more samples.
fn triangulate(
    solid: &Solid,
    name: &str,
    tolerance: &Tolerance,
    observer: &dyn Observer,
) -> Result<Parts, TessellateError> {
    let sound = |x: f64| x.is_finite() && x > 0.0;
    if !sound(tolerance.chord) || !sound(tolerance.angle) {
        return Err(TessellateError::Tolerance {
            chord: tolerance.chord,
            angle: tolerance.angle,
        });
    }
    let tolerance = Tolerance {
        angle: tolerance.angle.min(std::f64::consts::FRAC_PI_4),
        ..*tolerance
    };
    let mut samples: Vec<Samples> = solid
        .edges
        .par_iter()
        .map(|edge| edges::discretise(solid, edge, &tolerance))
        .collect();
    let too_fine = || TessellateError::TooFine {
        solid: name.to_owned(),
        chord: tolerance.chord,
    };
    if samples.iter().any(|s| s.t.len() > edges::MOST_CHORDS) {
        return Err(too_fine());
    }
    let charts: Vec<Chart<'_>> = solid
        .faces
        .par_iter()
        .map(|face| Chart::new(face, solid.uncertainty))
        .collect();
    let mut faces: Vec<Option<FaceMesh>> = vec![None; solid.faces.len()];
    let failed = |face: usize, reason: String| TessellateError::Face {
        solid: name.to_owned(),
        id: solid.faces[face].id,
        reason,
    };
    for round in 0..ROUNDS {
        let open: Vec<usize> = (0..faces.len()).filter(|&f| faces[f].is_none()).collect();
        if open.is_empty() {
            break;
        }
        let results: Vec<Result<FaceMesh, FaceIssue>> = open
            .par_iter()
            .map(|&f| {
                if observer.cancelled() {
                    return Err(FaceIssue::Failed(String::new()));
                }
                let outline =
                    trim::outline(solid, &solid.faces[f], &charts[f], &samples, &tolerance)?;
                fill::fill(&charts[f], &outline, solid, &samples, &tolerance)
            })
            .collect();
        observer.check()?;
        let mut more: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for (&f, result) in open.iter().zip(results) {
            match result {
                Ok(mesh) => faces[f] = Some(mesh),
                Err(FaceIssue::Split(splits)) if round + 1 < ROUNDS => {
                    for (edge, t) in splits {
                        more.entry(edge).or_default().push(t);
                    }
                }
                Err(FaceIssue::Split(_)) => {
                    return Err(failed(
                        f,
                        "its edges cross each other or come too close".to_owned(),
                    ));
                }
                Err(FaceIssue::TooFine) => return Err(too_fine()),
                Err(FaceIssue::Failed(reason)) => return Err(failed(f, reason)),
            }
        }
        let grown = cut_finer(solid, &mut samples, &more);
        if !more.is_empty() && !grown.contains(&true) {
            let f = faces.iter().position(Option::is_none).unwrap_or(0);
            return Err(failed(
                f,
                "its edges cross each other or come too close".to_owned(),
            ));
        }
        for (f, face) in solid.faces.iter().enumerate() {
            let touched = face.loops.iter().any(|l| match l {
                super::Loop::Edges(uses) => uses.iter().any(|u| grown[u.edge as usize]),
                super::Loop::Vertex(_) => false,
            });
            if touched {
                faces[f] = None;
            }
        }
    }
    let done: Option<Vec<FaceMesh>> = faces.into_iter().collect();
    match done {
        Some(faces) => Ok(Parts { samples, faces }),
        None => Err(failed(
            0,
            "its edges could not be cut finely enough".to_owned(),
        )),
    }
}

/// Cuts edges at more places; tells which of them have grown by it.
fn cut_finer(solid: &Solid, samples: &mut [Samples], more: &BTreeMap<u32, Vec<f64>>) -> Vec<bool> {
    let mut grown = vec![false; samples.len()];
    for (&edge, t) in more {
        let e = edge as usize;
        let finer = edges::split(solid, &solid.edges[e], &samples[e], t);
        if finer.t.len() > samples[e].t.len() {
            samples[e] = finer;
            grown[e] = true;
        }
    }
    grown
}

/// Joins the faces over shared vertices and turns shells that are inside out.
fn assemble(
    solid: &Solid,
    name: &str,
    parts: &Parts,
    tolerance: &Tolerance,
    reporter: &Reporter,
) -> Result<Mesh, TessellateError> {
    let mut vertices: Vec<DVec3> = solid.vertices.clone();
    let mut first_sample = Vec::with_capacity(parts.samples.len());
    for samples in &parts.samples {
        // sample i of an edge is vertex first + i - 1; its ends are the edge's vertices
        first_sample.push(vertices.len());
        let inner = samples.points.len().saturating_sub(1).max(1);
        vertices.extend_from_slice(samples.points.get(1..inner).unwrap_or_default());
    }
    let mut first_own = Vec::with_capacity(parts.faces.len());
    for face in &parts.faces {
        first_own.push(vertices.len());
        vertices.extend_from_slice(&face.own);
    }
    if u32::try_from(vertices.len()).is_err() {
        return Err(TessellateError::TooFine {
            solid: name.to_owned(),
            chord: tolerance.chord,
        });
    }
    let index = |face: usize, node: Node| match node {
        Node::Vertex(v) => v,
        Node::Sample { edge, index } => (first_sample[edge as usize] + index as usize - 1) as u32,
        Node::Own(own) => (first_own[face] + own as usize) as u32,
    };
    let mut triangles = Vec::new();
    for shell in &solid.shells {
        let start = triangles.len();
        let mut patches = Vec::new();
        for used in &shell.faces {
            let f = used.face as usize;
            let face = &parts.faces[f];
            let sense = used.sense.then(face.sense);
            let begin = triangles.len();
            for (t, corners) in face.triangles.iter().enumerate() {
                if face.folded.binary_search(&t).is_ok() {
                    continue;
                }
                let [a, b, c] = corners.map(|l| index(f, face.nodes[l as usize]));
                // triangles along a pole have two corners in one vertex
                if a == b || b == c || c == a {
                    continue;
                }
                triangles.push(match sense {
                    Sense::Forward => [a, b, c],
                    Sense::Reversed => [a, c, b],
                });
            }
            patches.push(begin..triangles.len());
        }
        separate(&mut vertices, &mut triangles, start, &patches);
        if shell.role == ShellRole::Open {
            continue;
        }
        let origin = solid.vertices.first().copied().unwrap_or_default();
        let volume: f64 = triangles[start..]
            .iter()
            .map(|t: &[u32; 3]| {
                let [a, b, c] = t.map(|v| vertices[v as usize] - origin);
                a.dot(b.cross(c))
            })
            .sum();
        let wrong = match shell.role {
            ShellRole::Outer => volume < 0.0,
            ShellRole::Void => volume > 0.0,
            ShellRole::Open => false,
        };
        if wrong {
            for t in &mut triangles[start..] {
                t.swap(1, 2);
            }
            reporter.warn(
                "brep-shell-turned",
                format!("a shell of `{name}` was inside out and has been turned"),
                "check the part's normals in the program that wrote the file",
            );
        }
    }
    Ok(compact(&vertices, triangles))
}

/// Halves inner sides of faces that join the same two vertices as a side of another face: each side
/// must belong to two triangles only. `patches` are the triangles of each face, from `start` on.
fn separate(
    vertices: &mut Vec<DVec3>,
    triangles: &mut Vec<[u32; 3]>,
    start: usize,
    patches: &[Range<usize>],
) {
    let undirected = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * (triangles.len() - start));
    for (t, &[a, b, c]) in triangles.iter().enumerate().skip(start) {
        for side in [undirected(a, b), undirected(b, c), undirected(c, a)] {
            sides.push((side, t as u32));
        }
    }
    sides.sort_unstable();
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        if run.len() <= 2 {
            continue;
        }
        // keep the sides of one face, or the boundaries of two, and halve the inner sides of the others
        let patch_of = |t: u32| patches.iter().position(|p| p.contains(&(t as usize)));
        let mut inner: Vec<[u32; 2]> = Vec::new();
        for pair in run.windows(2) {
            if patch_of(pair[0].1) == patch_of(pair[1].1) {
                inner.push([pair[0].1, pair[1].1]);
            }
        }
        let spare = usize::from(2 * inner.len() == run.len());
        for &[s, t] in inner.iter().skip(spare) {
            let [a, b] = run[0].0;
            let mid = vertices.len() as u32;
            vertices.push(0.5 * (vertices[a as usize] + vertices[b as usize]));
            for old in [s, t] {
                let corners = triangles[old as usize];
                let replaced = |from: u32| corners.map(|v| if v == from { mid } else { v });
                triangles[old as usize] = replaced(a);
                triangles.push(replaced(b));
            }
        }
    }
}

/// Drops vertices that no triangle uses.
fn compact(vertices: &[DVec3], mut triangles: Vec<[u32; 3]>) -> Mesh {
    let mut new = vec![u32::MAX; vertices.len()];
    for &v in triangles.iter().flatten() {
        new[v as usize] = 0;
    }
    let mut kept = Vec::new();
    for (old, slot) in new.iter_mut().enumerate() {
        if *slot == 0 {
            *slot = kept.len() as u32;
            kept.push(vertices[old]);
        }
    }
    for corner in triangles.iter_mut().flatten() {
        *corner = new[*corner as usize];
    }
    Mesh {
        vertices: kept,
        triangles,
    }
}
