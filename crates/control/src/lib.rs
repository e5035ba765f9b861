//! Linear systems for machine builders: transfer functions and state space with delays, frequency response, margins and norms,
//! sampled twins, H-infinity synthesis, reduction, test signals, spectra, fits and swarm optimisation.
//!
//! Units are the caller's: seconds and rad/s for time and frequency, anything for signals. Each module names the source of its
//! theory. Nothing here knows what is controlled.

pub mod balanced;
pub mod delay;
pub mod dense;
pub mod discretise;
mod error;
pub mod export;
pub mod fit;
pub mod frequency;
pub mod hinf;
mod interconnect;
pub mod margins;
pub mod matrix;
pub mod moving_average;
pub mod norms;
pub mod polynomial;
pub mod prbs;
pub mod random;
pub mod riccati;
pub mod sections;
pub mod simplify;
pub mod simulate;
pub mod state_space;
pub mod swarm;
pub mod transfer;
pub mod welch;
pub mod zero_pole;
pub mod zeros;

pub use error::SystemError;
pub use matrix::{ComplexMatrix, Matrix};
pub use num_complex::Complex64;
pub use polynomial::Polynomial;
pub use state_space::{Domain, StateSpace};
pub use transfer::TransferFunction;
pub use zero_pole::ZeroPoleGain;
