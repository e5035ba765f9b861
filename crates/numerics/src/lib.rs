//! Numbers that several rooms need: dense matrices and what is computed of them, linear and nonlinear least squares, seeded
//! random numbers, search by a swarm, moving averages, halving, golden section, loops in vector
//! registers.
//!
//! Units are the caller's. The same bits come out on every machine and on any number of threads.

pub mod dense;
pub mod golden;
pub mod halving;
pub mod least_squares;
mod matrix;
pub mod moving_average;
pub mod random;
pub mod student;
pub mod swarm;
pub mod vector;

pub use matrix::{ComplexMatrix, Matrix, Scalar};
pub use num_complex::Complex64;
