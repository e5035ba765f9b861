//! Design of the angle control: models in frequency, synthesis, H-infinity, robust search, refinement in simulation, and what a drive reads.

pub mod compare;
pub mod file;
pub mod h_infinity;
pub mod model;
pub mod preview;
pub mod refine;
pub mod robust;
pub mod sampled;
pub mod synthesis;
