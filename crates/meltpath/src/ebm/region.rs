//! Which columns of voxels are judged: those well inside a contour.

/// A closed contour, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    corners: Vec<[f64; 2]>,
}

impl Contour {
    /// A contour through `corners`.
    pub fn new(corners: Vec<[f64; 2]>) -> Self {
        Contour { corners }
    }

    /// The convex hull of `points`.
    ///
    /// ```
    /// use meltpath::ebm::region::Contour;
    /// let hull = Contour::hull(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0]]);
    /// assert_eq!(hull.corners().len(), 4);
    /// assert!((hull.depth([1.0, 1.0]) - 1.0).abs() < 1e-12);
    /// assert!(hull.depth([3.0, 1.0]) < 0.0);
    /// ```
    pub fn hull(points: &[[f64; 2]]) -> Self {
        let mut points = points.to_vec();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        points.dedup();
        let turns = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
        };
        let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
            let mut chain: Vec<[f64; 2]> = Vec::new();
            for p in points {
                while chain.len() >= 2 && !turns(chain[chain.len() - 2], chain[chain.len() - 1], p)
                {
                    chain.pop();
                }
                chain.push(p);
            }
            chain.pop();
            chain
        };
        let mut corners = half(&mut points.iter().copied());
        corners.extend(half(&mut points.iter().rev().copied()));
        Contour { corners }
    }

    /// The corners.
    pub fn corners(&self) -> &[[f64; 2]] {
        &self.corners
    }

    /// How far inside the contour a point lies, mm; below zero outside.
    pub fn depth(&self, point: [f64; 2]) -> f64 {
        let [x, y] = point;
        let mut inside = false;
        let mut nearest = f64::INFINITY;
        for (n, a) in self.corners.iter().enumerate() {
            let b = self.corners[(n + 1) % self.corners.len()];
            if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
                inside = !inside;
            }
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let length = dx * dx + dy * dy;
            let t = if length > 0.0 {
                (((x - a[0]) * dx + (y - a[1]) * dy) / length).clamp(0.0, 1.0)
            } else {
                0.0
            };
            nearest = nearest.min((x - a[0] - t * dx).hypot(y - a[1] - t * dy));
        }
        if inside { nearest } else { -nearest }
    }

    /// A point that lies as deep inside as any, found on a grid of a hundredth of the contour's extent, mm.
    pub fn deepest(&self) -> [f64; 2] {
        let ends = |a: usize| {
            self.corners
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |e, c| {
                    [e[0].min(c[a]), e[1].max(c[a])]
                })
        };
        let (x, y) = (ends(0), ends(1));
        // the middle first: of points equally deep the one nearest to it
        let middle = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])];
        let away = |p: [f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
        let mut best = (self.depth(middle), middle);
        for n in 0..101 * 101 {
            let share = |i: usize| i as f64 / 100.0;
            let p = [
                x[0] + share(n % 101) * (x[1] - x[0]),
                y[0] + share(n / 101) * (y[1] - y[0]),
            ];
            let depth = self.depth(p);
            if depth > best.0 + 1e-9 || (depth > best.0 - 1e-9 && away(p) < away(best.1)) {
                best = (depth, p);
            }
        }
        best.1
    }
}
