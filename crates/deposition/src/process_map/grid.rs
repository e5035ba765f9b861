//! A measured table of width and height, bilinear between its nodes (interpolator A of the source).

use crate::consumable::DataError;

/// Width and height on a grid of wire feed by travel speed, m/min and mm; NaN where nothing was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    wire_feed: Vec<f64>,
    travel_speed: Vec<f64>,
    width: Vec<f64>,
    height: Vec<f64>,
}

impl Grid {
    /// A grid from rising axes and row-major values (one row per wire feed).
    ///
    /// # Errors
    /// [`DataError::Value`] when an axis does not rise or a count does not match.
    pub fn new(
        file: &str,
        wire_feed: Vec<f64>,
        travel_speed: Vec<f64>,
        width: Vec<f64>,
        height: Vec<f64>,
    ) -> Result<Self, DataError> {
        let fail = |what: &str, value: f64, must| DataError::Value {
            file: file.to_owned(),
            what: what.to_owned(),
            value,
            must,
        };
        for (what, axis) in [("wire_feed", &wire_feed), ("travel_speed", &travel_speed)] {
            if axis.len() < 2 {
                return Err(fail(what, axis.len() as f64, "a table needs two values or more"));
            }
            if let Some(w) = axis.windows(2).find(|w| !(w[0] > 0.0 && w[1] > w[0])) {
                return Err(fail(what, w[1], "the axis must be positive and rise"));
            }
        }
        let n = wire_feed.len() * travel_speed.len();
        for (what, values) in [("width", &width), ("height", &height)] {
            if values.len() != n {
                let must = "one value per pair of wire feed and travel speed";
                return Err(fail(what, values.len() as f64, must));
            }
            if let Some(v) = values.iter().find(|v| !v.is_nan() && **v <= 0.0) {
                return Err(fail(what, *v, "sizes must be positive"));
            }
        }
        Ok(Grid {
            wire_feed,
            travel_speed,
            width,
            height,
        })
    }

    /// Wire feeds of the nodes, m/min.
    pub fn wire_feeds(&self) -> &[f64] {
        &self.wire_feed
    }

    /// Travel speeds of the nodes, m/min.
    pub fn travel_speeds(&self) -> &[f64] {
        &self.travel_speed
    }

    /// Whether the four nodes round a point were measured.
    pub(crate) fn covers(&self, vf: f64, vr: f64) -> bool {
        let (lo, hi) = (self.wire_feed[0], self.wire_feed[self.wire_feed.len() - 1]);
        let (left, right) = (self.travel_speed[0], self.travel_speed[self.travel_speed.len() - 1]);
        let slack = 1e-9;
        vf >= lo - slack
            && vf <= hi + slack
            && vr >= left - slack
            && vr <= right + slack
            && self.at(vf, vr).0.is_finite()
    }

    /// (width, height) at a point; the outer cells go on outside the grid; NaN in cells that were not measured.
    pub(crate) fn at(&self, vf: f64, vr: f64) -> (f64, f64) {
        let cell = |axis: &[f64], x: f64| {
            let i = axis.partition_point(|a| *a <= x).clamp(1, axis.len() - 1) - 1;
            (i, (x - axis[i]) / (axis[i + 1] - axis[i]))
        };
        let (i, u) = cell(&self.wire_feed, vf);
        let (j, v) = cell(&self.travel_speed, vr);
        let n = self.travel_speed.len();
        let mix = |t: &[f64]| {
            let at = |a: usize, b: usize| t[a * n + b];
            // a weight of zero hides a node that was not measured
            let part = |w: f64, x: f64| if w == 0.0 { 0.0 } else { w * x };
            part((1.0 - u) * (1.0 - v), at(i, j))
                + part((1.0 - u) * v, at(i, j + 1))
                + part(u * (1.0 - v), at(i + 1, j))
                + part(u * v, at(i + 1, j + 1))
        };
        (mix(&self.width), mix(&self.height))
    }
}
