//! What moves do: where they go, how fast, how they end, with which arc.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;

use super::beside::{Beside, Place, turning};
use super::circles::no_way;
use super::effect::{
    called_on_the_way, coordinated, first_word, joints_at, leaves_beads, moves_target, switches_arc,
};
use super::path::Came;
use super::{
    Executed, ExecutedKind, ExecutedMotion, ExecutedSpeed, Lacking, Machine, Missing, NoPose,
    ProgramError, Refusal,
};
use crate::fanuc_ls::{lacking, lacks_config, other_unit};
use crate::orientation::pose;
use crate::positioner::turned_back;
use crate::program::{
    Coordinates, Dialect, Group, MotionInstruction, MotionKind, PositionRef, Speed, SpeedUnit,
    Termination,
};

/// Slowest and fastest speed along a path that a robot has, mm/s.
const SPEEDS: std::ops::RangeInclusive<f64> = 1e-2..=1e5;
/// Shortest and longest time of a move, s.
const TIMES: std::ops::RangeInclusive<f64> = 1e-3..=86_400.0;
/// Farthest coordinate that is taken for a place, mm.
const FARTHEST: f64 = 1e6;

impl Machine<'_> {
    /// Where a position lies in the selected frames; what is missing where it is not known here.
    fn place(&mut self, reference: &PositionRef) -> Result<Result<Place, Missing>, ProgramError> {
        let index = match reference {
            PositionRef::Point { index, .. } => *index,
            PositionRef::Unresolved(text) => {
                if let Some(index) = self.indirect(text) {
                    index
                } else {
                    return self.register_place(text);
                }
            }
        };
        let Some(position) = self.tables[self.at.0].get(&index).copied() else {
            return Err(self.refuse(Refusal::NoPosition(index)));
        };
        let (settings, program) = (self.settings, &self.programs[self.at.0]);
        let beside = Beside::of(settings, program, position);
        for group in &beside.unknown {
            self.gap(Missing::Positioner(*group));
        }
        let lines = turning(settings, program).and_then(|t| t.lines.as_ref());
        let lines = lines.filter(|_| program.dialect.tells_stations_apart());
        let found = match position.robot().map(|group| (group, &group.coordinates)) {
            Some((
                group,
                Coordinates::Cartesian {
                    xyz, wpr_degrees, ..
                },
            )) => {
                self.taught_in(index, group)?;
                let mut pose = pose(DVec3::from_array(*xyz), *wpr_degrees);
                if let Some(lines) = lines {
                    match &beside.angles {
                        Some(angles) => pose = turned_back(lines, angles, pose),
                        None => self.gap(Missing::Coordinated),
                    }
                }
                Ok((pose, false))
            }
            Some((_, Coordinates::Joint(_))) => {
                let known = settings.by_joints.get(&(self.at.0, index));
                let pose = known.copied().unwrap_or(Err(NoPose::NoRobot));
                pose.map(|pose| (pose, true))
            }
            Some((_, Coordinates::Unread(text))) if other_unit(text) => Err(NoPose::Unit),
            Some((_, Coordinates::Unread(text))) if lacks_config(text) => Err(NoPose::NoConfig),
            Some((_, Coordinates::Unread(text))) => Err(match lacking(text) {
                Some(which) => NoPose::Lacks(Lacking(which)),
                None => NoPose::Untaught,
            }),
            None => Err(NoPose::Untaught),
        };
        let (pose, by_joints) = match found {
            Ok(found) => found,
            Err(why) => {
                let name = program.name_of(index);
                return Ok(Err(Missing::JointPosition(name, why)));
            }
        };
        if pose.position.abs().max_element() > FARTHEST {
            return Err(self.refuse(Refusal::Far(index)));
        }
        Ok(Ok(Place {
            pose,
            own: beside.own,
            slides: beside.slides,
            further: beside.further,
            turns: beside.carried || beside.angles.is_some(),
            by_joints,
            tells_axes: true,
        }))
    }

    /// The frames in which places are told that lie in these, and the places in them. By joints they are told so already.
    fn told_in<'p>(
        &self,
        frames: (u32, u32),
        places: impl Iterator<Item = &'p mut Place>,
    ) -> (u32, u32) {
        let told_in = &self.programs[self.at.0].said_frames.told_in;
        let Some((number, from)) = told_in.get(&frames.0) else {
            return frames;
        };
        for place in places.filter(|place| !place.by_joints) {
            place.pose = from.then(place.pose);
        }
        (*number, frames.1)
    }

    /// Tells a bead in other frames than the first one's.
    fn look_at_frames(&mut self, frames: (u32, u32)) {
        let now = (self.at.0, frames);
        if self.bead_frames.as_ref().is_some_and(|(_, at)| *at == now) {
            return;
        }
        let names = self.programs[now.0].frame_names(frames);
        let (first, at) = self
            .bead_frames
            .get_or_insert_with(|| (names.clone(), now))
            .clone();
        if first != names && !(first[1] == names[1] && self.lie_known([at, now])) {
            let [frame, tool] = names;
            self.gap(Missing::Frames(frame, tool));
        }
    }

    /// Selects the frames that a position was taught in, or refuses it where others are selected.
    fn taught_in(&mut self, index: u32, group: &Group) -> Result<(), ProgramError> {
        let program = &self.programs[self.at.0];
        if program.dialect.moves_name_frames() {
            self.frames = (group.frame.or(self.frames.0), group.tool.or(self.frames.1));
            return Ok(());
        }
        // a controller moves to a position only in the frames it was taught in: they are selected where no line tells
        let name = program.name_of(index);
        self.in_frames(&name, (group.frame, group.tool))
    }

    /// Selects the frames that a position is told in where no line did, or refuses it where others are selected.
    pub(super) fn in_frames(
        &mut self,
        name: &str,
        (frame, tool): (Option<u32>, Option<u32>),
    ) -> Result<(), ProgramError> {
        self.frames.0 = self.frames.0.or(frame);
        self.frames.1 = self.frames.1.or(tool);
        let pairs = [
            ("user frame", frame, self.frames.0),
            ("tool frame", tool, self.frames.1),
        ];
        for (what, taught, selected) in pairs {
            if let (Some(taught), Some(selected)) = (taught, selected)
                && taught != selected
            {
                return Err(self.refuse(Refusal::OtherFrame {
                    name: name.to_owned(),
                    what,
                    taught,
                    selected,
                }));
            }
        }
        Ok(())
    }

    fn no_frames(&self) -> ProgramError {
        let (frame, tool) = match self.programs[self.at.0].dialect {
            Dialect::Krl => ("$BASE=BASE_DATA[n]", "$TOOL=TOOL_DATA[n]"),
            _ => ("UFRAME_NUM", "UTOOL_NUM"),
        };
        let missing = if self.frames.0.is_none() { frame } else { tool };
        self.refuse(Refusal::NoFrame(missing))
    }

    /// The position that `P[R[2]]` means.
    fn indirect(&self, text: &str) -> Option<u32> {
        let rest = text.strip_prefix(['P', 'p'])?;
        let (inner, _) = crate::scan::bracket(rest)?;
        self.memory.index(inner.split(':').next()?)
    }

    /// The speed of a move; an assumed one, told, where it is not known.
    fn speed(&mut self, motion: &MotionInstruction) -> Result<ExecutedSpeed, ProgramError> {
        let (value, unit) = match &motion.speed {
            Speed::Value { value, unit } => (*value, *unit),
            Speed::Register { number, unit } => match self.memory.registers.get(number) {
                Some(value) => (*value, *unit),
                None => return Ok(self.assumed_speed(motion, format!("R[{number}]"))),
            },
            Speed::Weld => {
                return Ok(
                    match self.arc.as_ref().and_then(|(_, source)| source.speed) {
                        Some(speed) => ExecutedSpeed::Path(speed),
                        None => self.assumed_speed(motion, "WELD_SPEED".to_owned()),
                    },
                );
            }
            Speed::Other(words) => return Ok(self.assumed_speed(motion, words.clone())),
            Speed::Maximum => {
                return match motion.kind {
                    MotionKind::Joint => Ok(ExecutedSpeed::Joint(1.0)),
                    _ => Err(self.refuse(Refusal::Speed)),
                };
            }
        };
        if !(value > 0.0 && value.is_finite()) {
            return Err(self.refuse(Refusal::Speed));
        }
        let path = |speed: f64| {
            let driven = SPEEDS
                .contains(&speed)
                .then_some(ExecutedSpeed::Path(speed));
            driven.ok_or_else(|| self.refuse(Refusal::Speed))
        };
        let timed = |time: f64| {
            let driven = TIMES
                .contains(&time)
                .then_some(ExecutedSpeed::Duration(time));
            driven.ok_or_else(|| self.refuse(Refusal::Speed))
        };
        match (unit, &motion.kind) {
            (SpeedUnit::Second, _) => timed(value),
            (SpeedUnit::Millisecond, _) => timed(value * 1e-3),
            (SpeedUnit::Percent, MotionKind::Joint) if value <= 100.0 => {
                Ok(ExecutedSpeed::Joint(value / 100.0))
            }
            (SpeedUnit::Percent, _) => Err(self.refuse(Refusal::Speed)),
            // ABB gives joint moves the speed of the tool
            (_, MotionKind::Joint) if self.programs[self.at.0].dialect != Dialect::Rapid => {
                Err(self.refuse(Refusal::Speed))
            }
            (SpeedUnit::DegreePerSecond, _) => Ok(ExecutedSpeed::Rotation(value.to_radians())),
            (SpeedUnit::MillimetrePerSecond, _) => path(value),
            (SpeedUnit::CentimetrePerMinute, _) => path(value * 10.0 / 60.0),
            (SpeedUnit::InchPerMinute, _) => path(value * 25.4 / 60.0),
        }
    }

    /// What stands for a speed that is not known: a bead's is a gap, a travel's a note.
    fn assumed_speed(&mut self, motion: &MotionInstruction, speed: String) -> ExecutedSpeed {
        if self.arc.is_some() {
            self.gap(Missing::Speed(speed));
        } else {
            self.note("travel-speed", speed);
        }
        match motion.kind {
            MotionKind::Joint => ExecutedSpeed::Joint(1.0),
            _ => ExecutedSpeed::Path(self.settings.assumed_speed),
        }
    }

    /// How a move ends; as smooth as can be, told, where it is not known.
    fn smoothing(&mut self, motion: &MotionInstruction) -> Option<f64> {
        let share = match &motion.termination {
            Termination::Fine => return None,
            Termination::Cnt(share) => f64::from(*share),
            Termination::CntRegister(n) => {
                if let Some(share) = self.memory.registers.get(n) {
                    *share
                } else {
                    self.gap(Missing::Termination(format!("CNT R[{n}]")));
                    100.0
                }
            }
            Termination::Blend(distance) => match self.settings.blend {
                Some(full) if full > 0.0 => {
                    self.round_off(*distance, full);
                    100.0 * distance / full
                }
                _ => {
                    self.gap(Missing::Blend);
                    100.0
                }
            },
            Termination::Other(word) => {
                if self.arc.is_some() {
                    self.gap(Missing::Termination(word.clone()));
                } else {
                    self.note("travel-smoothing", word.clone());
                }
                100.0
            }
        };
        Some((share / 100.0).clamp(0.0, 1.0))
    }

    /// Tells what the further words of a move do, and by how much they shift its target, mm; `None` where that is not known.
    fn further_words(&mut self, motion: &MotionInstruction) -> Option<DVec3> {
        let mut shift = Some(DVec3::ZERO);
        for word in &motion.extra {
            if let Some(by) = self.offset(word) {
                shift = shift.map(|shift| shift + by);
            } else if moves_target(word) {
                self.gap(Missing::Offset(word.clone()));
                shift = None;
            } else if let Some(name) = called_on_the_way(word) {
                if self.settings.passed_over.contains(&name) {
                    self.note("call-passed-over", name);
                } else {
                    self.gap(Missing::OnTheWay(word.clone()));
                }
            } else if coordinated(word) || first_word(word) == "MODE" {
                // told with the place of the positioner, and with how the tool turns
            } else if let Some(share) = joints_at(word) {
                if self.arc.is_some() {
                    self.gap(Missing::SlowJoints(share));
                }
            } else if switches_arc(word) || self.arc.is_some() && !leaves_beads(word) {
                self.gap(Missing::Word(word.clone()));
            } else {
                self.note("line-passed-over", first_word(word));
            }
        }
        shift
    }

    /// Tells a bead that gains its speed over a way that its metal shows.
    fn look_at_acceleration(&mut self, motion: &MotionInstruction, speed: ExecutedSpeed) {
        let Some(acceleration) = motion.acceleration.as_ref().filter(|_| self.arc.is_some()) else {
            return;
        };
        let speed = match speed {
            ExecutedSpeed::Path(speed) => Some(speed),
            _ => None,
        };
        if let Some(told) = acceleration.told(speed, self.settings.unseen_way) {
            self.gap(Missing::Acceleration(told));
        }
    }

    pub(super) fn motion(&mut self, motion: &MotionInstruction) -> Result<(), ProgramError> {
        let joint = motion.kind == MotionKind::Joint;
        if joint && self.arc.is_some() {
            return self.leave_out(motion, Some(Missing::JointBead));
        }
        let shift = self.further_words(motion);
        self.tell_phases();
        let via = match &motion.kind {
            MotionKind::Circular { via } => Some(self.place(via)?),
            _ => None,
        };
        let of_via = self.frames;
        let target = self.place(&motion.target)?;
        let (mut target, mut via, shift) = match (target, via.transpose(), shift) {
            (Ok(target), Ok(via), Some(shift)) => (target, via, shift),
            (target, via, _) => return self.leave_out(motion, target.err().or(via.err())),
        };
        for place in via.iter_mut().chain([&mut target]) {
            place.pose.position += shift;
        }
        let frames = match self.frames {
            // an arm goes to joints whatever frames are selected
            (frame, tool) if target.by_joints => (frame.unwrap_or(0), tool.unwrap_or(0)),
            (Some(frame), Some(tool)) => (frame, tool),
            _ => return Err(self.no_frames()),
        };
        let here = target.pose;
        let frames = self.told_in(frames, via.iter_mut().chain([&mut target]));
        self.turn(motion, &mut target, frames);
        let on_way = via.as_ref().map(|via| via.pose.position);
        self.look_at_bend(motion, (&target, on_way), frames);
        self.tell_axes(motion, &target);
        let round = via.is_some();
        let kind = match (&motion.kind, via) {
            (MotionKind::Joint, _) => ExecutedKind::Joint,
            (_, Some(via)) => ExecutedKind::Circular {
                via: via.pose.position,
            },
            // circles of A moves are found once three of them are known
            (_, None) => ExecutedKind::Linear,
        };
        let counts = self.arc.is_some() && !target.by_joints;
        if counts {
            self.look_at_frames(frames);
            self.look_at_start(frames);
            if round {
                self.look_at_via(of_via);
            }
        }
        let (speed, smoothing) = (self.speed(motion)?, self.smoothing(motion));
        self.look_at_acceleration(motion, speed);
        if motion.kind == MotionKind::CircleArc {
            self.arc_points.push(self.executed.len());
        } else {
            self.close_arcs();
        }
        let holds = if target.by_joints {
            None
        } else {
            self.held_here()
        };
        self.here = Some(here);
        self.came = match (target.by_joints, joint) {
            (true, _) => Came::Joints,
            (false, true) => Came::ByJoints((self.at.0, frames)),
            (false, false) => Came::Along((self.at.0, frames)),
        };
        self.executed.push(Executed::Motion(ExecutedMotion {
            kind,
            target: target.pose,
            external: [target.own, target.further].concat(),
            speed,
            turns: motion.turns.filter(|_| !joint),
            smoothing,
            arc: self.arc.as_ref().map(|(_, source)| *source),
            weave: self.weave.filter(|_| self.arc.is_some()),
            frames,
            holds,
            layer: self.layer,
            bead: self.bead,
            program: self.at.0 as u32,
            line: self.at.1 as u32 + 1,
        }));
        if let Some(word) = &motion.arc {
            let was_off = self.arc.is_none();
            self.switch(word)?;
            let changes = was_off || self.arc.is_none();
            if smoothing.is_some() && changes {
                self.note("arc-on-the-fly", word.to_string());
            }
        }
        Ok(())
    }

    /// Goes on without a move whose target is not known: a gap, unless it is a travel given by joints, whose end the next move says.
    fn leave_out(
        &mut self,
        motion: &MotionInstruction,
        why: Option<Missing>,
    ) -> Result<(), ProgramError> {
        self.close_arcs();
        self.here = None;
        self.came = Came::Told;
        match why {
            Some(Missing::JointPosition(name, why))
                if motion.kind == MotionKind::Joint && motion.arc.is_none() =>
            {
                self.came = Came::Unknown;
                self.note("joint-position-skipped", format!("{name} {why}"));
                self.leaves_out(Missing::JointPosition(name, why));
            }
            Some(why) => self.gap(why),
            // its words are told already
            None => {}
        }
        match &motion.arc {
            Some(word) => self.switch(word),
            None => Ok(()),
        }
    }

    /// Gives a finished chain of A moves its circles: each pair of points lies on the circle with the next point, the last pair on
    /// that with the one before. The move to the first point is straight, and so are chains of less than three points.
    pub(super) fn close_arcs(&mut self) {
        let chain = std::mem::take(&mut self.arc_points);
        let at = |executed: &[Executed], i: usize| match executed.get(i) {
            Some(Executed::Motion(m)) => m.target.position,
            _ => DVec3::ZERO,
        };
        for (k, pair) in chain.windows(2).enumerate() {
            let Some(first) = k.checked_sub(usize::from(k + 3 > chain.len())) else {
                continue;
            };
            let Some(three) = chain.get(first..first + 3) else {
                continue;
            };
            let points = [0, 1, 2].map(|i| at(&self.executed, three[i]));
            if let Some(why) = no_way(points[0], points[1], points[2]) {
                self.tell_circle(pair[1], why);
                continue;
            }
            let Some(arc) = Arc::through(points[0], points[1], points[2]) else {
                continue;
            };
            let offset = points[1] - arc.centre;
            let share = offset
                .dot(arc.v)
                .atan2(offset.dot(arc.u))
                .rem_euclid(std::f64::consts::TAU)
                / arc.sweep;
            let middle = if first == k {
                0.5 * share
            } else {
                0.5 * (1.0 + share)
            };
            if let Some(Executed::Motion(m)) = self.executed.get_mut(pair[1]) {
                m.kind = ExecutedKind::Circular {
                    via: arc.at(middle),
                };
            }
        }
    }
}
