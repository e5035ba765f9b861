//! The part: read from its file, examined, repaired where needed, turned and set down on the plate.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use meltpath_base::{Cancelled, Observer, Reporter};
use meltpath_geometry::Mesh;
use meltpath_geometry::math::{DQuat, DVec3};

use crate::job::PartUnit;

/// A part ready for planning.
#[derive(Debug, Clone)]
pub struct Part {
    /// Its name for people: the file's.
    pub name: String,
    /// Its surface, mm: build direction up, lowest point on z = 0.
    pub mesh: Mesh,
    /// Volume, mm³.
    pub volume: f64,
    /// What was found and repaired, in words.
    pub findings: Vec<String>,
}

/// Why a part cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PartError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The file cannot be opened.
    #[error("cannot open the part {}: {source}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file cannot be read as what it claims to be.
    #[error("cannot use the part {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What its reader said.
        reason: String,
    },
    /// No reader for the file.
    #[error("cannot read {}: meltpath reads STEP (.step, .stp), STL (.stl) and 3MF (.3mf); export the part as one of these", .0.display())]
    Format(PathBuf),
    /// Nothing solid in the file.
    #[error("the part {} has no volume{}", .path.display(), hint(.thin))]
    Empty {
        /// The file.
        path: PathBuf,
        /// Whether it has a surface all the same.
        thin: f64,
    },
    /// Far too large for the process.
    #[error("the part {} is {:.0} x {:.0} x {:.0} mm: wrong unit? An STL carries none: say `part_unit = \"mm\"`, \"cm\", \"m\" or \"in\"", .path.display(), .size.x, .size.y, .size.z)]
    Size {
        /// The file.
        path: PathBuf,
        /// Extents, mm.
        size: DVec3,
    },
}

fn hint(area: &f64) -> &'static str {
    if *area > 0.0 { ": its surface encloses nothing; export a solid, not a sheet" } else { "" }
}

/// Extents beyond these, mm, are a wrong unit and not a wire-arc part.
const SMALLEST: f64 = 1.0;
const LARGEST: f64 = 20_000.0;

/// Reads, examines, repairs and places the part.
///
/// `unit` applies to files that carry none; `up` is the direction of the file that points up; `chord_error` (mm) bounds the
/// mesh made of a B-rep.
///
/// # Errors
/// [`PartError`], naming the file and what to do.
pub fn load(
    path: &Path,
    unit: PartUnit,
    up: DVec3,
    chord_error: f64,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Part, PartError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let mut mesh = match extension.as_str() {
        "stl" => read_stl(path, unit, reporter, observer)?,
        "3mf" => read_3mf(path, reporter, observer)?,
        "step" | "stp" => read_step(path, chord_error, reporter, observer)?,
        _ => return Err(PartError::Format(path.to_path_buf())),
    };
    let findings = repair(&mut mesh, reporter, observer)?;
    place(&mut mesh, up);
    let size = mesh.bounds().map_or(DVec3::ZERO, |(lo, hi)| hi - lo);
    let volume = mesh.volume();
    if volume <= 0.0 || volume.is_nan() {
        return Err(PartError::Empty { path: path.to_path_buf(), thin: mesh.area() });
    }
    if size.max_element() > LARGEST || size.max_element() < SMALLEST {
        return Err(PartError::Size { path: path.to_path_buf(), size });
    }
    Ok(Part { name, mesh, volume, findings })
}
