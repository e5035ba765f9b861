//! Meshes in and out: STL and 3MF, told apart by the file's extension.

pub mod stl;
pub mod threemf;

use std::{
    fs::File,
    io::{self, BufRead, BufReader, Seek},
    path::Path,
};

use meltpath_base::{Observer, Reporter};
use thiserror::Error;

use crate::Mesh;
use crate::math::DVec3;
use crate::mesh::NamedMesh;
use stl::{StlError, read_stl};
use threemf::{ThreeMfError, read_3mf};

/// Extents below this are suspected to be metres or inches, mm.
const SMALLEST_USUAL: f64 = 1.0;
/// Extents above this are suspected to be micrometres, mm.
const LARGEST_USUAL: f64 = 10_000.0;

/// Mesh formats that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// STL, binary or text.
    Stl,
    /// 3MF.
    ThreeMf,
}

impl MeshFormat {
    /// The format that a file name extension stands for, without the dot, in any case.
    fn from_extension(extension: &str) -> Option<Self> {
        if extension.eq_ignore_ascii_case("stl") {
            Some(MeshFormat::Stl)
        } else if extension.eq_ignore_ascii_case("3mf") {
            Some(MeshFormat::ThreeMf)
        } else {
            None
        }
    }
}

/// Why a mesh file could not be read.
#[derive(Debug, Error)]
pub enum ReadMeshError {
    /// The file could not be opened.
    #[error("cannot open `{path}`: {source}")]
    Open {
        /// The path as given.
        path: String,
        /// What the system says.
        source: io::Error,
    },
    /// The extension is not that of a mesh format.
    #[error(
        "`{path}`: the extension `{extension}` is not a mesh format that can be read (stl, 3mf)"
    )]
    Extension {
        /// The path as given.
        path: String,
        /// Its extension.
        extension: String,
    },
    /// The STL is not sound.
    #[error(transparent)]
    Stl(#[from] StlError),
    /// The 3MF is not sound.
    #[error(transparent)]
    ThreeMf(#[from] ThreeMfError),
}

/// Reads the meshes of a file, by its extension.
///
/// An STL gives one mesh, taken as millimetres (with the warning `part-unit-suspect` when its size is
/// unlikely); a 3MF gives one per build item, in millimetres by its own unit.
///
/// # Errors
/// See [`ReadMeshError`].
pub fn read_mesh(
    path: &Path,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<NamedMesh>, ReadMeshError> {
    let shown = path.display().to_string();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let Some(format) = MeshFormat::from_extension(&extension) else {
        return Err(ReadMeshError::Extension {
            path: shown,
            extension: extension.into_owned(),
        });
    };
    let opened = File::open(path).and_then(|file| {
        let length = file.metadata()?.len();
        Ok((file, length))
    });
    let (file, length) = opened.map_err(|source| ReadMeshError::Open {
        path: shown,
        source,
    })?;
    read_format(
        BufReader::new(file),
        format,
        Some(length),
        reporter,
        observer,
    )
}

fn read_format(
    reader: impl BufRead + Seek,
    format: MeshFormat,
    length: Option<u64>,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<NamedMesh>, ReadMeshError> {
    match format {
        MeshFormat::Stl => {
            let stl = read_stl(reader, length, reporter, observer)?;
            suspect_unit(&stl.mesh, reporter);
            Ok(vec![NamedMesh {
                name: stl.name,
                mesh: stl.mesh,
            }])
        }
        MeshFormat::ThreeMf => Ok(read_3mf(reader, reporter, observer)?),
    }
}

/// Warns when a file without a unit has an unlikely size in millimetres.
fn suspect_unit(mesh: &Mesh, reporter: &Reporter) {
    let Some((lo, hi)) = mesh.bounds() else {
        return;
    };
    let size: DVec3 = hi - lo;
    let extent = size.max_element();
    let guess = if extent < SMALLEST_USUAL {
        "metres or inches (`part_unit = \"m\"` or `\"in\"`)"
    } else if extent > LARGEST_USUAL {
        "micrometres (`part_unit = \"um\"`)"
    } else {
        return;
    };
    reporter.warn(
        "part-unit-suspect",
        format!(
            "the part is {} x {} x {} mm if its STL is in millimetres: STL files carry no unit",
            size.x, size.y, size.z
        ),
        format!("say `part_unit` in the job if it is in {guess}"),
    );
}
