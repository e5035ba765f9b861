//! meltpath as a library: job files, the data that ships, the pipelines that join the rooms.

pub mod job;
pub mod start;
pub mod waam;
