//! Durations as people read them, and the round values of an axis.

pub use meltpath_base::number::{fixed, significant, with_uncertainty};

/// A duration in seconds as `1 h 02 min`, `3 min 05 s` or `12.5 s`.
///
/// ```
/// use meltpath_report::number::duration;
/// assert_eq!(duration(12.53), "12.5 s");
/// assert_eq!(duration(185.2), "3 min 05 s");
/// assert_eq!(duration(3725.0), "1 h 02 min");
/// ```
pub fn duration(seconds: f64) -> String {
    if !seconds.is_finite() {
        return "unknown".to_owned();
    }
    if seconds < 0.0 {
        return format!("−{}", duration(-seconds));
    }
    if seconds < 59.95 {
        return format!("{} s", fixed(seconds, 1));
    }
    let whole = seconds.round();
    if whole < 3600.0 {
        format!("{:.0} min {:02.0} s", (whole / 60.0).floor(), whole % 60.0)
    } else {
        let minutes = (seconds / 60.0).round();
        format!(
            "{:.0} h {:02.0} min",
            (minutes / 60.0).floor(),
            minutes % 60.0
        )
    }
}

/// Round values that divide `lo..hi` in about `count` intervals, and the decimals they need.
///
/// ```
/// let (ticks, decimals) = meltpath_report::number::ticks(0.0, 30.0, 6);
/// assert_eq!(ticks, [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]);
/// assert_eq!(decimals, 0);
/// ```
pub fn ticks(lo: f64, hi: f64, count: u32) -> (Vec<f64>, usize) {
    let span = hi - lo;
    if !(span.is_finite() && span > 0.0) {
        return (vec![lo], 2);
    }
    let raw = span / f64::from(count.max(1));
    let decade = 10_f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|step| *step >= raw * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade);
    let decimals = (0..12)
        .find(|&d| {
            let scaled = step * 10_f64.powi(d);
            (scaled - scaled.round()).abs() < 1e-6 * scaled.max(1.0)
        })
        .unwrap_or(12) as usize;
    let first = (lo / step - 1e-9).ceil();
    let past = (hi / step + 1e-9).floor();
    // a span far below the magnitude of its ends leaves no distinct ticks
    let n = (past - first).clamp(-1.0, 100.0) as i64;
    let values = (0..=n).map(|i| (first + i as f64) * step).collect();
    (values, decimals)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn ticks_stay_inside_and_are_few(lo in -1e6..1e6_f64, span in 1e-3..1e6_f64) {
            let (values, _) = ticks(lo, lo + span, 6);
            prop_assert!((2..=14).contains(&values.len()), "{values:?}");
            prop_assert!(values.iter().all(|v| *v >= lo - 1e-6 * span && *v <= lo + span * (1.0 + 1e-6)));
        }
    }

    #[test]
    fn rounding_carries_into_minutes_and_hours() {
        assert_eq!(duration(59.97), "1 min 00 s");
        assert_eq!(duration(3599.7), "1 h 00 min");
    }
}
