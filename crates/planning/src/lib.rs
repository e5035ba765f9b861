//! From shape to toolpath: filling, ordering, links. Bead knowledge comes in as plain values.
//! Lengths are millimetres, angles radians. Sources of the rules: Rouchon 2022, § 1.2.3.2 and 4.1.

pub mod error;
pub mod fill;
pub mod onto;
pub mod powder;
pub mod surface;

pub use error::PlanError;
pub use fill::{
    ContourOrder, Coverage, FillLayer, FillSettings, Gap, LayerDirection, LayerPlan, LineAngle,
    LineDirection, LineOrder, Paces, PassIds, Spacing, StartPoints, Strategy, nominal_length,
    plan_layer, plan_layers,
};
