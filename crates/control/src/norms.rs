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
use meltpath_numerics::dense::{
    Factored, eigenvalues, hessenberg_form, largest_singular_value, singular_values,
};

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
    let upper = poles.iter().map(|p| p / unit).filter(|p| p.im >= 0.0);
    for omega in promising(&s, upper) {
        offer(omega, &mut best);
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

/// Frequencies near which the response is largest: those of a few poles, and the top that is climbed to from the best of them.
/// They are found on another form of the system, which costs less and keeps fewer digits: what is met there is only where to look.
fn promising(s: &StateSpace, poles: impl Iterator<Item = Complex64>) -> Vec<f64> {
    const KEPT: usize = 3;
    const CLIMBS: usize = 14;
    let quick = quick(s);
    let gain_at = |omega: f64| {
        let gain = largest_singular_value(&quick.response(omega));
        (omega, if gain.is_finite() { gain } else { 0.0 })
    };
    let mut met: Vec<(f64, f64)> = poles
        .flat_map(|p| [p.norm(), p.im])
        .filter(|&omega| omega > 0.0)
        .map(gain_at)
        .collect();
    met.sort_by(|x, y| y.1.total_cmp(&x.1));
    met.truncate(KEPT);
    let Some(mut top) = met.first().copied() else {
        return Vec::new();
    };
    // over ln ω, by parabolas through three places that draw together
    let mut step = 0.1;
    for _ in 0..CLIMBS {
        let beside = |by: f64| gain_at(top.0 * by.exp());
        let (left, right) = (beside(-step), beside(step));
        let bend = left.1 + right.1 - 2.0 * top.1;
        let shift = 0.5 * step * (left.1 - right.1) / bend;
        let inside = bend < 0.0 && shift.abs() < step;
        let vertex = if inside { beside(shift) } else { top };
        top = [left, right, vertex]
            .into_iter()
            .fold(top, |a, b| if b.1 > a.1 { b } else { a });
        if inside {
            step *= 0.25;
        }
    }
    met.push(top);
    met.into_iter().map(|(omega, _)| omega).collect()
}

/// The same gains in states in which a response costs the square of their number, by a form next to triangular; with no more inputs
/// than outputs, since a system's dual has its gains.
fn quick(s: &StateSpace) -> StateSpace {
    let s = if s.inputs() > s.outputs() {
        &dual(s)
    } else {
        s
    };
    let (u, form) = hessenberg_form(&s.a);
    StateSpace {
        a: form,
        b: u.transpose() * &s.b,
        c: &s.c * u,
        ..s.clone()
    }
}

/// The system whose response is the transpose of this one's.
fn dual(s: &StateSpace) -> StateSpace {
    StateSpace {
        a: s.a.transpose(),
        b: s.c.transpose(),
        c: s.b.transpose(),
        d: s.d.transpose(),
        domain: s.domain,
    }
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

    /// Six lightly damped modes over three decades, the narrowest a millionth of its frequency wide.
    #[test]
    fn the_narrowest_of_many_resonances_is_found_from_either_side() {
        let dampings = [1e-2, 1e-6, 3e-3, 1e-4, 1e-3, 2e-2];
        let omega = |k: usize| 10f64.powf(0.55 * k as f64 - 1.0);
        let a = Matrix::from_fn(12, 12, |i, j| match (i / 2 == j / 2, i % 2, j % 2) {
            (true, 0, 0) | (true, 1, 1) => -dampings[i / 2] * omega(i / 2),
            (true, 0, 1) => omega(i / 2),
            (true, ..) => -omega(i / 2),
            _ => 0.0,
        });
        let b = Matrix::from_fn(12, 5, |i, j| ((3 * i + 7 * j) % 5) as f64 - 1.5);
        let c = Matrix::from_fn(1, 12, |_, j| 1.0 + (j % 3) as f64);
        let wide = StateSpace::continuous(a, b, c, Matrix::zeros(1, 5)).unwrap();
        let (one, other) = (
            peak_gain(&wide, 1e-9).unwrap(),
            peak_gain(&dual(&wide), 1e-9).unwrap(),
        );
        assert!((one.gain / other.gain - 1.0).abs() < 1e-8);
        assert!((one.omega / omega(1) - 1.0).abs() < 1e-6);
        let seen = largest_singular_value(&wide.response(omega(1)));
        assert!(one.gain >= seen * (1.0 - 1e-9) && one.bound <= one.gain * (1.0 + 1e-8));
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
