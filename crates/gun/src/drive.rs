//! The beam along a toolpath: passes at their speeds, jumps between them.

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Channel, MotionBlock, Move, Pass, PassPlace, Profile, Times, Toolpath};

/// How a gun follows passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Speed of the beam from one pass to the next, where it is off, mm/s; infinite for jumps that take no time.
    pub jump: f64,
    /// Greatest distance between an arc and the lines in its place, mm.
    pub chord_error: f64,
}

/// Why a gun cannot follow passes.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// A speed, power or spot that no beam has.
    #[error(
        "move {index} of {pass}: {what} is {value}, it must be {range}; correct the pass or its profile"
    )]
    Value {
        /// The pass.
        pass: PassPlace,
        /// The move, from 0.
        index: usize,
        /// What is wrong.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// A profile that does not exist.
    #[error("{pass} refers to profile {profile}; there are {known}")]
    Profile {
        /// The pass.
        pass: PassPlace,
        /// What it refers to.
        profile: u16,
        /// How many there are.
        known: usize,
    },
}

/// Appends moves to a motion.
struct Pen {
    motion: MotionBlock,
    times: Vec<f64>,
    time: f64,
    drive: Drive,
}

/// What the beam is on a stretch.
#[derive(Clone, Copy)]
struct Beam {
    /// W.
    power: f64,
    /// mm.
    spot: f64,
}

impl Beam {
    /// The same beam, off.
    fn off(self) -> Self {
        Beam { power: 0.0, ..self }
    }
}

impl Pen {
    /// The beam is at `at` now, and was `beam` on its way there.
    fn put(&mut self, at: DVec3, beam: Beam) {
        let motion = &mut self.motion;
        if motion.position.last() == Some(&at) && self.times.last() == Some(&self.time) {
            return;
        }
        self.times.push(self.time);
        motion.position.push(at);
        motion.power.push(beam.power);
        motion.spot.push(beam.spot);
    }

    /// To `at`, beam off, its spot as it will be there.
    fn jump_to(&mut self, at: DVec3, beam: Beam) {
        if let Some(last) = self.motion.position.last() {
            self.time += last.truncate().distance(at.truncate()) / self.drive.jump;
        }
        self.put(at, beam.off());
    }

    fn line_to(&mut self, from: DVec3, to: DVec3, speed: f64, beam: Beam) {
        self.time += from.truncate().distance(to.truncate()) / speed;
        self.put(to, beam);
    }

    /// Stays where it is.
    fn rest(&mut self, at: DVec3, time: f64, beam: Beam) {
        self.time += time;
        self.put(at, beam);
    }
}

/// The beam along a toolpath in its order, beginning at `time` s: power, spot, speed and dwell of each move from the pass' channels,
/// else from its profile; beam off on travels and on the way from pass to pass. Spots are jumped to.
/// Heights of points are left out: a layer is plane.
///
/// # Errors
/// [`DriveError`] naming the move.
///
/// ```
/// use meltpath_geometry::math::DVec3;
/// use meltpath_gun::drive::{Drive, drive};
/// use meltpath_toolpath::{Layer, PassHead, Profile, Toolpath};
/// let mut layer = Layer::new(1, 0.0);
/// for y in [0.0, 0.125] {
///     layer.polyline(PassHead::default(), [DVec3::new(0.0, y, 0.0), DVec3::new(9.8, y, 0.0)]);
/// }
/// let profile = Profile { speed: 980.0, power: 300.0, spot: 0.4, ..Profile::default() };
/// let toolpath = Toolpath { profiles: vec![profile], layers: vec![layer], ..Toolpath::default() };
/// let how = Drive { jump: f64::INFINITY, chord_error: 0.005 };
/// let motion = drive(&toolpath, how, 0.0).unwrap();
/// assert_eq!(motion.power, [0.0, 300.0, 0.0, 300.0]);
/// assert!((motion.time(3) - 0.02).abs() < 1e-12);
/// ```
pub fn drive(toolpath: &Toolpath, drive: Drive, time: f64) -> Result<MotionBlock, DriveError> {
    let mut pen = Pen {
        motion: MotionBlock::default(),
        times: Vec::new(),
        time,
        drive,
    };
    for pass in toolpath.passes() {
        let profile = toolpath.profiles.get(usize::from(pass.head.profile));
        let profile = profile.ok_or(DriveError::Profile {
            pass: pass.place(),
            profile: pass.head.profile,
            known: toolpath.profiles.len(),
        })?;
        draw(&mut pen, &pass, profile)?;
    }
    pen.motion.times = Times::Each(pen.times);
    Ok(pen.motion)
}

fn draw(pen: &mut Pen, pass: &Pass<'_>, profile: &Profile) -> Result<(), DriveError> {
    for (index, kind) in pass.moves().enumerate() {
        let value = |channel, else_: f64| pass.value(channel, index).unwrap_or(else_);
        let speed = value(Channel::Speed, profile.speed);
        let power = value(Channel::Power, profile.power);
        let spot = value(Channel::Spot, profile.spot);
        let wrong = |what, value, range| DriveError::Value {
            pass: pass.place(),
            index,
            what,
            value,
            range,
        };
        if !(power >= 0.0 && power.is_finite()) {
            return Err(wrong("the power (W)", power, "0 or more"));
        }
        let power = if pass.head.role.deposits() {
            power
        } else {
            0.0
        };
        if !(spot.is_finite() && (spot > 0.0 || power == 0.0)) {
            return Err(wrong("the spot (mm)", spot, "above 0"));
        }
        let beam = Beam { power, spot };
        let [start, end] = [pass.points[index], pass.points[index + 1]];
        if let Move::Spot { time } = kind {
            if !(time >= 0.0 && time.is_finite()) {
                return Err(wrong("the time of a spot (s)", time, "0 or more"));
            }
            pen.jump_to(end, beam);
            pen.rest(end, time, beam);
            continue;
        }
        if !(speed > 0.0 && speed.is_finite()) {
            return Err(wrong("the speed (mm/s)", speed, "above 0"));
        }
        pen.jump_to(start, beam);
        let mut from = start;
        let arc = pass.arc(index);
        let pieces = arc.map_or(1, |a| a.chords(pen.drive.chord_error).max(1));
        for k in 1..=pieces {
            let to = match &arc {
                Some(arc) if k < pieces => arc.at(k as f64 / pieces as f64),
                _ => end,
            };
            pen.line_to(from, to, speed, beam);
            from = to;
        }
        let dwell = value(Channel::Dwell, profile.dwell);
        if dwell > 0.0 {
            pen.rest(end, dwell, beam);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_toolpath::{Layer, PassHead, PassId, Role};
    use proptest::prelude::*;

    const HOW: Drive = Drive {
        jump: 1e4,
        chord_error: 1e-3,
    };

    fn toolpath(layer: Layer) -> Toolpath {
        Toolpath {
            profiles: vec![profile()],
            layers: vec![layer],
            ..Toolpath::default()
        }
    }

    fn profile() -> Profile {
        Profile {
            speed: 1000.0,
            power: 300.0,
            spot: 0.4,
            ..Profile::default()
        }
    }

    /// Where the beam is at `time`, and its power.
    fn at(motion: &MotionBlock, time: f64) -> (DVec3, f64) {
        let n = (1..motion.len()).find(|n| motion.time(*n) > time).unwrap();
        let (from, to) = (motion.time(n - 1), motion.time(n));
        let share = (time - from) / (to - from);
        let place = motion.position[n - 1].lerp(motion.position[n], share);
        (place, motion.power[n])
    }

    proptest! {
        /// Energy and duration are those of the passes and the jumps between them.
        #[test]
        fn energy_and_time_add_up(ends in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64, 0.1..3.0_f64), 1..12)) {
            let mut layer = Layer::new(1, 0.0);
            for &(x, y, l) in &ends {
                layer.polyline(PassHead::default(), [DVec3::new(x, y, 0.0), DVec3::new(x + l, y, 0.0)]);
            }
            let motion = drive(&toolpath(layer), HOW, 0.25).unwrap();
            motion.sanity_check().unwrap();
            let drawn: f64 = ends.iter().map(|e| e.2 / 1000.0).sum();
            let jumped: f64 = ends.windows(2).map(|w| (w[0].0 + w[0].2 - w[1].0).hypot(w[0].1 - w[1].1) / 1e4).sum();
            prop_assert!((motion.time(motion.len() - 1) - 0.25 - drawn - jumped).abs() < 1e-9);
            let heated: f64 = (1..motion.len())
                .map(|n| motion.power[n] * (motion.time(n) - motion.time(n - 1))).sum();
            prop_assert!((heated - 300.0 * drawn).abs() < 1e-9);
        }
    }

    #[test]
    fn arcs_spots_and_channels_are_followed() {
        let drawn = {
            let mut layer = Layer::new(1, 0.0);
            let head = PassHead {
                id: PassId(3),
                role: Role::Contour,
                ..PassHead::default()
            };
            let mut pass = layer.begin(head, DVec3::new(1.0, 0.0, 0.0));
            pass.go(
                Move::Arc {
                    via: DVec3::new(0.0, 1.0, 0.0),
                },
                DVec3::new(-1.0, 0.0, 0.0),
            );
            pass.set(Channel::Speed, 500.0).set(Channel::Power, 600.0);
            pass.go(Move::Spot { time: 0.001 }, DVec3::new(0.0, 3.0, 0.0));
            pass.set(Channel::Speed, 500.0).set(Channel::Power, 120.0);
            drive(&toolpath(layer), HOW, 0.0)
        };
        let motion = drawn.unwrap();
        let arc = std::f64::consts::PI / 500.0;
        let jump = 1.0_f64.hypot(3.0) / 1e4;
        let end = motion.time(motion.len() - 1);
        assert!((end - arc - jump - 0.001).abs() < 1e-5, "{end}");
        let (half, power) = at(&motion, 0.5 * arc);
        assert!((half.y - 1.0).abs() < 2e-3 && power == 600.0);
        let spot = at(&motion, end - 5e-4);
        assert_eq!(spot, (DVec3::new(0.0, 3.0, 0.0), 120.0));
        assert_eq!(at(&motion, arc + 0.5 * jump).1, 0.0);
    }

    #[test]
    fn impossible_values_are_refused() {
        let refused = |channel: Channel, value: f64| {
            let mut layer = Layer::new(1, 0.0);
            let mut pass = layer.begin(PassHead::default(), DVec3::ZERO);
            pass.line_to(DVec3::X).set(channel, value);
            let refused = drive(&toolpath(layer), HOW, 0.0).unwrap_err();
            refused.to_string()
        };
        for speed in [0.0, -1.0, f64::INFINITY] {
            let words = refused(Channel::Speed, speed);
            assert!(
                words.starts_with(
                    "move 0 of pass 1 of layer 1 (from x 0.0, y 0.0, z 0.0 mm): the speed"
                ),
                "{words}"
            );
        }
        for power in [-1.0, f64::INFINITY] {
            let words = refused(Channel::Power, power);
            assert!(
                words.starts_with(
                    "move 0 of pass 1 of layer 1 (from x 0.0, y 0.0, z 0.0 mm): the power"
                ),
                "{words}"
            );
        }
        for time in [-1.0, f64::INFINITY, f64::NAN] {
            let mut layer = Layer::new(1, 0.0);
            let mut pass = layer.begin(PassHead::default(), DVec3::ZERO);
            pass.go(Move::Spot { time }, DVec3::X);
            let words = drive(&toolpath(layer), HOW, 0.0).unwrap_err().to_string();
            assert!(words.contains("the time of a spot"), "{words}");
        }
    }

    #[test]
    fn a_point_that_is_passed_twice_at_once_is_there_once() {
        let mut layer = Layer::new(1, 0.0);
        // on from where the first ends, without a jump; then there and back
        for (from, to) in [(0.0, 1.0), (1.0, 2.0), (1.0, 0.0)] {
            layer.polyline(PassHead::default(), [DVec3::X * from, DVec3::X * to]);
        }
        let motion = drive(&toolpath(layer), HOW, 0.0).unwrap();
        let x: Vec<f64> = motion.position.iter().map(|p| p.x).collect();
        assert_eq!(x, [0.0, 1.0, 2.0, 1.0, 0.0]);
        assert_eq!(motion.power, [0.0, 300.0, 300.0, 0.0, 300.0]);
        assert_eq!(motion.spot, [0.4; 5]);
    }

    /// Each move has its own spot, those without one the profile's; the beam is never on without a width.
    #[test]
    fn spots_are_those_of_moves_and_profiles() {
        let drawn = |spot: Option<f64>, profile: Profile| {
            let mut layer = Layer::new(1, 0.0);
            let mut pass = layer.begin(PassHead::default(), DVec3::ZERO);
            pass.line_to(DVec3::X);
            if let Some(spot) = spot {
                pass.set(Channel::Spot, spot);
            }
            pass.line_to(DVec3::X * 2.0);
            pass.set(Channel::Spot, 0.31);
            let toolpath = Toolpath {
                profiles: vec![profile],
                layers: vec![layer],
                ..Toolpath::default()
            };
            drive(&toolpath, HOW, 0.0)
        };
        assert_eq!(drawn(None, profile()).unwrap().spot, [0.4, 0.4, 0.31]);
        assert_eq!(drawn(Some(0.5), profile()).unwrap().spot, [0.5, 0.5, 0.31]);
        let without = Profile {
            spot: 0.0,
            ..profile()
        };
        let refused = drawn(None, without.clone()).unwrap_err().to_string();
        assert!(refused.contains("the spot (mm) is 0"), "{refused}");
        let dark = Profile {
            power: 0.0,
            ..without
        };
        assert!(drawn(None, dark).is_ok());
    }
}
