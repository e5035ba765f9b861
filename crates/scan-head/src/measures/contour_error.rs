//! Contour error: how far the marked path lies from another path, whatever their timing.
//!
//! Source: Rasoanarivo 2020, § 2.5.3, fig. 2.69 (after Duong 2016): the point is projected on the segments next to the closest
//! point of the other path. The search is bounded in time, or else neighbouring hatch lines would match.

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::vector::{ScanJob, VectorKind};
use crate::measures::histogram::Histogram;
use crate::measures::segment::distance_to_segment;
use meltpath_geometry::math::DVec2;
use std::collections::VecDeque;

/// The contour error, mm, of each point of `path` against `other`, searched among the points of `other` whose index differs
/// by at most `window` (`None`: among all).
///
/// ```
/// use meltpath_geometry::math::DVec2;
/// use meltpath_scan_head::measures::contour_error::contour_errors;
/// let asked: Vec<_> = (0..100).map(|k| DVec2::new(f64::from(k) * 0.05, 0.0)).collect();
/// // 0.25 mm late and 0.03 mm aside
/// let done: Vec<_> = asked.iter().map(|p| *p + DVec2::new(-0.25, 0.03)).collect();
/// let errors = contour_errors(&done, &asked, Some(10));
/// assert!((errors[50] - 0.03).abs() < 1e-12);
/// ```
pub fn contour_errors(path: &[DVec2], other: &[DVec2], window: Option<usize>) -> Vec<f64> {
    let errors = path.iter().enumerate().map(|(k, &p)| {
        let (from, to) = match window {
            Some(w) => (
                k.saturating_sub(w).min(other.len()),
                (k + w + 1).min(other.len()),
            ),
            None => (0, other.len()),
        };
        let near = (from..to).min_by(|&a, &b| {
            p.distance_squared(other[a])
                .total_cmp(&p.distance_squared(other[b]))
        });
        let Some(m) = near else { return f64::INFINITY };
        let mut error = p.distance(other[m]);
        if m > 0 {
            error = error.min(distance_to_segment(p, other[m - 1], other[m]));
        }
        if m + 1 < other.len() {
            error = error.min(distance_to_segment(p, other[m], other[m + 1]));
        }
        error
    });
    errors.collect()
}

/// Width of a bin of contour errors, mm.
const CONTOUR_BIN: f64 = 5e-4;

/// Width of a bin of angle errors, deg.
const ANGLE_BIN: f64 = 1e-4;

/// A vector under consideration: where it starts and ends, and the last sample at which it is commanded.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    vector: u32,
    a: DVec2,
    b: DVec2,
    kind: VectorKind,
    until: u64,
}

/// Judges a run against its job while it streams: contour errors of lit points, tracking errors of each axis on marks and on
/// jumps, focus errors of lit points, and the worst places.
#[derive(Debug, Clone)]
pub struct PathErrors<'a> {
    job: &'a ScanJob,
    /// Vectors commanded in the last `window` samples, oldest first.
    near: VecDeque<Candidate>,
    window: u64,
    /// Contour errors of lit points on contours, mm.
    pub contour: Histogram,
    /// Contour errors of lit points on fills, mm.
    pub fill: Histogram,
    /// |set-point − angle| of X, Y, Z while marks are commanded, deg.
    pub tracking: [Histogram; 3],
    /// The same while jumps are commanded, deg.
    pub tracking_jumps: [Histogram; 3],
    /// |focus − commanded height| of lit points, mm.
    pub focus: Histogram,
    /// Where the largest contour error lies, mm.
    pub worst: DVec2,
    worst_error: f64,
}

impl<'a> PathErrors<'a> {
    /// Against `job`; lit points are compared with marks commanded at most `window` s before.
    pub fn new(job: &'a ScanJob, window: f64, period: f64) -> Self {
        let angles = || [(); 3].map(|()| Histogram::new(ANGLE_BIN, 20_000));
        PathErrors {
            job,
            near: VecDeque::new(),
            window: (window / period).ceil() as u64,
            contour: Histogram::new(CONTOUR_BIN, 2_000),
            fill: Histogram::new(CONTOUR_BIN, 2_000),
            tracking: angles(),
            tracking_jumps: angles(),
            focus: Histogram::new(1e-3, 5_000),
            worst: DVec2::ZERO,
            worst_error: 0.0,
        }
    }

    fn note(&mut self, vector: u32, sample: u64) {
        match self.near.back_mut() {
            Some(last) if last.vector == vector => last.until = sample,
            _ => {
                let v = &self.job.vectors[vector as usize];
                self.near.push_back(Candidate {
                    vector,
                    a: self.job.start_of(vector as usize).truncate(),
                    b: v.end.truncate(),
                    kind: v.kind,
                    until: sample,
                });
            }
        }
        while self
            .near
            .front()
            .is_some_and(|c| c.until + self.window < sample)
        {
            self.near.pop_front();
        }
    }
}

impl HeadSink for PathErrors<'_> {
    fn block(&mut self, block: &HeadBlock) {
        for (k, &vector) in block.command.vector.iter().enumerate() {
            self.note(vector, block.command.first + k as u64);
            let kind = self.job.vectors[vector as usize].kind;
            if block.command.moving[k] {
                let errors = if kind.is_mark() {
                    &mut self.tracking
                } else {
                    &mut self.tracking_jumps
                };
                for ((histogram, axis), wanted) in
                    errors.iter_mut().zip(&block.axes).zip(&block.set_points)
                {
                    if let Some(angle) = axis.angle.get(k) {
                        histogram.add((wanted[k] - angle).abs().to_degrees());
                    }
                }
            }
            if block.lit[k] < 0.5 {
                continue;
            }
            let p = block.hit[k];
            let closest = self
                .near
                .iter()
                .filter(|c| c.kind.is_mark())
                .map(|c| (distance_to_segment(p, c.a, c.b), c.kind))
                .min_by(|x, y| x.0.total_cmp(&y.0));
            if let Some((error, kind)) = closest {
                if kind == VectorKind::Contour {
                    &mut self.contour
                } else {
                    &mut self.fill
                }
                .add(error);
                if error > self.worst_error {
                    self.worst_error = error;
                    self.worst = p;
                }
                self.focus
                    .add((block.focus[k] - block.command.position[k].z).abs());
            }
        }
    }
}
