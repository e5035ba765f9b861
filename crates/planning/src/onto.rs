//! Layers that follow a body which is there already: a repair on a worn face, a boss on a pipe, a rib on a casting.
//!
//! Layer k lies at k layer heights from the body, so that every layer is evenly thick and stands on the metal below it. The surface
//! through the middle of each layer is laid out in a plane with the least stretch, filled there as a flat layer is, and brought back.
//! What the layout stretches, the distance between beads is off by: it is told. A face that can be unrolled is not stretched.
//!
//! Where the top of the part is not parallel to the body, layers can go from the one to the other instead (`field`): so many everywhere, their
//! thickness that of the place, and beads the slower the thicker the layer.
//!
//! Ours. Layers at one distance from a free-form base are what Campocasso 2017 does with one bead on a surface, § III.C, eq. 3.

mod error;
mod field;
mod inner;
mod laid_out;
mod layers;
mod lift;
mod plan;
mod settings;
mod shape;
mod top;

pub use error::OntoError;
pub use layers::touches;
pub use lift::{OntoBead, TopPlace};
pub use plan::{Onto, OntoLayer, OntoPlan};
pub use settings::{OntoSettings, ToTop};
