//! Accelerations that programs say, and which of them metal shows.

use crate::scan::finite;

/// What a program says of how quickly a move along its path gains and loses its speed.
#[derive(Debug, Clone, PartialEq)]
pub enum Acceleration {
    /// mm/s².
    Of(f64),
    /// A share of what the controller does, or something that is not known here, in the program's words.
    Words(String),
}

impl Acceleration {
    /// One in m/s², as `words` say it.
    pub(crate) fn metres(value: &str, words: &str) -> Self {
        match finite(value).filter(|a| *a > 0.0) {
            Some(a) => Acceleration::Of(1000.0 * a),
            None => Acceleration::Words(words.to_owned()),
        }
    }

    /// A share of the controller's own, %; nothing where that is not lowered.
    pub(crate) fn share(percent: f64, words: &str) -> Option<Self> {
        (percent < 100.0).then(|| Acceleration::Words(words.to_owned()))
    }

    /// What is told of it where a speed, mm/s, is not reached within `unseen` mm.
    pub(crate) fn told(&self, speed: Option<f64>, unseen: f64) -> Option<String> {
        match (self, speed) {
            (Acceleration::Of(a), Some(speed)) => {
                let way = 0.5 * speed * speed / a;
                (way > unseen).then(|| {
                    format!("an acceleration of {} m/s², by which the speed is reached over {way:.1} mm,", a / 1000.0)
                })
            }
            (Acceleration::Of(a), None) => Some(format!("an acceleration of {} m/s²", a / 1000.0)),
            (Acceleration::Words(words), _) => Some(words.clone()),
        }
    }
}
