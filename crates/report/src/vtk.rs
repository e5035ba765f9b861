//! Files for ParaView: lines (`.vtp`), height maps and volumes (`.vti`), and collections over layers (`.pvd`).
//!
//! XML with raw appended binary, little-endian, 64-bit headers, uncompressed.
//! Source: VTK file formats, <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

mod appended;
mod collection;
mod image;
mod polydata;

pub use appended::Values;
pub use collection::write_collection;
pub use image::{Field, Volume, write_height_image, write_volume};
pub use polydata::write_lines;

/// Why a ParaView file could not be written.
#[derive(Debug, thiserror::Error)]
pub enum VtkError {
    /// The item makes no sense.
    #[error(transparent)]
    Scene(#[from] crate::scene::SceneError),
    /// The system refused.
    #[error("cannot write the ParaView file: {0}")]
    Io(#[from] std::io::Error),
}
