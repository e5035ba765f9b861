//! Where a robot's joints put its flange, and which joint values put the flange where it shall be.
//! Lengths are mm, angles rad; poses are those of the flange in the robot's base.

mod angles;
pub mod arm;
pub mod batch;
pub mod chain;
pub mod configuration;
mod lanes;
pub mod nearness;
pub mod numeric;
pub mod offset_wrist;
pub mod ortho_parallel;
mod planar;
pub mod reach;
pub mod solution;

pub use arm::{Arm, Geometry, Inverse};
pub use batch::{Batch, Poses, Ways};
pub use chain::{Chain, Joint, JointKind, Limits};
pub use configuration::Configuration;
pub use nearness::Nearness;
pub use offset_wrist::OffsetWrist;
pub use ortho_parallel::OrthoParallel;
pub use reach::Reach;
pub use solution::{Singularities, Solution, Unreachable};
