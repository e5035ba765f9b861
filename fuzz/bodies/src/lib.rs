//! Every parser of meltpath on any bytes: never a panic, never without bounds, and what is read can be written and read again.
//! `cargo +nightly fuzz run NAME` and the tests of this crate run the same bodies.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a body that finds something says so by panicking"
)]

pub mod mutate;
mod targets;

pub use targets::{TARGETS, Target, named};
