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
/// Least places through which a flank is bent freely; through fewer it is bent so that it meets the top.
const BENT: usize = 4;
/// Least places of a straight flank; of two the scatter of their points tells the noise.
const STRAIGHT: usize = 2;
/// A flank is bent where its places span this share of the bead's height or more.
const SPAN: f64 = 0.25;
/// A flank is straight where its places span this share of the bead's height or more.
const LEAST_SPAN: f64 = 0.1;
/// How much a straight flank may be bent, as the factor of the square of its height in shares of the bead's: an ellipse is bent by -1, a triangle
/// by 1, a parabola not at all. A standard uncertainty.
const BEND: f64 = 0.5;
/// How much a flank that meets the top may be bent, as [`BEND`]: what a triangle and an ellipse are bent by, and a little more for noise.
const BENDS: std::ops::RangeInclusive<f64> = -1.3..=1.6;
/// Share of the foot's distance by which a flank that meets the top is off where its form is another, a standard uncertainty: a flat top (1 - u⁴)
/// is off by 0.026.
const FORM: f64 = 0.015;
/// A place no higher than this share of what may be the plate's is on the plate.
const ON_PLATE: f64 = 0.25;
/// A law so many standard uncertainties beyond the rows between which the foot lies tells nothing.
const BEYOND: f64 = 3.0;
/// Places so many times the usual distance off the flank are left out of it.
const STRAY: f64 = 3.5;
/// Steps in which a distribution is summed.
const STEPS: u32 = 64;
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

impl Foot {
    /// Standard uncertainty of both kinds, mm.
    fn sigma(&self) -> f64 {
        self.scatter.hypot(self.common)
    }

    fn is_known(&self) -> bool {
        self.out.is_finite() && self.sigma().is_finite()
    }
}

/// The foot of a flank `height` mm high: its points outwards from the middle of the section and up from the plate, mm, by their distance.
/// Points up to `near` mm high may be the plate's. `None` without points.
///
/// The square of the distance as a quadratic of the height is exact for parabolas, ellipses, circles and triangles, at any angle to the plate.
/// No flank ends beyond the first place that is seen on the plate.
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
    let rows = rows(&places, end, (near, height));
    let carried = carried.and_then(|law| match rows {
        Some(rows) => within(law, rows),
        None => Some(law),
    });
    carried.or_else(|| between(&places, end, rows, (near, height)))
}

/// Between which distances the foot lies: the outermost place of the bead, and the first place on the plate; `None` where no place is on it.
fn rows(places: &[Mean], end: usize, (near, height): (f64, f64)) -> Option<[f64; 2]> {
    let inner = places[..end].iter().rev().find(|m| m.at.y > near)?.at.x;
    let on = |m: &&Mean| m.at.y < ON_PLATE * near && m.at.x > inner;
    let first = places.iter().find(on)?;
    // what is left of the flank there, as steep as a parabola is
    let left = first.at.y
        + 2.0
            * if first.noise.is_nan() {
                0.0
            } else {
                first.noise
            };
    let outer = first.far / (1.0 - (left / height).clamp(0.0, 0.5)).sqrt();
    (outer > inner).then_some([inner, outer])
}

/// The foot of a law where it is known between which rows it lies: the mean of its normal distribution there. `None` where the law lies far
/// beyond them.
fn within(law: Foot, [inner, outer]: [f64; 2]) -> Option<Foot> {
    let sigma = law.sigma().max(1e-9);
    let off = |x: f64| (x - law.out) / sigma;
    if off(inner) > BEYOND || off(outer) < -BEYOND {
        return None;
    }
    if off(inner) < -BEYOND && off(outer) > BEYOND {
        return Some(law);
    }
    // of the normal distribution what lies between the rows and counts
    let low = inner.max(law.out - 2.0 * BEYOND * sigma);
    let high = outer.min(law.out + 2.0 * BEYOND * sigma);
    let [mut weight, mut first, mut second] = [0.0; 3];
    for k in 0..STEPS {
        let x = low + (high - low) * (f64::from(k) + 0.5) / f64::from(STEPS);
        let w = (-0.5 * off(x).powi(2)).exp();
        weight += w;
        first += w * (x - low);
        second += w * (x - low).powi(2);
    }
    let mean = first / weight;
    let share = (second / weight - mean * mean).max(0.0).sqrt() / sigma;
    Some(Foot {
        out: low + mean,
        scatter: share * law.scatter,
        // rows lie alike in all sections
        common: share * sigma,
    })
}

/// The mean of neighbouring points.
#[derive(Debug, Clone, Copy)]
struct Mean {
    at: DVec2,
    lowest: f64,
    /// Its outermost point, mm.
    far: f64,
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
            far: points.iter().map(|p| p.x).fold(at.x, f64::max),
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
        let law = if span(&kept, height) < SPAN {
            straight_law(&kept, height)
        } else {
            let both = [bent_law(&kept, height), topped_law(&kept, height)];
            let known = both.into_iter().flatten().filter(|l| l.foot.is_known());
            let best = known.min_by(|a, b| a.foot.sigma().total_cmp(&b.foot.sigma()));
            best.or_else(|| straight_law(&kept, height))
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
    found.filter(Foot::is_known)
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

/// The law that is bent; `None` of fewer than four places.
fn bent_law(flank: &[Mean], height: f64) -> Option<Law> {
    if flank.len() < BENT {
        return None;
    }
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
    // of few places what is left over is less than their noise by chance
    let n = flank.len() as f64;
    let (mut left, mut noise) = (0.0, 0.0);
    for p in flank {
        let z = p.at.y / height;
        left += (p.at.x.powi(2) - a - z * (b + z * c)).powi(2) / (n - 3.0);
        noise += (p.noise / height * (b + 2.0 * c * z)).powi(2) / n;
    }
    let more = (noise / left).sqrt().max(1.0);
    Some(Law {
        terms: [a, b, c],
        foot: Foot {
            out,
            scatter: more * solved.sigma()[0] / (2.0 * out),
            common: CARRIED * (out - outermost).abs(),
        },
    })
}

/// The law that is bent and meets the top of the bead: as ellipses, circles, parabolas and triangles do. `None` where it is bent as none of them.
fn topped_law(flank: &[Mean], height: f64) -> Option<Law> {
    if flank.len() < STRAIGHT {
        return None;
    }
    // q = a (1 - z) + b (z - z²)
    let [mut pp, mut pr, mut rr, mut pq, mut rq] = [0.0; 5];
    let form = |m: &Mean| {
        let z = m.at.y / height;
        [1.0 - z, z - z * z, m.at.x.powi(2)]
    };
    for m in flank {
        let [p, r, q] = form(m);
        pp += p * p;
        pr += p * r;
        rr += r * r;
        pq += p * q;
        rq += r * q;
    }
    let det = pp * rr - pr * pr;
    let [a, b] = [(rr * pq - pr * rq) / det, (pp * rq - pr * pq) / det];
    if a.is_nan() || a <= 0.0 || !BENDS.contains(&(b / a)) {
        return None;
    }
    let n = flank.len() as f64;
    let left: f64 = flank
        .iter()
        .map(form)
        .map(|[p, r, q]| (q - a * p - b * r).powi(2))
        .sum();
    // of two places nothing is left over, of single points there is no scatter
    let left = left / (n - 2.0);
    let variance: f64 = flank
        .iter()
        .map(|m| {
            let [p, r, _] = form(m);
            let slope = b * (1.0 - 2.0 * m.at.y / height) - a;
            let own = (m.noise / height * slope).powi(2);
            ((rr * p - pr * r) / det).powi(2) * own.max(left)
        })
        .sum();
    let out = a.sqrt();
    let carried = CARRIED * (out - flank.last()?.at.x).abs();
    Some(Law {
        terms: [a, b - a, -b],
        foot: Foot {
            out,
            scatter: variance.sqrt() / (2.0 * out),
            common: carried.hypot(FORM * out),
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

/// Between the outermost place of the bead before `end` and the next one of the plate, and carried on from there as an ellipse or a parabola is,
/// which may be wrong by as much: all that flanks show which stand steep, are low, or lie between the rows of a scanner.
fn between(
    places: &[Mean],
    end: usize,
    rows: Option<[f64; 2]>,
    (near, height): (f64, f64),
) -> Option<Foot> {
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
    let most = rows.map_or(outer + unseen, |[_, outer]| outer.max(inner.x));
    let middle = (inner.x + 0.5 * apart + unseen).min(0.5 * (inner.x + most));
    let out = if inner.y < FLANK * height {
        // as far as an ellipse is carried on, and as a parabola
        let z = inner.y / height;
        let ellipse = inner.x / (1.0 - z * z).sqrt();
        let form = [ellipse, inner.x * parabola(inner.y)].map(|x| x.clamp(inner.x, most));
        0.5 * (form[0] + form[1])
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
