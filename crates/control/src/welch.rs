//! Frequency responses from records: averaged spectra of overlapping segments, with coherence and confidence.
//!
//! P. D. Welch, IEEE Trans. Audio Electroacoustics 15 (1967) 70–73; Rasoanarivo 2020, annex A.2 (sums put in their place).

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use rustfft::FftPlanner;
use serde::{Deserialize, Serialize};

/// How segments are faded in and out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Window {
    /// Not at all: right for segments of exactly one period of the excitation, leaky otherwise.
    Rectangular,
    /// A raised cosine: the rule for records that integrate.
    Hann,
    /// A triangle (Bartlett).
    Triangular,
    /// Decay by exp(−k/`samples`).
    Exponential {
        /// Decay in samples.
        samples: f64,
    },
}

impl Window {
    fn at(self, k: usize, length: usize) -> f64 {
        let x = k as f64 / length as f64;
        match self {
            Window::Rectangular => 1.0,
            Window::Hann => (PI * x).sin().powi(2),
            Window::Triangular => 1.0 - (2.0 * x - 1.0).abs(),
            Window::Exponential { samples } => (-(k as f64) / samples).exp(),
        }
    }
}

/// What is taken off each segment before it is transformed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Detrend {
    /// Nothing.
    None,
    /// The mean.
    Mean,
    /// The line of least squares.
    Line,
}

/// How a record is cut and averaged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Welch {
    /// Samples a segment.
    pub length: usize,
    /// Samples from one segment's start to the next.
    pub shift: usize,
    /// The window.
    pub window: Window,
    /// What is taken off.
    pub detrend: Detrend,
}

impl Welch {
    /// Hann windows of `length` samples, half overlapping, means taken off.
    pub fn hann(length: usize) -> Self {
        Welch {
            length,
            shift: (length / 2).max(1),
            window: Window::Hann,
            detrend: Detrend::Mean,
        }
    }

    /// Whole periods of a periodic excitation, one after another.
    pub fn periods(length: usize) -> Self {
        Welch {
            length,
            shift: length.max(1),
            window: Window::Rectangular,
            detrend: Detrend::Mean,
        }
    }
}

/// Why no estimate is returned.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WelchError {
    /// The two records differ in length.
    #[error("the input record has {input} samples, the output record {output}")]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// Not one segment fits.
    #[error(
        "a record of {samples} samples holds no segment of {length}: shorten the segments or record longer"
    )]
    TooShort {
        /// Samples recorded.
        samples: usize,
        /// Samples a segment.
        length: usize,
    },
    /// A sample is not finite.
    #[error("sample {index} is infinite or not a number: cut the record there or repair the gap")]
    NotFinite {
        /// Which sample.
        index: usize,
    },
    /// The sample time is not positive.
    #[error("a sample time of {period} s is not positive")]
    Period {
        /// What was given.
        period: f64,
    },
}

/// An estimated frequency response.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Frequencies (rad/s), from one bin above rest to half the sampling frequency.
    pub omega: Vec<f64>,
    /// Output over input (H1: noise on the output averages out).
    pub response: Vec<Complex64>,
    /// Share of the output that the input explains, 0 to 1.
    pub coherence: Vec<f64>,
    /// Spectral density of the input (unit²·s, two-sided).
    pub input: Vec<f64>,
    /// Spectral density of the output (unit²·s, two-sided).
    pub output: Vec<f64>,
    /// Segments averaged.
    pub segments: usize,
}

/// The response from `input` to `output`, both sampled at `period` (s).
///
/// # Errors
/// [`WelchError`].
///
/// ```
/// use meltpath_control::{prbs::Prbs, welch::{estimate, Welch}};
/// let u = Prbs::new(9).unwrap().signal(1.0, 1, 4 * 511);
/// let y: Vec<f64> = u.iter().map(|v| 3.0 * v).collect();
/// let e = estimate(&u, &y, 1e-3, &Welch::periods(511)).unwrap();
/// assert!((e.response[40] - 3.0).norm() < 1e-12 && (e.coherence[40] - 1.0).abs() < 1e-12);
/// ```
pub fn estimate(
    input: &[f64],
    output: &[f64],
    period: f64,
    welch: &Welch,
) -> Result<Estimate, WelchError> {
    let samples = input.len();
    if samples != output.len() {
        return Err(WelchError::Lengths {
            input: samples,
            output: output.len(),
        });
    }
    if !(period > 0.0 && period.is_finite()) {
        return Err(WelchError::Period { period });
    }
    let length = welch.length;
    if length < 2 || samples < length {
        return Err(WelchError::TooShort { samples, length });
    }
    if let Some(index) = (0..samples).find(|&k| !(input[k].is_finite() && output[k].is_finite())) {
        return Err(WelchError::NotFinite { index });
    }
    let window: Vec<f64> = (0..length).map(|k| welch.window.at(k, length)).collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let fft = FftPlanner::new().plan_fft_forward(length);
    let bins = length / 2;
    let mut cross = vec![Complex64::default(); bins];
    let mut auto = vec![0.0; bins];
    let mut out = vec![0.0; bins];
    let mut buffer = vec![Complex64::default(); length];
    let mut scratch = vec![Complex64::default(); fft.get_inplace_scratch_len()];
    let segments = (samples - length) / welch.shift.max(1) + 1;
    for p in 0..segments {
        let start = p * welch.shift.max(1);
        let u = detrended(&input[start..start + length], welch.detrend);
        let y = detrended(&output[start..start + length], welch.detrend);
        // both real records in one complex transform: u + j y
        for k in 0..length {
            buffer[k] = Complex64::new(u[k], y[k]) * window[k];
        }
        fft.process_with_scratch(&mut buffer, &mut scratch);
        for k in 1..=bins {
            let (z, mirrored) = (buffer[k % length], buffer[(length - k) % length].conj());
            let spectrum_u = 0.5 * (z + mirrored);
            let spectrum_y = Complex64::new(0.0, -0.5) * (z - mirrored);
            cross[k - 1] += spectrum_u.conj() * spectrum_y;
            auto[k - 1] += spectrum_u.norm_sqr();
            out[k - 1] += spectrum_y.norm_sqr();
        }
    }
    let scale = period / (power * segments as f64);
    Ok(Estimate {
        omega: (1..=bins)
            .map(|k| TAU * k as f64 / (length as f64 * period))
            .collect(),
        response: (0..bins).map(|k| cross[k] / auto[k]).collect(),
        coherence: (0..bins)
            .map(|k| cross[k].norm_sqr() / (auto[k] * out[k]))
            .collect(),
        input: auto.iter().map(|a| a * scale).collect(),
        output: out.iter().map(|a| a * scale).collect(),
        segments,
    })
}

fn detrended(x: &[f64], detrend: Detrend) -> Vec<f64> {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    match detrend {
        Detrend::None => x.to_vec(),
        Detrend::Mean => x.iter().map(|v| v - mean).collect(),
        Detrend::Line => {
            let centre = (n - 1.0) / 2.0;
            let slope = x
                .iter()
                .enumerate()
                .map(|(k, v)| (k as f64 - centre) * v)
                .sum::<f64>()
                / (n * (n * n - 1.0) / 12.0);
            x.iter()
                .enumerate()
                .map(|(k, v)| v - mean - slope * (k as f64 - centre))
                .collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    use crate::{TransferFunction, simulate::Running};

    #[test]
    fn windows_have_their_shapes() {
        let at = |window: Window| [0, 2, 4].map(|k| window.at(k, 8));
        assert_eq!(at(Window::Rectangular), [1.0; 3]);
        assert_eq!(at(Window::Triangular), [0.0, 0.5, 1.0]);
        let shapes = [
            (at(Window::Hann), [0.0, 0.5, 1.0]),
            (
                at(Window::Exponential { samples: 2.0 }),
                [1.0, f64::exp(-1.0), f64::exp(-2.0)],
            ),
        ];
        for (found, wanted) in shapes {
            for (a, b) in found.into_iter().zip(wanted) {
                assert!((a - b).abs() < 1e-15, "{found:?}");
            }
        }
    }

    #[test]
    fn white_noise_through_a_filter() {
        let g = TransferFunction::sampled([0.3, 0.1], [1.0, -1.2, 0.6], 1e-3).unwrap();
        let mut running = Running::new(&g.to_state_space().unwrap()).unwrap();
        let mut random = Random::new(3);
        let (mut u, mut y) = (Vec::new(), Vec::new());
        for _ in 0..400_000 {
            let mut out = [0.0];
            let input = random.normal();
            running.step(&[input], &mut out);
            u.push(input);
            y.push(out[0] + 0.05 * random.normal());
        }
        let e = estimate(&u, &y, 1e-3, &Welch::hann(1024)).unwrap();
        for k in (5..500).step_by(7) {
            let wanted = g.response(e.omega[k]);
            let error = (e.response[k] / wanted - 1.0).norm();
            // Bendat and Piersol: √((1 − γ²)/(2 P γ²)) for P segments
            let c = e.coherence[k];
            let deviation = ((1.0 - c) / (2.0 * e.segments as f64 * c)).sqrt();
            assert!(error < 8.0 * deviation + 0.01, "{k} {error}");
        }
        // density of unit white noise: the sample time
        let mean = e.input.iter().sum::<f64>() / e.input.len() as f64;
        assert!((mean / 1e-3 - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_line_is_taken_off() {
        let x: Vec<f64> = (0..50).map(|k| 3.0 - 0.7 * f64::from(k)).collect();
        assert!(detrended(&x, Detrend::Line).iter().all(|v| v.abs() < 1e-12));
    }

    #[test]
    fn refusals() {
        assert!(matches!(
            estimate(&[0.0; 5], &[0.0; 6], 1.0, &Welch::hann(4)),
            Err(WelchError::Lengths { .. })
        ));
        assert!(matches!(
            estimate(&[0.0; 5], &[0.0; 5], 1.0, &Welch::hann(8)),
            Err(WelchError::TooShort { .. })
        ));
        let gap = [0.0, f64::NAN, 0.0, 1.0, 2.0];
        assert!(matches!(
            estimate(&gap, &[0.0; 5], 1.0, &Welch::hann(4)),
            Err(WelchError::NotFinite { index: 1 })
        ));
    }
}
