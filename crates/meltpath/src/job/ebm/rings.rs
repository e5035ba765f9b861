//! Contours of a region that bound no area anyone could mean: they cross themselves or each other, or holes lie where nothing is.

use meltpath_base::settings::Problem;
use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;

use super::{RegionTable, Ring};

const ONE_OUTLINE: &str = "write its corners in the order in which they follow the outline; draw areas that meet in a point by a job each";
const APART: &str =
    "keep holes inside the contour and apart from each other; write holes that overlap as one";

/// What is wrong with the rings of a region, each with its key.
pub(super) fn check(region: &RegionTable) -> Vec<Problem> {
    let mut found = Vec::new();
    for ring in [&region.contour, &region.supported] {
        let Some(corners) = ring.as_ref().map(points) else {
            continue;
        };
        let what = match crossing(&corners, None) {
            Some(place) => format!("{} crosses itself at {}", ring.name, told(place)),
            None if flat(&corners) => format!("{} holds no area", ring.name),
            None => continue,
        };
        found.push(ring.problem(what).help(ONE_OUTLINE));
    }
    let holes: Vec<Vec<DVec2>> = region.holes.iter().map(points).collect();
    let contour = region.contour.as_ref().map(points);
    for (n, hole) in holes.iter().enumerate() {
        let others = holes.iter().take(n).enumerate();
        let mut others = others.map(|(m, other)| (m + 1, meeting(hole, other)));
        let other = others.find_map(|(m, place)| Some((m, place?)));
        let (what, help) = if let Some(place) = crossing(hole, None) {
            (format!("crosses itself at {}", told(place)), ONE_OUTLINE)
        } else if flat(hole) {
            ("holds no area".to_owned(), ONE_OUTLINE)
        } else if let Some(place) = contour.as_ref().and_then(|c| leaving(hole, c)) {
            (format!("leaves the contour at {}", told(place)), APART)
        } else if let Some((m, place)) = other {
            (format!("overlaps hole {m} at {}", told(place)), APART)
        } else {
            continue;
        };
        let what = format!("region.holes: hole {} {what}", n + 1);
        found.push(region.holes.problem(what).help(help));
    }
    found
}

fn points(ring: &Ring) -> Vec<DVec2> {
    let corners = ring.iter();
    corners.map(|[x, y]| DVec2::new(x.0, y.0)).collect()
}

fn told(place: DVec2) -> String {
    format!("x {:.3}, y {:.3} mm", place.x, place.y)
}

/// Whether a ring holds less than a square micrometre for each millimetre of its length.
fn flat(ring: &[DVec2]) -> bool {
    let area: f64 = edges(ring).map(|(a, b)| 0.5 * a.perp_dot(b)).sum();
    let length: f64 = edges(ring).map(|(a, b)| a.distance(b)).sum();
    area.abs() <= 1e-6 * length
}

/// The edges of a ring.
fn edges(ring: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    let next = ring.iter().cycle().skip(1);
    ring.iter().copied().zip(next.copied())
}

/// Where a ring crosses another, or itself. What only touches does not cross: slits to inner outlines and corners that meet are usual.
fn crossing(ring: &[DVec2], other: Option<&[DVec2]>) -> Option<DVec2> {
    let mut pairs = edges(ring).flat_map(|e| edges(other.unwrap_or(ring)).map(move |f| (e, f)));
    pairs.find_map(|((a, b), (c, d))| {
        let side = |from: DVec2, to: DVec2, p: DVec2| (to - from).perp_dot(p - from);
        let (of_c, of_d) = (side(a, b, c), side(a, b, d));
        let apart = |p: f64, q: f64| (p < 0.0 && q > 0.0) || (p > 0.0 && q < 0.0);
        let crosses = apart(of_c, of_d) && apart(side(c, d, a), side(c, d, b));
        crosses.then(|| c + (d - c) * (of_c / (of_c - of_d)))
    })
}

/// Corners and middles of edges of a ring that lie inside (or outside) another by more than rounding.
fn beyond(ring: &[DVec2], other: &[DVec2], inside: bool) -> Option<DVec2> {
    let area = Region {
        outer: other.to_vec(),
        holes: Vec::new(),
    };
    let near = |p: DVec2| edges(other).any(|(a, b)| distance(p, a, b) < 1e-6);
    let mut places = edges(ring).flat_map(|(a, b)| [a, 0.5 * (a + b)]);
    places.find(|p| area.contains(*p) == inside && !near(*p))
}

/// Distance of a point from an edge, mm.
fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let way = b - a;
    let share = (p - a).dot(way) / way.length_squared().max(f64::MIN_POSITIVE);
    p.distance(a + way * share.clamp(0.0, 1.0))
}

/// Where a hole is not inside the contour.
fn leaving(hole: &[DVec2], contour: &[DVec2]) -> Option<DVec2> {
    crossing(hole, Some(contour)).or_else(|| beyond(hole, contour, false))
}

/// Where two holes have area in common.
fn meeting(hole: &[DVec2], other: &[DVec2]) -> Option<DVec2> {
    let same = || hole.first().copied().filter(|_| hole == other);
    crossing(hole, Some(other))
        .or_else(same)
        .or_else(|| beyond(hole, other, true))
        .or_else(|| beyond(other, hole, true))
}
