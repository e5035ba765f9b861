//! Cross-section of a single bead on a flat plate: shapes, and the relations between width, height and area both ways.
//!
//! Source: Rouchon 2022, table 2.1 (after Ding 2015 and Cao 2011) with the corrected arc row; the semi-ellipse is ours.

use meltpath_numerics::halving;
use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

/// Shape of the section of a bead on a plate, apex above the middle of its width.
///
/// The parabola is the one retained by the source and the default everywhere. The arc suits bulged beads
/// (high wire-to-travel ratio), the Gaussian has no edge: its width is where it falls to 5 % of its apex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Section {
    /// y = h (1 − 4x²/w²).
    #[default]
    Parabola,
    /// y = h cos(πx/w).
    Cosine,
    /// Arc of a circle through the two toes and the apex.
    Arc,
    /// Half an ellipse.
    SemiEllipse,
    /// y = h exp(−x²/c²), w where y = 0.05 h: w = 2c √ln 20.
    Gaussian,
}

impl Section {
    /// All shapes.
    pub const ALL: [Section; 5] = [
        Section::Parabola,
        Section::Cosine,
        Section::Arc,
        Section::SemiEllipse,
        Section::Gaussian,
    ];

    /// Area of a section `width` wide and `height` high, mm². Zero where either is not positive.
    ///
    /// ```
    /// use meltpath_deposition::section::Section;
    /// assert!((Section::Parabola.area(7.0, 2.0) - 28.0 / 3.0).abs() < 1e-12);
    /// ```
    pub fn area(self, width: f64, height: f64) -> f64 {
        if !(width > 0.0 && height > 0.0) {
            return 0.0;
        }
        match self {
            Section::Parabola => 2.0 / 3.0 * width * height,
            Section::Cosine => 2.0 / PI * width * height,
            Section::SemiEllipse => PI / 4.0 * width * height,
            Section::Gaussian => width * height * (PI.sqrt() / (2.0 * 20f64.ln().sqrt())),
            Section::Arc => {
                let r = arc_radius(width, height);
                // atan2 keeps its precision for flat arcs and past the half circle, where arccos loses it
                let half_angle = (0.5 * width).atan2(r - height);
                r * r * half_angle - (r - height) * 0.5 * width
            }
        }
    }

    /// Height that gives `area` at `width`, mm.
    pub fn height(self, width: f64, area: f64) -> f64 {
        if !(width > 0.0 && area > 0.0) {
            return 0.0;
        }
        let unit = self.area(width, 1.0);
        match self {
            Section::Arc => root(area / unit, |h| self.area(width, h) - area),
            _ => area / unit,
        }
    }

    /// Width that gives `area` at `height`, mm.
    ///
    /// An arc of a given height has at least half a circle's area less its overhang: the width may then be smaller
    /// than twice the height, and no width gives less than a full circle of that diameter; the result is then 0.
    pub fn width(self, height: f64, area: f64) -> f64 {
        if !(height > 0.0 && area > 0.0) {
            return 0.0;
        }
        let unit = self.area(1.0, height);
        match self {
            Section::Arc => {
                if area <= PI / 4.0 * height * height {
                    return 0.0;
                }
                root(area / height, |w| self.area(w, height) - area)
            }
            _ => area / unit,
        }
    }

    /// Height of the section at lateral distance `x` from its middle, mm; 0 outside the width.
    pub fn at(self, x: f64, width: f64, height: f64) -> f64 {
        if !(width > 0.0 && height > 0.0) || x.abs() > 0.5 * width {
            return 0.0;
        }
        let t = 2.0 * x / width;
        match self {
            Section::Parabola => height * (1.0 - t * t),
            Section::Cosine => height * (PI * x / width).cos(),
            Section::SemiEllipse => height * (1.0 - t * t).max(0.0).sqrt(),
            Section::Gaussian => height * (-t * t * 20f64.ln()).exp(),
            Section::Arc => {
                let r = arc_radius(width, height);
                (r * r - x * x).max(0.0).sqrt() + height - r
            }
        }
    }
}

fn arc_radius(width: f64, height: f64) -> f64 {
    (0.25 * width * width + height * height) / (2.0 * height)
}

/// Zero of an increasing function, from a positive guess, by bracketing and bisection to the last bits.
fn root(guess: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut lo, mut hi) = (guess, guess);
    while f(lo) > 0.0 && lo > 1e-12 * guess {
        lo *= 0.5;
    }
    while f(hi) < 0.0 && hi < 1e12 * guess {
        hi *= 2.0;
    }
    halving::root([lo, hi], 200, |x| f(x) > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waam_ac1_areas_of_the_section_models() {
        for (shape, area) in [
            (Section::Parabola, 9.333),
            (Section::Cosine, 8.913),
            (Section::Arc, 9.917),
            (Section::SemiEllipse, 10.996),
        ] {
            let got = shape.area(7.0, 2.0);
            assert!((got - area).abs() < 1e-3, "{shape:?} {got}");
        }
    }

    #[test]
    fn relations_turn_round() {
        for shape in Section::ALL {
            for (w, h) in [(7.0, 2.0), (4.8, 0.6), (5.0, 3.4)] {
                let a = shape.area(w, h);
                assert!((shape.height(w, a) - h).abs() < 1e-9, "{shape:?}");
                assert!((shape.width(h, a) - w).abs() < 1e-9, "{shape:?}");
            }
        }
    }

    #[test]
    fn area_is_the_integral_of_the_shape() {
        for shape in Section::ALL {
            let (w, h, n) = (7.0, 2.0, 200_000);
            let dx = w / f64::from(n);
            let sum: f64 = (0..n)
                .map(|i| shape.at((f64::from(i) + 0.5) * dx - 0.5 * w, w, h) * dx)
                .sum();
            let tails = if shape == Section::Gaussian {
                0.015
            } else {
                1e-6
            };
            assert!(
                (sum / shape.area(w, h) - 1.0).abs() < tails,
                "{shape:?} {sum}"
            );
        }
    }
}
