//! Where the grid lines of an axis stand, and what is written at them.

use super::Scale;
use crate::number::{fixed, significant, ticks};

/// A line of the grid.
pub(super) struct Tick {
    /// Where, in the coordinates of the frame.
    pub(super) at: f64,
    /// What stands at it.
    pub(super) label: Option<String>,
}

/// Most decades whose parts are drawn too.
const FINE_DECADES: f64 = 8.0;

/// The grid lines of an axis from `lo` to `hi` in the frame's coordinates, about `count` of them labelled.
pub(super) fn axis_ticks(scale: Scale, lo: f64, hi: f64, count: u32) -> Vec<Tick> {
    let span = hi - lo;
    // an axis within a third of a decade is as good as linear; one of 300 decades is none
    if scale == Scale::Linear || !(0.3..300.0).contains(&span) {
        let (values, decimals) = ticks(lo, hi, count);
        return values
            .into_iter()
            .map(|v| Tick {
                at: v,
                label: Some(match scale {
                    Scale::Linear => tick_label(v, decimals),
                    Scale::Logarithmic => significant(10f64.powf(v), 3),
                }),
            })
            .collect();
    }
    let every = (span / f64::from(count.max(1))).ceil().max(1.0) as i32;
    let parts: &[i32] = if span <= FINE_DECADES {
        &[1, 2, 3, 4, 5, 6, 7, 8, 9]
    } else {
        &[1]
    };
    let mut all = Vec::new();
    for decade in lo.floor() as i32..=hi.ceil() as i32 {
        for &part in parts {
            let at = f64::from(decade) + f64::from(part).log10();
            if at < lo - 1e-9 || at > hi + 1e-9 {
                continue;
            }
            let labelled = match part {
                1 => decade.rem_euclid(every) == 0,
                2 | 5 => span < 1.7,
                _ => false,
            };
            let value = f64::from(part) * 10f64.powi(decade);
            all.push(Tick {
                at,
                label: labelled.then(|| significant(value, 1)),
            });
        }
    }
    all
}

fn tick_label(value: f64, decimals: usize) -> String {
    if value.abs() >= 1e6 {
        significant(value, 4)
    } else {
        fixed(value, decimals)
    }
}
