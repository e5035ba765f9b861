//! Dense matrices of the size control problems have (a few to a few hundred rows), real or complex, row by row in memory.
//!
//! Products and sums assert that sizes agree: a mismatch is a bug of the caller, as an index out of range is.
//! What a user can get wrong is checked, with an error, where systems are built.

use std::ops::{Add, Index, IndexMut, Mul, Neg, Range, Sub};

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// A number a [`Matrix`] can hold: `f64` or [`Complex64`].
pub trait Scalar:
    Copy
    + Default
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + Neg<Output = Self>
{
    /// One.
    const ONE: Self;
    /// Absolute value.
    fn modulus(self) -> f64;
    /// Whether every part is finite.
    fn finite(self) -> bool;
}

impl Scalar for f64 {
    const ONE: Self = 1.0;
    fn modulus(self) -> f64 {
        self.abs()
    }
    fn finite(self) -> bool {
        self.is_finite()
    }
}

impl Scalar for Complex64 {
    const ONE: Self = Complex64::new(1.0, 0.0);
    fn modulus(self) -> f64 {
        self.norm()
    }
    fn finite(self) -> bool {
        self.re.is_finite() && self.im.is_finite()
    }
}

/// A dense matrix. `Matrix` alone is real; [`ComplexMatrix`] is its complex twin.
///
/// ```
/// use meltpath_numerics::Matrix;
/// let a = Matrix::from_rows([[0.0, 1.0], [-2.0, -3.0]]);
/// let b = Matrix::column([0.0, 1.0]);
/// assert_eq!((&a * &b).to_rows(), [[1.0], [-3.0]]);
/// assert_eq!(a.transpose()[(0, 1)], -2.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Matrix<T = f64> {
    rows: usize,
    columns: usize,
    data: Vec<T>,
}

/// A dense complex matrix.
pub type ComplexMatrix = Matrix<Complex64>;

impl<T: Scalar> Matrix<T> {
    /// All zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Matrix {
            rows,
            columns,
            data: vec![T::default(); rows * columns],
        }
    }

    /// Entry by entry from its row and column.
    pub fn from_fn(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> T) -> Self {
        let mut data = Vec::with_capacity(rows * columns);
        for i in 0..rows {
            for j in 0..columns {
                data.push(entry(i, j));
            }
        }
        Matrix {
            rows,
            columns,
            data,
        }
    }

    /// From rows of equal length.
    pub fn from_rows<const M: usize, const N: usize>(rows: [[T; N]; M]) -> Self {
        Self::from_fn(M, N, |i, j| rows[i][j])
    }

    /// One column.
    pub fn column<const N: usize>(entries: [T; N]) -> Self {
        Self::from_fn(N, 1, |i, _| entries[i])
    }

    /// One row.
    pub fn row<const N: usize>(entries: [T; N]) -> Self {
        Self::from_fn(1, N, |_, j| entries[j])
    }

    /// The identity.
    pub fn identity(size: usize) -> Self {
        Self::from_fn(
            size,
            size,
            |i, j| if i == j { T::ONE } else { T::default() },
        )
    }

    /// A square matrix from its diagonal.
    pub fn diagonal(entries: &[T]) -> Self {
        Self::from_fn(entries.len(), entries.len(), |i, j| {
            if i == j { entries[i] } else { T::default() }
        })
    }

    /// One block after another, given as rows of blocks; heights agree within a row of blocks, widths within a column.
    ///
    /// # Panics
    /// When they do not: a bug of the caller.
    pub fn blocks<const M: usize, const N: usize>(blocks: [[&Self; N]; M]) -> Self {
        let rows = blocks.iter().map(|r| r[0].rows).sum();
        let columns = blocks[0].iter().map(|b| b.columns).sum();
        let mut out = Self::zeros(rows, columns);
        let mut top = 0;
        for row in blocks {
            let mut left = 0;
            for block in row {
                assert!(
                    block.rows == row[0].rows,
                    "blocks of one row differ in height"
                );
                out.set(top, left, block);
                left += block.columns;
            }
            assert!(left == columns, "rows of blocks differ in width");
            top += row[0].rows;
        }
        out
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Whether it has as many rows as columns.
    pub fn is_square(&self) -> bool {
        self.rows == self.columns
    }

    /// Entries in reading order.
    pub fn entries(&self) -> &[T] {
        &self.data
    }

    /// One row as a slice.
    pub fn row_slice(&self, i: usize) -> &[T] {
        &self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// One row as a slice to write to.
    pub fn row_slice_mut(&mut self, i: usize) -> &mut [T] {
        &mut self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// Neighbouring rows as slices to write to, all at once.
    pub(crate) fn rows_mut(&mut self, rows: Range<usize>) -> impl Iterator<Item = &mut [T]> {
        let columns = self.columns;
        self.data[rows.start * columns..rows.end * columns].chunks_exact_mut(columns.max(1))
    }

    /// The rows as nested vectors, for files and tests.
    pub fn to_rows(&self) -> Vec<Vec<T>> {
        (0..self.rows).map(|i| self.row_slice(i).to_vec()).collect()
    }

    /// The block at the crossing of a range of rows and a range of columns.
    #[must_use]
    pub fn block(&self, rows: Range<usize>, columns: Range<usize>) -> Self {
        Self::from_fn(rows.len(), columns.len(), |i, j| {
            self[(rows.start + i, columns.start + j)]
        })
    }

    /// Overwrites the block whose first entry is at (`top`, `left`).
    pub fn set(&mut self, top: usize, left: usize, block: &Self) {
        for i in 0..block.rows {
            let columns = self.columns;
            let start = (top + i) * columns + left;
            self.data[start..start + block.columns].copy_from_slice(block.row_slice(i));
        }
    }

    /// The transpose (without conjugation).
    #[must_use]
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self[(j, i)])
    }

    /// Each entry multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: T) -> Self {
        self.map(|x| x * factor)
    }

    /// Each entry through `f`.
    pub fn map<U: Scalar>(&self, mut f: impl FnMut(T) -> U) -> Matrix<U> {
        Matrix {
            rows: self.rows,
            columns: self.columns,
            data: self.data.iter().map(|&x| f(x)).collect(),
        }
    }

    /// Root of the sum of squares (Frobenius norm), safe against overflow.
    pub fn norm(&self) -> f64 {
        let largest = self.largest();
        if largest == 0.0 || !largest.is_finite() {
            return largest;
        }
        let sum: f64 = self
            .data
            .iter()
            .map(|x| (x.modulus() / largest).powi(2))
            .sum();
        largest * sum.sqrt()
    }

    /// Largest absolute entry; infinite when any entry is not finite.
    pub fn largest(&self) -> f64 {
        if self.is_finite() {
            self.data.iter().fold(0.0, |m, x| m.max(x.modulus()))
        } else {
            f64::INFINITY
        }
    }

    /// Whether every entry is finite.
    pub fn is_finite(&self) -> bool {
        self.data.iter().all(|x| x.finite())
    }

    pub(crate) fn swap_rows(&mut self, i: usize, k: usize) {
        if i != k {
            for j in 0..self.columns {
                self.data.swap(i * self.columns + j, k * self.columns + j);
            }
        }
    }
}

impl Matrix {
    /// The same numbers as a complex matrix.
    pub fn to_complex(&self) -> ComplexMatrix {
        self.map(|x| Complex64::new(x, 0.0))
    }

    /// Half the sum of the matrix and its transpose.
    #[must_use]
    pub fn symmetric_part(&self) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| {
            0.5 * (self[(i, j)] + self[(j, i)])
        })
    }
}

impl ComplexMatrix {
    /// The real parts.
    pub fn real(&self) -> Matrix {
        self.map(|z| z.re)
    }
}

impl<T> Index<(usize, usize)> for Matrix<T> {
    type Output = T;
    fn index(&self, (i, j): (usize, usize)) -> &T {
        debug_assert!(j < self.columns);
        &self.data[i * self.columns + j]
    }
}

impl<T> IndexMut<(usize, usize)> for Matrix<T> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        debug_assert!(j < self.columns);
        &mut self.data[i * self.columns + j]
    }
}

impl<T: Scalar> Mul for &Matrix<T> {
    type Output = Matrix<T>;
    fn mul(self, other: &Matrix<T>) -> Matrix<T> {
        assert!(
            self.columns == other.rows,
            "product of a {}x{} by a {}x{} matrix",
            self.rows,
            self.columns,
            other.rows,
            other.columns
        );
        let mut out = Matrix::zeros(self.rows, other.columns);
        for i in 0..self.rows {
            let target = out.row_slice_mut(i);
            for (k, &factor) in self.row_slice(i).iter().enumerate() {
                if factor != T::default() {
                    for (t, &x) in target.iter_mut().zip(other.row_slice(k)) {
                        *t = *t + factor * x;
                    }
                }
            }
        }
        out
    }
}

macro_rules! entrywise {
    ($trait:ident, $method:ident, $op:tt) => {
        impl<T: Scalar> $trait for &Matrix<T> {
            type Output = Matrix<T>;
            fn $method(self, other: &Matrix<T>) -> Matrix<T> {
                assert!(self.rows == other.rows && self.columns == other.columns, "matrices differ in size");
                Matrix {
                    rows: self.rows,
                    columns: self.columns,
                    data: self.data.iter().zip(&other.data).map(|(&x, &y)| x $op y).collect(),
                }
            }
        }
        impl<T: Scalar> $trait for Matrix<T> {
            type Output = Matrix<T>;
            fn $method(self, other: Matrix<T>) -> Matrix<T> {
                &self $op &other
            }
        }
        impl<T: Scalar> $trait<&Matrix<T>> for Matrix<T> {
            type Output = Matrix<T>;
            fn $method(self, other: &Matrix<T>) -> Matrix<T> {
                &self $op other
            }
        }
        impl<T: Scalar> $trait<Matrix<T>> for &Matrix<T> {
            type Output = Matrix<T>;
            fn $method(self, other: Matrix<T>) -> Matrix<T> {
                self $op &other
            }
        }
    };
}

entrywise!(Add, add, +);
entrywise!(Sub, sub, -);

impl<T: Scalar> Mul for Matrix<T> {
    type Output = Matrix<T>;
    fn mul(self, other: Matrix<T>) -> Matrix<T> {
        &self * &other
    }
}

impl<T: Scalar> Mul<&Matrix<T>> for Matrix<T> {
    type Output = Matrix<T>;
    fn mul(self, other: &Matrix<T>) -> Matrix<T> {
        &self * other
    }
}

impl<T: Scalar> Mul<Matrix<T>> for &Matrix<T> {
    type Output = Matrix<T>;
    fn mul(self, other: Matrix<T>) -> Matrix<T> {
        self * &other
    }
}

impl<T: Scalar> Neg for &Matrix<T> {
    type Output = Matrix<T>;
    fn neg(self) -> Matrix<T> {
        self.map(|x| -x)
    }
}

impl<T: Scalar> Neg for Matrix<T> {
    type Output = Matrix<T>;
    fn neg(self) -> Matrix<T> {
        -&self
    }
}
