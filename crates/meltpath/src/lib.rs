//! meltpath as a library: job files, the pipelines that join the rooms, the data that ships.

pub mod data;
pub mod inspect;
pub mod job;
pub mod lpbf;
pub mod run;
pub mod start;
pub mod waam;
