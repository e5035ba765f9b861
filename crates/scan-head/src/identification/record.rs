//! A bench record of voltage, current and angle, and how responses are estimated from it.

use meltpath_control::welch::Welch;

/// A bench record of one axis, one value a sample.
#[derive(Debug, Clone, Copy)]
pub struct BenchRecord<'a> {
    /// Time between samples, s.
    pub period: f64,
    /// Voltage held from each sample on, V.
    pub voltage: &'a [f64],
    /// Current, A.
    pub current: &'a [f64],
    /// Angle, rad.
    pub angle: &'a [f64],
}

/// What was excited.
#[derive(Debug, Clone, Copy)]
pub enum Excitation<'a> {
    /// The voltage itself, in open loop.
    Voltage,
    /// The set-point of the closed loop, rad: estimates refer to it, so that noise that the loop feeds back does not bias them.
    SetPoint(&'a [f64]),
}

/// How estimates are made and fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Method {
    /// The spectral estimate.
    pub welch: Welch,
    /// The band of the fit, Hz.
    pub band: [f64; 2],
}

impl Default for Method {
    /// Hann windows of 8192 samples, half overlapping; 5 Hz to 1.5 kHz.
    fn default() -> Self {
        Method {
            welch: Welch::hann(8192),
            band: [5.0, 1500.0],
        }
    }
}

impl Method {
    /// Windows of about 0.4 s, whatever the sample time (s): 8192 samples at 20 kHz, 32 768 at 93.75 kHz. Shorter ones do not see
    /// viscous damping.
    pub fn at(period: f64) -> Self {
        let exponent = (0.41 / period).log2().round().clamp(8.0, 20.0) as u32;
        Method {
            welch: Welch::hann(1 << exponent),
            ..Method::default()
        }
    }
}
