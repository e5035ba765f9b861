//! The whole head, streaming: from a job to where the laser really goes, in blocks, all axes at once.
//!
//! Source: Rasoanarivo 2020, fig. 2.1 and 2.6 (the digital chain). While the axes run over one block, the next is commanded
//! and the previous one is judged; memory does not grow with the job. The result does not depend on the number of threads.

use crate::axis::chain::RunningAxis;
use crate::head::ahead::Ahead;
use crate::head::block::{HeadBlock, HeadSink};
use crate::head::error::HeadError;
use crate::head::gate::Gate;
use crate::head::interpolation::Interpolator;
use crate::head::prepared::{Layers, alone};
use crate::head::ready::ReadyHead;
use crate::head::recipe::LaserDelays;
use crate::head::scan_head::LETTERS;
use crate::head::vector::ScanJob;
use crate::head::window::Window;
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
    /// Executes a job that is wholly in memory: see [`ReadyHead::run_layers`].
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
        let whole = self.survey(alone(job))?;
        self.run_layers(alone(job), (delays, whole.samples), seed, observer, sink)
    }

    /// Executes a job layer by layer: what the head does goes into `sink`, [`BLOCK`] samples at a time. Of `samples` the observer is
    /// told; `seed` is that of the sensors' noise.
    ///
    /// # Errors
    /// [`HeadError`]; also where an axis runs away or the observer cancels.
    pub fn run_layers(
        &self,
        layers: Layers<'_>,
        (delays, samples): (LaserDelays, u64),
        seed: u64,
        observer: &dyn Observer,
        sink: &mut dyn HeadSink,
    ) -> Result<RunSummary, HeadError> {
        let period = self.head.period;
        let rest = (RUN_OUT / period).ceil() as u64;
        observer.stage("scan head", samples + rest);
        let mut window = Window::new(self.checked(layers));
        let start = self.angles(window.start());
        window.sound()?;
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
            path: Interpolator::new(period, rest),
            ahead: self.previews.as_ref().map(|previews| {
                Ahead::new(&previews.mirrors, Interpolator::new(period, rest), start)
            }),
            gate: Gate::new(&mut window, delays, period),
            window,
        };
        let mut optics = Optics { head: self, sink };
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
            ahead.shape((self, &mut source.window), future, &mut done.shaped);
            advance(&mut axes, &mut done)?;
        }
        source.fill(&mut moving);
        let mut samples = 0;
        while !moving.is_empty() {
            source.window.sound()?;
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
            samples += moving.len() as u64;
            std::mem::swap(&mut done, &mut moving);
            std::mem::swap(&mut moving, &mut coming);
        }
        source.window.sound()?;
        optics.take(&mut done);
        Ok(RunSummary {
            duration: samples.saturating_sub(rest + 1) as f64 * period,
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

/// Commands, set-points, and when the laser is on.
struct Source<'a> {
    head: &'a ReadyHead,
    window: Window<'a>,
    path: Interpolator,
    ahead: Option<Ahead<'a>>,
    gate: Gate,
}

impl Source<'_> {
    fn fill(&mut self, block: &mut HeadBlock) {
        self.path.fill(&mut self.window, &mut block.command, BLOCK);
        let vectors = &block.command.vector;
        let ends = vectors.first().zip(vectors.last());
        block.layers = ends.map_or_else(Vec::new, |(a, b)| self.window.between(*a, *b));
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
            ahead.shape((self.head, &mut self.window), count, &mut block.shaped);
        }
        block.lit.clear();
        for k in 0..block.command.position.len() as u64 {
            let sample = block.command.first + k;
            block.lit.push(self.gate.lit(&mut self.window, sample));
        }
        self.window
            .release(self.path.vector().min(self.gate.vector()));
    }
}

/// Where the laser goes.
struct Optics<'a> {
    head: &'a ReadyHead,
    sink: &'a mut dyn HeadSink,
}

impl Optics<'_> {
    fn take(&mut self, block: &mut HeadBlock) {
        if block.is_empty() {
            return;
        }
        block.hit.clear();
        block.focus.clear();
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
        }
        self.sink.block(block);
    }
}
