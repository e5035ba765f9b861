//! What the cell loops run on: two precisions, the widest vector registers, an exponential that fits them.

pub(crate) mod fast_exp;
pub mod real;
pub mod vector;
