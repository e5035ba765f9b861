//! Corrects the power along a path by the highest temperatures of the whole section, until all of it reaches one aim.
//!
//! A damped fixed point: the rise above the start temperature goes about as the power does, so that each place wishes for the
//! power there times what is wanted over what it reached; a piece of the path does what the places round it wish in the mean,
//! weighted by a Gaussian. No place has to know which line made it hottest. At the rim nothing can be as sharp as the contour:
//! what is wanted falls there as the edge of a beam does, and passes the melting range where metal may melt no further.

use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::grid::{Field, Grid};
use meltpath_thermal::material::CELSIUS;

use crate::error::StrategyError;
use crate::learning::Freedom;
use crate::speed::SpeedProfile;

/// What is wanted of the highest temperatures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aim {
    start: f64,
    temperature: f64,
    melting: f64,
    rim: f64,
    width: f64,
}

/// What the rim asks for: where metal may melt no further, and how sharp an edge can be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rim {
    /// Temperature that is to be passed there, K.
    pub melting: f64,
    /// How far beyond the contour, mm.
    pub beyond: f64,
    /// Standard deviation of the edge, mm: a quarter of the beam's diameter for a Gaussian beam and no time to conduct.
    pub width: f64,
}

impl Aim {
    /// `temperature` (K) well inside, over ground at `start` (K), and less at the rim.
    ///
    /// # Errors
    /// [`StrategyError::Aim`]: a temperature that does not lie above melting, and that above the start.
    pub fn new(start: f64, temperature: f64, rim: Rim) -> Result<Self, StrategyError> {
        if !(temperature > rim.melting && rim.melting > start) {
            return Err(StrategyError::Aim {
                celsius: temperature - CELSIUS,
            });
        }
        Ok(Aim {
            start,
            temperature,
            melting: rim.melting,
            rim: rim.beyond,
            width: rim.width.max(1e-6),
        })
    }

    /// What is wanted `depth` mm inside the contour, K; below zero outside it.
    ///
    /// ```
    /// use meltpath_melt_strategy::correction::{Aim, Rim};
    /// let rim = Rim { melting: 1900.0, beyond: 0.1, width: 0.1 };
    /// let aim = Aim::new(1000.0, 3000.0, rim).unwrap();
    /// assert!((aim.at(-0.1) - 1900.0).abs() < 1e-6);
    /// assert!(aim.at(0.0) < aim.at(0.1) && aim.at(1.0) > 2999.9);
    /// assert!((aim.at(aim.depth_of(2900.0)) - 2900.0).abs() < 1e-6);
    /// ```
    pub fn at(&self, depth: f64) -> f64 {
        let rise = self.temperature - self.start;
        let edge = below((depth + self.rim) / self.width + self.at_rim());
        self.start + rise * edge
    }

    /// How far inside the contour `kelvin` is wanted, mm: the inverse of [`Aim::at`]. Infinite where no place is wanted as hot.
    pub fn depth_of(&self, kelvin: f64) -> f64 {
        let share = (kelvin - self.start) / (self.temperature - self.start);
        if share >= 1.0 {
            return f64::INFINITY;
        }
        self.width * (deviations(share) - self.at_rim()) - self.rim
    }

    /// Deviations of the edge at which it passes the melting range.
    fn at_rim(&self) -> f64 {
        deviations((self.melting - self.start) / (self.temperature - self.start))
    }
}

/// Share of a Gaussian below so many standard deviations.
fn below(deviations: f64) -> f64 {
    0.5 * libm::erfc(-deviations * std::f64::consts::FRAC_1_SQRT_2)
}

/// The inverse of [`below`], by halving.
fn deviations(share: f64) -> f64 {
    let (mut low, mut high) = (-8.0, 8.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// How the power is corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// Share of what is wished for that is done, up to 1.
    pub gain: f64,
    /// Standard deviation of the Gaussian that evens wishes out along and across lines, mm.
    pub reach: f64,
    /// Least and greatest power, as shares of the path's own.
    pub powers: [f64; 2],
    /// How often along the path the machine can change it.
    pub freedom: Freedom,
}

/// The most that a place may wish for at once, as a natural logarithm: powder that was never reached would wish for all.
const MOST: f64 = 0.4;
/// How far wishes are heard, in reaches.
const HEARD: f64 = 3.0;

/// What the columns of a field wish for: the natural logarithm of the factor on the power.
#[derive(Debug, Clone)]
pub struct Wishes {
    grid: Grid,
    values: Vec<Option<f64>>,
}

impl Wishes {
    /// What the top plane of `highest` (K) wishes for, `depth` telling how far inside the contour a place lies, mm. Outside only
    /// what is too hot wishes.
    pub fn of(highest: &Field, aim: &Aim, depth: &dyn Fn([f64; 2]) -> f64) -> Self {
        let grid = highest.grid.clone();
        let [nx, ny] = grid.cells;
        let top = grid.planes() - 1;
        let wish = |n: usize| {
            let (i, j) = (n % nx, n / nx);
            let centre = grid.centre(i, j, top);
            let inside = depth([centre.x, centre.y]);
            let wanted = aim.at(inside) - aim.start;
            let reached = (highest.at(i, j, top) - aim.start).max(1.0);
            (inside > 0.0 || reached > wanted).then(|| (wanted / reached).ln().clamp(-MOST, MOST))
        };
        let values = (0..nx * ny).map(wish).collect();
        Wishes { grid, values }
    }

    /// What the places round one wish in the mean, and whether any does.
    fn near(&self, [x, y]: [f64; 2], reach: f64) -> Option<f64> {
        let grid = &self.grid;
        let far = HEARD * reach;
        let range = |at: f64, origin: f64, a: usize| {
            let index = |v: f64| (v.max(0.0) as usize).min(grid.cells[a]);
            index((at - far - origin) / grid.edge[a])
                ..index((at + far - origin) / grid.edge[a] + 1.0)
        };
        let (mut sum, mut weights) = (0.0, 0.0);
        for j in range(y, grid.origin.y, 1) {
            for i in range(x, grid.origin.x, 0) {
                let Some(wish) = self.values[j * grid.cells[0] + i] else {
                    continue;
                };
                let centre = grid.centre(i, j, 0);
                let away = (centre.x - x).powi(2) + (centre.y - y).powi(2);
                let weight = (-0.5 * away / (reach * reach)).exp();
                sum += weight * wish;
                weights += weight;
            }
        }
        (weights > 1e-6).then(|| sum / weights)
    }

    /// The factors by which the power of `path` is divided, after `profile`; pieces that no place speaks of stay as they are.
    #[must_use]
    pub fn corrected(
        &self,
        profile: &SpeedProfile,
        path: &BeamPath,
        how: &Correction,
    ) -> SpeedProfile {
        let mut next = profile.clone();
        let [least, most] = how.powers;
        for (factor, (from, to, old)) in next.factors_mut().iter_mut().zip(profile.intervals()) {
            if !path.at(from).is_on() {
                continue;
            }
            let middle = path.at(0.5 * (from + to));
            if let Some(wish) = self.near([middle.x, middle.y], how.reach) {
                *factor = (old * (-how.gain * wish).exp()).clamp(1.0 / most, 1.0 / least);
            }
        }
        match how.freedom {
            Freedom::Continuous => next,
            Freedom::PerLine => next.by_line(path),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lever::Lever;
    use meltpath_geometry::math::DVec3;
    use meltpath_thermal::beam::BeamPoint;

    const START: f64 = 1000.0;
    const SPOT: f64 = 0.4;

    /// A square of 2 mm by lines one way, 0.05 mm apart, 300 W, overrun by 0.1 mm.
    fn square() -> BeamPath {
        let mut points = Vec::new();
        let mut time = 0.0;
        for n in 0..=44 {
            let y = -1.1 + 0.05 * f64::from(n);
            for (x, power) in [(-1.1, 300.0), (1.1, 0.0)] {
                points.push(BeamPoint {
                    time,
                    x,
                    y,
                    power,
                    spot: SPOT,
                });
                time += if power > 0.0 { 1e-3 } else { 0.0 };
            }
        }
        BeamPath::new(points).unwrap()
    }

    fn depth([x, y]: [f64; 2]) -> f64 {
        1.0 - x.abs().max(y.abs())
    }

    /// What stands for a solver: every bit of the path raises the places round it as its beam is wide, and a slope along y stands
    /// for heat that piles up.
    fn drawn(path: &BeamPath) -> Field {
        let edge = DVec3::new(0.05, 0.05, 0.05);
        let corner = DVec3::new(1.5, 1.5, 0.0);
        let grid = Grid::covering(-corner, corner + DVec3::Z * 0.05, edge).unwrap();
        let mut rise = vec![0.0; grid.cells[0] * grid.cells[1]];
        for pair in path.points().windows(2).filter(|w| w[0].is_on()) {
            let middle = [0.5 * (pair[0].x + pair[1].x), 0.5 * (pair[0].y + pair[1].y)];
            let energy = pair[0].power * (pair[1].time - pair[0].time);
            let parts = ((pair[1].x - pair[0].x).abs() / 0.05).ceil().max(1.0) as usize;
            for part in 0..parts {
                let share = (part as f64 + 0.5) / parts as f64;
                let x = pair[0].x + share * (pair[1].x - pair[0].x);
                for (n, rise) in rise.iter_mut().enumerate() {
                    let c = grid.centre(n % grid.cells[0], n / grid.cells[0], 0);
                    let away = (c.x - x).powi(2) + (c.y - middle[1]).powi(2);
                    let piled = 1.0 + 0.1 * (c.y + 1.0);
                    *rise += piled * energy / parts as f64 * (-8.0 * away / (SPOT * SPOT)).exp();
                }
            }
        }
        let values = rise.iter().map(|r| (START + 12e3 * r) as f32).collect();
        Field { grid, values }
    }

    /// Places of the square within 30 K of the aim, and area molten beyond the rim, both as shares of the square.
    fn told(field: &Field) -> [f64; 2] {
        let (mut inside, mut good, mut beyond) = (0.0, 0.0, 0.0);
        for n in 0..field.values.len() {
            let (i, j) = (n % field.grid.cells[0], n / field.grid.cells[0]);
            let c = field.grid.centre(i, j, 0);
            let (deep, kelvin) = (depth([c.x, c.y]), field.at(i, j, 0));
            inside += f64::from(u8::from(deep > 0.0));
            good += f64::from(u8::from(deep > 0.0 && (kelvin - 3000.0).abs() < 30.0));
            beyond += f64::from(u8::from(deep < -0.1 && kelvin > 1900.0));
        }
        [good / inside, beyond / inside]
    }

    fn aim() -> Aim {
        let rim = Rim {
            melting: 1900.0,
            beyond: 0.1,
            width: 0.25 * SPOT,
        };
        Aim::new(START, 3000.0, rim).unwrap()
    }

    #[test]
    fn a_section_is_brought_to_its_aim() {
        let path = square();
        let how = Correction {
            gain: 1.0,
            reach: 0.1,
            powers: [0.3, 3.0],
            freedom: Freedom::Continuous,
        };
        let mut profile = SpeedProfile::of(&path, 0.1);
        let mut rounds = Vec::new();
        for _ in 0..9 {
            let changed = Lever::Power.apply(&profile, &path).unwrap();
            let field = drawn(&changed);
            rounds.push(told(&field));
            profile = Wishes::of(&field, &aim(), &depth).corrected(&profile, &path, &how);
        }
        let ([first, _], [last, beyond]) = (rounds[0], rounds[8]);
        // a rim of some 0.1 mm, a fifth of so small a square, cannot be as hot as the rest without melting beyond
        assert!(first < 0.1 && last > 0.7 && beyond < 0.01, "{rounds:?}");
        // a machine that changes between lines alone still evens out what piles up across them
        let per_line = Correction {
            freedom: Freedom::PerLine,
            ..how
        };
        let field = drawn(&path);
        let own = SpeedProfile::of(&path, 0.1);
        let lines = Wishes::of(&field, &aim(), &depth).corrected(&own, &path, &per_line);
        let of_line = |n: usize| &lines.factors()[n * 23..n * 23 + 22];
        assert!(of_line(0).iter().all(|f| (f - of_line(0)[0]).abs() < 1e-12));
        assert!(of_line(35)[0] > of_line(10)[0]);
    }

    /// Bounds hold, jumps keep their factor, and places that no beam reached do not ask for all at once.
    #[test]
    fn corrections_keep_to_their_bounds() {
        let path = square();
        let cold = drawn(&path);
        let cold = Field {
            values: vec![START as f32; cold.values.len()],
            ..cold
        };
        let how = |most: f64| Correction {
            gain: 1.0,
            reach: 0.1,
            powers: [0.5, most],
            freedom: Freedom::Continuous,
        };
        let profile = SpeedProfile::of(&path, 0.1);
        let wishes = Wishes::of(&cold, &aim(), &depth);
        for (most, wanted) in [(1.2, 1.0 / 1.2), (9.0, (-MOST).exp())] {
            let next = wishes.corrected(&profile, &path, &how(most));
            let least = next.factors().iter().copied().fold(f64::INFINITY, f64::min);
            assert!((least - wanted).abs() < 1e-9, "{least} {wanted}");
        }
        let rim = Rim {
            melting: 1900.0,
            beyond: 0.1,
            width: 0.1,
        };
        assert!(matches!(
            Aim::new(START, 1850.0, rim),
            Err(StrategyError::Aim { .. })
        ));
    }
}
