//! Where the pieces of a record begin that a fit left at a low place which is not the lowest, or has not seen.

use crate::identification::abreast::end;
use crate::identification::drive::LATEST;
use crate::identification::error::IdentificationError;
use crate::identification::estimate::Estimate;
use crate::identification::record::BenchRecord;
use crate::identification::refine::{BEGINS, Cut, FINE, Pieces, Settled};

/// A piece that leaves this many times the squared residuals of the median piece is caught among friction's turns.
const CAUGHT: f64 = 1.5;

impl Settled {
    /// The pieces that leave far more than most: their first states stayed at a low place that is not the lowest.
    fn caught(&self) -> Vec<usize> {
        let squares = |piece: usize| -> f64 {
            let of = |(left, rms): (&Vec<Vec<f64>>, &f64)| {
                left[piece].iter().map(|l| l * l).sum::<f64>() / (rms * rms)
            };
            self.left.iter().zip(&self.rms).map(of).sum()
        };
        let all: Vec<f64> = (0..self.begins.len()).map(squares).collect();
        let mut sorted = all.clone();
        sorted.sort_by(f64::total_cmp);
        let most = CAUGHT
            * sorted
                .get(sorted.len() / 2)
                .copied()
                .unwrap_or(f64::INFINITY);
        (0..all.len()).filter(|piece| all[*piece] > most).collect()
    }
}

/// Where the pieces of a fit begin, those that are caught at the end of the piece before; nothing where none is.
///
/// # Errors
/// [`IdentificationError::Axis`].
pub(super) fn freed<const N: usize>(
    record: &BenchRecord<'_>,
    cut: Cut,
    settled: &Settled,
) -> Result<Option<Vec<Vec<f64>>>, IdentificationError> {
    let pieces = Pieces::<N>::new(record, cut.piece, &settled.estimate);
    let drive = pieces.drive(&settled.estimate)?;
    let mut begins = settled.begins.clone();
    let mut any = false;
    for piece in settled.caught() {
        let before = piece.checked_sub(1);
        let state = before.and_then(|k| <[f64; N]>::try_from(begins.get(k)?.as_slice()).ok());
        let span = before.and_then(|k| pieces.spans.get(k));
        if let (Some(state), Some(span)) = (state, span) {
            begins[piece] = end(&drive, &state, &record.voltage[span.clone()]).to_vec();
            any = true;
        }
    }
    Ok(any.then_some(begins))
}

/// Root mean squares of what an estimate leaves of current (A) and angle (rad) of a record that it was not fitted to, cut into pieces
/// whose first states are free as those of the fit were; `rms` is what it left there.
///
/// # Errors
/// [`IdentificationError::Axis`].
pub(super) fn unseen<const N: usize>(
    record: &BenchRecord<'_>,
    estimate: &Estimate,
    rms: [f64; 2],
) -> Result<[f64; 2], IdentificationError> {
    let pieces = Pieces::<N>::new(record, FINE.piece, estimate);
    let drive = pieces.drive(estimate)?;
    let (mut sums, mut count) = ([0.0; 2], 0);
    let mut before: Option<[f64; N]> = None;
    for (piece, (span, seems)) in pieces.spans.iter().zip(&pieces.seems).enumerate() {
        // where it seems to begin, or at the end of the piece before: friction's turns make low places that are not the lowest
        let begun = |state| pieces.begun(piece, &drive, state, rms, BEGINS);
        let cost = |state: &[f64; N]| pieces.cost(piece, &drive, state, rms);
        let mut state = begun(*seems);
        if let Some(other) = before.map(begun)
            && cost(&other) < cost(&state)
        {
            state = other;
        }
        for (sum, squares) in sums.iter_mut().zip(pieces.squares(piece, &drive, &state)) {
            *sum += squares;
        }
        count += span.len().saturating_sub(LATEST);
        before = Some(end(&drive, &state, &record.voltage[span.clone()]));
    }
    Ok(sums.map(|sum| (sum / count.max(1) as f64).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::galvanometer::{Galvanometer, example};
    use crate::identification::abreast::run;
    use crate::identification::drive::Drive;

    /// The state in which one piece ends is the one in which the next begins, across turns of the rotor.
    #[test]
    fn a_caught_piece_begins_where_the_one_before_ends() {
        let motor = Galvanometer {
            modes: vec![],
            ..example()
        };
        let estimate = Estimate {
            motor,
            coulomb: 3e-5,
            bias: 0.0,
            delays: [0.0; 2],
            zero: 0.0,
        };
        let period = 20e-6;
        let drive = Drive::<3>::new(&estimate.driven(), estimate.delays, period).unwrap();
        let voltage: Vec<f64> = (0..4800)
            .map(|k| if (k / 37) % 3 == 0 { 0.8 } else { -0.5 })
            .collect();
        let [current, angle] = run(&drive, &[0.0; 3], &voltage);
        let record = BenchRecord {
            period,
            voltage: &voltage,
            current: &current,
            angle: &angle,
        };
        let pieces = Pieces::<3>::new(&record, FINE.piece, &estimate);
        let mut begins = vec![vec![0.0; 3]];
        for k in 1..pieces.spans.len() {
            let before: [f64; 3] = begins[k - 1].as_slice().try_into().unwrap();
            let span = pieces.spans[k - 1].clone();
            begins.push(end(&drive, &before, &voltage[span]).to_vec());
        }
        let left = |caught: f64| -> Vec<Vec<f64>> {
            let level = |k: usize| if k == 7 { caught } else { 1.0 };
            (0..begins.len()).map(|k| vec![level(k); 100]).collect()
        };
        let mut settled = Settled {
            estimate,
            sigma: vec![],
            begins: begins.clone(),
            rms: [1.0; 2],
            left: [left(1.0), left(2.0)],
            rounding: [0.0; 2],
            cost: 0.0,
            units: pieces.units,
            smooth: true,
        };
        settled.begins[7] = vec![0.1, 3.0, -0.2];
        let anew = freed::<3>(&record, FINE, &settled).unwrap().unwrap();
        for (anew, wanted) in anew.iter().flatten().zip(begins.iter().flatten()) {
            assert!((anew - wanted).abs() < 1e-12, "{anew} {wanted}");
        }
        // nothing is begun anew where all leave alike
        settled.left = [left(1.0), left(1.1)];
        assert!(freed::<3>(&record, FINE, &settled).unwrap().is_none());
    }
}
