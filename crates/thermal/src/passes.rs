//! From passes, the common language of planning, to the beam in time.

use meltpath_toolpath::{Move, Pass, Profile, Role};

use crate::beam::{BeamError, BeamPath, BeamPoint};

/// What passes leave unsaid about the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defaults {
    /// Accelerating voltage, V.
    pub voltage: f64,
    /// Current of the focus coil where a pass says none, A.
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
        profile: u32,
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

/// The beam along `passes` in their order, beginning at `time` s: powers, speeds, focus and dwell of each move from the pass'
/// channels, else from its profile and `defaults`; beam off on travels and on the way from pass to pass. Spots are jumped to.
/// Heights of points are left out: a layer is plane.
///
/// # Errors
/// [`PassesError`] naming the move.
///
/// ```
/// use meltpath_geometry::math::DVec3;
/// use meltpath_thermal::passes::{Defaults, beam_path};
/// use meltpath_toolpath::{Pass, PassId, Profile, Role, Tag};
/// let tag = Tag { part: 0, layer: 1, entity: 0 };
/// let line = |y: f64| vec![DVec3::new(0.0, y, 0.0), DVec3::new(9.8, y, 0.0)];
/// let passes = [0.0, 0.125].map(|y| Pass::polyline(PassId(0), Role::Fill, tag, line(y)));
/// let profile = Profile { speed: 980.0, power: 300.0, ..Profile::default() };
/// let defaults = Defaults { voltage: 60e3, focus: 4e-3, jump: f64::INFINITY, chord_error: 0.005 };
/// let path = beam_path(&passes, &[profile], &defaults, 0.0).unwrap();
/// assert!((path.end() - 0.02).abs() < 1e-12);
/// assert_eq!(path.at(0.005).current, 0.005);
/// ```
pub fn beam_path(
    passes: &[Pass],
    profiles: &[Profile],
    defaults: &Defaults,
    time: f64,
) -> Result<BeamPath, PassesError> {
    let mut pen = Pen {
        points: Vec::new(),
        time,
        jump: defaults.jump,
    };
    for pass in passes {
        let profile = profiles
            .get(pass.profile as usize)
            .ok_or(PassesError::Profile {
                pass: pass.id.0,
                profile: pass.profile,
                known: profiles.len(),
            })?;
        draw(&mut pen, pass, profile, defaults)?;
    }
    Ok(BeamPath::new(pen.points)?)
}

fn draw(
    pen: &mut Pen,
    pass: &Pass,
    profile: &Profile,
    defaults: &Defaults,
) -> Result<(), PassesError> {
    let of =
        |channel: &Option<Vec<f64>>, i: usize| channel.as_ref().and_then(|c| c.get(i).copied());
    let channels = &pass.channels;
    for (index, kind) in pass.moves.iter().enumerate() {
        let speed = of(&channels.speed, index).unwrap_or(profile.speed);
        let power = of(&channels.power, index).unwrap_or(profile.power);
        let wrong = |what, value, range| PassesError::Value {
            pass: pass.id.0,
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
            focus: of(&channels.focus, index).unwrap_or(defaults.focus),
            on: pass.role != Role::Travel,
        };
        let end = pass.points[index + 1];
        if let Move::Spot { time } = *kind {
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
        if let Some(dwell) = of(&channels.dwell, index).filter(|d| *d > 0.0) {
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
    use meltpath_toolpath::{Channels, PassId, Tag};
    use proptest::prelude::*;

    const DEFAULTS: Defaults = Defaults {
        voltage: 60e3,
        focus: 4e-3,
        jump: 1e4,
        chord_error: 1e-3,
    };
    const TAG: Tag = Tag {
        part: 0,
        layer: 1,
        entity: 0,
    };

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
            let passes: Vec<Pass> = ends.iter().map(|&(x, y, l)| {
                Pass::polyline(PassId(7), Role::Fill, TAG, vec![DVec3::new(x, y, 0.0), DVec3::new(x + l, y, 0.0)])
            }).collect();
            let path = beam_path(&passes, &[profile()], &DEFAULTS, 0.25).unwrap();
            let drawn: f64 = ends.iter().map(|e| e.2 / 1000.0).sum();
            let jumped: f64 = passes.windows(2).map(|w| w[0].points[1].distance(w[1].points[0]) / 1e4).sum();
            prop_assert!((path.end() - 0.25 - drawn - jumped).abs() < 1e-9);
            let heated: f64 = path.points().windows(2).filter(|w| w[0].on)
                .map(|w| w[0].voltage * w[0].current * (w[1].time - w[0].time)).sum();
            prop_assert!((heated - 300.0 * drawn).abs() < 1e-9);
        }
    }

    #[test]
    fn arcs_spots_and_channels_are_followed() {
        let mut pass = Pass::polyline(
            PassId(3),
            Role::Contour,
            TAG,
            vec![
                DVec3::new(1.0, 0.0, 0.0),
                DVec3::new(-1.0, 0.0, 0.0),
                DVec3::new(0.0, 3.0, 0.0),
            ],
        );
        pass.moves = vec![
            Move::Arc {
                via: DVec3::new(0.0, 1.0, 0.0),
            },
            Move::Spot { time: 0.001 },
        ];
        pass.channels = Channels {
            speed: Some(vec![500.0, 500.0]),
            power: Some(vec![600.0, 120.0]),
            focus: Some(vec![0.0, 7e-3]),
            ..Channels::default()
        };
        let path = beam_path(&[pass.clone()], &[profile()], &DEFAULTS, 0.0).unwrap();
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
        assert_eq!((spot.current, spot.focus), (0.002, 7e-3));
        assert!(!path.at(arc + 0.5 * jump).on);
        pass.channels.speed = Some(vec![0.0, 0.0]);
        let refused = beam_path(&[pass], &[profile()], &DEFAULTS, 0.0).unwrap_err();
        assert!(
            refused
                .to_string()
                .starts_with("move 0 of pass 3: the speed"),
            "{refused}"
        );
    }
}
