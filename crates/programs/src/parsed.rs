//! What parsers give: a program, what they kept of it verbatim, or why the text is none.

use std::borrow::Cow;

use crate::program::Program;

/// A line kept verbatim because nothing here models it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unread {
    /// Line in the file, from 1.
    pub line: u32,
    /// The text.
    pub text: String,
}

/// What was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Parsed {
    /// The program.
    pub program: Program,
    /// Line in the file of each instruction, from 1.
    pub lines: Vec<u32>,
    /// Every instruction and section that is kept but not modelled.
    pub unread: Vec<Unread>,
}

/// The text of a file: UTF-8, else the Latin-1 of older controllers.
pub(crate) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|&b| char::from(b)).collect()),
    }
}

/// The lines of a text, without the mark at its begin and the blanks around each.
pub(crate) fn trimmed(text: &str) -> impl Iterator<Item = &str> {
    text.trim_start_matches('\u{feff}').lines().map(str::trim)
}

/// Why a text is not a program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseError {
    /// No `/PROG`.
    #[error(
        "not a FANUC program: it does not start with /PROG; export the program as text (.ls), not as binary (.tp)"
    )]
    NotAProgram,
    /// Of no language that is read.
    #[error(
        "not a program that is read here: it does not begin with /PROG, and its name ends as none of .ls (FANUC), .src with .dat (KUKA), .mod (ABB), .script (Universal Robots), .JBI (Yaskawa), .pgx with .dtx (Stäubli), .3mf; export the program as text, and keep the ending of its controller"
    )]
    Unknown,
    /// No `/END`.
    #[error("the program stops at line {line} without /END: the file is cut off; export it again")]
    CutOff {
        /// Last line, from 1.
        line: u32,
    },
    /// A position does not read.
    #[error("line {line}: a position cannot be read: {why}")]
    Position {
        /// Line in the file, from 1.
        line: u32,
        /// What is wrong.
        why: &'static str,
    },
    /// A number was given to two positions.
    #[error("position P[{index}] stands twice in /POS: keep one")]
    RepeatedPosition {
        /// The number.
        index: u32,
    },
    /// A second program begins.
    #[error("line {line}: a second /PROG begins: give each program its own file")]
    SecondProgram {
        /// Line in the file, from 1.
        line: u32,
    },
    /// Another dialect's file, or none.
    #[error("not a {dialect} program: it has no {wanted}; export it as text")]
    Other {
        /// The dialect.
        dialect: &'static str,
        /// What a program of it has.
        wanted: &'static str,
    },
    /// A routine whose name its controller does not take.
    #[error(
        "line {line}: the program is called {name:?}, and a KUKA's name begins with a letter and has letters, digits and _ alone: rename it, in its file and where it is called"
    )]
    Name {
        /// Line in the file, from 1.
        line: u32,
        /// The name.
        name: String,
    },
    /// A name of a project's data, or a value of one, that stands twice.
    #[error(
        "{0} stands twice in the data of the project (.dtx): which of them counts is not known; keep one"
    )]
    Repeated(String),
    /// A project in inches.
    #[error(
        "the project is in inches (millimeterUnit=\"false\" in its .pjx); set it to millimetres on the controller, so that its points are converted, and export it again"
    )]
    InInches,
    /// A program without its end.
    #[error(
        "the program stops at line {line} without {wanted}: the file is cut off; export it again"
    )]
    Unended {
        /// Last line, from 1.
        line: u32,
        /// How it ends.
        wanted: &'static str,
    },
}
