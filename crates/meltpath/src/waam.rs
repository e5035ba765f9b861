//! The wire-arc pipeline: part, plan, program, machine, metal, verdict.

pub mod target;
