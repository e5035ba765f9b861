//! A synthesised controller made practical: a nearly cancelling pole and zero removed, the slowest pole made an integrator.
//!
//! Rasoanarivo 2020, 3.3.3 and fig. 3.6: weights cannot have a pole at the origin, so that the synthesis returns a very slow
//! pole where an integrator is meant.

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use crate::SystemError;
use crate::zero_pole::ZeroPoleGain;

/// What was changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Simplified {
    /// The controller after the changes.
    pub controller: ZeroPoleGain,
    /// Pole and zero removed (rad/s).
    pub removed: Vec<(f64, f64)>,
    /// The slow pole that became an integrator (rad/s).
    pub integrated: f64,
    /// Largest change of gain, as a ratio above one, from `checked.0` to `checked.1`.
    pub change: f64,
    /// Where the change was checked (rad/s).
    pub checked: (f64, f64),
}

/// Removes real pole and zero pairs closer than `closeness` (relative), at most `pairs` of them and the closest first,
/// moves the slowest real pole to the origin, and rescales so that the gain at `crossover` (rad/s) stays. The change is
/// checked from a tenth to a hundred times the crossover.
///
/// # Errors
/// [`SystemError::Range`] without a real pole slower than a hundredth of the crossover.
pub fn simplify_controller(
    k: &ZeroPoleGain,
    crossover: f64,
    closeness: f64,
    pairs: usize,
) -> Result<Simplified, SystemError> {
    let slowest = (0..k.poles.len())
        .filter(|&i| k.poles[i].im == 0.0)
        .min_by(|&i, &j| k.poles[i].norm().total_cmp(&k.poles[j].norm()))
        .filter(|&i| k.poles[i].norm() < 0.01 * crossover);
    let Some(slowest) = slowest else {
        return Err(SystemError::Range {
            what: "the slowest real pole (rad/s)",
            value: k
                .poles
                .iter()
                .map(|p| p.norm())
                .fold(f64::INFINITY, f64::min),
            wanted: "an integrator is made of a real pole slower than a hundredth of the crossover",
        });
    };
    let mut out = k.clone();
    let integrated = out.poles.remove(slowest).re;
    let mut removed = Vec::new();
    for _ in 0..pairs {
        let candidates = out
            .poles
            .iter()
            .enumerate()
            .filter(|(_, p)| p.im == 0.0 && p.re < 0.0);
        let best = candidates
            .flat_map(|(i, p)| {
                out.zeros
                    .iter()
                    .enumerate()
                    .filter(|(_, z)| z.im == 0.0)
                    .map(move |(j, z)| (i, j, (p - z).norm() / p.norm()))
            })
            .min_by(|a, b| a.2.total_cmp(&b.2));
        match best {
            Some((i, j, distance)) if distance <= closeness => {
                removed.push((out.poles.remove(i).re, out.zeros.remove(j).re));
            }
            _ => break,
        }
    }
    out.poles.push(Complex64::default());
    out.gain *= k.response(crossover).norm() / out.response(crossover).norm();
    let checked = (0.1 * crossover, 100.0 * crossover);
    let change = largest_change(k, &out, checked);
    Ok(Simplified {
        controller: out,
        removed,
        integrated,
        change,
        checked,
    })
}

/// Largest ratio of gains between two controllers over a band (rad/s), above one whichever is larger.
pub fn largest_change(one: &ZeroPoleGain, other: &ZeroPoleGain, band: (f64, f64)) -> f64 {
    crate::frequency::logarithmic(band.0, band.1, 400)
        .into_iter()
        .map(|w| {
            let ratio = (other.response(w) / one.response(w)).norm();
            ratio.max(1.0 / ratio)
        })
        .fold(1.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hidden_pair_goes_and_the_slow_pole_integrates() {
        let c = |x: f64| Complex64::new(x, 0.0);
        let k = ZeroPoleGain::new(
            vec![c(-100.0), c(-40.0)],
            vec![c(-0.01), c(-101.0), c(-5000.0)],
            7.0,
        );
        let done = simplify_controller(&k, 300.0, 0.1, 3).unwrap();
        assert_eq!(done.removed, [(-101.0, -100.0)]);
        assert_eq!(done.integrated, -0.01);
        assert_eq!(done.controller.zeros, [c(-40.0)]);
        assert!(done.controller.poles.contains(&c(0.0)));
        assert!(
            (done.controller.response(300.0).norm() / k.response(300.0).norm() - 1.0).abs() < 1e-12
        );
        assert!(done.change < 1.01 && done.change > 1.0);
        // no pole slow enough
        let fast = ZeroPoleGain::new(vec![], vec![c(-50.0)], 1.0);
        assert!(matches!(
            simplify_controller(&fast, 300.0, 0.1, 1),
            Err(SystemError::Range { .. })
        ));
    }
}
