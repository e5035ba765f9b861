//! Heat: the solver, the moving source and the charts, against closed forms, the thesis and each other.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that fails stops here; its figures are shown with --nocapture"
)]

mod am_bench;
mod cases;
mod chart_between;
mod chart_simulation;
mod charts;
mod closed_form;
mod electron_pools;
mod laser_tracks;
mod layers;
mod levels;
mod levels_after_beam;
mod moving_source;
mod raster;
mod skin;
mod support;
mod verification;
