//! From mirror angles to the spot in the plane and back: geometry, focus, beam, correction table.

pub mod beam;
pub mod correction;
pub mod focus;
pub mod geometry;
