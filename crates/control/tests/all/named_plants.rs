//! Plants of COMPleib 1.1 (Leibfritz & Lipinski 2004) by name: lists of figures from publications on which solvers are compared.

use meltpath_control::h_infinity::GeneralizedPlant;
use meltpath_control::{Matrix, StateSpace};

use super::hard_plants::tried;

/// A plant without direct parts but those of `cost` and `noise`: what each command weighs, and how noisy each measurement is.
struct Named<'a> {
    a: Matrix,
    disturbances: Matrix,
    commands: Matrix,
    costs: Matrix,
    measured: Matrix,
    cost: &'a [f64],
    noise: &'a [f64],
}

impl Named<'_> {
    /// The disturbances, then a noise for each measurement; the costs, then each command by its weight.
    fn plant(&self) -> GeneralizedPlant {
        let (n, nw, nu) = (
            self.a.rows(),
            self.disturbances.columns(),
            self.commands.columns(),
        );
        let (nz, ny) = (self.costs.rows(), self.measured.rows());
        let b = Matrix::from_fn(n, nw + ny + nu, |i, j| {
            if j < nw {
                self.disturbances[(i, j)]
            } else if j < nw + ny {
                0.0
            } else {
                self.commands[(i, j - nw - ny)]
            }
        });
        let c = Matrix::from_fn(nz + nu + ny, n, |i, j| {
            if i < nz {
                self.costs[(i, j)]
            } else if i < nz + nu {
                0.0
            } else {
                self.measured[(i - nz - nu, j)]
            }
        });
        let d = Matrix::from_fn(nz + nu + ny, nw + ny + nu, |i, j| {
            if i >= nz && i < nz + nu && j >= nw + ny && i - nz == j - nw - ny {
                self.cost[i - nz]
            } else if i >= nz + nu && j >= nw && j < nw + ny && i - nz - nu == j - nw {
                self.noise[j - nw]
            } else {
                0.0
            }
        });
        GeneralizedPlant::new(
            StateSpace::continuous(self.a.clone(), b, c, d).unwrap(),
            nu,
            ny,
        )
        .unwrap()
    }
}

/// A matrix of which the entries that are not nothing are told.
fn sparse(rows: usize, columns: usize, entries: &[(usize, usize, f64)]) -> Matrix {
    let mut m = Matrix::zeros(rows, columns);
    for (i, j, x) in entries {
        m[(*i, *j)] = *x;
    }
    m
}

/// NN11 (Apkarian & Tuan 2000): two Jordan blocks at -101, a double pole at -1 four times, entries from 1e-4 to 764.
fn nn11<'a>(cost: &'a [f64], noise: &'a [f64]) -> Named<'a> {
    let mut a = vec![(0, 1, -99.9), (2, 3, -99.9)];
    a.extend((0..4).map(|i| (i, i, -101.0)));
    a.extend((4..8).map(|i| (i, i, -1.0)));
    a.extend((4..8).map(|i| (i, i + 4, 1.0)));
    let coupled = [
        [427.098, -46.8341, 0.4271, -0.0468],
        [232.0719, 120.4649, 0.2321, 0.1205],
        [-764.2456, 85.4154, -1.7642, 0.0854],
        [166.827, -264.7739, 0.1668, -1.2648],
    ];
    for (i, row) in coupled.iter().enumerate() {
        a.extend([(8 + i, 6, row[0]), (8 + i, 7, row[1])]);
        a.extend([(8 + i, 10, row[2]), (8 + i, 11, row[3])]);
    }
    a.extend([(8, 8, -1.0), (9, 9, -1.0)]);
    for (i, j) in [(12, 4), (14, 5)] {
        a.extend([(i, j, 0.3162), (i + 1, j, -0.125)]);
        a.extend([(i, i, -1.1), (i, i + 1, -0.0759), (i + 1, i + 1, -1.0)]);
    }
    let commands = [
        (0, 1, -9.995),
        (1, 0, 0.199),
        (1, 1, -9.995),
        (2, 0, 0.211),
        (2, 2, -9.995),
        (3, 0, -0.233),
        (3, 2, -9.995),
        (8, 1, 2.7173),
        (8, 2, 1.4274),
        (9, 1, 1.4274),
        (9, 2, 2.8382),
        (10, 1, -4.7909),
        (10, 2, -2.6032),
        (11, 1, 1.0261),
        (11, 2, -2.6393),
        (12, 0, 0.11),
        (15, 0, 0.01),
    ];
    let disturbances = [
        (0, 1, -0.001),
        (1, 1, -0.001),
        (2, 2, -0.001),
        (3, 2, -0.001),
        (8, 0, 0.1787),
        (8, 1, 0.0003),
        (8, 2, 0.0001),
        (9, 0, -0.8364),
        (9, 1, 0.0001),
        (9, 2, 0.0003),
        (10, 0, 0.0818),
        (10, 1, -0.0005),
        (10, 2, -0.0003),
        (11, 0, 0.3577),
        (11, 1, 0.0001),
        (11, 2, -0.0003),
        (12, 1, -0.3162),
        (13, 1, 0.125),
        (14, 0, -0.3162),
        (15, 2, 0.125),
    ];
    let slip = [(6, 1.5564), (7, 3.4834), (10, 0.0016), (11, 0.0035)];
    let row = |i: usize| slip.map(|(j, x)| (i, j, x)).to_vec();
    let costs = [row(0), vec![(1, 12, -0.4743), (2, 15, -0.3479)]].concat();
    let measured = [
        vec![(0, 12, -0.3162), (1, 14, -0.3162)],
        row(2),
        vec![(3, 12, -0.4743), (4, 14, -0.3479)],
    ]
    .concat();
    Named {
        a: sparse(16, 16, &a),
        disturbances: sparse(16, 3, &disturbances),
        commands: sparse(16, 3, &commands),
        costs: sparse(3, 16, &costs),
        measured: sparse(5, 16, &measured),
        cost,
        noise,
    }
}

/// ROC8 (El Ghaoui et al. 1997): three masses on undamped springs, beside three integrators that are driven and measured. `held` disturbs the
/// integrators, and weighs where they stand.
fn roc8<'a>(held: f64, cost: &'a [f64], noise: &'a [f64]) -> Named<'a> {
    let chain = [
        (0, 1, 1.0),
        (1, 0, -1.0),
        (1, 2, 1.0),
        (2, 3, 1.0),
        (3, 0, 1.0),
        (3, 2, -2.0),
        (3, 4, 1.0),
        (4, 5, 1.0),
        (5, 2, 1.0),
        (5, 4, -1.0),
    ];
    Named {
        a: sparse(9, 9, &chain),
        disturbances: sparse(
            9,
            4,
            &[(5, 0, 1.0), (6, 1, held), (7, 2, held), (8, 3, held)],
        ),
        commands: sparse(9, 4, &[(6, 0, 1.0), (7, 1, 1.0), (8, 2, 1.0), (1, 3, 1.0)]),
        costs: Matrix::from_fn(9, 9, |i, j| match i == j {
            true if i < 6 => 1.0,
            true => held,
            false => 0.0,
        }),
        measured: sparse(4, 9, &[(0, 6, 1.0), (1, 7, 1.0), (2, 8, 1.0), (3, 4, 1.0)]),
        cost,
        noise,
    }
}

/// As they are printed a command or a measurement costs nothing; and integrators that nobody asks for stay where they are: refused, and what to weight is
/// said.
#[test]
fn named_plants_without_weights_are_refused_with_what_to_weight() {
    let printed = [0.0, 0.0, 0.0, 1.0];
    for (name, named) in [
        ("NN11 as printed", nn11(&[0.0; 3], &[0.0; 5])),
        ("ROC8 as printed", roc8(0.0, &printed, &printed)),
        ("ROC8, integrators free", roc8(0.0, &[1.0; 4], &[1.0; 4])),
    ] {
        assert!(!tried(name, &named.plant()), "{name}");
    }
}

/// Eigenvalues upon each other (-101 twice in a Jordan block, -1 four times) kept the iteration from settling.
#[test]
fn named_plants_keep_their_bound() {
    for weight in [1.0, 0.1, 1e-2, 1e-4, 1e-6] {
        let ends = [weight, weight, weight, 1.0];
        for (name, named) in [
            ("NN11", nn11(&[weight; 3], &[weight; 5])),
            ("ROC8", roc8(0.1, &ends, &ends)),
        ] {
            let found = tried(&format!("{name}, weights {weight:e}"), &named.plant());
            assert!(found || weight < 1e-3, "{name}, {weight}");
        }
    }
}
