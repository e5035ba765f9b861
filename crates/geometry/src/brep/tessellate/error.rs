//! Why a solid has no mesh, or one of its faces none yet.

use meltpath_base::Cancelled;

/// Why a solid has no mesh.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TessellateError {
    /// A tolerance that is not above zero.
    #[error(
        "a chord error of {chord} mm and an angle of {angle} rad are not both finite and above 0"
    )]
    Tolerance {
        /// Chord error, mm.
        chord: f64,
        /// Angle, rad.
        angle: f64,
    },
    /// A face whose boundary and surface do not make a region.
    #[error(
        "face #{id} of `{solid}`: {reason}; repair the face in the program that wrote the file, or export again with a tighter tolerance"
    )]
    Face {
        /// Name of the solid.
        solid: String,
        /// Instance number of the face in the file.
        id: u64,
        /// What is wrong.
        reason: String,
    },
    /// More than a million chords on one edge or points in one face, or four thousand million vertices.
    #[error(
        "the mesh of `{solid}` at a chord error of {chord} mm has too many vertices; allow a larger chord error, or check the part's size and unit"
    )]
    TooFine {
        /// Name of the solid.
        solid: String,
        /// Chord error, mm.
        chord: f64,
    },
    /// Stopped by the person who started it.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What a face needs before it can be done, or why it cannot be.
#[derive(Debug)]
pub(super) enum FaceIssue {
    /// More samples on edges: (edge, parameter).
    Split(Vec<(u32, f64)>),
    /// More points than a face may have.
    TooFine,
    /// The reason, for people.
    Failed(String),
}
