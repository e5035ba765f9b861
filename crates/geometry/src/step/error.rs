//! What can be wrong with a STEP file: each error says what, where in the file, and what to do.

use std::fmt;

/// The place of an entity instance in a STEP file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EntityPlace {
    /// Entity type in capitals, parts of a complex instance joined by `+`.
    pub keyword: String,
    /// Instance number, without the `#`.
    pub id: u64,
    /// Line in the file, from 1.
    pub line: usize,
}

impl fmt::Display for EntityPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{} {} (line {})", self.id, self.keyword, self.line)
    }
}

/// Why a STEP file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The bytes could not be read.
    #[error("the STEP file could not be read: {0}")]
    Read(#[from] std::io::Error),
    /// The file is too large for the reader's 32-bit positions.
    #[error(
        "the STEP file has {bytes} bytes, more than the 4 GiB that can be read; export the part alone"
    )]
    TooLarge {
        /// Size of the file.
        bytes: usize,
    },
    /// The file does not begin as a Part 21 exchange structure.
    #[error(
        "not a STEP file: expected `ISO-10303-21;`, found {found}; export the part as STEP (AP203, AP214 or AP242)"
    )]
    NotStep {
        /// What the file begins with.
        found: String,
    },
    /// The text breaks the grammar of ISO 10303-21.
    #[error(
        "line {line}: expected {expected}, found {found}; the file is damaged, export it again"
    )]
    Syntax {
        /// Line, from 1.
        line: usize,
        /// What the grammar wants.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// The file ends early.
    #[error(
        "line {line}: the file ends inside {inside}; it was not written or copied whole, get it again"
    )]
    Truncated {
        /// Last line, from 1.
        line: usize,
        /// What was being read.
        inside: &'static str,
    },
    /// Two instances have the same number.
    #[error(
        "#{id} is defined twice, on lines {first} and {second}; the file is damaged, export it again"
    )]
    Duplicate {
        /// The number.
        id: u64,
        /// Line of the first definition.
        first: usize,
        /// Line of the second definition.
        second: usize,
    },
    /// A reference to an instance that the file does not hold.
    #[error(
        "{from} refers to #{id}, which the file does not hold; the file is damaged, export it again"
    )]
    Missing {
        /// The instance that refers.
        from: EntityPlace,
        /// The missing number.
        id: u64,
    },
    /// An attribute of the wrong kind or out of its range.
    #[error(
        "{entity}: attribute {attribute} must be {expected}; the file is damaged or written wrongly, export it again"
    )]
    Attribute {
        /// The instance.
        entity: EntityPlace,
        /// Position of the attribute, from 1.
        attribute: usize,
        /// What is allowed there.
        expected: &'static str,
    },
    /// Geometry that means nothing: a zero direction, a negative radius, falling knots.
    #[error("{entity}: {what}; repair the part in the program that wrote it")]
    Degenerate {
        /// The instance.
        entity: EntityPlace,
        /// What is wrong.
        what: String,
    },
    /// An instance that refers to itself, or nests deeper than any real part.
    #[error(
        "{entity}: refers to itself or is nested too deeply; the file is damaged, export it again"
    )]
    Cyclic {
        /// The instance.
        entity: EntityPlace,
    },
    /// An entity of the shape that is not read.
    #[error("{entity} is not supported as {role}; {remedy}")]
    Unsupported {
        /// The instance.
        entity: EntityPlace,
        /// What it was met as: surface, curve, item of the shape…
        role: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// The assembly unfolds into more solids than can be meant.
    #[error(
        "{entity}: the assembly unfolds into more than {limit} solids; export the one part that is to be built"
    )]
    TooManySolids {
        /// The representation at which the limit was met.
        entity: EntityPlace,
        /// The limit.
        limit: usize,
    },
    /// Components of an assembly lie in other files.
    #[error(
        "components of the assembly have no shape in this file: {components}; it refers to other files, which are not followed: {files}; export the assembly with all of its parts in one file"
    )]
    Elsewhere {
        /// Their names.
        components: String,
        /// The files.
        files: String,
    },
    /// The file holds no solid and no surface model.
    #[error(
        "the file holds no solid; it holds {holds}; export the part as a solid (AP203, AP214 or AP242)"
    )]
    NoShape {
        /// The kinds of shape items found.
        holds: String,
    },
}
