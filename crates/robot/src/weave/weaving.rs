//! Weaves motion on its way to another sink.
//!
//! The direction across is the mean of what comes before and after a sample: a sample is woven when half of the two averages behind it is known.

use std::collections::VecDeque;

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{MotionBlock, MotionSink, Weave};

use super::Swing;
use super::across::{Across, Smooth};
use crate::controller::{Controller, ControllerError};

/// A tool that goes no farther in a sample stands, mm: below it directions are rounding.
const STANDS: f64 = 1e-7;

/// What is known of a sample before it is woven.
#[derive(Clone, Copy)]
struct Ahead {
    /// The direction from which the travel's left is turned.
    reference: DVec3,
    turned: f64,
    /// The weave that its command asks for, from 1; 0 for none.
    weave: u32,
}

/// A swing from its beginning until it has died away.
struct Run<'a> {
    weave: u32,
    swing: Swing<'a>,
    /// How long it swings, s.
    time: f64,
    /// The share of the swing that is drawn.
    share: Smooth,
    /// From the reference to the direction across, rad.
    turned: Smooth,
    /// How far the travel is turned at the last sample ahead that is this swing's.
    last: f64,
    /// Whether samples ahead may still be this swing's, and whether those that are woven are.
    ahead: bool,
    on: bool,
}

/// Adds the swing to motion on its way to another sink.
pub struct Weaving<'a> {
    weaves: &'a [Weave],
    /// The weave of each command, from 1; 0 for none.
    of_command: &'a [u32],
    controller: &'a Controller,
    sink: &'a mut dyn MotionSink,
    /// Lengths of the two averages, samples.
    taps: (usize, usize),
    /// The place told last.
    told: Option<DVec3>,
    across: Option<Across>,
    /// How fast swings go on: 0 where the tool stands.
    pace: Smooth,
    runs: Vec<Run<'a>>,
    /// Samples told, not yet woven.
    ahead: VecDeque<Ahead>,
    /// Blocks told, not yet passed on, and how much of the first is woven.
    waiting: VecDeque<MotionBlock>,
    woven: usize,
    /// Where the sample before was woven to, and when.
    before: Option<(DVec3, f64)>,
    /// A block to be filled again.
    spare: MotionBlock,
}

impl<'a> Weaving<'a> {
    /// Weaves by `weaves`, numbered from 1, while commands are executed for which `of_command` says one; pushes into `sink`. The motion is
    /// that of `controller`, at its own sampling. [`Weaving::finish`] passes on what is still held.
    ///
    /// # Errors
    /// [`ControllerError`] where the controller's averages are not whole numbers of samples.
    pub fn new(
        weaves: &'a [Weave],
        of_command: &'a [u32],
        controller: &'a Controller,
        sink: &'a mut dyn MotionSink,
    ) -> Result<Self, ControllerError> {
        let taps = controller.taps(controller.sampling())?;
        Ok(Weaving {
            weaves,
            of_command,
            controller,
            sink,
            taps,
            told: None,
            across: None,
            pace: Smooth::new(taps, 0.0),
            runs: Vec::new(),
            ahead: VecDeque::new(),
            waiting: VecDeque::new(),
            woven: 0,
            before: None,
            spare: MotionBlock::default(),
        })
    }

    /// Passes on the samples that are still held, as if the tool stood where it stands from now on.
    pub fn finish(mut self) {
        while !self.waiting.is_empty()
            && let Some(&last) = self.ahead.back()
        {
            self.look(Ahead { weave: 0, ..last }, false);
            self.weave_one();
        }
    }

    /// By how many samples two averages come late.
    fn delay(&self) -> usize {
        usize::midpoint(self.taps.0, self.taps.1) - 1
    }

    fn weave(&self, number: u32) -> Option<&'a Weave> {
        self.weaves.get((number as usize).checked_sub(1)?)
    }

    /// Learns where sample `i` of a block is.
    fn learn(&mut self, block: &MotionBlock, i: usize) {
        let place = block.position[i];
        let axis = block.axis.get(i).copied().unwrap_or(DVec3::Z);
        let moved = place - self.told.replace(place).unwrap_or(place);
        let moved = (moved.length() > STANDS).then_some(moved);
        let across = self.across.get_or_insert_with(|| Across::new(axis));
        across.go(axis, moved);
        let (reference, turned) = (across.reference, across.turned);
        let command = block.command.get(i);
        let number = command.and_then(|c| self.of_command.get(*c as usize));
        let number = number.copied().filter(|n| self.weave(*n).is_some());
        let sample = Ahead {
            reference,
            turned: turned.unwrap_or(0.0),
            // before the tool moves there is no side to swing to
            weave: number.filter(|_| turned.is_some()).unwrap_or(0),
        };
        self.look(sample, moved.is_some());
    }

    /// Lets the averages that look ahead take the next sample.
    fn look(&mut self, sample: Ahead, moves: bool) {
        self.pace.push(if moves { 1.0 } else { 0.0 });
        for run in &mut self.runs {
            // the way back to the path goes across the last of the bead
            run.ahead &= run.weave == sample.weave;
            if run.ahead {
                run.last = sample.turned;
            }
            run.turned.push(run.last);
        }
        self.ahead.push_back(sample);
    }

    /// Begins a swing where the sample that is woven next asks for one that is not on, and ends others.
    fn turn_on(&mut self, wanted: u32) {
        for run in &mut self.runs {
            run.on &= run.weave == wanted;
        }
        if self.runs.iter().any(|r| r.on) {
            return;
        }
        let Some(weave) = self.weave(wanted) else {
            return;
        };
        // a bead begins across its own way, whatever leads to it
        let its_own = self.ahead.iter().take_while(|a| a.weave == wanted);
        let (count, turned) = its_own.fold((0, 0.0), |(n, _), a| (n + 1, a.turned));
        self.runs.push(Run {
            weave: wanted,
            swing: Swing::new(weave, self.controller),
            time: 0.0,
            share: Smooth::new(self.taps, 0.0),
            turned: Smooth::new(self.taps, turned),
            last: turned,
            ahead: count == self.ahead.len(),
            on: true,
        });
    }

    /// How far the sample that is woven next is swung off its path, `dt` s after the one before.
    fn offset(&mut self, reference: DVec3, axis: DVec3, dt: f64) -> DVec3 {
        let lasted = self.pace.value * dt;
        let mut offset = DVec3::ZERO;
        for run in &mut self.runs {
            run.time += lasted;
            run.share.push(if run.on { 1.0 } else { 0.0 });
            let [along, side] = run.swing.at(run.time);
            let (sin, cos) = run.turned.value.sin_cos();
            let left = cos * reference + sin * axis.cross(reference);
            let drawn = run.share.value * run.swing.weave.amplitude;
            offset += drawn * (along * left.cross(axis) + side * left);
        }
        self.runs.retain(|r| r.on || r.share.value > 0.0);
        offset
    }

    /// Weaves the first sample that is not woven yet once enough is known ahead of it, and passes its block on if it is the last of it.
    fn weave_one(&mut self) {
        let Some(&Ahead { weave, .. }) = self.ahead.front() else {
            return;
        };
        if self.ahead.len() <= self.delay() {
            return;
        }
        self.turn_on(weave);
        let (Some(sample), Some(mut block)) = (self.ahead.pop_front(), self.waiting.pop_front())
        else {
            return;
        };
        let i = self.woven;
        let (path, time) = (block.position[i], block.time(i));
        let axis = block.axis.get(i).copied().unwrap_or(DVec3::Z);
        let dt = block.stretch(i, self.before.map(|b| b.1));
        let offset = self.offset(sample.reference, axis, dt);
        let to = path + offset;
        if let (Some((from, then)), Some(speed)) = (self.before, block.speed.get_mut(i))
            && to != path
            && time > then
        {
            *speed = from.distance(to) / (time - then);
        }
        block.position[i] = to;
        self.before = Some((to, time));
        self.woven += 1;
        if self.woven < block.len() {
            self.waiting.push_front(block);
        } else {
            self.woven = 0;
            self.sink.block(&block);
            self.spare = block;
        }
    }
}

impl MotionSink for Weaving<'_> {
    fn block(&mut self, block: &MotionBlock) {
        if block.is_empty() {
            return;
        }
        let mut kept = std::mem::take(&mut self.spare);
        kept.clone_from(block);
        self.waiting.push_back(kept);
        for i in 0..block.len() {
            self.learn(block, i);
            self.weave_one();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    use meltpath_base::Silent;
    use meltpath_geometry::Pose;
    use meltpath_toolpath::{Times, WeaveShape};

    use crate::controller::tests::arcmate;
    use crate::interpolation::fir::simulate;
    use crate::weave::tests::sine;
    use crate::{Command, Kind, Smoothing};

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

    /// 60 mm along x at 6 mm/s, woven from 1 s to 9 s, in blocks of 1000 samples.
    fn woven(weave: Weave) -> Vec<DVec3> {
        let mut kept = Kept::default();
        let (weaves, controller) = ([weave], arcmate());
        let mut weaving = Weaving::new(&weaves, &[0, 1, 0], &controller, &mut kept).unwrap();
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
        weaving.finish();
        assert_eq!(kept.0.position.len(), 5000);
        assert!((kept.0.wire.iter().sum::<f64>() - 1000.0).abs() < 1e-9);
        kept.0.position
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
        // a sine is drawn in full from the end of the transition on
        let path = woven(sine());
        for k in 107..4000 {
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

    fn line(id: u32, to: DVec3, smoothing: Smoothing) -> Command {
        Command::line(id, to, 12.5, smoothing)
    }

    fn weave_all(weave: Weave, commands: &[Command], of_command: &[u32]) -> Vec<DVec3> {
        let (weaves, controller) = ([weave], arcmate());
        let mut blocks: Vec<MotionBlock> = Vec::new();
        let mut weaving = Weaving::new(&weaves, of_command, &controller, &mut blocks).unwrap();
        let start = Pose::IDENTITY;
        let dt = controller.sampling();
        simulate(start, commands, &controller, dt, &Silent, &mut weaving).unwrap();
        weaving.finish();
        blocks.into_iter().flat_map(|b| b.position).collect()
    }

    /// Greatest second difference of a path over 4 ms, mm/s², of its places within a range.
    fn acceleration(path: &[DVec3], within: impl Fn(DVec3) -> bool) -> f64 {
        let seconds = path.windows(5).filter(|w| within(w[2]));
        let sizes = seconds.map(|w| (w[4] - 2.0 * w[2] + w[0]).length() / (0.004 * 0.004));
        sizes.fold(0.0, f64::max)
    }

    fn two() -> Weave {
        Weave {
            amplitude: 2.0,
            ..sine()
        }
    }

    /// A travel, a bead round a corner, a travel.
    fn round_a_corner(turn: f64, smoothing: Smoothing) -> [Command; 4] {
        let (sin, cos) = turn.sin_cos();
        let (a, b) = (DVec3::new(50.0, 30.0, 0.0), DVec3::new(110.0, 30.0, 0.0));
        let c = b + 60.0 * DVec3::new(cos, sin, 0.0);
        [
            line(0, a, Smoothing::Fine),
            line(1, b, smoothing),
            line(2, c, Smoothing::Fine),
            line(3, c + DVec3::Z * 40.0, Smoothing::Fine),
        ]
    }

    /// On a straight line a swing asks for (2 pi f)² of its amplitude. Beside that a corner asks for the way from one side to the other
    /// in the time of a transition: the swing's speed and the turn's, never a jump.
    #[test]
    fn the_swing_turns_round_corners_as_smoothly_as_the_motion() {
        let weave = two();
        let swing = (TAU * weave.frequency).powi(2) * weave.amplitude;
        let [t1, t2] = [0.132, 0.084];
        for smoothing in [Smoothing::Fine, Smoothing::Cnt(0.5), Smoothing::Cnt(1.0)] {
            for degrees in [-150.0, -90.0, 45.0, 90.0, 150.0, 179.0_f64] {
                let turn = degrees.to_radians();
                let path = weave_all(weave, &round_a_corner(turn, smoothing), &[0, 1, 1, 0]);
                let straight = acceleration(&path, |p| (65.0..95.0).contains(&p.x) && p.y < 33.0);
                assert!((straight / swing - 1.0).abs() < 0.01, "{straight} {swing}");
                // parts of the acceleration of a turning swing, and of the motion
                let (rate, change) = (turn.abs() / t1, turn.abs() / (t1 * t2));
                let speed = TAU * weave.frequency * weave.amplitude;
                let bound = swing
                    + weave.amplitude * (rate * rate + change)
                    + 2.0 * speed * rate
                    + 2.0 * 12.5 / t1;
                let most = acceleration(&path, |_| true);
                assert!(most < bound, "{smoothing:?} {degrees}: {most} {bound}");
            }
        }
    }

    /// The tool swings no farther off its path at a corner, and as wide on both legs.
    #[test]
    fn the_swing_is_as_wide_round_a_corner() {
        let commands = round_a_corner(0.5 * std::f64::consts::PI, Smoothing::Cnt(0.5));
        let path = weave_all(two(), &commands, &[0, 1, 1, 0]);
        let plain = weave_all(two(), &commands, &[0; 4]);
        assert_eq!(path.len(), plain.len());
        let off: Vec<DVec3> = path.iter().zip(&plain).map(|(w, p)| *w - *p).collect();
        assert!(off.iter().all(|o| o.length() < 2.0 + 1e-9));
        let widest = |leg: &dyn Fn(DVec3) -> bool, of: DVec3| {
            let on = off.iter().zip(&plain).filter(|(_, p)| leg(**p));
            on.map(|(o, _)| o.dot(of)).fold(0.0, f64::max)
        };
        for side in [1.0, -1.0] {
            let first = widest(
                &|p| (55.0..105.0).contains(&p.x) && p.y < 30.01,
                DVec3::Y * side,
            );
            let second = widest(
                &|p| (40.0..85.0).contains(&p.y) && p.z < 0.01,
                DVec3::X * side,
            );
            assert!(first > 1.99 && second > 1.99, "{first} {second}");
        }
        // across its own way from the first swing on, whatever way led there: the travel came from the left
        let begin = plain.iter().position(|p| p.x > 50.001).unwrap();
        let early = off[begin..begin + 250].iter();
        let [along, across] = early.fold([0.0_f64; 2], |[x, y], o| [x.max(o.x.abs()), y.max(o.y)]);
        assert!(along < 0.01 && across > 1.5, "{along} {across}");
    }

    /// Where the tool waits amid a bead the swing stands, and neither there nor at the ends it jumps.
    #[test]
    fn the_swing_stops_and_goes_on_gently() {
        for shape in [WeaveShape::Sine, WeaveShape::Circle, WeaveShape::Triangle] {
            for dwell in [[0.0; 2], [0.1, 0.2]] {
                let weave = Weave {
                    shape,
                    dwell,
                    ..two()
                };
                let mut commands = round_a_corner(0.0, Smoothing::Fine).to_vec();
                let wait = Command {
                    kind: Kind::Wait { time: 1.0 },
                    ..commands[1]
                };
                commands.insert(2, wait);
                let path = weave_all(weave, &commands, &[0, 1, 1, 1, 0]);
                let still = path
                    .windows(2)
                    .filter(|w| w[0].distance(w[1]) < 1e-7)
                    .count();
                assert!(still as f64 * 0.002 > 0.6, "{still}");
                let most = acceleration(&path, |_| true);
                let steady = acceleration(&path, |p| (65.0..95.0).contains(&p.x));
                assert!(steady < 750.0 && most < 900.0, "{steady} {most}");
            }
        }
    }

    /// Blocks of any size give the same bits, and a bead that is shorter than a transition is driven through.
    #[test]
    fn sizes_of_blocks_do_not_show() {
        let commands = round_a_corner(1.0, Smoothing::Cnt(0.5));
        let (weaves, controller) = ([two()], arcmate());
        let mut plain: Vec<MotionBlock> = Vec::new();
        let dt = controller.sampling();
        simulate(
            Pose::IDENTITY,
            &commands,
            &controller,
            dt,
            &Silent,
            &mut plain,
        )
        .unwrap();
        let samples: Vec<(DVec3, u32)> = plain
            .iter()
            .flat_map(|b| b.position.iter().copied().zip(b.command.iter().copied()))
            .collect();
        let in_blocks = |size: usize, of_command: &[u32]| {
            let mut kept = Kept::default();
            let mut weaving = Weaving::new(&weaves, of_command, &controller, &mut kept).unwrap();
            for (k, some) in samples.chunks(size).enumerate() {
                weaving.block(&MotionBlock {
                    times: Times::Uniform {
                        t0: (k * size) as f64 * dt,
                        dt,
                    },
                    position: some.iter().map(|s| s.0).collect(),
                    command: some.iter().map(|s| s.1).collect(),
                    ..MotionBlock::default()
                });
            }
            weaving.finish();
            kept.0.position
        };
        let whole = in_blocks(100_000, &[0, 1, 1, 0]);
        assert_eq!(whole.len(), samples.len());
        for size in [1, 7, 53, 54, 55, 4096] {
            assert!(in_blocks(size, &[0, 1, 1, 0]) == whole, "{size}");
        }
        let nothing = in_blocks(53, &[0; 4]);
        assert!(nothing.iter().zip(&samples).all(|(n, s)| *n == s.0));
        // fewer samples than the averages look ahead
        let mut kept = Kept::default();
        let mut weaving = Weaving::new(&weaves, &[1], &controller, &mut kept).unwrap();
        weaving.block(&MotionBlock {
            position: vec![DVec3::ZERO, DVec3::X * 0.01, DVec3::X * 0.02],
            command: vec![0; 3],
            ..MotionBlock::default()
        });
        weaving.finish();
        assert_eq!(kept.0.position.len(), 3);
    }
}
