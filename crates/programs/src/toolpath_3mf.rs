//! Toolpaths in 3MF packages, read and written layer by layer: paths of a torch in space, and of a beam in planes.
//!
//! Source: 3MF Toolpath Extension 1.0, release candidate (3MF Consortium, BSD-2-Clause), namespace of March 2026. Such a package holds what
//! is laid or marked and with what, never the ways between: who executes it chooses them.
//!
//! **Frames.** Positions are those of the part as it lies in the build, z up; files that are written here count beads in micrometres and marks of a beam in
//! tenths of one. The
//! quaternion of a point turns the build's axes into those of the tool. Its z points from the work to the tool, as [`Pass::axis`] does, so that a
//! torch that points straight down has the identity; z of the torch frames of controllers points the other way. What the rotation leaves about z is
//! [`Pass::turn`].
//!
//! [`Pass::axis`]: meltpath_toolpath::Pass::axis
//! [`Pass::turn`]: meltpath_toolpath::Pass::turn

mod error;
mod frame;
mod identity;
mod layer;
mod profile;
mod read;
mod resource;
mod segment;
mod walk;
mod words;
mod write;
mod xml;

pub use error::{ToolpathFileError, ToolpathFileWriteError};
pub use read::{Found, Reader, SpatialPath, read_spatial};
pub use words::{EXTENSION, Kind, NAMESPACE, VERSION};
pub use write::{Beam, PlanarWriter, write_spatial};
