//! How a model goes over its parameters: a smooth course of each prediction, and its roughness about that.
//!
//! A model in cells goes by steps: what it says at one place is the smooth course and a step's rest. The course is a quadratic through all places
//! that were looked at, by least squares, those about a middle counting most. What it leaves is the roughness of the model: another uncertainty of
//! each comparison, beside the measurement's. Assumed: over that reach the course is a quadratic, and steps are as large everywhere in it.

use meltpath_numerics::least_squares::{LeastSquaresError, Regression, Solution};

/// What a model predicts at a place.
pub(super) type There = (Vec<f64>, Vec<f64>);

/// Places that count, over the numbers of a quadratic: with fewer, its reach is widened.
const COUNTED: f64 = 2.0;
/// By how much.
const WIDENED: f64 = 1.2;

/// How many numbers a quadratic of so many parameters has.
pub(super) fn numbers(parameters: usize) -> usize {
    (parameters + 1) * (parameters + 2) / 2
}

/// 1, each number, and each product of two.
fn terms(at: &[f64]) -> Vec<f64> {
    let mut all = vec![1.0];
    all.extend(at);
    for (i, a) in at.iter().enumerate() {
        all.extend(at[i..].iter().map(|b| a * b));
    }
    all
}

/// The smooth course of each prediction.
pub(super) struct Course {
    middle: Vec<f64>,
    reach: Vec<f64>,
    /// Of each prediction.
    coefficients: Vec<Vec<f64>>,
    /// Of each prediction a standard deviation: how far the model is from its course, and the course from where more places would lay it.
    pub(super) roughness: Vec<f64>,
}

impl Course {
    /// The course about `middle` through `places`, which count less from `reach` on.
    ///
    /// # Errors
    /// [`LeastSquaresError`] where places are too few or fall together.
    pub(super) fn new(
        places: &[There],
        middle: &[f64],
        reach: &[f64],
    ) -> Result<Self, LeastSquaresError> {
        let numbers = numbers(middle.len());
        let most = (places.len() as f64).min(COUNTED * numbers as f64);
        let mut course = Course {
            middle: middle.to_vec(),
            reach: reach.to_vec(),
            coefficients: Vec::new(),
            roughness: Vec::new(),
        };
        let mut weights = course.weights(places);
        // all places count wholly in the end: so far it has to go where that many are there only
        while weights.iter().sum::<f64>() < 0.98 * most {
            course.reach.iter_mut().for_each(|r| *r *= WIDENED);
            weights = course.weights(places);
        }
        let rows: Vec<Vec<f64>> = places.iter().map(|p| terms(&course.at(&p.0))).collect();
        let count = places.first().map_or(0, |p| p.1.len());
        let mut left = 0.0;
        let mut open = 0.0;
        for k in 0..count {
            let mut through = Regression::new(numbers);
            for ((row, w), (_, predicted)) in rows.iter().zip(&weights).zip(places) {
                let root = w.sqrt();
                through.push(row.iter().map(|t| root * t), root * predicted[k]);
            }
            let Solution { values, spread, .. } = through.solve()?;
            if k == 0 {
                // how the course at one place hangs on what was found at another: the same for all predictions
                let hangs = |at: &[f64], n: usize| -> f64 {
                    let along = |i: usize| -> f64 {
                        (0..numbers).map(|j| spread[(i, j)] * rows[n][j]).sum()
                    };
                    let sum: f64 = (0..numbers).map(|i| at[i] * along(i)).sum();
                    weights[n] * sum
                };
                for (n, row) in rows.iter().enumerate() {
                    let all: Vec<f64> = (0..rows.len()).map(|m| hangs(row, m)).collect();
                    let squares: f64 = all.iter().map(|h| h * h).sum();
                    left += weights[n] * (1.0 - 2.0 * all[n] + squares);
                }
                let here = terms(&vec![0.0; middle.len()]);
                open = (0..rows.len()).map(|n| hangs(&here, n).powi(2)).sum();
            }
            let off =
                |(n, p): (usize, &There)| weights[n] * (p.1[k] - sum(&values, &rows[n])).powi(2);
            let squares: f64 = places.iter().enumerate().map(off).sum();
            let rough = (squares / left.max(f64::MIN_POSITIVE)).sqrt();
            course.roughness.push(rough * (1.0 + open).sqrt());
            course.coefficients.push(values);
        }
        Ok(course)
    }

    /// What each place counts: wholly in the middle, half at the reach.
    fn weights(&self, places: &[There]) -> Vec<f64> {
        let squares = |p: &There| self.at(&p.0).iter().map(|x| x * x).sum::<f64>();
        places
            .iter()
            .map(|p| 1.0 / (1.0 + squares(p).powi(2)))
            .collect()
    }

    /// Where `values` lie about the middle, over the reach.
    fn at(&self, values: &[f64]) -> Vec<f64> {
        let each = values.iter().zip(&self.middle).zip(&self.reach);
        each.map(|((v, m), r)| (v - m) / r).collect()
    }

    /// What the course predicts at `values`.
    pub(super) fn predicted(&self, values: &[f64]) -> Vec<f64> {
        let terms = terms(&self.at(values));
        self.coefficients.iter().map(|c| sum(c, &terms)).collect()
    }
}

fn sum(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(count: u32) -> Vec<Vec<f64>> {
        let at = |n: u32| {
            [0.755, 0.57]
                .iter()
                .map(|s| (f64::from(n) * s).fract())
                .collect()
        };
        (1..=count).map(at).collect()
    }

    fn course(model: &dyn Fn(&[f64]) -> f64, count: u32) -> Course {
        let all: Vec<There> = places(count)
            .into_iter()
            .map(|p| (p.clone(), vec![model(&p)]))
            .collect();
        Course::new(&all, &[0.5, 0.5], &[0.5, 0.5]).unwrap()
    }

    /// A quadratic is its own course; steps have the roughness of a rounding, 0.29 of a step, and what few places leave open of the course.
    #[test]
    fn quadratics_are_smooth_and_steps_are_rough() {
        let smooth = |p: &[f64]| 1.0 + 2.0 * p[0] - 0.5 * p[0] * p[1] + p[1] * p[1];
        let found = course(&smooth, 17);
        assert!(found.roughness[0] < 1e-12);
        for place in [[0.2, 0.9], [1.4, -0.3]] {
            let told = found.predicted(&place)[0];
            assert!((told - smooth(&place)).abs() < 1e-12, "{told}");
        }
        let (tries, count) = (200, 25);
        let (mut squares, mut off) = (0.0, 0.0);
        for n in 0..tries {
            let phase = f64::from(n) / f64::from(tries);
            let stepped = move |p: &[f64]| 0.05 * (smooth(p) / 0.05 + phase).round() - 0.05 * phase;
            let found = course(&stepped, count);
            squares += found.roughness[0].powi(2) / f64::from(tries);
            off +=
                (found.predicted(&[0.5, 0.5])[0] - smooth(&[0.5, 0.5])).powi(2) / f64::from(tries);
        }
        // the places lie about the middle for six numbers: about a quarter of one of them, squared
        let rounding = 0.05 / 12.0_f64.sqrt();
        let [rough, off] = [squares, off].map(|s| s.sqrt() / rounding);
        assert!((1.0..1.3).contains(&rough), "{rough}");
        assert!(off < 0.5, "{off}");
    }

    /// A bend beyond a quadratic far from the middle counts little there.
    #[test]
    fn places_about_the_middle_count_most() {
        let kinked = |p: &[f64]| p[0].max(0.8) + p[1];
        let told = |reach: f64| {
            let all: Vec<There> = places(60)
                .into_iter()
                .map(|p| (p.clone(), vec![kinked(&p)]))
                .collect();
            let course = Course::new(&all, &[0.3, 0.5], &[reach; 2]).unwrap();
            (course.predicted(&[0.3, 0.5])[0] - 1.3).abs()
        };
        let [near, far] = [0.25, 2.0].map(told);
        assert!(near < 0.3 * far && far > 1e-3, "{near} {far}");
    }
}
