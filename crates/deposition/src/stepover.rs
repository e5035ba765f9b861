//! Distance between beads and height of layers, proposed from the bead on a plate.
//! Source: Rouchon 2022, §4.1 (after Suryakumar 2011 and Ding 2015), §4.4; the numeric solutions are ours.

use meltpath_numerics::halving;
use serde::{Deserialize, Serialize};

/// Which model of two parabolic beads side by side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Overlap {
    /// Valley and overlap are equal under a flat top: 2/3 of the width.
    FlatTop,
    /// Valley under the tangent from the toe of the new bead: 0.738 of the width.
    #[default]
    Tangent,
}

/// Area that two beads `d` apart have in common, as a share of w·h; `d` in widths.
fn common(d: f64) -> f64 {
    if d >= 1.0 {
        return 0.0;
    }
    // 2 ∫ (1 − 4x²) dx from d/2 to 1/2
    2.0 / 3.0 - d + d * d * d / 3.0
}

/// The stepover in bead widths.
///
/// ```
/// use meltpath_deposition::stepover::{Overlap, stepover};
/// assert!((stepover(Overlap::Tangent) - 0.738).abs() < 5e-4);
/// ```
pub fn stepover(overlap: Overlap) -> f64 {
    match overlap {
        Overlap::FlatTop => 2.0 / 3.0,
        Overlap::Tangent => {
            // critical valley less overlap: negative while beads are close
            let lack = |d: f64| tangent_valley(d) - common(d);
            halving::root([0.55, 0.99], 100, |d| lack(d) > 0.0)
        }
    }
}

/// Area between the tangent of Ding's model and two beads `d` widths apart, share of w·h.
///
/// Unit bead y = 1 − 4x². B lies on bead 1 above the left toe of bead 2; the line from B touches bead 2 at `s` left of
/// its apex.
fn tangent_valley(d: f64) -> f64 {
    let bead = |x: f64| 1.0 - 4.0 * x * x;
    let xb = d - 0.5;
    let s = 0.5 - (0.25 - xb * xb).max(0.0).sqrt();
    let xt = d - s;
    let (yb, yt) = (bead(xb), bead(s));
    let line = 0.5 * (yb + yt) * (xt - xb);
    // under the beads: bead 1 from B to their crossing at d/2, bead 2 from there to the tangent point
    let integral = |a: f64, b: f64| (b - 4.0 / 3.0 * b * b * b) - (a - 4.0 / 3.0 * a * a * a);
    line - integral(xb, 0.5 * d) - integral(0.5 * d - d, xt - d)
}

/// Stepover above which flat beads may fail to fuse, in bead widths (rule of §4.2: λ about 5 and d > 0.70 w).
pub const FUSION_LIMIT: f64 = 0.70;
/// Ratio of wire feed to travel speed below which beads count as flat for [`FUSION_LIMIT`]; our threshold, between the
/// measured 5.33 (defects) and 10.67 (none).
pub const FLAT_BEAD_RATIO: f64 = 7.0;

/// Whether a stepover (in bead widths) risks lack of fusion between beads.
pub fn fusion_at_risk(feed_ratio: f64, stepover: f64) -> bool {
    feed_ratio < FLAT_BEAD_RATIO && stepover > FUSION_LIMIT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waam_ac31_overlap_models() {
        assert!((stepover(Overlap::FlatTop) - 0.66667).abs() < 1e-5);
        assert!(
            (stepover(Overlap::Tangent) - 0.73784).abs() < 1e-5,
            "{}",
            stepover(Overlap::Tangent)
        );
    }

    #[test]
    fn waam_ac35_flat_beads_far_apart_may_not_fuse() {
        assert!(fusion_at_risk(5.33, 0.738) && !fusion_at_risk(5.33, 0.70));
        assert!(!fusion_at_risk(10.67, 0.8));
    }
}
