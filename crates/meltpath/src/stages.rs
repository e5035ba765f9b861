//! Stages that the processes share.

pub mod onto;
pub mod part;
pub mod section;
pub mod sheet;
