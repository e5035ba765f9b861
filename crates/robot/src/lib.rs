//! From commanded moves to what a robot will really do: its cell, its kinematics, the interpolation of its controller.
//! Lengths are millimetres in the part frame, times s, speeds mm/s, angles rad.

pub mod cell;
pub mod collision;
pub mod command;
pub mod controller;
pub mod driven;
pub mod hull;
pub mod identification;
pub mod interpolation;
pub mod joint_move;
pub mod kinematics;
pub mod pacing;
pub mod posture;
pub mod summary;
pub mod travel;
pub mod weave;

pub use command::{Command, Kind, Smoothing, Source};
pub use controller::{Controller, ControllerError};
pub use interpolation::fir::{MotionError, simulate};
pub use pacing::Pacing;
pub use summary::{CommandRecord, Summary};
