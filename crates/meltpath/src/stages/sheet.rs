//! The surface that a wall is built on: faces of a STEP file, or the open mesh of any part file, turned and set down on the plate.

use std::path::Path;
use std::sync::Arc;

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::brep::surface::Surface;
use meltpath_geometry::brep::{BrepModel, Face, Loop, PlacedSolid, Solid, Tolerance, tessellate};
use meltpath_geometry::diagnosis::{Defect, DiagnosisOptions, diagnose};
use meltpath_geometry::math::{DAffine3, DVec2, DVec3};
use meltpath_geometry::repair::{RepairOptions, repair};

use super::part::{self, PartError};
use crate::job::PartUnit;

/// A surface ready for planning.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// Its name for people: the file's.
    pub name: String,
    /// Its triangles, mm: build direction up, lowest point on z = 0.
    pub mesh: Mesh,
    /// The surface itself, where it is one face between lines of its parameters.
    pub exact: Option<Rectangle>,
    /// From the coordinates of the file.
    pub build_from_file: DAffine3,
    /// What was found and repaired, in words.
    pub findings: Vec<String>,
}

/// A piece of a surface between two values of each of its parameters.
#[derive(Debug, Clone)]
pub struct Rectangle {
    /// The surface, in its own frame.
    pub surface: Arc<Surface>,
    /// Ranges of u and v; one that closes covers a whole period.
    pub ranges: [[f64; 2]; 2],
    /// Whether u and v close.
    pub closed: [bool; 2],
    /// From the frame of the surface.
    pub build_from_surface: DAffine3,
}

/// What is read as a surface.
#[derive(Debug, Clone, Copy)]
pub struct How<'a> {
    /// Unit of files that carry none.
    pub unit: PartUnit,
    /// The direction of the file that points up.
    pub up: DVec3,
    /// Chord error of the mesh made of faces, mm.
    pub chord_error: f64,
    /// Numbers of faces, from 1; nothing for the whole file.
    pub faces: Option<&'a [u32]>,
}

/// Reads, repairs and places a surface. Holes stay: passes go around them.
///
/// # Errors
/// [`PartError`], naming the file and what to do.
pub fn load(
    path: &Path,
    how: How<'_>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Sheet, PartError> {
    let (mut mesh, face) = if part::is_step(path) {
        let model = part::step_model(path, reporter, observer)?;
        let model = match how.faces {
            Some(faces) => chosen(&model, faces, path)?,
            None => model,
        };
        let mesh = part::meshed(&model, how.chord_error, path, reporter, observer)?;
        (mesh, single_face(&model))
    } else if how.faces.is_some() {
        return Err(PartError::NoFaces {
            path: path.to_path_buf(),
            remedy: "leave surface.faces out",
        });
    } else {
        (
            part::read_triangles(path, how.unit, reporter, observer)?,
            None,
        )
    };
    let keep_holes = RepairOptions {
        hole: 0.0,
        stray: 0.0,
        ..RepairOptions::default()
    };
    let actions = repair(&mut mesh, &keep_holes, reporter, observer)?;
    let diagnosis = diagnose(&mesh, &DiagnosisOptions::default(), observer)?;
    if mesh.triangles.is_empty() {
        return Err(PartError::NoSurface(path.to_path_buf()));
    }
    if diagnosis.count(Defect::LooseEdge) == 0 {
        return Err(PartError::Closed(path.to_path_buf()));
    }
    let area = mesh.area();
    let build_from_file = part::place(&mut mesh, how.up);
    part::check_size(&mesh, path)?;
    let mut findings = vec![format!(
        "surface of {} triangles, area {area:.1} mm²",
        mesh.triangles.len()
    )];
    findings.extend(actions.iter().map(|a| format!("repaired: {a}")));
    let exact = face.and_then(|(solid, face, file_from_surface)| {
        let mut found = rectangle(&solid, &face, area)?;
        found.build_from_surface = build_from_file * file_from_surface;
        Some(found)
    });
    Ok(Sheet {
        name: part::name_of(path),
        mesh,
        exact,
        build_from_file,
        findings,
    })
}

/// The mesh of faces with these numbers, in the coordinates of the file.
///
/// # Errors
/// [`PartError`] where the file has none such.
pub(super) fn mesh_of(
    path: &Path,
    faces: &[u32],
    chord_error: f64,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Mesh, PartError> {
    if !part::is_step(path) {
        return Err(PartError::NoFaces {
            path: path.to_path_buf(),
            remedy: "write onto.top = \"auto\"",
        });
    }
    let model = part::step_model(path, reporter, observer)?;
    let model = chosen(&model, faces, path)?;
    part::meshed(&model, chord_error, path, reporter, observer)
}

/// The faces with these numbers alone.
fn chosen(model: &BrepModel, faces: &[u32], path: &Path) -> Result<BrepModel, PartError> {
    let counts = model.solids.iter().map(|s| s.solid.faces.len() as u32);
    let count = counts.clone().sum();
    let missing = |number: &&u32| **number == 0 || **number > count;
    if let Some(&number) = faces.iter().find(missing) {
        return Err(PartError::NoFace {
            path: path.to_path_buf(),
            number,
            count,
        });
    }
    let mut solids = Vec::new();
    let mut before = 0;
    for (placed, count) in model.solids.iter().zip(counts) {
        let own: Vec<u32> = faces
            .iter()
            .filter(|&&n| n > before && n <= before + count)
            .map(|n| n - before - 1)
            .collect();
        before += count;
        let piece = placed.solid.piece(&own).filter(|p| !p.faces.is_empty());
        solids.extend(piece.map(|piece| PlacedSolid {
            solid: Arc::new(piece),
            ..placed.clone()
        }));
    }
    Ok(BrepModel { solids })
}

/// The only face of a model, with its solid and its pose in the file.
fn single_face(model: &BrepModel) -> Option<(Arc<Solid>, Face, DAffine3)> {
    let [placed] = &model.solids[..] else {
        return None;
    };
    let [face] = &placed.solid.faces[..] else {
        return None;
    };
    Some((placed.solid.clone(), face.clone(), placed.part_from_solid))
}

/// Places of an edge that are looked at.
const PLACES: u32 = 32;
/// Share by which the area of a mesh may differ from that of its surface.
const SAME_AREA: f64 = 0.01;

/// The ranges of a face that lies between lines of its parameters, `area` mm² large: nothing where it is trimmed otherwise.
fn rectangle(solid: &Solid, face: &Face, area: f64) -> Option<Rectangle> {
    let surface = &face.surface;
    let periods = surface.periods(solid.uncertainty.max(1e-9));
    // the longest edge along each parameter, as the parameters run through it
    let mut longest: [Option<[f64; 2]>; 2] = [None; 2];
    let uses = face.loops.iter().flat_map(|l| match l {
        Loop::Edges(uses) => uses.as_slice(),
        Loop::Vertex(_) => &[],
    });
    for used in uses {
        let edge = solid.edges.get(used.edge as usize)?;
        let mut here: Option<DVec2> = None;
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for i in 0..=PLACES {
            let p = edge.at(f64::from(i) / f64::from(PLACES));
            let mut uv = surface.locate(p, here, solid.uncertainty.max(1e-6));
            for k in 0..2 {
                if let (Some(before), Some(period)) = (here, periods[k]) {
                    uv[k] += ((before[k] - uv[k]) / period).round() * period;
                }
            }
            here = Some(uv);
            (low, high) = (low.min(uv), high.max(uv));
        }
        let range = high - low;
        // as lengths: parameters may be anything
        let [_, du, dv] = surface.tangents(0.5 * (low + high));
        let length = DVec2::new(range.x * du.length(), range.y * dv.length());
        let along = usize::from(length.y > length.x);
        if length[1 - along] > 1e-3 * length[along] {
            return None;
        }
        if longest[along].is_none_or(|[a, b]| range[along] > b - a) {
            longest[along] = Some([low[along], high[along]]);
        }
    }
    // an edge may be half of a closed line: the area tells
    let whole = |k: usize| periods[k].map(|p| [longest[k].map_or(0.0, |r| r[0]), p]);
    let options = |k: usize| {
        let of_edge = longest[k].map(|r| (r, periods[k].is_some_and(|p| r[1] - r[0] > 0.999 * p)));
        let of_period = whole(k).map(|[from, p]| ([from, from + p], true));
        of_edge.into_iter().chain(of_period)
    };
    for (u, u_closed) in options(0) {
        for (v, v_closed) in options(1) {
            let own = area_of(surface, [u, v]);
            if (own - area).abs() <= SAME_AREA * area {
                return Some(Rectangle {
                    surface: surface.clone(),
                    ranges: [u, v],
                    closed: [u_closed, v_closed],
                    build_from_surface: DAffine3::IDENTITY,
                });
            }
        }
    }
    None
}

/// The area between lines of parameters, mm².
fn area_of(surface: &Surface, [u, v]: [[f64; 2]; 2]) -> f64 {
    const STEPS: u32 = 48;
    let at =
        |[from, to]: [f64; 2], i: u32| from + (to - from) * (f64::from(i) + 0.5) / f64::from(STEPS);
    let mut sum = 0.0;
    for i in 0..STEPS {
        for k in 0..STEPS {
            let [_, du, dv] = surface.tangents(DVec2::new(at(u, i), at(v, k)));
            sum += du.cross(dv).length();
        }
    }
    sum * ((u[1] - u[0]) * (v[1] - v[0])).abs() / f64::from(STEPS * STEPS)
}

/// The faces of a STEP file in words, by the numbers that jobs call them.
///
/// # Errors
/// [`PartError`] where the file cannot be read.
pub fn faces(
    path: &Path,
    chord_error: f64,
    observer: &dyn Observer,
) -> Result<Vec<String>, PartError> {
    let quiet = Reporter::new();
    let model = part::step_model(path, &quiet, observer)?;
    let tolerance = Tolerance {
        chord: chord_error,
        ..Tolerance::default()
    };
    let all = model.solids.iter().flat_map(|placed| {
        let count = placed.solid.faces.len() as u32;
        (0..count).map(move |face| (placed, face))
    });
    let mut lines = Vec::new();
    for (number, (placed, face)) in (1..).zip(all) {
        observer.check()?;
        let kind = placed.solid.faces[face as usize].surface.words();
        let piece = placed.solid.piece(&[face]).unwrap_or_default();
        let one = BrepModel {
            solids: vec![PlacedSolid {
                solid: Arc::new(piece),
                ..placed.clone()
            }],
        };
        let mesh = tessellate(&one, &tolerance, &quiet, observer).unwrap_or_default();
        let (low, high) = mesh.bounds().unwrap_or((DVec3::ZERO, DVec3::ZERO));
        lines.push(format!(
            "face {number}: {kind}, {:.1} mm², from ({:.1}, {:.1}, {:.1}) to ({:.1}, {:.1}, {:.1}) mm",
            mesh.area(), low.x, low.y, low.z, high.x, high.y, high.z
        ));
    }
    Ok(lines)
}
