//! What can be wrong with a path or a motion.

use thiserror::Error;

/// A promise of a path or a motion that does not hold.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum PathError {
    /// An array has not the entries that the others ask for.
    #[error("`{what}` has {found} entries, {wanted} are needed")]
    Length {
        /// The array.
        what: &'static str,
        /// Its entries.
        found: usize,
        /// How many it should have.
        wanted: usize,
    },
    /// A value that is none.
    #[error("entry {index}: {what}")]
    Value {
        /// What is wrong.
        what: &'static str,
        /// Which entry, counted from 0.
        index: usize,
    },
}
