//! What can be wrong with a 3MF file.

use std::io;

use meltpath_base::Cancelled;
use thiserror::Error;

use super::limits::{MAX_DEPTH, MAX_INSTANCES, MAX_TRIANGLES};

/// Why a 3MF file could not be read.
#[derive(Debug, Error)]
pub enum ThreeMfError {
    /// Reading or writing failed.
    #[error("cannot read or write the 3MF data: {0}")]
    Io(#[from] io::Error),
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// No bytes at all.
    #[error("the 3MF file is empty (0 bytes): export the part again")]
    Empty,
    /// Not a zip package, or a damaged one.
    #[error(
        "the 3MF package is damaged or is no zip file ({message}): copy or export the file again"
    )]
    Package {
        /// What the zip reader says.
        message: String,
    },
    /// The package is encrypted.
    #[error("the 3MF package is encrypted ({what}): export the part without protection")]
    Encrypted {
        /// What gives it away.
        what: String,
    },
    /// A part of the package is missing.
    #[error("the 3MF package has no part `{part}`, {why}")]
    MissingPart {
        /// Name of the part.
        part: String,
        /// Who needs it.
        why: &'static str,
    },
    /// The package starts from more than one model.
    #[error(
        "the 3MF package starts from two models, `{first}` and `{second}`: which one is the part?"
    )]
    TwoModels {
        /// Name of one.
        first: String,
        /// Name of the other.
        second: String,
    },
    /// A part is suspiciously large.
    #[error(
        "part `{part}` unpacks to more than {bytes} bytes from {packed}: refused as a zip bomb; \
         if the part is real, export it as binary STL"
    )]
    Bomb {
        /// Name of the part.
        part: String,
        /// Bytes unpacked when reading stopped.
        bytes: u64,
        /// Packed size, bytes.
        packed: u64,
    },
    /// An extension changes shapes, or adds metal, in ways that are not supported.
    #[error(
        "part `{part}` needs the 3MF extension {name}, which is not supported: export without it"
    )]
    Extension {
        /// Name of the part.
        part: String,
        /// Name of the extension, or its namespace if it is not known.
        name: String,
    },
    /// The XML is not well-formed.
    #[error("part `{part}`, byte {position}: the XML is not well-formed: {message}")]
    Xml {
        /// Name of the part.
        part: String,
        /// Bytes into the unpacked part.
        position: u64,
        /// What the XML reader says.
        message: String,
    },
    /// The XML is well-formed but breaks the core specification 1.3.
    #[error("part `{part}`, byte {position}: {message}")]
    Model {
        /// Name of the part.
        part: String,
        /// Bytes into the unpacked part.
        position: u64,
        /// What is wrong, with the names and values.
        message: String,
    },
    /// A component or build item names an object that is not there.
    #[error("part `{part}`: {user} uses object {object}, which is not defined before it")]
    MissingObject {
        /// Name of the part.
        part: String,
        /// Who uses it.
        user: String,
        /// Object identifier.
        object: u32,
    },
    /// Components contain each other, or are nested without end.
    #[error(
        "object {object}: its components are nested more than {MAX_DEPTH} deep or contain themselves"
    )]
    Nesting {
        /// Object identifier.
        object: u32,
    },
    /// The components multiply beyond reason.
    #[error(
        "the placed components make more than {MAX_TRIANGLES} triangles or {MAX_INSTANCES} copies: \
         refused; export fewer copies"
    )]
    TooMany,
    /// The build is empty.
    #[error("the 3MF file builds nothing: its `build` has no items with triangles")]
    NothingToBuild,
}
