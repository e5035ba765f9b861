//! A plate of squares, the job that recipes are compared on: two concentric contours and a serpentine fill at 45° in each.
//!
//! Source: Rasoanarivo 2020, § 2.5.2.1, fig. 2.65-2.67. Contour distance, hatch, inset and pitch are not given there: the
//! defaults of the data files are back-computed from the printed job times (docs/theory/sources.md, the plate).

use meltpath_geometry::math::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::head::job::{JobBuilder, Jump, Recipe, ScanJob, ScanJobError};

/// Squares in rows and columns round the centre of the field.
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
    pub fn fill_area(&self, square: u32) -> (DVec2, DVec2) {
        let half = DVec2::splat(0.5 * self.side - self.inset);
        (self.centre(square) - half, self.centre(square) + half)
    }

    /// Checks every dimension.
    ///
    /// # Errors
    /// [`ScanJobError::Value`].
    pub fn check(&self) -> Result<(), ScanJobError> {
        let fail = |what, value, wanted| {
            Err(ScanJobError::Value {
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
    pub fn hatch_lines(&self, square: u32) -> Vec<(DVec2, DVec2)> {
        let (lo, hi) = self.fill_area(square);
        let size = hi.x - lo.x;
        let diagonal = size * std::f64::consts::SQRT_2;
        let first = 0.5 * self.hatch;
        let count = ((diagonal - first) / self.hatch).ceil().max(1.0) as u32;
        let across = DVec2::new(-1.0, 1.0) * std::f64::consts::FRAC_1_SQRT_2;
        let corner = DVec2::new(hi.x, lo.y);
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
                Some(if k % 2 == 0 { (a, b) } else { (b, a) })
            })
            .collect()
    }

    /// The job of one layer.
    ///
    /// # Errors
    /// [`ScanJobError`].
    pub fn job(&self, recipe: &Recipe) -> Result<ScanJob, ScanJobError> {
        self.check()?;
        recipe.check()?;
        let flat = |p: DVec2| p.extend(0.0);
        let start = self.ring(0, self.contour_distance)[0];
        let mut builder = JobBuilder::new(recipe, flat(start));
        for square in 0..self.squares() {
            builder.block(square);
            for (k, offset) in [self.contour_distance, 0.0].into_iter().enumerate() {
                let ring = self.ring(square, offset);
                let jump = if k == 0 {
                    Jump::ToFill
                } else {
                    Jump::BetweenContours
                };
                builder.jump(flat(ring[0]), jump);
                for corner in [1, 2, 3, 0] {
                    builder.contour(flat(ring[corner]));
                }
            }
            for (k, (a, b)) in self.hatch_lines(square).into_iter().enumerate() {
                let jump = if k == 0 {
                    Jump::ToFill
                } else {
                    Jump::BetweenLines
                };
                builder.line(flat(a), flat(b), jump);
            }
        }
        builder.finish()
    }

    /// The corners of a contour, counter-clockwise from the lower right.
    fn ring(&self, square: u32, offset: f64) -> [DVec2; 4] {
        let (c, h) = (self.centre(square), 0.5 * self.side - offset);
        [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)].map(|(x, y)| c + DVec2::new(x, y) * h)
    }
}

/// The outline of the plate, mm: half its size in x and y.
pub fn half_size(plate: &SquarePlate) -> DVec3 {
    let half = |count: u32, pitch: f64| 0.5 * (f64::from(count - 1) * pitch + plate.side);
    DVec3::new(
        half(plate.columns, plate.column_pitch),
        half(plate.rows, plate.row_pitch),
        0.0,
    )
}
