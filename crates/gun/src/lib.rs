//! The electron gun: what it is fed with for a power and a spot, how it follows a toolpath, what a machine can do and what it makes of
//! a path, and what its records say. Volts, amperes and coil currents end here: paths and heat know power (W) and spot (mm). Lengths
//! mm, times s.

pub mod demands;
pub mod drive;
pub mod focus;
pub mod focus_walls;
pub mod follow;
mod jumps;
pub mod machine;
pub mod record;
pub mod short;
pub mod stretch;
pub mod supply;

pub use machine::Machine;
pub use supply::Gun;
