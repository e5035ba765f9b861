//! Whether torch and arm stay clear of the metal as it has grown, of the table and of the arm itself along a held program.
//!
//! Bodies are capsules: a link from its joint to the next, the torch from the flange to its contact tube, the nozzle as rods around the
//! tube. Metal is columns from below up to their heights. Distances are exact; what may happen between two places is bounded by how far
//! a body goes between them, so that a told distance is never too great.

mod bodies;
mod clear;
mod distance;
mod metal;
mod sweep;

pub use bodies::Body;
pub use clear::{Clearance, Cleared, hold_clear};
pub use metal::Metal;
pub use sweep::{Closest, Surroundings, sweep};
