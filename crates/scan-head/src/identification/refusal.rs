//! Peaks of a response that are no modes, and why.

/// A peak of angle over current that stands out of the rigid motor's, and why it is no mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RefusedPeak {
    /// Where, Hz.
    pub frequency: f64,
    /// How far it stands out, as a ratio.
    pub ratio: f64,
    /// Why it is no mode.
    pub why: Refusal,
}

/// Why a peak is no mode.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The response has not fallen again at the end of the band that is searched.
    #[error(
        "the response has not fallen again where the search ends, at {end:.0} Hz: sample faster to see what is there"
    )]
    Edge {
        /// The end, Hz.
        end: f64,
    },
    /// Most of the angle there is not an answer to the current.
    #[error("only {:.0} % of the angle there answers the current, the rest is noise or the encoder's steps: excite more, or average longer", 100.0 * coherence)]
    Noise {
        /// Coherence at the peak.
        coherence: f64,
    },
    /// Thinner than the windows of the estimate tell from a line.
    #[error(
        "it is {width:.1} Hz wide, thinner than the {resolved:.1} Hz that windows of this length resolve: record longer, in longer windows"
    )]
    Thin {
        /// Width at −3 dB, Hz.
        width: f64,
        /// Width of a line in the estimate, Hz.
        resolved: f64,
    },
    /// The fit leaves the peak for something else, as what friction does at low frequencies.
    #[error(
        "the fit takes it to {to:.0} Hz, where no peak is: it explains something else there, as friction at low frequencies: record longer, or excite more"
    )]
    Strayed {
        /// Where to, Hz.
        to: f64,
    },
    /// The angle turns there against what a mode of the rotor's side makes of it.
    #[error(
        "the angle there turns against the rotor: it is measured beyond the spring, as by an encoder on the load, and the gain of the mode is negative; motors here have modes of the rotor's own side alone: measure the angle of the rotor"
    )]
    Opposed,
    /// The fit with it does not determine it.
    #[error("its frequency, damping and gain are known to ± {:.0} % only: record longer, or excite more", 100.0 * sigma)]
    Unsure {
        /// The largest of the three relative deviations.
        sigma: f64,
    },
    /// What it does to the record other parameters do, too.
    #[error(
        "the record does not tell its frequency, damping and gain from the other parameters: record longer, excite more, or sample faster"
    )]
    Undetermined,
}
