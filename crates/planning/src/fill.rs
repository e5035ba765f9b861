//! Filling of regions with beads of wire: strategies, links, gaps, speeds, neighbours.

mod alike;
mod bead;
mod bend;
mod chain;
mod contour;
mod coverage;
mod direction;
mod gaps;
mod layer;
mod lined;
mod lines;
mod neighbours;
mod outline;
mod pace;
mod pieces;
mod plan;
mod raster;
mod region;
mod rings;
mod rooms;
mod settings;
mod spacing;
mod spiral;
mod thin;
mod turning_points;
mod zigzag;

pub use coverage::{Coverage, Gap};
pub use layer::{FillLayer, PassIds};
pub use pace::nominal_length;
pub(crate) use plan::passes_alone;
pub use plan::{LayerPlan, plan_layer, plan_layers};
pub use settings::{
    ContourOrder, FillSettings, LayerDirection, LineAngle, LineDirection, LineOrder, Paces,
    Spacing, StartPoints, Strategy,
};
