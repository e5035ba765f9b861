//! How well a model's prediction meets a record that it has not seen.
//!
//! L. Ljung, "System Identification: Theory for the User", 2nd ed., chapter 16.

use serde::{Deserialize, Serialize};

/// How well a prediction meets a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// 1 − |error|/|deviation of the record from its mean|: 1 is perfect, 0 no better than the mean.
    pub fit: f64,
    /// Root mean square error, in the record's unit.
    pub rms: f64,
    /// The error below which 50, 90 and 99 % of the samples lie, in the record's unit.
    pub percentiles: [f64; 3],
    /// Autocorrelation of the error at lags 1…25, 1 being its power.
    pub autocorrelation: Vec<f64>,
    /// The level that 99 % of the autocorrelations of white noise stay below.
    pub confidence: f64,
    /// Share of the lags beyond that level: near 0.01 for a model that explains all but white noise.
    pub coloured: f64,
}

impl Quality {
    /// Compares a prediction with the record it predicts; `None` when lengths differ or fewer than 2 samples are given.
    pub fn of(predicted: &[f64], measured: &[f64]) -> Option<Self> {
        const LAGS: usize = 25;
        let n = measured.len();
        if predicted.len() != n || n < 2 {
            return None;
        }
        let mean = measured.iter().sum::<f64>() / n as f64;
        let error: Vec<f64> = measured.iter().zip(predicted).map(|(m, p)| m - p).collect();
        let power = |x: &mut dyn Iterator<Item = f64>| x.map(|v| v * v).sum::<f64>();
        let left = power(&mut error.iter().copied());
        let spread = power(&mut measured.iter().map(|m| m - mean));
        let mut sorted: Vec<f64> = error.iter().map(|e| e.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| sorted[((share * n as f64) as usize).min(n - 1)];
        let autocorrelation: Vec<f64> = (1..=LAGS.min(n - 1))
            .map(|lag| {
                let sum: f64 = (lag..n).map(|t| error[t] * error[t - lag]).sum();
                if left > 0.0 { sum / left } else { 0.0 }
            })
            .collect();
        let confidence = 2.576 / (n as f64).sqrt();
        let beyond = autocorrelation
            .iter()
            .filter(|r| r.abs() > confidence)
            .count();
        Some(Quality {
            fit: if spread > 0.0 {
                1.0 - (left / spread).sqrt()
            } else {
                f64::NAN
            },
            rms: (left / n as f64).sqrt(),
            percentiles: [at(0.5), at(0.9), at(0.99)],
            coloured: beyond as f64 / autocorrelation.len().max(1) as f64,
            autocorrelation,
            confidence,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    /// A record, and the same with white noise of deviation 0.1 on it.
    fn record() -> (Vec<f64>, Vec<f64>) {
        let mut random = Random::new(3);
        let truth: Vec<f64> = (0..4000).map(|k| f64::sin(0.01 * f64::from(k))).collect();
        let seen = truth.iter().map(|v| v + 0.1 * random.normal()).collect();
        (truth, seen)
    }

    #[test]
    fn white_noise_is_all_that_a_good_model_leaves() {
        let (truth, seen) = record();
        let q = Quality::of(&truth, &seen).unwrap();
        assert!((q.rms / 0.1 - 1.0).abs() < 0.05, "{q:?}");
        assert!((q.fit - (1.0 - 0.1 / 0.51f64.sqrt())).abs() < 0.01, "{q:?}");
        assert!((q.percentiles[1] / 0.1645 - 1.0).abs() < 0.05, "{q:?}");
        assert!(q.coloured <= 0.08, "{q:?}");
    }

    #[test]
    fn a_model_that_misses_something_leaves_colour() {
        let (truth, seen) = record();
        let lagging: Vec<f64> = (0..seen.len())
            .map(|k| truth[k.saturating_sub(30)])
            .collect();
        let q = Quality::of(&lagging, &seen).unwrap();
        assert!(q.coloured > 0.5 && q.fit < 0.75, "{q:?}");
        // no better than the mean, and worse
        assert!(
            Quality::of(&vec![0.0; seen.len()], &seen)
                .unwrap()
                .fit
                .abs()
                < 0.01
        );
        assert!(Quality::of(&truth[1..], &seen).is_none());
    }

    /// Errors 1, −1, 1, −1: each lag has one pair less, and the sign of its parity.
    #[test]
    fn short_records_have_the_lags_they_have() {
        let error = [1.0, -1.0, 1.0, -1.0];
        let q = Quality::of(&[0.0; 4], &error).unwrap();
        assert_eq!(q.autocorrelation, [-0.75, 0.5, -0.25]);
        assert!((q.confidence - 1.288).abs() < 1e-12 && q.coloured == 0.0);
        assert_eq!(
            Quality::of(&[0.0; 60], &[1.0; 60])
                .unwrap()
                .autocorrelation
                .len(),
            25
        );
    }
}
