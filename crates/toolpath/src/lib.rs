//! The common language between rooms: toolpaths of layers and passes with their profiles, and motion in blocks.
//! Lengths are millimetres in the part frame, speeds mm/s, times s, angles rad.

mod column;
mod divide;
pub mod error;
pub mod layer;
mod merge;
pub mod motion;
pub mod pass;
mod rename;
mod sanity;
pub mod storage;
pub mod toolpath;
pub mod vocabulary;

pub use error::PathError;
pub use layer::{Layer, PassWriter};
pub use motion::{MotionBlock, MotionSink, Times};
pub use pass::{Pass, PassPlace};
pub use toolpath::{Profile, Toolpath};
pub use vocabulary::{
    Channel, Event, Move, Neighbour, PassHead, PassId, Role, Side, Weave, WeaveShape,
};
