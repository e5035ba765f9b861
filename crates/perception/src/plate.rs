//! The plate in a cloud of points, and the frame that lies on it.

use meltpath_geometry::math::DVec3;
use meltpath_numerics::least_squares::Regression;
use meltpath_numerics::random::Random;

/// Planes through three points that are tried.
const TRIES: usize = 1000;
/// Points against which each is tried, at most.
const TRIED_ON: usize = 10_000;
/// Rounds in which the plane is laid through the points near it.
const ROUNDS: usize = 4;

/// A plane with its frame: x and y lie in it, z stands out of it on the side on which there is more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plate {
    origin: DVec3,
    axes: [DVec3; 3],
    /// Root mean square distance of its points, mm.
    pub rms: f64,
    /// Share of the cloud that lies on it.
    pub share: f64,
}

impl Plate {
    /// The plane near which most points lie: within `near` mm (random samples of three, Fischler and Bolles 1981, then least squares).
    /// Nothing where no three points span one.
    ///
    /// The same points give the same plane.
    pub fn of(points: &[DVec3], near: f64) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let mut random = Random::new(1);
        let mut any = || points[(random.unit() * points.len() as f64) as usize % points.len()];
        let tried: Vec<DVec3> = (0..points.len().min(TRIED_ON)).map(|_| any()).collect();
        let mut best: Option<(usize, DVec3, DVec3)> = None;
        for _ in 0..TRIES {
            let [a, b, c] = [any(), any(), any()];
            let Some(normal) = (b - a).cross(c - a).try_normalize() else {
                continue;
            };
            let count = tried.iter().filter(|p| (**p - a).dot(normal).abs() <= near);
            let count = count.count();
            if best.is_none_or(|(most, ..)| count > most) {
                best = Some((count, a, normal));
            }
        }
        let (_, mut origin, mut normal) = best?;
        for _ in 0..ROUNDS {
            (origin, normal) = fitted(points, (origin, normal), near)?;
        }
        let off = |p: &DVec3| (*p - origin).dot(normal);
        let above = points.iter().filter(|p| off(p) > near).count();
        let below = points.iter().filter(|p| off(p) < -near).count();
        let on: Vec<f64> = points.iter().map(off).filter(|d| d.abs() <= near).collect();
        let squares: f64 = on.iter().map(|d| d * d).sum();
        if below > above {
            normal = -normal;
        }
        // x along the axis of the cloud that lies flattest on the plane
        let across = |axis: DVec3| normal.cross(axis).try_normalize();
        let y = if normal.x.abs() < 0.9 {
            across(DVec3::X)
        } else {
            across(DVec3::Y)
        }?;
        Some(Plate {
            origin,
            axes: [y.cross(normal), y, normal],
            rms: (squares / on.len().max(1) as f64).sqrt(),
            share: on.len() as f64 / points.len() as f64,
        })
    }

    /// A point in the frame of the plate, mm.
    pub fn local(&self, p: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|a| (p - self.origin).dot(a)))
    }

    /// A point of the frame of the plate in that of the cloud, mm.
    pub fn global(&self, p: DVec3) -> DVec3 {
        self.origin + p.x * self.axes[0] + p.y * self.axes[1] + p.z * self.axes[2]
    }

    /// Unit vector that stands out of the plate.
    pub fn normal(&self) -> DVec3 {
        self.axes[2]
    }
}

/// The plane of least squares through the points near one.
fn fitted(points: &[DVec3], (origin, normal): (DVec3, DVec3), near: f64) -> Option<(DVec3, DVec3)> {
    let (u, v) = normal.any_orthonormal_pair();
    let local = |p: &DVec3| {
        let from = *p - origin;
        [from.dot(u), from.dot(v), from.dot(normal)]
    };
    let mut plane = Regression::new(3);
    for [x, y, off] in points
        .iter()
        .map(local)
        .filter(|[.., off]| off.abs() <= near)
    {
        plane.push([1.0, x, y], off);
    }
    let [off, along_u, along_v] = plane.solve().ok()?.values[..] else {
        return None;
    };
    let turned = (normal - along_u * u - along_v * v).try_normalize()?;
    Some((origin + off * normal, turned))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// waam AC-45, first half: a fifth of the points are those of a bead, the rest scatter by 0.05 mm.
    #[test]
    fn waam_ac45_the_plane_under_a_bead_is_found() {
        let tilt = DVec3::new(0.2, -0.35, 1.0).normalize();
        let (u, v) = tilt.any_orthonormal_pair();
        for seed in 0..5 {
            let mut random = Random::new(100 + seed);
            let mut points = Vec::new();
            for n in 0..20_000 {
                let (x, y) = (random.between(-40.0, 40.0), random.between(-30.0, 30.0));
                let height = if n % 5 == 0 {
                    random.between(0.3, 2.0)
                } else {
                    0.0
                };
                let at = if height > 0.0 { (x, 0.1 * y) } else { (x, y) };
                points.push(
                    DVec3::new(5.0, 6.0, 7.0)
                        + at.0 * u
                        + at.1 * v
                        + (height + 0.05 * random.normal()) * tilt,
                );
            }
            let plate = Plate::of(&points, 0.2).unwrap();
            assert!(plate.normal().dot(tilt).acos().to_degrees() < 0.1);
            assert!((plate.local(DVec3::new(5.0, 6.0, 7.0)).z).abs() < 0.02);
            assert!((plate.rms - 0.05).abs() < 0.005, "{}", plate.rms);
            let there = plate.local(points[3]);
            assert!((plate.global(there) - points[3]).length() < 1e-9);
        }
    }

    #[test]
    fn points_on_a_line_span_no_plane() {
        let line: Vec<DVec3> = (0..50).map(|i| DVec3::splat(f64::from(i))).collect();
        assert_eq!(Plate::of(&line, 0.2), None);
        assert_eq!(Plate::of(&line[..2], 0.2), None);
    }
}
