//! Shapes: meshes and B-reps in and out, planes, regions with holes, sections, offsets, and the
//! growing workpiece. Knows nothing of manufacturing. Lengths are millimetres, angles radians.

pub mod arc;
pub mod boolean;
pub mod brep;
mod bvh;
pub mod cover;
pub mod diagnosis;
pub mod distance;
pub mod fit;
pub mod flatten;
pub mod io;
pub mod level;
pub mod math;
pub mod medial;
pub mod mesh;
pub mod offset;
pub mod overhang;
pub mod plane;
pub mod pose;
pub mod raster;
pub mod region;
pub mod repair;
pub mod section;
pub mod segments;
pub mod shapes;
pub mod sheet;
pub mod sight;
pub mod step;
mod topology;
pub mod union;
pub mod weld;
pub mod workpiece;

pub use mesh::Mesh;
pub use plane::Plane;
pub use pose::Pose;
pub use region::{Region, Ring};
