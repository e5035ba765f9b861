//! Contour error: how far the marked path lies from another path, whatever their timing.
//!
//! Source: Rasoanarivo 2020, § 2.5.3, fig. 2.69 (after Duong 2016): the point is projected on the segments next to the closest
//! point of the other path. The search is bounded in time, or else neighbouring hatch lines would match.

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::prepared::Prepared;
use crate::measures::histogram::Histogram;
use crate::measures::segment::distance_to_segment;
use meltpath_geometry::math::DVec2;
use meltpath_toolpath::Role;
use std::collections::VecDeque;

/// Width of a bin of contour errors, mm.
const CONTOUR_BIN: f64 = 5e-4;

/// Width of a bin of angle errors, deg.
const ANGLE_BIN: f64 = 1e-4;

/// In a millimetre.
const NANOMETRES: f64 = 1e6;

/// A vector under consideration: where it starts and ends, and the last sample at which it is commanded.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    vector: u32,
    a: DVec2,
    b: DVec2,
    kind: Role,
    until: u64,
}

/// Judges a run against its job while it streams: contour errors of lit points, tracking errors of each axis on marks and on
/// jumps, focus errors of lit points, and the worst places.
#[derive(Debug, Clone)]
pub struct PathErrors {
    /// Vectors commanded in the last `window` samples, oldest first.
    near: VecDeque<Candidate>,
    window: u64,
    /// Contour errors of lit points on contours, mm.
    pub contour: Histogram,
    /// The same by the way that the spot goes between points, one a nanometre: where it stands, lit, at a corner, no more counts.
    pub contour_way: Histogram,
    /// Where the spot was at the last point, if it was lit, mm.
    last: Option<DVec2>,
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

impl PathErrors {
    /// Lit points are compared with marks commanded at most `window` s before.
    pub fn new(window: f64, period: f64) -> Self {
        let angles = || [(); 3].map(|()| Histogram::new(ANGLE_BIN, 20_000));
        PathErrors {
            near: VecDeque::new(),
            window: (window / period).ceil() as u64,
            contour: Histogram::new(CONTOUR_BIN, 2_000),
            contour_way: Histogram::new(CONTOUR_BIN, 2_000),
            last: None,
            fill: Histogram::new(CONTOUR_BIN, 2_000),
            tracking: angles(),
            tracking_jumps: angles(),
            focus: Histogram::new(1e-3, 5_000),
            worst: DVec2::ZERO,
            worst_error: 0.0,
        }
    }

    fn note(&mut self, vector: u32, (layer, i): (&Prepared, usize), sample: u64) {
        match self.near.back_mut() {
            Some(last) if last.vector == vector => last.until = sample,
            _ => {
                let v = &layer.job.vectors[i];
                self.near.push_back(Candidate {
                    vector,
                    a: layer.job.start_of(i).truncate(),
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

impl HeadSink for PathErrors {
    fn block(&mut self, block: &HeadBlock) {
        for (k, &vector) in block.command.vector.iter().enumerate() {
            let Some((layer, i)) = block.vector(k) else {
                continue;
            };
            self.note(vector, (layer, i), block.command.first + k as u64);
            let kind = layer.job.vectors[i].kind;
            if block.command.moving[k] {
                let errors = if kind.deposits() {
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
                self.last = None;
                continue;
            }
            let p = block.hit[k];
            let way = self.last.replace(p).map_or(0.0, |last| last.distance(p));
            let closest = self
                .near
                .iter()
                .filter(|c| c.kind.deposits())
                .map(|c| (distance_to_segment(p, c.a, c.b), c.kind))
                .min_by(|x, y| x.0.total_cmp(&y.0));
            if let Some((error, kind)) = closest {
                if kind == Role::Contour {
                    self.contour.add(error);
                    self.contour_way
                        .add_many(error, (NANOMETRES * way).round() as u64);
                } else {
                    self.fill.add(error);
                }
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
