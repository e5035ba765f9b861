//! Straight lines over the contact tube distance.

use meltpath_numerics::least_squares::Regression;
use meltpath_perception::arc::steady::Mean;

/// Greatest less least.
pub(super) fn span(values: impl Iterator<Item = f64>) -> f64 {
    let [low, high] = ends(values);
    high - low
}

/// Least and greatest.
pub(super) fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    })
}

/// A straight line of least squares.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// Distance at which it has its value, mm.
    pub reference: f64,
    /// Value there, and its standard uncertainty.
    pub value: [f64; 2],
    /// Change per mm, and its standard uncertainty.
    pub slope: [f64; 2],
    /// Covariance of both.
    covariance: f64,
    /// Greatest distance of a mean from it.
    pub off: f64,
}

impl Fitted {
    /// The line through means at distances, mm, that are known to `sigma` mm.
    ///
    /// What a mean leaves open is how much it scatters along its bead, and what the distance leaves open along the line; or, where that is
    /// more, what the means leave of the line. `None` where the distances are one.
    pub(super) fn of(points: &[(f64, Mean)], reference: f64, sigma: f64) -> Option<Self> {
        let mut line = Regression::new(2);
        for (distance, mean) in points {
            line.push([1.0, distance - reference], mean.value);
        }
        let found = line.solve().ok()?;
        let (value, slope) = (found.values[0], found.values[1]);
        let squares = points
            .iter()
            .map(|(_, m)| m.scatter.powi(2) + (slope * sigma).powi(2));
        let open = squares.sum::<f64>() / points.len() as f64;
        let left = if points.len() > 2 {
            found.variance
        } else {
            0.0
        };
        let variance = left.max(open);
        let of = |i, j| found.spread[(i, j)] * variance;
        let off = points
            .iter()
            .map(|(d, m)| (m.value - value - slope * (d - reference)).abs());
        Some(Fitted {
            reference,
            value: [value, of(0, 0).sqrt()],
            slope: [slope, of(1, 1).sqrt()],
            covariance: of(0, 1),
            off: off.fold(0.0, f64::max),
        })
    }

    /// Value and standard uncertainty at a distance, mm.
    pub fn at(&self, distance: f64) -> [f64; 2] {
        let by = distance - self.reference;
        let variance =
            self.value[1].powi(2) + 2.0 * by * self.covariance + (by * self.slope[1]).powi(2);
        [self.value[0] + by * self.slope[0], variance.max(0.0).sqrt()]
    }

    /// Whether its slope is told from none.
    pub fn is_sloped(&self) -> bool {
        self.slope[0].abs() > 2.0 * self.slope[1]
    }

    /// The distance at which it has a value, and the standard uncertainty; `None` where its slope is not told from none.
    pub fn distance(&self, mean: Mean) -> Option<[f64; 2]> {
        let distance = self.reference + (mean.value - self.value[0]) / self.slope[0];
        let sigma = self.at(distance)[1].hypot(mean.scatter) / self.slope[0].abs();
        (self.is_sloped() && distance.is_finite()).then_some([distance, sigma])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_how_well_it_is_known() {
        let mean = |value| Mean {
            value,
            scatter: 0.1,
        };
        let points = [(15.0, mean(16.65)), (10.0, mean(15.87)), (5.0, mean(15.1))];
        let line = Fitted::of(&points, 15.0, 0.5).unwrap();
        assert!(
            (line.slope[0] - 0.155).abs() < 1e-12 && line.off < 0.01,
            "{line:?}"
        );
        // sqrt(0.1² + (0.155 * 0.5)²) over the root of the sum of squares about the middle
        let open = 0.1f64.hypot(0.5 * 0.155);
        assert!((line.slope[1] - open / 50f64.sqrt()).abs() < 1e-9);
        let [distance, sigma] = line.distance(mean(15.87)).unwrap();
        assert!((distance - 10.0).abs() < 0.1 && sigma > 0.1 / 0.155);
        assert!((line.at(10.0)[1] - open / 3f64.sqrt()).abs() < 1e-9);
        let flat = [(15.0, mean(16.0)), (5.0, mean(16.05))];
        assert_eq!(
            Fitted::of(&flat, 15.0, 0.5).unwrap().distance(mean(16.0)),
            None
        );
        assert_eq!(Fitted::of(&[(15.0, mean(16.0)); 3], 15.0, 0.5), None);
    }
}
