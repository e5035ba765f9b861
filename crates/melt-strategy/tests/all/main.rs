//! Beam paths that melt well: learned, predicted and judged, on charts and on the reference solver.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test that fails stops here; its figures are shown with --nocapture"
)]

mod charts_and_solver;
mod converged_strategy;
mod ground_memory;
mod interrupted;
mod layer_cost;
mod reference_strategy;
mod spots;
mod strategy;
mod support;
mod watch;
mod window;
