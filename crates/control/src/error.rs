//! What can be wrong with a system or with the way systems are put together.

use num_complex::Complex64;

use crate::domain::Domain;
use meltpath_numerics::dense::DenseError;

/// Why a system cannot be built, joined or converted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SystemError {
    /// Matrices do not fit each other.
    #[error(
        "state-space matrices do not fit: A is {}x{}, B is {}x{}, C is {}x{}, D is {}x{}; wanted A n x n, B n x m, C p x n, D p x m",
        a.0, a.1, b.0, b.1, c.0, c.1, d.0, d.1
    )]
    Sizes {
        /// Rows and columns of A.
        a: (usize, usize),
        /// Rows and columns of B.
        b: (usize, usize),
        /// Rows and columns of C.
        c: (usize, usize),
        /// Rows and columns of D.
        d: (usize, usize),
    },
    /// An entry is infinite or not a number.
    #[error("{what} holds a value that is infinite or not a number")]
    NotFinite {
        /// Which part.
        what: &'static str,
    },
    /// A sample time is not positive.
    #[error("a sample time of {period} s is not positive")]
    Period {
        /// What was given (s).
        period: f64,
    },
    /// A delay that cannot be, or cannot be represented here.
    #[error(
        "a delay of {delay} s cannot be represented here: it must be positive, whole in sample times when sampled, equal in a sum, and replaced by a Padé approximant before a continuous loop is closed"
    )]
    Delay {
        /// The delay (s).
        delay: f64,
    },
    /// The denominator is zero.
    #[error("the denominator is zero")]
    ZeroDenominator,
    /// More zeros than poles.
    #[error(
        "the numerator's degree {numerator} exceeds the denominator's {denominator}: no state-space form exists; add a fast filter pole"
    )]
    Improper {
        /// Degree of the numerator.
        numerator: usize,
        /// Degree of the denominator.
        denominator: usize,
    },
    /// Continuous and sampled systems, or different sample times, cannot be joined.
    #[error(
        "systems of different time cannot be joined ({one:?} and {two:?}): discretise one first"
    )]
    Domains {
        /// Time of the first.
        one: Domain,
        /// Time of the second.
        two: Domain,
    },
    /// Numbers of channels do not match.
    #[error("{what}: {one} channels meet {two}")]
    Widths {
        /// Which connection.
        what: &'static str,
        /// Channels on one side.
        one: usize,
        /// Channels on the other side.
        two: usize,
    },
    /// A channel that does not exist.
    #[error("there is no {what} {index} (counted from 0): the system has {available}")]
    Channel {
        /// Input or output.
        what: &'static str,
        /// The index asked for.
        index: usize,
        /// How many there are.
        available: usize,
    },
    /// The loop determines nothing at infinite frequency.
    #[error(
        "the loop is not well posed: its direct gain is −1 in some direction; a small delay or a strictly proper block removes this"
    )]
    AlgebraicLoop,
    /// A complex root without its conjugate.
    #[error("the complex root {root} comes without its conjugate")]
    Unpaired {
        /// The root.
        root: Complex64,
    },
    /// The system is not stable where it must be.
    #[error("the system is not stable (pole {pole}): {need}")]
    Unstable {
        /// The offending pole.
        pole: Complex64,
        /// What needed stability.
        need: &'static str,
    },
    /// A quantity is outside its range.
    #[error("{what} is {value}: {wanted}")]
    Range {
        /// Which quantity.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// A matrix computation failed.
    #[error(transparent)]
    Dense(#[from] DenseError),
}
