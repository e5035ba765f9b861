//! A property against temperature: a polynomial or a table, exactly as its source prints it.

/// A property as a function of temperature in kelvin.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// `Σ cᵢ (T − about)ⁱ`.
    Polynomial {
        /// Temperature at which all but the first term vanish, K.
        about: f64,
        /// Coefficients, lowest order first.
        coefficients: Vec<f64>,
    },
    /// Straight between corners `[T in K, value]`, constant outside them.
    Table {
        /// The corners, temperatures strictly increasing.
        corners: Vec<[f64; 2]>,
    },
}

impl Law {
    /// The same value at every temperature.
    pub fn constant(value: f64) -> Self {
        Law::Polynomial {
            about: 0.0,
            coefficients: vec![value],
        }
    }

    /// The value at `kelvin`.
    ///
    /// ```
    /// use meltpath_thermal::material::law::Law;
    /// let conductivity = Law::Polynomial { about: 273.15, coefficients: vec![7.0, 0.0125] };
    /// assert!((conductivity.at(750.0 + 273.15) - 16.375).abs() < 1e-12);
    /// ```
    pub fn at(&self, kelvin: f64) -> f64 {
        match self {
            Law::Polynomial {
                about,
                coefficients,
            } => coefficients
                .iter()
                .rev()
                .fold(0.0, |sum, c| sum * (kelvin - about) + c),
            Law::Table { corners } => {
                let after = corners.partition_point(|c| c[0] <= kelvin);
                match (after.checked_sub(1), corners.get(after)) {
                    (Some(i), Some(next)) => {
                        let [t0, v0] = corners[i];
                        v0 + (next[1] - v0) * (kelvin - t0) / (next[0] - t0)
                    }
                    (Some(i), None) => corners[i][1],
                    (None, Some(first)) => first[1],
                    (None, None) => f64::NAN,
                }
            }
        }
    }
}

/// Straight pieces through corners as the first one, `a + b x`, and the changes of its slope. Corners beyond `N` and the two ends are left
/// out.
pub(crate) fn straight_pieces<const N: usize>(corners: &[[f64; 2]]) -> ([f64; 2], [[f64; 2]; N]) {
    let slope = |pair: &[[f64; 2]]| (pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0]);
    let mut bends = [[0.0; 2]; N];
    for (bend, three) in bends.iter_mut().zip(corners.windows(3)) {
        *bend = [three[1][0], slope(&three[1..]) - slope(&three[..2])];
    }
    let first = corners.get(..2).map_or(1.0, slope);
    let [x, y] = corners.first().copied().unwrap_or([0.0, 0.0]);
    ([y - first * x, first], bends)
}

#[cfg(test)]
mod tests {
    use super::{Law, straight_pieces};

    #[test]
    fn pieces_pass_through_their_corners() {
        let corners = [[0.5, 0.1], [0.7, 0.2], [0.9, 0.8], [1.0, 1.0]];
        let ([a, b], bends) = straight_pieces::<4>(&corners);
        for [x, y] in corners {
            let bent = bends.map(|[knot, bend]| bend * (x - knot).max(0.0));
            let found = a + b * x + bent.iter().sum::<f64>();
            assert!((found - y).abs() < 1e-12, "{x}: {found} {y}");
        }
        assert_eq!(
            straight_pieces([[0.0, 0.0], [1.0, 1.0]].as_slice()),
            ([0.0, 1.0], [[0.0; 2]; 4])
        );
    }

    #[test]
    fn a_table_is_straight_between_and_flat_outside() {
        let law = Law::Table {
            corners: vec![[100.0, 1.0], [200.0, 3.0], [400.0, 2.0]],
        };
        assert_eq!(law.at(50.0), 1.0);
        assert_eq!(law.at(150.0), 2.0);
        assert_eq!(law.at(300.0), 2.5);
        assert_eq!(law.at(900.0), 2.0);
    }
}
