//! From commanded moves to what the machine will really do: the interpolation of an industrial robot's controller, the laser scan head.
//! Lengths are millimetres in the part frame, times s, speeds mm/s, angles rad.

pub mod closed_form;
pub mod command;
pub mod controller;
pub mod corner;
mod filter;
pub mod fir;
mod history;
pub mod scan_head;
pub mod summary;
mod timeline;
mod track;

pub use command::{Command, Kind, Smoothing, Source};
pub use controller::{Controller, ControllerError, Sourced};
pub use fir::{MotionError, simulate};
pub use summary::{CommandRecord, Summary};
