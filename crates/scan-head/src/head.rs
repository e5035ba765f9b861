//! The whole head: what it is asked to do, time interpolation, laser gate, and where the laser really goes.

mod ahead;
pub mod gate;
pub mod interpolation;
pub mod job;
pub mod motion;
pub mod scan_head;
