//! The motor behind a record: resistance, inductance, inertia, friction, modes.

mod channels;
pub mod error;
pub mod friction;
pub mod modes;
pub mod motor;
pub mod prediction;
pub mod ramps;
pub mod record;
pub mod refusal;
pub mod responses;
pub mod transfers;
