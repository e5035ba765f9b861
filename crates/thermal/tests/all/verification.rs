//! The reference solver against closed forms; its order of convergence; its energy balance.
use crate::closed_form::{eagar_tsai, rosenthal};
use crate::support::titanium;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::grid::Grid;
use meltpath_thermal::material::law::Law;
use meltpath_thermal::material::medium::{Body, Medium};
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::numeric::real::Real;
use meltpath_thermal::solver::source::{Depth, Spot};
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::{Face, Faces, Solver, State};

/// A column of `n` cells, `length` mm long, insulated but for its bottom.
fn column<R: Real>(material: Material, n: usize, length: f64, bottom: Face) -> Solver<R> {
    let grid = Grid {
        origin: DVec3::ZERO,
        cells: [1, 1],
        edge: [1.0, 1.0],
        heights: vec![length / n as f64; n],
    };
    let faces = Faces {
        top: Surface::Insulated,
        sides: Face::Insulated,
        bottom,
    };
    Solver::new(grid, material, faces).unwrap()
}

fn go_to<R: Real>(solver: &mut Solver<R>, time: f64) {
    let steps = (time / solver.stable_step()).ceil();
    for _ in 0..steps as usize {
        solver.step(time / steps, &[]).unwrap();
    }
}

#[test]
fn one_dimensional_warming_is_the_error_function() {
    let (k, c, start, hot) = (0.02, 3e-3, 1000.0, 1800.0);
    let mut solver = column::<f64>(
        Material::constant(k, c, start),
        200,
        2.0,
        Face::Imposed(hot),
    );
    let time = 0.01;
    go_to(&mut solver, time);
    let mut worst = 0.0_f64;
    for n in 0..150 {
        let depth = (n as f64 + 0.5) * 0.01;
        let exact = start + (hot - start) * (1.0 - libm_erf(depth / (2.0 * (k / c * time).sqrt())));
        worst = worst.max((solver.temperature_at(0, 0, n) - exact).abs());
    }
    println!("1-D: {worst:.3} K of {}", hot - start);
    assert!(worst < 1.0, "{worst} K");
}

/// Error function by its series and continued fraction, independent of the crate's own.
fn libm_erf(x: f64) -> f64 {
    if x < 3.0 {
        let (mut term, mut sum) = (x, x);
        for n in 1..200 {
            term *= -x * x / f64::from(n);
            sum += term / f64::from(2 * n + 1);
        }
        sum * 2.0 / std::f64::consts::PI.sqrt()
    } else {
        let mut tail = x;
        for n in (1..60).rev() {
            tail = x + 0.5 * f64::from(n) / tail;
        }
        1.0 - (-x * x).exp() / (tail * std::f64::consts::PI.sqrt())
    }
}

/// A substance that melts within half a kelvin, with other properties when liquid.
fn melting(start: f64, melt: f64) -> Material {
    Material {
        solidus: melt - 0.25,
        liquidus: melt + 0.25,
        latent: 300e3,
        density_solid: Law::constant(4000.0),
        density_liquid: Law::constant(4000.0),
        specific_heat_solid: Law::constant(700.0),
        specific_heat_liquid: Law::constant(850.0),
        conductivity_solid: Law::constant(20.0),
        conductivity_liquid: Law::constant(30.0),
        ..Material::constant(0.02, 3e-3, start)
    }
}

/// Position of the front in Neumann's solution, as a multiple of `2 √(α_l t)`.
fn neumann(material: &Material, start: f64, melt: f64, hot: f64) -> (f64, f64) {
    let solid = material.conductivity(start) / material.heat_capacity(start);
    let liquid = material.conductivity(hot) / material.heat_capacity(hot);
    let latent = 1e-9 * 4000.0 * material.latent;
    let root_pi = std::f64::consts::PI.sqrt();
    let balance = |l: f64| {
        let ratio = (liquid / solid).sqrt();
        let from_liquid = material.conductivity(hot) * (hot - melt) * (-l * l).exp()
            / (libm_erf(l) * (liquid).sqrt());
        let into_solid =
            material.conductivity(start) * (melt - start) * (-(l * ratio).powi(2)).exp()
                / ((1.0 - libm_erf(l * ratio)) * solid.sqrt());
        from_liquid - into_solid - latent * root_pi * l * liquid.sqrt()
    };
    let (mut low, mut high) = (1e-6, 2.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if balance(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low, liquid)
}

#[test]
fn neumann_stefan_front() {
    let (start, melt, hot) = (1500.0, 1900.0, 2600.0);
    let material = melting(start, melt);
    let (lambda, liquid) = neumann(&material, start, melt, hot);
    let n = 400;
    let mut solver = column::<f64>(material.clone(), n, 2.0, Face::Imposed(hot));
    let time = 0.02;
    go_to(&mut solver, time);
    let field: Vec<f64> = (0..n).map(|k| solver.temperature_at(0, 0, k)).collect();
    // liquid share of each cell from its enthalpy gives the front below a cell
    let curve = solver.curve();
    let front: f64 = field
        .iter()
        .map(|&t| {
            let g = curve.of(t);
            ((g - curve.at_solidus) / (curve.at_liquidus - curve.at_solidus)).clamp(0.0, 1.0) * 2.0
                / n as f64
        })
        .sum();
    let exact = 2.0 * lambda * (liquid * time).sqrt();
    println!("Stefan: front {front:.4} mm, exact {exact:.4} mm");
    assert!((front / exact - 1.0).abs() < 0.01);
    // temperature in the liquid
    let depth = 0.5 * exact;
    let t = field[(depth / 2.0 * n as f64) as usize];
    let place = ((depth / 2.0 * n as f64).floor() + 0.5) * 2.0 / n as f64;
    let expected =
        hot - (hot - melt) * libm_erf(place / (2.0 * (liquid * time).sqrt())) / libm_erf(lambda);
    assert!((t - expected).abs() < 0.01 * (hot - melt), "{t} {expected}");
}

#[test]
fn observed_order_is_two_in_space_with_steps_of_its_square() {
    let (k, c, start) = (0.02, 3e-3, 1000.0);
    let length = 1.0;
    let rate = (k / c) * (std::f64::consts::PI / length).powi(2);
    let time = 0.5 / rate;
    let error = |n: usize| {
        let mut solver = column::<f64>(Material::constant(k, c, start), n, length, Face::Insulated);
        let wave = |z: f64| (std::f64::consts::PI * z / length).cos();
        solver.set_temperature(|p| start + 200.0 + 100.0 * wave(p.z));
        go_to(&mut solver, time);
        let exact = |z: f64| start + 200.0 + 100.0 * wave(z) * (-rate * time).exp();
        let sum: f64 = (0..n)
            .map(|i| (solver.temperature_at(0, 0, i) - exact((i as f64 + 0.5) / n as f64)).powi(2))
            .sum();
        (sum / n as f64).sqrt()
    };
    let space = [10, 20, 40].map(error);
    let orders: Vec<f64> = space.windows(2).map(|w| (w[0] / w[1]).log2()).collect();
    println!("explicit, dt ~ dx²: errors {space:.6?}, orders {orders:.3?}");
    assert!(orders.iter().all(|o| (o - 2.0).abs() < 0.1), "{orders:?}");
}

fn half_space(edge: f64, low: DVec3, high: DVec3, start: f64) -> Solver<f32> {
    let grid = Grid::covering(low, high, DVec3::splat(edge)).unwrap();
    let faces = Faces {
        top: Surface::Insulated,
        sides: Face::Imposed(start),
        bottom: Face::Imposed(start),
    };
    Solver::new(grid, Material::constant(0.0275, 0.0275 / 8.0, start), faces).unwrap()
}

fn medium(start: f64) -> Medium {
    Medium {
        conductivity: 0.0275,
        diffusivity: 8.0,
        ambient: start,
        body: Body::HalfSpace,
    }
}

/// Draws a straight track along x and compares temperatures along, beside and below it.
fn compare_track(
    solver: &mut Solver<f32>,
    spot: Spot,
    speed: f64,
    length: f64,
    exact: impl Fn([f64; 3]) -> f64,
    near: f64,
) -> f64 {
    let time = length / speed;
    let steps = (time / solver.stable_step()).ceil();
    let dt = time / steps;
    for n in 0..steps as usize {
        let x = speed * dt * (n as f64 + 0.5);
        solver
            .step(
                dt,
                &[Spot {
                    centre: [x, 0.0],
                    ..spot
                }],
            )
            .unwrap();
    }
    let field = solver.temperature();
    let grid = &field.grid;
    let mut worst = 0.0_f64;
    let mut hottest = 0.0_f64;
    for k in 0..grid.planes() {
        for j in 0..grid.cells[1] {
            for i in 0..grid.cells[0] {
                let p = grid.centre(i, j, k);
                let place = [p.x - length, p.y, -p.z];
                let distance = DVec3::new(place[0], place[1], place[2]).length();
                if distance < near || p.x < 0.6 * length || place[1].abs() > 0.5 || place[2] > 0.5 {
                    continue;
                }
                let expected = exact(place);
                hottest = hottest.max(expected);
                worst = worst.max((field.at(i, j, k) - expected).abs());
            }
        }
    }
    worst / (hottest - solver.material().start)
}

/// Heat of `power` W on `diameter` mm at the surface, `x` mm along the track.
fn spot(x: f64, [power, diameter]: [f64; 2]) -> Spot {
    Spot {
        centre: [x, 0.0],
        diameter,
        power,
        depth: Depth::Surface,
    }
}

#[test]
fn a_moving_gaussian_is_that_of_eagar_and_tsai() {
    let start = 1000.0;
    let mut errors = Vec::new();
    for edge in [0.05, 0.025] {
        let mut solver = half_space(
            edge,
            DVec3::new(-0.8, -1.2, -1.2),
            DVec3::new(2.8, 1.2, 0.0),
            start,
        );
        let spot = spot(0.0, [100.0, 0.4]);
        let medium = medium(start);
        errors.push(compare_track(
            &mut solver,
            spot,
            800.0,
            2.0,
            |place| eagar_tsai(&medium, [100.0, 0.4], 800.0, 2.0 / 800.0, place),
            0.0,
        ));
    }
    println!("moving Gaussian: largest error over largest rise at 50 and 25 µm {errors:.4?}");
    assert!(
        errors[1] < 0.03 && errors[0] / errors[1] > 1.8,
        "{errors:?}"
    );
}

#[test]
fn a_narrow_beam_is_that_of_rosenthal() {
    let start = 1000.0;
    let mut solver = half_space(
        0.03,
        DVec3::new(-1.2, -1.8, -1.8),
        DVec3::new(5.4, 1.8, 0.0),
        start,
    );
    let spot = spot(0.0, [20.0, 0.06]);
    let medium = medium(start);
    let error = compare_track(
        &mut solver,
        spot,
        200.0,
        4.0,
        |place| rosenthal(&medium, 20.0, 200.0, place),
        0.15,
    );
    println!("Rosenthal: largest error over largest rise beyond five cells {error:.4}");
    assert!(error < 0.03, "{error}");
}

fn titanium_track<R: Real>() -> Solver<R> {
    let material = titanium();
    let grid = Grid::covering(
        DVec3::new(-0.5, -0.5, -0.4),
        DVec3::new(1.3, 0.5, 0.0),
        DVec3::new(0.04, 0.04, 0.025),
    )
    .unwrap();
    let start = material.start;
    let faces = Faces {
        top: Surface::Evaporating {
            surroundings: 300.0 + CELSIUS,
            ambient: 0.2,
        },
        sides: Face::Imposed(start),
        bottom: Face::Imposed(start),
    };
    let mut solver = Solver::new(grid, material, faces).unwrap();
    solver.set_state(|c| {
        if c.z > -0.1 && c.y > 0.0 {
            State::Powder
        } else {
            State::Dense
        }
    });
    let dt = 1.5e-6;
    for n in 0..500 {
        let spot = Spot {
            centre: [980.0 * dt * (f64::from(n) + 0.5), 0.0],
            diameter: 0.4137,
            power: 270.0,
            depth: Depth::Falling { penetration: 0.1 },
        };
        solver.step(dt, &[spot]).unwrap();
    }
    solver
}

#[test]
fn every_joule_is_accounted_for() {
    let single = titanium_track::<f32>();
    let double = titanium_track::<f64>();
    for (ledger, stored) in [
        (*single.ledger(), single.stored()),
        (*double.ledger(), double.stored()),
    ] {
        let residual = ledger.residual(stored);
        println!("{ledger:?} stored {stored:.5} J, residual {residual:.1e}");
        assert!(residual.abs() < 1e-3, "{residual}");
        assert!(ledger.evaporated > 0.0 && ledger.radiated > 0.0 && ledger.conducted > 0.0);
    }
    let (a, b) = (single.highest_temperature(), double.highest_temperature());
    let apart = a
        .values
        .iter()
        .zip(&b.values)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    println!(
        "single and double precision differ by at most {apart:.3} K of {:.0} K",
        a.largest().0
    );
    assert!(apart < 2.0);
}

#[test]
fn the_bits_do_not_depend_on_threads() {
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| titanium_track::<f32>().temperature())
    });
    assert_eq!(one, three);
}

#[test]
fn bad_steps_and_places_are_refused_with_a_way_out() {
    let mut solver = half_space(
        0.05,
        DVec3::new(-0.5, -0.5, -0.5),
        DVec3::new(0.5, 0.5, 0.0),
        1000.0,
    );
    let error = solver.step(1.0, &[]).unwrap_err().to_string();
    assert!(error.contains("use at most"), "{error}");
    let spot = spot(3.0, [100.0, 0.4]);
    let error = solver.step(1e-6, &[spot]).unwrap_err().to_string();
    assert!(error.contains("enlarge the domain"), "{error}");
    let error = solver.add_layer(0.07).unwrap_err().to_string();
    assert!(error.contains("whole number of planes"), "{error}");
}
