//! Numbers as people read them, and the round values of an axis.

/// `value` with `figures` significant digits, without an exponent between 1e-4 and 1e7; a true minus sign;
/// `unknown` when not finite.
///
/// ```
/// use meltpath_report::number::significant;
/// assert_eq!(significant(1234.567, 4), "1235");
/// assert_eq!(significant(-0.012345, 3), "−0.0123");
/// assert_eq!(significant(2.50, 4), "2.5");
/// assert_eq!(significant(1.5e-9, 3), "1.5e−9");
/// assert_eq!(significant(f64::NAN, 3), "unknown");
/// ```
pub fn significant(value: f64, figures: u32) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let figures = figures.clamp(1, 15).cast_signed();
    // the exponent after rounding: 9.996 with three figures is 10.0
    let rounded = format!("{:.*e}", usize::try_from(figures - 1).unwrap_or(0), value);
    let exponent: i32 = rounded
        .split_once('e')
        .and_then(|(_, e)| e.parse().ok())
        .unwrap_or(0);
    let text = if (-4..7).contains(&exponent) {
        let decimals = usize::try_from(figures - 1 - exponent).unwrap_or(0);
        trimmed(&format!("{value:.decimals$}"))
    } else {
        let (mantissa, _) = rounded.split_once('e').unwrap_or((&rounded, ""));
        format!("{}e{exponent}", trimmed(mantissa))
    };
    text.replace('-', "−")
}

/// `value` with exactly `decimals` digits after the point; a true minus sign; `unknown` when not finite.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "unknown".to_owned();
    }
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.'));
    if is_zero {
        text.trim_start_matches('-').to_owned()
    } else {
        text.replace('-', "−")
    }
}

fn trimmed(text: &str) -> String {
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text.to_owned()
    }
}

/// A value with its uncertainty: the uncertainty with two figures, the value to the same place.
///
/// ```
/// use meltpath_report::number::with_uncertainty;
/// assert_eq!(with_uncertainty(5.4732, 1.483), "5.5 ± 1.5");
/// assert_eq!(with_uncertainty(0.0, 0.02), "0 ± 0.02");
/// ```
pub fn with_uncertainty(value: f64, sigma: f64) -> String {
    if !(sigma.is_finite() && sigma > 0.0 && value.is_finite()) {
        return significant(value, 4);
    }
    let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize;
    format!(
        "{} ± {}",
        trimmed(&fixed(value, decimals)),
        trimmed(&fixed(sigma, decimals))
    )
}

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

        #[test]
        fn significant_digits_carry_the_value(value in -1e12..1e12_f64) {
            let text = significant(value, 6).replace('−', "-");
            let back: f64 = text.parse().unwrap();
            prop_assert!((back - value).abs() <= 1e-5 * value.abs());
        }
    }

    #[test]
    fn rounding_carries_into_the_exponent() {
        assert_eq!(significant(9.996, 3), "10");
        assert_eq!(significant(9_999_999.0, 3), "1e7");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(duration(59.97), "1 min 00 s");
        assert_eq!(duration(3599.7), "1 h 00 min");
    }
}
