//! How much of a 3MF package is accepted.

/// Unpacked bytes accepted in one part of a package.
pub const MAX_UNPACKED: u64 = 4 << 30;
/// Packing ratio accepted beyond [`RATIO_FREE`] bytes: meshes pack 5 to 40 times.
pub const MAX_RATIO: u64 = 200;
/// Unpacked bytes below which the ratio does not matter.
pub const RATIO_FREE: u64 = 64 << 20;
/// Triangles accepted after all components are placed.
pub const MAX_TRIANGLES: u64 = 100_000_000;
/// Placed components accepted.
pub const MAX_INSTANCES: u64 = 1_000_000;
/// Depth of components within components accepted.
pub const MAX_DEPTH: usize = 64;
