//! Where a section meets the plate: each flank of the measured profile by itself, carried on to the plate from just above it. No form of the
//! whole section is asked for.

use meltpath_geometry::math::DVec2;
use meltpath_numerics::least_squares::Regression;

/// Flanks reach up to this share of the bead's height.
const FLANK: f64 = 0.6;
/// Means of points along a flank: the noise of single points would tilt it.
const MEANS: usize = 10;
/// Least means through which a flank is bent; through fewer it is straight.
const BENT: usize = 6;
/// Least means of a straight flank.
const STRAIGHT: usize = 3;
/// A flank is bent where its means span this share of the bead's height or more.
const SPAN: f64 = 0.25;
/// Means so many times the usual distance off the flank are left out of it.
const STRAY: f64 = 3.5;
/// Rounds in which they are.
const ROUNDS: usize = 3;
/// How much nearer or farther than its outermost mean a flank may end, share of that: else it tells nothing.
const CREDIBLE: std::ops::Range<f64> = 0.9..1.5;
/// Share of what is carried on below the outermost mean that is not known, a standard uncertainty: a value of ours, held by the test
/// of forms below.
const CARRIED: f64 = 0.1;

/// A foot of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    /// Distance from the middle of the section, mm.
    pub(super) out: f64,
    /// Standard uncertainty by the scatter of its points, mm.
    pub(super) scatter: f64,
    /// Standard uncertainty by what lies lower than points are told from the plate, mm: that of all sections of a bead alike.
    pub(super) carried: f64,
}

/// The foot of a flank `height` mm high: its points outwards from the middle of the section and up from the plate, mm, by their distance.
/// Points up to `near` mm high may be the plate's. `None` without points.
///
/// The square of the distance as a quadratic of the height is exact for parabolas, ellipses, circles and triangles, at any angle to the plate.
pub(super) fn foot(points: &[DVec2], near: f64, height: f64) -> Option<Foot> {
    let low = |p: &&DVec2| p.y > near && p.y < FLANK * height;
    let count = points.iter().filter(low).count();
    let means: Vec<Mean> = points
        .chunks((count / MEANS).max(1))
        .map(Mean::of)
        .collect();
    let plate = |m: &Mean| m.at.y <= near;
    let end = (0..means.len())
        .find(|i| plate(&means[*i]) && means.get(i + 1).is_none_or(plate))
        .unwrap_or(means.len());
    let flank: Vec<DVec2> = means[..end]
        .iter()
        .filter(|m| !plate(m) && m.lowest > 0.5 * near && m.at.y < FLANK * height)
        .map(|m| m.at)
        .collect();
    let outermost = flank.last().map_or(0.0, |p| p.x);
    let credible = |f: &Foot| CREDIBLE.contains(&(f.out / outermost));
    let carried = carried(&flank, height).filter(credible);
    carried.or_else(|| between(points, near))
}

/// The mean of neighbouring points.
struct Mean {
    at: DVec2,
    lowest: f64,
}

impl Mean {
    fn of(points: &[DVec2]) -> Self {
        Mean {
            at: points.iter().sum::<DVec2>() / points.len() as f64,
            lowest: points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min),
        }
    }
}

/// A flank carried on to the plate; `None` of too few means.
fn carried(flank: &[DVec2], height: f64) -> Option<Foot> {
    let span = |p: &[DVec2]| {
        let heights = p.iter().map(|p| p.y / height);
        let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| {
            [l.min(z), h.max(z)]
        });
        high - low
    };
    let mut kept = flank.to_vec();
    let mut found = None;
    for _ in 0..ROUNDS {
        let unknowns = match kept.len() {
            n if n >= BENT && span(&kept) >= SPAN => 3,
            n if n >= STRAIGHT => 2,
            _ => break,
        };
        let powers = |p: &DVec2| {
            let z = p.y / height;
            [1.0, z, z * z].into_iter().take(unknowns)
        };
        let mut fit = Regression::new(unknowns);
        for p in &kept {
            fit.push(powers(p), p.x * p.x);
        }
        let Ok(solved) = fit.solve() else { break };
        let out = solved.values[0].max(0.0).sqrt();
        let outermost = kept.last().map_or(out, |p| p.x);
        found = Some(Foot {
            out,
            scatter: solved.sigma()[0] / (2.0 * out),
            carried: CARRIED * (out - outermost).abs(),
        });
        let off = |p: &DVec2| {
            let law: f64 = powers(p).zip(&solved.values).map(|(z, a)| z * a).sum();
            (p.x * p.x - law).abs()
        };
        let mut all: Vec<f64> = kept.iter().map(off).collect();
        all.sort_by(f64::total_cmp);
        // the median of normal errors is at 0.67 of their deviation
        let usual = all[all.len() / 2] / 0.6745;
        let before = kept.len();
        kept.retain(|p| off(p) <= STRAY * usual.max(1e-6));
        if kept.len() == before {
            break;
        }
    }
    found.filter(|f| f.scatter.is_finite())
}

/// Between the outermost point of the bead and the next one of the plate: all that flanks show which stand steep.
fn between(points: &[DVec2], near: f64) -> Option<Foot> {
    let last = points.iter().rposition(|p| p.y > near)?;
    let inner = points[last].x;
    let outer = points.get(last + 1).map_or(inner, |p| p.x);
    Some(Foot {
        out: 0.5 * (inner + outer),
        // somewhere between both
        scatter: 0.5 * (outer - inner) / 3.0_f64.sqrt(),
        carried: 0.0,
    })
}
