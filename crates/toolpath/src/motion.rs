//! Motion: what the tool really does in time, pushed in blocks to several sinks, never the whole record in memory.

use meltpath_geometry::math::DVec3;

/// A block of uniformly sampled motion. Sample `i` is taken at `t0 + i·dt`; every column has one entry per sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MotionBlock {
    /// Time of the first sample, s.
    pub t0: f64,
    /// Sample period, s.
    pub dt: f64,
    /// Tool centre point, mm, part frame.
    pub position: Vec<DVec3>,
    /// Speed of the tool centre point, mm/s.
    pub speed: Vec<f64>,
    /// Unit tool axis, from the part towards the tool; empty where it stays along +Z of the part frame.
    pub axis: Vec<DVec3>,
    /// Wire fed during the sample period that ends at this sample, mm; 0 while the arc is off. The sum over all samples
    /// is the wire used, exactly.
    pub wire: Vec<f64>,
    /// Beam power, W, mean over the sample period that ends at this sample; empty without beam.
    pub power: Vec<f64>,
    /// Index of the command being executed: the caller's own numbering (program line, pass…).
    pub command: Vec<u32>,
}

impl MotionBlock {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether the block has no samples.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }
}

/// Receives motion, block after block in time order.
pub trait MotionSink {
    /// Takes the next block.
    fn block(&mut self, block: &MotionBlock);
}

impl<S: MotionSink + ?Sized> MotionSink for &mut S {
    fn block(&mut self, block: &MotionBlock) {
        (**self).block(block);
    }
}

impl<S: MotionSink> MotionSink for Option<S> {
    fn block(&mut self, block: &MotionBlock) {
        if let Some(sink) = self {
            sink.block(block);
        }
    }
}

impl<A: MotionSink, B: MotionSink> MotionSink for (A, B) {
    fn block(&mut self, block: &MotionBlock) {
        self.0.block(block);
        self.1.block(block);
    }
}

impl MotionSink for Vec<MotionBlock> {
    fn block(&mut self, block: &MotionBlock) {
        self.push(block.clone());
    }
}
