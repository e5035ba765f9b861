//! meltpath as a library: job files, the pipelines that join the rooms, the data that ships.

pub mod cancel;
pub mod chain;
pub mod compare;
pub mod data;
pub mod ebm;
pub mod fit;
pub mod focus;
pub mod health;
pub mod identify;
mod inputs;
pub mod inspect;
pub mod job;
pub mod list;
pub mod lpbf;
mod machine;
pub mod material;
pub mod measure;
pub mod outcome;
mod pools;
pub mod reach;
pub mod records;
pub mod reference;
pub mod stages;
pub mod start;
pub mod tune;
pub mod views;
pub mod waam;
