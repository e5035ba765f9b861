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

#[cfg(test)]
mod tests {
    use super::Law;

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
