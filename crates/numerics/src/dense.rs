//! Dense linear algebra: factorisations, ordered real Schur form, symmetric and singular
//! values by Jacobi's method (high relative accuracy, which badly scaled plants need), exponential, Sylvester and
//! Lyapunov equations, balancing.
//!
//! Written here rather than taken from a library because the ordered real Schur form, on which Riccati solvers stand,
//! is not public in any pure Rust one; the same bits on every machine come with it.
//!
//! Weighed against faer 0.24 (one thread, its kernels chosen at run time by the machine's instruction set) on a Xeon with AVX-512, times
//! here over times there, random matrices of size n:
//!
//! | | n = 20 | 60 | 120 | error here / there |
//! |---|---|---|---|---|
//! | product | 6 | 7 | 8 | roundings |
//! | solve, n right sides | 2 | 4 | 6 | roundings; units 24 decades apart: 1e-14 / 4e-14 |
//! | eigenvalues | 0.8 | 1.5 | 3 | roundings |
//! | symmetric eigenvectors | 4 | 14 | 20 | roundings |
//! | singular values and vectors | 4 | 17 | 24 | roundings |
//! | smallest singular value, columns over 24 decades | 4 | 18 | 37 | 1e-14 / no digit |
//!
//! Since then eigenvalues here take 1.6 to 4 times less (rows are turned as they lie in memory, and only within the window that
//! has not settled), with the same bits.
//!
//! The rooms factor matrices of a few tens of rows, where a whole decomposition takes milliseconds at most (120: 54 ms): speed buys
//! nothing that a user sees. Plants in volts, amperes and radians are scaled over decades, and there Jacobi's method keeps digits that
//! bidiagonalisation loses. A program of these few calls took 114 CPU-seconds to build with
//! faer. So what stands here stays; larger matrices, or very many of them, would change the answer.
//!
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
pub use schur::{Schur, eigenvalues, hessenberg_form};
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
