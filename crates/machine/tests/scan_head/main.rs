//! Acceptance cases of the scan head (specification *lpbf-scan-head*, § 17): each test bears its case.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "helpers of tests fail the test, and the figures found are told"
)]

mod controllers;
mod geometry;
mod identification;
mod jobs;
mod km0;
mod models;
mod preview;
mod reference;
mod richer;
mod trajectory;
