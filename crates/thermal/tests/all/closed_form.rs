//! Closed forms of moving sources: the yardsticks for the solver and the engine.

use meltpath_thermal::material::medium::Medium;

/// Steady temperature (K) round a point source of `power` W that moves at `speed` mm/s along x on a half space: at `ahead` mm ahead of it
/// (negative behind), `aside` mm beside, `depth` mm below (Rosenthal 1946).
pub(crate) fn rosenthal(
    medium: &Medium,
    power: f64,
    speed: f64,
    [ahead, aside, depth]: [f64; 3],
) -> f64 {
    let distance = (ahead * ahead + aside * aside + depth * depth).sqrt();
    let decay = (-speed * (distance + ahead) / (2.0 * medium.diffusivity)).exp();
    medium.ambient + power / (2.0 * std::f64::consts::PI * medium.conductivity * distance) * decay
}

/// Temperature (K) round a Gaussian surface source of 1/e² diameter `diameter` mm that has moved at `speed` mm/s for `duration` s on
/// a half space, in the frame of [`rosenthal`] (Eagar and Tsai 1983, their integral over time by the trapezium rule in a
/// variable that removes both ends).
pub(crate) fn eagar_tsai(
    medium: &Medium,
    [power, diameter]: [f64; 2],
    speed: f64,
    duration: f64,
    [ahead, aside, depth]: [f64; 3],
) -> f64 {
    let a = medium.diffusivity;
    let variance = (diameter / 4.0).powi(2);
    let factor = power / medium.heat_capacity() / (2.0 * std::f64::consts::PI).powf(1.5) * 2.0;
    // u = √age; the integrand is smooth in u
    let steps = 4000;
    let whole = duration.sqrt();
    let mut sum = 0.0;
    for n in 0..=steps {
        let u = whole * f64::from(n) / f64::from(steps);
        let age = u * u;
        let (flat, deep) = (variance + 2.0 * a * age, 2.0 * a * age);
        let x = ahead + speed * age;
        let below = if depth == 0.0 {
            0.0
        } else {
            depth * depth / (2.0 * deep)
        };
        let bell = (-(x * x + aside * aside) / (2.0 * flat) - below).exp();
        let weight = if n == 0 || n == steps { 0.5 } else { 1.0 };
        // 2u/√(2 a u²) = √2/√a
        sum += weight * bell / flat * (2.0 / a).sqrt();
    }
    medium.ambient + factor * sum * whole / f64::from(steps)
}
