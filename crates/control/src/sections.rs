//! Second-order sections: the form in which a controller survives short words, run sample by sample.

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

    /// The same coefficients rounded to a fixed-point grid of `fraction_bits` bits after the point.
    #[must_use]
    pub fn rounded(&self, fraction_bits: u32) -> Self {
        let step = 0.5f64.powi(fraction_bits.cast_signed());
        let round = |x: f64| (x / step).round() * step;
        Sections {
            gain: self.gain,
            sections: self
                .sections
                .iter()
                .map(|s| SecondOrder {
                    b: s.b.map(round),
                    a: s.a.map(round),
                })
                .collect(),
            period: self.period,
        }
    }

    /// At rest, ready to filter.
    pub fn running(&self) -> RunningSections {
        RunningSections {
            sections: self.clone(),
            memory: vec![[0.0; 2]; self.sections.len()],
        }
    }
}

/// [`Sections`] with their memory (transposed direct form II).
#[derive(Debug, Clone)]
pub struct RunningSections {
    sections: Sections,
    memory: Vec<[f64; 2]>,
}

impl RunningSections {
    /// One sample in, one sample out.
    pub fn step(&mut self, input: f64) -> f64 {
        let mut x = self.sections.gain * input;
        for (s, m) in self.sections.sections.iter().zip(&mut self.memory) {
            let y = s.b[0] * x + m[0];
            m[0] = s.b[1] * x - s.a[0] * y + m[1];
            m[1] = s.b[2] * x - s.a[1] * y;
            x = y;
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretise::{Hold, discretise};
    use crate::{TransferFunction, simulate::Running};

    #[test]
    fn sections_run_like_the_state_space() {
        let g = TransferFunction::new([1.0, 30.0, 900.0], [1.0, 40.0, 5000.0, 1e5, 0.0]).unwrap();
        let sampled = discretise(&g.to_state_space().unwrap(), 1e-3, Hold::First).unwrap();
        let sections =
            Sections::from_zero_pole(&ZeroPoleGain::from_state_space(&sampled, 0, 0).unwrap())
                .unwrap();
        let mut fast = sections.running();
        let mut slow = Running::new(&sampled).unwrap();
        let mut y = [0.0];
        for k in 0..500 {
            let u = (0.03 * f64::from(k)).sin();
            slow.step(&[u], &mut y);
            assert!((fast.step(u) - y[0]).abs() < 1e-10);
        }
        let coarse = sections.rounded(8);
        assert!(
            coarse
                .sections
                .iter()
                .all(|s| (s.a[0] * 256.0).fract() == 0.0)
        );
    }
}
