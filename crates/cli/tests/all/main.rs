//! The command line, called as a person calls it.
#![allow(clippy::unwrap_used, reason = "a test that fails stops here")]

mod bad_input;
mod output;
