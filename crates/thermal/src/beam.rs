//! The beam in time: where it is, with which voltage, current and focus.

use std::fmt::Write as _;
use std::io::BufRead;

use crate::focus::{FocusCalibration, FocusError};
use crate::solver::source::{Depth, Spot};

/// The beam from one instant on: it moves in a straight line to the next point, with these settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamPoint {
    /// When, s.
    pub time: f64,
    /// Where, mm.
    pub x: f64,
    /// Where, mm.
    pub y: f64,
    /// Accelerating voltage, V.
    pub voltage: f64,
    /// Beam current, A.
    pub current: f64,
    /// Current of the focus coil, A.
    pub focus: f64,
    /// Whether the beam is on.
    pub on: bool,
}

/// Why a beam path or a focus was refused.
#[derive(Debug, thiserror::Error)]
pub enum BeamError {
    /// Time runs backwards or a value is not finite.
    #[error("point {index} of the beam path ({time} s): {what}")]
    Point {
        /// Which, from 0.
        index: usize,
        /// Its time, s.
        time: f64,
        /// What is wrong.
        what: &'static str,
    },
    /// A line of a file that does not read.
    #[error("line {line} of the beam path: {what}; the columns are {}", COLUMNS)]
    Line {
        /// Which, from 1.
        line: usize,
        /// What is wrong.
        what: String,
    },
    /// The file cannot be read.
    #[error("the beam path cannot be read: {0}")]
    Read(#[from] std::io::Error),
}

/// Heads of the columns of a beam-path file; `on` is 0 or 1.
pub const COLUMNS: &str = "t_s,x_mm,y_mm,U_V,I_A,I_f_A,on";

/// A beam from its first point's time to its last.
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
            let values = [p.time, p.x, p.y, p.voltage, p.current, p.focus];
            if !values.iter().all(|v| v.is_finite()) {
                return fail("a value is not finite");
            }
            if p.time < before {
                return fail("time runs backwards");
            }
            if p.voltage * p.current < 0.0 {
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
    /// let start = BeamPoint { time: 0.0, x: 0.0, y: 0.0, voltage: 60e3, current: 5e-3, focus: 4e-3, on: true };
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
                on: false,
                ..self.points[i]
            },
            (None, Some(first)) => BeamPoint {
                time,
                on: false,
                ..*first
            },
            (None, None) => BeamPoint {
                time,
                x: 0.0,
                y: 0.0,
                voltage: 0.0,
                current: 0.0,
                focus: 0.0,
                on: false,
            },
        }
    }

    /// What the beam does from one time to another: where it is midway of each stretch between jumps and switchings, with the
    /// stretch's share of the time. One stretch where it neither jumps nor switches.
    ///
    /// ```
    /// use meltpath_thermal::beam::{BeamPath, BeamPoint};
    /// let at = |time: f64, x: f64, on: bool| BeamPoint { time, x, y: 0.0, voltage: 60e3, current: 5e-3, focus: 4e-3, on };
    /// let spots = BeamPath::new(vec![at(0.0, 0.0, true), at(1.0, 0.0, true), at(1.0, 9.0, true), at(2.0, 9.0, false)]).unwrap();
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
                let switches = b.on != here.on || (n + 1 == points.len() && here.on);
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
            .filter(|w| w[0].on && w[1].time > w[0].time && (w[0].x, w[0].y) == (w[1].x, w[1].y))
            .map(|w| [w[0].time, w[1].time])
    }

    /// Whether the beam is on and rests from one time to another, between two points of the path.
    pub fn rests_over(&self, from: f64, to: f64) -> bool {
        let (begun, midway) = (self.at(from), self.at(0.5 * (from + to)));
        begun.on && (begun.x, begun.y) == (midway.x, midway.y)
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
                on: points[points.len() - 1].on,
                ..self.at(to)
            });
        }
        BeamPath { points }
    }

    /// Reads a path from CSV with the columns of [`COLUMNS`] and that line at its head; lines that begin with `#` are comments.
    ///
    /// # Errors
    /// [`BeamError`] with the line.
    pub fn from_csv(reader: impl BufRead) -> Result<Self, BeamError> {
        let mut points = Vec::new();
        let mut head = false;
        for (n, text) in reader.lines().enumerate() {
            let text = text?;
            let text = text.trim();
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let fail = |what: String| BeamError::Line { line: n + 1, what };
            if !head {
                if text != COLUMNS {
                    return Err(fail(format!("the head is \"{text}\"")));
                }
                head = true;
                continue;
            }
            let mut values = [0.0; 7];
            let mut cells = text.split(',');
            for value in &mut values {
                let cell = cells
                    .next()
                    .ok_or_else(|| fail("a column is missing".to_owned()))?;
                *value = cell
                    .trim()
                    .parse()
                    .map_err(|_| fail(format!("\"{cell}\" is not a number")))?;
            }
            if cells.next().is_some() {
                return Err(fail("there is a column too many".to_owned()));
            }
            let [time, x, y, voltage, current, focus, on] = values;
            if on != 0.0 && on != 1.0 {
                return Err(fail(format!("`on` is {on}: write 0 or 1")));
            }
            points.push(BeamPoint {
                time,
                x,
                y,
                voltage,
                current,
                focus,
                on: on == 1.0,
            });
        }
        Self::new(points)
    }

    /// The path as CSV; reads back to the same bits.
    pub fn to_csv(&self) -> String {
        let mut out = format!("{COLUMNS}\n");
        for p in &self.points {
            // writing to a String cannot fail
            let _ = writeln!(
                out,
                "{:?},{:?},{:?},{:?},{:?},{:?},{}",
                p.time,
                p.x,
                p.y,
                p.voltage,
                p.current,
                p.focus,
                u8::from(p.on)
            );
        }
        out
    }
}

/// What turns machine settings into heat.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    /// Share of the beam power that becomes heat, η.
    pub efficiency: f64,
    /// How the heat is spread below the surface.
    pub depth: Depth,
    /// Diameter against focus current.
    pub focus: FocusCalibration,
}

impl Beam {
    /// The heat source of a beam that is at `point`; power 0 where it is off.
    ///
    /// # Errors
    /// [`FocusError`] outside the calibrated currents.
    pub fn spot(&self, point: &BeamPoint) -> Result<Spot, FocusError> {
        Ok(Spot {
            centre: [point.x, point.y],
            diameter: self.focus.diameter(point.focus)?,
            power: if point.on {
                self.efficiency * point.voltage * point.current
            } else {
                0.0
            },
            depth: self.depth,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn paths_come_back_from_csv(values in prop::collection::vec((0.0..1.0_f64, -9.0..9.0_f64, prop::bool::ANY), 0..20)) {
            let mut time = 0.0;
            let points = values.iter().map(|&(dt, x, on)| {
                time += dt;
                BeamPoint { time, x, y: x * 0.3, voltage: 60e3, current: 5e-3 * dt, focus: 0.0, on }
            }).collect();
            let path = BeamPath::new(points).unwrap();
            prop_assert_eq!(BeamPath::from_csv(path.to_csv().as_bytes()).unwrap(), path);
        }
    }

    #[test]
    fn a_bad_line_is_named() {
        let text = format!("{COLUMNS}\n0,0,0,60000,0.005,0,1\n0.1,zero,0,60000,0.005,0,1\n");
        let error = BeamPath::from_csv(text.as_bytes()).unwrap_err().to_string();
        assert!(
            error.starts_with("line 3 of the beam path: \"zero\" is not a number"),
            "{error}"
        );
    }
}
