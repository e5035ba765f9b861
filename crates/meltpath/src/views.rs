//! What people look at: results turned into pages, 3D scenes, plots, tables and field files.

pub mod compare;
pub mod ebm;
pub mod fit;
pub(crate) mod health;
pub(crate) mod lpbf;
pub(crate) mod tune;
pub mod waam;
