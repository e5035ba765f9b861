//! From the bead wanted to the settings: all solutions, ranked by deposition rate; the closest bead where there is none.

use meltpath_numerics::halving::{self, halve};
use serde::Serialize;

use super::{Bead, Law, M_PER_MIN, ProcessMap, ProcessMapError};

/// What is wanted: two of the four, or the height alone. Speeds mm/s, sizes mm.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Target {
    /// Programmed wire feed, mm/s.
    pub wire_feed: Option<f64>,
    /// Travel speed, mm/s.
    pub travel_speed: Option<f64>,
    /// Width, mm.
    pub width: Option<f64>,
    /// Height, mm.
    pub height: Option<f64>,
}

/// Intervals per axis in which one solution is looked for (laws without nodes of their own).
const CELLS: usize = 48;

type Point = [f64; 2];

impl ProcessMap {
    /// All settings of the map that make the bead wanted, highest deposition rate first.
    ///
    /// Given both speeds there is one answer, even outside the map's validity (see [`Bead::valid`]). The height alone
    /// is answered by the settings of highest wire feed that make it.
    ///
    /// # Errors
    /// [`ProcessMapError::Underspecified`], [`ProcessMapError::Value`], and [`ProcessMapError::Unreachable`] with the
    /// closest bead and what the map can make.
    pub fn solve(&self, target: &Target) -> Result<Vec<Bead>, ProcessMapError> {
        for (what, value) in [
            ("wire_feed", target.wire_feed),
            ("travel_speed", target.travel_speed),
            ("width", target.width),
            ("height", target.height),
        ] {
            if let Some(value) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                return Err(ProcessMapError::Value { what, value });
            }
        }
        let vf = target.wire_feed.map(|v| v / M_PER_MIN);
        let vr = target.travel_speed.map(|v| v / M_PER_MIN);
        let mut found: Vec<Point> = match (vf, vr, target.width, target.height) {
            (Some(vf), Some(vr), None, None) => {
                return Ok(vec![self.bead(vf * M_PER_MIN, vr * M_PER_MIN)]);
            }
            (Some(vf), None, Some(w), None) => self.along(1, vf, |s| s.0 - w),
            (Some(vf), None, None, Some(h)) => self.along(1, vf, |s| s.1 - h),
            (None, Some(vr), Some(w), None) => self.along(0, vr, |s| s.0 - w),
            (None, Some(vr), None, Some(h)) => self.along(0, vr, |s| s.1 - h),
            (None, None, Some(w), Some(h)) => self.both(w, h),
            (None, None, None, Some(h)) => self.fastest(h),
            _ => {
                return Err(ProcessMapError::Underspecified {
                    given: given(target),
                });
            }
        };
        if found.is_empty() {
            return Err(self.unreachable(target, vf, vr));
        }
        found.sort_by(|a, b| b[0].total_cmp(&a[0]).then(a[1].total_cmp(&b[1])));
        Ok(found
            .into_iter()
            .map(|p| self.bead(p[0] * M_PER_MIN, p[1] * M_PER_MIN))
            .collect())
    }

    /// Lines between which the law is smooth, m/min: the nodes of a table, else an even division of the region.
    fn knots(&self, axis: usize) -> Vec<f64> {
        let (lo, hi) = match axis {
            0 => self.validity.wire_feed,
            _ => self.validity.travel_speed,
        };
        let mut knots: Vec<f64> = (0..=CELLS)
            .map(|i| lo + (hi - lo) * i as f64 / CELLS as f64)
            .collect();
        if let Law::Grid(grid) = &self.law {
            let nodes = match axis {
                0 => grid.wire_feeds(),
                _ => grid.travel_speeds(),
            };
            knots = nodes
                .iter()
                .copied()
                .filter(|x| *x > lo && *x < hi)
                .collect();
            knots.insert(0, lo.max(nodes[0]));
            knots.push(hi.min(nodes[nodes.len() - 1]));
        }
        knots
    }

    /// Zeros of `f` along axis `axis` with the other speed held at `held`, m/min.
    fn along(&self, axis: usize, held: f64, f: impl Fn((f64, f64)) -> f64) -> Vec<Point> {
        let point = |x: f64| if axis == 0 { [x, held] } else { [held, x] };
        let value = |x: f64| f(self.sizes(point(x)[0], point(x)[1]));
        let mut zeros: Vec<Point> = Vec::new();
        let within = |p: Point| self.holds(p[0], p[1]);
        let mut keep = |x: f64| {
            let p = point(x);
            let other = zeros.iter().all(|q: &Point| (q[axis] - x).abs() > 1e-7);
            if within(p) && other {
                zeros.push(p);
            }
        };
        for pair in self.knots(axis).windows(2) {
            let (lo, hi) = (pair[0], pair[1]);
            let (flo, fhi) = (value(lo), value(hi));
            // an end that answers by itself, rounding included
            for (x, fx) in [(lo, flo), (hi, fhi)] {
                if fx.abs() < 1e-9 {
                    keep(x);
                }
            }
            if flo * fhi >= 0.0 || !(flo * fhi).is_finite() {
                continue;
            }
            keep(halving::root([lo, hi], 200, |x| value(x) * flo <= 0.0));
        }
        zeros
    }

    /// Settings that make a width and a height: in closed form in each cell of a table, else Newton from five starts
    /// in each cell of an even division.
    fn both(&self, width: f64, height: f64) -> Vec<Point> {
        let (rows, columns) = (self.knots(0), self.knots(1));
        let mut found: Vec<Point> = Vec::new();
        for r in rows.windows(2) {
            for c in columns.windows(2) {
                let (low, size) = ([r[0], c[0]], [r[1] - r[0], c[1] - c[0]]);
                let candidates: Vec<Point> = if let Law::Grid(grid) = &self.law {
                    grid.solve_cell(low, size, width, height)
                } else {
                    [(0.5, 0.5), (0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)]
                        .iter()
                        .map(|(s, t)| [low[0] + s * size[0], low[1] + t * size[1]])
                        .filter_map(|start| self.newton(start, low, size, width, height))
                        .collect()
                };
                for p in candidates {
                    let new = found
                        .iter()
                        .all(|q| (q[0] - p[0]).abs() + (q[1] - p[1]).abs() > 1e-5);
                    if new && self.holds(p[0], p[1]) {
                        found.push(p);
                    }
                }
            }
        }
        found
    }

    /// Newton's method in one cell; `None` unless it ends inside (the border counts, to rounding).
    fn newton(
        &self,
        start: Point,
        low: Point,
        size: Point,
        width: f64,
        height: f64,
    ) -> Option<Point> {
        let residual = |p: Point| {
            let (w, h) = self.sizes(p[0], p[1]);
            [w / width - 1.0, h / height - 1.0]
        };
        let inside = |p: Point, slack: f64| {
            (0..2).all(|i| {
                p[i] >= low[i] - slack * size[i] && p[i] <= low[i] + (1.0 + slack) * size[i]
            })
        };
        let mut p = start;
        for _ in 0..40 {
            let r = residual(p);
            if r[0].abs() + r[1].abs() < 1e-13 {
                break;
            }
            // one-sided steps that stay in the cell, where the law is smooth
            let mut jacobian = [[0.0; 2]; 2];
            for j in 0..2 {
                let mut step = 1e-6 * size[j];
                if p[j] + step > low[j] + size[j] {
                    step = -step;
                }
                let mut q = p;
                q[j] += step;
                let rq = residual(q);
                for i in 0..2 {
                    jacobian[i][j] = (rq[i] - r[i]) / step;
                }
            }
            let det = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0];
            if det == 0.0 || !det.is_finite() {
                return None;
            }
            let move_by = [
                (r[0] * jacobian[1][1] - r[1] * jacobian[0][1]) / det,
                (jacobian[0][0] * r[1] - jacobian[1][0] * r[0]) / det,
            ];
            p = [p[0] - move_by[0], p[1] - move_by[1]];
            // a table's cell ends at its border: come back to it, give up when far out
            if !inside(p, 1.0) {
                return None;
            }
            for i in 0..2 {
                p[i] = p[i].clamp(low[i], low[i] + size[i]);
            }
        }
        let r = residual(p);
        (r[0].abs() + r[1].abs() < 1e-9 && inside(p, 1e-9)).then_some(p)
    }

    /// The settings of highest wire feed that make a height.
    fn fastest(&self, height: f64) -> Vec<Point> {
        let at_feed = |vf: f64| self.along(1, vf, |s| s.1 - height);
        let mut knots = self.knots(0);
        if let Law::Grid(_) = &self.law {
            // a table has few nodes: look between them as well
            knots = knots
                .windows(2)
                .flat_map(|w| (0..8).map(move |i| w[0] + (w[1] - w[0]) * f64::from(i) / 8.0))
                .chain(knots.last().copied())
                .collect();
        }
        for i in (0..knots.len()).rev() {
            let mut best = at_feed(knots[i]);
            if best.is_empty() {
                continue;
            }
            // the edge of what can be made lies before the next knot
            if let Some(&above) = knots.get(i + 1) {
                halve([knots[i], above], 60, |feed| {
                    let here = at_feed(feed);
                    let beyond = here.is_empty();
                    if !beyond {
                        best = here;
                    }
                    beyond
                });
            }
            // at one feed the fastest travel is the flattest arc on time
            best.sort_by(|a, b| b[1].total_cmp(&a[1]));
            best.truncate(1);
            return best;
        }
        Vec::new()
    }

    /// The error that tells the closest bead and the limits.
    fn unreachable(&self, target: &Target, vf: Option<f64>, vr: Option<f64>) -> ProcessMapError {
        let miss = |(width, height): (f64, f64)| {
            let part =
                |wanted: Option<f64>, value: f64| wanted.map_or(0.0, |w| (value / w).ln().powi(2));
            part(target.width, width) + part(target.height, height)
        };
        // the knots end where the table or the validity does
        let ends = |axis: usize| {
            let knots = self.knots(axis);
            (knots[0], knots[knots.len() - 1])
        };
        let limits = (ends(0), ends(1));
        let range = |held: Option<f64>, (lo, hi): (f64, f64)| {
            held.map_or((lo, hi), |h| (h.clamp(lo, hi), h.clamp(lo, hi)))
        };
        let (mut feeds, mut travels) = (range(vf, limits.0), range(vr, limits.1));
        let mut width = (f64::INFINITY, f64::NEG_INFINITY);
        let mut height = width;
        let mut closest: Option<(f64, Point)> = None;
        // three rounds of an ever finer search
        for round in 0..3 {
            for i in 0..=60 {
                for j in 0..=60 {
                    let p = [
                        feeds.0 + (feeds.1 - feeds.0) * f64::from(i) / 60.0,
                        travels.0 + (travels.1 - travels.0) * f64::from(j) / 60.0,
                    ];
                    let (w, h) = self.sizes(p[0], p[1]);
                    if !self.holds(p[0], p[1]) || !w.is_finite() {
                        continue;
                    }
                    if round == 0 {
                        width = (width.0.min(w), width.1.max(w));
                        height = (height.0.min(h), height.1.max(h));
                    }
                    let m = miss((w, h));
                    if closest.is_none_or(|(best, _)| m < best) {
                        closest = Some((m, p));
                    }
                }
            }
            if let Some((_, p)) = &closest {
                let near = |x: f64, (lo, hi): (f64, f64)| {
                    let half = (hi - lo) / 30.0;
                    ((x - half).max(lo), (x + half).min(hi))
                };
                feeds = near(p[0], feeds);
                travels = near(p[1], travels);
            }
        }
        let closest = closest.map_or([limits.0.0, limits.1.0], |(_, p)| p);
        ProcessMapError::Unreachable {
            map: self.id.clone(),
            asked: given(target),
            closest: Box::new(self.bead(closest[0] * M_PER_MIN, closest[1] * M_PER_MIN)),
            width,
            height,
            with_the_value_given: vf.is_some() || vr.is_some(),
        }
    }
}

fn given(target: &Target) -> String {
    let speed = |v: f64| format!("{:.3} m/min", v / M_PER_MIN);
    let size = |v: f64| format!("{v:.2} mm");
    let parts: Vec<String> = [
        target.wire_feed.map(|v| format!("wire_feed {}", speed(v))),
        target
            .travel_speed
            .map(|v| format!("travel_speed {}", speed(v))),
        target.width.map(|v| format!("width {}", size(v))),
        target.height.map(|v| format!("height {}", size(v))),
    ]
    .into_iter()
    .flatten()
    .collect();
    if parts.is_empty() {
        "nothing".to_owned()
    } else {
        parts.join(", ")
    }
}
