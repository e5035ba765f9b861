//! Second-order sections: the form in which a controller survives short words.

use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::domain::Domain;
use crate::polynomial::Polynomial;
use crate::zero_pole::{ZeroPoleGain, pair_sections};

/// (b0 + b1 z⁻¹ + b2 z⁻²)/(1 + a1 z⁻¹ + a2 z⁻²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SecondOrder {
    /// Numerator b0, b1, b2.
    pub b: [f64; 3],
    /// Denominator a1, a2.
    pub a: [f64; 2],
}

/// A sampled system as a gain and sections in series.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sections {
    /// Overall gain.
    pub gain: f64,
    /// In order of application: gentle sections first, resonant ones last, each with the zeros closest to its poles.
    pub sections: Vec<SecondOrder>,
    /// Sample time (s).
    pub period: f64,
}

impl Sections {
    /// The sections of a sampled system.
    ///
    /// # Errors
    /// [`SystemError::Domains`] when continuous, [`SystemError::Improper`], [`SystemError::Unpaired`], [`SystemError::Delay`]
    /// when the system carries a delay (append its samples instead).
    ///
    /// ```
    /// use meltpath_control::{sections::Sections, Complex64, Domain, ZeroPoleGain};
    /// let notch = ZeroPoleGain {
    ///     zeros: vec![Complex64::cis(0.4), Complex64::cis(-0.4)],
    ///     poles: vec![Complex64::from_polar(0.9, 0.4), Complex64::from_polar(0.9, -0.4)],
    ///     gain: 0.95, delay: 0.0, domain: Domain::Sampled { period: 1e-4 },
    /// };
    /// let s = Sections::from_zero_pole(&notch).unwrap();
    /// assert_eq!(s.sections.len(), 1);
    /// assert!((s.sections[0].a[1] - 0.81).abs() < 1e-15);
    /// ```
    pub fn from_zero_pole(system: &ZeroPoleGain) -> Result<Self, SystemError> {
        let Domain::Sampled { period } = system.domain else {
            return Err(SystemError::Domains {
                one: system.domain,
                two: Domain::Sampled { period: f64::NAN },
            });
        };
        if system.delay != 0.0 {
            return Err(SystemError::Delay {
                delay: system.delay,
            });
        }
        let mut pairs = pair_sections(system)?;
        pairs.reverse();
        let sections = pairs
            .iter()
            .map(|(zeros, poles)| {
                let up = Polynomial::from_roots(zeros, 1.0);
                let down = Polynomial::from_roots(poles, 1.0);
                // both in powers of z⁻¹, aligned on the pole count
                let n = poles.len();
                let b = |lag: usize| {
                    if lag <= n {
                        up.coefficient(n - lag)
                    } else {
                        0.0
                    }
                };
                let a = |lag: usize| {
                    if lag <= n {
                        down.coefficient(n - lag)
                    } else {
                        0.0
                    }
                };
                SecondOrder {
                    b: [b(0), b(1), b(2)],
                    a: [a(1), a(2)],
                }
            })
            .collect();
        Ok(Sections {
            gain: system.gain,
            sections,
            period,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretise::{Hold, discretise};
    use crate::{Complex64, TransferFunction};

    #[test]
    fn sections_answer_like_the_state_space() {
        let g = TransferFunction::new([1.0, 30.0, 900.0], [1.0, 40.0, 5000.0, 1e5, 0.0]).unwrap();
        let sampled = discretise(&g.to_state_space().unwrap(), 1e-3, Hold::First).unwrap();
        let sections =
            Sections::from_zero_pole(&ZeroPoleGain::from_state_space(&sampled, 0, 0).unwrap())
                .unwrap();
        for omega in [1.0, 30.0, 400.0, 3000.0] {
            let back = Complex64::new(0.0, -omega * sections.period).exp();
            let of = |s: &SecondOrder| {
                let up = s.b[0] + (s.b[1] + s.b[2] * back) * back;
                up / (1.0 + (s.a[0] + s.a[1] * back) * back)
            };
            let found = sections.sections.iter().map(of).product::<Complex64>() * sections.gain;
            let wanted = sampled.response(omega)[(0, 0)];
            assert!((found - wanted).norm() < 1e-9 * wanted.norm(), "{omega}");
        }
    }
}
