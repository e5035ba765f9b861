//! From shape to toolpath: filling, ordering, links. Bead knowledge comes in as plain values.
//! Lengths are millimetres, angles radians. Sources of the rules: Rouchon 2022, § 1.2.3.2 and 4.1.

mod bend;
mod chain;
mod contour;
mod coverage;
mod direction;
pub mod error;
mod fill;
mod gaps;
mod layer;
mod lines;
mod neighbours;
mod outline;
mod pace;
pub mod powder;
mod raster;
mod rings;
pub mod settings;
mod spacing;
mod spiral;
mod thin;
mod zigzag;

pub use coverage::{Coverage, Gap};
pub use error::PlanError;
pub use layer::{Layer, LayerPlan, PassIds, plan_layer, plan_layers};
pub use pace::nominal_length;
pub use settings::{
    ContourOrder, FillSettings, LayerDirection, LineAngle, LineDirection, LineOrder, Paces,
    Spacing, StartPoints, Strategy,
};
