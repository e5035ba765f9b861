//! The page and the ParaView files of one demonstration report.
#![allow(clippy::unwrap_used, reason = "a test that fails stops here")]

mod demo;
mod report;
mod vtk;
