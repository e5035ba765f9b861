//! The common language between rooms: passes with their profiles, toolpaths that order them, and motion in blocks.
//! Lengths are millimetres in the part frame, speeds mm/s, times s, angles rad.

pub mod error;
pub mod motion;
pub mod pass;
pub mod storage;
pub mod toolpath;

pub use error::PathError;
pub use motion::{MotionBlock, MotionSink, Times};
pub use pass::{Channels, Move, Neighbour, Pass, PassId, Role, Side, Tag};
pub use toolpath::{Profile, Toolpath};
