//! H-infinity synthesis: the controller that keeps the largest gain from disturbances to errors under a bound, the smallest
//! bound for which one exists, and the reason when none does.
//!
//! General two-Riccati solution with direct terms: K. Glover, J. C. Doyle, Systems & Control Letters 11 (1988) 167–172;
//! K. Zhou, J. C. Doyle, K. Glover, "Robust and Optimal Control", chapters 16–17; as written out in Rasoanarivo 2020,
//! chapter 3. Every result is verified on the closed loop it makes, with its true peak.
//!
//! ```
//! use meltpath_control::h_infinity::{MixedSensitivity, SynthesisOptions, Template, synthesise};
//! use meltpath_control::TransferFunction;
//!
//! // position a motor: 10/(s(s + 5)); follow up to 3 rad/s, little command beyond 300 rad/s
//! let motor = TransferFunction::new([10.0], [1.0, 5.0, 0.0]).unwrap().to_state_space().unwrap();
//! let plant = MixedSensitivity::new(motor)
//!     .sensitivity(Template::new(0.001, 1.5, 3.0).unwrap())
//!     .command(Template::new(50.0, 0.1, 300.0).unwrap())
//!     .disturbance(Template::new(5.0, 0.9, 0.5).unwrap())
//!     .assemble()
//!     .unwrap();
//! let design = synthesise(&plant, &SynthesisOptions::default()).unwrap();
//! assert!(design.closed_loop.is_stable().unwrap());
//! assert!(design.peak.gain <= design.bound);       // 1.01 times the optimum
//! ```

mod assumptions;
mod controller;
mod error;
mod level;
mod mixed_sensitivity;
mod normalised;
mod plant;
mod synthesis;
mod weights;

pub use error::{Assumption, Obstacle, SynthesisError};
pub use mixed_sensitivity::MixedSensitivity;
pub use plant::GeneralizedPlant;
pub use synthesis::{Synthesis, SynthesisOptions, synthesise};
pub use weights::{Template, WeightError};
