//! How far an arm reaches within its limits.

use super::arm::Arm;

/// Steps of the second and third joint from limit to limit.
const STEPS: u32 = 360;

/// What the centre of the wrist can reach, mm; of an offset wrist, the fifth joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Least and greatest distance from the first axis.
    pub out: [f64; 2],
    /// Least and greatest height above the base.
    pub up: [f64; 2],
}

impl Arm {
    /// The reach of the wrist's centre, by trying the second and third joint in steps of their ranges (of which it may fall short
    /// by a ten-thousandth); the other joints at zero.
    pub fn reach(&self) -> Reach {
        let mut reach = Reach {
            out: [f64::INFINITY, 0.0],
            up: [f64::INFINITY, f64::NEG_INFINITY],
        };
        let Some([_, second, third]) = self.chain.joints.first_chunk() else {
            return reach;
        };
        let at = |low: f64, high: f64, i: u32| low + (high - low) * f64::from(i) / f64::from(STEPS);
        for i in 0..=STEPS {
            for k in 0..=STEPS {
                let j2 = at(second.limits.low, second.limits.high, i);
                let j3 = at(third.limits.low, third.limits.high, k);
                let frames = self
                    .chain
                    .frames(&self.joints([0.0, j2, j3, 0.0, 0.0, 0.0])[..5]);
                let Some(wrist) = frames.get(4).map(|f| f.position) else {
                    continue;
                };
                let out = wrist.x.hypot(wrist.y);
                reach.out = [reach.out[0].min(out), reach.out[1].max(out)];
                reach.up = [reach.up[0].min(wrist.z), reach.up[1].max(wrist.z)];
            }
        }
        reach
    }
}
