//! Meshes in and out: STL and 3MF, by the file's extension.

pub mod stl;
