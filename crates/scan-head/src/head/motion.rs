//! What the head does as motion with power, ready for the thermal room.

use meltpath_toolpath::{MotionBlock, MotionSink, Times};

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::power::PowerLaw;
use crate::head::vector::ScanJob;
use crate::measures::light::Light;

/// Hands on what the head does as motion with power, ready for the thermal room: the tool is the point hit, at the
/// height of its layer.
pub struct AsMotion<'a> {
    job: &'a ScanJob,
    /// The first vector of each layer, and its height, mm.
    layers: &'a [(u32, f64)],
    sink: &'a mut (dyn MotionSink + Send),
    block: MotionBlock,
    law: PowerLaw,
    light: Light,
}

impl<'a> AsMotion<'a> {
    /// Into `sink`. `layers` are the first vector of each layer and its height over the part's z = 0, mm, in order; what comes
    /// before the first lies at its height, and at 0 without any.
    pub fn new(
        job: &'a ScanJob,
        law: PowerLaw,
        layers: &'a [(u32, f64)],
        sink: &'a mut (dyn MotionSink + Send),
    ) -> Self {
        AsMotion {
            job,
            layers,
            sink,
            block: MotionBlock::default(),
            law,
            light: Light::default(),
        }
    }
}

impl HeadSink for AsMotion<'_> {
    fn block(&mut self, block: &HeadBlock) {
        let out = &mut self.block;
        out.restart(Times::Uniform {
            t0: block.command.first as f64 * block.period,
            dt: block.period,
        });
        for (k, hit) in block.hit.iter().enumerate() {
            let vector = block.command.vector[k];
            let layer = self.layers.partition_point(|&(first, _)| first <= vector);
            let height = self.layers.get(layer.saturating_sub(1));
            let at = hit.extend(height.map_or(0.0, |&(_, h)| h));
            out.position.push(at);
            let (power, moved) = self.light.step(self.law, self.job, block, k);
            out.speed.push(moved / block.period);
            out.power.push(power);
        }
        out.command.clone_from(&block.command.vector);
        self.sink.block(out);
    }
}
