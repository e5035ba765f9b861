//! The electron gun: what it is fed with for a power and a spot, how it follows a toolpath, and what its records say. Volts,
//! amperes and coil currents end here: paths and heat know power (W) and spot (mm). Lengths mm, times s.

pub mod drive;
pub mod focus;
pub mod record;
pub mod supply;

pub use supply::Gun;
