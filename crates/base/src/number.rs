//! Numbers as people read them, alike in reports, on the terminal and in messages.

/// `value` with `figures` significant digits, without an exponent between 1e-4 and 1e7; a true minus sign;
/// `unknown` when not finite.
///
/// ```
/// use meltpath_base::number::significant;
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

/// Significant digits to which a number that a person wrote comes back as written from other units.
pub const WRITTEN: usize = 10;

/// `value` to so many significant digits, as a number.
///
/// ```
/// use meltpath_base::number::{WRITTEN, rounded};
/// assert_eq!(rounded(1e3 * -0.009, WRITTEN), -9.0);
/// assert_eq!(rounded(2.0 / 3.0, 3), 0.667);
/// ```
pub fn rounded(value: f64, figures: usize) -> f64 {
    let text = format!("{value:.*e}", figures.saturating_sub(1));
    text.parse().unwrap_or(value)
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
/// use meltpath_base::number::with_uncertainty;
/// assert_eq!(with_uncertainty(5.4732, 1.483), "5.5 ± 1.5");
/// assert_eq!(with_uncertainty(0.0, 0.02), "0 ± 0.02");
/// assert_eq!(with_uncertainty(5473.2, 148.3), "5470 ± 150");
/// ```
pub fn with_uncertainty(value: f64, sigma: f64) -> String {
    if !(sigma.is_finite() && sigma > 0.0 && value.is_finite()) {
        return significant(value, 4);
    }
    // rounding of the computation, of which no digit is meant
    if sigma < 1e-7 * value.abs() {
        return significant(value, 7);
    }
    let decimals = 1.0 - sigma.log10().floor();
    // hundreds and more are rounded before the point
    let place = 10_f64.powf((-decimals).max(0.0));
    let decimals = decimals.clamp(0.0, 9.0) as usize;
    let shown = |number: f64| {
        let number = if place > 1.0 {
            (number / place).round() * place
        } else {
            number
        };
        trimmed(&fixed(number, decimals))
    };
    format!("{} ± {}", shown(value), shown(sigma))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn significant_digits_carry_the_value(value in -1e12..1e12_f64) {
            let text = significant(value, 6).replace('−', "-");
            let back: f64 = text.parse().unwrap();
            prop_assert!((back - value).abs() <= 1e-5 * value.abs());
        }
    }

    #[test]
    fn an_uncertainty_of_rounding_is_not_told() {
        assert_eq!(with_uncertainty(99.999_999_79, 1e-7), "100");
        assert_eq!(with_uncertainty(99.95, 0.036), "99.95 ± 0.036");
    }

    #[test]
    fn rounding_carries_into_the_exponent() {
        assert_eq!(significant(9.996, 3), "10");
        assert_eq!(significant(9_999_999.0, 3), "1e7");
        assert_eq!(fixed(-0.001, 2), "0.00");
    }
}
