//! Packages with a toolpath, written: profiles and layers, and the part that they build.

mod package;
mod planar;
mod spatial;

pub use planar::{Beam, PlanarWriter};
pub use spatial::write_spatial;
