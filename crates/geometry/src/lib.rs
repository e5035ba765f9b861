//! Shapes: meshes and B-reps in and out, planes, regions with holes, sections, offsets, and the
//! growing workpiece. Knows nothing of manufacturing. Lengths are millimetres, angles radians.

pub mod arc;
pub mod boolean;
pub mod fit;
pub mod math;
pub mod medial;
pub mod mesh;
pub mod offset;
pub mod plane;
pub mod raster;
pub mod region;
pub mod workpiece;

pub use mesh::Mesh;
pub use plane::Plane;
pub use region::{Region, Ring};
