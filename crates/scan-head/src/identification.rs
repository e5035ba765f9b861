//! The motor behind a record: resistance, inductance, inertia, friction, modes.

mod abreast;
mod begins;
mod channels;
mod drive;
pub mod error;
mod estimate;
pub mod friction;
pub mod joint;
pub mod modes;
pub mod motor;
mod noise;
pub mod prediction;
pub mod ramps;
pub mod record;
mod refine;
pub mod refusal;
pub mod responses;
pub mod transfers;
mod triangles;
