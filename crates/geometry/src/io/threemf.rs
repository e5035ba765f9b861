//! 3MF core specification 1.3, in and out (3MF Consortium, BSD): a zip package with an XML model of meshes.
//!
//! The production extension's paths to other model parts are followed; materials and triangle sets do not change
//! shapes and are ignored; any other extension that a file requires is refused by name.

mod build;
mod element;
mod error;
mod limited;
mod limits;
mod model;
mod package;
mod volumes;
mod write;

use std::io::{Read, Seek};

use meltpath_base::{Observer, Reporter};

use crate::mesh::NamedMesh;
use build::instantiate;
pub use element::{CORE, PRODUCTION, unit_in_mm};
pub use error::ThreeMfError;
pub use limited::{Limited, unread};
pub use limits::{MAX_DEPTH, MAX_INSTANCES, MAX_RATIO, MAX_TRIANGLES, MAX_UNPACKED, RATIO_FREE};
pub use package::{Package, Relation};
pub use write::{MODEL_PART, PackageWriter, write_3mf, write_object};

/// Reads every build item of a 3MF package as one mesh in millimetres, components and transforms applied.
///
/// Warns where a build item is support, not part (`3mf-support-skipped`), or not to be printed (`3mf-unprintable-skipped`), where an object also
/// carries ready-made slices (`3mf-slices-ignored`), and where a slicer's modifiers lie in it (`3mf-modifier-skipped`). Vertices are kept as the file shares them.
///
/// # Errors
/// See [`ThreeMfError`]: damaged or encrypted packages, required extensions that are not supported, XML or
/// index errors with their byte position, missing or self-containing objects, volumes that a slicer cuts out of a part, zip bombs.
pub fn read_3mf(
    reader: impl Read + Seek,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<NamedMesh>, ThreeMfError> {
    let mut package = Package::open(reader)?;
    let start = package.start_part()?;
    observer.stage("read part", 0);
    let mut models = std::collections::BTreeMap::new();
    let mut wanted = vec![start.clone()];
    while let Some(part) = wanted.pop() {
        if models.contains_key(&part) {
            continue;
        }
        let model = package.model(&part, observer)?;
        wanted.extend(model.paths());
        models.insert(part, model);
    }
    if let Some(model) = models.get_mut(&start) {
        volumes::leave_out(&mut package, model, reporter)?;
    }
    instantiate(&models, &start, reporter)
}
