//! The pursuit length of a bead at a corner, found from its crest: the curve that lies nearest.
//! Source: Rouchon 2022, §3.3.2, eq. 3.5.

use meltpath_geometry::math::DVec2;
use meltpath_numerics::golden;
use meltpath_numerics::least_squares::Regression;

use super::{PursuitMode, pursuit_curve};

/// Lengths that are looked through, mm: the source's bounds.
pub const BOUNDS: [f64; 2] = [0.5, 20.0];
/// Lengths that are tried before the search narrows.
const TRIED: u32 = 22;
/// Steps of the golden section, each 0.62 of the last.
const STEPS: u32 = 16;
/// Steps of the torch, in lengths.
const STEP: f64 = 0.01;
/// Turn after which a curve has a new corner, rad: a chord of 5 mm lies 6 µm off.
const TURN: f64 = 0.01;
/// How far a curve goes on straight beyond its ends, mm.
const BEYOND: f64 = 50.0;
/// Points farther than this from the nearest curve count as so far in the first search, mm: spatter beside a bead.
const FAR: f64 = 1.0;
/// Points so many times the usual distance off are left out of the second search.
const STRAY: f64 = 4.0;
/// Fits of the curve's place at each length.
const PLACINGS: usize = 8;

/// The pursuit length of a crest.
#[derive(Debug, Clone, PartialEq)]
pub struct Identified {
    /// The length, mm.
    pub length: f64,
    /// Its standard uncertainty from the scatter of the crest, mm: place and direction of the torch's path are found along with it.
    pub sigma: f64,
    /// Root mean square distance of the crest from the curve, mm.
    pub off: f64,
    /// Crest points that count.
    pub points: usize,
    /// Crest points that were left out since they stray.
    pub stray: usize,
    /// The curve in the frame of the crest.
    pub curve: Vec<DVec2>,
    /// Where the torch's path lies in the frame of the crest.
    pub place: Place,
}

/// A turn, then a shift, in plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Turn, rad.
    pub turn: f64,
    /// Shift, mm.
    pub shift: DVec2,
}

impl Place {
    /// Neither.
    pub const NONE: Place = Place {
        turn: 0.0,
        shift: DVec2::ZERO,
    };

    /// A point of the path in the frame of the crest.
    pub fn of(&self, p: DVec2) -> DVec2 {
        DVec2::from_angle(self.turn).rotate(p) + self.shift
    }

    /// A point of the crest in the frame of the path.
    pub fn back(&self, p: DVec2) -> DVec2 {
        DVec2::from_angle(-self.turn).rotate(p - self.shift)
    }
}

/// Why no length is found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoLength {
    /// Too few crest points.
    #[error("the crest has {0} points, 20 are the least")]
    Points(usize),
    /// The nearest curve has the shortest or the longest length that is looked at.
    #[error(
        "no length between 0.5 and 20 mm is nearest: the crest lies nearest to the curve of {0:.1} mm"
    )]
    Bound(f64),
    /// The crest says nothing of the length.
    #[error("the crest does not hang on the length")]
    Blind,
}

/// Finds the length whose curve lies nearest to `crest`, mm, in the sense of least squares, when the torch runs along `torch`.
///
/// The path's place and direction are fitted along with each length, from those that are given; its form is taken as it is. Crest points
/// within `window` mm of each other are taken to share their errors.
///
/// # Errors
/// [`NoLength`].
pub fn identify(
    torch: &[DVec2],
    crest: &[DVec2],
    mode: PursuitMode,
    window: f64,
) -> Result<Identified, NoLength> {
    let search = Search { torch, mode };
    if crest.len() < 20 {
        return Err(NoLength::Points(crest.len()));
    }
    let (first, place) = search.nearest(crest, Place::NONE, FAR)?;
    let curve = search.curve(first);
    let off = |p: &DVec2| nearest(&curve, place.back(*p)).off.abs();
    let mut sorted: Vec<f64> = crest.iter().map(off).collect();
    sorted.sort_by(f64::total_cmp);
    // the median of normal errors is at 0.67 of their deviation
    let most = STRAY * (sorted[sorted.len() / 2] / 0.6745).max(0.01);
    let kept: Vec<DVec2> = crest.iter().copied().filter(|p| off(p) <= most).collect();
    if kept.len() < 20 {
        return Err(NoLength::Points(kept.len()));
    }
    let (length, place) = search.nearest(&kept, place, f64::INFINITY)?;
    let sigma = search.sigma(&kept, length, place, window)?;
    let curve = search.curve(length);
    let squares: f64 = kept
        .iter()
        .map(|p| nearest(&curve, place.back(*p)).off.powi(2))
        .sum();
    let ends = curve.len() - 1;
    Ok(Identified {
        length,
        sigma,
        off: (squares / kept.len() as f64).sqrt(),
        points: kept.len(),
        stray: crest.len() - kept.len(),
        curve: curve[1..ends].iter().map(|p| place.of(*p)).collect(),
        place,
    })
}

/// Where a curve is nearest to a point.
struct Near {
    /// Distance from the curve, positive to its left, mm.
    off: f64,
    /// Unit normal of the curve there, to its left.
    normal: DVec2,
}

fn nearest(curve: &[DVec2], p: DVec2) -> Near {
    let mut best = f64::INFINITY;
    let mut near = Near {
        off: f64::INFINITY,
        normal: DVec2::Y,
    };
    for w in curve.windows(2) {
        let way = w[1] - w[0];
        let square = way.length_squared();
        let share = ((p - w[0]).dot(way) / square).clamp(0.0, 1.0);
        let from = p - (w[0] + share * way);
        let distance = from.length_squared();
        if distance < best {
            best = distance;
            let left = way.perp() / square.sqrt();
            let sign = if from.dot(left) < 0.0 { -1.0 } else { 1.0 };
            let length = distance.sqrt();
            // beyond a bend of the curve the point lies off its corner
            let normal = if length > 1e-9 {
                sign * from / length
            } else {
                left
            };
            near = Near {
                off: sign * length,
                normal,
            };
        }
    }
    near
}

struct Search<'a> {
    torch: &'a [DVec2],
    mode: PursuitMode,
}

impl Search<'_> {
    /// The curve of a length in the frame of the torch's path, with few corners, and gone on beyond its ends.
    fn curve(&self, length: f64) -> Vec<DVec2> {
        let all = pursuit_curve(self.torch, length, self.mode, STEP * length);
        let mut curve: Vec<DVec2> = Vec::new();
        let mut last = DVec2::ZERO;
        for w in all.windows(2) {
            let Some(heading) = (w[1] - w[0]).try_normalize() else {
                continue;
            };
            if curve.is_empty() {
                curve.push(w[0] - BEYOND * heading);
                curve.push(w[0]);
                last = heading;
            } else if heading.dot(last) < TURN.cos() {
                curve.push(w[0]);
                last = heading;
            }
        }
        if let Some(end) = all.last() {
            curve.push(*end);
            curve.push(*end + BEYOND * last);
        }
        curve.dedup_by(|a, b| a.distance_squared(*b) < 1e-18);
        curve
    }

    /// Sum of squares of the distances of a crest, none of which counts for more than `far`, and the path's best place.
    fn squares(&self, crest: &[DVec2], length: f64, from: Place, far: f64) -> (f64, Place) {
        let curve = self.curve(length);
        let mut place = from;
        for _ in 0..PLACINGS {
            let mut fit = Regression::new(3);
            for p in crest {
                let at = place.back(*p);
                let near = nearest(&curve, at);
                if near.off.abs() <= far {
                    let turn = near.normal.dot(at.perp());
                    fit.push([near.normal.x, near.normal.y, turn], near.off);
                }
            }
            let Ok(found) = fit.solve() else { break };
            let [x, y, turn] = found.values[..] else {
                break;
            };
            // the path moves so that the crest lies on its curve
            let moved = DVec2::new(x, y);
            place = Place {
                turn: place.turn + turn,
                shift: place.shift + DVec2::from_angle(place.turn).rotate(moved),
            };
            if moved.length() < 1e-7 && turn.abs() < 1e-9 {
                break;
            }
        }
        let of = |p: &DVec2| nearest(&curve, place.back(*p)).off.abs().min(far).powi(2);
        (crest.iter().map(of).sum(), place)
    }

    /// The length of least squares and the path's place there.
    fn nearest(&self, crest: &[DVec2], from: Place, far: f64) -> Result<(f64, Place), NoLength> {
        let [low, high] = BOUNDS.map(f64::ln);
        let at = |k: u32| (low + (high - low) * f64::from(k) / f64::from(TRIED)).exp();
        let cost = |length: f64| self.squares(crest, length, from, far).0;
        let costs: Vec<f64> = (0..=TRIED).map(|k| cost(at(k))).collect();
        let best = (0..=TRIED).min_by(|a, b| costs[*a as usize].total_cmp(&costs[*b as usize]));
        let best = best.unwrap_or(0);
        if best == 0 || best == TRIED {
            return Err(NoLength::Bound(at(best)));
        }
        let [length, _] = golden::least([at(best - 1), at(best + 1)], STEPS, cost);
        Ok((length, self.squares(crest, length, from, far).1))
    }

    /// Standard uncertainty of the length where place and direction of the path are unknown as well.
    fn sigma(
        &self,
        crest: &[DVec2],
        length: f64,
        place: Place,
        window: f64,
    ) -> Result<f64, NoLength> {
        let step = 0.02 * length;
        let [less, here, more] = [length - step, length, length + step].map(|l| self.curve(l));
        let mut fit = Regression::new(4);
        for p in crest {
            let at = place.back(*p);
            let near = nearest(&here, at);
            // along the normal here, on which side of its curve the point lies may change
            let off = |curve: &[DVec2]| {
                let found = nearest(curve, at);
                found.off * found.normal.dot(near.normal)
            };
            let slope = (off(&more) - off(&less)) / (2.0 * step);
            let turn = near.normal.dot(at.perp());
            fit.push([near.normal.x, near.normal.y, turn, slope], near.off);
        }
        let found = fit.solve().map_err(|_| NoLength::Blind)?;
        let sigma = found.sigma().get(3).copied().unwrap_or(f64::NAN);
        let way: f64 = self.torch.windows(2).map(|w| w[0].distance(w[1])).sum();
        let shared = (crest.len() as f64 * window / way).max(1.0);
        let sigma = sigma * shared.sqrt();
        if sigma.is_finite() {
            Ok(sigma)
        } else {
            Err(NoLength::Blind)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_numerics::random::Random;

    fn path(angle: f64, leg: f64) -> [DVec2; 3] {
        let turn = DVec2::from_angle(angle.to_radians());
        [DVec2::X * -leg, DVec2::ZERO, turn * leg]
    }

    /// Points every 0.1 mm of a pursuit curve, off it by normal errors, of a path that lies elsewhere than is told.
    fn crest(angle: f64, length: f64, noise: f64, random: &mut Random) -> Vec<DVec2> {
        let curve = pursuit_curve(&path(angle, 45.0), length, PursuitMode::Rope, 0.05);
        let place = Place {
            turn: 0.01,
            shift: DVec2::new(0.3, -0.2),
        };
        let mut since = f64::INFINITY;
        let mut points = Vec::new();
        for w in curve.windows(2) {
            since += w[0].distance(w[1]);
            if since >= 0.1 {
                since = 0.0;
                let error = noise * DVec2::new(random.normal(), random.normal());
                points.push(place.of(w[0] + error));
            }
        }
        points
    }

    /// waam AC-18: a length is found again within 2 % from crest points with 0.1 mm of noise.
    #[test]
    fn waam_ac18_the_length_is_found_again_from_a_crest() {
        let mut random = Random::new(18);
        let mut scores = Vec::new();
        for angle in [75.0, 90.0, -90.0, 105.0, 120.0, 135.0, 150.0] {
            for length in [4.0, 5.0, 6.0] {
                let points = crest(angle, length, 0.1, &mut random);
                let torch = path(angle, 45.0);
                let found = identify(&torch, &points, PursuitMode::Rope, 0.0).unwrap();
                let error = found.length / length - 1.0;
                assert!(
                    error.abs() < 0.02,
                    "{angle} {length}: {error} {}",
                    found.sigma
                );
                assert!((found.off - 0.1).abs() < 0.02, "{}", found.off);
                scores.push((found.length - length) / found.sigma);
            }
        }
        // the uncertainty that is told is that of the errors
        let rms = (scores.iter().map(|s| s * s).sum::<f64>() / scores.len() as f64).sqrt();
        assert!((0.5..1.6).contains(&rms), "{rms}: {scores:?}");
    }

    /// Blunter corners say less, and the uncertainty tells it.
    #[test]
    fn a_blunt_corner_says_little() {
        let mut random = Random::new(4);
        let mut sigma = |angle: f64| {
            let points = crest(angle, 4.0, 0.1, &mut random);
            let found = identify(&path(angle, 45.0), &points, PursuitMode::Rope, 0.0);
            found.map_or(f64::INFINITY, |f| f.sigma / f.length)
        };
        let [blunt, half, right] = [10.0, 45.0, 90.0].map(&mut sigma);
        assert!(
            right < 0.01 && right < half && half < 0.03 && blunt > 0.05,
            "{blunt} {half} {right}"
        );
    }

    #[test]
    fn spatter_beside_the_bead_is_left_out() {
        let mut random = Random::new(5);
        let mut points = crest(90.0, 5.0, 0.05, &mut random);
        let good = points.len();
        for k in 0..20 {
            points.push(DVec2::new(-10.0 + 0.1 * f64::from(k), 2.5));
        }
        let found = identify(&path(90.0, 45.0), &points, PursuitMode::Rope, 0.0).unwrap();
        assert!((found.length - 5.0).abs() < 0.1, "{found:?}");
        assert!(found.stray >= 20 && found.points > good * 9 / 10);
    }

    #[test]
    fn what_gives_no_length_is_told() {
        let torch = path(90.0, 45.0);
        let few = identify(&torch, &torch, PursuitMode::Rope, 0.0);
        assert_eq!(few, Err(NoLength::Points(3)));
        // a crest that keeps to the torch's corner
        let sharp: Vec<DVec2> = (0..200)
            .map(|k| {
                let s = 0.25 * (f64::from(k) - 100.0);
                if s < 0.0 { DVec2::X * s } else { DVec2::Y * s }
            })
            .collect();
        let none = identify(&torch, &sharp, PursuitMode::Rope, 0.0);
        assert!(
            matches!(none, Err(NoLength::Bound(l)) if l < 0.6),
            "{none:?}"
        );
    }
}
