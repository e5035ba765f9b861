//! The whole head, streaming: from a job to where the laser really goes, in blocks, all axes at once.
//!
//! Source: Rasoanarivo 2020, fig. 2.1 and 2.6 (the digital chain). While the axes run over one block, the next is commanded
//! and the previous one is judged; memory does not grow with the job. The result does not depend on the number of threads.

use std::collections::VecDeque;

use meltpath_base::{Cancelled, Observer};
use meltpath_geometry::math::{DVec2, DVec3};

use crate::axis::chain::{Axis, AxisRecord, RunningAxis};
use crate::axis::galvanometer::AxisError;
use crate::axis::prefilter::Kernel;
use crate::head::ahead::Ahead;
use crate::head::gate::Gate;
use crate::head::interpolation::{CommandBlock, Interpolator, counts, sample_count};
use crate::head::job::{LaserDelays, ScanJob, ScanJobError};
use crate::optics::beam::GaussianBeam;
use crate::optics::correction::{Border, CorrectionError, CorrectionTable};
use crate::optics::focus::{Focus, Lenses};
use crate::optics::geometry::{Geometry, GeometryError};
use crate::servo::preview::Previews;

/// Samples in a block.
pub const BLOCK: usize = 8192;

/// Why a head could not execute a job.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeadError {
    /// An axis.
    #[error("{axis} axis: {source}")]
    Axis {
        /// `X`, `Y` or `Z`.
        axis: char,
        /// What is wrong.
        source: AxisError,
    },
    /// The job.
    #[error(transparent)]
    Job(#[from] ScanJobError),
    /// The correction table.
    #[error(transparent)]
    Correction(#[from] CorrectionError),
    /// The geometry.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A vector that leaves the field.
    #[error("vector {index}: {source}")]
    Field {
        /// Position in the job, from 0.
        index: usize,
        /// Where it goes.
        source: CorrectionError,
    },
    /// The axes' sampling does not suit the job.
    #[error(
        "at {frequency:.0} Hz a mark of {length:.4} mm at {speed:.0} mm/s (up to vector {index}) is over before one sample: mark slower, or leave it out"
    )]
    Sampling {
        /// Position in the job, from 0.
        index: usize,
        /// Its length, mm.
        length: f64,
        /// Its speed, mm/s.
        speed: f64,
        /// Sampling frequency, Hz.
        frequency: f64,
    },
    /// Delays that leave every mark dark.
    #[error(
        "no mark is lit: the laser-on delay, {:.0} µs, outlasts the longest mark between jumps, {:.0} µs, and the laser-off delay, {:.0} µs: a shorter laser-on delay, or tuned delays",
        1e6 * .on, 1e6 * .longest, 1e6 * .off
    )]
    Dark {
        /// On-delay, s.
        on: f64,
        /// Off-delay, s.
        off: f64,
        /// Duration of the longest chain of marks, s.
        longest: f64,
    },
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A scan head: its optics and its axes.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanHead {
    /// Name for people.
    pub name: String,
    /// Sample period, s.
    pub period: f64,
    /// Mirrors, windows and plane.
    pub geometry: Geometry,
    /// The X and Y axes.
    pub mirrors: [Axis; 2],
    /// The axis of the dynamic focus with its lenses, where the head has one.
    pub focus: Option<(Axis, Lenses)>,
    /// Half the side of the field, mm.
    pub half_field: f64,
    /// Points a side of the correction table; without a table the inverse is computed exactly.
    pub table: Option<usize>,
    /// The beam at the powder.
    pub beam: GaussianBeam,
}

/// What the head did during one block of samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeadBlock {
    /// Sample period, s.
    pub period: f64,
    /// The command: points, vectors, whether it moves.
    pub command: CommandBlock,
    /// Angles (θx, θy, θz) of the commanded points, rad.
    pub set_points: [Vec<f64>; 3],
    /// What the mirrors are given in their place where the path ahead is used, rad; empty otherwise.
    pub shaped: [Vec<f64>; 2],
    /// What each axis did; the third is empty without focus axis.
    pub axes: [AxisRecord; 3],
    /// Point hit in the plane, mm.
    pub hit: Vec<DVec2>,
    /// Height of the focus over the plane, mm; zeros without focus axis.
    pub focus: Vec<f64>,
    /// Share of the period ending at the sample during which the laser is on.
    pub lit: Vec<f64>,
}

impl HeadBlock {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.command.position.len()
    }

    /// Whether the block has no samples.
    pub fn is_empty(&self) -> bool {
        self.command.position.is_empty()
    }
}

/// Receives what a head does, block after block in time order.
pub trait HeadSink: Send {
    /// Takes the next block.
    fn block(&mut self, block: &HeadBlock);
}

impl<S: HeadSink + ?Sized> HeadSink for &mut S {
    fn block(&mut self, block: &HeadBlock) {
        (**self).block(block);
    }
}

impl<S: HeadSink> HeadSink for Option<S> {
    fn block(&mut self, block: &HeadBlock) {
        if let Some(sink) = self {
            sink.block(block);
        }
    }
}

impl HeadSink for Vec<HeadBlock> {
    fn block(&mut self, block: &HeadBlock) {
        self.push(block.clone());
    }
}

impl<A: HeadSink, B: HeadSink> HeadSink for (A, B) {
    fn block(&mut self, block: &HeadBlock) {
        self.0.block(block);
        self.1.block(block);
    }
}

/// Sums of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSummary {
    /// Duration of the job, the head's run-out not included, s.
    pub duration: f64,
    /// Samples of each axis, run-out included.
    pub samples: u64,
}

/// A head made ready: focus fitted, table computed, everything checked.
#[derive(Debug, Clone)]
pub struct ReadyHead {
    head: ScanHead,
    focus: Option<Focus>,
    inverse: Inverse,
    previews: Option<Previews>,
}

#[derive(Debug, Clone)]
enum Inverse {
    Table(CorrectionTable),
    Exact { travel: DVec2 },
}

/// The axes' letters.
const LETTERS: [char; 3] = ['X', 'Y', 'Z'];

impl ScanHead {
    /// Checks the head, fits its focus and computes its table.
    ///
    /// # Errors
    /// [`HeadError`].
    pub fn ready(&self) -> Result<ReadyHead, HeadError> {
        self.geometry.check()?;
        for (axis, letter) in self.axes().zip(LETTERS) {
            axis.check().map_err(|source| HeadError::Axis {
                axis: letter,
                source,
            })?;
        }
        let focus = self
            .focus
            .as_ref()
            .map(|(_, lenses)| Focus::new(*lenses, self.geometry))
            .transpose()?;
        let travel = DVec2::new(self.mirrors[0].travel, self.mirrors[1].travel);
        let inverse = match self.table {
            Some(points) => Inverse::Table(CorrectionTable::new(
                &self.geometry,
                focus.as_ref(),
                self.half_field,
                points,
                travel,
                Border::Extrapolate,
            )?),
            None => Inverse::Exact { travel },
        };
        if let (Inverse::Table(table), Some((axis, _))) = (&inverse, &self.focus) {
            table.require_cam(axis.travel)?;
        }
        Ok(ReadyHead {
            head: self.clone(),
            focus,
            inverse,
            previews: None,
        })
    }

    fn axes(&self) -> impl Iterator<Item = &Axis> {
        self.mirrors
            .iter()
            .chain(self.focus.as_ref().map(|(axis, _)| axis))
    }

    /// Gives both mirrors the averages of the one whose pre-filter lags more, so that set-points of straight lines stay straight;
    /// a mirror without a pre-filter stays without.
    pub fn filter_alike(&mut self) {
        let slower = self
            .mirrors
            .iter()
            .filter_map(|axis| axis.prefilter)
            .max_by(|a, b| a.lag().total_cmp(&b.lag()));
        if let Some(slower) = slower {
            for axis in &mut self.mirrors {
                if let Some(filter) = &mut axis.prefilter {
                    (filter.first, filter.second) = (slower.first, slower.second);
                }
            }
        }
    }

    /// Leaves out the second average of each mirror's pre-filter: the speed and the acceleration stay bounded, the jerk does not
    /// (Rasoanarivo 2020, fig. 2.27).
    pub fn filter_acceleration(&mut self) {
        for axis in &mut self.mirrors {
            if let Some(filter) = &mut axis.prefilter {
                // an average over one sample is none
                filter.second = Kernel::Box(self.period);
            }
        }
    }

    /// By how much more one mirror's pre-filter lags than the other's, s.
    pub fn mirrors_apart(&self) -> f64 {
        let [x, y] = [0, 1].map(|k| {
            let filter = self.mirrors[k].prefilter.as_ref();
            filter.map_or(0.0, crate::axis::prefilter::PreFilter::lag)
        });
        (x - y).abs()
    }

    /// The longest steady lag of an axis' pre-filter, s.
    pub fn lag(&self) -> f64 {
        self.axes()
            .filter_map(|a| a.prefilter.as_ref())
            .map(crate::axis::prefilter::PreFilter::lag)
            .fold(0.0, f64::max)
    }
}

/// Time after the job's end in which the axes arrive, s.
const RUN_OUT: f64 = 3e-3;

impl ReadyHead {
    /// The head.
    pub fn head(&self) -> &ScanHead {
        &self.head
    }

    /// The fitted focus.
    pub fn focus(&self) -> Option<&Focus> {
        self.focus.as_ref()
    }

    /// The correction table, where the head uses one.
    pub fn table(&self) -> Option<&CorrectionTable> {
        match &self.inverse {
            Inverse::Table(table) => Some(table),
            Inverse::Exact { .. } => None,
        }
    }

    /// The same head with its table recalibrated or replaced.
    #[must_use]
    pub fn with_table(mut self, table: CorrectionTable) -> Self {
        self.inverse = Inverse::Table(table);
        self
    }

    /// The same head with the set-points of its mirrors shaped, the path ahead being known.
    #[must_use]
    pub fn with_previews(mut self, previews: Previews) -> Self {
        self.previews = Some(previews);
        self
    }

    /// The largest changes of each mirror's speed, rad/s, that the commands of a job ask for within `window` s.
    pub fn speed_changes(&self, job: &ScanJob, window: f64) -> [f64; 2] {
        let period = self.head.period;
        // speeds of the last `window`, each with the sample at which it ends
        let mut recent: VecDeque<(f64, DVec2)> = VecDeque::from([(0.0, DVec2::ZERO)]);
        let (mut at, mut from) = (0.0, self.angles(job.start).truncate());
        let mut largest = DVec2::ZERO;
        let mut note = |begin: f64, end: f64, speed: DVec2| {
            while recent
                .front()
                .is_some_and(|r| r.0 + window / period < begin)
            {
                recent.pop_front();
            }
            for (_, before) in &recent {
                largest = largest.max((speed - before).abs());
            }
            recent.push_back((end, speed));
        };
        for (index, v) in job.vectors.iter().enumerate() {
            let to = self.angles(v.end).truncate();
            let (moving, waiting) = counts(job, index, period);
            let (moving, waiting) = (moving as f64, waiting as f64);
            if moving > 0.0 {
                note(at, at + moving, (to - from) / (moving * period));
            }
            if waiting > 0.0 {
                note(at + moving, at + moving + waiting, DVec2::ZERO);
            }
            at += moving + waiting;
            from = to;
        }
        note(at, at, DVec2::ZERO);
        largest.to_array()
    }

    /// Refuses a job that leaves the field or has vectors without samples.
    ///
    /// # Errors
    /// [`HeadError`].
    pub fn check(&self, job: &ScanJob) -> Result<(), HeadError> {
        job.check()?;
        let inside = |index: usize, p: DVec2| {
            let error = match &self.inverse {
                Inverse::Table(table) => table.require(p).err(),
                Inverse::Exact { travel } => {
                    let beyond = p.abs().max_element() > self.head.half_field;
                    let half = self.head.half_field;
                    let outside = beyond.then_some(CorrectionError::Outside {
                        x: p.x,
                        y: p.y,
                        half,
                    });
                    outside.or_else(|| self.within(p, *travel).err().map(CorrectionError::from))
                }
            };
            error.map_or(Ok(()), |source| Err(HeadError::Field { index, source }))
        };
        inside(0, job.start.truncate())?;
        // short vectors of a curve take a sample each; a whole chain of marks needs one at its own speed
        let (mut length, mut samples) = (0.0, 0.0);
        for (index, v) in job.vectors.iter().enumerate() {
            inside(index, v.end.truncate())?;
            if !v.kind.is_mark() {
                (length, samples) = (0.0, 0.0);
                continue;
            }
            length += job.length_of(index);
            samples += job.length_of(index) / (v.speed * self.head.period);
            let last = job.vectors.get(index + 1).is_none_or(|n| !n.kind.is_mark());
            if last && length > 0.0 && samples < 1.0 {
                return Err(HeadError::Sampling {
                    index,
                    length,
                    speed: v.speed,
                    frequency: 1.0 / self.head.period,
                });
            }
        }
        Ok(())
    }

    /// Refuses a point whose angles, without a table, are beyond the travels of the mirrors or of the cam.
    fn within(&self, point: DVec2, travel: DVec2) -> Result<(), GeometryError> {
        let mirrors = self.head.geometry.inverse_within(point, travel)?;
        if let (Some(focus), Some((axis, _))) = (&self.focus, &self.head.focus) {
            let cam = focus.inverse(mirrors, 0.0);
            if cam.is_nan() || cam.abs() > axis.travel {
                return Err(GeometryError::Travel {
                    axis: 'Z',
                    x: point.x,
                    y: point.y,
                    angle_deg: cam.to_degrees(),
                    travel_deg: axis.travel.to_degrees(),
                });
            }
        }
        Ok(())
    }

    /// Marks that are shorter than a sample at their speed, and by how much they lengthen the job, s: each takes a whole one.
    pub fn short_marks(&self, job: &ScanJob) -> (u64, f64) {
        let period = self.head.period;
        (0..job.vectors.len())
            .filter(|&i| job.vectors[i].kind.is_mark())
            .map(|i| job.length_of(i) / job.vectors[i].speed)
            .filter(|&t| t > 0.0 && t < period)
            .fold((0, 0.0), |(n, sum), t| (n + 1, sum + period - t))
    }

    /// The angle set-points (θx, θy, θz), rad, for a commanded point, mm.
    #[inline]
    pub fn angles(&self, point: DVec3) -> DVec3 {
        match &self.inverse {
            Inverse::Table(table) => {
                let angles = table.angles(point.truncate());
                match &self.focus {
                    Some(focus) if point.z != 0.0 => {
                        let mirrors = angles.truncate();
                        let moved = focus.inverse(mirrors, point.z) - focus.inverse(mirrors, 0.0);
                        angles + DVec3::Z * moved
                    }
                    _ => angles,
                }
            }
            Inverse::Exact { .. } => {
                // the job was checked: every point of it has an inverse
                let mirrors = self
                    .head
                    .geometry
                    .inverse(point.truncate())
                    .unwrap_or(DVec2::ZERO);
                let cam = self
                    .focus
                    .as_ref()
                    .map_or(0.0, |f| f.inverse(mirrors, point.z));
                mirrors.extend(cam)
            }
        }
    }

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
