//! Sine, cosine and the angle of a point without branches or calls, so that a loop over them runs in vector registers.
//!
//! Sine and cosine by the kernels of fdlibm (Sun Microsystems 1993), the arc tangent by that of Cephes (S. Moshier 1989). Both are within 1e-15
//! of the exact values for angles up to a few turns; tests hold them against the library's.

#![expect(
    clippy::inline_always,
    reason = "a loop over them has to be compiled for the registers it is called under"
)]

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, FRAC_PI_4, PI};

/// Adding this to a number below 2^51 rounds it to a whole one, which then stands in the last bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// The nearest whole number, for numbers below 2^51.
#[inline(always)]
pub(super) fn rounded(x: f64) -> f64 {
    (x + WHOLE) - WHOLE
}

/// The nearest whole number, of two as near the one away from zero, as [`f64::round`] has it; for numbers below 2^51.
#[inline(always)]
pub(super) fn whole(x: f64) -> f64 {
    let even = rounded(x);
    if (x - even).abs() == 0.5 {
        x + 0.5_f64.copysign(x)
    } else {
        even
    }
}

/// Sine and cosine of `angle` rad, which is at most some thousand turns.
#[inline(always)]
pub(super) fn sin_cos(angle: f64) -> (f64, f64) {
    // a quarter turn in two parts: the first has 33 bits, so that its multiples are exact
    const QUARTER: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
    let shifted = angle * FRAC_2_PI + WHOLE;
    let quarters = shifted - WHOLE;
    let r = (angle - quarters * QUARTER[0]) - quarters * QUARTER[1];
    let z = r * r;
    let sine = 1.589_690_995_211_55e-10;
    let sine = sine * z - 2.505_076_025_340_686_3e-8;
    let sine = sine * z + 2.755_731_370_707_006_8e-6;
    let sine = sine * z - 1.984_126_982_985_795e-4;
    let sine = sine * z + 8.333_333_333_322_49e-3;
    let sine = sine * z - 1.666_666_666_666_663_2e-1;
    let sine = r + r * z * sine;
    let cosine = -1.135_964_755_778_819_5e-11;
    let cosine = cosine * z + 2.087_572_321_298_175e-9;
    let cosine = cosine * z - 2.755_731_435_139_066_3e-7;
    let cosine = cosine * z + 2.480_158_728_947_673e-5;
    let cosine = cosine * z - 1.388_888_888_887_411e-3;
    let cosine = cosine * z + 4.166_666_666_666_66e-2;
    let cosine = 1.0 - (0.5 * z - z * z * cosine);
    // odd quarters swap them; in quarters 2 and 3 the sine is below zero, in 1 and 2 the cosine
    let quarter = shifted.to_bits();
    let odd = quarter & 1 == 1;
    let (s, k) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sign = |x: f64, of: u64| f64::from_bits(x.to_bits() ^ ((of & 2) << 62));
    (sign(s, quarter), sign(k, quarter + 1))
}

/// The angle of the point (`x`, `y`) from the x axis, rad; zero for the origin.
#[inline(always)]
pub(super) fn atan2(y: f64, x: f64) -> f64 {
    let (up, out) = (y.abs(), x.abs());
    let steep = out < up;
    let low = if steep { out } else { up };
    let high = if steep { up } else { out };
    // above 0.66 from an eighth of a turn: the tangent of the difference
    let near = high * 0.66 < low;
    let over = if near { low - high } else { low };
    let under = if near { low + high } else { high };
    let t = over / if under == 0.0 { 1.0 } else { under };
    let z = t * t;
    let above = -0.875_060_860_003_190_4;
    let above = above * z - 16.157_537_187_333_65;
    let above = above * z - 75.008_557_923_147_05;
    let above = above * z - 122.886_668_449_013_62;
    let above = above * z - 64.850_219_049_420_25;
    let below = z + 24.858_464_901_423_062;
    let below = below * z + 165.027_009_831_698_85;
    let below = below * z + 432.881_060_491_291_3;
    let below = below * z + 485.390_399_635_913_7;
    let below = below * z + 194.550_657_148_261_4;
    let angle = t + t * z * (above / below);
    let angle = if near { angle + FRAC_PI_4 } else { angle };
    let angle = if steep { FRAC_PI_2 - angle } else { angle };
    let angle = if x < 0.0 { PI - angle } else { angle };
    angle.copysign(y)
}

#[cfg(test)]
mod tests {
    use meltpath_numerics::random::Random;
    use proptest::prelude::*;

    use super::*;

    fn close(angle: f64, [y, x]: [f64; 2]) {
        let ((s, k), (sine, cosine)) = (sin_cos(angle), angle.sin_cos());
        assert!((s - sine).abs() < 4e-16, "sine of {angle}: {s} {sine}");
        assert!(
            (k - cosine).abs() < 4e-16,
            "cosine of {angle}: {k} {cosine}"
        );
        let (found, known) = (atan2(y, x), y.atan2(x));
        assert!((found - known).abs() < 1e-15, "({x}, {y}): {found} {known}");
    }

    #[test]
    fn angles_are_those_of_the_library() {
        let mut random = Random::new(9);
        for _ in 0..1_000_000 {
            let of_any_size = |random: &mut Random| {
                random.between(-1.0, 1.0) * 10.0_f64.powf(random.between(-12.0, 4.0))
            };
            let point = [of_any_size(&mut random), of_any_size(&mut random)];
            close(random.between(-30.0, 30.0), point);
        }
    }

    #[test]
    fn whole_numbers_are_those_of_the_library() {
        let mut random = Random::new(10);
        let halves = (-9..=9).map(|i| 0.5 * f64::from(i));
        let beside = halves.flat_map(|h| [h, h.next_up(), h.next_down(), h - 0.1, h + 0.1]);
        let anywhere = (0..10_000).map(|_| random.between(-1e6, 1e6));
        for x in beside.chain(anywhere) {
            assert_eq!(whole(x), x.round(), "{x}");
        }
    }

    #[test]
    fn borders_of_quarters_are_met() {
        let quarters = (-9..=9).map(|i| f64::from(i) * 0.5 * FRAC_PI_2);
        for angle in quarters.flat_map(|q| [q, q - 1e-9, q + 1e-9, q - 1e-16, q + 1e-16]) {
            let (s, k) = angle.sin_cos();
            close(angle, [s, k]);
        }
        for y in [0.0, -0.0, 1.0, -1.0, 1e-300, 0.66, f64::MIN_POSITIVE] {
            for x in [0.0, 1.0, -1.0, 1e-300, -0.66] {
                close(y, [y, x]);
            }
        }
        assert!(sin_cos(f64::NAN).0.is_nan() && atan2(f64::NAN, 1.0).is_nan());
    }

    proptest! {
        #[test]
        fn the_angle_of_a_sine_and_cosine_is_their_own(angle in -3.0..3.0) {
            let (s, k) = sin_cos(angle);
            prop_assert!((atan2(s, k) - angle).abs() < 1e-15);
        }
    }
}
