//! A part that grows out of a body which is there already: both read, placed alike, with the body on z = 0.

use std::path::Path;

use meltpath_base::{Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::diagnosis::{Defect, DiagnosisOptions, diagnose};
use meltpath_geometry::math::{DAffine3, DVec3};

use super::part::{self, Part, PartError};
use super::sheet;
use crate::job::PartUnit;

/// A part and the body that it grows out of.
#[derive(Debug, Clone)]
pub struct Onto {
    /// As it is to be, or what is to be added alone.
    pub part: Part,
    /// As it is now.
    pub body: Part,
    /// The faces of the part that are its top, where they are named.
    pub top: Option<Mesh>,
    /// From the coordinates of both files.
    pub build_from_file: DAffine3,
}

/// How both files are read.
#[derive(Debug, Clone, Copy)]
pub struct How<'a> {
    /// Unit of files that carry none.
    pub unit: PartUnit,
    /// The direction of the files that points up.
    pub up: DVec3,
    /// Chord error of meshes made of faces, mm.
    pub chord_error: f64,
    /// Numbers of faces of the part, from 1, that are its top; nothing where none are named.
    pub top: Option<&'a [u32]>,
}

/// Reads, repairs and places a part and its body, which are in the same coordinates.
///
/// # Errors
/// [`PartError`], naming the file and what to do.
pub fn load(
    part: &Path,
    body: &Path,
    how: How<'_>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Onto, PartError> {
    let read = |path: &Path| -> Result<Part, PartError> {
        let read = part::read(path, how.unit, how.chord_error, reporter, observer)?;
        let found = diagnose(&read.mesh, &DiagnosisOptions::default(), observer)?;
        match found.count(Defect::Intersection) {
            0 => Ok(read),
            _ => Err(PartError::Overlap(path.to_path_buf())),
        }
    };
    let named = |faces| sheet::mesh_of(part, faces, how.chord_error, reporter, observer);
    let mut top = how.top.map(named).transpose()?;
    let (mut part, mut body) = (read(part)?, read(body)?);
    let build_from_file = part::place(&mut body.mesh, how.up);
    let placed = |mesh: &mut Mesh| {
        for v in &mut mesh.vertices {
            *v = build_from_file.transform_point3(*v);
        }
    };
    placed(&mut part.mesh);
    top.iter_mut().for_each(placed);
    Ok(Onto {
        part,
        body,
        top,
        build_from_file,
    })
}
