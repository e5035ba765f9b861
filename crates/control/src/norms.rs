//! The size of a stable system: its largest gain over all frequencies and directions (H-infinity), with a lower bound that is
//! reached and an upper bound that is proved.
//!
//! N. A. Bruinsma, M. Steinbuch, "A fast algorithm to compute the H∞-norm of a transfer function matrix", Systems &
//! Control Letters 14 (1990) 287–293.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::discretise::continuous_twin;
use crate::domain::Domain;
use crate::state_space::StateSpace;
use meltpath_numerics::Matrix;
use meltpath_numerics::dense::{Factored, eigenvalues, largest_singular_value, singular_values};

/// The largest gain of a system.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// The largest gain met; it is reached at `omega`.
    pub gain: f64,
    /// No gain at any frequency exceeds this (proved by the absence of Hamiltonian eigenvalues on the axis).
    pub bound: f64,
    /// Frequency of the peak (rad/s); infinite when the gain keeps rising towards its direct part.
    pub omega: f64,
}

fn refuse_unstable(system: &StateSpace, need: &'static str) -> Result<Vec<Complex64>, SystemError> {
    let poles = system.poles()?;
    match poles.iter().find(|&&p| !system.domain.decays(p)) {
        Some(&pole) => Err(SystemError::Unstable { pole, need }),
        None => Ok(poles),
    }
}

/// The largest gain over all frequencies, to a relative `tolerance`.
///
/// # Errors
/// [`SystemError::Unstable`], [`SystemError::Dense`].
///
/// ```
/// use meltpath_control::{norms, TransferFunction};
/// // resonance of damping 0.01: peak 1/(2ζ√(1−ζ²))
/// let g = TransferFunction::new([1.0], [1.0, 0.02, 1.0]).unwrap().to_state_space().unwrap();
/// let peak = norms::peak_gain(&g, 1e-9).unwrap();
/// assert!((peak.gain - 50.002500187515626).abs() < 1e-6 && peak.bound >= peak.gain);
/// ```
pub fn peak_gain(system: &StateSpace, tolerance: f64) -> Result<Peak, SystemError> {
    const ROUNDS: usize = 60;
    if let Domain::Sampled { period } = system.domain {
        // the bilinear map carries the unit circle onto the axis and keeps every gain
        let mut peak = peak_gain(&continuous_twin(system)?, tolerance)?;
        peak.omega = 2.0 / period * (0.5 * peak.omega * period).atan();
        return Ok(peak);
    }
    let poles = refuse_unstable(system, "a system with an unstable pole has no largest gain")?;
    let direct = singular_values(&system.d)?.first().copied().unwrap_or(0.0);
    if system.order() == 0 {
        return Ok(Peak {
            gain: direct,
            bound: direct,
            omega: 0.0,
        });
    }
    // in the time unit of a typical pole all matrices have comparable entries
    let unit = (poles.iter().map(|p| p.norm().ln()).sum::<f64>() / poles.len() as f64).exp();
    let s = system.slowed(unit).balanced_scaling();
    let gain_at = |omega: f64| largest_singular_value(&s.response(omega));
    let mut best = Peak {
        gain: direct,
        bound: direct,
        omega: f64::INFINITY,
    };
    let offer = |omega: f64, best: &mut Peak| {
        let gain = gain_at(omega);
        if gain > best.gain && gain.is_finite() {
            best.gain = gain;
            best.omega = omega;
        }
    };
    offer(0.0, &mut best);
    for pole in poles.iter().map(|p| p / unit).filter(|p| p.im >= 0.0) {
        offer(pole.norm(), &mut best);
        if pole.im > 0.0 {
            offer(pole.im, &mut best);
        }
    }
    if best.gain == 0.0 {
        best.omega = 0.0;
        return Ok(best);
    }
    for _ in 0..ROUNDS {
        let level = best.gain * (1.0 + 2.0 * tolerance);
        let crossings = crossings(&s, level)?;
        let before = best.gain;
        for pair in crossings.windows(2) {
            offer(0.5 * (pair[0] + pair[1]), &mut best);
        }
        for &omega in &crossings {
            offer(omega, &mut best);
        }
        if best.gain <= level && best.gain <= before * (1.0 + 2.0 * tolerance) {
            best.bound = level.max(best.gain);
            best.omega *= unit;
            return Ok(best);
        }
    }
    best.bound = f64::INFINITY;
    best.omega *= unit;
    Ok(best)
}

/// Frequencies at which a singular value of the response may equal `level`: imaginary parts of the Hamiltonian's
/// eigenvalues next to the axis. "Next to" is generous: a false one costs an evaluation, a missed one the proof.
fn crossings(s: &StateSpace, level: f64) -> Result<Vec<f64>, SystemError> {
    let m = s.inputs();
    let r = Matrix::identity(m).scaled(level * level) - s.d.transpose() * &s.d;
    let Ok(f) = Factored::new(&r) else {
        return Ok(Vec::new());
    };
    let dc = s.d.transpose() * &s.c;
    let a = &s.a + &s.b * f.solve(&dc);
    let p = (&s.b * f.solve(&s.b.transpose())).scaled(level);
    let q = (s.c.transpose() * &s.c + dc.transpose() * f.solve(&dc)).scaled(1.0 / level);
    // with level inside R the lower left block is Cᵀ(I + D R⁻¹ Dᵀ)C / level
    let p = p.symmetric_part();
    let q = q.symmetric_part();
    let hamiltonian = Matrix::blocks([[&a, &p], [&-&q, &-a.transpose()]]);
    let mut out: Vec<f64> = eigenvalues(&hamiltonian)?
        .into_iter()
        .filter(|e| e.im >= 0.0 && e.re.abs() <= 1e-4 * e.norm().max(1e-12))
        .map(|e| e.im)
        .collect();
    out.push(0.0);
    out.sort_by(f64::total_cmp);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TransferFunction, frequency};
    use proptest::prelude::*;

    /// Poles at 0.95 e^{±0.9 i}: the frequency of the peak, by trying 100,000 of them up to half the rate.
    #[test]
    fn the_peak_of_a_sampled_resonance_is_where_its_gain_is_largest() {
        let period = 1e-4;
        let (c, d) = (0.95 * 0.9_f64.cos(), 0.95 * 0.9_f64.sin());
        let g = StateSpace::new(
            Matrix::from_rows([[c, d], [-d, c]]),
            Matrix::column([1.0, 0.0]),
            Matrix::row([1.0, 0.5]),
            Matrix::zeros(1, 1),
            Domain::Sampled { period },
        )
        .unwrap();
        let peak = peak_gain(&g, 1e-10).unwrap();
        let step = std::f64::consts::PI / period / 1e5;
        let gain = |k: u32| largest_singular_value(&g.response(f64::from(k) * step));
        let best = (1..100_000)
            .max_by(|&a, &b| gain(a).total_cmp(&gain(b)))
            .unwrap();
        assert!((peak.omega - f64::from(best) * step).abs() <= step);
        assert!((peak.gain / gain(best) - 1.0).abs() < 1e-8);
    }

    #[test]
    fn direct_part_may_be_the_peak() {
        let g = TransferFunction::new([3.0, 1.0], [1.0, 1.0])
            .unwrap()
            .to_state_space()
            .unwrap();
        let peak = peak_gain(&g, 1e-8).unwrap();
        assert!((peak.gain - 3.0).abs() < 1e-12 && peak.omega.is_infinite());
    }

    #[test]
    fn sampled_peak() {
        // 1/(z − 0.9) peaks at rest with gain 10
        let g = TransferFunction::sampled([1.0], [1.0, -0.9], 1e-3)
            .unwrap()
            .to_state_space()
            .unwrap();
        assert!((peak_gain(&g, 1e-8).unwrap().gain - 10.0).abs() < 1e-9);
    }

    #[test]
    fn unstable_systems_are_refused() {
        let g = TransferFunction::new([1.0], [1.0, -1.0])
            .unwrap()
            .to_state_space()
            .unwrap();
        assert!(matches!(
            peak_gain(&g, 1e-6),
            Err(SystemError::Unstable { .. })
        ));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn no_grid_point_exceeds_the_bound(v in proptest::collection::vec(-1.0f64..1.0, 5 * 5 + 5 * 2 + 2 * 5 + 4)) {
            let a = Matrix::from_fn(5, 5, |i, j| v[i * 5 + j]);
            let shift = meltpath_numerics::dense::eigenvalues(&a).unwrap().iter().map(|e| e.re).fold(f64::MIN, f64::max) + 0.05;
            let s = StateSpace::continuous(
                a - Matrix::identity(5).scaled(shift),
                Matrix::from_fn(5, 2, |i, j| v[25 + i * 2 + j]),
                Matrix::from_fn(2, 5, |i, j| v[35 + i * 5 + j]),
                Matrix::from_fn(2, 2, |i, j| v[45 + i * 2 + j]),
            ).unwrap();
            let peak = peak_gain(&s, 1e-7).unwrap();
            let grid = frequency::logarithmic(1e-3, 1e3, 4000);
            let seen = grid.iter().map(|&w| largest_singular_value(&s.response(w))).fold(0.0, f64::max);
            prop_assert!(seen <= peak.bound * (1.0 + 1e-12));
            prop_assert!(seen >= peak.gain * (1.0 - 1e-2));
        }
    }
}
