//! The wire-arc pipeline: part, plan, program, machine, metal, verdict.

pub mod judge;
pub mod part;
pub mod present;
pub mod record;
pub mod simulate;
pub mod target;
