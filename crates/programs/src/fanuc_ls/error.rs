//! Why a text is not a program.

/// Why a text is not a program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseError {
    /// No `/PROG`.
    #[error(
        "not a FANUC program: it does not start with /PROG; export the program as text (.ls), not as binary (.tp)"
    )]
    NotAProgram,
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
}
