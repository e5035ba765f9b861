//! When the places of a motion are really passed, where axes cannot keep its pace: the same way, later.
//!
//! A pace has a rate at each sample of the motion: how much of the motion's own time passes in a second, 1 where every axis keeps up. Wire goes on
//! being fed by the second, so that more of it comes to lie where the rate is low.

mod limits;

use meltpath_toolpath::{MotionBlock, MotionSink, Times};

use crate::command::Command;
use crate::summary::Summary;

pub use limits::{Asked, rates};

/// Rates nearer to 1 than this are 1.
const FULL: f64 = 1e-9;

/// The pace at which a motion is really driven.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pacing {
    /// Between samples of the motion, s.
    dt: f64,
    /// Where it is slower, in order.
    slow: Vec<Slow>,
    /// At the end of all, s.
    delay: f64,
}

/// Samples that come later than those before them would have it.
#[derive(Debug, Clone, PartialEq)]
struct Slow {
    /// The first sample; it comes as late as those before.
    first: usize,
    /// How late each sample is, s.
    delay: Vec<f64>,
    /// The rate at each.
    rate: Vec<f64>,
}

impl Slow {
    fn end(&self) -> usize {
        self.first + self.delay.len()
    }
}

impl Pacing {
    /// The own pace of any motion.
    pub const OWN: Pacing = Pacing {
        dt: 0.0,
        slow: Vec::new(),
        delay: 0.0,
    };

    /// The motion's own pace, its samples `dt` s apart.
    pub(crate) fn own(dt: f64) -> Self {
        Pacing { dt, ..Pacing::OWN }
    }

    /// Adds squares of rates, one every `every` samples from `first` on, which lies after all that was added before. Between two of them the
    /// square changes evenly: the rate changes evenly in time.
    pub(crate) fn add(&mut self, first: usize, every: usize, squares: &[f64]) {
        let slower = |x: &f64| *x < 1.0 - FULL;
        let (Some(from), Some(to)) = (
            squares.iter().position(slower),
            squares.iter().rposition(slower),
        ) else {
            return;
        };
        let (from, to) = (from.saturating_sub(1), (to + 1).min(squares.len() - 1));
        let part = &squares[from..=to];
        let room = (part.len() - 1) * every + 1;
        let mut slow = Slow {
            first: first + from * every,
            delay: Vec::with_capacity(room),
            rate: Vec::with_capacity(room),
        };
        let mut rate = part[0].sqrt();
        slow.delay.push(self.delay);
        slow.rate.push(rate);
        for pair in part.windows(2) {
            for k in 1..=every {
                let share = k as f64 / every as f64;
                let next = (pair[0] + (pair[1] - pair[0]) * share).sqrt();
                self.delay += self.dt * (2.0 / (rate + next) - 1.0);
                rate = next;
                slow.delay.push(self.delay);
                slow.rate.push(rate);
            }
        }
        self.slow.push(slow);
    }

    /// Whether the motion keeps its own pace all along.
    pub fn is_own(&self) -> bool {
        self.slow.is_empty()
    }

    /// How much longer everything takes, s.
    pub fn delay(&self) -> f64 {
        self.delay
    }

    /// The stretch of slow samples that holds sample `n`, or ends before it.
    fn near(&self, n: usize) -> Option<&Slow> {
        let after = self.slow.partition_point(|s| s.first <= n);
        self.slow.get(after.checked_sub(1)?)
    }

    /// How late a sample is, s.
    fn late(&self, n: usize) -> f64 {
        self.near(n).map_or(0.0, |slow| {
            let at = slow.delay.get(n - slow.first);
            at.or(slow.delay.last()).copied().unwrap_or(0.0)
        })
    }

    /// The rate at a sample.
    fn rate(&self, n: usize) -> f64 {
        let at = self.near(n).and_then(|s| s.rate.get(n - s.first));
        at.copied().unwrap_or(1.0)
    }

    /// When the place is really passed at which the motion is at its own time `time`, s.
    pub fn at(&self, time: f64) -> f64 {
        if self.slow.is_empty() {
            return time;
        }
        let n = (time / self.dt).max(0.0);
        let (before, share) = (n.floor() as usize, n.fract());
        let (a, b) = (self.late(before), self.late(before + 1));
        time + a + (b - a) * share
    }

    /// A summary of the motion at this pace; `commands` are those it was made of.
    #[must_use]
    pub fn summary(&self, own: Summary, commands: &[Command]) -> Summary {
        if self.is_own() {
            return own;
        }
        let mut paced = Summary {
            samples: own.samples,
            ..Summary::default()
        };
        for (mut record, command) in own.commands.into_iter().zip(commands) {
            record.passage_speed *= self.rate((record.end / self.dt).round() as usize);
            (record.start, record.end) = (self.at(record.start), self.at(record.end));
            paced.spend(command, record.end - record.start);
            paced.total_time = record.end;
            paced.commands.push(record);
        }
        paced
    }

    /// A sink that passes on what comes at the motion's own pace as it is driven.
    pub fn before<S: MotionSink>(&self, sink: S) -> Paced<'_, S> {
        Paced {
            pacing: self,
            sample: 0,
            sink,
            block: MotionBlock::default(),
        }
    }
}

/// Passes motion on at the pace at which it is driven.
pub struct Paced<'a, S> {
    pacing: &'a Pacing,
    sample: usize,
    sink: S,
    block: MotionBlock,
}

impl<S: MotionSink> MotionSink for Paced<'_, S> {
    fn block(&mut self, block: &MotionBlock) {
        let first = self.sample;
        let end = first + block.len();
        self.sample = end;
        let pacing = self.pacing;
        let begun = pacing.slow.partition_point(|s| s.end() <= first);
        let slows = pacing.slow.get(begun).is_some_and(|s| s.first < end);
        let late = pacing.late(first);
        if late == 0.0 && !slows {
            return self.sink.block(block);
        }
        self.block.clone_from(block);
        self.block.times = if let (Times::Uniform { t0, dt }, false) = (&block.times, slows) {
            Times::Uniform {
                t0: t0 + late,
                dt: *dt,
            }
        } else {
            let late = |i: usize| block.time(i) + pacing.late(first + i);
            Times::Each((0..block.len()).map(late).collect())
        };
        if slows {
            for i in 0..block.len() {
                let n = first + i;
                if let Some(speed) = self.block.speed.get_mut(i) {
                    *speed *= pacing.rate(n);
                }
                if let (Some(wire), Some(before)) = (self.block.wire.get_mut(i), n.checked_sub(1)) {
                    *wire *= 1.0 + (pacing.late(n) - pacing.late(before)) / pacing.dt;
                }
            }
        }
        self.sink.block(&self.block);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Smoothing, Source};
    use crate::summary::CommandRecord;
    use meltpath_geometry::math::DVec3;

    /// Half the pace on samples 10 to 20 of motion 0.1 s apart, in two changes.
    fn half() -> Pacing {
        let mut pacing = Pacing::own(0.1);
        let squares: Vec<f64> = (0..=10)
            .map(|i| if (4..=8).contains(&i) { 0.25 } else { 1.0 })
            .collect();
        pacing.add(2, 2, &squares);
        pacing
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }

    #[test]
    fn times_are_those_of_rates_that_change_evenly_in_time() {
        let pacing = half();
        // from 1 to 1/2 over 0.2 s of the motion: 0.2 / 0.75 s; along at a half 0.8 s of it
        let change = 0.2 / 0.75;
        close(pacing.at(0.7), 0.7);
        close(pacing.at(1.0), 0.8 + change);
        close(pacing.at(1.8), 0.8 + change + 1.6);
        close(pacing.at(1.45), 0.8 + change + 0.9);
        close(pacing.at(3.0), 3.0 + pacing.delay());
        close(pacing.delay(), 2.0 * (change - 0.2) + 0.8);
        assert!(!pacing.is_own() && Pacing::own(0.1).is_own());
        close(Pacing::OWN.at(1.0), 1.0);
    }

    #[test]
    fn a_pace_that_is_full_is_own() {
        let mut pacing = Pacing::own(0.1);
        pacing.add(4, 2, &[1.0, 1.0 - 1e-12, 1.0]);
        pacing.add(12, 2, &[]);
        assert!(pacing.is_own() && pacing.delay() == 0.0);
    }

    /// Blocks of any length give the same motion: times that grow, places that stay, wire by the second.
    #[test]
    fn a_motion_is_driven_at_its_pace() {
        let pacing = half();
        let driven = |length: usize| {
            let mut blocks: Vec<MotionBlock> = Vec::new();
            let mut paced = pacing.before(&mut blocks);
            for from in (0..40).step_by(length) {
                let n = length.min(40 - from);
                paced.block(&MotionBlock {
                    times: Times::Uniform {
                        t0: 0.1 * from as f64,
                        dt: 0.1,
                    },
                    position: (from..from + n).map(|i| DVec3::X * i as f64).collect(),
                    speed: vec![10.0; n],
                    wire: vec![0.3; n],
                    command: vec![0; n],
                    ..MotionBlock::default()
                });
            }
            assert!(blocks.iter().all(|b| b.sanity_check().is_ok()));
            let rows = blocks.iter().flat_map(|b| {
                (0..b.len()).map(|i| (b.time(i), b.position[i], b.speed[i], b.wire[i]))
            });
            rows.collect::<Vec<_>>()
        };
        let whole = driven(40);
        for (length, kept) in [(7, 40), (1, 40)] {
            let rows = driven(length);
            assert_eq!(rows.len(), kept);
            for (a, b) in rows.iter().zip(&whole) {
                close(a.0, b.0);
                assert_eq!((a.1, a.2, a.3), (b.1, b.2, b.3));
            }
        }
        for (n, row) in whole.iter().enumerate() {
            close(row.0, pacing.at(0.1 * n as f64));
            assert_eq!(row.1, DVec3::X * n as f64);
        }
        close(whole[15].2, 5.0);
        close(whole[15].3, 0.6);
        for pair in whole.windows(2) {
            close(pair[1].3, 3.0 * (pair[1].0 - pair[0].0));
        }
    }

    #[test]
    fn a_summary_is_that_of_the_pace() {
        let pacing = half();
        let command = |id: u32, source| Command {
            source,
            ..Command::line(id, DVec3::X, 10.0, Smoothing::Fine)
        };
        let commands = [
            command(0, Source::Off),
            command(1, Source::On { wire_feed: 3.0 }),
        ];
        let record = |id: u32, start: f64, end: f64| CommandRecord {
            id,
            start,
            end,
            passage_speed: 10.0,
            deviation: 0.5,
        };
        let mut own = Summary {
            samples: 40,
            commands: vec![record(0, 0.0, 1.2), record(1, 1.2, 3.0)],
            ..Summary::default()
        };
        own.spend(&commands[0], 1.2);
        own.spend(&commands[1], 1.8);
        own.total_time = 3.0;
        let paced = pacing.summary(own.clone(), &commands);
        close(paced.total_time, 3.0 + pacing.delay());
        close(paced.travel_time, pacing.at(1.2));
        close(paced.arc_time, pacing.at(3.0) - pacing.at(1.2));
        close(paced.wire, 3.0 * paced.arc_time);
        close(paced.commands[0].passage_speed, 5.0);
        close(paced.commands[1].passage_speed, 10.0);
        assert_eq!((paced.samples, paced.commands[1].deviation), (40, 0.5));
        assert_eq!(Pacing::own(0.1).summary(own.clone(), &commands), own);
    }
}
