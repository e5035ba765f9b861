//! Metal: laid by the simulated motion, held against the part and against the distances of the contact tube.

mod grown;
pub(crate) mod metal;
pub mod simulate;
pub mod stock;
pub mod target;
pub(crate) mod tube;
