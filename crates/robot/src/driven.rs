//! The axes of a cell along the motion that its controller really makes, corners cut and slowed down at: how fast they go there, how fast
//! they speed up, and how near they come to their limits.
//!
//! Where an axis cannot keep the pace of that motion, the same way is driven more slowly: as fast as its speed and, where it is told, its
//! acceleration let it, before and after that as its acceleration asks ([`crate::pacing`]).
//!
//! The wire's tip, the turn of the tool and the external axes are those of [`crate::interpolation::fir`]; the arm goes on from its chosen way
//! ([`crate::posture`]), the joints always the nearest continuation. Between two samples a speed or an acceleration is bounded: the mean of
//! the step, and what the differences beside it let it rise above that.

use meltpath_base::Observer;
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DMat3, DQuat, DVec3};
use meltpath_toolpath::{MotionBlock, MotionSink, Weave};

use crate::cell::{AXES, External, Values};
use crate::command::{Kind, Source};
use crate::controller::Controller;
use crate::controller::ControllerError;
use crate::interpolation::corner::dwells;
use crate::interpolation::fir::{MotionError, simulate};
use crate::interpolation::joints::{Along, Bending, JointMoves, Lacks};
use crate::interpolation::riders::{Carried, Rider, Riders};
use crate::joint_move::JointMove;
use crate::kinematics::arm::beside;
use crate::kinematics::numeric::apart;
use crate::kinematics::{Batch, Limits, Poses, Unreachable, Ways};
use crate::pacing::{Asked, Pacing, rates};
use crate::posture::{Axes, Held, Least, NotHeld, Task, Why};
use crate::weave::Weaving;

/// Every so many samples of the motion the axes are looked at.
const EVERY: usize = 2;
/// A joint that goes farther from one sample to the next has changed its way, rad.
const JUMP: f64 = 0.35;
/// Steps below this are rounding, rad or mm.
const ROUNDING: f64 = 1e-9;

meltpath_base::passes_on! {
    /// Why the axes could not be followed.
    #[derive(Clone, PartialEq)]
    pub enum DrivenError {
        /// The commands cannot be driven.
        Motion(MotionError),
        /// The controller's data are unsound.
        Controller(ControllerError),
    }
}

/// What the axes come near to on a motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Driven {
    /// Least distance of a joint from its limits, rad.
    pub limit: Option<Least>,
    /// Greatest speed while the arc burns, as a share of what the axis can do.
    pub speed: Option<Peak>,
    /// Greatest acceleration while the arc burns, as a share of what the axis can do; of axes whose greatest is known.
    pub acceleration: Option<Peak>,
    /// Axes that move while the arc burns and whose greatest acceleration nobody tells.
    pub untold: [bool; AXES],
    /// Length of the beads along which an axis would have to do more than it can, mm.
    pub beyond: f64,
    /// Where the arm could not go on from its chosen way.
    pub lost: Option<NotHeld>,
    /// The pace at which the motion is driven: slower where an axis asks for it while the arc burns.
    pub pacing: Pacing,
    /// Length of the beads along which it is slower, mm.
    pub slowed: f64,
    /// Where it is slowest against the motion's own pace; nothing where every axis keeps up.
    pub slowest: Option<Slowest>,
}

/// The greatest share of what an axis can do, and the speed of the wire's tip there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// The share, the axis, the place.
    pub most: Least,
    /// Speed of the wire's tip there at the motion's own pace, mm/s.
    pub speed: f64,
    /// The rate of the pace there: the tip's speed is so much of that.
    pub rate: f64,
    /// The sample of the motion.
    sample: usize,
}

impl Peak {
    /// At a place along the path as written, where nothing is driven.
    pub fn written(most: Least, speed: f64) -> Self {
        Peak {
            most,
            speed,
            rate: 1.0,
            sample: 0,
        }
    }
}

/// Where a motion is slowest against its own pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slowest {
    /// The rate, the axis that asks for it, the place.
    pub at: Least,
    /// Speed of the wire's tip there at the motion's own pace, mm/s.
    pub speed: f64,
}

/// Follows the axes of a held program along its motion. `joint_moves` are those whose ends are known; the arm is not followed along others.
/// `weaves` are those of the program, and which of them each command has, from 1.
///
/// # Errors
/// [`DrivenError`].
pub fn drive(
    task: &Task<'_>,
    held: &Held,
    joint_moves: &[JointMove],
    controller: &Controller,
    weaves: (&[Weave], &[u32]),
    observer: &dyn Observer,
) -> Result<Driven, DrivenError> {
    let rest = task.values.external();
    let (start, ends) = match task.axes {
        Axes::Written { start, ends } => (start, ends),
        Axes::Standing | Axes::Free => (rest, &[][..]),
    };
    let ends: Vec<DVec3> = ends.iter().map(|e| DVec3::from_array(e.0)).collect();
    let carried = Carried {
        start: DVec3::from_array(start.0),
        ends: &ends,
    };
    let dt = controller.sampling();
    let (place, orientation) = (task.start.position, task.start.orientation);
    let dwells = dwells(place, orientation, task.commands, controller);
    let riders = Riders::new(
        task.start,
        task.commands,
        &dwells,
        carried,
        (controller, dt),
    )?;
    let along = Along {
        cell: Some(task.cell),
        moves: joint_moves,
        start: task.start,
        commands: task.commands,
    };
    let bent = || JointMoves::new(along, &dwells, (controller, dt));
    let mut axes = Following::new(task, held, (riders, bent()?, dt));
    let go = |sink: &mut dyn MotionSink| -> Result<(), DrivenError> {
        let mut bending = Bending::new(bent()?, sink);
        let (start, commands) = (task.start, task.commands);
        simulate(start, commands, controller, dt, observer, &mut bending)?;
        Ok(())
    };
    if weaves.0.is_empty() {
        go(&mut axes)?;
    } else {
        let mut weaving = Weaving::new(weaves.0, weaves.1, controller, &mut axes)?;
        go(&mut weaving)?;
        weaving.finish();
    }
    axes.end_run(None);
    Ok(axes.found)
}

/// A moment: where every axis stands, as the controller shows it.
#[derive(Clone, Copy)]
struct Moment {
    axes: [f64; AXES],
    tip: DVec3,
    speed: f64,
    command: u32,
    sample: usize,
}

/// A place of the motion that the axes are to come to.
struct Place {
    tip: Pose,
    external: External,
    /// Where every axis stands on a joint move.
    alone: Option<Values>,
    command: u32,
    speed: f64,
    sample: usize,
    /// The flange in the arm's base.
    flange: Pose,
}

/// Moments, the arc burning, without one between that was not followed.
#[derive(Default)]
struct Run {
    /// The moment before, if it was followed.
    before: Option<Moment>,
    moments: Vec<Moment>,
}

/// Goes along a motion.
struct Following<'a> {
    task: &'a Task<'a>,
    riders: Riders<'a>,
    joint_moves: JointMoves<'a>,
    limits: [Option<Limits>; AXES],
    /// Joints at the begin of each run, by the command that leads there.
    begins: Vec<(Option<u32>, [f64; 6])>,
    /// Where the arm is; nothing on a joint move whose ends are not known.
    joints: Option<[f64; 6]>,
    /// The last four moments, the newest last.
    moments: Vec<Moment>,
    run: Run,
    /// From one looked at to the next, s.
    step: f64,
    count: usize,
    found: Driven,
    batch: Batch<'a>,
    /// Ways of the arm at the places of a block of samples.
    ways: Ways,
}

impl<'a> Following<'a> {
    fn new(
        task: &'a Task<'a>,
        held: &Held,
        (riders, joint_moves, dt): (Riders<'a>, JointMoves<'a>, f64),
    ) -> Self {
        let begins: Vec<_> = held.chains.iter().map(|c| (c.first, c.joints)).collect();
        Following {
            task,
            riders,
            joint_moves,
            limits: task.cell.axis_limits(),
            joints: begins.first().map(|b| b.1),
            begins,
            moments: Vec::with_capacity(5),
            run: Run::default(),
            step: EVERY as f64 * dt,
            count: 0,
            batch: Batch::of(&task.cell.arm),
            ways: Ways::default(),
            found: Driven {
                pacing: Pacing::own(dt),
                ..Driven::default()
            },
        }
    }

    /// Where the arm is looked for: at the place before, after an unknown joint move at the begin of the run that it leads to.
    fn near(&self, command: u32) -> Option<[f64; 6]> {
        self.joints.or_else(|| {
            let after = self
                .begins
                .partition_point(|(first, _)| first.is_none_or(|f| f <= command));
            self.begins.get(after.saturating_sub(1)).map(|b| b.1)
        })
    }

    /// The joints nearest to where the arm is at place `i` of a block.
    fn onward(&self, i: usize, flange: Pose, near: &[f64; 6]) -> Result<[f64; 6], Unreachable> {
        if !self.batch.is_side_by_side() || self.ways.is_alone(i) {
            return self.task.cell.arm.onward(flange, near);
        }
        let ways = self.ways.of(i)?.map(|way| beside(way.angles, near));
        let ways = ways.map(|joints| (apart(&joints, near), joints));
        let nearest = ways.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|n| n.1).ok_or(Unreachable::AtBorder)
    }

    /// Goes on to place `i` of a block.
    fn place(&mut self, i: usize, place: &Place) {
        let Place {
            tip,
            external,
            alone,
            command,
            speed,
            sample,
            flange,
        } = *place;
        let of = self.task.commands.get(command as usize);
        let joint = of.is_some_and(|c| matches!(c.kind, Kind::Joint(_)));
        if joint && self.joint_moves.known(command).is_none() {
            self.end_run(None);
            self.joints = None;
            self.moments.clear();
            return;
        }
        let cell = self.task.cell;
        let Some(near) = self.near(command) else {
            self.end_run(None);
            return;
        };
        let joints = if let Some(values) = alone {
            values.arm
        } else {
            match self.onward(i, flange, &near) {
                Ok(joints) => joints,
                Err(why) => return self.lose(tip, command, Why::Unreachable(why)),
            }
        };
        let jumped = (0..6).any(|i| (joints[i] - near[i]).abs() > JUMP);
        if jumped && !self.moments.is_empty() {
            return self.lose(tip, command, Why::Change);
        }
        self.joints = Some(joints);
        let axes = cell.shown(&Values::of(joints, external));
        let moment = Moment {
            axes,
            tip: tip.position,
            speed,
            command,
            sample,
        };
        self.go_on(moment);
        self.moments.push(moment);
        if self.moments.len() > 4 {
            self.moments.remove(0);
        }
        self.near_limits(cell.arm.margin(joints), alone.is_some());
        self.judge();
    }

    /// The arm cannot go on: it is taken up again at the next place.
    fn lose(&mut self, tip: Pose, command: u32, why: Why) {
        self.found.lost.get_or_insert(NotHeld {
            command,
            position: tip.position,
            why,
        });
        self.end_run(None);
        self.moments.clear();
    }

    fn burns(&self, moment: &Moment) -> bool {
        let command = self.task.commands.get(moment.command as usize);
        command.is_some_and(|c| matches!(c.source, Source::On { .. }))
    }

    /// Goes on along a bead, to its begin, or from its end.
    fn go_on(&mut self, moment: Moment) {
        if !self.burns(&moment) {
            return self.end_run(Some(moment));
        }
        if self.run.moments.is_empty() {
            self.run.before = self.moments.last().copied();
        }
        self.run.moments.push(moment);
    }

    /// Paces the bead that ended before the moment `after`, if that was followed.
    fn end_run(&mut self, after: Option<Moment>) {
        let run = std::mem::take(&mut self.run);
        let Some(first) = run.moments.first() else {
            return;
        };
        let all = run.before.iter().chain(&run.moments).chain(&after);
        let rows: Vec<[f64; AXES]> = all.map(|m| m.axes).collect();
        let begin = usize::from(run.before.is_some());
        let asked = Asked {
            rows: &rows,
            step: self.step,
            beside: [begin, usize::from(after.is_some())],
            limits: &self.limits,
        };
        let squares = rates(&asked);
        self.found.pacing.add(first.sample, EVERY, &squares);
        for peak in [&mut self.found.speed, &mut self.found.acceleration] {
            if let Some(peak) = peak
                && let Some(row) = peak.sample.checked_sub(first.sample)
                && let Some(x) = squares.get(row / EVERY)
            {
                peak.rate = x.sqrt();
            }
        }
        for (row, (moment, x)) in run.moments.iter().zip(&squares).enumerate() {
            if *x >= 1.0 {
                continue;
            }
            if let Some(next) = run.moments.get(row + 1) {
                self.found.slowed += moment.tip.distance(next.tip);
            }
            if self.found.slowest.is_none_or(|s| x.sqrt() < s.at.value) {
                let allows = |axis: usize| {
                    let [speed, acceleration] = asked.allowed(begin + row, axis);
                    speed.min(acceleration)
                };
                let axis = (0..AXES).min_by(|a, b| allows(*a).total_cmp(&allows(*b)));
                self.found.slowest = Some(Slowest {
                    at: moment.place(x.sqrt(), axis.unwrap_or(0)),
                    speed: moment.speed,
                });
            }
        }
    }

    /// Looks at the way to the newest moment, whose joints keep `margin` rad from their limits. Of a joint move `alone` the averages lie
    /// between its ends: it is nowhere nearer to a limit than there.
    fn near_limits(&mut self, (margin, joint): (f64, usize), alone: bool) {
        let Some(here) = self.moments.last() else {
            return;
        };
        // a parabola leaves its chord by an eighth of its second difference: twice that
        let bend = match &self.moments[..] {
            [.., a, b, c] if !alone => {
                let second = (0..6).map(|i| (c.axes[i] - 2.0 * b.axes[i] + a.axes[i]).abs());
                second.fold(0.0, f64::max)
            }
            _ => 0.0,
        };
        let least = here.place(margin - 0.25 * bend, joint);
        if self.found.limit.is_none_or(|l| least.value < l.value) {
            self.found.limit = Some(least);
        }
    }

    /// Looks at the step between the last two moments but one.
    fn judge(&mut self) {
        let [.., first, a, b, last] = self.moments[..] else {
            return;
        };
        if !(self.burns(&a) && self.burns(&b)) {
            return;
        }
        let mut greatest = 0.0_f64;
        for axis in 0..AXES {
            let Some(limits) = self.limits[axis] else {
                continue;
            };
            let [before, gone, after] =
                [(first, a), (a, b), (b, last)].map(|(from, to)| to.axes[axis] - from.axes[axis]);
            if gone.abs() < ROUNDING && before.abs() < ROUNDING {
                continue;
            }
            let square = self.step * self.step;
            let [from, to] = [(gone - before) / square, (after - gone) / square];
            // accelerations that rise evenly to a kink pass what the differences show by less than a quarter of their own
            let most = from.abs().max(to.abs()) + 0.25 * (to - from).abs();
            if let Some(limit) = limits.speed {
                let fastest = gone.abs() / self.step + 0.5 * self.step * most;
                greatest = greatest.max(fastest / limit);
                take(&mut self.found.speed, b.place(fastest / limit, axis), &b);
            }
            match limits.acceleration {
                Some(limit) => {
                    greatest = greatest.max(most / limit);
                    take(
                        &mut self.found.acceleration,
                        b.place(most / limit, axis),
                        &b,
                    );
                }
                None => self.found.untold[axis] = true,
            }
        }
        if greatest > 1.0 {
            self.found.beyond += a.tip.distance(b.tip);
        }
    }
}

impl Moment {
    fn place(&self, value: f64, joint: usize) -> Least {
        Least {
            value,
            joint,
            command: self.command,
            position: self.tip,
        }
    }
}

/// Keeps the greater.
fn take(kept: &mut Option<Peak>, most: Least, at: &Moment) {
    if kept.is_none_or(|k| most.value > k.most.value) {
        *kept = Some(Peak {
            sample: at.sample,
            ..Peak::written(most, at.speed)
        });
    }
}

/// The tool's frame, whose axis is known, with its x axis as near to `across` as may be.
fn frame(axis: DVec3, across: DVec3) -> DQuat {
    let across = across.reject_from(axis).try_normalize();
    let x = across.unwrap_or_else(|| axis.any_orthonormal_vector());
    DQuat::from_mat3(&DMat3::from_cols(x, x.cross(axis), -axis))
}

impl MotionSink for Following<'_> {
    fn block(&mut self, block: &MotionBlock) {
        let task = self.task;
        let mut places = Vec::with_capacity(block.position.len().div_ceil(EVERY));
        for (i, &position) in block.position.iter().enumerate() {
            let Rider { across, carried } = self.riders.next_sample();
            let lacks = self.joint_moves.next_sample();
            self.count += 1;
            if !(self.count - 1).is_multiple_of(EVERY) {
                continue;
            }
            let axis = block.axis.get(i).copied().unwrap_or(DVec3::Z);
            let tip = Pose {
                position,
                orientation: frame(axis, across + lacks.map_or(DVec3::ZERO, |l| l.across)),
            };
            let external = External(carried.to_array());
            let values = Values::of(task.values.arm, external);
            places.push(Place {
                tip,
                external,
                alone: lacks.and_then(|lacks: Lacks| lacks.alone),
                command: block.command.get(i).copied().unwrap_or(0),
                speed: block.speed.get(i).copied().unwrap_or(0.0),
                sample: self.count - 1,
                flange: task.cell.base_from_flange(tip, &values),
            });
        }
        if self.batch.is_side_by_side() {
            let flanges: Poses = places.iter().map(|place| place.flange).collect();
            self.batch.inverse(&flanges, &mut self.ways);
        }
        for (i, place) in places.iter().enumerate() {
            self.place(i, place);
        }
    }
}
