//! The layers of a job that a head is at: taken when they are needed, given back when their last vector is over, so that memory
//! does not grow with the job.

use std::collections::VecDeque;
use std::sync::Arc;

use meltpath_geometry::math::DVec3;

use crate::head::error::HeadError;
use crate::head::prepared::{Layers, Prepared};
use meltpath_toolpath::Role;

/// A vector on its way: what it is, where it leads, and its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) kind: Role,
    pub(super) from: DVec3,
    pub(super) to: DVec3,
    /// Samples that it moves and then waits.
    pub(super) moving: u64,
    pub(super) waiting: u64,
}

/// The layers that a head is at.
pub struct Window<'a> {
    coming: Layers<'a>,
    held: VecDeque<Arc<Prepared>>,
    over: bool,
    failed: Option<HeadError>,
}

impl<'a> Window<'a> {
    /// Over the layers of a job.
    pub fn new(layers: Layers<'a>) -> Self {
        Window {
            coming: layers,
            held: VecDeque::new(),
            over: false,
            failed: None,
        }
    }

    /// Takes the next layer, if there is one.
    fn take(&mut self) -> bool {
        if self.over {
            return false;
        }
        match self.coming.next() {
            Some(Ok(layer)) => self.held.push_back(Arc::new(layer)),
            Some(Err(e)) => (self.over, self.failed) = (true, Some(e)),
            None => self.over = true,
        }
        !self.over
    }

    /// Why the layers came to an end before the job did.
    ///
    /// # Errors
    /// [`HeadError`] of the layer that could not be had.
    pub(super) fn sound(&mut self) -> Result<(), HeadError> {
        self.failed.take().map_or(Ok(()), Err)
    }

    /// Where the head stands at first, mm.
    pub(super) fn start(&mut self) -> DVec3 {
        if self.held.is_empty() {
            self.take();
        }
        self.held.front().map_or(DVec3::ZERO, |l| l.job.start)
    }

    /// A vector of the job, sampled every `period` s; none after the last.
    pub(super) fn step(&mut self, vector: u32, period: f64) -> Option<Step> {
        while self.held.back().is_none_or(|l| l.end() <= vector) {
            if !self.take() {
                return None;
            }
        }
        let layer = self.held.iter().find(|l| vector < l.end())?;
        let i = vector.checked_sub(layer.first)? as usize;
        let v = layer.job.vectors.get(i)?;
        let (moving, waiting) = layer.job.samples_of(i, period);
        Some(Step {
            kind: v.kind,
            from: layer.job.start_of(i),
            to: v.end,
            moving,
            waiting,
        })
    }

    /// The layers to which the vectors from `first` to `last` belong.
    pub(super) fn between(&self, first: u32, last: u32) -> Vec<Arc<Prepared>> {
        let meets = |l: &&Arc<Prepared>| l.first <= last && first < l.end();
        self.held.iter().filter(meets).map(Arc::clone).collect()
    }

    /// Gives back the layers that end before a vector.
    pub(super) fn release(&mut self, before: u32) {
        while self.held.len() > 1 && self.held[0].end() <= before {
            self.held.pop_front();
        }
    }
}
