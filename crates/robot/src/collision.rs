//! Whether torch and arm stay clear of the metal as it has grown, of the table and of the arm itself along a held program.
//!
//! Bodies are round bars: a link from its joint to the next and the torch from the flange to its contact tube with round ends, nozzle and
//! flange with flat ones. Metal that is laid from above is columns from the plate up to their heights; metal that is laid from any side is
//! rods along its beads, on closed meshes. Distances at a place are exact. Between two places they are bounded by how far
//! bodies go, and where that bound is less than wanted the way is looked at more finely: a told distance is never too great, and one that
//! is too little is so.

mod bodies;
mod clear;
mod distance;
mod form;
mod metal;
pub(crate) mod motion;
mod pairs;
mod passage;
mod rooms;
mod round;
mod solids;
mod surroundings;
mod sweep;

pub use bodies::Body;
pub use clear::{Clearance, Cleared, hold_clear, is_nearest_on, room, room_over};
pub use metal::Metal;
pub use pairs::Pairs;
pub use solids::{Rod, Solids};
pub use surroundings::Surroundings;
pub use sweep::{Closest, sweep};
