//! Where a section meets the plate: each flank of the measured profile by itself, carried on to the plate from just above it. No form of the
//! whole section is asked for.

use meltpath_geometry::math::DVec2;
use meltpath_numerics::least_squares::Regression;

/// Flanks reach up to this share of the bead's height.
const FLANK: f64 = 0.6;
/// Means of points along a flank: the noise of single points would tilt it.
const MEANS: usize = 10;
/// Points nearer to each other than this share of their distance from the middle are at one place: those of a scanner's row along the bead.
const PLACE: f64 = 0.01;
/// Least places through which a flank is bent; through fewer it is straight.
const BENT: usize = 6;
/// Least places of a straight flank; of two the scatter of their points tells the noise.
const STRAIGHT: usize = 2;
/// A flank is bent where its places span this share of the bead's height or more.
const SPAN: f64 = 0.25;
/// A flank is straight where its places span this share of the bead's height or more.
const LEAST_SPAN: f64 = 0.1;
/// How much a straight flank may be bent, as the factor of the square of its height in shares of the bead's: an ellipse is bent by -1, a triangle
/// by 1, a parabola not at all. A standard uncertainty.
const BEND: f64 = 0.5;
/// Places so many times the usual distance off the flank are left out of it.
const STRAY: f64 = 3.5;
/// Rounds in which they are.
const ROUNDS: usize = 3;
/// How much nearer or farther than its outermost place a flank may end, share of that: else it tells nothing.
const CREDIBLE: std::ops::Range<f64> = 0.9..1.5;
/// Share of what is carried on below the outermost place that is not known, a standard uncertainty: a value of ours, held by the test
/// of forms in `beads`.
const CARRIED: f64 = 0.1;

/// A foot of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Foot {
    /// Distance from the middle of the section, mm.
    pub(super) out: f64,
    /// Standard uncertainty by the scatter of its points, mm.
    pub(super) scatter: f64,
    /// Standard uncertainty by what lies lower than points are told from the plate and between the rows of a scanner, mm: that of all sections of
    /// a bead alike.
    pub(super) common: f64,
}

/// The foot of a flank `height` mm high: its points outwards from the middle of the section and up from the plate, mm, by their distance.
/// Points up to `near` mm high may be the plate's. `None` without points.
///
/// The square of the distance as a quadratic of the height is exact for parabolas, ellipses, circles and triangles, at any angle to the plate.
pub(super) fn foot(points: &[DVec2], near: f64, height: f64) -> Option<Foot> {
    let places = places(points, near, height)?;
    let plate = |m: &Mean| m.at.y <= near;
    let end = (0..places.len())
        .find(|i| plate(&places[*i]) && places.get(i + 1).is_none_or(plate))
        .unwrap_or(places.len());
    let flank: Vec<Mean> = places[..end]
        .iter()
        .filter(|m| !plate(m) && m.lowest > 0.5 * near && m.at.y < FLANK * height)
        .copied()
        .collect();
    let outermost = flank.last().map_or(0.0, |p| p.at.x);
    let credible = |f: &Foot| CREDIBLE.contains(&(f.out / outermost));
    let carried = carried(&flank, height).filter(credible);
    carried.or_else(|| between(&places, end, (near, height)))
}

/// The mean of neighbouring points.
#[derive(Debug, Clone, Copy)]
struct Mean {
    at: DVec2,
    lowest: f64,
    /// Standard uncertainty of its height, mm; not a number of fewer than three points.
    noise: f64,
}

impl Mean {
    fn of(points: &[DVec2]) -> Self {
        let n = points.len() as f64;
        let at = points.iter().sum::<DVec2>() / n;
        let squares: f64 = points.iter().map(|p| (p.y - at.y).powi(2)).sum();
        Mean {
            at,
            lowest: points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min),
            noise: if points.len() > 2 {
                (squares / (n - 1.0) / n).sqrt()
            } else {
                f64::NAN
            },
        }
    }
}

/// The places where points lie, outwards: so many along the flank as tell its form, each with a share of its points. Points of one row of a
/// scanner are one place, however many they are. `None` where no point is the bead's.
fn places(points: &[DVec2], near: f64, height: f64) -> Option<Vec<Mean>> {
    let low = |p: &&DVec2| p.y > near && p.y < FLANK * height;
    let along: Vec<f64> = points.iter().filter(low).map(|p| p.x).collect();
    let last = points.iter().rev().find(|p| p.y > near)?.x;
    // a stray point far out is no flank
    let at = |share: f64| along.get((share * along.len() as f64) as usize).copied();
    let [first, outer] = [0.05, 0.95].map(|share| at(share).unwrap_or(last));
    let wide = ((outer - first) / (1.8 * MEANS as f64)).max(PLACE * outer);
    let least = (along.len() / MEANS).max(1);
    let mut places = Vec::new();
    let mut rest = points;
    while let Some(begin) = rest.first() {
        let own = rest.iter().take_while(|p| p.x <= begin.x + wide).count();
        let (own, next) = rest.split_at(own.max(least).min(rest.len()));
        places.push(Mean::of(own));
        rest = next;
    }
    Some(places)
}

/// A flank carried on to the plate; `None` of too few places.
fn carried(flank: &[Mean], height: f64) -> Option<Foot> {
    let mut kept = flank.to_vec();
    let mut found = None;
    for _ in 0..ROUNDS {
        let bent = kept.len() >= BENT && span(&kept, height) >= SPAN;
        let law = if bent {
            bent_law(&kept, height)
        } else {
            straight_law(&kept, height)
        };
        let Some(law) = law else { break };
        found = Some(law.foot);
        let off = |p: &Mean| (p.at.x.powi(2) - law.at(p.at.y / height)).abs();
        let mut all: Vec<f64> = kept.iter().map(off).collect();
        all.sort_by(f64::total_cmp);
        // the median of normal errors is at 0.67 of their deviation
        let usual = all[all.len() / 2] / 0.6745;
        let before = kept.len();
        if before > STRAIGHT + 1 {
            kept.retain(|p| off(p) <= STRAY * usual.max(1e-6));
        }
        if kept.len() == before {
            break;
        }
    }
    found.filter(|f| f.scatter.is_finite() && f.common.is_finite())
}

/// Share of the height that places span.
fn span(places: &[Mean], height: f64) -> f64 {
    let heights = places.iter().map(|p| p.at.y / height);
    let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], z| {
        [l.min(z), h.max(z)]
    });
    high - low
}

/// The square of a flank's distance as a law of its height.
struct Law {
    terms: [f64; 3],
    foot: Foot,
}

impl Law {
    /// At a share of the bead's height.
    fn at(&self, z: f64) -> f64 {
        let [a, b, c] = self.terms;
        a + z * (b + z * c)
    }
}

/// The law that is bent.
fn bent_law(flank: &[Mean], height: f64) -> Option<Law> {
    let mut fit = Regression::new(3);
    for p in flank {
        let z = p.at.y / height;
        fit.push([1.0, z, z * z], p.at.x.powi(2));
    }
    let solved = fit.solve().ok()?;
    let [a, b, c] = solved.values[..] else {
        return None;
    };
    let out = a.max(0.0).sqrt();
    let outermost = flank.last()?.at.x;
    Some(Law {
        terms: [a, b, c],
        foot: Foot {
            out,
            scatter: solved.sigma()[0] / (2.0 * out),
            common: CARRIED * (out - outermost).abs(),
        },
    })
}

/// The law that is straight. The noise is that of heights: so heights are fitted over squares of distances, else noise would draw the foot inwards.
fn straight_law(flank: &[Mean], height: f64) -> Option<Law> {
    if flank.len() < STRAIGHT || span(flank, height) < LEAST_SPAN {
        return None;
    }
    let n = flank.len() as f64;
    let mean = |of: &dyn Fn(&Mean) -> f64| flank.iter().map(of).sum::<f64>() / n;
    let q = |p: &Mean| p.at.x.powi(2);
    let z = |p: &Mean| p.at.y / height;
    let [q_mean, z_mean, zz_mean] = [mean(&q), mean(&z), mean(&|p| z(p).powi(2))];
    let qq = mean(&|p| (q(p) - q_mean).powi(2));
    let zz = mean(&|p| (z(p) - z_mean).powi(2));
    let qz = mean(&|p| (q(p) - q_mean) * (z(p) - z_mean));
    let z_zz = mean(&|p| (z(p) - z_mean) * (z(p).powi(2) - zz_mean));
    let slope = qz / qq;
    if slope.is_nan() || slope >= 0.0 {
        return None;
    }
    let inside = mean(&|p| (p.noise / height).powi(2));
    let left = (zz - slope * qz).max(0.0) * n / (n - 2.0);
    // of two places nothing is left over, of single points there is no scatter
    let noise = left.max(inside);
    let foot = q_mean - z_mean / slope;
    let out = foot.max(0.0).sqrt();
    let scatter = (noise * (1.0 / n + (foot - q_mean).powi(2) / (n * qq))).sqrt() / slope.abs();
    // what a bend would move, and how far noise draws the foot
    let bend = BEND * foot * (zz_mean - z_zz / zz * z_mean);
    let drawn = 0.5 * (foot - (q_mean - qz / zz * z_mean));
    let outermost = flank.last()?.at.x;
    let common = [bend, drawn, CARRIED * (out - outermost) * 2.0 * out];
    Some(Law {
        terms: [foot, 1.0 / slope, 0.0],
        foot: Foot {
            out,
            scatter: scatter / (2.0 * out),
            common: common.iter().map(|c| c * c).sum::<f64>().sqrt() / (2.0 * out),
        },
    })
}

/// Between the outermost place of the bead before `end` and the next one of the plate, and carried on from there as a parabola is, which may be
/// wrong by as much: all that flanks show which stand steep, are low, or lie between the rows of a scanner.
fn between(places: &[Mean], end: usize, (near, height): (f64, f64)) -> Option<Foot> {
    let last = places[..end].iter().rposition(|m| m.at.y > near)?;
    let inner = places[last].at;
    let parabola = |z: f64| 1.0 / (1.0 - (z / height).min(0.9)).sqrt();
    let next = places.get(last + 1).map(|m| m.at.x);
    let outer = next.unwrap_or(inner.x * parabola(inner.y));
    let apart = outer - inner.x;
    let mut unseen = inner.x * (parabola(near) - 1.0);
    if inner.y > 2.0 * near {
        // no less steep below than from place to place
        unseen = unseen.min(near * apart / (inner.y - near));
    }
    let middle = inner.x + 0.5 * apart + unseen;
    let out = if inner.y < FLANK * height {
        let carried = inner.x * parabola(inner.y);
        0.5 * (middle + carried.clamp(inner.x, outer + unseen))
    } else {
        middle
    };
    Some(Foot {
        out,
        scatter: 0.0,
        // somewhere between both
        common: (apart / 12.0_f64.sqrt()).hypot(unseen),
    })
}
