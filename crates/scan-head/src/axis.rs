//! One axis of the head: motor, friction, pre-filter, angle control, and all of them together sample by sample.

pub mod chain;
pub mod control;
pub mod error;
pub mod friction;
pub mod galvanometer;
pub mod plant;
pub mod prefilter;
pub mod servo;
