//! Stages that the processes share.

pub mod part;
