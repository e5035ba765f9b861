//! What is wrong in a file of points.

/// What is wrong in a file, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {message}")]
pub struct Wrong {
    /// Line or part of the file.
    pub place: String,
    /// What is wrong, and what to do.
    pub message: String,
}
