//! Dense computations at sizes from one to beyond any that the rooms use: rebuilt, and compared with what went in.
//!
//! Tolerances are multiples of the rounding unit times the size, for matrices with entries within ±1.

use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{
    Factored, Schur, Singular, eigenvalues, exponential, lyapunov, singular_values, solve,
    sylvester, symmetric_eigen,
};
use meltpath_numerics::least_squares::Regression;
use meltpath_numerics::random::Random;

const SIZES: [usize; 7] = [1, 2, 3, 14, 32, 64, 120];

fn random(rows: usize, columns: usize, seed: u64) -> Matrix {
    let mut numbers = Random::new(seed);
    Matrix::from_fn(rows, columns, |_, _| numbers.between(-1.0, 1.0))
}

/// Largest entry of a difference, in rounding units times the size.
fn roundings(difference: &Matrix) -> f64 {
    difference.largest() / (f64::EPSILON * difference.rows() as f64)
}

#[test]
fn systems_are_solved() {
    for size in SIZES {
        let a = random(size, size, 1) + Matrix::identity(size).scaled(2.0);
        let b = random(size, 3, 2);
        let x = solve(&a, &b).unwrap();
        let left = &a * &x - &b;
        assert!(
            left.largest() < 1e-14 * size as f64 * x.largest().max(1.0),
            "{size}"
        );
        // rows and columns in units 24 decades apart: the solution keeps its digits, column by column
        let units = |k: usize| 10f64.powf((k % 25) as f64 - 12.0);
        let scaled = Matrix::from_fn(size, size, |i, j| units(i) * a[(i, j)] * units(j + 7));
        let right = Matrix::from_fn(size, 3, |i, j| units(i) * b[(i, j)]);
        let y = solve(&scaled, &right).unwrap();
        for i in 0..size {
            for j in 0..3 {
                let off = (y[(i, j)] * units(i + 7) - x[(i, j)]).abs();
                assert!(off < 1e-10 * x.largest(), "{size}: {off:e}");
            }
        }
        let inverse = Factored::new(&a).unwrap().inverse();
        let one = &a * &inverse - Matrix::identity(size);
        assert!(
            roundings(&one) < 10.0 * inverse.largest().max(1.0),
            "{size}"
        );
    }
}

#[test]
fn schur_forms_rebuild_in_any_order() {
    for size in SIZES {
        let a = random(size, size, 3);
        let mut schur = Schur::new(&a).unwrap();
        for ordered in [false, true] {
            if ordered {
                let wanted = schur.eigenvalues().iter().filter(|e| e.re < 0.0).count();
                assert_eq!(schur.order(|e| e.re < 0.0), wanted, "{size}");
                let first = &schur.eigenvalues()[..wanted];
                assert!(first.iter().all(|e| e.re < 1e-9), "{size}");
            }
            let rebuilt = &schur.vectors * &schur.form * schur.vectors.transpose();
            assert!(roundings(&(rebuilt - &a)) < 40.0, "{size}");
            let orthogonal = schur.vectors.transpose() * &schur.vectors;
            assert!(
                roundings(&(orthogonal - Matrix::identity(size))) < 40.0,
                "{size}"
            );
        }
        let sum: f64 = eigenvalues(&a).unwrap().iter().map(|e| e.re).sum();
        let trace: f64 = (0..size).map(|i| a[(i, i)]).sum();
        assert!(
            (sum - trace).abs() < 1e-13 * size as f64,
            "{size}: {sum} {trace}"
        );
    }
}

#[test]
fn symmetric_and_singular_values_rebuild() {
    for size in SIZES {
        let a = random(size, size, 4).symmetric_part();
        let e = symmetric_eigen(&a).unwrap();
        let rebuilt = &e.vectors * Matrix::diagonal(&e.values) * e.vectors.transpose();
        assert!(roundings(&(rebuilt - &a)) < 40.0, "{size}");
        assert!(e.values.is_sorted(), "{size}");
        // tall and wide
        for (rows, columns) in [(size, size.div_ceil(2)), (size.div_ceil(2), size)] {
            let b = random(rows, columns, 5);
            let s = Singular::new(&b).unwrap();
            let middle =
                Matrix::from_fn(rows, columns, |i, j| if i == j { s.values[i] } else { 0.0 });
            let rebuilt = &s.left * middle * s.right.transpose();
            assert!(roundings(&(rebuilt - &b)) < 40.0, "{rows}x{columns}");
            for q in [&s.left, &s.right] {
                let one = q.transpose() * q - Matrix::identity(q.rows());
                assert!(roundings(&one) < 40.0, "{rows}x{columns}");
            }
            assert_eq!(singular_values(&b).unwrap().len(), rows.min(columns));
        }
    }
}

#[test]
fn linear_matrix_equations_hold() {
    for size in SIZES {
        // eigenvalues of a random matrix lie within about √(size/3): shifted well to the left of that
        let shift = 2.0 * (size as f64).sqrt() + 1.0;
        let a = random(size, size, 6) - Matrix::identity(size).scaled(shift);
        let b = random(size, size, 7) - Matrix::identity(size).scaled(shift);
        let c = random(size, size, 8);
        let x = sylvester(&a, &b, &c).unwrap();
        assert!(roundings(&(&a * &x + &x * &b - &c)) < 40.0, "{size}");
        let q = &c * c.transpose();
        let x = lyapunov(&a, &q).unwrap();
        let left = &a * &x + &x * a.transpose() + &q;
        assert!(roundings(&left) < 40.0 * q.largest(), "{size}");
    }
}

#[test]
fn exponentials_add_up() {
    for size in SIZES {
        let a = random(size, size, 9);
        let whole = exponential(&a).unwrap();
        let half = exponential(&a.scaled(0.5)).unwrap();
        let difference = &half * &half - &whole;
        assert!(roundings(&difference) < 200.0 * whole.largest(), "{size}");
    }
}

#[test]
fn least_squares_finds_what_made_the_data() {
    for unknowns in SIZES {
        let equations = 3 * unknowns + 300; // more than are folded at once
        let rows = random(equations, unknowns, 10);
        let truth = random(unknowns, 1, 11);
        let values = &rows * &truth;
        let mut system = Regression::new(unknowns);
        for i in 0..equations {
            system.push(rows.row_slice(i).iter().copied(), values[(i, 0)]);
        }
        let found = system.solve().unwrap();
        for (a, b) in found.values.iter().zip(truth.entries()) {
            assert!(
                (a - b).abs() < 1e-13 * unknowns as f64,
                "{unknowns}: {a} {b}"
            );
        }
        assert!(found.variance < 1e-26 * unknowns as f64, "{unknowns}");
        // the spread is the inverse of the normal matrix
        let normal = rows.transpose() * &rows;
        let one = &found.spread * &normal - Matrix::identity(unknowns);
        assert!(one.largest() < 1e-12, "{unknowns}");
    }
}
