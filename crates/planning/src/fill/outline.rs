//! Questions to outlines: is a point, is a straight way inside, where does a ray leave.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::crosses;
use meltpath_geometry::{Region, Ring, segments};

/// The edges of a ring.
pub(crate) fn edges(ring: &Ring) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(&a, &b)| (a, b))
}

/// Whether `p` lies inside any of the regions (even-odd over their rings).
pub(crate) fn contains(regions: &[Region], p: DVec2) -> bool {
    regions.iter().any(|region| region.contains(p))
}

/// Regions apart from each other, their edges in rows, for many questions.
pub(crate) struct Room {
    low: f64,
    height: f64,
    rows: Vec<Vec<(DVec2, DVec2)>>,
}

impl Room {
    pub(crate) fn new(regions: &[Region]) -> Self {
        let all = || regions.iter().flat_map(Region::rings).flat_map(edges);
        let (low, high) = all().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (a, _)| {
            (low.min(a.y), high.max(a.y))
        });
        let count = all().count().clamp(1, 4096);
        let height = ((high - low) / count as f64).max(f64::MIN_POSITIVE);
        let mut room = Room {
            low,
            height,
            rows: vec![Vec::new(); count],
        };
        for (a, b) in all() {
            let (first, last) = (room.row(a.y.min(b.y)), room.row(a.y.max(b.y)));
            for row in &mut room.rows[first..=last] {
                row.push((a, b));
            }
        }
        room
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low) / self.height) as usize).min(self.rows.len() - 1)
    }

    /// Whether `p` lies inside.
    pub(crate) fn contains(&self, p: DVec2) -> bool {
        let edges = self.rows[self.row(p.y)].iter();
        edges.filter(|(a, b)| crosses(*a, *b, p)).count() % 2 == 1
    }

    /// Whether the straight way from `a` to `b` stays inside, seen at points at most `step` mm apart.
    pub(crate) fn has_way(&self, a: DVec2, b: DVec2, step: f64) -> bool {
        let n = (a.distance(b) / step).ceil().max(1.0) as usize;
        (0..=n).all(|i| self.contains(a.lerp(b, i as f64 / n as f64)))
    }
}

/// How far a ray from `p` along the unit vector `u` runs until it meets the boundary.
pub(crate) fn ray(region: &Region, p: DVec2, u: DVec2) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    for ring in region.rings() {
        for (a, b) in edges(ring) {
            let e = b - a;
            let det = u.perp_dot(e);
            if det.abs() < 1e-12 {
                continue;
            }
            let t = (a - p).perp_dot(e) / det;
            let s = (a - p).perp_dot(u) / det;
            if t > 1e-9 && (0.0..=1.0).contains(&s) && nearest.is_none_or(|n| t < n) {
                nearest = Some(t);
            }
        }
    }
    nearest
}

/// The nearest point of the segment `a`–`b` to `p`, as the share of the way.
pub(crate) fn nearest_share(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let e = b - a;
    segments::nearest_share((p - a).dot(e), e.length_squared())
}

/// How far `p` is from the boundary, on either side of it.
pub(crate) fn clearance(region: &Region, p: DVec2) -> f64 {
    region
        .rings()
        .flat_map(edges)
        .map(|(a, b)| p.distance(a.lerp(b, nearest_share(p, a, b))))
        .fold(f64::INFINITY, f64::min)
}

/// Length of a polyline.
pub(crate) fn length(points: &[DVec2]) -> f64 {
    points.windows(2).map(|s| s[0].distance(s[1])).sum()
}

/// The polyline without its first `cut` mm; what is left of a shorter one is its last point.
pub(crate) fn without_start(points: &[DVec2], cut: f64) -> Vec<DVec2> {
    let mut left = cut;
    for (i, s) in points.windows(2).enumerate() {
        let step = s[0].distance(s[1]);
        if step > left {
            let mut rest = vec![s[0].lerp(s[1], left / step)];
            rest.extend_from_slice(&points[i + 1..]);
            return rest;
        }
        left -= step;
    }
    points.last().copied().into_iter().collect()
}

/// The regions turned by `angle` about the origin.
pub(crate) fn turned(regions: &[Region], angle: f64) -> Vec<Region> {
    let rotation = DVec2::from_angle(angle);
    let turn = |ring: &Ring| ring.iter().map(|&p| rotation.rotate(p)).collect();
    regions
        .iter()
        .map(|r| Region {
            outer: turn(&r.outer),
            holes: r.holes.iter().map(turn).collect(),
        })
        .collect()
}
