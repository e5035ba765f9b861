//! Parts that grow out of a body which is there already, one after the other: all read, placed alike, with the body on z = 0.

use std::path::Path;

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::diagnosis::{Defect, DiagnosisOptions, diagnose};
use meltpath_geometry::math::{DAffine3, DVec3};

use super::part::{self, Part, PartError};
use super::sheet;
use crate::job::PartUnit;

/// Parts and the body that they grow out of.
#[derive(Debug, Clone)]
pub struct Onto {
    /// As they are to be, or what is to be added alone, in the order in which they are built.
    pub parts: Vec<Part>,
    /// As it is now.
    pub body: Part,
    /// The faces of the first part that are its top, where they are named.
    pub top: Option<Mesh>,
    /// From the coordinates of the files.
    pub build_from_file: DAffine3,
}

impl Onto {
    /// The names of the parts.
    pub fn name(&self) -> String {
        let names: Vec<&str> = self.parts.iter().map(|p| p.name.as_str()).collect();
        names.join(", ")
    }

    /// The parts as one mesh, in which they may reach into each other.
    pub fn whole(&self) -> Mesh {
        let mut whole = Mesh::default();
        for Part { mesh, .. } in &self.parts {
            whole.add(mesh);
        }
        whole
    }

    /// What was found in the files, in words; of several parts with their names.
    pub fn findings(&self) -> Vec<String> {
        let of = |part: &Part| -> Vec<String> {
            let named = |f: &String| match self.parts.len() {
                1 => f.clone(),
                _ => format!("{}: {f}", part.name),
            };
            part.findings.iter().map(named).collect()
        };
        let body = self.body.findings.iter().map(|f| format!("body: {f}"));
        self.parts.iter().flat_map(of).chain(body).collect()
    }
}

/// How the files are read.
#[derive(Debug, Clone, Copy)]
pub struct How<'a> {
    /// Unit of files that carry none.
    pub unit: PartUnit,
    /// The direction of the files that points up.
    pub up: DVec3,
    /// Chord error of meshes made of faces, mm.
    pub chord_error: f64,
    /// Numbers of faces of the first part, from 1, that are its top; nothing where none are named.
    pub top: Option<&'a [u32]>,
}

/// Reads, repairs and places parts and their body, which are in the same coordinates.
///
/// # Errors
/// [`PartError`], naming the file and what to do.
pub fn load(
    parts: &[&Path],
    body: &Path,
    how: How<'_>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Onto, PartError> {
    let read = |path: &Path| -> Result<Part, PartError> {
        let read = part::read(path, how.unit, how.chord_error, reporter, observer)?;
        let found = diagnose(&read.mesh, &DiagnosisOptions::default(), observer)?;
        let path = || path.to_path_buf();
        match (
            found.count(Defect::Intersection),
            found.count(Defect::LooseEdge),
        ) {
            (0, 0) => Ok(read),
            (0, edges) => Err(PartError::NotClosed(path(), edges)),
            _ => Err(PartError::Overlap(path())),
        }
    };
    let named = |(faces, part): (&[u32], &&Path)| {
        sheet::mesh_of(part, faces, how.chord_error, reporter, observer)
    };
    let mut top = how.top.zip(parts.first()).map(named).transpose()?;
    let mut all = Vec::with_capacity(parts.len());
    for part in parts {
        all.push(read(part)?);
    }
    let mut body = read(body)?;
    let build_from_file = part::place(&mut body.mesh, how.up);
    let placed = |mesh: &mut Mesh| {
        for v in &mut mesh.vertices {
            *v = build_from_file.transform_point3(*v);
        }
    };
    let meshes = all.iter_mut().map(|part| &mut part.mesh);
    for mesh in meshes.chain(&mut top) {
        placed(mesh);
    }
    Ok(Onto {
        parts: all,
        body,
        top,
        build_from_file,
    })
}
