//! A section across a bead: its width, height and area without any form, and the parabola through its points that tells how far it is one.

use meltpath_geometry::math::DVec2;
use meltpath_numerics::least_squares::Regression;

use super::clusters::range;
use super::foot::{Foot, foot};

/// Least points of a section.
const POINTS: usize = 12;
/// Least points of the plate on each side, to level a section by.
const BESIDE: usize = 5;
/// How far beside the bead the plate levels a section, mm.
const LEVELS: [f64; 2] = [0.5, 4.0];
/// Points so many times the usual distance off the parabola are left out of it.
const STRAY: f64 = 3.0;
/// What is no bead has a parabola so many times wider or narrower than itself.
const FITS: f64 = 1.4;
/// Share of a bead's width to both sides of its middle that is its top.
const TOP: f64 = 0.15;
/// Points nearer to each other across, in widths, may be of one row.
const ROW: f64 = 0.05;
/// Rounds in which stray points are left out.
const ROUNDS: usize = 3;
/// What lies between points so much of the width apart is not seen.
const GAP: f64 = 0.15;
/// Steps across of which the area is the sum, mm.
const STEP: f64 = 0.25;

/// A section across a bead; heights are above the plate beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Where along the bead, from its first end, mm.
    pub along: f64,
    /// Where its middle is across the bead, mm.
    pub centre: f64,
    /// Where it meets the plate, from foot to foot, mm: of any form.
    pub width: f64,
    /// Standard uncertainty of the width, mm: by the scatter of its points, which differs from section to section, and by how flanks go on
    /// below `near` and between the rows of a scanner, which does not.
    pub width_sigma: [f64; 2],
    /// Of its top, mm: of any form.
    pub height: f64,
    /// Under the points, mm²: of any form.
    pub area: f64,
    /// Share of the width that points show: what lies in gaps wider than 15 % of it is not.
    pub shown: f64,
    /// Root mean square distance of its points from the parabola of least squares, mm.
    pub off: f64,
    /// Its points, across the bead and above the plate, mm, by their places.
    pub points: Vec<DVec2>,
}

impl Section {
    /// The section of a bead's points, which are higher than `near`, and those of the plate in a slab; across and up, mm.
    pub(super) fn of(
        along: f64,
        own: &[DVec2],
        plate: &[DVec2],
        near: f64,
    ) -> Result<Self, String> {
        if own.len() < POINTS {
            return Err(format!(
                "at {along:.0} mm there are {} points, {POINTS} or more are needed: a closer scan, or sections farther apart",
                own.len()
            ));
        }
        let [low, high] = range(own.iter().map(|p| p.x));
        let beside = |p: &&DVec2| {
            let out = (low - p.x).max(p.x - high);
            (LEVELS[0]..LEVELS[1]).contains(&out)
        };
        let level = level(plate.iter().filter(beside), 0.5 * (low + high));
        let levelled = |p: &DVec2| DVec2::new(p.x, p.y - level(p.x));
        let own: Vec<DVec2> = own.iter().map(levelled).collect();
        let [a, b, c] = parabola(&own)
            .ok_or_else(|| format!("at {along:.0} mm no parabola goes through the points"))?;
        // a + b y + c y², open below
        let middle = -b / (2.0 * c);
        let height = a - b * b / (4.0 * c);
        if !(c < 0.0 && height > 0.0) {
            return Err(format!(
                "at {along:.0} mm the points are no bead: they are not highest in their middle"
            ));
        }
        let width = 2.0 * (-height / c).sqrt();
        let wide = (high - low) / (1.0 - near / height).max(0.1).sqrt();
        if !(1.0 / FITS..FITS).contains(&(width / wide)) {
            return Err(format!(
                "at {along:.0} mm the parabola is {width:.1} mm wide where the points are {wide:.1} mm: it is flat on top or has edges; if it is the plate, take what lies under it out of the scan"
            ));
        }
        let squares: f64 = own
            .iter()
            .map(|p| (p.y - (a + p.x * (b + c * p.x))).powi(2))
            .sum();
        let mut points: Vec<DVec2> = own
            .iter()
            .copied()
            .chain(plate.iter().map(levelled))
            .collect();
        points.retain(|p| (p.x - middle).abs() <= 0.5 * width + LEVELS[1]);
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        let height = top(&own, middle, wide).unwrap_or(height);
        let [left, right] = feet(&points, middle, (near, height)).ok_or_else(|| no_foot(along))?;
        let (area, shown) = area(&points, [middle - left.out, middle + right.out], -c);
        Ok(Section {
            along,
            centre: middle + 0.5 * (right.out - left.out),
            width: left.out + right.out,
            width_sigma: [
                left.scatter.hypot(right.scatter),
                left.common + right.common,
            ],
            height,
            area,
            shown,
            off: (squares / own.len() as f64).sqrt(),
            points,
        })
    }

    /// The area of a parabola of its width and height, mm².
    pub fn parabola(&self) -> f64 {
        2.0 / 3.0 * self.width * self.height
    }
}

fn no_foot(along: f64) -> String {
    format!("at {along:.0} mm the points lie on one side of their middle: they are no bead")
}

/// Both feet of a section, the lower side first.
fn feet(points: &[DVec2], middle: f64, (near, height): (f64, f64)) -> Option<[Foot; 2]> {
    let upper = points.partition_point(|p| p.x < middle);
    let outwards = |p: &DVec2| DVec2::new((p.x - middle).abs(), p.y);
    let lower: Vec<DVec2> = points[..upper].iter().rev().map(outwards).collect();
    let upper: Vec<DVec2> = points[upper..].iter().map(outwards).collect();
    Some([foot(&lower, near, height)?, foot(&upper, near, height)?])
}

/// The height of a section's top: of a parabola through its middle alone; `None` of too few points, or of fewer rows than a parabola has numbers.
fn top(own: &[DVec2], middle: f64, width: f64) -> Option<f64> {
    let inner = |p: &&DVec2| (p.x - middle).abs() <= TOP * width;
    let moved = |p: &DVec2| DVec2::new(p.x - middle, p.y);
    let points: Vec<DVec2> = own.iter().filter(inner).map(moved).collect();
    let mut places: Vec<f64> = points.iter().map(|p| p.x).collect();
    places.sort_by(f64::total_cmp);
    places.dedup_by(|next, first| *next <= *first + ROW * width);
    let enough = points.len() >= POINTS && places.len() >= 3;
    let [a, b, c] = enough.then(|| parabola(&points))??;
    let at = -b / (2.0 * c);
    let inside = c < 0.0 && at.abs() <= TOP * width;
    Some(if inside { a - b * b / (4.0 * c) } else { a })
}

/// The height of the plate under a section: the line through what of it lies on both sides, else zero.
fn level<'a>(beside: impl Iterator<Item = &'a DVec2>, middle: f64) -> impl Fn(f64) -> f64 {
    let mut line = Regression::new(2);
    let mut sides = [0; 2];
    for p in beside {
        line.push([1.0, p.x - middle], p.y);
        sides[usize::from(p.x > middle)] += 1;
    }
    let both = sides.iter().all(|n| *n >= BESIDE);
    let found = both.then(|| line.solve().ok()).flatten();
    let [at, slope] = found.map_or([0.0; 2], |s| [s.values[0], s.values[1]]);
    move |y| at + slope * (y - middle)
}

/// The parabola a + b y + c y² of least squares, without stray points.
fn parabola(points: &[DVec2]) -> Option<[f64; 3]> {
    let mut kept: Vec<DVec2> = points.to_vec();
    let mut found = None;
    for _ in 0..ROUNDS {
        let mut fit = Regression::new(3);
        for p in &kept {
            fit.push([1.0, p.x, p.x * p.x], p.y);
        }
        let [a, b, c] = fit.solve().ok()?.values[..] else {
            return None;
        };
        found = Some([a, b, c]);
        let off = |p: &DVec2| (p.y - (a + p.x * (b + c * p.x))).abs();
        let mut all: Vec<f64> = kept.iter().map(off).collect();
        all.sort_by(f64::total_cmp);
        // the median of normal errors is at 0.67 of their deviation
        let usual = all.get(all.len() / 2)? / 0.6745;
        let before = kept.len();
        kept.retain(|p| off(p) <= STRAY * usual.max(1e-6));
        if kept.len() == before || kept.len() < POINTS {
            break;
        }
    }
    found
}

/// The area under points from foot to foot, and the share of that way which they show: trapezia between the means of what lies in even steps
/// across, each at its own mean place, so that rows of a scanner do not beat with the steps. Between means the section bends as its parabola of
/// least squares does, by `bend` times the square of the distance: chords would cut it short where points are far apart.
fn area(points: &[DVec2], [first, last]: [f64; 2], bend: f64) -> (f64, f64) {
    let width = last - first;
    let count = (width / STEP).ceil().max(1.0);
    let mut sums = vec![(DVec2::ZERO, 0.0); count as usize];
    for p in points {
        let place = (p.x - first) / width * count;
        if let Some(sum) = (place >= 0.0)
            .then(|| sums.get_mut(place as usize))
            .flatten()
        {
            *sum = (sum.0 + *p, sum.1 + 1.0);
        }
    }
    let means = sums.iter().filter(|s| s.1 > 0.0).map(|s| s.0 / s.1);
    let mut line = vec![DVec2::new(first, 0.0)];
    line.extend(means);
    line.push(DVec2::new(last, 0.0));
    let (mut area, mut unseen) = (0.0, 0.0);
    for w in line.windows(2) {
        let apart = w[1].x - w[0].x;
        area += 0.5 * (w[0].y + w[1].y) * apart + bend * apart.powi(3) / 6.0;
        if apart > GAP * width {
            unseen += apart;
        }
    }
    (area, 1.0 - unseen / width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(count: u32, wide: f64, high: f64) -> Vec<DVec2> {
        let y = |k: u32| wide * (f64::from(k) / f64::from(count - 1) - 0.5);
        let z = |y: f64| high * (1.0 - (2.0 * y / wide).powi(2));
        (0..count).map(|k| DVec2::new(y(k), z(y(k)))).collect()
    }

    /// waam AC-36: the area and 2HL/3 agree within 2 % on a parabola of 100 points or more. The source sums rectangles; these are trapezia.
    #[test]
    fn waam_ac36_area_by_rectangles_and_by_width_and_height() {
        for (wide, high) in [(7.0, 2.0), (4.0, 3.0), (12.0, 1.5)] {
            for count in [100, 333, 2000] {
                let section = Section::of(0.0, &samples(count, wide, high), &[], 0.0).unwrap();
                let by_size = 2.0 / 3.0 * wide * high;
                assert!(
                    (section.area / by_size - 1.0).abs() < 0.02,
                    "{}",
                    section.area
                );
                assert!((section.parabola() / by_size - 1.0).abs() < 0.005);
            }
        }
    }

    /// A flat bead with steep sides, which no parabola fits, has its area all the same.
    #[test]
    fn the_area_is_that_of_any_form() {
        let flat = |k: i32| {
            DVec2::new(
                f64::from(k) * 0.01,
                1.5 - 1.5 * (f64::from(k) / 300.0).powi(4),
            )
        };
        let all: Vec<DVec2> = (-299..300).map(flat).collect();
        let (own, plate): (Vec<DVec2>, Vec<DVec2>) = all.into_iter().partition(|p| p.y > 0.2);
        let section = Section::of(0.0, &own, &plate, 0.2).unwrap();
        let true_area = 6.0 * 1.5 * 0.8;
        assert!(
            (section.area / true_area - 1.0).abs() < 0.02,
            "{}",
            section.area
        );
        let size = [section.width / 6.0, section.height / 1.5];
        assert!(size.iter().all(|s| (s - 1.0).abs() < 0.01), "{size:?}");
    }

    /// A plate that lies on a larger one is no bead.
    #[test]
    fn what_is_flat_on_top_is_no_bead() {
        for bent in [0.0, 1e-5, 1e-4] {
            let top = |k: i32| DVec2::new(f64::from(k) * 0.1, 8.0 - bent * f64::from(k * k) * 0.01);
            let own: Vec<DVec2> = (-300..300).map(top).collect();
            let error = Section::of(0.0, &own, &[], 0.2).unwrap_err();
            assert!(
                error.contains("flat on top") || error.contains("no bead"),
                "{error}"
            );
        }
    }

    /// Rows of a scanner along the bead: what lies between them is not known, and is told; gaps do not cut the area short.
    #[test]
    fn rows_and_gaps_take_nothing_from_the_area_and_are_told() {
        let mut random = meltpath_numerics::random::Random::new(4);
        let mut rows = |pitch: f64, from: f64, seen: fn(f64) -> bool| {
            let count = (10.0 / pitch) as i32;
            let places = (-count..=count).map(|k| from + pitch * f64::from(k));
            let all: Vec<DVec2> = places
                .filter(|y| seen(*y))
                .flat_map(|y| std::iter::repeat_n(y, 20))
                .map(|y| {
                    let z = (1.9 * (1.0 - (y / 2.6).powi(2))).max(0.0);
                    DVec2::new(y, z + 0.03 * random.normal())
                })
                .collect();
            let (own, plate): (Vec<DVec2>, Vec<DVec2>) = all.into_iter().partition(|p| p.y > 0.2);
            Section::of(0.0, &own, &plate, 0.2).unwrap()
        };
        let area = 2.0 / 3.0 * 5.2 * 1.9;
        let mut widths = Vec::new();
        for from in [0.0, 0.08, 0.16, 0.24, 0.32, 0.4] {
            for (pitch, least) in [(0.05, 0.0), (0.5, 0.02)] {
                let section = rows(pitch, from, |_| true);
                let [own, common] = section.width_sigma;
                let told = own.hypot(common) / 5.2;
                let off = section.width / 5.2 - 1.0;
                assert!(off.abs() < 2.0 * told, "{pitch} {from}: {off} for {told}");
                assert!((least..0.1).contains(&told), "{pitch} {from}: {told}");
                let area = section.area / area - 1.0;
                assert!(area.abs() < 0.04, "{pitch} {from}: {area}");
                assert!((section.height / 1.9 - 1.0).abs() < 0.02, "{pitch} {from}");
                assert!(section.shown > 0.99, "{pitch} {from}: {}", section.shown);
                widths.push(off);
            }
        }
        assert!(widths.iter().any(|off| off.abs() > 0.005), "{widths:?}");
        // one foot is not seen: from 60 % of half the width outwards
        let section = rows(0.05, 0.0, |y| !(1.56..3.0).contains(&y));
        assert!(section.shown < 0.85, "{}", section.shown);
        assert!(section.width_sigma[1] > 0.05 * 5.2);
        // and another between two parts of the flank: it takes nothing
        let section = rows(0.05, 0.0, |y| !(1.3..1.9).contains(&y));
        assert!((section.area / area - 1.0).abs() < 0.01, "{}", section.area);
        assert!(section.shown > 0.99);
    }

    /// A bead hardly higher than what may be its plate: the form of what lies below is not known, and the uncertainty covers it.
    #[test]
    fn low_beads_are_as_wide_as_they_are_to_their_uncertainty() {
        let mut random = meltpath_numerics::random::Random::new(6);
        let forms: [fn(f64) -> f64; 3] = [
            |u| 1.0 - u * u,
            |u| (1.0 - u * u).max(0.0).sqrt(),
            |u| 1.0 - u.abs(),
        ];
        for form in forms {
            for (high, wide, least) in [(0.4, 3.0, 0.1), (0.5, 3.5, 0.05), (0.8, 4.0, 0.01)] {
                let all: Vec<DVec2> = (0..400)
                    .map(|_| {
                        let y = random.between(-4.0, 4.0);
                        let u: f64 = 2.0 * y / wide;
                        let z = if u.abs() < 1.0 { high * form(u) } else { 0.0 };
                        DVec2::new(y, z + 0.03 * random.normal())
                    })
                    .collect();
                let (own, plate): (Vec<DVec2>, Vec<DVec2>) =
                    all.into_iter().partition(|p| p.y > 0.2);
                let section = Section::of(0.0, &own, &plate, 0.2).unwrap();
                let told = section.width_sigma[0].hypot(section.width_sigma[1]) / wide;
                let off = section.width / wide - 1.0;
                assert!(off.abs() < 2.5 * told, "{high}: {off} for {told}");
                assert!(told > least, "{high}: {told}");
            }
        }
    }

    #[test]
    fn stray_points_leave_the_parabola_alone() {
        let mut points = samples(200, 7.0, 2.0);
        for k in [20, 60, 61, 150] {
            points[k].y += 1.5;
        }
        let section = Section::of(0.0, &points, &[], 0.0).unwrap();
        assert!((section.width - 7.0).abs() < 0.01 && (section.height - 2.0).abs() < 0.01);
    }

    #[test]
    fn what_is_no_bead_is_told() {
        let valley: Vec<DVec2> = samples(50, 6.0, 2.0)
            .iter()
            .map(|p| DVec2::new(p.x, 3.0 - p.y))
            .collect();
        assert!(
            Section::of(5.0, &valley, &[], 0.0)
                .unwrap_err()
                .contains("no bead")
        );
        assert!(
            Section::of(5.0, &valley[..4], &[], 0.0)
                .unwrap_err()
                .contains("4 points")
        );
    }
}
