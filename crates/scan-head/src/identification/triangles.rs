//! What the pieces of a record say of a motor's parameters, each as a triangle: columns are its first state, the free parameters, and
//! what is left of the record.
//!
//! Source: L. Ljung, "System Identification: Theory for the User", 2nd ed., §§ 9.4-9.5.

use meltpath_numerics::Matrix;
use meltpath_numerics::least_squares::{LeastSquaresError, Regression};

/// How the first state of a piece goes with a step of the parameters.
pub(super) fn led<const N: usize>(triangle: &Matrix, step: &[f64]) -> [f64; N] {
    let mut by = [0.0; N];
    for i in (0..N).rev() {
        let mut right = triangle[(i, N + step.len())];
        for (j, step) in step.iter().enumerate() {
            right -= triangle[(i, N + j)] * step;
        }
        for k in i + 1..N {
            right -= triangle[(i, k)] * by[k];
        }
        by[i] = right / triangle[(i, i)];
    }
    by
}

/// What the triangles say of the free parameters: rows beyond the first states.
fn told(
    triangles: &[Matrix],
    states: usize,
    free: usize,
) -> impl Iterator<Item = (Vec<f64>, f64)> + '_ {
    triangles.iter().flat_map(move |t| {
        (states..t.rows().min(states + free)).map(move |i| {
            let row = (0..free).map(|j| t[(i, states + j)]).collect();
            (row, t[(i, states + free)])
        })
    })
}

/// The step of the free parameters, damped by the lengths of their columns.
pub(super) fn damped(
    triangles: &[Matrix],
    states: usize,
    free: usize,
    damping: f64,
) -> Result<Vec<f64>, LeastSquaresError> {
    let mut system = Regression::new(free);
    let mut lengths = vec![0.0; free];
    for (row, right) in told(triangles, states, free) {
        for (length, value) in lengths.iter_mut().zip(&row) {
            *length += value * value;
        }
        system.push(row, right);
    }
    for (j, length) in lengths.iter().enumerate() {
        let level = (damping * length).sqrt();
        system.push((0..free).map(|i| if i == j { level } else { 0.0 }), 0.0);
    }
    Ok(system.solve()?.values)
}

/// The step of a first state, damped by the lengths of its columns.
pub(super) fn stepped<const N: usize>(
    triangle: &Matrix,
    damping: f64,
) -> Result<Vec<f64>, LeastSquaresError> {
    let mut system = Regression::new(N);
    let mut lengths = [0.0; N];
    for i in 0..triangle.rows().min(N) {
        for (j, length) in lengths.iter_mut().enumerate() {
            *length += triangle[(i, j)].powi(2);
        }
        system.push((0..N).map(|j| triangle[(i, j)]), triangle[(i, N)]);
    }
    for (j, length) in lengths.iter().enumerate() {
        let level = (damping * length).sqrt();
        system.push((0..N).map(|i| if i == j { level } else { 0.0 }), 0.0);
    }
    Ok(system.solve()?.values)
}

/// One standard deviation of each free parameter: the larger of what white residuals leave, and of what the pieces' own scatter
/// leaves.
pub(super) fn deviations(
    triangles: &[Matrix],
    states: usize,
    free: usize,
) -> Result<Vec<f64>, LeastSquaresError> {
    let variances = variances(triangles, states, free)?.into_iter();
    Ok(variances
        .map(|(white, scatter)| white.max(scatter).sqrt())
        .collect())
}

/// Variances of each free parameter: what white residuals leave, and what the pieces' own scatter leaves (the sandwich of Ljung's
/// eq. 9.54 with pieces as its terms).
fn variances(
    triangles: &[Matrix],
    states: usize,
    free: usize,
) -> Result<Vec<(f64, f64)>, LeastSquaresError> {
    let mut system = Regression::new(free);
    for (row, right) in told(triangles, states, free) {
        system.push(row, right);
    }
    let spread = system.solve()?.spread;
    let mut scatter = vec![0.0; free];
    for t in triangles {
        let mut slope = vec![0.0; free];
        for (row, right) in told(std::slice::from_ref(t), states, free) {
            for (slope, value) in slope.iter_mut().zip(row) {
                *slope += value * right;
            }
        }
        for (i, scatter) in scatter.iter_mut().enumerate() {
            let by: f64 = slope
                .iter()
                .enumerate()
                .map(|(j, s)| spread[(i, j)] * s)
                .sum();
            *scatter += by * by;
        }
    }
    let pieces = triangles.len() as f64;
    Ok(scatter
        .iter()
        .enumerate()
        .map(|(i, scatter)| (spread[(i, i)], scatter * pieces / (pieces - 1.0).max(1.0)))
        .collect())
}
