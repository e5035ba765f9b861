//! The motor behind a record: resistance, inductance, inertia, friction, modes.

mod channels;
pub mod modes;
pub mod motor;
pub mod ramps;
