//! Whether a channel of a record came to the end of what it can show.

/// A channel with so many different values shows by them where its range ends; of one with fewer each value stands for many.
const FINE: usize = 200;
/// The values next to the end of a range that are held against those at its end: their share of all that the channel shows.
const NEXT: f64 = 0.01;
/// A range ends where so many times more samples lie at its end than next to it.
const PILED: usize = 3;

/// How many different values a channel has, and the share of samples at the one of its ends at which it is cut off.
pub(super) fn clipped(column: &[f64], taken: &[usize]) -> (usize, f64) {
    let mut values: Vec<f64> = taken.iter().map(|k| column[*k]).collect();
    values.sort_by(f64::total_cmp);
    let distinct = values.chunk_by(|a, b| a == b).count();
    let (Some(least), Some(most)) = (values.first().copied(), values.last().copied()) else {
        return (0, 0.0);
    };
    let next = NEXT * (most - least);
    let low = values.partition_point(|v| *v <= least);
    let above = values.partition_point(|v| *v <= least + next) - low;
    let high = values.len() - values.partition_point(|v| *v < most);
    let below = values.len() - values.partition_point(|v| *v < most - next) - high;
    let ends = [(low, above), (high, below)].map(|(end, beside)| match end {
        _ if distinct < FINE || end <= PILED * beside.max(1) => 0,
        end => end,
    });
    let share = ends[0].max(ends[1]) as f64 / values.len() as f64;
    (distinct, share)
}

/// The worse share of two channels; all of them where one shows one value while the other changes.
pub(super) fn worse([a, b]: [(usize, f64); 2]) -> f64 {
    let stands = |this: usize, other: usize| this == 1 && other >= FINE;
    if stands(a.0, b.0) || stands(b.0, a.0) {
        1.0
    } else {
        a.1.max(b.1)
    }
}
