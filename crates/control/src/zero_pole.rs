//! Systems by their zeros, poles and gain: the form in which controllers are read and simplified.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::domain::Domain;
use crate::polynomial::{Polynomial, exponent};
use crate::state_space::StateSpace;
use crate::transfer::TransferFunction;
use crate::zeros::invariant_zeros;
use meltpath_numerics::Matrix;

/// gain · Π(s − zero) / Π(s − pole) · exp(−delay·s), one input and one output; complex values in conjugate pairs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ZeroPoleGain {
    /// Zeros (rad/s, or in z).
    pub zeros: Vec<Complex64>,
    /// Poles (rad/s, or in z).
    pub poles: Vec<Complex64>,
    /// Ratio of leading coefficients.
    pub gain: f64,
    /// Delay (s).
    pub delay: f64,
    /// How time runs.
    pub domain: Domain,
}

impl ZeroPoleGain {
    /// A continuous system without delay.
    pub fn new(zeros: Vec<Complex64>, poles: Vec<Complex64>, gain: f64) -> Self {
        ZeroPoleGain {
            zeros,
            poles,
            gain,
            delay: 0.0,
            domain: Domain::Continuous,
        }
    }

    /// The zeros, poles and gain of one input and one output of a state-space system.
    ///
    /// # Errors
    /// [`SystemError::Channel`], [`SystemError::Dense`].
    pub fn from_state_space(
        system: &StateSpace,
        output: usize,
        input: usize,
    ) -> Result<Self, SystemError> {
        let part = system.select(&[output], &[input])?.balanced_scaling();
        let poles = part.poles()?;
        let zeros = invariant_zeros(&part)?;
        // the gain from one evaluation far from every pole and zero
        let reach = poles
            .iter()
            .chain(&zeros)
            .map(|p| p.norm())
            .fold(1e-3, f64::max);
        let probe = Complex64::new(0.6 * reach, 1.1 * reach);
        let ratio = poles
            .iter()
            .fold(part.at(probe)[(0, 0)], |v, p| v * (probe - p) / reach);
        let ratio = zeros.iter().fold(ratio, |v, z| v / ((probe - z) / reach));
        let gain = ratio.re * reach.powi(exponent(poles.len()) - exponent(zeros.len()));
        Ok(ZeroPoleGain {
            zeros,
            poles,
            gain,
            delay: 0.0,
            domain: system.domain,
        })
    }

    /// Value at a complex point, delay included.
    pub fn at(&self, s: Complex64) -> Complex64 {
        // zeros and poles taken in turn, so that intermediate products stay moderate
        let mut value = Complex64::new(self.gain, 0.0);
        let most = self.zeros.len().max(self.poles.len());
        for k in 0..most {
            if let Some(z) = self.zeros.get(k) {
                value *= s - z;
            }
            if let Some(p) = self.poles.get(k) {
                value /= s - p;
            }
        }
        self.domain.delayed(value, s, self.delay)
    }

    /// The frequency response at `omega` (rad/s).
    pub fn response(&self, omega: f64) -> Complex64 {
        self.at(self.domain.point(omega))
    }

    /// As a chain of sections of first and second order, which keeps every root to full precision.
    ///
    /// # Errors
    /// [`SystemError::Improper`] when there are more zeros than poles, [`SystemError::Delay`] when a delay is left,
    /// [`SystemError::Unpaired`] when a complex root lacks its conjugate.
    pub fn to_state_space(&self) -> Result<StateSpace, SystemError> {
        if self.delay != 0.0 {
            return Err(SystemError::Delay { delay: self.delay });
        }
        let sections = pair_sections(self)?;
        let mut chain = StateSpace::constant(Matrix::diagonal(&[self.gain]), self.domain);
        for (zeros, poles) in &sections {
            chain = chain.then(&section(zeros, poles, self.domain)?)?;
        }
        Ok(chain.balanced_scaling())
    }
}

/// A sampled pole this near to one is an integrator with rounding.
const INTEGRATOR: f64 = 1e-9;

/// Roots grouped into sections: complex pairs of poles each with the nearest pair of zeros, then real ones two by two.
pub(crate) type Section = (Vec<Complex64>, Vec<Complex64>);

pub(crate) fn pair_sections(system: &ZeroPoleGain) -> Result<Vec<Section>, SystemError> {
    if system.zeros.len() > system.poles.len() {
        return Err(SystemError::Improper {
            numerator: system.zeros.len(),
            denominator: system.poles.len(),
        });
    }
    let (mut pairs, mut reals) = conjugate_pairs(&system.poles)?;
    let (zero_pairs, mut zero_reals) = conjugate_pairs(&system.zeros)?;
    reals.sort_by(|a, b| b.re.abs().total_cmp(&a.re.abs()));
    // an integrator stands alone where the zeros leave it: rounded together with another pole it would not stay on the circle
    let integrates = matches!(system.domain, Domain::Sampled { .. })
        && reals
            .first()
            .is_some_and(|p| (p.re - 1.0).abs() < INTEGRATOR);
    if integrates
        && system.zeros.len() == system.poles.len()
        && pairs.len() + (reals.len() - 1) / 2 >= zero_pairs.len()
    {
        pairs.push(vec![reals.remove(0)]);
    }
    for two in reals.chunks(2) {
        pairs.push(two.to_vec());
    }
    // the poles closest to instability choose their zeros first
    let decay = |p: &Complex64| match system.domain {
        Domain::Continuous => p.re.abs() / p.norm().max(f64::MIN_POSITIVE),
        Domain::Sampled { .. } => (1.0 - p.norm()).abs(),
    };
    pairs.sort_by(|a, b| {
        b.len()
            .cmp(&a.len())
            .then(decay(&a[0]).total_cmp(&decay(&b[0])))
    });
    let mut zero_pairs = zero_pairs;
    let mut out: Vec<Section> = Vec::with_capacity(pairs.len());
    for poles in pairs {
        let mut zeros = Vec::new();
        let near = |z: &Complex64| (z - poles[0]).norm();
        if poles.len() == 2 {
            let best = (0..zero_pairs.len())
                .min_by(|&i, &j| near(&zero_pairs[i][0]).total_cmp(&near(&zero_pairs[j][0])));
            if let Some(k) = best {
                zeros = zero_pairs.remove(k);
            }
        }
        if zeros.is_empty() {
            while zeros.len() < poles.len() {
                let best = (0..zero_reals.len())
                    .min_by(|&i, &j| near(&zero_reals[i]).total_cmp(&near(&zero_reals[j])));
                let Some(k) = best else { break };
                zeros.push(zero_reals.remove(k));
            }
        }
        out.push((zeros, poles));
    }
    Ok(out)
}

fn conjugate_pairs(
    roots: &[Complex64],
) -> Result<(Vec<Vec<Complex64>>, Vec<Complex64>), SystemError> {
    let mut pairs = Vec::new();
    let mut reals = Vec::new();
    let mut lower: Vec<Complex64> = roots.iter().filter(|r| r.im < 0.0).copied().collect();
    for &root in roots {
        if root.im == 0.0 {
            reals.push(root);
        } else if root.im > 0.0 {
            let best = (0..lower.len()).min_by(|&i, &j| {
                (lower[i].conj() - root)
                    .norm()
                    .total_cmp(&(lower[j].conj() - root).norm())
            });
            match best {
                Some(k) if (lower[k].conj() - root).norm() <= 1e-6 * root.norm() => {
                    lower.remove(k);
                    pairs.push(vec![root, root.conj()]);
                }
                _ => return Err(SystemError::Unpaired { root }),
            }
        }
    }
    match lower.first() {
        Some(&root) => Err(SystemError::Unpaired { root }),
        None => Ok((pairs, reals)),
    }
}

fn section(
    zeros: &[Complex64],
    poles: &[Complex64],
    domain: Domain,
) -> Result<StateSpace, SystemError> {
    let mut g = TransferFunction::new(
        Polynomial::from_roots(zeros, 1.0).coefficients(),
        Polynomial::from_roots(poles, 1.0).coefficients(),
    )?;
    g.domain = domain;
    if poles.len() == 2 && poles[0].im == 0.0 {
        // two real poles in cascade: no coefficient mixes them
        let (p, q) = (poles[0].re, poles[1].re);
        let n = &g.numerator;
        let through = n.coefficient(2);
        // n(s) = through·(s − p)(s − q) + c1·(s − p) + c0
        let c1 = n.coefficient(1) + through * (p + q);
        let c0 = n.coefficient(0) - through * p * q + c1 * p;
        let mut out = StateSpace::new(
            Matrix::from_rows([[p, 0.0], [1.0, q]]),
            Matrix::column([1.0, 0.0]),
            Matrix::row([0.0, 0.0]),
            Matrix::diagonal(&[through]),
            domain,
        )?;
        // y = c1·(s − p)/((s − p)(s − q)) + c0/((s − p)(s − q)); second state is 1/((s − p)(s − q))
        out.c = Matrix::row([c1, c0 + c1 * (q - p)]);
        return Ok(out);
    }
    let s = g.to_state_space()?;
    Ok(s)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2/z after 3 samples of 1 ms: 2/z⁴.
    #[test]
    fn a_sampled_delay_is_a_power_of_z() {
        let mut k = ZeroPoleGain::new(vec![], vec![Complex64::new(0.0, 0.0)], 2.0);
        k.domain = Domain::Sampled { period: 1e-3 };
        k.delay = 3e-3;
        let z = Complex64::new(0.6, -0.7);
        assert!((k.at(z) - 2.0 / z.powi(4)).norm() < 1e-12);
    }

    #[test]
    fn forms_agree() {
        let c = Complex64::new;
        let k = ZeroPoleGain::new(
            vec![
                c(-4.97576e6, 0.0),
                c(-394.07, 25142.9),
                c(-394.07, -25142.9),
                c(-134.177, 0.0),
                c(-8.73646, 0.0),
            ],
            vec![
                c(-2.15242e5, 0.0),
                c(-8587.7, 19194.5),
                c(-8587.7, -19194.5),
                c(-1316.1, 24888.1),
                c(-1316.1, -24888.1),
                c(-145.635, 0.0),
                c(-0.134_064, 0.0),
            ],
            21604.2,
        );
        let s = k.to_state_space().unwrap();
        assert_eq!(s.order(), 7);
        let back = ZeroPoleGain::from_state_space(&s, 0, 0).unwrap();
        for omega in [0.01, 1.0, 130.0, 3000.0, 25_000.0, 3e5] {
            let x = k.response(omega);
            assert!(
                (s.response(omega)[(0, 0)] - x).norm() < 1e-9 * x.norm(),
                "{omega}"
            );
            assert!(
                (back.response(omega) - x).norm() < 1e-8 * x.norm(),
                "{omega}"
            );
        }
        assert_eq!(back.zeros.len(), 5);
    }

    #[test]
    fn a_lone_complex_root_is_named() {
        let bad = ZeroPoleGain::new(vec![], vec![Complex64::new(-1.0, 2.0)], 1.0);
        assert!(matches!(
            bad.to_state_space(),
            Err(SystemError::Unpaired { .. })
        ));
    }
}
