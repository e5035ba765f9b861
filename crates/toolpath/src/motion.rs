//! Motion: what the tool really does in time, pushed in blocks to several sinks, never the whole record in memory.

use meltpath_geometry::math::DVec3;

use crate::error::PathError;

/// When the samples of a block are taken.
#[derive(Debug, Clone, PartialEq)]
pub enum Times {
    /// Sample `i` at `t0 + i·dt`.
    Uniform {
        /// Time of the first sample, s.
        t0: f64,
        /// Sample period, s.
        dt: f64,
    },
    /// One time a sample, s, never decreasing. Two samples at one time are a jump.
    Each(Vec<f64>),
}

impl Default for Times {
    fn default() -> Self {
        Times::Uniform { t0: 0.0, dt: 0.0 }
    }
}

impl Times {
    /// Time of sample `i`, s.
    ///
    /// # Panics
    /// Where there is a time for each sample and `i` has none.
    #[inline]
    pub fn at(&self, i: usize) -> f64 {
        match self {
            Times::Uniform { t0, dt } => t0 + i as f64 * dt,
            Times::Each(times) => times[i],
        }
    }
}

/// A block of motion. The tool goes straight and at constant speed from one sample to the next; what a column says of a
/// stretch (speed, wire, power, spot) belongs to the sample at which the stretch ends. So 25 m of beam are two samples a
/// straight line.
///
/// Every column has one entry per sample, or none where whoever made the motion does not say.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MotionBlock {
    /// When the samples are taken.
    pub times: Times,
    /// Tool centre point, mm, part frame.
    pub position: Vec<DVec3>,
    /// Speed of the tool centre point, mm/s.
    pub speed: Vec<f64>,
    /// Unit tool axis, from the part towards the tool; empty where it stays along +Z of the part frame.
    pub axis: Vec<DVec3>,
    /// Wire fed over the stretch that ends at this sample, mm; 0 while the arc is off, empty without wire. The sum over all
    /// samples is the wire used, exactly.
    pub wire: Vec<f64>,
    /// Beam power, W, mean over the stretch that ends at this sample; empty without beam.
    pub power: Vec<f64>,
    /// Diameter of the beam's spot, mm, over the stretch that ends at this sample; empty where the machine does not say.
    pub spot: Vec<f64>,
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

    /// Time of sample `i`, s.
    ///
    /// # Panics
    /// Where there is a time for each sample and `i` has none.
    #[inline]
    pub fn time(&self, i: usize) -> f64 {
        self.times.at(i)
    }

    /// Duration of the stretch that ends at sample `i`, s, from the time `before` of the sample before it: the period where
    /// samples are uniform, to the bit; else 0 at the first sample of all.
    ///
    /// # Panics
    /// Where there is a time for each sample and `i` has none.
    #[inline]
    pub fn stretch(&self, i: usize, before: Option<f64>) -> f64 {
        match &self.times {
            Times::Uniform { dt, .. } => *dt,
            Times::Each(times) => before.map_or(0.0, |before| times[i] - before),
        }
    }

    /// Empties the columns for samples at `times`, keeping their room.
    pub fn restart(&mut self, times: Times) {
        self.times = times;
        self.position.clear();
        self.speed.clear();
        self.axis.clear();
        self.wire.clear();
        self.power.clear();
        self.spot.clear();
        self.command.clear();
    }

    /// Checks what the columns promise: one entry a sample or none, finite numbers, times in order, unit axes, no negative
    /// power, spot or period.
    ///
    /// # Errors
    /// [`PathError`], at the first sample that breaks a promise.
    pub fn sanity_check(&self) -> Result<(), PathError> {
        let n = self.len();
        let times = match &self.times {
            Times::Uniform { .. } => n,
            Times::Each(times) => times.len(),
        };
        let lengths = [
            ("times", times, false),
            ("speed", self.speed.len(), true),
            ("axis", self.axis.len(), true),
            ("wire", self.wire.len(), true),
            ("power", self.power.len(), true),
            ("spot", self.spot.len(), true),
            ("command", self.command.len(), true),
        ];
        for (column, found, optional) in lengths {
            if found != n && !(optional && found == 0) {
                return Err(PathError::Length {
                    what: column,
                    found,
                    wanted: n,
                });
            }
        }
        let bad = |what, index| Err(PathError::Value { what, index });
        match &self.times {
            Times::Uniform { t0, dt } => {
                if !(t0.is_finite() && dt.is_finite() && *dt >= 0.0) {
                    return bad("the period is no finite time", 0);
                }
            }
            Times::Each(times) => {
                if let Some(i) = times.iter().position(|t| !t.is_finite()) {
                    return bad("the time is not finite", i);
                }
                if let Some(i) = times.windows(2).position(|w| w[1] < w[0]) {
                    return bad("time runs backwards", i + 1);
                }
            }
        }
        if let Some(i) = self.position.iter().position(|p| !p.is_finite()) {
            return bad("the position is not finite", i);
        }
        if let Some(i) = self.axis.iter().position(|a| !a.is_normalized()) {
            return bad("the tool axis is no unit vector", i);
        }
        let never_negative = [
            ("the speed is no finite speed", &self.speed),
            ("the wire is not finite or negative", &self.wire),
            ("the power is not finite or negative", &self.power),
            ("the spot is not finite or negative", &self.spot),
        ];
        for (what, column) in never_negative {
            if let Some(i) = column.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
                return bad(what, i);
            }
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;

    fn beam() -> MotionBlock {
        MotionBlock {
            times: Times::Each(vec![1.0, 1.5, 1.5, 2.5]),
            position: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Y * 3.0],
            power: vec![0.0, 300.0, 0.0, 250.0],
            spot: vec![0.3; 4],
            ..MotionBlock::default()
        }
    }

    #[test]
    fn stretches_end_at_their_samples() {
        let block = beam();
        block.sanity_check().unwrap();
        let mut before = Some(0.25);
        let stretches = [0, 1, 2, 3].map(|i| block.stretch(i, before.replace(block.time(i))));
        assert_eq!(stretches, [0.75, 0.5, 0.0, 1.0]);
        assert_eq!(block.stretch(0, None), 0.0);
        let uniform = Times::Uniform { t0: 3.0, dt: 0.25 };
        let block = MotionBlock {
            times: uniform,
            ..block
        };
        assert_eq!(block.stretch(0, Some(1.0)), 0.25);
        assert_eq!(block.time(3), 3.75);
    }

    #[test]
    fn every_sink_takes_every_block() {
        let (mut a, mut b): (Vec<MotionBlock>, Vec<MotionBlock>) = Default::default();
        let mut sinks = (&mut a, (None::<Vec<MotionBlock>>, Some(&mut b)));
        sinks.block(&beam());
        sinks.block(&MotionBlock::default());
        assert_eq!(a, [beam(), MotionBlock::default()]);
        assert_eq!(a, b);
        assert!(!a[0].is_empty() && a[1].is_empty());
    }

    #[test]
    fn broken_promises_are_found() {
        let broken = |breaking: &dyn Fn(&mut MotionBlock)| {
            let mut block = beam();
            breaking(&mut block);
            block.sanity_check().unwrap_err().to_string()
        };
        let short = broken(&|b| b.power.truncate(3));
        assert!(short.contains("power") && short.contains('3'), "{short}");
        let back = broken(&|b| b.times = Times::Each(vec![1.0, 0.5, 0.5, 2.0]));
        assert!(back.contains("backwards") && back.contains('1'), "{back}");
        assert!(broken(&|b| b.times = Times::Each(vec![1.0])).contains("times"));
        assert!(broken(&|b| b.position[2].y = f64::NAN).contains("position"));
        assert!(broken(&|b| b.axis = vec![DVec3::Z * 2.0; 4]).contains("axis"));
        assert!(broken(&|b| b.power[1] = -1.0).contains("power"));
        assert!(broken(&|b| b.spot[1] = f64::INFINITY).contains("spot"));
        let dt = f64::NAN;
        assert!(broken(&|b| b.times = Times::Uniform { t0: 0.0, dt }).contains("period"));
    }
}
