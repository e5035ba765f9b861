//! Correction tables: the inverse transform on a grid, interpolated bilinearly, as controllers do it.
//!
//! Source: Rasoanarivo 2020, § 2.3.2.2 (65 × 65 points).

use meltpath_geometry::math::{DVec2, DVec3};

use crate::optics::focus::Focus;
use crate::optics::geometry::{Geometry, GeometryError};

/// Why a table cannot be made or used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CorrectionError {
    /// A grid that is none.
    #[error(
        "a correction table of {points} x {points} points over ±{half} mm is none: at least 2 points and a field above 0 are needed"
    )]
    Grid {
        /// Points a side.
        points: usize,
        /// Half the field, mm.
        half: f64,
    },
    /// A point of the grid is out of reach.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A point outside the table.
    #[error(
        "({x:.3}, {y:.3}) mm lies outside the corrected field of ±{half:.3} mm: move the job towards the centre"
    )]
    Outside {
        /// The point, mm.
        x: f64,
        /// The point, mm.
        y: f64,
        /// Half the field, mm.
        half: f64,
    },
}

/// Angles (θx, θy, θz), rad, on a square grid of points of the field.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionTable {
    half: f64,
    points: usize,
    step: f64,
    /// Row by row, x fastest.
    angles: Vec<DVec3>,
}

/// Errors of a table over its field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableError {
    /// Largest distance between the point asked for and the point hit, mm.
    pub largest: f64,
    /// Where it lies, mm.
    pub at: DVec2,
    /// Mean distance, mm.
    pub mean: f64,
}

/// Cell and weights of a point; beyond the border the outermost cell goes on.
struct Cell {
    i: usize,
    j: usize,
    u: f64,
    v: f64,
}

#[inline]
fn cell(point: DVec2, half: f64, step: f64, points: usize) -> Cell {
    let at = (point + half) / step;
    let last = points - 2;
    // negative indices saturate to 0
    let (i, j) = ((at.x as usize).min(last), (at.y as usize).min(last));
    let (u, v) = (at.x - i as f64, at.y - j as f64);
    Cell { i, j, u, v }
}

impl CorrectionTable {
    /// The table of `points` × `points` over ±`half` mm for a head whose mirrors travel ±`travel` rad, focus on the plane.
    ///
    /// # Errors
    /// [`CorrectionError`] where a point of the field is out of reach.
    pub fn new(
        geometry: &Geometry,
        focus: Option<&Focus>,
        half: f64,
        points: usize,
        travel: DVec2,
    ) -> Result<Self, CorrectionError> {
        geometry.check()?;
        if points < 2 || !(half > 0.0 && half.is_finite()) {
            return Err(CorrectionError::Grid { points, half });
        }
        let step = 2.0 * half / (points - 1) as f64;
        let mut angles = Vec::with_capacity(points * points);
        for j in 0..points {
            for i in 0..points {
                let point = DVec2::new(i as f64, j as f64) * step - half;
                let mirrors = geometry.inverse_within(point, travel)?;
                let cam = focus.map_or(0.0, |f| f.inverse(mirrors, 0.0));
                angles.push(mirrors.extend(cam));
            }
        }
        Ok(CorrectionTable {
            half,
            points,
            step,
            angles,
        })
    }

    /// Refuses points whose cam angle is beyond its travel, rad, or is none.
    ///
    /// # Errors
    /// [`GeometryError::Travel`] with the point that needs most.
    pub fn require_cam(&self, travel: f64) -> Result<(), GeometryError> {
        let size = |z: f64| if z.is_nan() { f64::INFINITY } else { z.abs() };
        let farthest = self
            .angles
            .iter()
            .enumerate()
            .max_by(|a, b| size(a.1.z).total_cmp(&size(b.1.z)));
        match farthest {
            Some((at, angles)) if size(angles.z) > travel => Err(GeometryError::Travel {
                axis: 'Z',
                x: (at % self.points) as f64 * self.step - self.half,
                y: (at / self.points) as f64 * self.step - self.half,
                angle_deg: angles.z.to_degrees(),
                travel_deg: travel.to_degrees(),
            }),
            _ => Ok(()),
        }
    }

    /// Whether the table covers a point, mm.
    pub fn covers(&self, point: DVec2) -> bool {
        point.abs().max_element() <= self.half
    }

    /// Refuses a point outside the table.
    ///
    /// # Errors
    /// [`CorrectionError::Outside`].
    pub fn require(&self, point: DVec2) -> Result<(), CorrectionError> {
        if self.covers(point) {
            Ok(())
        } else {
            Err(CorrectionError::Outside {
                x: point.x,
                y: point.y,
                half: self.half,
            })
        }
    }

    /// The angles, rad, for a point, mm.
    #[inline]
    pub fn angles(&self, point: DVec2) -> DVec3 {
        let Cell { i, j, u, v } = cell(point, self.half, self.step, self.points);
        let at = j * self.points + i;
        let low = self.angles[at] * (1.0 - u) + self.angles[at + 1] * u;
        let high =
            self.angles[at + self.points] * (1.0 - u) + self.angles[at + self.points + 1] * u;
        low * (1.0 - v) + high * v
    }

    /// Errors of the round trip point → table → head → point, on a grid `finer` times as fine as the table.
    pub fn errors(&self, geometry: &Geometry, finer: usize) -> TableError {
        let n = (self.points - 1) * finer.max(1);
        let mut worst = TableError {
            largest: 0.0,
            at: DVec2::ZERO,
            mean: 0.0,
        };
        let mut sum = 0.0;
        for j in 0..=n {
            for i in 0..=n {
                let point =
                    DVec2::new(i as f64, j as f64) * (2.0 * self.half / n as f64) - self.half;
                let error = (geometry.direct(self.angles(point).truncate()) - point).length();
                sum += error;
                if error > worst.largest {
                    worst.largest = error;
                    worst.at = point;
                }
            }
        }
        worst.mean = sum / ((n + 1) * (n + 1)) as f64;
        worst
    }
}
