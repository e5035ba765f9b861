//! Why passes on a surface cannot be made.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::sheet::SheetError;

/// Why passes on a surface cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// A setting out of its range.
    #[error("{name} is {value}: it must be above zero and finite")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// The profile of a body of revolution is none.
    #[error("place {place} of the profile of the base: {what}")]
    Profile {
        /// Which, from 1; of too few how many.
        place: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// The ranges of the parameters are empty or not finite.
    #[error(
        "the range {from} to {to} of a parameter of the surface is empty or not finite: give both ends"
    )]
    Range {
        /// Begin.
        from: f64,
        /// End.
        to: f64,
    },
    /// The surface turns back along the direction of the planes.
    #[error("the surface folds back at ({:.3}, {:.3}, {:.3}) mm, so that planes meet it twice: lay passes at a constant distance, or plan it in two pieces", .at.x, .at.y, .at.z)]
    Fold {
        /// Where, mm.
        at: DVec3,
    },
    /// The surface has no direction in which it is built.
    #[error("the surface shrinks to a point at ({:.3}, {:.3}, {:.3}) mm, where the build has no direction: end its range before that place", .at.x, .at.y, .at.z)]
    Pole {
        /// Where, mm.
        at: DVec3,
    },
    /// Not a single pass has room.
    #[error(
        "no pass at {spacing} mm has room: the surface ends {reach:.3} mm from its base; take a smaller distance between passes"
    )]
    TooSmall {
        /// Distance between passes, mm.
        spacing: f64,
        /// How far the surface reaches, mm.
        reach: f64,
    },
    /// More passes than there can be.
    #[error("more than {most} passes of {spacing} mm: take a larger distance between passes")]
    TooMany {
        /// Distance between passes, mm.
        spacing: f64,
        /// Most passes.
        most: usize,
    },
    /// A mesh has no parameter.
    #[error(
        "a mesh has no parameter: lay passes by planes or at a constant distance, or give the surface itself"
    )]
    NoParameter,
    /// The mesh is not a surface that fronts can run over.
    #[error(transparent)]
    Sheet(#[from] SheetError),
}
