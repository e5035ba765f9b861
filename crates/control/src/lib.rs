//! Linear systems for machine builders: transfer functions and state space with delays, frequency response, margins and norms,
//! sampled twins, H-infinity synthesis, reduction, test signals and spectra.
//!
//! Units are the caller's: seconds and rad/s for time and frequency, anything for signals. Each module names the source of its
//! theory. Nothing here knows what is controlled.

pub mod balanced;
pub mod delay;
pub mod discretise;
mod domain;
mod error;
pub mod export;
pub mod frequency;
pub mod h_infinity;
mod interconnect;
pub mod margins;
pub mod norms;
pub mod polynomial;
pub mod prbs;
pub mod quality;
pub mod riccati;
pub mod sections;
pub mod simplify;
pub mod simulate;
pub mod state_space;
pub mod transfer;
pub mod welch;
pub mod zero_pole;
pub mod zeros;

pub use domain::Domain;
pub use error::SystemError;
pub use meltpath_numerics::{Complex64, ComplexMatrix, Matrix};
pub use polynomial::Polynomial;
pub use state_space::StateSpace;
pub use transfer::TransferFunction;
pub use zero_pole::ZeroPoleGain;
