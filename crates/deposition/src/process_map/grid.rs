//! A measured table of width and height, bilinear between its nodes (interpolator A of the source).

use super::import::MeasuredBead;

/// A part of a grid that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GridPart {
    /// The axis of wire feeds.
    WireFeed,
    /// The axis of travel speeds.
    TravelSpeed,
    /// The widths.
    Width,
    /// The heights.
    Height,
}

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
    /// What of it is wrong: an axis that does not rise, a count that does not match, a size that is none.
    pub fn new(
        wire_feed: Vec<f64>,
        travel_speed: Vec<f64>,
        width: Vec<f64>,
        height: Vec<f64>,
    ) -> Result<Self, (GridPart, String)> {
        use GridPart::{Height, TravelSpeed, Width, WireFeed};
        for (part, axis) in [(WireFeed, &wire_feed), (TravelSpeed, &travel_speed)] {
            if axis.len() < 2 {
                return Err((part, "a table needs two values or more".to_owned()));
            }
            let falls = |w: &&[f64]| !(w[0] > 0.0 && w[1] > w[0]);
            if let Some([before, after, ..]) = axis.windows(2).find(falls) {
                let told = format!("{after} after {before}: the axis must be positive and rise");
                return Err((part, told));
            }
        }
        let n = wire_feed.len() * travel_speed.len();
        for (part, values) in [(Width, &width), (Height, &height)] {
            if values.len() != n {
                let told = format!(
                    "{} values: there must be {} rows of {}, one for each pair of wire feed and travel speed",
                    values.len(),
                    wire_feed.len(),
                    travel_speed.len()
                );
                return Err((part, told));
            }
            if let Some(v) = values.iter().find(|v| !v.is_nan() && **v <= 0.0) {
                return Err((part, format!("{v}: sizes must be positive")));
            }
        }
        Ok(Grid {
            wire_feed,
            travel_speed,
            width,
            height,
        })
    }

    /// The beads that were measured, with `factor` times the programmed wire fed.
    pub(super) fn beads(&self, factor: f64) -> Vec<MeasuredBead> {
        let nodes = self
            .wire_feed
            .iter()
            .flat_map(|feed| self.travel_speed.iter().map(move |travel| (*feed, *travel)));
        nodes
            .zip(self.width.iter().zip(&self.height))
            .filter(|(_, (w, h))| w.is_finite() && h.is_finite())
            .map(
                |((wire_feed, travel_speed), (width, height))| MeasuredBead {
                    wire_feed,
                    fed: factor * wire_feed,
                    travel_speed,
                    width: *width,
                    height: *height,
                },
            )
            .collect()
    }

    /// Root mean square of the relative errors of width and height at nodes that are left out and read between their neighbours on
    /// either side; `None` where no node has such neighbours.
    pub(crate) fn left_out(&self) -> Option<[f64; 2]> {
        let (rows, columns) = (self.wire_feed.len(), self.travel_speed.len());
        let mut errors = [Vec::new(), Vec::new()];
        for (sizes, errors) in [&self.width, &self.height].into_iter().zip(&mut errors) {
            let at = |i: usize, j: usize| sizes[i * columns + j];
            let mut left_out = |x: [f64; 3], y: [f64; 3]| {
                let between = y[0] + (y[2] - y[0]) * (x[1] - x[0]) / (x[2] - x[0]);
                let error = (between / y[1]).ln();
                if error.is_finite() {
                    errors.push(error);
                }
            };
            for i in 0..rows {
                for j in 1..columns - 1 {
                    let x = [j - 1, j, j + 1].map(|j| self.travel_speed[j]);
                    left_out(x, [at(i, j - 1), at(i, j), at(i, j + 1)]);
                }
            }
            for j in 0..columns {
                for i in 1..rows - 1 {
                    let x = [i - 1, i, i + 1].map(|i| self.wire_feed[i]);
                    left_out(x, [at(i - 1, j), at(i, j), at(i + 1, j)]);
                }
            }
        }
        let rms = |e: &Vec<f64>| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
        let found = errors.each_ref().map(rms);
        found.iter().all(|e| e.is_finite()).then_some(found)
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
        let (left, right) = (
            self.travel_speed[0],
            self.travel_speed[self.travel_speed.len() - 1],
        );
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

    /// Points of the cell at `low` of size `size` where both tables have the given values: at most two, by the
    /// quadratic that is left once one unknown of the two bilinear equations is eliminated.
    pub(crate) fn solve_cell(
        &self,
        low: [f64; 2],
        size: [f64; 2],
        width: f64,
        height: f64,
    ) -> Vec<[f64; 2]> {
        let inset = 1e-9;
        // read just inside, so that the cell asked for answers and not its neighbour
        let at = |s: f64, t: f64| self.at(low[0] + s * size[0], low[1] + t * size[1]);
        let (e, f) = (inset, 1.0 - inset);
        let (p00, p10, p01, p11) = (at(e, e), at(f, e), at(e, f), at(f, f));
        let terms = |pick: fn((f64, f64)) -> f64| {
            let (a, b, c, d) = (pick(p00), pick(p10), pick(p01), pick(p11));
            [a, b - a, c - a, d - b - c + a]
        };
        let (w, h) = (terms(|p| p.0), terms(|p| p.1));
        if w.iter().chain(&h).any(|v| !v.is_finite()) {
            return Vec::new();
        }
        // w0 + w1 s + (w2 + w3 s) t = width, the same for h; t eliminated
        let (dw, dh) = (width - w[0], height - h[0]);
        let a = h[1] * w[3] - h[3] * w[1];
        let b = h[1] * w[2] - dh * w[3] + h[3] * dw - h[2] * w[1];
        let c = h[2] * dw - dh * w[2];
        let scale = a.abs().max(b.abs()).max(c.abs());
        let roots: Vec<f64> = if a.abs() <= 1e-14 * scale {
            if b == 0.0 { Vec::new() } else { vec![-c / b] }
        } else {
            let disc = b * b - 4.0 * a * c;
            // a fold touched exactly may come out a rounding below zero
            let disc = if disc < 0.0 && disc > -1e-12 * scale * scale {
                0.0
            } else {
                disc
            };
            if disc < 0.0 {
                Vec::new()
            } else {
                let q = -0.5 * (b + disc.sqrt().copysign(b));
                let mut roots = vec![q / a];
                if q != 0.0 {
                    roots.push(c / q);
                }
                roots
            }
        };
        let slack = 1e-7;
        roots
            .into_iter()
            .filter_map(|s| {
                let (qw, qh) = (w[2] + w[3] * s, h[2] + h[3] * s);
                let t = if qw.abs() * height >= qh.abs() * width {
                    (dw - w[1] * s) / qw
                } else {
                    (dh - h[1] * s) / qh
                };
                let inside = |x: f64| x >= -slack && x <= 1.0 + slack;
                (inside(s) && inside(t)).then(|| {
                    let (s, t) = (s.clamp(0.0, 1.0), t.clamp(0.0, 1.0));
                    [low[0] + s * size[0], low[1] + t * size[1]]
                })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Between two neighbours a plane is read without error; a node that stands off by a factor is read by that much too low, and its
    /// neighbours half of what it is off.
    #[test]
    fn nodes_left_out_are_read_between_their_neighbours() {
        let (feeds, speeds) = ([2.0, 3.0, 6.0], [0.5, 0.75, 1.5]);
        let plane = |f: f64, v: f64| 4.0 + 0.5 * f - 2.0 * v;
        let sizes: Vec<f64> = feeds
            .iter()
            .flat_map(|f| speeds.map(|v| plane(*f, v)))
            .collect();
        let grid = |width: Vec<f64>| {
            Grid::new(feeds.to_vec(), speeds.to_vec(), width, sizes.clone()).unwrap()
        };
        let [width, height] = grid(sizes.clone()).left_out().unwrap();
        assert!(width < 1e-12 && height < 1e-12, "{width} {height}");
        // the node in the middle: read twice, in six readings
        let mut off = sizes.clone();
        off[4] *= 1.2;
        let [width, height] = grid(off).left_out().unwrap();
        let wanted = (2.0 * f64::ln(1.2).powi(2) / 6.0).sqrt();
        assert!(
            (width - wanted).abs() < 1e-12 && height < 1e-12,
            "{width} {wanted}"
        );
        let two = Grid::new(vec![2.0, 3.0], vec![0.5, 0.75], vec![6.0; 4], vec![2.0; 4]);
        assert_eq!(two.unwrap().left_out(), None);
    }
}
