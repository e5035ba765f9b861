//! The commanded path run before its time, for set-points that are shaped with what comes.
//!
//! The filters are those of [`crate::servo::preview`]; here they meet the stream of a job.

use meltpath_geometry::math::{DVec2, DVec3};

use crate::head::interpolation::{CommandBlock, Interpolator};
use crate::head::ready::ReadyHead;
use crate::head::window::Window;
use crate::servo::preview::Preview;

/// The same path once more, run before its time, with the mirrors' set-points about the present.
pub(super) struct Ahead<'a> {
    previews: &'a [Preview; 2],
    path: Interpolator,
    block: CommandBlock,
    /// Set-points from `past` samples before the present on; the present starts `future` samples before the path.
    angles: Vec<DVec2>,
    past: usize,
    pub(super) future: usize,
}

impl<'a> Ahead<'a> {
    pub(super) fn new(previews: &'a [Preview; 2], path: Interpolator, start: DVec3) -> Self {
        let past = previews
            .iter()
            .map(|p| p.taps.len().saturating_sub(p.ahead))
            .fold(1, usize::max);
        let future = previews.iter().map(|p| p.ahead).fold(0, usize::max);
        Ahead {
            previews,
            path,
            block: CommandBlock::default(),
            angles: vec![start.truncate(); past + future],
            past,
            future,
        }
    }

    /// Shapes the mirrors' set-points of the next `count` samples.
    pub(super) fn shape(
        &mut self,
        (head, window): (&ReadyHead, &mut Window<'_>),
        count: usize,
        shaped: &mut [Vec<f64>; 2],
    ) {
        while self.angles.len() < self.past + count + self.future {
            let wanted = self.past + count + self.future - self.angles.len();
            self.path.fill(window, &mut self.block, wanted);
            if self.block.position.is_empty() {
                // the path is over: it stays where it ended
                let last = self.angles.last().copied().unwrap_or_default();
                self.angles.extend(std::iter::repeat_n(last, wanted));
            }
            for &point in &self.block.position {
                self.angles.push(head.angles(point).truncate());
            }
        }
        for (axis, (preview, column)) in self.previews.iter().zip(shaped).enumerate() {
            column.resize(count, 0.0);
            for (k, out) in column.iter_mut().enumerate() {
                // the newest set-point that counts
                let newest = self.past + k + preview.ahead;
                *out = preview
                    .taps
                    .iter()
                    .enumerate()
                    .map(|(i, w)| w * self.angles[newest - i][axis])
                    .sum();
            }
        }
        self.angles.drain(..count);
    }
}
