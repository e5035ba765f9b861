//! Dense linear algebra: factorisations, ordered real Schur form, symmetric and singular
//! values by Jacobi's method (high relative accuracy, which badly scaled plants need), exponential, Sylvester and
//! Lyapunov equations, balancing.
//!
//! Written here rather than taken from a library because the ordered real Schur form, on which Riccati solvers stand,
//! is not public in any pure Rust one; the same bits on every machine come with it.
//! Theory: G. H. Golub, C. F. Van Loan, "Matrix Computations", 4th ed., chapters 3, 5, 7, 8.

pub mod balance;
pub mod exponential;
pub mod factor;
pub mod schur;
pub mod singular;
pub mod sylvester;
pub mod symmetric;

pub use balance::balance;
pub use exponential::exponential;
pub(crate) use factor::Reflector;
pub use factor::{Factored, solve};
pub use schur::{Schur, eigenvalues};
pub use singular::{Singular, largest_singular_value, singular_values, smallest_singular_value};
pub use sylvester::{lyapunov, lyapunov_discrete, sylvester};
pub use symmetric::{Symmetric, symmetric_eigen};

/// Why a matrix computation did not succeed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DenseError {
    /// A linear system has no unique solution.
    #[error(
        "the matrix is singular to working precision (pivot {pivot:e} in column {column} of {size})"
    )]
    Singular {
        /// The column whose pivot vanished.
        column: usize,
        /// The matrix' size.
        size: usize,
        /// The largest pivot left.
        pivot: f64,
    },
    /// An iteration did not settle.
    #[error(
        "{what} of a {size}x{size} matrix did not settle in {sweeps} sweeps: scale the problem (units, time) and try again"
    )]
    NotSettled {
        /// Which iteration.
        what: &'static str,
        /// The matrix' size.
        size: usize,
        /// Sweeps done.
        sweeps: usize,
    },
    /// An entry is infinite or not a number.
    #[error("a matrix entry is infinite or not a number")]
    NotFinite,
    /// Two spectra touch, so that the equation has no unique solution.
    #[error(
        "no unique solution: the eigenvalues of the two coefficient matrices add up to {gap:e}, as good as zero"
    )]
    CommonEigenvalue {
        /// The smallest sum of eigenvalues met.
        gap: f64,
    },
}
