//! The distance of two convex bodies by their foremost points.
//!
//! Source: Gilbert, Johnson, Keerthi 1988, "A fast procedure for computing the distance between complex objects in three-dimensional space",
//! IEEE Journal of Robotics and Automation 4; nearest points of simplices after Ericson, Real-Time Collision Detection, 2005, 5.1.5 and 9.5.

use meltpath_geometry::math::DVec3;

/// Steps after which what is known is told.
const STEPS: u32 = 64;
/// How much less than the distance may be told, as a share of it.
const EXACT: f64 = 1e-6;
/// The square of a distance that is none, mm².
const TOUCH: f64 = 1e-16;

/// The distance of two convex bodies, mm, each told by its foremost point in a direction, where it is less than `most`; else no less than
/// `most`. Zero where they touch; never more than it is, and less by a millionth at most. The search begins from `ahead`, a guess of the way
/// from the second to the first.
pub(crate) fn distance(
    one: impl Fn(DVec3) -> DVec3,
    other: impl Fn(DVec3) -> DVec3,
    ahead: DVec3,
    most: f64,
) -> f64 {
    let between = |d: DVec3| one(-d) - other(d);
    let mut simplex = Simplex {
        points: [DVec3::ZERO; 4],
        count: 0,
    };
    let ahead = if ahead.length_squared() > TOUCH {
        ahead
    } else {
        DVec3::Z
    };
    let mut nearest = ahead;
    let (mut least, mut before) = (0.0_f64, f64::INFINITY);
    for step in 0..STEPS {
        let far = nearest.length();
        let new = between(nearest);
        // all lies beyond the plane through the foremost point
        least = least.max(nearest.dot(new) / far);
        let done = step > 0 && far - least <= EXACT * far;
        if least >= most || done || simplex.holds(new) {
            return least;
        }
        simplex.add(new);
        nearest = simplex.nearest();
        let now = nearest.length_squared();
        if simplex.count == 4 || now <= TOUCH {
            return 0.0;
        }
        // no nearer: what is left is rounding
        if now >= before {
            return least;
        }
        before = now;
    }
    least
}

/// Up to four points.
struct Simplex {
    points: [DVec3; 4],
    count: usize,
}

impl Simplex {
    fn all(&self) -> &[DVec3] {
        self.points.get(..self.count).unwrap_or(&self.points)
    }

    fn holds(&self, p: DVec3) -> bool {
        self.all().contains(&p)
    }

    fn add(&mut self, p: DVec3) {
        if let Some(free) = self.points.get_mut(self.count) {
            *free = p;
            self.count += 1;
        }
    }

    fn keep<const N: usize>(&mut self, points: [DVec3; N]) {
        self.count = N;
        for (own, p) in self.points.iter_mut().zip(points) {
            *own = p;
        }
    }

    /// Its point nearest to the origin; what that does not lie on is left out.
    fn nearest(&mut self) -> DVec3 {
        let [a, b, c, d] = self.points;
        match self.count {
            2 => self.on_line(a, b),
            3 => self.on_face(a, b, c),
            4 => self.within(a, b, c, d),
            _ => a,
        }
    }

    fn on_line(&mut self, a: DVec3, b: DVec3) -> DVec3 {
        let way = b - a;
        let square = way.length_squared();
        let along = -a.dot(way);
        if along <= 0.0 || square <= 0.0 {
            self.keep([a]);
            return a;
        }
        if along >= square {
            self.keep([b]);
            return b;
        }
        self.keep([a, b]);
        a + way * (along / square)
    }

    fn on_face(&mut self, a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
        let (ab, ac) = (b - a, c - a);
        let (d1, d2) = (-ab.dot(a), -ac.dot(a));
        if d1 <= 0.0 && d2 <= 0.0 {
            self.keep([a]);
            return a;
        }
        let (d3, d4) = (-ab.dot(b), -ac.dot(b));
        if d3 >= 0.0 && d4 <= d3 {
            self.keep([b]);
            return b;
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return self.on_line(a, b);
        }
        let (d5, d6) = (-ab.dot(c), -ac.dot(c));
        if d6 >= 0.0 && d5 <= d6 {
            self.keep([c]);
            return c;
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return self.on_line(a, c);
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
            return self.on_line(b, c);
        }
        self.keep([a, b, c]);
        // by the plane: more digits than by the shares of its corners
        let normal = ab.cross(ac);
        normal * (a.dot(normal) / normal.length_squared())
    }

    fn within(&mut self, a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> DVec3 {
        let faces = [[a, b, c, d], [a, c, d, b], [a, d, b, c], [b, d, c, a]];
        // the origin on the same side of each face as the corner that is not on it
        let inside = faces.iter().all(|[a, b, c, other]| {
            let normal = (*b - *a).cross(*c - *a);
            let (own, its) = (-a.dot(normal), (*other - *a).dot(normal));
            own * its > 0.0
        });
        if inside {
            return DVec3::ZERO;
        }
        let mut best = (f64::INFINITY, DVec3::ZERO, [DVec3::ZERO; 4], 0);
        for [a, b, c, _] in faces {
            let point = self.on_face(a, b, c);
            let far = point.length_squared();
            if far < best.0 {
                best = (far, point, self.points, self.count);
            }
        }
        (self.points, self.count) = (best.2, best.3);
        best.1
    }
}
