//! The bead: sections, process maps, pursuit, cumulative deposit and its levelling, layer growth.

pub mod bead;
pub mod deposit;
mod least_squares;
pub mod mass;
pub mod pursuit;
pub mod section;
