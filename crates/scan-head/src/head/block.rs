//! What a head did during one block of samples, and who receives it.

use std::sync::Arc;

use crate::axis::chain::AxisRecord;
use crate::head::interpolation::CommandBlock;
use crate::head::prepared::Prepared;
use meltpath_geometry::math::DVec2;

/// What the head did during one block of samples.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeadBlock {
    /// Sample period, s.
    pub period: f64,
    /// The command: points, vectors, whether it moves.
    pub command: CommandBlock,
    /// The layers to which its vectors belong.
    pub layers: Vec<Arc<Prepared>>,
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

    /// The layer of sample `k`, and the number of its vector in that layer.
    #[inline]
    pub fn vector(&self, k: usize) -> Option<(&Prepared, usize)> {
        let vector = *self.command.vector.get(k)?;
        let layer = self.layers.partition_point(|l| l.end() <= vector);
        let layer = self.layers.get(layer)?;
        Some((layer, vector.checked_sub(layer.first)? as usize))
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
