//! What robots do: arms and cells against what stands outside, and motion as a controller interpolates it.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test that fails stops here; its figures are shown with --nocapture"
)]

mod collision;
mod driven;
mod external;
mod identification;
mod joint_moves;
mod kinematics;
mod motion;
mod posture;
