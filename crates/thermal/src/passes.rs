//! From passes, the common language of planning, to the beam in time.

use meltpath_toolpath::{Channel, Move, Pass, Profile, Toolpath};

use crate::beam::{BeamError, BeamPath, BeamPoint};

/// What passes leave unsaid about the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defaults {
    /// Accelerating voltage, V.
    pub voltage: f64,
    /// Current of the focus coil, A.
    pub focus: f64,
    /// Speed of the beam from one pass to the next, where it is off, mm/s; infinite for jumps that take no time.
    pub jump: f64,
    /// Greatest distance between an arc and the lines in its place, mm.
    pub chord_error: f64,
}

/// Why passes do not make a beam path.
#[derive(Debug, thiserror::Error)]
pub enum PassesError {
    /// A speed or power that no beam has.
    #[error(
        "move {index} of pass {pass}: {what} is {value}, it must be {range}; correct the pass or its profile"
    )]
    Value {
        /// Identifier of the pass.
        pass: u32,
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
    #[error("pass {pass} refers to profile {profile}; there are {known}")]
    Profile {
        /// Identifier of the pass.
        pass: u32,
        /// What it refers to.
        profile: u16,
        /// How many there are.
        known: usize,
    },
    /// Times or places that are no numbers.
    #[error(transparent)]
    Beam(#[from] BeamError),
}

/// Appends moves to a path.
struct Pen {
    points: Vec<BeamPoint>,
    time: f64,
    jump: f64,
}

impl Pen {
    fn put(&mut self, point: BeamPoint) {
        let point = BeamPoint {
            time: self.time,
            ..point
        };
        if self.points.last() != Some(&point) {
            self.points.push(point);
        }
    }

    /// To where `point` is, beam off.
    fn jump_to(&mut self, point: BeamPoint) {
        let off = BeamPoint { on: false, ..point };
        if let Some(last) = self.points.last().copied() {
            let way = (point.x - last.x).hypot(point.y - last.y);
            if way > 0.0 {
                self.put(BeamPoint { on: false, ..last });
                self.time += way / self.jump;
                self.put(off);
            }
        }
    }

    fn line_to(&mut self, from: BeamPoint, to: [f64; 2], speed: f64) {
        self.put(from);
        self.time += (to[0] - from.x).hypot(to[1] - from.y) / speed;
        self.put(BeamPoint {
            x: to[0],
            y: to[1],
            ..from
        });
    }
}

/// The beam along a toolpath in its order, beginning at `time` s: powers, speeds and dwell of each move from the pass'
/// channels, else from its profile and `defaults`; beam off on travels and on the way from pass to pass. Spots are jumped to.
/// Heights of points are left out: a layer is plane.
///
/// # Errors
/// [`PassesError`] naming the move.
///
/// ```
/// use meltpath_geometry::math::DVec3;
/// use meltpath_thermal::passes::{Defaults, beam_path};
/// use meltpath_toolpath::{Layer, PassHead, Profile, Toolpath};
/// let mut layer = Layer::new(1, 0.0);
/// for y in [0.0, 0.125] {
///     layer.polyline(PassHead::default(), [DVec3::new(0.0, y, 0.0), DVec3::new(9.8, y, 0.0)]);
/// }
/// let profile = Profile { speed: 980.0, power: 300.0, ..Profile::default() };
/// let defaults = Defaults { voltage: 60e3, focus: 4e-3, jump: f64::INFINITY, chord_error: 0.005 };
/// let toolpath = Toolpath { profiles: vec![profile], layers: vec![layer], ..Toolpath::default() };
/// let path = beam_path(&toolpath, &defaults, 0.0).unwrap();
/// assert!((path.end() - 0.02).abs() < 1e-12);
/// assert_eq!(path.at(0.005).current, 0.005);
/// ```
pub fn beam_path(
    toolpath: &Toolpath,
    defaults: &Defaults,
    time: f64,
) -> Result<BeamPath, PassesError> {
    let mut pen = Pen {
        points: Vec::new(),
        time,
        jump: defaults.jump,
    };
    for pass in toolpath.passes() {
        let profile = toolpath.profiles.get(usize::from(pass.head.profile));
        let profile = profile.ok_or(PassesError::Profile {
            pass: pass.head.id.0,
            profile: pass.head.profile,
            known: toolpath.profiles.len(),
        })?;
        draw(&mut pen, &pass, profile, defaults)?;
    }
    Ok(BeamPath::new(pen.points)?)
}

fn draw(
    pen: &mut Pen,
    pass: &Pass<'_>,
    profile: &Profile,
    defaults: &Defaults,
) -> Result<(), PassesError> {
    for (index, kind) in pass.moves().enumerate() {
        let value = |channel, else_: f64| pass.value(channel, index).unwrap_or(else_);
        let speed = value(Channel::Speed, profile.speed);
        let power = value(Channel::Power, profile.power);
        let wrong = |what, value, range| PassesError::Value {
            pass: pass.head.id.0,
            index,
            what,
            value,
            range,
        };
        if !(power >= 0.0 && power.is_finite()) {
            return Err(wrong("the power (W)", power, "0 or more"));
        }
        let here = BeamPoint {
            time: 0.0,
            x: pass.points[index].x,
            y: pass.points[index].y,
            voltage: defaults.voltage,
            current: power / defaults.voltage,
            focus: defaults.focus,
            on: pass.head.role.deposits(),
        };
        let end = pass.points[index + 1];
        if let Move::Spot { time } = kind {
            if !(time >= 0.0 && time.is_finite()) {
                return Err(wrong("the time of a spot (s)", time, "0 or more"));
            }
            let there = BeamPoint {
                x: end.x,
                y: end.y,
                ..here
            };
            pen.jump_to(there);
            pen.put(there);
            pen.time += time;
            pen.put(there);
            continue;
        }
        if !(speed > 0.0 && speed.is_finite()) {
            return Err(wrong("the speed (mm/s)", speed, "above 0"));
        }
        pen.jump_to(here);
        let mut from = here;
        let arc = pass.arc(index);
        let pieces = arc.map_or(1, |a| a.chords(defaults.chord_error).max(1));
        for k in 1..=pieces {
            let to = match &arc {
                Some(arc) if k < pieces => arc.at(k as f64 / pieces as f64),
                _ => end,
            };
            pen.line_to(from, [to.x, to.y], speed);
            (from.x, from.y) = (to.x, to.y);
        }
        let dwell = value(Channel::Dwell, profile.dwell);
        if dwell > 0.0 {
            pen.time += dwell;
            pen.put(from);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::{Layer, PassHead, PassId, Role};
    use proptest::prelude::*;

    const DEFAULTS: Defaults = Defaults {
        voltage: 60e3,
        focus: 4e-3,
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
            ..Profile::default()
        }
    }

    proptest! {
        /// Energy and duration are those of the passes and the jumps between them.
        #[test]
        fn energy_and_time_add_up(ends in prop::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64, 0.1..3.0_f64), 1..12)) {
            let mut layer = Layer::new(1, 0.0);
            for &(x, y, l) in &ends {
                layer.polyline(PassHead::default(), [DVec3::new(x, y, 0.0), DVec3::new(x + l, y, 0.0)]);
            }
            let path = beam_path(&toolpath(layer), &DEFAULTS, 0.25).unwrap();
            let drawn: f64 = ends.iter().map(|e| e.2 / 1000.0).sum();
            let jumped: f64 = ends.windows(2).map(|w| (w[0].0 + w[0].2 - w[1].0).hypot(w[0].1 - w[1].1) / 1e4).sum();
            prop_assert!((path.end() - 0.25 - drawn - jumped).abs() < 1e-9);
            let heated: f64 = path.points().windows(2).filter(|w| w[0].on)
                .map(|w| w[0].voltage * w[0].current * (w[1].time - w[0].time)).sum();
            prop_assert!((heated - 300.0 * drawn).abs() < 1e-9);
        }
    }

    #[test]
    fn arcs_spots_and_channels_are_followed() {
        let drawn = |speed: f64| {
            let mut layer = Layer::new(1, 0.0);
            let head = PassHead {
                id: PassId(3),
                role: Role::Contour,
                ..PassHead::default()
            };
            let mut pass = layer.begin(head, DVec3::new(1.0, 0.0, 0.0));
            pass.arc_to(DVec3::new(0.0, 1.0, 0.0), DVec3::new(-1.0, 0.0, 0.0));
            pass.set(Channel::Speed, speed).set(Channel::Power, 600.0);
            pass.go(Move::Spot { time: 0.001 }, DVec3::new(0.0, 3.0, 0.0));
            pass.set(Channel::Speed, speed).set(Channel::Power, 120.0);
            beam_path(&toolpath(layer), &DEFAULTS, 0.0)
        };
        let path = drawn(500.0).unwrap();
        let arc = std::f64::consts::PI / 500.0;
        let jump = 1.0_f64.hypot(3.0) / 1e4;
        assert!(
            (path.end() - arc - jump - 0.001).abs() < 1e-5,
            "{}",
            path.end()
        );
        let half = path.at(0.5 * arc);
        assert!((half.y - 1.0).abs() < 2e-3 && half.on && half.current == 0.01);
        let spot = path.at(path.end() - 5e-4);
        assert_eq!((spot.x, spot.y, spot.on), (0.0, 3.0, true));
        assert_eq!((spot.current, spot.focus), (0.002, 4e-3));
        assert!(!path.at(arc + 0.5 * jump).on);
        let refused = drawn(0.0).unwrap_err();
        assert!(
            refused
                .to_string()
                .starts_with("move 0 of pass 3: the speed"),
            "{refused}"
        );
    }
}
