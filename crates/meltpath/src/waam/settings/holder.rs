//! What holds a part over the table.

use meltpath_geometry::math::DVec3;

/// Something round with flat ends that holds a part, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holder {
    /// The middles of its ends.
    pub ends: [DVec3; 2],
    /// Its radius.
    pub radius: f64,
}

impl Holder {
    /// The distance of a point from it, mm; below zero inside.
    pub fn to_point(&self, p: DVec3) -> f64 {
        let [a, b] = self.ends;
        let along = (b - a).normalize_or_zero();
        let length = (p - a).dot(along);
        let beyond = (-length).max(length - a.distance(b));
        let aside = (p - a - length * along).length() - self.radius;
        match (beyond > 0.0, aside > 0.0) {
            (true, true) => beyond.hypot(aside),
            _ => beyond.max(aside),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_holder_ends_flat() {
        let holder = Holder {
            ends: [DVec3::ZERO, DVec3::new(0.0, 0.0, -60.0)],
            radius: 20.0,
        };
        for (p, distance) in [
            ([0.0, 0.0, 5.0], 5.0),
            ([23.0, 0.0, 4.0], 5.0),
            ([0.0, -26.0, -30.0], 6.0),
            ([0.0, 0.0, -59.0], -1.0),
            ([18.0, 0.0, -30.0], -2.0),
        ] {
            let found = holder.to_point(DVec3::from_array(p));
            assert!((found - distance).abs() < 1e-12, "{p:?}: {found}");
        }
    }
}
