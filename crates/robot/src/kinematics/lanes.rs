//! Several numbers at once: arithmetic and angles without branches, so that the compiler makes vector instructions of them.
//!
//! Sine and cosine after fdlibm's kernels, arc tangent after Cephes: within 2e-15 of the exact values for angles up to a few turns,
//! which the tests hold against the library's.

#![expect(
    clippy::inline_always,
    reason = "numbers stay in vector registers only where nothing is called"
)]

use std::array::from_fn;
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// How many numbers.
pub(super) const WIDTH: usize = 8;

/// Numbers of as many poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lanes(pub(super) [f64; WIDTH]);

/// What holds for each of them.
pub(super) type Mask = [bool; WIDTH];

impl Lanes {
    /// One number for all.
    #[inline(always)]
    pub(super) fn all(x: f64) -> Self {
        Lanes([x; WIDTH])
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        Lanes(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        Lanes(self.0.map(f64::abs))
    }

    /// At least zero.
    #[inline(always)]
    pub(super) fn positive(self) -> Self {
        Lanes(self.0.map(|x| if x > 0.0 { x } else { 0.0 }))
    }

    /// Where it is below another.
    #[inline(always)]
    pub(super) fn below(self, other: Self) -> Mask {
        from_fn(|i| self.0[i] < other.0[i])
    }

    /// Itself where `mask` holds, else `other`.
    #[inline(always)]
    pub(super) fn where_or(self, mask: Mask, other: Self) -> Self {
        Lanes(from_fn(|i| if mask[i] { self.0[i] } else { other.0[i] }))
    }

    /// The root of the sum of squares.
    #[inline(always)]
    pub(super) fn length(self, other: Self) -> Self {
        (self * self + other * other).sqrt()
    }

    /// The nearest whole numbers, for those below 2^51.
    #[inline(always)]
    fn rounded(self) -> Self {
        const SHIFT: f64 = 6_755_399_441_055_744.0;
        (self + Lanes::all(SHIFT)) - Lanes::all(SHIFT)
    }

    /// Powers of `self` from the highest coefficient down.
    #[inline(always)]
    fn polynomial<const N: usize>(self, coefficients: [f64; N]) -> Self {
        let mut sum = Lanes::all(0.0);
        for c in coefficients {
            sum = sum * self + Lanes::all(c);
        }
        sum
    }

    /// Sine and cosine.
    #[inline(always)]
    pub(super) fn sin_cos(self) -> (Self, Self) {
        // quarter turns away, in two parts: the first has 33 bits, so that its multiples are exact
        const QUARTER: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
        const SINE: [f64; 6] = [
            1.589_690_995_211_55e-10,
            -2.505_076_025_340_686_3e-8,
            2.755_731_370_707_006_8e-6,
            -1.984_126_982_985_795e-4,
            8.333_333_333_322_49e-3,
            -1.666_666_666_666_663_2e-1,
        ];
        const COSINE: [f64; 6] = [
            -1.135_964_755_778_819_5e-11,
            2.087_572_321_298_175e-9,
            -2.755_731_435_139_066_3e-7,
            2.480_158_728_947_673e-5,
            -1.388_888_888_887_411e-3,
            4.166_666_666_666_66e-2,
        ];
        let quarters = (self * Lanes::all(2.0 * FRAC_1_PI)).rounded();
        let r = (self - quarters * Lanes::all(QUARTER[0])) - quarters * Lanes::all(QUARTER[1]);
        let z = r * r;
        let sine = r + r * z * z.polynomial(SINE);
        let cosine = Lanes::all(1.0) - (Lanes::all(0.5) * z - z * z * z.polynomial(COSINE));
        // odd quarters swap them; quarters 2 and 3 turn the sine's sign, 1 and 2 the cosine's
        let half = quarters * Lanes::all(0.5);
        let odd: Mask = {
            let whole = half.rounded();
            from_fn(|i| half.0[i] != whole.0[i])
        };
        let swapped = (cosine.where_or(odd, sine), sine.where_or(odd, cosine));
        let sign = |q: Self| {
            // of the quarters q, 0 and 1 within a whole turn give 1, 2 and 3 give -1
            let h = (q - Lanes::all(0.5)) * Lanes::all(0.5);
            let even = h.rounded();
            let quarter = even * Lanes::all(0.5);
            let whole = quarter.rounded();
            Lanes(from_fn(|i| {
                if quarter.0[i] == whole.0[i] {
                    1.0
                } else {
                    -1.0
                }
            }))
        };
        (
            swapped.0 * sign(quarters),
            swapped.1 * sign(quarters + Lanes::all(1.0)),
        )
    }

    /// The angle of the point (`x`, `self`); zero for the origin.
    #[inline(always)]
    pub(super) fn atan2(self, x: Self) -> Self {
        const ABOVE: [f64; 5] = [
            -0.875_060_860_003_190_4,
            -16.157_537_187_333_65,
            -75.008_557_923_147_05,
            -122.886_668_449_013_62,
            -64.850_219_049_420_25,
        ];
        const BELOW: [f64; 6] = [
            1.0,
            24.858_464_901_423_062,
            165.027_009_831_698_85,
            432.881_060_491_291_3,
            485.390_399_635_913_7,
            194.550_657_148_261_4,
        ];
        let (a, b) = (self.abs(), x.abs());
        let steep = b.below(a);
        let (low, high) = (b.where_or(steep, a), a.where_or(steep, b));
        // above 0.66 from an eighth of a turn: the tangent of the difference
        let near = (high * Lanes::all(0.66)).below(low);
        let over = (low - high).where_or(near, low);
        let under = (low + high).where_or(near, high);
        let nothing = under.0.map(|u| u == 0.0);
        let t = Lanes::all(0.0).where_or(nothing, over / Lanes::all(1.0).where_or(nothing, under));
        let z = t * t;
        let small = t + t * z * (z.polynomial(ABOVE) / z.polynomial(BELOW));
        let angle = Lanes::all(FRAC_PI_4).where_or(near, Lanes::all(0.0)) + small;
        let angle = (Lanes::all(FRAC_PI_2) - angle).where_or(steep, angle);
        let back = x.0.map(|x| x < 0.0);
        let angle = (Lanes::all(PI) - angle).where_or(back, angle);
        Lanes(from_fn(|i| angle.0[i].copysign(self.0[i])))
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] * other.0[i]))
    }
}

impl Div for Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Lanes(from_fn(|i| self.0[i] / other.0[i]))
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Lanes(self.0.map(|x| -x))
    }
}

/// Where both hold.
#[inline(always)]
pub(super) fn both(a: Mask, b: Mask) -> Mask {
    from_fn(|i| a[i] & b[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn angles_are_those_of_the_library(x in -20.0..20.0, y in -1e3..1e3, small in -1e-9..1e-9) {
            let (s, c) = Lanes([x, small, -x, 0.0, PI, -PI, FRAC_PI_2, 3.0 * FRAC_PI_4]).sin_cos();
            for (i, a) in [x, small, -x, 0.0, PI, -PI, FRAC_PI_2, 3.0 * FRAC_PI_4].into_iter().enumerate() {
                prop_assert!((s.0[i] - a.sin()).abs() < 2e-15 && (c.0[i] - a.cos()).abs() < 2e-15, "{a}");
            }
            let (ys, xs) = ([y, small, y, 0.0, -0.0, 0.0, y, -y], [x, x, small, 0.0, -1.0, -1.0, y, y]);
            let found = Lanes(ys).atan2(Lanes(xs));
            for i in 0..WIDTH {
                prop_assert!((found.0[i] - ys[i].atan2(xs[i])).abs() < 2e-15, "{} {}", ys[i], xs[i]);
            }
        }
    }
}
