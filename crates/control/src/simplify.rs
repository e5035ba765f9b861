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
    let change = crate::frequency::logarithmic(checked.0, checked.1, 400)
        .into_iter()
        .map(|w| {
            let ratio = (out.response(w) / k.response(w)).norm();
            ratio.max(1.0 / ratio)
        })
        .fold(1.0, f64::max);
    Ok(Simplified {
        controller: out,
        removed,
        integrated,
        change,
        checked,
    })
}
