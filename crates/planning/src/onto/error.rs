//! Why layers on a body cannot be planned.

use meltpath_geometry::Mesh;
use meltpath_geometry::flatten::FlattenError;
use meltpath_geometry::level::LevelError;
use meltpath_geometry::math::DVec3;

use crate::PlanError;

/// What to do where a layer is nothing.
fn nothing(why: &FlattenError) -> &'static str {
    match why {
        FlattenError::Empty => {
            ": nothing of it can be laid; look whether the part is a body as it is meant to be (meltpath inspect), and its top (onto.top) a face that looks away from the body"
        }
        FlattenError::Back { .. } => "",
    }
}

impl OntoError {
    /// Why there is no grid in the box of a part.
    pub(super) fn of_grid(why: LevelError, part: &Mesh) -> Self {
        let (low, high) = part.bounds().unwrap_or_default();
        match why {
            LevelError::TooFine { cell } => OntoError::TooLarge {
                size: (high - low).to_array(),
                cell,
            },
            other @ LevelError::Size { .. } => OntoError::Level(other),
        }
    }
}

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
    /// What layers fill has no closed surface.
    #[error(
        "what the layers fill has no closed surface, so that nothing can grow out of it: give the part thicker places, or a larger target.allowance, and what follows as a job of its own"
    )]
    Open,
    /// Part and body do not meet.
    #[error("the part does not touch the body: its nearest place ({:.3}, {:.3}, {:.3}) mm is {gap:.3} mm away, more than half a layer; both files are in the same coordinates", .at.x, .at.y, .at.z)]
    Apart {
        /// Least distance, mm.
        gap: f64,
        /// Where on the part, mm.
        at: DVec3,
    },
    /// Nothing of the part is its top.
    #[error(
        "the part has no top: none of its faces, or of those named, lies more than {least:.3} mm, half a layer, out of the body and looks away from it; name its faces (onto.top), or leave onto.top out for layers at one distance from the body"
    )]
    NoTop {
        /// Half a layer, mm.
        least: f64,
    },
    /// The part goes on above its top.
    #[error("the part lies {by:.3} mm above its top at ({:.3}, {:.3}, {:.3}) mm of the build: layers from the body to the top need one top over all that grows, without steps; name its faces (onto.top), divide the part at the step, or leave onto.top out for layers at one distance from the body", .at.x, .at.y, .at.z)]
    OverTop {
        /// How far, mm.
        by: f64,
        /// Where, mm.
        at: DVec3,
    },
    /// No layer has room for a bead.
    #[error("no layer has room for a bead {width:.3} mm wide; take a narrower bead")]
    Narrow {
        /// Width of a bead, mm.
        width: f64,
    },
    /// What is named as the top looks along the body.
    #[error(
        "the faces named as the top of the part (onto.top) look along the body, {:.0} deg from the way out of it in the mean: layers go from the body to faces that look away from it; name those at the end of the growth, or write top = \"auto\"", .angle.to_degrees()
    )]
    TopAside {
        /// The angle, rad.
        angle: f64,
    },
    /// Too large for the grid on which layers are found.
    #[error(
        "what is to be added lies in {:.0} x {:.0} x {:.0} mm, too much for layers that are found {cell:.2} mm finely: if that is not its size, the unit of the files is another (part_unit); else divide the part, or lay wider and higher beads", .size[0], .size[1], .size[2]
    )]
    TooLarge {
        /// The box around the part, mm.
        size: [f64; 3],
        /// Side of the grid's cells, mm.
        cell: f64,
    },
    /// The grid on which layers are found.
    #[error(transparent)]
    Level(LevelError),
    /// A layer that goes around too much of the body.
    #[error("layer {number}: {source}{}", nothing(.source))]
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
