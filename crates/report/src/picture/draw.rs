//! Triangles and lines in space, drawn with a depth for each pixel from far away.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::mesh::bounds;

use super::Image;

/// Pixels are so many a side finer than those of the image.
const FINER: usize = 2;
/// How much of the light comes from everywhere.
const AMBIENT: f64 = 0.42;
/// Lines lie so far before faces that they touch, pixels.
const BEFORE: f64 = 3.0;

/// From where something is seen: straight lines of sight, so that lengths across them keep their scale.
#[derive(Debug, Clone, Copy)]
pub struct Camera {
    /// What lies in the middle.
    pub middle: DVec3,
    /// Direction of sight, of unit length.
    sight: DVec3,
    right: DVec3,
    up: DVec3,
    /// Pixels of the image per mm.
    pub scale: f64,
}

impl Camera {
    /// Seen from an azimuth (rad, from x about z) and a height over the level (rad, below a quarter turn).
    pub fn from(middle: DVec3, azimuth: f64, height: f64, scale: f64) -> Self {
        let back = DVec3::new(
            azimuth.cos() * height.cos(),
            azimuth.sin() * height.cos(),
            height.sin(),
        );
        let right = DVec3::new(-azimuth.sin(), azimuth.cos(), 0.0);
        Camera {
            middle,
            sight: -back,
            right,
            up: back.cross(right),
            scale,
        }
    }

    /// Right and up in the picture and away from the eye, mm from the middle.
    pub fn seen(&self, point: DVec3) -> DVec3 {
        let d = point - self.middle;
        DVec3::new(d.dot(self.right), d.dot(self.up), d.dot(self.sight))
    }

    /// The point so far right and up of the middle, and so far from the eye, mm.
    pub fn at(&self, [right, up]: [f64; 2], away: f64) -> DVec3 {
        self.middle + right * self.right + up * self.up + away * self.sight
    }

    /// The scale at which some points fit into a size, and the middle that they have then.
    #[must_use]
    pub fn fitted(self, points: impl Iterator<Item = DVec3>, size: [f64; 2]) -> Self {
        let Some((low, high)) = bounds(points.map(|p| self.seen(p)).filter(|p| p.is_finite()))
        else {
            return self;
        };
        let (middle, span) = (0.5 * (low + high), (high - low).max(DVec3::splat(1.0)));
        Camera {
            middle: self.middle + middle.x * self.right + middle.y * self.up,
            scale: (size[0] / span.x).min(size[1] / span.y),
            ..self
        }
    }
}

/// A view that is being drawn.
pub struct Drawing {
    camera: Camera,
    size: [usize; 2],
    colours: Vec<[f32; 3]>,
    depths: Vec<f64>,
}

impl Drawing {
    /// An empty view of so many pixels.
    pub fn new(camera: Camera, size: [usize; 2], ground: [u8; 3]) -> Self {
        let fine = size.map(|n| n * FINER);
        Drawing {
            camera,
            size: fine,
            colours: vec![ground.map(f32::from); fine[0] * fine[1]],
            depths: vec![f64::INFINITY; fine[0] * fine[1]],
        }
    }

    /// A place in fine pixels, and its depth in the same unit.
    fn place(&self, point: DVec3) -> DVec3 {
        let seen = self.camera.seen(point) * self.camera.scale * FINER as f64;
        let middle = DVec2::new(self.size[0] as f64, self.size[1] as f64) * 0.5;
        DVec3::new(middle.x + seen.x, middle.y - seen.y, seen.z)
    }

    fn put(&mut self, x: usize, y: usize, depth: f64, colour: [f32; 3]) {
        let i = y * self.size[0] + x;
        if let (Some(old), Some(pixel)) = (self.depths.get_mut(i), self.colours.get_mut(i))
            && depth < *old
        {
            *old = depth;
            *pixel = colour;
        }
    }

    /// A triangle, lit from the eye's upper left.
    pub fn triangle(&mut self, corners: [DVec3; 3], colour: [u8; 3]) {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let light =
            (-self.camera.sight + 0.6 * self.camera.up - 0.5 * self.camera.right).normalize();
        let lit = AMBIENT + (1.0 - AMBIENT) * normal.dot(light).abs();
        let colour = colour.map(|c| f32::from(c) * lit as f32);
        let [a, b, c] = corners.map(|p| self.place(p));
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area.abs() < 1e-9 || !area.is_finite() {
            return;
        }
        let span = |of: fn(DVec3) -> f64, size: usize| {
            let (low, high) = (of(a).min(of(b)).min(of(c)), of(a).max(of(b)).max(of(c)));
            (low.max(0.0) as usize)..((high + 1.0).clamp(0.0, size as f64) as usize)
        };
        // shares of the corners and the depth are linear in the picture: slopes along x and y, and what they are at its corner
        let share = |p: DVec3, q: DVec3| {
            let side = (q - p).truncate() / area;
            [-side.y, side.x, side.y * p.x - side.x * p.y]
        };
        let shares = [share(b, c), share(c, a), share(a, b)];
        let depth: [f64; 3] =
            std::array::from_fn(|k| shares[0][k] * a.z + shares[1][k] * b.z + shares[2][k] * c.z);
        let (columns, rows) = (span(|p| p.x, self.size[0]), span(|p| p.y, self.size[1]));
        for y in rows {
            let in_row = |[_, slope, first]: [f64; 3]| slope * (y as f64 + 0.5) + first;
            let begins = shares.map(in_row);
            // no pixel lies in the triangle before or behind where a share is none
            let mut within = columns.clone();
            for ([slope, ..], begin) in shares.iter().zip(begins) {
                let none = (-begin / slope).clamp(-1e6, 1e6);
                if *slope > 0.0 {
                    within.start = within.start.max((none - 2.0).max(0.0) as usize);
                } else if *slope < 0.0 {
                    within.end = within.end.min((none + 2.0).max(0.0) as usize);
                }
            }
            let far = in_row(depth);
            for x in within {
                let at = x as f64 + 0.5;
                let inside = |k: usize| shares[k][0] * at + begins[k] >= 0.0;
                if inside(0) && inside(1) && inside(2) {
                    self.put(x, y, depth[0] * at + far, colour);
                }
            }
        }
    }

    /// A line of some pixels of width.
    pub fn line(&mut self, from: DVec3, to: DVec3, width: f64, colour: [u8; 3]) {
        let [a, b] = [from, to].map(|p| self.place(p));
        let steps = (b - a).truncate().length().min(1e5).ceil().max(1.0) as usize;
        let half = (0.5 * width * FINER as f64).max(0.5);
        let colour = colour.map(f32::from);
        for step in 0..=steps {
            let p = a.lerp(b, step as f64 / steps as f64);
            let range = |at: f64, size: usize| {
                let (low, high) = ((at - half).round(), (at + half).round());
                (low.max(0.0) as usize)..(high.clamp(0.0, size as f64) as usize)
            };
            for y in range(p.y, self.size[1]) {
                for x in range(p.x, self.size[0]) {
                    self.put(x, y, p.z - BEFORE, colour);
                }
            }
        }
    }

    /// Where a point lies in the image, pixels.
    pub fn pixel(&self, point: DVec3) -> [f64; 2] {
        let p = self.place(point) / FINER as f64;
        [p.x, p.y]
    }

    /// Lays the view into an image with its upper left corner at `at`.
    pub fn lay(&self, image: &mut Image, at: [usize; 2]) {
        let count = (FINER * FINER) as f32;
        for y in 0..self.size[1] / FINER {
            for x in 0..self.size[0] / FINER {
                let mut sum = [0.0; 3];
                for (dx, dy) in (0..FINER).flat_map(|dx| (0..FINER).map(move |dy| (dx, dy))) {
                    let fine = (y * FINER + dy) * self.size[0] + x * FINER + dx;
                    let colour = self.colours[fine];
                    sum = std::array::from_fn(|i| sum[i] + colour[i]);
                }
                image.set([at[0] + x, at[1] + y], sum.map(|c| (c / count) as u8));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearer of two faces is seen, whichever is drawn first; lengths across the sight keep the scale.
    #[test]
    fn what_is_nearer_hides_what_lies_behind() {
        let camera = Camera::from(DVec3::ZERO, 0.0, 0.0, 1.0);
        let face = |x: f64, half: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.5]].map(|[y, z]| DVec3::new(x, half * y, half * z))
        };
        for order in [[0, 1], [1, 0]] {
            let mut drawing = Drawing::new(camera, [40, 40], [255; 3]);
            for i in order {
                let (x, half, colour) = [(5.0, 4.0, [200, 0, 0]), (-5.0, 15.0, [0, 0, 200])][i];
                drawing.triangle(face(x, half), colour);
            }
            let mut image = Image::new([40, 40], [255; 3]);
            drawing.lay(&mut image, [0, 0]);
            let rows: Vec<&[[u8; 3]]> = image.rows().collect();
            assert!(rows[20][20][0] > 80 && rows[20][20][2] == 0);
            assert!(rows[30][12][2] > 80 && rows[30][12][0] == 0);
            assert_eq!(rows[2][2], [255; 3]);
        }
        let drawing = Drawing::new(camera, [40, 40], [255; 3]);
        let [a, b] = [DVec3::ZERO, DVec3::new(0.0, 10.0, 0.0)].map(|p| drawing.pixel(p));
        assert!((b[0] - a[0] - 10.0).abs() < 1e-9 && (b[1] - a[1]).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_finite_or_far_outside_draws_nothing() {
        let camera = Camera::from(DVec3::ZERO, 0.3, 0.4, 1.0);
        let mut drawing = Drawing::new(camera, [8, 8], [9; 3]);
        let far = DVec3::new(1e9, 1e9, 0.0);
        drawing.triangle([DVec3::NAN, DVec3::X, DVec3::Y], [0; 3]);
        drawing.triangle([far, far + DVec3::X, far + DVec3::Y], [0; 3]);
        drawing.line(far, far + DVec3::X, 2.0, [0; 3]);
        let mut image = Image::new([8, 8], [0; 3]);
        drawing.lay(&mut image, [0, 0]);
        assert!(image.rows().flatten().all(|p| *p == [9; 3]));
    }
}
