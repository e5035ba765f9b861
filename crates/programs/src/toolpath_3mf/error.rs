//! Why toolpaths in 3MF packages cannot be read or written.

use std::io;

use meltpath_geometry::io::threemf::ThreeMfError;
use meltpath_toolpath::PassPlace;

use super::words::Kind;

/// Why the toolpath of a 3MF package cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ToolpathFileError {
    /// The package, or what it requires, cannot be read.
    #[error(transparent)]
    Package(#[from] ThreeMfError),
    /// Something in it breaks the specification, or is not followed here.
    #[error("part `{part}`, byte {position}: {what}; {remedy}")]
    Content {
        /// Name of the part.
        part: String,
        /// Bytes into the unpacked part.
        position: u64,
        /// What is wrong, with names and values.
        what: String,
        /// What to do.
        remedy: &'static str,
    },
    /// There is no toolpath.
    #[error(
        "the package holds no toolpath (element `toolpathresource`), only shapes: name it as the part of a job, or export it with its toolpath"
    )]
    None,
    /// There are several, and nothing says which is meant.
    #[error(
        "the package holds {count} toolpaths and does not say which is to be built: write tp:toolpathid at its `build` (one of {ids})"
    )]
    Several {
        /// How many.
        count: usize,
        /// Their identifiers.
        ids: String,
    },
    /// It is of another kind than what is done with it asks for.
    #[error("the toolpath is {}, and {wanted}", .found.name())]
    Kind {
        /// What it is.
        found: Kind,
        /// What is asked for, and where such a toolpath goes.
        wanted: &'static str,
    },
}

/// Why a toolpath cannot be written into a 3MF package.
#[derive(Debug, thiserror::Error)]
pub enum ToolpathFileWriteError {
    /// Writing failed.
    #[error("the 3MF toolpath cannot be written: {0}")]
    Io(#[from] io::Error),
    /// The specification has no words for something.
    #[error("{pass}: a 3MF toolpath has no words for {what}: {remedy}")]
    NoWords {
        /// The pass.
        pass: PassPlace,
        /// What.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A value that the file cannot hold.
    #[error("{pass}: {what} is {value}: it must be {wanted}; nothing is written")]
    Value {
        /// The pass.
        pass: PassPlace,
        /// What.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What a file holds.
        wanted: &'static str,
    },
    /// Nothing is laid or marked.
    #[error("the plan lays and marks nothing: there is no toolpath to write")]
    Empty,
}

impl From<ThreeMfError> for ToolpathFileWriteError {
    fn from(error: ThreeMfError) -> Self {
        match error {
            ThreeMfError::Io(e) => ToolpathFileWriteError::Io(e),
            other => ToolpathFileWriteError::Io(io::Error::other(other)),
        }
    }
}
