//! The vector types every room uses, re-exported on purpose from one place (`glam`, double precision).

pub use glam::{DAffine3, DMat2, DMat3, DQuat, DVec2, DVec3, IVec3};
