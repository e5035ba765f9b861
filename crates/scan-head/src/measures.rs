//! What is measured on a run: contour errors, how a hatch is filled, energy, delays of the laser.

pub mod contour_error;
pub mod dark_way;
pub mod delays;
pub mod energy;
pub mod fill_rate;
pub mod fill_share;
pub mod hatch;
pub mod histogram;
pub mod light;
pub mod marks_again;
pub mod outline;
pub mod segment;
pub mod stray_light;
pub mod strays;
mod sweep;
pub mod swept_surface;
