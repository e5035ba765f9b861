//! The electric source: what voltage, current, wire feed and contact tube distance have to do with one another.
//!
//! Two ways stand side by side. [`circuit`] is the model of source, stick-out and arc, whose constants must be known for the
//! wire. [`lines`] are what was measured: straight lines over the contact tube distance.

pub mod circuit;
pub mod file;
pub mod lines;
