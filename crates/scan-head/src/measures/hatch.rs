//! The hatch distance of a job's fill, from the distances of its lines.

use meltpath_geometry::math::DVec2;

use crate::head::vector::ScanJob;
use meltpath_toolpath::Role;

/// Sine of the largest angle between lines called parallel.
const PARALLEL: f64 = 0.01;
/// Distances that are looked at: memory does not grow with the job.
const MOST: usize = 1_000_000;

/// The distances of neighbouring parallel lines, layer after layer.
#[derive(Debug, Clone, Default)]
pub struct HatchDistance {
    distances: Vec<f64>,
    before: Option<(DVec2, DVec2)>,
}

impl HatchDistance {
    /// Looks at the lines of a layer.
    pub fn take(&mut self, job: &ScanJob) {
        for (i, v) in job.vectors.iter().enumerate() {
            if v.kind != Role::Fill || self.distances.len() >= MOST {
                continue;
            }
            let (a, b) = (job.start_of(i).truncate(), v.end.truncate());
            let along = (b - a).normalize_or_zero();
            if let Some((from, to)) = self.before {
                let other = (to - from).normalize_or_zero();
                let distance = (from.midpoint(to) - a).perp_dot(along).abs();
                if other.perp_dot(along).abs() < PARALLEL && distance > 0.0 {
                    self.distances.push(distance);
                }
            }
            self.before = Some((a, b));
        }
    }

    /// The median distance, mm; none with fewer than two lines.
    pub fn median(mut self) -> Option<f64> {
        self.distances.sort_by(f64::total_cmp);
        self.distances.get(self.distances.len() / 2).copied()
    }

    /// That of one job.
    pub fn of(job: &ScanJob) -> Option<f64> {
        let mut found = HatchDistance::default();
        found.take(job);
        found.median()
    }
}
