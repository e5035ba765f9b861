//! KM0, the periodic health test of an axis: a signal in two stages, its analysis, and a rating against the first accepted test.
//!
//! The first stage (R, L, J, constants and modes) is an identification, [`mod@bench`]; the second steps and ramps, [`signal`].

pub mod analysis;
pub mod bench;
pub mod friction;
pub mod rating;
pub mod records;
pub mod signal;
