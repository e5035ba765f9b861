//! Directions of the torch from a person's file, in the build.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use meltpath_geometry::math::{DAffine3, DVec3};
use meltpath_perception::table::csv;
use meltpath_planning::surface::Field;

/// How far a place of the file counts, widths of the bead: a torch that turns by some degrees over one has places enough.
const REACH: f64 = 4.0;

/// Why a file holds no directions.
#[derive(Debug, thiserror::Error)]
pub enum DirectionsError {
    /// It cannot be opened.
    #[error("cannot read {} (surface.field): {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is no table of directions.
    #[error("{} (surface.field): {what}; each line is x, y, z in mm and the three components of a direction", .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// The directions of a file, turned as the part is.
///
/// # Errors
/// [`DirectionsError`].
pub(super) fn directions(
    path: &Path,
    build_from_file: &DAffine3,
    width: f64,
) -> Result<Arc<Field>, DirectionsError> {
    let text = std::fs::read_to_string(path).map_err(|source| DirectionsError::Io {
        path: path.to_owned(),
        source,
    })?;
    let bad = |what: String| DirectionsError::Table {
        path: path.to_owned(),
        what,
    };
    let table = csv(&text).map_err(bad)?;
    let [x, y, z, u, v, w] = &table.columns[..] else {
        return Err(bad(format!("it has {} columns", table.columns.len())));
    };
    let mut places = Vec::with_capacity(x.1.len());
    for i in 0..x.1.len() {
        let of = |columns: [&(String, Vec<f64>); 3]| {
            DVec3::from_array(columns.map(|c| c.1.get(i).copied().unwrap_or(f64::NAN)))
        };
        let (at, direction) = (of([x, y, z]), of([u, v, w]));
        if !at.is_finite() || direction.try_normalize().is_none() {
            return Err(bad(format!(
                "place {} has no direction: its numbers are not finite, or the direction is zero",
                i + 1
            )));
        }
        places.push([
            build_from_file.transform_point3(at),
            build_from_file.transform_vector3(direction),
        ]);
    }
    if places.is_empty() {
        return Err(bad("it has no place".to_owned()));
    }
    Ok(Arc::new(Field::new(places, REACH * width)))
}
