//! The exponential of numbers that are not positive, in a form that runs in vector registers.

/// `e^x` for `x ≤ 0`, within 2e-13 of itself; 0 from about −700 down.
#[inline(always)]
pub(crate) fn exp_not_positive(x: f64) -> f64 {
    // adding this number rounds to an integer, which is then in its last bits
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let clamped = if x > -700.0 { x } else { -700.0 };
    let scaled = clamped * std::f64::consts::LOG2_E;
    let rounded = scaled + ROUND;
    let rest = (scaled - (rounded - ROUND)) * std::f64::consts::LN_2;
    // Taylor to the tenth order; |rest| ≤ 0.35
    let mut sum = 1.0 / 3_628_800.0;
    for c in [
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ] {
        sum = sum * rest + c;
    }
    let power = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    if x > -700.0 { sum * power } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn follows_the_library(x in -699.0..0.0_f64) {
            let exact = x.exp();
            prop_assert!((super::exp_not_positive(x) / exact - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn ends() {
        assert_eq!(super::exp_not_positive(0.0), 1.0);
        assert_eq!(super::exp_not_positive(-1e9), 0.0);
    }
}
