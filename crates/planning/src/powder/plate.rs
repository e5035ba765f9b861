//! A plate of equal squares, the job that recipes of powder beds are compared on: two concentric contours and a serpentine fill
//! at 45° in each.
//!
//! Source: Rasoanarivo 2020, § 2.5.2.1, fig. 2.65-2.67.

use meltpath_geometry::math::DVec2;
use meltpath_toolpath::{Layer, PassHead, PassId, Profile, Role, Toolpath};
use serde::{Deserialize, Serialize};

/// A size of a plate that has no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} is {value}, but must be {wanted}")]
pub struct PlateError {
    /// Which one.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
    /// What it must be.
    pub wanted: &'static str,
}

/// Squares in rows and columns round the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SquarePlate {
    /// Squares in a row.
    pub columns: u32,
    /// Rows.
    pub rows: u32,
    /// From square to square along a row, mm.
    pub column_pitch: f64,
    /// From row to row, mm.
    pub row_pitch: f64,
    /// Side of a square, mm.
    pub side: f64,
    /// From the outer to the inner contour, mm.
    pub contour_distance: f64,
    /// From hatch line to hatch line, mm.
    pub hatch: f64,
    /// From the outer contour to the ends of the hatch lines, mm.
    pub inset: f64,
}

impl SquarePlate {
    /// Number of squares.
    pub fn squares(&self) -> u32 {
        self.columns * self.rows
    }

    /// The centre of a square, mm. Square 0 is at the lower right; the next lies on its left; rows go up.
    pub fn centre(&self, square: u32) -> DVec2 {
        let (row, column) = (
            square / self.columns,
            self.columns - 1 - square % self.columns,
        );
        let mid = |count: u32| 0.5 * f64::from(count - 1);
        DVec2::new(
            (f64::from(column) - mid(self.columns)) * self.column_pitch,
            (f64::from(row) - mid(self.rows)) * self.row_pitch,
        )
    }

    /// Corners of the area that the fill covers, mm: lowest and highest.
    fn fill_area(&self, square: u32) -> [DVec2; 2] {
        let half = DVec2::splat(0.5 * self.side - self.inset);
        [self.centre(square) - half, self.centre(square) + half]
    }

    /// The areas that the fills of all squares cover, in the order of execution.
    pub fn fill_areas(&self) -> Vec<[DVec2; 2]> {
        (0..self.squares()).map(|s| self.fill_area(s)).collect()
    }

    /// Checks every dimension.
    ///
    /// # Errors
    /// [`PlateError`].
    pub fn check(&self) -> Result<(), PlateError> {
        let fail = |what, value, wanted| {
            Err(PlateError {
                what,
                value,
                wanted,
            })
        };
        if self.squares() == 0 {
            return fail("the number of squares", 0.0, "1 or more");
        }
        for (what, value) in [
            ("the side of a square", self.side),
            ("the hatch distance", self.hatch),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return fail(what, value, "positive (mm)");
            }
        }
        for (what, value) in [
            ("the contour distance", self.contour_distance),
            ("the inset of the fill", self.inset),
        ] {
            if !(value >= 0.0 && value < 0.5 * self.side) {
                return fail(what, value, "not negative, and less than half a side (mm)");
            }
        }
        for (what, value) in [
            ("the pitch of columns", self.column_pitch),
            ("the pitch of rows", self.row_pitch),
        ] {
            if !(value >= self.side && value.is_finite()) {
                return fail(what, value, "at least a side (mm)");
            }
        }
        Ok(())
    }

    /// The hatch lines of a square, in order and direction: at 45°, from the lower right corner, half a hatch
    /// distance away, to the upper left one.
    pub fn hatch_lines(&self, square: u32) -> Vec<[DVec2; 2]> {
        let [low, high] = self.fill_area(square);
        let size = high.x - low.x;
        let diagonal = size * std::f64::consts::SQRT_2;
        let first = 0.5 * self.hatch;
        let count = ((diagonal - first) / self.hatch).ceil().max(1.0) as u32;
        let across = DVec2::new(-1.0, 1.0) * std::f64::consts::FRAC_1_SQRT_2;
        let corner = DVec2::new(high.x, low.y);
        (0..count)
            .filter_map(|k| {
                let distance = first + f64::from(k) * self.hatch;
                let reach = distance.min(diagonal - distance);
                if reach <= 0.0 {
                    return None;
                }
                let middle = corner + across * distance;
                let along = DVec2::splat(std::f64::consts::FRAC_1_SQRT_2) * reach;
                let (a, b) = (middle - along, middle + along);
                Some(if k % 2 == 0 { [a, b] } else { [b, a] })
            })
            .collect()
    }

    /// One layer of the plate, square by square: two contours, the inner one first, then the fill. Each square is a part.
    ///
    /// # Errors
    /// [`PlateError`].
    pub fn toolpath(&self) -> Result<Toolpath, PlateError> {
        self.check()?;
        let mut layer = Layer::new(1, 0.0);
        for square in 0..self.squares() {
            let mut add = |role: Role, points: &[DVec2]| {
                let head = PassHead {
                    id: PassId(layer.len() as u32),
                    part: square,
                    role,
                    ..PassHead::default()
                };
                layer.polyline(head, points.iter().map(|p| p.extend(0.0)));
            };
            for offset in [self.contour_distance, 0.0] {
                let ring = self.ring(square, offset);
                add(
                    Role::Contour,
                    &[ring[0], ring[1], ring[2], ring[3], ring[0]],
                );
            }
            for line in self.hatch_lines(square) {
                add(Role::Fill, &line);
            }
        }
        Ok(Toolpath {
            profiles: vec![Profile::default()],
            layers: vec![layer],
            ..Toolpath::default()
        })
    }

    /// The corners of a contour, counter-clockwise from the lower right.
    fn ring(&self, square: u32, offset: f64) -> [DVec2; 4] {
        let (c, h) = (self.centre(square), 0.5 * self.side - offset);
        [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| c + DVec2::new(x, y) * h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLATE: SquarePlate = SquarePlate {
        columns: 3,
        rows: 2,
        column_pitch: 12.0,
        row_pitch: 15.0,
        side: 10.0,
        contour_distance: 0.2,
        hatch: 0.5,
        inset: 0.25,
    };

    #[test]
    fn squares_have_two_contours_and_a_serpentine() {
        let path = PLATE.toolpath().unwrap();
        let layer = &path.layers[0];
        layer.sanity_check().unwrap();
        for square in 0..PLATE.squares() {
            let passes: Vec<_> = layer.passes().filter(|p| p.head.part == square).collect();
            let rings: Vec<_> = passes[..2]
                .iter()
                .map(meltpath_toolpath::Pass::length)
                .collect();
            assert!((rings[0] - 38.4).abs() < 1e-9 && (rings[1] - 40.0).abs() < 1e-9);
            assert!(passes[..2].iter().all(meltpath_toolpath::Pass::is_closed));
            let [low, high] = PLATE.fill_area(square);
            let mut area = 0.0;
            for pair in passes[2..].windows(2) {
                let [from, to] = [pair[0].points[1], pair[1].points[0]];
                // there and back, one hatch distance on
                assert!(from.distance(to) < 3.0 * PLATE.hatch);
            }
            for line in &passes[2..] {
                assert_eq!(line.head.role, Role::Fill);
                area += line.length() * PLATE.hatch;
                for p in line.points {
                    let inside = p.truncate().clamp(low, high);
                    assert!(inside.distance(p.truncate()) < 1e-9);
                }
            }
            let wanted = (high - low).element_product();
            assert!((area / wanted - 1.0).abs() < 0.01, "{area} {wanted}");
        }
        assert_eq!(PLATE.centre(0), DVec2::new(12.0, -7.5));
    }

    #[test]
    fn sizes_without_sense_are_refused() {
        let refused = |plate: SquarePlate| plate.toolpath().unwrap_err().to_string();
        assert!(refused(SquarePlate { rows: 0, ..PLATE }).contains("number of squares"));
        assert!(
            refused(SquarePlate {
                hatch: 0.0,
                ..PLATE
            })
            .contains("hatch")
        );
        assert!(
            refused(SquarePlate {
                inset: 5.0,
                ..PLATE
            })
            .contains("half a side")
        );
        let near = SquarePlate {
            row_pitch: 9.0,
            ..PLATE
        };
        assert!(refused(near).contains("pitch of rows"));
    }
}
