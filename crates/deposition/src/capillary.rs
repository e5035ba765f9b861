//! The section of a liquid bead at rest: surface tension against its own weight, long beside its width.
//!
//! Source: Rouchon 2022, § 2.1.3 and § 4.1 (equations 2.3 to 2.8, after Mohebbi). Elliptic integrals are summed along the tangent's angle
//! instead: d*x* = cos θ / *C*(θ) dθ. Assumes that the whole section is liquid at once, on a flat plate, with one contact angle on
//! both sides; what froze from its toes inwards, or was blown by the arc, has another form.

use std::f64::consts::PI;

use meltpath_numerics::halving;

/// Acceleration of the ground under a falling body, m/s².
const GRAVITY: f64 = 9.81;
/// Pieces in which the half width is summed.
const PIECES: u32 = 48;
/// Places and weights of Gauss' rule of three points on -1 to 1.
const GAUSS: [[f64; 2]; 3] = [
    [-0.774_596_669_241_483_4, 5.0 / 9.0],
    [0.0, 8.0 / 9.0],
    [0.774_596_669_241_483_4, 5.0 / 9.0],
];

/// Capillary length √(γ/ρg), mm, of a liquid of `surface_tension` N/m and `density` kg/m³.
///
/// ```
/// use meltpath_deposition::capillary::capillary_length;
/// // steel: 1.8 N/m, 7150 kg/m³ (Rouchon 2022, § 2.1.3)
/// assert!((capillary_length(1.8, 7150.0) - 5.066).abs() < 1e-3);
/// ```
pub fn capillary_length(surface_tension: f64, density: f64) -> f64 {
    1e3 * (surface_tension / (density * GRAVITY)).sqrt()
}

/// A capillary section: its surface from the apex down to the plate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capillary {
    /// Capillary length of the liquid, mm.
    pub length: f64,
    /// Curvature at the apex, 1/mm.
    pub apex: f64,
    /// Angle between plate and surface, inside the liquid, rad.
    pub contact: f64,
}

impl Capillary {
    /// The section `width` wide on the plate and `height` high, both in mm; none where none is: higher than any puddle of the liquid stands.
    ///
    /// ```
    /// use meltpath_deposition::capillary::Capillary;
    /// let bead = Capillary::of_size(5.066, 7.2, 2.0).unwrap();
    /// assert!((bead.contact.to_degrees() - 61.4).abs() < 0.1);
    /// ```
    pub fn of_size(length: f64, width: f64, height: f64) -> Option<Self> {
        let flat = height * height / (2.0 * length * length);
        if !(width > 0.0 && height > 0.0 && length > 0.0 && flat < 2.0) {
            return None;
        }
        // of one height: the steeper it meets the plate, the rounder its top and the narrower it is
        let of = |contact: f64| Capillary {
            length,
            // 1 - cos a and not cos b - cos a, which loses its digits on flat beads
            apex: (2.0 * (0.5 * contact).sin().powi(2) - flat) / height,
            contact,
        };
        let flattest = 2.0 * (0.5 * flat).sqrt().asin();
        let narrow = |contact: f64| of(contact).width() < width;
        if !narrow(PI) {
            return None;
        }
        Some(of(halving::root([flattest, PI], 200, narrow)))
    }

    /// The section of `area` mm² that meets the plate at `contact` rad, more than 0 and less than π; none of other angles.
    pub fn of_area(length: f64, area: f64, contact: f64) -> Option<Self> {
        if !(area > 0.0 && length > 0.0 && contact > 0.0 && contact < PI) {
            return None;
        }
        let of = |apex: f64| Capillary {
            length,
            apex,
            contact,
        };
        // a full circle of the area is rounder than any section of it
        let least = 1e-9 / length;
        let most = 10.0 * (PI / area).sqrt();
        let small = |apex: f64| of(apex).area() < area;
        (!small(least) && small(most)).then(|| of(halving::root([least, most], 200, small)))
    }

    /// Curvature where the surface stands at `angle`, 1/mm.
    fn curvature(&self, angle: f64) -> f64 {
        self.apex.hypot(2.0 * (0.5 * angle).sin() / self.length)
    }

    /// Distance from the middle where the surface stands at `angle` to the plate, mm.
    fn half_width(&self, angle: f64) -> f64 {
        // the angle as apex * length * sinh(u): near a flat top the summand turns within a small angle
        let scale = self.apex * self.length;
        if scale.is_nan() || scale <= 0.0 {
            return f64::INFINITY;
        }
        let end = (angle / scale).asinh();
        let piece = end / f64::from(PIECES);
        let at = |u: f64| {
            let angle = scale * u.sinh();
            scale * u.cosh() * angle.cos() / self.curvature(angle)
        };
        let pieces = (0..PIECES).map(|k| {
            let middle = (f64::from(k) + 0.5) * piece;
            let sum: f64 = GAUSS
                .iter()
                .map(|[x, w]| w * at(middle + 0.5 * piece * x))
                .sum();
            0.5 * piece * sum
        });
        pieces.sum()
    }

    /// How far under the apex the surface stands at `angle`, mm.
    fn depth(&self, angle: f64) -> f64 {
        // length² (C - apex), without the difference of near numbers
        4.0 * (0.5 * angle).sin().powi(2) / (self.curvature(angle) + self.apex)
    }

    /// Width on the plate, mm.
    pub fn width(&self) -> f64 {
        2.0 * self.half_width(self.contact)
    }

    /// Height over the plate, mm.
    pub fn height(&self) -> f64 {
        self.depth(self.contact)
    }

    /// Area, mm².
    pub fn area(&self) -> f64 {
        let angle = self.contact;
        2.0 * self.length
            * self.length
            * (self.curvature(angle) * self.half_width(angle) - angle.sin())
    }

    /// `count` points of the surface from toe to toe, mm: across from the middle, height over the plate. Points lie at even angles.
    pub fn points(&self, count: usize) -> Vec<[f64; 2]> {
        let height = self.height();
        let last = count.saturating_sub(1).max(1) as f64;
        let point = |k: usize| {
            let share = 2.0 * k as f64 / last - 1.0;
            let angle = share.abs() * self.contact;
            let across = self.half_width(angle).copysign(share);
            [across, height - self.depth(angle)]
        };
        (0..count).map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel() -> f64 {
        capillary_length(1.8, 7150.0)
    }

    /// Runge–Kutta along the arc from the apex: dx/ds = cos θ, dz/ds = -sin θ, dθ/ds = C(z); x, depth and area at the contact angle.
    fn drawn(c: Capillary) -> [f64; 3] {
        let slope = |y: [f64; 4]| {
            let [_, z, angle, _] = y;
            // half the area, as height under the apex times way across
            [
                angle.cos(),
                angle.sin(),
                c.apex + z / (c.length * c.length),
                y[1] * angle.cos(),
            ]
        };
        let step = |y: [f64; 4], h: f64| {
            let add = |k: [f64; 4], s: f64| std::array::from_fn(|i| y[i] + s * k[i]);
            let a = slope(y);
            let b = slope(add(a, 0.5 * h));
            let d = slope(add(b, 0.5 * h));
            let e = slope(add(d, h));
            std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * d[i] + e[i]))
        };
        let mut y = [0.0; 4];
        let h = 1e-3;
        loop {
            let next: [f64; 4] = step(y, h);
            if next[2] >= c.contact {
                // the last step as long as it takes, by halving
                let long = halving::root([0.0, h], 60, |h| step(y, h)[2] > c.contact);
                y = step(y, long);
                return [y[0], y[1], 2.0 * (y[0] * y[1] - y[3])];
            }
            y = next;
        }
    }

    #[test]
    fn waam_ac28_capillary_sections_against_the_differential_equation() {
        for (apex, contact, source) in [
            (0.2, 1.0, [3.7935, 1.9341, 10.4263]),
            (0.05, 1.5, [10.2138, 5.7412, 92.294]),
        ] {
            let c = Capillary {
                length: steel(),
                apex,
                contact,
            };
            let ours = [0.5 * c.width(), c.height(), c.area()];
            for k in 0..3 {
                assert!((ours[k] / source[k] - 1.0).abs() < 1e-4, "{ours:?}");
                assert!((ours[k] / drawn(c)[k] - 1.0).abs() < 1e-9, "{ours:?}");
            }
        }
    }

    #[test]
    fn waam_ac29_the_capillary_section_of_a_beads_size() {
        for (width, [contact, apex, area]) in
            [(7.2, [61.4, 0.2218, 10.316]), (7.0, [62.7, 0.2320, 10.057])]
        {
            let c = Capillary::of_size(steel(), width, 2.0).unwrap();
            assert!((c.contact.to_degrees() - contact).abs() < 0.05, "{c:?}");
            assert!((c.apex - apex).abs() < 5e-5, "{c:?}");
            assert!((c.area() - area).abs() < 5e-4, "{}", c.area());
        }
        let c = Capillary::of_area(steel(), 10.58, 60f64.to_radians()).unwrap();
        assert!((c.width() - 7.41).abs() < 5e-3 && (c.height() - 2.0).abs() < 5e-3);
    }

    #[test]
    fn waam_ac30_what_density_tension_curvature_and_angle_do() {
        let of = |tension: f64, density: f64| {
            Capillary::of_area(capillary_length(tension, density), 10.0, 1.0).unwrap()
        };
        // heavier: flatter; more tension: rounder
        assert!(of(1.8, 7900.0).height() < of(1.8, 7150.0).height());
        assert!(of(2.0, 7150.0).height() > of(1.8, 7150.0).height());
        let of = |apex: f64, contact: f64| Capillary {
            length: steel(),
            apex,
            contact,
        };
        assert!(of(0.1, 1.0).width() > of(0.2, 1.0).width());
        // the angle cuts the same curve farther down
        let (short, long) = (of(0.2, 0.8), of(0.2, 1.2));
        assert!(long.height() > short.height());
        assert_eq!(short.depth(0.5), long.depth(0.5));
        assert_eq!(short.half_width(0.5), long.half_width(0.5));
    }

    #[test]
    fn every_bead_that_stands_has_its_section() {
        for width in [0.5, 3.0, 7.0, 20.0, 80.0] {
            for height in [0.05, 0.5, 2.0, 5.0, 8.0] {
                let Some(c) = Capillary::of_size(steel(), width, height) else {
                    // narrower than a drop that touches the plate in a line
                    assert!(height > 0.9 * width || height > 7.0, "{width} {height}");
                    continue;
                };
                assert!((c.width() / width - 1.0).abs() < 1e-6, "{c:?}");
                assert!((c.height() / height - 1.0).abs() < 1e-6, "{c:?}");
                let points = c.points(21);
                assert!(points[0][1].abs() < 1e-9 && (points[10][1] - height).abs() < 1e-6);
                assert!((points[20][0] - 0.5 * width).abs() < 1e-5 * width);
            }
        }
        assert!(Capillary::of_size(steel(), 7.0, 11.0).is_none());
        assert!(Capillary::of_size(steel(), f64::NAN, 1.0).is_none());
        assert!(Capillary::of_area(steel(), 10.0, PI).is_none());
    }
}
