//! Pseudo-random binary sequences: the excitation with a flat spectrum that two levels can give.
//!
//! Rasoanarivo 2020, annex A.1; primitive polynomials found by exhaustive check (tested here).

/// Feedback taps of a maximal shift register, for 3 to 18 stages.
const TAPS: [&[usize]; 16] = [
    &[2, 3],
    &[3, 4],
    &[3, 5],
    &[5, 6],
    &[6, 7],
    &[4, 5, 6, 8],
    &[5, 9],
    &[7, 10],
    &[9, 11],
    &[4, 10, 11, 12],
    &[8, 11, 12, 13],
    &[2, 12, 13, 14],
    &[14, 15],
    &[4, 13, 15, 16],
    &[14, 17],
    &[11, 18],
];

/// A shift register that runs through all its states but zero.
///
/// ```
/// use meltpath_control::prbs::Prbs;
/// let one_period: Vec<f64> = Prbs::new(4).unwrap().take(15).collect();
/// assert_eq!(one_period.iter().sum::<f64>().abs(), 1.0);
/// ```
#[derive(Debug, Clone)]
pub struct Prbs {
    stages: usize,
    taps: u32,
    state: u32,
}

/// A register of this length is not provided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "a pseudo-random sequence of {stages} stages is not provided: use 3 to 18 (period 2^stages − 1)"
)]
pub struct StagesError {
    /// What was asked for.
    pub stages: usize,
}

impl Prbs {
    /// A register of `stages` stages, all at one.
    ///
    /// # Errors
    /// [`StagesError`] outside 3 to 18.
    pub fn new(stages: usize) -> Result<Self, StagesError> {
        let taps = stages
            .checked_sub(3)
            .and_then(|k| TAPS.get(k))
            .ok_or(StagesError { stages })?;
        Ok(Prbs {
            stages,
            taps: taps.iter().map(|t| 1 << (t - 1)).sum(),
            state: (1 << stages) - 1,
        })
    }

    /// Values before the sequence repeats.
    pub fn period(&self) -> usize {
        (1 << self.stages) - 1
    }

    /// `count` samples of ±`amplitude`, each register value held for `hold` samples.
    pub fn signal(&self, amplitude: f64, hold: usize, count: usize) -> Vec<f64> {
        let hold = hold.max(1);
        self.clone()
            .flat_map(|v| std::iter::repeat_n(v * amplitude, hold))
            .take(count)
            .collect()
    }
}

impl Iterator for Prbs {
    type Item = f64;

    /// The next value, −1 or 1; the sequence never ends.
    fn next(&mut self) -> Option<f64> {
        let out = (self.state >> (self.stages - 1)) & 1;
        let fresh = (self.state & self.taps).count_ones() & 1;
        self.state = ((self.state << 1) | fresh) & ((1 << self.stages) - 1);
        Some(2.0 * f64::from(out) - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;

    #[test]
    fn lpbf_ac07_sequence_of_four_stages() {
        let s: Vec<f64> = Prbs::new(4).unwrap().take(30).collect();
        assert_eq!(s[..15], s[15..]);
        assert!((1..15).all(|p| (0..15).any(|k| s[k] != s[k + p])));
        for shift in 0..15 {
            let sum: f64 = (0..15).map(|k| s[k] * s[k + shift]).sum();
            assert_eq!(sum, if shift == 0 { 15.0 } else { -1.0 });
        }
        assert_eq!(s[..15].iter().sum::<f64>().abs(), 1.0);
        for bin in 1..15 {
            let z: Complex64 = (0..15)
                .map(|k| s[k] * Complex64::cis(-std::f64::consts::TAU * (bin * k) as f64 / 15.0))
                .sum();
            assert!((z.norm_sqr() - 16.0).abs() < 1e-11);
        }
    }

    #[test]
    fn lpbf_ac08_every_register_is_maximal() {
        for stages in 3..=18 {
            let mut register = Prbs::new(stages).unwrap();
            let start = register.state;
            let mut steps = 0;
            loop {
                register.next();
                steps += 1;
                if register.state == start {
                    break;
                }
            }
            assert_eq!(steps, (1usize << stages) - 1);
        }
        assert!(Prbs::new(2).is_err() && Prbs::new(19).is_err());
    }

    #[test]
    fn held_signal() {
        let s = Prbs::new(5).unwrap().signal(0.5, 3, 10);
        assert!(s.len() == 10 && s[0] == s[2] && s.iter().all(|v| v.abs() == 0.5));
    }
}
