//! How a model goes about a place: slopes and roughness of its predictions.
//!
//! A model in cells goes by steps. A difference over less than a step is a jump or nothing: slopes that are many times too steep, and
//! uncertainties as many times too small. Slopes are those of a parabola through seven places over the prior's uncertainty on both sides, and
//! what it leaves is the roughness of the model: another uncertainty of each comparison, beside the measurement's. Assumed: the model's smooth
//! course is a parabola over that reach, and its steps are as large elsewhere in it.

use meltpath_numerics::least_squares::{LeastSquaresError, Regression};

/// Places about a middle, over the reach of a parameter: unevenly, so that no step of a model hides between them.
pub(super) const PLACES: [f64; 6] = [-1.0, -0.62, -0.27, 0.35, 0.71, 1.0];
/// Unknowns of a parabola.
const PARABOLA: usize = 3;
/// Least reach, as a share of the prior's uncertainty.
const LEAST_REACH: f64 = 0.3;
/// Least reach, over what the roughness hides of a parameter.
const OVER_ROUGHNESS: f64 = 4.0;

/// Where to look at a model about `values`: places of each parameter after the other, as far as `reach` or the `bounds`.
pub(super) fn places(values: &[f64], bounds: &[[f64; 2]], reach: &[f64]) -> Vec<Vec<f64>> {
    let along = |k: usize| {
        let [low, high] = bounds[k];
        // where a bound is near: as wide, about a place farther inside
        let half = 0.5 * (low + high);
        let about = values[k].clamp((low + reach[k]).min(half), (high - reach[k]).max(half));
        PLACES.map(|place| {
            let mut moved = values.to_vec();
            moved[k] = (about + place * reach[k]).clamp(low, high);
            moved
        })
    };
    (0..values.len()).flat_map(along).collect()
}

/// How a model goes about a middle: a parabola of each prediction along each parameter.
pub(super) struct Course {
    middle: Vec<f64>,
    /// How far it was looked at, of each parameter.
    reach: Vec<f64>,
    /// First and second coefficients, over the reach: of each prediction, of each parameter.
    bends: Vec<Vec<[f64; 2]>>,
    /// What parabolas leave of each prediction, a standard deviation: its own, or that of all as shares of what they predict, whichever is larger.
    pub(super) roughness: Vec<f64>,
}

impl Course {
    /// The course about `values`, where the model predicts `predicted`, from what it `found` at the [`places`] within `reach`.
    ///
    /// # Errors
    /// [`LeastSquaresError`] where places fall together or predictions are not finite.
    pub(super) fn new(
        (values, predicted): (&[f64], &[f64]),
        reach: Vec<f64>,
        (places, found): (&[Vec<f64>], &[Vec<f64>]),
    ) -> Result<Self, LeastSquaresError> {
        let mut bends = vec![vec![[0.0; 2]; values.len()]; predicted.len()];
        let mut left = vec![0.0; predicted.len()];
        let along = places.chunks(PLACES.len()).zip(found.chunks(PLACES.len()));
        for (k, (places, found)) in along.enumerate() {
            let at = |moved: &Vec<f64>| (moved[k] - values[k]) / reach[k];
            for (n, here) in predicted.iter().enumerate() {
                let there = places.iter().map(at).zip(found.iter().map(|f| f[n]));
                let all: Vec<(f64, f64)> = there.chain([(0.0, *here)]).collect();
                let (bend, squares) = parabola(&all)?;
                bends[n][k] = bend;
                left[n] += squares;
            }
        }
        let freedom = (values.len() * (PLACES.len() + 1 - PARABOLA)) as f64;
        let own = |left: &f64| (left / freedom).sqrt();
        let shares = left.iter().zip(predicted).filter(|(_, p)| **p != 0.0);
        let squares: Vec<f64> = shares.map(|(left, p)| (own(left) / p).powi(2)).collect();
        let share = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        let rough = |(left, p): (&f64, &f64)| own(left).max(share * p.abs());
        Ok(Course {
            middle: values.to_vec(),
            reach,
            bends,
            roughness: left.iter().zip(predicted).map(rough).collect(),
        })
    }

    /// Where `values` lie over the reach of parameter `k`.
    fn at(&self, values: &[f64], k: usize) -> f64 {
        (values[k] - self.middle[k]) / self.reach[k]
    }

    /// Whether `values` lie well within what was looked at.
    pub(super) fn covers(&self, values: &[f64]) -> bool {
        (0..values.len()).all(|k| self.at(values, k).abs() <= 0.5)
    }

    /// `∂ prediction / ∂ parameter` at `values`.
    pub(super) fn slopes(&self, values: &[f64]) -> Vec<Vec<f64>> {
        let of = |row: &Vec<[f64; 2]>| {
            let slope = |(k, [b, c]): (usize, &[f64; 2])| {
                (b + 2.0 * c * self.at(values, k)) / self.reach[k]
            };
            row.iter().enumerate().map(slope).collect()
        };
        self.bends.iter().map(of).collect()
    }

    /// How far to look next, of parameters that are known by `sigmas` now and were by `before`: as far as they are known, but farther than
    /// steps of the model hide.
    pub(super) fn next_reach(&self, sigmas: &[f64], before: &[f64]) -> Vec<f64> {
        let of = |(k, (now, before)): (usize, (&f64, &f64))| {
            let each = self.bends.iter().zip(&self.roughness);
            // of the measurement that tells most of it
            let hidden = each
                .map(|(row, rough)| rough * self.reach[k] / row[k][0].abs())
                .fold(f64::INFINITY, f64::min);
            let least = (LEAST_REACH * before).max(OVER_ROUGHNESS * hidden);
            now.max(least).min(*before)
        };
        sigmas.iter().zip(before).enumerate().map(of).collect()
    }
}

/// First and second coefficients of the parabola through places and values, and the sum of squares that it leaves.
fn parabola(all: &[(f64, f64)]) -> Result<([f64; 2], f64), LeastSquaresError> {
    let mut through = Regression::new(PARABOLA);
    for (x, y) in all {
        through.push([1.0, *x, x * x], *y);
    }
    let found = through.solve()?.values;
    let (a, b, c) = (found[0], found[1], found[2]);
    let off = |(x, y): &(f64, f64)| (y - (a + x * (b + x * c))).powi(2);
    Ok(([b, c], all.iter().map(off).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(model: &dyn Fn(f64) -> f64, at: f64, reach: f64) -> Course {
        let bounds = [[0.0, 2.0]];
        let places = places(&[at], &bounds, &[reach]);
        let found: Vec<Vec<f64>> = places.iter().map(|p| vec![model(p[0])]).collect();
        Course::new((&[at], &[model(at)]), vec![reach], (&places, &found)).unwrap()
    }

    /// A parabola has its slopes everywhere and no roughness, beside a bound too; steps have that of a rounding, 0.29 of a step.
    #[test]
    fn parabolas_are_smooth_and_steps_are_rough() {
        let smooth = |p: f64| 1.0 + 2.0 * p - 0.5 * p * p;
        for at in [1.0, 1.95] {
            let found = course(&smooth, at, 0.3);
            assert!(found.roughness[0] < 1e-12);
            for p in [at, 0.9] {
                let slope = found.slopes(&[p])[0][0];
                assert!((slope - (2.0 - p)).abs() < 1e-9, "{at} {p}: {slope}");
            }
            assert!(found.covers(&[at - 0.1]) && !found.covers(&[at - 0.2]));
        }
        let tries = 200;
        let (mut squares, mut slopes) = (0.0, 0.0);
        for n in 0..tries {
            let phase = f64::from(n) / f64::from(tries);
            let stepped = move |p: f64| 0.05 * (2.0 * p / 0.05 + phase).round();
            let found = course(&stepped, 1.0, 0.3);
            squares += found.roughness[0].powi(2) / f64::from(tries);
            slopes += found.slopes(&[1.0])[0][0] / f64::from(tries);
        }
        let rounding = 0.05 / 12.0_f64.sqrt();
        assert!((squares.sqrt() / rounding - 1.0).abs() < 0.2, "{squares}");
        assert!((slopes - 2.0).abs() < 0.02, "{slopes}");
    }
}
