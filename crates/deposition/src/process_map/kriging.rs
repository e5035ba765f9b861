//! Sizes of measured beads as a law that knows its own uncertainty: a trend in the settings, and where it helps a Gaussian process
//! around that trend (universal kriging). Power law, quadratic and Gaussian process are one calculation with other trends.
//!
//! Errors are those of beads left out, in closed form (Dubrule 1983); the scale of the uncertainty is set so that beads left out
//! scatter as it says. The process is one and the same for all beads: choosing it by their likelihood (Rasmussen and Williams 2006,
//! § 5.4) made intervals that held 81 to 88 % where 90 % were promised.

use std::collections::{BTreeMap, BTreeSet};

use meltpath_numerics::Matrix;
use meltpath_numerics::dense::Factored;

use super::import::MeasuredBead;

/// The form of a law through measured beads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// ln(size) linear in the logarithms of both speeds.
    PowerLaw,
    /// Size quadratic in both speeds (Rouchon 2022, eq. 2.1, 2.2).
    Quadratic,
    /// The power law with a Gaussian process around it.
    GaussianProcess,
}

impl Form {
    /// All of them.
    pub(super) const ALL: [Form; 3] = [Form::PowerLaw, Form::Quadratic, Form::GaussianProcess];

    /// Its name.
    pub(super) fn words(self) -> &'static str {
        match self {
            Form::PowerLaw => "power law",
            Form::Quadratic => "quadratic",
            Form::GaussianProcess => "Gaussian process",
        }
    }

    /// How many numbers are taken from the beads; there must be more beads than that. A process takes more than its trend: as many as
    /// a quadratic.
    pub(super) fn coefficients(self) -> usize {
        match self {
            Form::PowerLaw => 3,
            Form::Quadratic | Form::GaussianProcess => 6,
        }
    }

    fn is_logarithmic(self) -> bool {
        self != Form::Quadratic
    }

    /// The terms of the trend.
    fn trend(self, [u, v]: [f64; 2]) -> Vec<f64> {
        match self {
            Form::PowerLaw | Form::GaussianProcess => vec![1.0, u, v],
            Form::Quadratic => vec![1.0, u, v, u * u, v * v, u * v],
        }
    }
}

/// The settings of a bead, m/min, one of its sizes, mm, and the measurement it belongs to: rows of one law are left out together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    pub(super) settings: [f64; 2],
    pub(super) size: f64,
    pub(super) group: usize,
}

impl Sample {
    pub(super) fn of(bead: &MeasuredBead, group: usize, size: f64) -> Self {
        Sample {
            settings: [bead.wire_feed, bead.travel_speed],
            size,
            group,
        }
    }
}

/// Range of the process along both speeds, in halves of the measured range.
const RANGE: f64 = 1.6;

/// Variance of the process, in those of a bead's scatter.
const VARIANCE: f64 = 16.0;

/// A law of one size through measured beads.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    form: Form,
    /// Middle and half width of the settings, in the logarithm where the form is logarithmic.
    middle: [f64; 2],
    half: [f64; 2],
    points: Vec<[f64; 2]>,
    /// The inverse of the kriging system, and its product with the sizes.
    inverse: Matrix,
    weights: Vec<f64>,
    /// Standard deviation of a bead in units of the system, widened by Student's t for the few beads it was found with.
    scale: f64,
    /// Root mean square of the relative errors of beads left out.
    pub left_out: f64,
}

/// What leaving beads out showed.
struct LeftOut {
    /// Root mean square of the relative errors.
    relative: f64,
    /// Standard deviation in units of the system.
    scale: f64,
}

impl Fit {
    /// The law of `form` through `samples`; `None` where there are not more measurements than coefficients, or where their settings
    /// do not span the trend.
    pub(super) fn new(form: Form, samples: &[Sample]) -> Option<Self> {
        let groups: BTreeSet<usize> = samples.iter().map(|s| s.group).collect();
        let freedom = groups.len().checked_sub(form.coefficients())?;
        if freedom == 0 {
            return None;
        }
        let speed = |x: f64| if form.is_logarithmic() { x.ln() } else { x };
        let (mut middle, mut half) = ([0.0; 2], [0.0; 2]);
        for i in 0..2 {
            let along = samples.iter().map(|s| speed(s.settings[i]));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            });
            (middle[i], half[i]) = (0.5 * (low + high), 0.5 * (high - low));
        }
        if half.iter().any(|h| *h <= 0.0) {
            return None;
        }
        let mut fit = Fit {
            form,
            middle,
            half,
            points: Vec::new(),
            inverse: Matrix::zeros(0, 0),
            weights: Vec::new(),
            scale: 0.0,
            left_out: 0.0,
        };
        fit.points = samples
            .iter()
            .map(|s| fit.place(s.settings[0], s.settings[1]))
            .collect();
        let n = samples.len();
        let trends: Vec<Vec<f64>> = fit.points.iter().map(|p| form.trend(*p)).collect();
        let terms = trends[0].len();
        let system = Matrix::from_fn(n + terms, n + terms, |i, j| match (i < n, j < n) {
            (true, true) => {
                let own = if i == j {
                    fit.scatter(samples[i].size)
                } else {
                    0.0
                };
                own + fit.covariance(fit.points[i], fit.points[j])
            }
            (true, false) => trends[i][j - n],
            (false, true) => trends[j][i - n],
            (false, false) => 0.0,
        });
        let factored = Factored::new(&system).ok()?;
        // settings on a line leave pivots of rounding only
        if factored.pivot_ratio() > 1e13 {
            return None;
        }
        let sizes: Vec<f64> = samples.iter().map(|s| fit.written(s.size)).collect();
        fit.inverse = factored.inverse();
        fit.weights = (0..n + terms)
            .map(|i| (0..n).map(|j| fit.inverse[(i, j)] * sizes[j]).sum())
            .collect();
        let left_out = fit.leave_out(samples)?;
        fit.left_out = left_out.relative;
        fit.scale = left_out.scale * student(freedom) / NORMAL;
        Some(fit)
    }

    /// Each measurement predicted from the others: with B the block of the inverse that belongs to it, its errors are B⁻¹ times its
    /// weights, and their covariance is B⁻¹.
    fn leave_out(&self, samples: &[Sample]) -> Option<LeftOut> {
        let mut groups = BTreeMap::<usize, Vec<usize>>::new();
        for (row, sample) in samples.iter().enumerate() {
            groups.entry(sample.group).or_default().push(row);
        }
        let (mut relative, mut squares) = (0.0, 0.0);
        for rows in groups.values() {
            let m = rows.len();
            let block = Matrix::from_fn(m, m, |i, j| self.inverse[(rows[i], rows[j])]);
            let covariance = Factored::new(&block).ok()?.inverse();
            for (i, row) in rows.iter().enumerate() {
                let error: f64 = (0..m)
                    .map(|j| covariance[(i, j)] * self.weights[rows[j]])
                    .sum();
                let variance = covariance[(i, i)];
                if variance <= 0.0 {
                    return None;
                }
                let size = samples[*row].size;
                relative += if self.form.is_logarithmic() {
                    error * error
                } else {
                    (error / size).powi(2)
                };
                squares += error * error / variance;
            }
        }
        let n = samples.len() as f64;
        // beads that a law meets exactly still scatter by rounding
        Some(LeftOut {
            relative: (relative / n).sqrt(),
            scale: (squares / n).max(1e-20).sqrt(),
        })
    }

    fn place(&self, wire_feed: f64, travel_speed: f64) -> [f64; 2] {
        let scaled = |x: f64, i: usize| {
            let x = if self.form.is_logarithmic() {
                x.ln()
            } else {
                x
            };
            (x - self.middle[i]) / self.half[i]
        };
        [scaled(wire_feed, 0), scaled(travel_speed, 1)]
    }

    /// A size as the law has it.
    fn written(&self, size: f64) -> f64 {
        if self.form.is_logarithmic() {
            size.ln()
        } else {
            size
        }
    }

    /// The variance of one bead: beads scatter in proportion to their size.
    fn scatter(&self, size: f64) -> f64 {
        if self.form.is_logarithmic() {
            1.0
        } else {
            size * size
        }
    }

    /// What two places share beyond the trend.
    fn covariance(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        if self.form != Form::GaussianProcess {
            return 0.0;
        }
        let part = |i: usize| ((a[i] - b[i]) / RANGE).powi(2);
        VARIANCE * (-0.5 * (part(0) + part(1))).exp()
    }

    /// What a place shares with each bead, and its trend.
    fn row(&self, at: [f64; 2]) -> Vec<f64> {
        let shared = self.points.iter().map(|p| self.covariance(at, *p));
        shared.chain(self.form.trend(at)).collect()
    }

    /// The size at settings in m/min, mm; not a number where a quadratic falls below zero.
    pub fn at(&self, wire_feed: f64, travel_speed: f64) -> f64 {
        let row = self.row(self.place(wire_feed, travel_speed));
        let value: f64 = row.iter().zip(&self.weights).map(|(a, b)| a * b).sum();
        match self.form {
            Form::PowerLaw | Form::GaussianProcess => value.exp(),
            Form::Quadratic if value > 0.0 => value,
            Form::Quadratic => f64::NAN,
        }
    }

    /// Relative standard uncertainty of a bead of these settings: ± 1.645 of it hold nine beads in ten.
    pub fn relative_sigma(&self, wire_feed: f64, travel_speed: f64) -> f64 {
        let at = self.place(wire_feed, travel_speed);
        let row = self.row(at);
        let size = self.at(wire_feed, travel_speed);
        let known: f64 = row
            .iter()
            .enumerate()
            .map(|(i, a)| {
                let products = self.inverse.row_slice(i).iter().zip(&row);
                a * products.map(|(m, b)| m * b).sum::<f64>()
            })
            .sum();
        let variance = self.scatter(size) + self.covariance(at, at) - known;
        let sigma = self.scale * variance.max(0.0).sqrt();
        if self.form.is_logarithmic() {
            sigma
        } else {
            sigma / size.abs()
        }
    }
}

/// Half width of the interval that holds nine tenths of a normal distribution, in standard deviations.
const NORMAL: f64 = 1.644_853_626_951_472_2;

/// The same of Student's t with `freedom` degrees of freedom: expansion of Fisher and Cornish from three on.
fn student(freedom: usize) -> f64 {
    let (z, n) = (NORMAL, freedom as f64);
    match freedom {
        0 => f64::INFINITY,
        1 => 6.313_751_514_675_043,
        2 => 2.919_985_580_353_725,
        _ => {
            z + (z.powi(3) + z) / (4.0 * n)
                + (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * n * n)
                + (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z)
                    / (384.0 * n.powi(3))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(size: impl Fn(f64, f64) -> f64) -> Vec<Sample> {
        let mut samples = Vec::new();
        for feed in [2.0, 4.0, 6.0, 8.0, 10.0] {
            for travel in [0.5, 1.0, 1.5] {
                samples.push(Sample {
                    settings: [feed, travel],
                    size: size(feed, travel),
                    group: samples.len(),
                });
            }
        }
        samples
    }

    /// Coefficients that a quadratic was made with come back: it predicts what they say, and says that it is certain.
    #[test]
    fn waam_ac7_known_coefficients_come_back() {
        let width =
            |f: f64, t: f64| 1.5 + 0.8 * f - 2.1 * t - 0.02 * f * f + 0.7 * t * t + 0.11 * f * t;
        let mut samples = samples(width);
        let fit = Fit::new(Form::Quadratic, &samples).unwrap();
        for (feed, travel) in [(2.0, 0.5), (3.3, 0.8), (9.1, 1.4)] {
            assert!((fit.at(feed, travel) - width(feed, travel)).abs() < 1e-9);
            assert!(fit.relative_sigma(feed, travel) < 1e-8);
        }
        samples[0].size += 1.0;
        let worse = Fit::new(Form::Quadratic, &samples).unwrap();
        assert!(worse.left_out > 0.05, "{}", worse.left_out);
        assert!(worse.relative_sigma(6.0, 1.0) > 0.05);
    }

    /// Settings that hardly vary lose no digits: the law is told round their middle.
    #[test]
    fn a_narrow_range_far_from_zero_gives_its_law_back() {
        // at their middle 5, falling by a half from end to end of either range
        let width = |f: f64, t: f64| 5.0 - 2.0 * (f - 20.0) - 4.0 * (t - 3.0) * (t - 2.9);
        let mut samples = Vec::new();
        for feed in [19.95, 19.97, 20.0, 20.02, 20.05] {
            for travel in [2.98, 3.0, 3.02] {
                samples.push(Sample {
                    settings: [feed, travel],
                    size: width(feed, travel),
                    group: samples.len(),
                });
            }
        }
        let fit = Fit::new(Form::Quadratic, &samples).unwrap();
        for (feed, travel) in [(19.96, 2.99), (20.01, 3.015)] {
            assert!((fit.at(feed, travel) - width(feed, travel)).abs() < 1e-10);
        }
    }

    #[test]
    fn no_more_beads_than_coefficients_are_refused() {
        let all = samples(|f, t| f / t);
        // six beads at settings that span the six terms
        let six: Vec<Sample> = [0, 2, 4, 7, 9, 14].map(|k| all[k]).to_vec();
        assert!(Fit::new(Form::Quadratic, &six).is_none());
        assert!(Fit::new(Form::GaussianProcess, &six).is_none());
        let power = Fit::new(Form::PowerLaw, &six).unwrap();
        assert!((power.at(5.0, 0.7) / (5.0 / 0.7) - 1.0).abs() < 1e-9);
        // five rows of one measurement are one measurement
        let together: Vec<Sample> = all
            .iter()
            .map(|s| Sample {
                group: s.group / 5,
                ..*s
            })
            .collect();
        assert!(Fit::new(Form::PowerLaw, &together).is_none());
        // settings on a line span no trend
        let line: Vec<Sample> = all.into_iter().filter(|s| s.settings[1] == 0.5).collect();
        assert!(Fit::new(Form::PowerLaw, &line).is_none());
    }

    /// The closed form says what leaving a bead out and fitting anew says.
    #[test]
    fn beads_left_out_are_predicted_by_the_others() {
        let wavy = |f: f64, t: f64| {
            (f / t).sqrt() * (1.0 + 0.1 * (f * 1.7).sin() + 0.05 * (t * 9.0).cos())
        };
        let samples = samples(wavy);
        for form in [Form::PowerLaw, Form::Quadratic] {
            let squares: f64 = (0..samples.len())
                .map(|k| {
                    let mut others = samples.clone();
                    let left = others.remove(k);
                    // the spread of the settings is that of all, as corners leave more than they are
                    let fit = Fit::new(form, &others).unwrap();
                    let predicted = fit.at(left.settings[0], left.settings[1]);
                    if form.is_logarithmic() {
                        (predicted / left.size).ln().powi(2)
                    } else {
                        (predicted / left.size - 1.0).powi(2)
                    }
                })
                .sum();
            let told = Fit::new(form, &samples).unwrap().left_out;
            let found = (squares / samples.len() as f64).sqrt();
            assert!(
                (told / found - 1.0).abs() < 1e-9,
                "{form:?}: {told} {found}"
            );
        }
        let groups: Vec<Sample> = samples
            .iter()
            .map(|s| Sample {
                group: s.group / 3,
                ..*s
            })
            .collect();
        let squares: f64 = (0..5)
            .flat_map(|g| {
                let (left, others): (Vec<_>, Vec<_>) =
                    groups.iter().copied().partition(|s| s.group == g);
                let fit = Fit::new(Form::PowerLaw, &others);
                left.into_iter().map(move |s| {
                    fit.as_ref().map_or(f64::NAN, |f| {
                        (f.at(s.settings[0], s.settings[1]) / s.size).ln().powi(2)
                    })
                })
            })
            .sum();
        let told = Fit::new(Form::PowerLaw, &groups).unwrap().left_out;
        let found = (squares / 15.0).sqrt();
        assert!((told / found - 1.0).abs() < 1e-9, "{told} {found}");
    }

    #[test]
    fn quantiles_are_those_of_tables() {
        for (freedom, t) in [
            (1, 6.3138),
            (2, 2.9200),
            (3, 2.3534),
            (5, 2.0150),
            (10, 1.8125),
            (30, 1.6973),
        ] {
            assert!((student(freedom) / t - 1.0).abs() < 4e-3, "{freedom}");
        }
    }
}
