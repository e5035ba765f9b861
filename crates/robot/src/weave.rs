//! Weaving: the tool swings about its path while it goes along.
//!
//! Controllers add the swing to the interpolated path, across the direction of travel and the tool axis. Assumptions, to be checked on
//! the controller at hand: the amplitude is reached in full at every frequency, dwells at the sides add to the period while the tool
//! goes on along the path, the swing begins towards the left, and the tool returns to its path with the speed of the swing where weaving ends.

use std::f64::consts::TAU;

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{MotionBlock, MotionSink, Weave, WeaveShape};

use crate::controller::Controller;

/// How much faster than its swing the tool may change sides, where the path turns.
const CATCH_UP: f64 = 1.05;

/// Where the swing is at a time after its beginning, in amplitudes: along the travel, and to its left.
fn swing(weave: &Weave, time: f64) -> [f64; 2] {
    let period = 1.0 / weave.frequency;
    let [left, right] = weave.dwell;
    let u = time.rem_euclid(period + left + right);
    // the time without dwells
    let moved = if u < 0.25 * period {
        u
    } else if u < 0.25 * period + left {
        0.25 * period
    } else if u < 0.75 * period + left {
        u - left
    } else if u < 0.75 * period + left + right {
        0.75 * period
    } else {
        u - left - right
    };
    let share = moved / period;
    let side = (TAU * share).sin();
    match weave.shape {
        WeaveShape::Sine => [0.0, side],
        WeaveShape::Circle => [(TAU * share).cos(), side],
        WeaveShape::Triangle => [0.0, side.asin() / (0.25 * TAU)],
    }
}

/// The share of a swing that the two moving averages of a controller leave, were it told to them as the path is: how far a controller
/// draws less than it is told where it does not make good for that.
pub fn reached(weave: &Weave, controller: &Controller) -> f64 {
    let left = |filter: f64| {
        let angle = 0.5 * TAU * weave.frequency * filter;
        if angle > 1e-9 {
            angle.sin() / angle
        } else {
            1.0
        }
    };
    (left(controller.t1.value.0) * left(controller.t2.value.0)).abs()
}

/// Adds the swing to motion on its way to another sink.
pub struct Weaving<'a> {
    weaves: &'a [Weave],
    /// The weave of each command, from 1; 0 for none.
    of_command: &'a [u32],
    sink: &'a mut dyn MotionSink,
    woven: MotionBlock,
    /// The sample before: where it was on the path, where it was woven to, and when.
    before: Option<(DVec3, DVec3, f64)>,
    travel: DVec3,
    /// Which weave is on, and for how long, s.
    on: Option<(u32, f64)>,
    /// Fastest change of the swing, mm/s.
    rate: f64,
}

impl<'a> Weaving<'a> {
    /// Weaves by `weaves`, numbered from 1, while commands are executed for which `of_command` says one; pushes into `sink`.
    pub fn new(weaves: &'a [Weave], of_command: &'a [u32], sink: &'a mut dyn MotionSink) -> Self {
        Weaving {
            weaves,
            of_command,
            sink,
            woven: MotionBlock::default(),
            before: None,
            travel: DVec3::X,
            on: None,
            rate: 0.0,
        }
    }

    fn weave(&self, number: u32) -> Option<&'a Weave> {
        self.weaves.get((number as usize).checked_sub(1)?)
    }

    /// Where sample `i` of a block is woven to.
    fn sample(&mut self, block: &MotionBlock, i: usize) -> DVec3 {
        let to = block.position[i];
        let time = block.time(i);
        let Some((from, woven, then)) = self.before else {
            return to;
        };
        let dt = block.stretch(i, Some(then));
        let moved = to - from;
        let number = block
            .command
            .get(i)
            .and_then(|c| self.of_command.get(*c as usize));
        let number = number.copied().filter(|n| self.weave(*n).is_some());
        // the swing stands still while the tool does
        let lasted = if moved.length() > 1e-9 { dt } else { 0.0 };
        self.on = number.map(|n| match self.on {
            Some((same, since)) if same == n => (n, since + lasted),
            _ => (n, lasted),
        });
        self.travel = moved.try_normalize().unwrap_or(self.travel);
        let axis = block.axis.get(i).copied().unwrap_or(DVec3::Z);
        let left = axis.cross(self.travel).normalize_or_zero();
        let weave = self.on.and_then(|(n, since)| Some((self.weave(n)?, since)));
        let wanted = weave.map_or(DVec3::ZERO, |(weave, since)| {
            self.rate = CATCH_UP * TAU * weave.frequency * weave.amplitude;
            let [along, side] = swing(weave, since);
            weave.amplitude * (along * self.travel + side * left)
        });
        let now = woven - from;
        to + now + (wanted - now).clamp_length_max(self.rate * (time - then).max(0.0))
    }
}

impl MotionSink for Weaving<'_> {
    fn block(&mut self, block: &MotionBlock) {
        let mut out = std::mem::take(&mut self.woven);
        out.clone_from(block);
        for (i, &path) in block.position.iter().enumerate() {
            let to = self.sample(block, i);
            let time = block.time(i);
            if let (Some((_, from, then)), Some(speed)) = (self.before, out.speed.get_mut(i))
                && to != path
                && time > then
            {
                *speed = from.distance(to) / (time - then);
            }
            out.position[i] = to;
            self.before = Some((path, to, time));
        }
        self.sink.block(&out);
        self.woven = out;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_toolpath::Times;

    #[derive(Default)]
    struct Kept(MotionBlock);

    impl MotionSink for Kept {
        fn block(&mut self, block: &MotionBlock) {
            assert_eq!(block.sanity_check(), Ok(()));
            self.0.position.extend(&block.position);
            self.0.wire.extend(&block.wire);
            self.0.speed.extend(&block.speed);
        }
    }

    /// With its dwells the swing comes back after each period, and goes through the middle in between.
    #[test]
    fn a_swing_repeats_after_its_period_and_its_dwells() {
        for shape in [WeaveShape::Sine, WeaveShape::Triangle] {
            let weave = Weave {
                shape,
                frequency: 2.0,
                dwell: [0.1, 0.2],
                ..sine()
            };
            let side = |time: f64| swing(&weave, time)[1];
            assert!((side(0.15) - 1.0).abs() < 1e-9 && (side(0.21) - 1.0).abs() < 1e-9);
            assert!((side(0.5) + 1.0).abs() < 1e-9 && (side(0.66) + 1.0).abs() < 1e-9);
            assert!(side(0.35).abs() < 1e-9);
            // an eighth of the period after it has left the right side
            let eighth = if shape == WeaveShape::Sine {
                0.5f64.sqrt()
            } else {
                0.5
            };
            assert!((side(0.675 + 0.0625) + eighth).abs() < 1e-9);
            for time in [0.03, 0.2, 0.4, 0.6, 0.75] {
                assert!((side(time + 0.8) - side(time)).abs() < 1e-9, "{time}");
            }
        }
    }

    /// 60 mm along x at 6 mm/s, woven from 1 s to 9 s, in blocks of 1000 samples.
    fn woven(weave: Weave) -> Vec<DVec3> {
        let mut kept = Kept::default();
        let mut weaving = Weaving::new(std::slice::from_ref(&weave), &[0, 1, 0], &mut kept);
        let at = |k: usize| DVec3::X * 0.012 * k as f64;
        for from in (0..5000).step_by(1000) {
            let samples = from..from + 1000;
            weaving.block(&MotionBlock {
                times: Times::Uniform {
                    t0: from as f64 * 0.002,
                    dt: 0.002,
                },
                position: samples.clone().map(at).collect(),
                speed: vec![6.0; 1000],
                wire: vec![0.2; 1000],
                command: samples
                    .map(|k| u32::from(k >= 500) + u32::from(k >= 4500))
                    .collect(),
                ..MotionBlock::default()
            });
        }
        assert!((kept.0.wire.iter().sum::<f64>() - 1000.0).abs() < 1e-9);
        kept.0.position
    }

    fn sine() -> Weave {
        Weave {
            shape: WeaveShape::Sine,
            frequency: 2.0,
            amplitude: 3.0,
            dwell: [0.0; 2],
        }
    }

    /// How often the tool crosses its path upwards.
    fn crossings(path: &[DVec3]) -> usize {
        path.windows(2)
            .filter(|w| w[0].y < 0.0 && w[1].y >= 0.0)
            .count()
    }

    #[test]
    fn the_tool_swings_about_its_path() {
        for shape in [WeaveShape::Sine, WeaveShape::Triangle] {
            let path = woven(Weave { shape, ..sine() });
            // x is that of the path, before and after it is woven the whole place is
            for (k, p) in path.iter().enumerate() {
                assert!((p.x - 0.012 * k as f64).abs() < 1e-9);
                assert!((500..4800).contains(&k) || p.y.abs() < 1e-9, "{k}: {p}");
            }
            let (low, high) = path
                .iter()
                .fold((0.0_f64, 0.0_f64), |(l, h), p| (l.min(p.y), h.max(p.y)));
            assert!(
                (low + 3.0).abs() < 0.05 && (high - 3.0).abs() < 0.05,
                "{low} {high}"
            );
            // 8 s at 2 Hz; the first swing begins on the path
            assert!(
                (15..=16).contains(&crossings(&path)),
                "{}",
                crossings(&path)
            );
            let first = path.iter().find(|p| p.y != 0.0).unwrap();
            assert!(first.y > 0.0);
        }
        // a sine is nowhere cut
        let path = woven(sine());
        for k in 0..4000 {
            let y = 3.0 * (TAU * 2.0 * 0.002 * (k + 1) as f64).sin();
            assert!((path[500 + k].y - y).abs() < 1e-6, "{k}");
        }
    }

    #[test]
    fn dwells_hold_the_sides() {
        let path = woven(Weave {
            dwell: [0.3, 0.1],
            ..sine()
        });
        let held =
            |side: f64| path.iter().filter(|p| (p.y - side).abs() < 1e-9).count() as f64 * 0.002;
        // 8 s of periods of 0.9 s
        assert!(
            (held(3.0) / (8.0 / 0.9 * 0.3) - 1.0).abs() < 0.15,
            "{}",
            held(3.0)
        );
        assert!(
            (held(-3.0) / (8.0 / 0.9 * 0.1) - 1.0).abs() < 0.15,
            "{}",
            held(-3.0)
        );
    }

    #[test]
    fn filters_take_the_more_of_a_swing_the_faster_it_is() {
        let arcmate = crate::controller::tests::arcmate();
        let shares = [0.5, 1.0, 2.0, 5.0].map(|frequency| {
            let weave = Weave {
                frequency,
                ..sine()
            };
            reached(&weave, &arcmate)
        });
        assert!(shares.is_sorted_by(|a, b| a > b), "{shares:?}");
        // two averages of a sine, taken as sums
        let sum = |time: f64| {
            let count = 1000;
            let at = |k: usize| (TAU * 2.0 * time * ((k as f64 + 0.5) / 1000.0 - 0.5)).cos();
            (0..count).map(at).sum::<f64>() / 1000.0
        };
        let wanted = sum(arcmate.t1.value.0) * sum(arcmate.t2.value.0);
        assert!((shares[2] - wanted).abs() < 1e-4, "{shares:?} {wanted}");
        assert!(shares[0] > 0.98 && shares[3] < 0.5);
    }

    #[test]
    fn circles_go_round_the_path() {
        let path = woven(Weave {
            shape: WeaveShape::Circle,
            ..sine()
        });
        for (k, p) in path.iter().enumerate().skip(1500).take(2900) {
            let off = *p - DVec3::X * 0.012 * k as f64;
            assert!((off.length() - 3.0).abs() < 0.05, "{k}: {off}");
        }
    }
}
