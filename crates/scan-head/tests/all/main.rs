//! Acceptance cases of the scan head: each test bears its case (acceptance.toml).

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "helpers of tests fail the test, and the figures found are told"
)]

mod chain;
mod contour_error;
mod controller_file;
mod controllers;
mod data_sheet;
mod drive_source;
mod friction_range;
mod geometry;
mod h_infinity;
mod identification;
mod identification_channels;
mod identification_time;
mod jobs;
mod km0;
mod laser_delays;
mod layers;
mod models;
mod preview;
mod ramps;
mod rays;
mod recipe_search;
mod reference;
mod reference_axis;
mod richer;
mod servo;
mod trajectory;

#[track_caller]
fn near(value: f64, expected: f64, within: f64) {
    assert!(
        (value - expected).abs() <= within,
        "{value} instead of {expected}"
    );
}

/// A pool of so many threads.
fn threads(count: usize) -> rayon::ThreadPool {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count);
    pool.build().unwrap()
}
