//! What the cell loops run on: two precisions, an exponential that fits vector registers.

pub(crate) mod fast_exp;
pub mod real;
