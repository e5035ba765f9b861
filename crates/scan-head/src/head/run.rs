//! The whole head, streaming: from a job to where the laser really goes, in blocks, all axes at once.
//!
//! Source: Rasoanarivo 2020, fig. 2.1 and 2.6 (the digital chain). While the axes run over one block, the next is commanded
//! and the previous one is judged; memory does not grow with the job. The result does not depend on the number of threads.

use crate::axis::chain::RunningAxis;
use crate::head::ahead::Ahead;
use crate::head::block::{HeadBlock, HeadSink};
use crate::head::error::HeadError;
use crate::head::gate::Gate;
use crate::head::interpolation::{Interpolator, sample_count};
use crate::head::ready::ReadyHead;
use crate::head::recipe::LaserDelays;
use crate::head::scan_head::LETTERS;
use crate::head::vector::ScanJob;
use meltpath_base::Observer;
use meltpath_geometry::math::DVec2;

/// Samples in a block.
pub const BLOCK: usize = 8192;

/// Sums of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSummary {
    /// Duration of the job, the head's run-out not included, s.
    pub duration: f64,
    /// Samples of each axis, run-out included.
    pub samples: u64,
}

/// Time after the job's end in which the axes arrive, s.
const RUN_OUT: f64 = 3e-3;

impl ReadyHead {
    /// Executes a job: what the head does goes into `sink`, [`BLOCK`] samples at a time. `seed` is that of the sensors' noise.
    ///
    /// # Errors
    /// [`HeadError`]; also where an axis runs away or the observer cancels.
    pub fn run(
        &self,
        job: &ScanJob,
        delays: LaserDelays,
        seed: u64,
        observer: &dyn Observer,
        sink: &mut dyn HeadSink,
    ) -> Result<RunSummary, HeadError> {
        self.check(job)?;
        let period = self.head.period;
        let rest = (RUN_OUT / period).ceil() as u64;
        let samples = sample_count(job, period) + rest;
        observer.stage("scan head", samples);
        let start = self.angles(job.start);
        let mut axes = Vec::with_capacity(3);
        for ((axis, letter), angle) in self.head.axes().zip(LETTERS).zip(start.to_array()) {
            let named = |source| HeadError::Axis {
                axis: letter,
                source,
            };
            let running = axis
                .start(
                    period,
                    angle,
                    seed.wrapping_mul(3).wrapping_add(axes.len() as u64),
                )
                .map_err(named)?;
            axes.push((letter, running));
        }
        let mut source = Source {
            head: self,
            path: Interpolator::new(job, period, rest),
            ahead: self.previews.as_ref().map(|previews| {
                Ahead::new(
                    &previews.mirrors,
                    Interpolator::new(job, period, rest),
                    start,
                )
            }),
        };
        let mut optics = Optics {
            head: self,
            gate: Gate::new(job, delays, period),
            sink,
        };
        let (mut coming, mut moving, mut done) = (
            HeadBlock::default(),
            HeadBlock::default(),
            HeadBlock::default(),
        );
        coming.period = period;
        moving.period = period;
        done.period = period;
        // what the path has ahead begins before the path does: the mirrors are on their way at its first sample
        if let Some(ahead) = &mut source.ahead {
            let future = ahead.future;
            for (column, angle) in done.set_points.iter_mut().zip(start.to_array()) {
                column.resize(future, angle);
            }
            ahead.shape(self, future, &mut done.shaped);
            advance(&mut axes, &mut done)?;
        }
        source.fill(&mut moving);
        while !moving.is_empty() {
            let mut outcome = Ok(());
            rayon::scope(|scope| {
                // the axes first: they are the longest tasks
                scope.spawn(|_| outcome = advance(&mut axes, &mut moving));
                scope.spawn(|_| source.fill(&mut coming));
                optics.take(&mut done);
            });
            outcome?;
            observer.check()?;
            observer.advance(moving.len() as u64);
            std::mem::swap(&mut done, &mut moving);
            std::mem::swap(&mut moving, &mut coming);
        }
        optics.take(&mut done);
        Ok(RunSummary {
            duration: (samples - rest - 1) as f64 * period,
            samples,
        })
    }
}

/// Runs every axis over a block, in parallel.
fn advance(axes: &mut [(char, RunningAxis)], block: &mut HeadBlock) -> Result<(), HeadError> {
    let HeadBlock {
        set_points,
        shaped,
        axes: records,
        ..
    } = block;
    let [x, y, z] = &*set_points;
    let given = match &*shaped {
        [a, b] if !a.is_empty() => [a, b, z],
        _ => [x, y, z],
    };
    let mut outcomes = [Ok(()), Ok(()), Ok(())];
    rayon::scope(|scope| {
        let parts = axes
            .iter_mut()
            .zip(given)
            .zip(records.iter_mut())
            .zip(outcomes.iter_mut());
        for ((((letter, axis), points), record), outcome) in parts {
            scope.spawn(move |_| {
                *outcome = axis
                    .block(points, record)
                    .map_err(|source| HeadError::Axis {
                        axis: *letter,
                        source,
                    });
            });
        }
    });
    outcomes.into_iter().collect()
}

/// Commands and set-points.
struct Source<'a> {
    head: &'a ReadyHead,
    path: Interpolator<'a>,
    ahead: Option<Ahead<'a>>,
}

impl Source<'_> {
    fn fill(&mut self, block: &mut HeadBlock) {
        self.path.fill(&mut block.command, BLOCK);
        for column in &mut block.set_points {
            column.clear();
        }
        for &point in &block.command.position {
            let angles = self.head.angles(point);
            block.set_points[0].push(angles.x);
            block.set_points[1].push(angles.y);
            block.set_points[2].push(angles.z);
        }
        if let Some(ahead) = &mut self.ahead {
            let count = block.command.position.len();
            ahead.shape(self.head, count, &mut block.shaped);
        }
    }
}

/// Where the laser goes, and when it is on.
struct Optics<'a> {
    head: &'a ReadyHead,
    gate: Gate<'a>,
    sink: &'a mut dyn HeadSink,
}

impl Optics<'_> {
    fn take(&mut self, block: &mut HeadBlock) {
        if block.is_empty() {
            return;
        }
        block.hit.clear();
        block.focus.clear();
        block.lit.clear();
        let geometry = &self.head.head.geometry;
        let [x, y, z] = &block.axes;
        for (k, (&x, &y)) in x.angle.iter().zip(&y.angle).enumerate() {
            let angles = DVec2::new(x, y);
            block.hit.push(geometry.direct(angles));
            let height = match (&self.head.focus, z.angle.get(k)) {
                (Some(focus), Some(&cam)) => focus.direct(angles, cam),
                _ => 0.0,
            };
            block.focus.push(height);
            block
                .lit
                .push(self.gate.lit(block.command.first + k as u64));
        }
        self.sink.block(block);
    }
}
