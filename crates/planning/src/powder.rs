//! Paths of a beam over powder: hatches, islands, spots, nested contours, and how much energy goes where. The beam comes in as
//! power, spot and speed, so that electron beams and lasers are planned alike.

mod error;
pub mod hatch;
pub mod modulation;
pub mod nested;
mod patterns;
pub mod plate;

pub use error::HatchError;
pub use hatch::{Hatch, Modulated, Pattern, Turns};
