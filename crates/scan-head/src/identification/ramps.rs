//! Steady ramps found in a record of angle and current, for the friction behind them.
//!
//! Source: Rasoanarivo 2020, § 2.2.1.5 (friction from angle ramps at constant speed, T = Kc ī); finding the ramps in a record is
//! ours.

use crate::identification::error::IdentificationError;
use crate::identification::friction::SteadyRamp;

/// Length of the pieces in which the speed is judged, s.
const PIECE: f64 = 2.5e-3;
/// Pieces belong to one ramp while their speeds differ by less than this share of the ramp's.
const STEADY: f64 = 0.05;
/// Pieces at the begin of a ramp that are left out: the loops are still settling.
const SETTLING: usize = 4;
/// Pieces that a ramp has at least after that.
const LEAST: usize = 4;
/// Slower than this share of the fastest piece counts as rest.
const REST: f64 = 1e-3;

/// The ramps of a record sampled every `period` s: stretches of 23 ms or more at a constant speed (angles in rad, currents in A), by
/// time. The first 10 ms of each and the last 3 ms are left out. Each mean current has the deviation that the noise within the ramps leaves
/// of it: by the differences of pieces that follow each other, so that a drift is not taken for noise; of all ramps together, for one has
/// few pieces.
///
/// # Errors
/// [`IdentificationError::Lengths`].
///
/// ```
/// use meltpath_scan_head::identification::ramps::steady_ramps;
/// let angle: Vec<f64> = (0..4000).map(|k| 2.0 * 50e-6 * f64::from(k.min(2000))).collect();   // 2 rad/s, then rest
/// let current = vec![0.01; 4000];
/// let ramps = steady_ramps(&angle, &current, 50e-6).unwrap();
/// assert_eq!(ramps.len(), 1);
/// assert!((ramps[0].speed - 2.0).abs() < 1e-9 && (ramps[0].current - 0.01).abs() < 1e-12);
/// ```
pub fn steady_ramps(
    angle: &[f64],
    current: &[f64],
    period: f64,
) -> Result<Vec<SteadyRamp>, IdentificationError> {
    if angle.len() != current.len() {
        return Err(IdentificationError::Lengths {
            what: "the current",
            found: current.len(),
            wanted: angle.len(),
        });
    }
    let length = ((PIECE / period).round() as usize).max(3);
    let speeds: Vec<f64> = angle
        .chunks_exact(length)
        .map(|piece| slope(piece) / period)
        .collect();
    let fastest = speeds.iter().fold(0.0, |a: f64, s| a.max(s.abs()));
    let mut ramps = Vec::new();
    let (mut noise, mut pieces) = (PieceNoise::default(), Vec::new());
    let mut begin = 0;
    while begin < speeds.len() {
        let first = speeds[begin];
        let mut end = begin + 1;
        // against the mean of what is already in the ramp: a slow drift of speed ends it
        let mut mean = first;
        while end < speeds.len() && (speeds[end] - mean).abs() <= STEADY * mean.abs() {
            mean += (speeds[end] - mean) / (end + 1 - begin) as f64;
            end += 1;
        }
        // the last piece may hold the begin of what follows
        if mean.abs() > REST * fastest && end - begin > SETTLING + LEAST {
            let samples = (begin + SETTLING) * length..(end - 1) * length;
            let held = &current[samples.clone()];
            ramps.push(SteadyRamp {
                speed: slope(&angle[samples]) / period,
                current: mean_of(held),
                sigma: None,
            });
            pieces.push(noise.add(held, length));
            begin = end;
        } else {
            begin += 1;
        }
    }
    for (ramp, pieces) in ramps.iter_mut().zip(pieces) {
        ramp.sigma = Some(noise.of_one() / f64::from(pieces).sqrt());
    }
    Ok(ramps)
}

/// Noise of the mean current of a piece, by the differences of pieces that follow each other.
#[derive(Default)]
struct PieceNoise {
    squares: f64,
    count: u32,
}

impl PieceNoise {
    /// Takes the pieces of a ramp, and tells how many they are.
    fn add(&mut self, held: &[f64], length: usize) -> u32 {
        let means: Vec<f64> = held.chunks_exact(length).map(mean_of).collect();
        for pair in means.windows(2) {
            self.squares += (pair[1] - pair[0]).powi(2);
            self.count += 1;
        }
        means.len() as u32
    }

    /// Standard deviation of one piece, A.
    fn of_one(&self) -> f64 {
        (0.5 * self.squares / f64::from(self.count.max(1))).sqrt()
    }
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Least-squares slope per sample.
fn slope(values: &[f64]) -> f64 {
    let middle = 0.5 * (values.len() - 1) as f64;
    let (mut rise, mut run) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let lag = k as f64 - middle;
        rise += lag * value;
        run += lag * lag;
    }
    rise / run
}
