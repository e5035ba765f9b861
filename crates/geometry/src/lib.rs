//! Shapes: meshes and B-reps in and out, planes, regions with holes, sections, offsets, and the
//! growing workpiece. Knows nothing of manufacturing. Lengths are millimetres, angles radians.

pub mod arc;
pub mod boolean;
mod bvh;
pub mod diagnosis;
pub mod io;
pub mod brep;
pub mod math;
pub mod mesh;
pub mod offset;
pub mod overhang;
pub mod plane;
pub mod pose;
pub mod raster;
pub mod region;
pub mod repair;
pub mod section;
pub mod shapes;
mod topology;
pub mod weld;
pub mod workpiece;
pub mod step;

pub use mesh::Mesh;
pub use plane::Plane;
pub use pose::Pose;
pub use region::{Region, Ring};
