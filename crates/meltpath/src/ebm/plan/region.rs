//! Which columns of voxels are judged, and what is filled: a contour with holes. What lies below the first layer.

use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::signed_area;
use meltpath_geometry::segments::nearest_share;

/// What lies below the first layer that is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Below {
    /// Dense metal everywhere: the start plate, or a part that is larger than what is drawn.
    Metal,
    /// Metal in these areas, powder elsewhere; powder everywhere where there are none.
    Areas(Vec<Contour>),
}

impl Below {
    /// Whether metal lies below a point.
    ///
    /// ```
    /// use meltpath::ebm::plan::region::{Below, Contour};
    /// let legs = Below::Areas(vec![Contour::rectangle([2.0, 2.0])]);
    /// assert!(legs.is_metal([0.5, 0.0]) && !legs.is_metal([3.0, 0.0]));
    /// ```
    pub fn is_metal(&self, point: [f64; 2]) -> bool {
        match self {
            Below::Metal => true,
            Below::Areas(areas) => areas.iter().any(|a| a.depth(point) > 0.0),
        }
    }

    /// Where metal lies; `None` where it lies everywhere.
    pub fn regions(&self) -> Option<Vec<Region>> {
        match self {
            Below::Metal => None,
            Below::Areas(areas) => Some(areas.iter().map(Contour::region).collect()),
        }
    }
}

/// A closed contour with holes, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    corners: Vec<[f64; 2]>,
    holes: Vec<Vec<[f64; 2]>>,
}

impl Contour {
    /// A contour through `corners`.
    pub fn new(corners: Vec<[f64; 2]>) -> Self {
        Contour {
            corners,
            holes: Vec::new(),
        }
    }

    /// The contour of a region.
    pub fn of(region: &Region) -> Self {
        let corners = |ring: &Vec<DVec2>| ring.iter().map(DVec2::to_array).collect::<Vec<_>>();
        Contour {
            corners: corners(&region.outer),
            holes: region.holes.iter().map(corners).collect(),
        }
    }

    /// A rectangle round the origin.
    pub fn rectangle([width, height]: [f64; 2]) -> Self {
        let (x, y) = (0.5 * width, 0.5 * height);
        Self::new(vec![[-x, -y], [x, -y], [x, y], [-x, y]])
    }

    /// The same contour with these holes.
    #[must_use]
    pub fn with_holes(self, holes: Vec<Vec<[f64; 2]>>) -> Self {
        Contour { holes, ..self }
    }

    /// The convex hull of `points`.
    ///
    /// ```
    /// use meltpath::ebm::plan::region::Contour;
    /// let hull = Contour::hull(&[[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0]]);
    /// assert!((hull.depth([1.0, 0.25]) - 0.25).abs() < 1e-12, "the point inside is no corner");
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
        Self::new(corners)
    }

    /// The region inside: outer ring counter-clockwise, holes clockwise.
    pub fn region(&self) -> Region {
        let ring = |corners: &[[f64; 2]], sign: f64| {
            let mut ring: Vec<DVec2> = corners.iter().map(|c| DVec2::from_array(*c)).collect();
            if signed_area(&ring) * sign < 0.0 {
                ring.reverse();
            }
            ring
        };
        Region {
            outer: ring(&self.corners, 1.0),
            holes: self.holes.iter().map(|h| ring(h, -1.0)).collect(),
        }
    }

    /// How far inside the contour and outside its holes a point lies, mm; below zero where it does not.
    ///
    /// ```
    /// use meltpath::ebm::plan::region::Contour;
    /// let frame = Contour::rectangle([10.0, 10.0])
    ///     .with_holes(vec![vec![[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]]);
    /// assert!((frame.depth([4.2, 0.0]) - 0.8).abs() < 1e-12);
    /// assert!(frame.depth([0.0, 0.0]) < 0.0);
    /// assert!((frame.region().area() - 64.0).abs() < 1e-9);
    /// ```
    pub fn depth(&self, point: [f64; 2]) -> f64 {
        let [x, y] = point;
        let mut inside = false;
        let mut nearest = f64::INFINITY;
        for ring in std::iter::once(&self.corners).chain(&self.holes) {
            for (n, a) in ring.iter().enumerate() {
                let b = ring[(n + 1) % ring.len()];
                if (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
                {
                    inside = !inside;
                }
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let t = nearest_share((x - a[0]) * dx + (y - a[1]) * dy, dx * dx + dy * dy);
                nearest = nearest.min((x - a[0] - t * dx).hypot(y - a[1] - t * dy));
            }
        }
        if inside { nearest } else { -nearest }
    }

    /// Its holes, each as a contour of its own.
    pub fn holes(&self) -> impl Iterator<Item = Contour> {
        self.holes
            .iter()
            .map(|corners| Contour::new(corners.clone()))
    }

    /// Lowest and highest corner.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let fold = |start: f64, of: fn(f64, f64) -> f64| {
            [0, 1].map(|a| self.corners.iter().fold(start, |e, c| of(e, c[a])))
        };
        [
            fold(f64::INFINITY, f64::min),
            fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// A point that lies as deep inside as any, found on a grid of a hundredth of the contour's extent, mm.
    pub fn deepest(&self) -> [f64; 2] {
        let [low, high] = self.bounds();
        let (x, y) = ([low[0], high[0]], [low[1], high[1]]);
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
