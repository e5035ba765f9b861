//! What a fit leaves of a channel: how much of it is noise, and where a mode that the model lacks shows in it.
//!
//! The rules are ours. What a model lacks (a mode, a friction of another law) lies at some frequencies; noise of the probe and an
//! encoder's steps lie at all, so that the lower quartile over the frequencies tells them alone. Assumption: the noise is white.
//! Validity: a channel whose noise is not (hum, drift) has a floor below its noise, which then counts among what the model does not hold.

use std::f64::consts::TAU;

use meltpath_control::welch::{Welch, estimate};

use crate::identification::error::IdentificationError;
use crate::identification::modes::APART;

/// Longest windows, samples: a mode is some of their frequencies wide up to 100 kHz.
const WINDOW: usize = 1024;
/// Shortest windows, samples.
const SHORTEST: usize = 8;
/// The lower quartile of a normal distribution, deviations below its mean.
const QUARTILE: f64 = 0.6745;
/// Relative deviation of a density from one half overlapping Hann window (Welch 1967).
const SCATTER: f64 = 1.03;
/// Power of a peak over the median within an octave round it, from which on it may be a mode.
const STANDS_OUT: f64 = 10.0;

/// The mean spectral density of pieces of a channel sampled every second, from one bin above rest on, and its windows' number and length.
struct Spectrum {
    density: Vec<f64>,
    windows: usize,
    length: usize,
}

fn spectrum(pieces: &[Vec<f64>]) -> Result<Option<Spectrum>, IdentificationError> {
    let shortest = pieces.iter().map(Vec::len).min().unwrap_or(0);
    let length = WINDOW.min(shortest);
    if length < SHORTEST {
        return Ok(None);
    }
    let mut density = vec![0.0; length / 2];
    let mut windows = 0;
    for piece in pieces {
        let found = estimate(piece, piece, 1.0, &Welch::hann(length))?;
        for (sum, value) in density.iter_mut().zip(&found.input) {
            *sum += value * found.segments as f64;
        }
        windows += found.segments;
    }
    for sum in &mut density {
        *sum /= windows as f64;
    }
    Ok(Some(Spectrum {
        density,
        windows,
        length,
    }))
}

/// Deviation of the white noise in the pieces of a channel, in its unit; nothing where they are too short to tell.
///
/// # Errors
/// [`IdentificationError::Welch`] for residuals that are not finite.
pub(super) fn white(pieces: &[Vec<f64>]) -> Result<Option<f64>, IdentificationError> {
    let Some(Spectrum {
        mut density,
        windows,
        ..
    }) = spectrum(pieces)?
    else {
        return Ok(None);
    };
    density.sort_by(f64::total_cmp);
    let low = density.get(density.len() / 4).copied().unwrap_or(0.0);
    // as far below the mean as few windows scatter
    let share = 1.0 - QUARTILE * SCATTER / (windows as f64).sqrt();
    Ok(Some((low / share.max(0.1)).sqrt()))
}

/// The pulsation, rad/s, at which what is left of an angle that is sampled every `period` s stands out of its neighbours most, above
/// `from` and apart from modes that are `taken`; nothing where nothing stands out.
///
/// # Errors
/// [`IdentificationError::Welch`] for residuals that are not finite.
pub(super) fn stands_out(
    pieces: &[Vec<f64>],
    period: f64,
    from: f64,
    taken: &[f64],
) -> Result<Option<f64>, IdentificationError> {
    let Some(Spectrum {
        density, length, ..
    }) = spectrum(pieces)?
    else {
        return Ok(None);
    };
    let omega = |k: usize| TAU * (k + 1) as f64 / (length as f64 * period);
    let free =
        |k: &usize| omega(*k) > from && taken.iter().all(|t| (omega(*k) / t - 1.0).abs() > APART);
    let over = |k: usize| {
        let (low, high) = ((k + 1) * 5 / 7, ((k + 1) * 7 / 5 + 1).min(density.len()));
        let mut near = density[low.min(k)..high].to_vec();
        near.sort_by(f64::total_cmp);
        density[k] / near[near.len() / 2]
    };
    let highest = (1..density.len().saturating_sub(1))
        .filter(|k| density[*k] >= density[k - 1] && density[*k] >= density[k + 1])
        .filter(free)
        .max_by(|a, b| over(*a).total_cmp(&over(*b)));
    Ok(highest.filter(|k| over(*k) > STANDS_OUT).map(omega))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    /// White noise is told to a few percent, whatever lies over it at some frequencies.
    #[test]
    fn what_stands_at_some_frequencies_is_no_noise() {
        let mut random = Random::new(5);
        let mut pieces = |lines: f64| -> Vec<Vec<f64>> {
            let piece = |_| {
                (0..700)
                    .map(|k| {
                        let line = (0.9 * f64::from(k)).sin() + (0.05 * f64::from(k)).sin();
                        0.01 * random.normal() + lines * line
                    })
                    .collect()
            };
            (0..24).map(piece).collect()
        };
        for lines in [0.0, 0.01, 1.0] {
            let found = white(&pieces(lines)).unwrap().unwrap();
            assert!((found / 0.01 - 1.0).abs() < 0.1, "{lines}: {found}");
        }
    }

    #[test]
    fn pieces_of_a_few_samples_tell_nothing() {
        assert_eq!(white(&[vec![0.0; 7]]).unwrap(), None);
        assert!(white(&[]).unwrap().is_none());
        assert!(white(&[vec![f64::NAN; 64]]).is_err());
    }
}
