//! Distance between beads and height of layers, proposed from the bead on a plate.
//! Source: Rouchon 2022, §4.1 (after Suryakumar 2011 and Ding 2015), §4.4; the numeric solutions are ours.

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
            let (mut lo, mut hi) = (0.55, 0.99);
            for _ in 0..100 {
                let mid = 0.5 * (lo + hi);
                if lack(mid) > 0.0 {
                    hi = mid;
                } else {
                    lo = mid;
                }
            }
            0.5 * (lo + hi)
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

/// The surface between two beads by the arc model (DTOM).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ArcSurface {
    /// Abscissa of the tangent point on the first bead, mm from its apex; negative when the arc is convex.
    pub tangent: f64,
    /// Radius of the arc, mm.
    pub radius: f64,
    /// Height at the middle between the beads, mm.
    pub middle: f64,
}

/// The arc tangent to two beads of width `w` and height `h`, `d` apart (mm), whose valley takes what overlaps;
/// `None` outside w/2 < d < w. At d = 2w/3 the top is flat: radius is infinite.
pub fn arc_surface(w: f64, h: f64, d: f64) -> Option<ArcSurface> {
    if !(w > 0.0 && h > 0.0 && d > 0.5 * w && d < w) {
        return None;
    }
    let k = 4.0 * h / (w * w);
    let overlap = w * h * common(d / w);
    let half = 0.5 * d;
    let p1 = |x: f64| h - k * x * x;
    let surface = |xt: f64| {
        let t = (half - xt) / (2.0 * k * xt);
        let yc = p1(xt) + t;
        let r = t.abs() * (1.0 + 4.0 * k * k * xt * xt).sqrt();
        (yc, r, t)
    };
    let area_under_bead = |a: f64, b: f64| h * (b - a) - k / 3.0 * (b.powi(3) - a.powi(3));
    // arc area from xt to the middle: rectangle at yc less (concave) or plus (convex) the circle's part
    let filled = |xt: f64| {
        let (yc, r, t) = surface(xt);
        let u = half - xt;
        let cap =
            0.5 * (u * (r * r - u * u).max(0.0).sqrt() + r * r * (u / r).clamp(-1.0, 1.0).asin());
        let arc = yc * u - cap * t.signum();
        // a convex arc begins left of the apex of bead 1, on the bead all the same
        2.0 * (arc - area_under_bead(xt, half))
    };
    let excess = |xt: f64| filled(xt) - overlap;
    if (d - 2.0 / 3.0 * w).abs() < 1e-9 * w {
        return Some(ArcSurface {
            tangent: 0.0,
            radius: f64::INFINITY,
            middle: h,
        });
    }
    // concave for d > 2w/3: a later tangent point leaves less in the fillet; convex mirrors it
    let (mut lo, mut hi) = if d > 2.0 / 3.0 * w {
        (1e-9 * w, half * (1.0 - 1e-9))
    } else {
        (-half, -1e-9 * w)
    };
    let rising = excess(hi) > excess(lo);
    for _ in 0..200 {
        let mid = 0.5 * (lo + hi);
        if (excess(mid) > 0.0) == rising {
            hi = mid;
        } else {
            lo = mid;
        }
    }
    let tangent = 0.5 * (lo + hi);
    let (yc, radius, t) = surface(tangent);
    Some(ArcSurface {
        tangent,
        radius,
        middle: yc - radius * t.signum(),
    })
}

/// Growth per layer of a wall of single beads, mm: the section over `ratio` (thesis: 0.9) of the width.
pub fn wall_growth(area: f64, width: f64, ratio: f64) -> f64 {
    area / (ratio * width)
}

/// Growth per layer inside a region of beads `d` apart, mm.
pub fn area_growth(area: f64, d: f64) -> f64 {
    area / d
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
        for (d, tangent, radius, middle) in [
            (0.66, -0.079, 92.6, 2.030),
            (0.738, 0.825, 6.76, 1.656),
            (0.80, 1.521, 2.87, 1.322),
        ] {
            let s = arc_surface(7.0, 2.0, d * 7.0).unwrap();
            assert!((s.tangent / tangent - 1.0).abs() < 0.01, "{d} {s:?}");
            assert!((s.radius / radius - 1.0).abs() < 0.01, "{d} {s:?}");
            assert!((s.middle / middle - 1.0).abs() < 0.01, "{d} {s:?}");
        }
        assert_eq!(arc_surface(7.0, 2.0, 14.0 / 3.0).unwrap().middle, 2.0);
        assert!(arc_surface(7.0, 2.0, 8.0).is_none());
    }

    #[test]
    fn waam_ac35_flat_beads_far_apart_may_not_fuse() {
        assert!(fusion_at_risk(5.33, 0.738) && !fusion_at_risk(5.33, 0.70));
        assert!(!fusion_at_risk(10.67, 0.8));
    }

    #[test]
    fn waam_ac37_growth_of_a_thin_wall() {
        let (w, h) = (7.0, 2.0);
        let area = 2.0 * w * h / 3.0;
        assert!((wall_growth(area, w, 1.0) - 2.0 * h / 3.0).abs() < 1e-12);
        assert!((wall_growth(area, w, 0.9) - 0.741 * h).abs() < 1e-3);
        let (a, w) = (10.58, 7.3);
        let growth = wall_growth(a, w, 0.9);
        assert!((growth - 1.61).abs() < 0.005);
        // the first bead has its height on the plate
        let first = 1.5 * a / w;
        assert!((first + 20.0 * growth - 34.3).abs() < 0.1);
        assert!((first + 20.0 * wall_growth(a, w, 1.0) - 31.1).abs() < 0.1);
    }
}
