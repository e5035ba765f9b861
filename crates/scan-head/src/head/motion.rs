//! What the head does as motion with power, ready for the thermal room.

use meltpath_toolpath::{MotionBlock, MotionSink, Times};

use crate::head::block::{HeadBlock, HeadSink};
use crate::head::power::PowerLaw;
use crate::measures::light::Light;

/// Hands on what the head does as motion with power, ready for the thermal room: the tool is the point hit, at the
/// height of its layer.
pub struct AsMotion<'a> {
    sink: &'a mut (dyn MotionSink + Send),
    block: MotionBlock,
    law: PowerLaw,
    light: Light,
}

impl<'a> AsMotion<'a> {
    /// Into `sink`.
    pub fn new(law: PowerLaw, sink: &'a mut (dyn MotionSink + Send)) -> Self {
        AsMotion {
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
            let height = block.vector(k).map_or(0.0, |(layer, _)| layer.height);
            out.position.push(hit.extend(height));
            let (power, moved) = self.light.step(self.law, block, k);
            out.speed.push(moved / block.period);
            out.power.push(power);
        }
        out.command.clone_from(&block.command.vector);
        self.sink.block(out);
    }
}
