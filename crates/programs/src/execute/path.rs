//! What is remembered of the path that moves leave open: where the last one came to, and corners that are rounded far.

/// Index of a program, with numbers of its user and tool frame.
pub(super) type FramesAt = (usize, (u32, u32));

/// Where the last move came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Came {
    /// It is not known where.
    Unknown,
    /// It is not known where, which is told.
    Told,
    /// To joints, whatever frames were selected.
    Joints,
    /// To a place in these frames, by the joints or along a path.
    ByJoints(FramesAt),
    /// See [`Came::ByJoints`].
    Along(FramesAt),
}

/// A move that is rounded farther at its end than the model reaches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Zone {
    /// The move among those executed.
    pub(super) index: usize,
    /// How far before its end it leaves the path, mm.
    pub(super) distance: f64,
    /// Its program and instruction, from 0.
    pub(super) at: (usize, usize),
}
