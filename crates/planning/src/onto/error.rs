//! Why layers on a body cannot be planned.

use meltpath_geometry::flatten::FlattenError;
use meltpath_geometry::level::LevelError;
use meltpath_geometry::math::DVec3;

use crate::PlanError;

/// Why layers on a body cannot be planned.
#[derive(Debug, thiserror::Error)]
pub enum OntoError {
    /// A setting out of its range.
    #[error("{name} is {value}: it must be above zero and finite")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// The body covers the part, to within half a layer.
    #[error("the part reaches nowhere more than {reach:.3} mm out of the body, and half a layer is {:.3} mm: there is nothing to lay; give the part as it is to be, and the body as it is now, in the same coordinates", 0.5 * .height)]
    Nothing {
        /// How far the part reaches out of the body, mm.
        reach: f64,
        /// Layer height, mm.
        height: f64,
    },
    /// Part and body do not meet.
    #[error("the part does not touch the body: its nearest place ({:.3}, {:.3}, {:.3}) mm is {gap:.3} mm away, more than half a layer; both files are in the same coordinates", .at.x, .at.y, .at.z)]
    Apart {
        /// Least distance, mm.
        gap: f64,
        /// Where on the part, mm.
        at: DVec3,
    },
    /// No layer has room for a bead.
    #[error("no layer has room for a bead {width:.3} mm wide; take a narrower bead")]
    Narrow {
        /// Width of a bead, mm.
        width: f64,
    },
    /// The grid on which layers are found.
    #[error(transparent)]
    Level(#[from] LevelError),
    /// A layer that goes around too much of the body.
    #[error("layer {number}: {source}")]
    Flatten {
        /// The layer.
        number: u32,
        /// Why.
        source: FlattenError,
    },
    /// The fill.
    #[error(transparent)]
    Fill(#[from] PlanError),
}
