//! Real Schur form A = U T Uᵀ by Hessenberg reduction and Francis' implicit double shift, with the eigenvalues that a
//! caller selects moved to the top.
//!
//! Golub and Van Loan, 7.4–7.5; exchange of blocks: Z. Bai, J. W. Demmel, "On swapping diagonal blocks in real Schur
//! form", Linear Algebra Appl. 186 (1993) 73–95.

use std::ops::Range;

use num_complex::Complex64;

use super::factor::{Factored, Reflector};
use super::{DenseError, balance};
use crate::matrix::Matrix;

/// A = U T Uᵀ with U orthogonal and T upper triangular but for 2x2 blocks of complex pairs.
#[derive(Debug, Clone)]
pub struct Schur {
    /// Orthogonal; its first k columns span the invariant subspace of the first k eigenvalues.
    pub vectors: Matrix,
    /// Upper quasi-triangular.
    pub form: Matrix,
}

impl Schur {
    /// The Schur form of a square real matrix.
    ///
    /// # Errors
    /// [`DenseError::NotFinite`], [`DenseError::NotSettled`].
    pub fn new(a: &Matrix) -> Result<Self, DenseError> {
        if !a.is_finite() {
            return Err(DenseError::NotFinite);
        }
        let mut form = a.clone();
        let mut vectors = Matrix::identity(a.rows());
        hessenberg(&mut form, Some(&mut vectors));
        francis(&mut form, Some(&mut vectors))?;
        Ok(Schur {
            vectors: vectors.transpose(),
            form,
        })
    }

    /// The eigenvalues, in the order of the diagonal.
    pub fn eigenvalues(&self) -> Vec<Complex64> {
        let mut out = Vec::with_capacity(self.form.rows());
        for block in blocks(&self.form) {
            let (one, two) = eigenvalues_of_block(&self.form, &block);
            out.push(one);
            out.extend(two);
        }
        out
    }

    /// The diagonal blocks, of one (real) or two (complex pair) rows.
    pub fn blocks(&self) -> Vec<Range<usize>> {
        blocks(&self.form)
    }

    /// Moves every eigenvalue for which `first` holds before all others, keeping the order within both groups; returns how
    /// many there are. Both members of a complex pair move together.
    pub fn order(&mut self, first: impl Fn(Complex64) -> bool) -> usize {
        let mut vectors = self.vectors.transpose();
        let count = self.moved_up(first, &mut vectors);
        self.vectors = vectors.transpose();
        count
    }

    /// As [`Schur::order`], beside the transposed vectors.
    fn moved_up(&mut self, first: impl Fn(Complex64) -> bool, vectors: &mut Matrix) -> usize {
        let mut done = 0;
        loop {
            let next = blocks(&self.form)
                .into_iter()
                .filter(|b| b.start >= done)
                .find(|b| first(eigenvalues_of_block(&self.form, b).0));
            let Some(block) = next else { return done };
            let size = block.len();
            let mut start = block.start;
            while start > done {
                let above = usize::from(start >= 2 && self.form[(start - 1, start - 2)] != 0.0) + 1;
                exchange(&mut self.form, vectors, start - above, (above, size));
                start -= above;
            }
            done = start + size;
        }
    }
}

/// U and H with A = U H Uᵀ, U orthogonal, and nothing in H more than one place below the diagonal.
///
/// ```
/// use meltpath_numerics::{dense, Matrix};
/// let a = Matrix::from_fn(4, 4, |i, j| 1.0 / (1.0 + i as f64 + 2.0 * j as f64));
/// let (u, h) = dense::hessenberg_form(&a);
/// assert!((&u * &h * u.transpose() - a).norm() < 1e-15 && h[(3, 0)] == 0.0 && h[(3, 1)] == 0.0);
/// ```
pub fn hessenberg_form(a: &Matrix) -> (Matrix, Matrix) {
    let mut form = a.clone();
    let mut vectors = Matrix::identity(a.rows());
    hessenberg(&mut form, Some(&mut vectors));
    (vectors.transpose(), form)
}

/// The eigenvalues of a square real matrix, after balancing.
///
/// # Errors
/// [`DenseError::NotFinite`], [`DenseError::NotSettled`].
///
/// ```
/// use meltpath_numerics::{dense, Matrix};
/// let poles = dense::eigenvalues(&Matrix::from_rows([[0.0, 1.0], [-25.0, -6.0]])).unwrap();
/// assert!((poles[0].re + 3.0).abs() < 1e-12 && (poles[0].im.abs() - 4.0).abs() < 1e-12);
/// ```
pub fn eigenvalues(a: &Matrix) -> Result<Vec<Complex64>, DenseError> {
    if !a.is_finite() {
        return Err(DenseError::NotFinite);
    }
    let (mut form, _) = balance(a);
    hessenberg(&mut form, None);
    francis(&mut form, None)?;
    let mut out = Vec::with_capacity(form.rows());
    for block in blocks(&form) {
        let (one, two) = eigenvalues_of_block(&form, &block);
        out.push(one);
        out.extend(two);
    }
    Ok(out)
}

fn blocks(form: &Matrix) -> Vec<Range<usize>> {
    let n = form.rows();
    let mut out = Vec::with_capacity(n);
    let mut i = 0;
    while i < n {
        let size = if i + 1 < n && form[(i + 1, i)] != 0.0 {
            2
        } else {
            1
        };
        out.push(i..i + size);
        i += size;
    }
    out
}

fn eigenvalues_of_block(form: &Matrix, block: &Range<usize>) -> (Complex64, Option<Complex64>) {
    let i = block.start;
    if block.len() == 1 {
        return (Complex64::new(form[(i, i)], 0.0), None);
    }
    let (a, b, c, d) = (
        form[(i, i)],
        form[(i, i + 1)],
        form[(i + 1, i)],
        form[(i + 1, i + 1)],
    );
    let half = 0.5 * (a - d);
    let discriminant = half * half + b * c;
    let imaginary = (-discriminant).max(0.0).sqrt();
    let root = Complex64::new(0.5 * (a + d), imaginary);
    (root, Some(root.conj()))
}

/// Exchanges the adjacent diagonal blocks of `p` and `q` rows that begin at `at`; `vectors` transposed.
fn exchange(t: &mut Matrix, vectors: &mut Matrix, at: usize, (p, q): (usize, usize)) {
    let n = t.rows();
    // the invariant subspace of the lower block is spanned by [V; I] with T11 V - V T22 = -T12
    let size = p * q;
    let mut system = Matrix::zeros(size, size);
    let mut right = Matrix::zeros(size, 1);
    for i in 0..p {
        for j in 0..q {
            let row = i * q + j;
            right[(row, 0)] = -t[(at + i, at + p + j)];
            for k in 0..p {
                system[(row, k * q + j)] += t[(at + i, at + k)];
            }
            for k in 0..q {
                system[(row, i * q + k)] -= t[(at + p + k, at + p + j)];
            }
        }
    }
    let v = match Factored::new(&system) {
        Ok(factored) => factored.solve(&right),
        // equal eigenvalues: the exchange changes nothing that matters
        Err(_) => return,
    };
    let mut basis = Matrix::zeros(p + q, q);
    for i in 0..p {
        for j in 0..q {
            basis[(i, j)] = v[(i * q + j, 0)];
        }
    }
    for j in 0..q {
        basis[(p + j, j)] = 1.0;
    }
    for k in 0..q {
        let column: Vec<f64> = (k..p + q).map(|i| basis[(i, k)]).collect();
        if let Some(reflector) = Reflector::new(&column) {
            reflector.apply_left(&mut basis, k, k..q);
            reflector.apply_left(t, at + k, 0..n);
            reflector.apply_right(t, at + k, 0..n);
            reflector.apply_left(vectors, at + k, 0..n);
        }
    }
    for i in at + q..at + p + q {
        for j in at..at + q {
            t[(i, j)] = 0.0;
        }
    }
    for (start, size) in [(at, q), (at + q, p)] {
        if size == 2 {
            split(t, Some(vectors), start);
        }
    }
}

/// Upper Hessenberg form in place. `vectors` is the transpose of what is multiplied on the right by the transformation, here and below:
/// its rows lie together in memory.
fn hessenberg(a: &mut Matrix, mut vectors: Option<&mut Matrix>) {
    let n = a.rows();
    for k in 0..n.saturating_sub(2) {
        let column: Vec<f64> = (k + 1..n).map(|i| a[(i, k)]).collect();
        if let Some(reflector) = Reflector::new(&column) {
            reflector.apply_left(a, k + 1, k..n);
            reflector.apply_right(a, k + 1, 0..n);
            if let Some(u) = vectors.as_deref_mut() {
                reflector.apply_left(u, k + 1, 0..n);
            }
            for i in k + 2..n {
                a[(i, k)] = 0.0;
            }
        }
    }
}

/// Sweeps after which an eigenvalue is no usual one: most take two to four.
const PATIENCE: usize = 20;

/// Francis' iteration on an upper Hessenberg matrix, down to quasi-triangular form.
fn francis(h: &mut Matrix, mut vectors: Option<&mut Matrix>) -> Result<(), DenseError> {
    const SWEEPS_PER_EIGENVALUE: usize = 60;
    let n = h.rows();
    let norm = h.norm();
    let mut end = n;
    let mut sweeps = 0;
    while end > 0 {
        let last = end - 1;
        let mut start = last;
        while start > 0 {
            let mut size = h[(start - 1, start - 1)].abs() + h[(start, start)].abs();
            // diagonals of lightly damped modes are next to nothing, and what is small beside the matrix is as good as zero
            if size == 0.0 || sweeps > PATIENCE {
                size = norm;
            }
            if h[(start, start - 1)].abs() <= f64::EPSILON * size {
                h[(start, start - 1)] = 0.0;
                break;
            }
            start -= 1;
        }
        if start == last {
            end -= 1;
            sweeps = 0;
        } else if start + 1 == last {
            split(h, vectors.as_deref_mut(), start);
            end -= 2;
            sweeps = 0;
        } else {
            sweeps += 1;
            if sweeps > SWEEPS_PER_EIGENVALUE {
                return Err(DenseError::NotSettled {
                    what: "the eigenvalue iteration",
                    size: n,
                    sweeps,
                });
            }
            sweep(h, vectors.as_deref_mut(), start, end, sweeps);
        }
    }
    Ok(())
}

/// The first column of H² − sum·H + product, divided by h21, with both eigenvalues of the last two rows for shifts.
fn usual(h: &Matrix, start: usize, end: usize, count: usize) -> [f64; 3] {
    let last = end - 1;
    let (sum, product) = if count.is_multiple_of(10) {
        // an exceptional shift breaks the rare cycles of the ordinary one
        let s = h[(last, last - 1)].abs() + h[(last - 1, last - 2)].abs();
        let x = 0.75 * s + h[(last, last)];
        (2.0 * x, x * x + 0.4375 * s * s)
    } else {
        (
            h[(last - 1, last - 1)] + h[(last, last)],
            h[(last - 1, last - 1)] * h[(last, last)] - h[(last - 1, last)] * h[(last, last - 1)],
        )
    };
    let h21 = h[(start + 1, start)];
    [
        (h[(start, start)] * (h[(start, start)] - sum) + product) / h21 + h[(start, start + 1)],
        h[(start, start)] + h[(start + 1, start + 1)] - sum,
        h[(start + 2, start + 1)],
    ]
}

/// Two shifts for eigenvalues that do not settle: a complex pair, or one that is real, twice. What is taken off them is small where eigenvalues lie upon each other, so that neither their sum nor
/// their product is ever formed.
struct Shifts {
    real: f64,
    /// The square of the imaginary part.
    imaginary: f64,
}

impl Shifts {
    /// The eigenvalues of the last two rows of `start..end`. Of two real ones the nearer to the corner, twice. Each tenth time other ones, from the bottom
    /// and from the top in turn, which break rare cycles.
    fn of(h: &Matrix, start: usize, end: usize, count: usize) -> Self {
        let last = end - 1;
        if count.is_multiple_of(10) {
            let (corner, s) = if count.is_multiple_of(20) {
                let s = h[(start + 1, start)].abs() + h[(start + 2, start + 1)].abs();
                (h[(start, start)], s)
            } else {
                let s = h[(last, last - 1)].abs() + h[(last - 1, last - 2)].abs();
                (h[(last, last)], s)
            };
            return Shifts {
                real: 0.75 * s + corner,
                imaginary: 0.4375 * s * s,
            };
        }
        let (a, d) = (h[(last - 1, last - 1)], h[(last, last)]);
        let half = 0.5 * (a - d);
        let discriminant = half * half + h[(last - 1, last)] * h[(last, last - 1)];
        if discriminant < 0.0 {
            return Shifts {
                real: d + half,
                imaginary: -discriminant,
            };
        }
        Shifts {
            real: d + half - discriminant.sqrt().copysign(half),
            imaginary: 0.0,
        }
    }

    /// The first column of (H − s)(H − s̄) from row `at` on, in units of its greatest entry: the begin of a bulge there.
    fn bulge(&self, h: &Matrix, at: usize) -> [f64; 3] {
        let below = h[(at + 1, at)];
        let [here, next] = [at, at + 1].map(|k| h[(k, k)] - self.real);
        let column = [
            here * here + self.imaginary + below * h[(at, at + 1)],
            below * (here + next),
            below * h[(at + 2, at + 1)],
        ];
        let greatest = column.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        if greatest > 0.0 {
            column.map(|x| x / greatest)
        } else {
            column
        }
    }

    /// Where a bulge begins, the lowest row at which what it leaves beside the form is nothing: two small entries below the diagonal, one after the other, are
    /// as good as one that is zero, and a bulge that is led past them forgets its shifts. And the bulge.
    fn begin(&self, h: &Matrix, start: usize, last: usize) -> (usize, [f64; 3]) {
        let mut at = last - 2;
        loop {
            let bulge = self.bulge(h, at);
            if at == start {
                return (at, bulge);
            }
            let beside = h[(at, at - 1)].abs() * (bulge[1].abs() + bulge[2].abs());
            let around: f64 = (at - 1..=at + 1).map(|k| h[(k, k)].abs()).sum();
            if beside <= f64::EPSILON * bulge[0].abs() * around {
                return (at, bulge);
            }
            at -= 1;
        }
    }
}

/// One implicit double shift over rows `start..end`.
fn sweep(h: &mut Matrix, mut vectors: Option<&mut Matrix>, start: usize, end: usize, count: usize) {
    let n = h.rows();
    let last = end - 1;
    // without vectors what lies beside the window is asked for by nobody: eigenvalues need the window alone
    let (top, right) = if vectors.is_some() {
        (0, n)
    } else {
        (start, end)
    };
    let (begin, mut bulge) = if count > PATIENCE {
        Shifts::of(h, start, end, count).begin(h, start, last)
    } else {
        (start, usual(h, start, end, count))
    };
    for k in begin..last {
        let rows = (end - k).min(3);
        if k > begin {
            for (i, value) in bulge.iter_mut().enumerate().take(rows) {
                *value = h[(k + i, k - 1)];
            }
        }
        if let Some(reflector) = Reflector::new(&bulge[..rows]) {
            reflector.apply_left(h, k, k.saturating_sub(1)..right);
            reflector.apply_right(h, k, top..(k + rows + 1).min(end));
            if let Some(u) = vectors.as_deref_mut() {
                reflector.apply_left(u, k, 0..n);
            }
            if k > start {
                for i in 1..rows {
                    h[(k + i, k - 1)] = 0.0;
                }
            }
        }
    }
}

/// Makes the 2x2 block at `at` triangular when its eigenvalues are real.
fn split(h: &mut Matrix, vectors: Option<&mut Matrix>, at: usize) {
    let (a, b, c, d) = (
        h[(at, at)],
        h[(at, at + 1)],
        h[(at + 1, at)],
        h[(at + 1, at + 1)],
    );
    if c == 0.0 {
        return;
    }
    let half = 0.5 * (a - d);
    let scale = half.abs().max(b.abs()).max(c.abs());
    let discriminant = (half / scale).powi(2) + (b / scale) * (c / scale);
    if discriminant < 0.0 {
        return;
    }
    // eigenvector (λ − d, c) of the eigenvalue λ = d + half ± root, sign chosen against cancellation
    let x = half + (scale * discriminant.sqrt()).copysign(half);
    let length = x.hypot(c);
    let (cosine, sine) = (x / length, c / length);
    let n = h.rows();
    let rotate_rows = |m: &mut Matrix| {
        for j in 0..n {
            let (top, bottom) = (m[(at, j)], m[(at + 1, j)]);
            m[(at, j)] = cosine * top + sine * bottom;
            m[(at + 1, j)] = cosine * bottom - sine * top;
        }
    };
    rotate_rows(h);
    for i in 0..n {
        let (left, right) = (h[(i, at)], h[(i, at + 1)]);
        h[(i, at)] = cosine * left + sine * right;
        h[(i, at + 1)] = cosine * right - sine * left;
    }
    if let Some(u) = vectors {
        rotate_rows(u);
    }
    h[(at + 1, at)] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(size: usize) -> impl Strategy<Value = Matrix> {
        proptest::collection::vec(-1.0f64..1.0, size * size)
            .prop_map(move |v| Matrix::from_fn(size, size, |i, j| v[i * size + j]))
    }

    fn check(a: &Matrix, schur: &Schur) {
        let rebuilt = &schur.vectors * &schur.form * schur.vectors.transpose();
        assert!((&rebuilt - a).norm() < 1e-13 * (1.0 + a.norm()) * a.rows() as f64);
        let orthogonal = schur.vectors.transpose() * &schur.vectors;
        assert!((orthogonal - Matrix::identity(a.rows())).norm() < 1e-13 * a.rows() as f64);
        for i in 0..a.rows() {
            for j in 0..i {
                assert!(i == j + 1 || schur.form[(i, j)] == 0.0);
            }
        }
    }

    proptest! {
        #[test]
        fn rebuilds_and_orders(a in (1usize..14).prop_flat_map(square)) {
            let mut schur = Schur::new(&a).unwrap();
            check(&a, &schur);
            let before = schur.eigenvalues();
            let count = schur.order(|e| e.re < 0.0);
            check(&a, &schur);
            let after = schur.eigenvalues();
            prop_assert_eq!(before.iter().filter(|e| e.re < 0.0).count(), count);
            prop_assert!(after[..count].iter().all(|e| e.re < 1e-9));
            prop_assert!(after[count..].iter().all(|e| e.re > -1e-9));
        }
    }

    #[test]
    fn a_companion_matrix_of_known_roots() {
        // (x−1)(x−2)…(x−6)
        let c = [-21.0, 175.0, -735.0, 1624.0, -1764.0, 720.0];
        let a = Matrix::from_fn(6, 6, |i, j| {
            if i == 0 {
                -c[j]
            } else {
                f64::from(u8::from(j + 1 == i))
            }
        });
        let mut roots: Vec<f64> = eigenvalues(&a).unwrap().iter().map(|e| e.re).collect();
        roots.sort_by(f64::total_cmp);
        for (k, r) in roots.iter().enumerate() {
            assert!((r - (k as f64 + 1.0)).abs() < 1e-9, "{r}");
        }
    }

    #[test]
    fn cyclic_and_zero_matrices_settle() {
        let cyclic = Matrix::from_fn(7, 7, |i, j| f64::from(u8::from((i + 1) % 7 == j)));
        let schur = Schur::new(&cyclic).unwrap();
        check(&cyclic, &schur);
        assert!(
            eigenvalues(&Matrix::zeros(5, 5))
                .unwrap()
                .iter()
                .all(|e| e.norm() == 0.0)
        );
        assert!(eigenvalues(&Matrix::zeros(0, 0)).unwrap().is_empty());
    }
}
