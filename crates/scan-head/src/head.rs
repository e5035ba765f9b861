//! The whole head: what it is asked to do, time interpolation, laser gate, and where the laser really goes.

mod ahead;
pub mod block;
pub mod error;
pub mod gate;
pub mod head_axis;
pub mod interpolation;
pub mod job;
pub mod motion;
pub mod power;
pub mod prepared;
pub mod ready;
pub mod recipe;
pub mod run;
pub mod scan_head;
pub mod survey;
pub mod vector;
pub mod window;
