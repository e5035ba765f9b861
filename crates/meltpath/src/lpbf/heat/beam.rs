//! The beam over a recipe's path: as the head drew it, and as it was commanded.

use meltpath_scan_head::head::power::PowerLaw;
use meltpath_scan_head::head::vector::{ScanJob, Vector};
use meltpath_thermal::beam::{BeamError, BeamPath, BeamPoint};
use meltpath_toolpath::{MotionBlock, MotionSink};

/// The beam of the marked path: motion with power, as far as it is wanted.
#[derive(Debug, Clone)]
pub struct BeamRecord {
    pub(super) points: Vec<BeamPoint>,
    vectors: [u32; 2],
    longest: f64,
    spot: f64,
    lit: f64,
    /// Whether the path goes on after what was kept.
    pub cut: bool,
}

impl BeamRecord {
    /// Keeps the path of a beam of `spot` mm from the first to the last of two vectors, or until `longest` mm were lit.
    pub fn new(vectors: [u32; 2], longest: f64, spot: f64) -> Self {
        BeamRecord {
            points: Vec::new(),
            vectors,
            longest,
            spot,
            lit: 0.0,
            cut: false,
        }
    }
}

impl MotionSink for BeamRecord {
    fn block(&mut self, block: &MotionBlock) {
        for (k, at) in block.position.iter().enumerate() {
            let [first, last] = self.vectors;
            if block.command[k] < first {
                continue;
            }
            if block.command[k] > last || self.cut {
                return;
            }
            if self.lit > self.longest {
                self.cut = true;
                return;
            }
            let power = block.power[k];
            let point = BeamPoint {
                time: block.time(k),
                x: at.x,
                y: at.y,
                power: 0.0,
                spot: self.spot,
            };
            // power is that of the period that ends here: it belongs to the row before
            if let Some(before) = self.points.last_mut() {
                before.power = power;
                if before.is_on() {
                    self.lit += (at.x - before.x).hypot(at.y - before.y);
                }
            }
            let dark = self
                .points
                .iter()
                .rev()
                .take(2)
                .filter(|p| !p.is_on())
                .count()
                == 2;
            match self.points.last_mut() {
                Some(last) if dark => *last = point,
                _ => self.points.push(point),
            }
        }
    }
}

/// The power of a beam that stands at the end of a vector until the next begins, W: from mark to mark the light stays on.
pub(super) fn while_it_stands(v: &Vector, next: Option<&Vector>, law: PowerLaw) -> f64 {
    let between = v.kind.deposits() && next.is_some_and(|next| next.kind.deposits());
    if between && v.wait > 0.0 {
        law.power(v.power, v.speed, 0.0)
    } else {
        0.0
    }
}

/// The beam as commanded: marks at their speeds with light from end to end, and the recipe's waits, from mark to mark in the light.
pub(super) fn commanded(
    (job, law): (&ScanJob, PowerLaw),
    longest: f64,
    spot: f64,
) -> Result<BeamPath, BeamError> {
    let mut points: Vec<BeamPoint> = Vec::new();
    let (mut time, mut lit) = (0.0, 0.0);
    for (i, v) in job.vectors.iter().enumerate() {
        if lit > longest {
            break;
        }
        let (from, length) = (job.start_of(i), job.length_of(i));
        let row = |time: f64, at: meltpath_geometry::math::DVec3, power: f64| BeamPoint {
            time,
            x: at.x,
            y: at.y,
            power,
            spot,
        };
        let on = v.kind.deposits();
        points.push(row(time, from, if on { v.power } else { 0.0 }));
        time += if v.speed > 0.0 { length / v.speed } else { 0.0 };
        let next = job.vectors.get(i + 1);
        points.push(row(time, v.end, while_it_stands(v, next, law)));
        time += v.wait;
        if on {
            lit += length;
        }
    }
    BeamPath::new(points)
}

/// The ways that a path draws with light, from where to where.
pub(super) fn lit(path: &BeamPath) -> impl Iterator<Item = [&BeamPoint; 2]> {
    let ways = path.points().windows(2).map(|w| [&w[0], &w[1]]);
    ways.filter(|[from, _]| from.is_on())
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::Times;

    #[test]
    fn power_belongs_to_the_way_that_it_lit() {
        let mut record = BeamRecord::new([0, 1], 1e9, 0.1);
        // dark, dark, dark, lit, lit, dark; the third vector is not wanted any more
        let block = MotionBlock {
            times: Times::Uniform { t0: 0.0, dt: 1e-3 },
            position: (0..7).map(|k| DVec3::new(f64::from(k), 0.0, 0.0)).collect(),
            power: vec![0.0, 0.0, 0.0, 100.0, 80.0, 0.0, 0.0],
            command: vec![0, 0, 0, 1, 1, 1, 2],
            ..MotionBlock::default()
        };
        record.block(&block);
        let rows: Vec<_> = record.points.iter().map(|p| (p.x, p.power)).collect();
        assert_eq!(
            rows,
            [
                (0.0, 0.0),
                (2.0, 100.0),
                (3.0, 80.0),
                (4.0, 0.0),
                (5.0, 0.0)
            ]
        );
        assert_eq!(record.lit, 2.0);
        // of a later layer nothing that was drawn before
        let mut later = BeamRecord::new([1, 1], 1e9, 0.1);
        later.block(&block);
        assert_eq!((later.points[0].x, later.lit), (3.0, 1.0));
    }

    #[test]
    fn a_record_ends_where_it_is_long_enough() {
        let mut record = BeamRecord::new([0, 9], 3.5, 0.1);
        let block = MotionBlock {
            times: Times::Uniform { t0: 0.0, dt: 1e-3 },
            position: (0..20)
                .map(|k| DVec3::new(f64::from(k), 0.0, 0.0))
                .collect(),
            power: vec![50.0; 20],
            command: vec![0; 20],
            ..MotionBlock::default()
        };
        record.block(&block);
        assert!(record.cut && record.points.len() == 5);
    }
}
