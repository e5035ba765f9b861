//! A part of a beam path: what falls into a rectangle of the build plane, with the time that passes in between.

use meltpath_thermal::beam::{BeamError, BeamPath, BeamPoint};

/// A rectangle of the build plane, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Lowest corner.
    pub low: [f64; 2],
    /// Highest corner.
    pub high: [f64; 2],
}

impl Rectangle {
    /// The rectangle with `margin` mm more on every side.
    #[must_use]
    pub fn grown(self, margin: f64) -> Self {
        Rectangle {
            low: self.low.map(|v| v - margin),
            high: self.high.map(|v| v + margin),
        }
    }

    /// How far inside a point lies, mm; below zero outside.
    pub fn depth(&self, point: [f64; 2]) -> f64 {
        (0..2)
            .map(|a| (point[a] - self.low[a]).min(self.high[a] - point[a]))
            .fold(f64::INFINITY, f64::min)
    }

    /// The stretch of the way from `a` to `b` that lies inside, as shares of the way.
    fn stretch(&self, a: [f64; 2], b: [f64; 2]) -> Option<[f64; 2]> {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let (start, way) = (a[axis], b[axis] - a[axis]);
            let ends = [self.low[axis] - start, self.high[axis] - start];
            if way == 0.0 {
                if ends[0] > 0.0 || ends[1] < 0.0 {
                    return None;
                }
                continue;
            }
            let ends = ends.map(|e| e / way);
            from = from.max(ends[0].min(ends[1]));
            to = to.min(ends[0].max(ends[1]));
        }
        (from <= to).then_some([from, to])
    }
}

/// The part of `path` inside `rectangle`: from when the beam first is on in it until it last is; the beam is off while it is
/// elsewhere, and its time passes. `None` where the beam is never on inside.
///
/// # Errors
/// [`BeamError`], which a sound path does not give.
///
/// ```
/// use meltpath_thermal::beam::{BeamPath, BeamPoint};
/// use meltpath_melt_strategy::part::{Rectangle, within};
/// let start = BeamPoint::start(300.0, 0.4);
/// let path = BeamPath::along(&[[0.0, 0.0], [9.0, 0.0]], 1000.0, start).unwrap();
/// let middle = within(&path, &Rectangle { low: [2.0, -1.0], high: [4.0, 1.0] }).unwrap().unwrap();
/// assert!((middle.begin() - 0.002).abs() < 1e-12 && (middle.end() - 0.004).abs() < 1e-12);
/// ```
pub fn within(path: &BeamPath, rectangle: &Rectangle) -> Result<Option<BeamPath>, BeamError> {
    let mut points: Vec<BeamPoint> = Vec::new();
    for w in path.points().windows(2) {
        let (a, b) = (w[0], w[1]);
        let at = |share: f64, on: bool| BeamPoint {
            time: a.time + share * (b.time - a.time),
            x: a.x + share * (b.x - a.x),
            y: a.y + share * (b.y - a.y),
            power: if on { a.power } else { 0.0 },
            ..a
        };
        let inside = rectangle.stretch([a.x, a.y], [b.x, b.y]);
        match inside.filter(|_| a.is_on() && b.time > a.time) {
            Some([from, to]) => {
                if from > 0.0 {
                    points.push(at(0.0, false));
                }
                points.push(at(from, true));
                if to < 1.0 {
                    points.push(at(to, false));
                }
            }
            None => points.push(at(0.0, false)),
        }
    }
    points.extend(path.points().last().map(|p| p.off()));
    let first = points.iter().position(BeamPoint::is_on);
    let last = points.iter().rposition(BeamPoint::is_on);
    match (first, last) {
        (Some(first), Some(last)) => {
            BeamPath::new(points[first..(last + 2).min(points.len())].to_vec()).map(Some)
        }
        _ => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// At any moment the part is on exactly where the path is on inside the rectangle.
        #[test]
        fn a_part_is_the_path_where_it_is_inside(
            corners in prop::collection::vec((-3.0..3.0_f64, -3.0..3.0_f64, prop::bool::ANY), 2..12),
            size in (0.5..2.0_f64, 0.5..2.0_f64), share in 0.0..1.0_f64,
        ) {
            let points = corners.iter().enumerate().map(|(n, &(x, y, on))| BeamPoint {
                time: n as f64, x, y, power: if on { 300.0 } else { 0.0 }, spot: 0.4,
            }).collect();
            let path = BeamPath::new(points).unwrap();
            let rectangle = Rectangle { low: [-size.0, -size.1], high: [size.0, size.1] };
            let part = within(&path, &rectangle).unwrap();
            let time = share * path.end();
            let whole = path.at(time);
            // a place within rounding of the border may fall on either side
            prop_assume!(rectangle.depth([whole.x, whole.y]).abs() > 1e-9);
            let wanted = whole.is_on() && rectangle.depth([whole.x, whole.y]) > 0.0;
            match part {
                Some(part) => {
                    let here = part.at(time);
                    prop_assert_eq!(here.is_on(), wanted, "at {} of {:?}", time, part);
                    if wanted {
                        prop_assert!((here.x - whole.x).hypot(here.y - whole.y) < 1e-9);
                    }
                }
                None => prop_assert!(!wanted),
            }
        }
    }
}
