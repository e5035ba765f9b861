//! Plants that are hard on rounding: many lightly damped modes, commands that cost next to nothing, high orders.

use meltpath_control::h_infinity::{GeneralizedPlant, Synthesis, SynthesisOptions, synthesise};
use meltpath_control::{Matrix, StateSpace};
use meltpath_numerics::dense::largest_singular_value;
use meltpath_numerics::random::Random;

/// A chain of masses on springs, its ends held: a force on each mass disturbs, the first mass is driven, the last is to stand still and
/// is measured. `damping` is that of the springs over 2/ω, `cost` the weight of the command.
fn chain(masses: usize, damping: f64, cost: f64) -> GeneralizedPlant {
    let (n, m) = (2 * masses, masses);
    let stiff = |i: usize, j: usize| match i.abs_diff(j) {
        0 => 2.0,
        1 => -1.0,
        _ => 0.0,
    };
    let a = Matrix::from_fn(n, n, |i, j| match (i < m, j < m) {
        (true, true) => 0.0,
        (true, false) => f64::from(u8::from(i + m == j)),
        (false, true) => -stiff(i - m, j),
        (false, false) => -damping * stiff(i - m, j - m),
    });
    // forces, noise of the measurement, command
    let b = Matrix::from_fn(n, m + 2, |i, j| {
        let force = i >= m && (j == i - m || (j == m + 1 && i == m));
        f64::from(u8::from(force))
    });
    // place of the last mass, command; the measurement
    let c = Matrix::from_fn(3, n, |i, j| f64::from(u8::from(i != 1 && j + 1 == m)));
    let d = Matrix::from_fn(3, m + 2, |i, j| match (i, j) {
        (1, j) if j == m + 1 => cost,
        (2, j) if j == m => 0.1,
        _ => 0.0,
    });
    GeneralizedPlant::new(StateSpace::continuous(a, b, c, d).unwrap(), 1, 1).unwrap()
}

/// A random lightly damped plant in mixed states.
fn mixed(order: usize, damping: f64, cost: f64, seed: u64) -> GeneralizedPlant {
    let mut random = Random::new(seed);
    let mut a = Matrix::zeros(order, order);
    for k in 0..order / 2 {
        let omega = 10f64.powf(random.between(-1.0, 1.5));
        let (one, two) = (2 * k, 2 * k + 1);
        a[(one, one)] = -damping * omega;
        a[(two, two)] = -damping * omega;
        a[(one, two)] = omega;
        a[(two, one)] = -omega;
    }
    let mut random_matrix = |rows, columns| Matrix::from_fn(rows, columns, |_, _| random.normal());
    let t = random_matrix(order, order);
    let back = meltpath_numerics::dense::Factored::new(&t).unwrap();
    let a = back.solve(&(a * &t));
    let b = random_matrix(order, 5);
    let c = random_matrix(5, order);
    let d = Matrix::from_fn(5, 5, |i, j| match (i, j) {
        (1, 3) | (2, 4) => cost,
        (3, 1) | (4, 2) => 1.0,
        _ => 0.0,
    });
    GeneralizedPlant::new(StateSpace::continuous(a, b, c, d).unwrap(), 2, 2).unwrap()
}

/// The peak of a loop closed anew stays within the bound, looked for on a grid.
fn kept(plant: &GeneralizedPlant, found: &Synthesis) -> bool {
    let closed = plant.closed_by(&found.controller).unwrap();
    let poles = closed.poles().unwrap();
    let seen = poles
        .iter()
        .filter(|p| p.im >= 0.0)
        .flat_map(|p| [p.norm(), p.im])
        .map(|omega| largest_singular_value(&closed.response(omega)))
        .fold(0.0, f64::max);
    poles.iter().all(|p| p.re < 0.0) && seen <= found.bound * (1.0 + 1e-6)
}

pub(crate) fn tried(name: &str, plant: &GeneralizedPlant) -> bool {
    let begin = std::time::Instant::now();
    let found = synthesise(plant, &SynthesisOptions::default());
    let seconds = begin.elapsed().as_secs_f64();
    match found {
        Ok(found) => {
            println!(
                "{name}: best {:.6e}, bound {:.4} times, peak {:.6} of it, {} levels, {seconds:.2} s",
                found.optimum,
                found.bound / found.optimum,
                found.peak.gain / found.bound,
                found.trials
            );
            assert!(kept(plant, &found), "{name}");
            true
        }
        Err(error) => {
            println!("{name}: {error}, {seconds:.2} s");
            // what is refused says what to change
            let words = error.to_string();
            assert!(words.contains("weight"), "{name}: {words}");
            false
        }
    }
}

#[test]
fn lightly_damped_plants_of_order_thirty_are_controlled() {
    for damping in [1e-2, 1e-4, 1e-6] {
        assert!(tried(
            &format!("chain of 15, {damping:e}"),
            &chain(15, damping, 0.1)
        ));
        assert!(tried(
            &format!("mixed 30, {damping:e}"),
            &mixed(30, damping, 1.0, 5)
        ));
    }
    assert!(tried(
        "mixed 16, undamped but for 1e-8",
        &mixed(16, 1e-8, 1.0, 6)
    ));
}

#[test]
fn commands_that_cost_next_to_nothing_keep_their_bound_or_are_refused() {
    for cost in [1e-3, 1e-6] {
        tried(&format!("chain of 6, cost {cost:e}"), &chain(6, 1e-2, cost));
        tried(
            &format!("mixed 12, cost {cost:e}"),
            &mixed(12, 1e-2, cost, 7),
        );
    }
}

#[test]
#[ignore = "half a minute"]
fn a_plant_of_order_a_hundred_and_twenty_is_controlled() {
    assert!(tried("chain of 60", &chain(60, 1e-2, 0.1)));
}
