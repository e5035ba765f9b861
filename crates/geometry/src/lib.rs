//! Shapes: meshes and B-reps in and out, planes, regions with holes, sections, offsets, and the
//! growing workpiece. Knows nothing of manufacturing. Lengths are millimetres, angles radians.

pub mod arc;
pub mod brep;
pub mod math;
pub mod mesh;
pub mod plane;
pub mod region;
pub mod step;

pub use mesh::Mesh;
pub use plane::Plane;
pub use region::{Region, Ring};
