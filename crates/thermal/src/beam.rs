//! The beam in time: where it is, with how much power and how wide. A place in time can be asked for anywhere, which a stream of
//! motion does not give.

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{MotionBlock, Times};

use crate::solver::source::{Depth, Spot};

/// The beam from one instant on: it moves in a straight line to the next point, with this power and spot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamPoint {
    /// When, s.
    pub time: f64,
    /// Where, mm.
    pub x: f64,
    /// Where, mm.
    pub y: f64,
    /// Power of the beam, W; 0 where it is off.
    pub power: f64,
    /// Diameter φ of the spot where the intensity has fallen to 1/e², mm.
    pub spot: f64,
}

impl BeamPoint {
    /// At the origin at time zero, with a power in W and a spot in mm.
    pub const fn start(power: f64, spot: f64) -> Self {
        BeamPoint {
            time: 0.0,
            x: 0.0,
            y: 0.0,
            power,
            spot,
        }
    }

    /// Whether the beam is on.
    pub fn is_on(&self) -> bool {
        self.power > 0.0
    }

    /// The same with the beam off.
    #[must_use]
    pub fn off(self) -> Self {
        BeamPoint { power: 0.0, ..self }
    }
}

/// Why a beam path was refused.
#[derive(Debug, thiserror::Error)]
pub enum BeamError {
    /// Time runs backwards or a value is not finite.
    #[error("point {} of the beam path ({time} s): {what}", index + 1)]
    Point {
        /// Which, from 0.
        index: usize,
        /// Its time, s.
        time: f64,
        /// What is wrong.
        what: &'static str,
    },
    /// Motion with power that does not say how wide the beam is.
    #[error("the motion carries {power} W at {time} s and no spot: give its column `spot`, mm")]
    NoSpot {
        /// When, s.
        time: f64,
        /// The power, W.
        power: f64,
    },
}

/// A beam from its first point's time to its last: an index over motion, for asking where the beam is at any time. It is no
/// [`MotionBlock`], whose stretches carry what was said at their ends, in blocks that a sink sees once: here each point says what holds
/// from it on, the points lie in one list that is searched by time, and all were checked. [`BeamPath::of`] and
/// [`BeamPath::motion`] go from one to the other.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamPath {
    points: Vec<BeamPoint>,
}

impl BeamPath {
    /// A path through `points`, times never decreasing; two points at the same time are a jump.
    ///
    /// # Errors
    /// [`BeamError::Point`].
    pub fn new(points: Vec<BeamPoint>) -> Result<Self, BeamError> {
        let mut before = f64::NEG_INFINITY;
        for (index, p) in points.iter().enumerate() {
            let fail = |what| {
                Err(BeamError::Point {
                    index,
                    time: p.time,
                    what,
                })
            };
            let values = [p.time, p.x, p.y, p.power, p.spot];
            if !values.iter().all(|v| v.is_finite()) {
                return fail("a value is not finite");
            }
            if p.is_on() && p.spot <= 0.0 {
                return fail("the spot has no width");
            }
            if p.time < before {
                return fail("time runs backwards");
            }
            if p.power < 0.0 {
                return fail("the power is negative");
            }
            before = p.time;
        }
        Ok(BeamPath { points })
    }

    /// A polyline at constant speed (mm/s) with the settings of `like`, beginning at its time.
    ///
    /// # Errors
    /// [`BeamError::Point`] where the speed is not above zero.
    ///
    /// ```
    /// use meltpath_thermal::beam::{BeamPath, BeamPoint};
    /// let start = BeamPoint::start(300.0, 0.4);
    /// let path = BeamPath::along(&[[0.0, 0.0], [3.0, 0.0]], 400.0, start).unwrap();
    /// assert!((path.end() - 0.0075).abs() < 1e-12);
    /// assert!((path.at(0.005).x - 2.0).abs() < 1e-12);
    /// ```
    pub fn along(corners: &[[f64; 2]], speed: f64, like: BeamPoint) -> Result<Self, BeamError> {
        let mut time = like.time;
        let mut points: Vec<BeamPoint> = Vec::with_capacity(corners.len());
        for &[x, y] in corners {
            if let Some(last) = points.last() {
                time += (x - last.x).hypot(y - last.y) / speed;
            }
            points.push(BeamPoint { time, x, y, ..like });
        }
        Self::new(points)
    }

    /// The path that a motion takes, block after block.
    ///
    /// # Errors
    /// [`BeamError`]: power without a spot, or what [`BeamPath::new`] refuses.
    ///
    /// ```
    /// use meltpath_geometry::math::DVec3;
    /// use meltpath_thermal::beam::BeamPath;
    /// use meltpath_toolpath::{MotionBlock, Times};
    /// let line = MotionBlock {
    ///     times: Times::Each(vec![0.0, 0.01]),
    ///     position: vec![DVec3::ZERO, DVec3::X * 9.8],
    ///     power: vec![0.0, 300.0],
    ///     spot: vec![0.4, 0.4],
    ///     ..MotionBlock::default()
    /// };
    /// let path = BeamPath::of(&[line]).unwrap();
    /// assert_eq!(path.at(0.005).power, 300.0);
    /// ```
    pub fn of(motion: &[MotionBlock]) -> Result<Self, BeamError> {
        let mut points: Vec<BeamPoint> = Vec::new();
        for block in motion {
            for (i, at) in block.position.iter().enumerate() {
                let time = block.time(i);
                let power = block.power.get(i).copied().unwrap_or_default();
                let spot = block.spot.get(i).copied();
                if power > 0.0 && spot.is_none() {
                    return Err(BeamError::NoSpot { time, power });
                }
                // what a sample says holds over the stretch that ends there: it belongs to the point before
                if let Some(before) = points.last_mut() {
                    before.power = power;
                    before.spot = spot.unwrap_or(before.spot);
                }
                points.push(BeamPoint {
                    time,
                    x: at.x,
                    y: at.y,
                    power: 0.0,
                    spot: spot.unwrap_or_default(),
                });
            }
        }
        Self::new(points)
    }

    /// The motion of this path, on the build plane; [`BeamPath::of`] gives it back but for what the last point says.
    pub fn motion(&self) -> MotionBlock {
        let points = &self.points;
        let before = |n: usize| points[n.saturating_sub(1)];
        MotionBlock {
            times: Times::Each(points.iter().map(|p| p.time).collect()),
            position: points.iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect(),
            power: (0..points.len())
                .map(|n| if n == 0 { 0.0 } else { before(n).power })
                .collect(),
            spot: (0..points.len()).map(|n| before(n).spot).collect(),
            ..MotionBlock::default()
        }
    }

    /// The points.
    pub fn points(&self) -> &[BeamPoint] {
        &self.points
    }

    /// Time of the first point, s; 0 without points.
    pub fn begin(&self) -> f64 {
        self.points.first().map_or(0.0, |p| p.time)
    }

    /// Time of the last point, s; 0 without points.
    pub fn end(&self) -> f64 {
        self.points.last().map_or(0.0, |p| p.time)
    }

    /// The beam at `time`, off before the first and after the last point.
    pub fn at(&self, time: f64) -> BeamPoint {
        let after = self.points.partition_point(|p| p.time <= time);
        match (after.checked_sub(1), self.points.get(after)) {
            (Some(i), Some(next)) => {
                let here = self.points[i];
                let share = (time - here.time) / (next.time - here.time);
                BeamPoint {
                    time,
                    x: here.x + share * (next.x - here.x),
                    y: here.y + share * (next.y - here.y),
                    ..here
                }
            }
            (Some(i), None) => BeamPoint {
                time,
                power: 0.0,
                ..self.points[i]
            },
            (None, Some(first)) => BeamPoint {
                time,
                power: 0.0,
                ..*first
            },
            (None, None) => BeamPoint {
                time,
                x: 0.0,
                y: 0.0,
                power: 0.0,
                spot: 0.0,
            },
        }
    }

    /// What the beam does from one time to another: where it is midway of each stretch between jumps and switchings, with the
    /// stretch's share of the time. One stretch where it neither jumps nor switches.
    ///
    /// ```
    /// use meltpath_thermal::beam::{BeamPath, BeamPoint};
    /// let at = |time: f64, x: f64, power: f64| BeamPoint { time, x, y: 0.0, power, spot: 0.4 };
    /// let spots = BeamPath::new(vec![at(0.0, 0.0, 300.0), at(1.0, 0.0, 300.0), at(1.0, 9.0, 300.0), at(2.0, 9.0, 0.0)]).unwrap();
    /// let both = spots.stretches(0.25, 1.25);
    /// assert_eq!(both.iter().map(|(share, p)| (*share, p.x)).collect::<Vec<_>>(), [(0.75, 0.0), (0.25, 9.0)]);
    /// ```
    pub fn stretches(&self, from: f64, to: f64) -> Vec<(f64, BeamPoint)> {
        let points = &self.points;
        let first = points.partition_point(|p| p.time <= from);
        let mut ends = vec![from];
        for n in first..points.len() {
            let here = points[n];
            if here.time >= to {
                break;
            }
            let before = n.checked_sub(1).map(|b| points[b]);
            // before the first point and from the last one on the beam is off
            let cut = before.is_none_or(|b| {
                let jumps = b.time == here.time && (b.x, b.y) != (here.x, here.y);
                let switches = b.is_on() != here.is_on() || (n + 1 == points.len() && here.is_on());
                jumps || switches
            });
            if cut && ends.last().is_some_and(|e| *e < here.time) {
                ends.push(here.time);
            }
        }
        ends.push(to);
        ends.windows(2)
            .map(|w| ((w[1] - w[0]) / (to - from), self.at(0.5 * (w[0] + w[1]))))
            .collect()
    }

    /// When the beam is on and rests on a place: from, to, s.
    pub fn rests(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.points
            .windows(2)
            .filter(|w| {
                w[0].is_on() && w[1].time > w[0].time && (w[0].x, w[0].y) == (w[1].x, w[1].y)
            })
            .map(|w| [w[0].time, w[1].time])
    }

    /// Whether the beam is on and rests from one time to another, between two points of the path.
    pub fn rests_over(&self, from: f64, to: f64) -> bool {
        let (begun, midway) = (self.at(from), self.at(0.5 * (from + to)));
        begun.is_on() && (begun.x, begun.y) == (midway.x, midway.y)
    }

    /// The path from one time to another, s.
    #[must_use]
    pub fn between(&self, from: f64, to: f64) -> BeamPath {
        let (from, to) = (from.max(self.begin()), to.min(self.end()));
        let mut points = vec![self.at(from)];
        let inside = |p: &&BeamPoint| from < p.time && p.time <= to;
        points.extend(self.points.iter().filter(inside));
        if points.last().is_some_and(|p| p.time < to) {
            points.push(BeamPoint {
                power: points[points.len() - 1].power,
                ..self.at(to)
            });
        }
        BeamPath { points }
    }
}

/// How a beam becomes heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Share of the beam power that becomes heat, η.
    pub efficiency: f64,
    /// How the heat is spread below the surface.
    pub depth: Depth,
}

impl Beam {
    /// The heat source of a beam that is at `point`; power 0 where it is off.
    pub fn spot(&self, point: &BeamPoint) -> Spot {
        Spot {
            centre: [point.x, point.y],
            diameter: point.spot,
            power: self.efficiency * point.power,
            depth: self.depth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// At any moment the motion's path is the path.
        #[test]
        fn paths_come_back_from_their_motion(
            steps in prop::collection::vec((0.0..1.0_f64, -9.0..9.0_f64, 0.0..400.0_f64, prop::bool::ANY), 2..20), share in 0.0..1.0_f64,
        ) {
            let mut time = 0.0;
            let points = steps.iter().map(|&(dt, x, power, on)| {
                time += dt;
                BeamPoint { time, x, y: 0.3 * x, power: if on { power } else { 0.0 }, spot: 0.4 }
            }).collect();
            let path = BeamPath::new(points).unwrap();
            let motion = path.motion();
            motion.sanity_check().unwrap();
            let back = BeamPath::of(&[motion]).unwrap();
            let time = path.begin() + share * (path.end() - path.begin());
            prop_assert_eq!(back.at(time), path.at(time));
        }
    }
}
