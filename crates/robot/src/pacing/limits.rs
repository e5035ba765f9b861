//! The fastest pace along a way that every axis allows, never faster than the way's own.
//!
//! With the rate u of a motion q(s), s its own time, an axis goes q' u and speeds up by q'' u² + q' du/dt. In x = u² and y = du/dt = x'/2 both are
//! linear: x ≤ (v/|q'|)², ±(q'' x + q' y) ≤ a. Backwards the greatest x of each place is found from which the next place's can still be kept, then
//! forwards the greatest that is reached. Source of the method: Pham & Pham 2018, "A new approach to time-optimal path parameterization based on
//! reachability analysis", IEEE Transactions on Robotics 34, eq. 5-14, both ends of each step held within limits (their interpolation scheme). As
//! x = y = 0 keeps every limit, no place is without a pace.

use crate::cell::AXES;
use crate::kinematics::Limits;

/// Least square of a rate.
const LEAST: f64 = 1e-12;
/// Slopes below this are none, of the axis' units.
const FLAT: f64 = 1e-12;
/// Lines over y, or under it: two ends of a step, either way, of each axis, and what the next place keeps.
const MOST: usize = 4 * AXES + 2;

/// What a way asks of the axes.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// Where each axis stands, evenly in the way's own time: rad or mm.
    pub rows: &'a [[f64; AXES]],
    /// Between rows, s.
    pub step: f64,
    /// Rows at the begin, and at the end, that belong to what is before and after: there nothing is asked.
    pub beside: [usize; 2],
    /// What each axis can do.
    pub limits: &'a [Option<Limits>; AXES],
}

/// `α y + β x ≤ γ`.
#[derive(Clone, Copy)]
struct Line {
    alpha: f64,
    beta: f64,
    gamma: f64,
}

/// An axis at a row.
#[derive(Clone, Copy, Default)]
struct Slopes {
    first: f64,
    second: f64,
    /// What the second slope may be off by until the next row.
    off: f64,
}

/// The axes at a row.
type Row = [Slopes; AXES];

/// Squares of the greatest rates, for each row that is not beside; 1 where every axis keeps up.
///
/// ```
/// use meltpath_robot::cell::AXES;
/// use meltpath_robot::kinematics::Limits;
/// use meltpath_robot::pacing::{Asked, rates};
/// // one axis that is asked for 2 rad/s and can do 1 rad/s
/// let rows: Vec<[f64; AXES]> = (0..10).map(|i| [0.02 * f64::from(i); AXES]).collect();
/// let mut limits = [None; AXES];
/// limits[0] = Some(Limits { low: -3.0, high: 3.0, speed: Some(1.0), acceleration: Some(9.0) });
/// let squares = rates(&Asked { rows: &rows, step: 0.01, beside: [0, 0], limits: &limits });
/// assert!((squares[5] - 0.25).abs() < 1e-9);
/// ```
pub fn rates(asked: &Asked<'_>) -> Vec<f64> {
    let [before, after] = asked.beside;
    let Some(count) = asked.rows.len().checked_sub(before + after) else {
        return Vec::new();
    };
    let mut most = vec![1.0; count];
    // steps on which nothing is to be asked as long as the pace is full
    let mut idle = vec![false; count];
    let mut lines: Vec<Line> = Vec::with_capacity(4 * AXES + 2);
    let mut next = Row::default();
    // backwards: from where the next place's is kept
    for j in (0..count).rev() {
        let here = asked.row(before + j);
        let cap = asked.cap(before + j, &here);
        most[j] = cap;
        if let Some(&then) = most.get(j + 1) {
            asked.lines([&here, &next], &mut lines);
            let keeps = |l: &Line| l.beta <= l.gamma;
            if cap >= 1.0 && then >= 1.0 && lines.iter().all(keeps) {
                idle[j] = true;
            } else {
                let twice = 2.0 * asked.step;
                lines.push(Line {
                    alpha: twice,
                    beta: 1.0,
                    gamma: then,
                });
                lines.push(Line {
                    alpha: -twice,
                    beta: -1.0,
                    gamma: 0.0,
                });
                most[j] = greatest(&lines, cap).max(LEAST);
            }
        }
        next = here;
    }
    let mut x = most.first().copied().unwrap_or(1.0);
    // the row of which the slopes are known
    let mut known: Option<(usize, Row)> = None;
    for j in 0..count.saturating_sub(1) {
        most[j] = x;
        if idle[j] && x >= 1.0 {
            continue;
        }
        let here = match known {
            Some((row, slopes)) if row == j => slopes,
            _ => asked.row(before + j),
        };
        let next = asked.row(before + j + 1);
        asked.lines([&here, &next], &mut lines);
        let rises = lines.iter().filter(|l| l.alpha > FLAT);
        let y = rises.map(|l| (l.gamma - l.beta * x) / l.alpha);
        let y = y.fold(f64::INFINITY, f64::min);
        x = (x + 2.0 * asked.step * y).min(most[j + 1]).max(LEAST);
        known = Some((j + 1, next));
    }
    if let Some(last) = most.last_mut() {
        *last = x;
    }
    most
}

/// The greatest x up to `cap` that leaves room for some y between the lines, all of which allow x = y = 0.
///
/// The least of what lies over y less the greatest of what lies under it is concave in x: from beyond its zero the crossing of the two lines
/// that decide leads nearer, and in a few steps there.
fn greatest(lines: &[Line], cap: f64) -> f64 {
    let mut x = cap;
    for line in lines {
        if line.alpha.abs() <= FLAT && line.beta > 0.0 {
            x = x.min(line.gamma / line.beta);
        }
    }
    // over and under y: where they stand at x = 0, and how they go on
    let mut bounds = [[(0.0, 0.0); MOST]; 2];
    let mut counts = [0; 2];
    for line in lines.iter().filter(|l| l.alpha.abs() > FLAT) {
        let side = usize::from(line.alpha > 0.0);
        if let Some(bound) = bounds[side].get_mut(counts[side]) {
            *bound = (line.gamma / line.alpha, -line.beta / line.alpha);
            counts[side] += 1;
        }
    }
    let [lows, highs] = [0, 1].map(|side| bounds[side].get(..counts[side]).unwrap_or_default());
    loop {
        let at = |bound: &(f64, f64)| bound.0 + bound.1 * x;
        let mut low = (f64::NEG_INFINITY, (0.0, 0.0));
        for bound in lows {
            let here = at(bound);
            low = if here > low.0 { (here, *bound) } else { low };
        }
        let mut high = (f64::INFINITY, (0.0, 0.0));
        for bound in highs {
            let here = at(bound);
            high = if here < high.0 { (here, *bound) } else { high };
        }
        let ((under, (low, falls)), (over, (high, rises))) = (low, high);
        if under <= over || falls <= rises {
            return x;
        }
        let crossing = (high - low) / (falls - rises);
        if crossing >= x {
            return x;
        }
        x = crossing;
    }
}

impl Asked<'_> {
    /// How an axis goes at a row.
    fn slopes(&self, row: usize, axis: usize) -> Slopes {
        let last = self.rows.len().saturating_sub(1);
        if last < 2 {
            let gone = self.gone(0, axis).unwrap_or(0.0);
            return Slopes {
                first: gone / self.step,
                ..Slopes::default()
            };
        }
        let inner = |row: usize| row.clamp(1, last - 1);
        let square = self.step * self.step;
        let second = |row: usize| {
            let n = inner(row);
            let at = |n: usize| self.rows[n][axis];
            (at(n + 1) - 2.0 * at(n) + at(n - 1)) / square
        };
        let middle = inner(row);
        let mean = (self.rows[middle + 1][axis] - self.rows[middle - 1][axis]) / (2.0 * self.step);
        let here = second(row);
        let beside = [row.saturating_sub(1), row + 1].map(|n| (second(n) - here).abs());
        Slopes {
            first: mean + here * self.step * (row as f64 - middle as f64),
            second: here,
            // accelerations that rise evenly to a kink pass what the differences show by less than a quarter of their own
            off: 0.25 * beside[0].max(beside[1]),
        }
    }

    /// How the axes that have limits go at a row.
    fn row(&self, row: usize) -> Row {
        std::array::from_fn(|axis| match self.limits[axis] {
            Some(_) => self.slopes(row, axis),
            None => Slopes::default(),
        })
    }

    fn gone(&self, row: usize, axis: usize) -> Option<f64> {
        Some(self.rows.get(row + 1)?[axis] - self.rows.get(row)?[axis])
    }

    /// The greatest square of the rate by speeds at a row, and by accelerations where the pace stays.
    fn cap(&self, row: usize, slopes: &Row) -> f64 {
        let of = (0..AXES).map(|axis| self.allowed_by(row, axis, slopes[axis])[0]);
        of.fold(1.0, f64::min).max(LEAST)
    }

    /// The greatest squares of the rate that an axis allows at a row: by its speed, and by its acceleration where the pace stays.
    pub(crate) fn allowed(&self, row: usize, axis: usize) -> [f64; 2] {
        self.allowed_by(row, axis, self.slopes(row, axis))
    }

    /// The same, where the axis goes so.
    fn allowed_by(&self, row: usize, axis: usize, slopes: Slopes) -> [f64; 2] {
        let Some(limits) = self.limits[axis] else {
            return [1.0; 2];
        };
        let most = slopes.second.abs() + 5.0 * slopes.off;
        let steps = [row.checked_sub(1), Some(row)];
        let gone = steps.into_iter().flatten();
        let gone = gone.filter_map(|n| self.gone(n, axis)).map(f64::abs);
        let fastest = gone.fold(0.0, f64::max) / self.step + 0.5 * self.step * most;
        let of = |limit: Option<f64>, asked: f64| match limit {
            Some(limit) if asked > limit => limit / asked,
            _ => 1.0,
        };
        let speed = of(limits.speed, fastest);
        [
            speed * speed,
            of(limits.acceleration, slopes.second.abs() + slopes.off),
        ]
    }

    /// What accelerations allow on the step from a row to the next, at both of its ends; `ends` is how the axes go there.
    fn lines(&self, ends: [&Row; 2], lines: &mut Vec<Line>) {
        lines.clear();
        let twice = 2.0 * self.step;
        for (axis, limits) in self.limits.iter().enumerate() {
            let Some(gamma) = limits.and_then(|l| l.acceleration) else {
                continue;
            };
            let [here, next] = ends.map(|row| row[axis]);
            for sign in [1.0, -1.0] {
                let beta = sign * here.second + here.off;
                lines.push(Line {
                    alpha: sign * here.first,
                    beta,
                    gamma,
                });
                let beta = sign * next.second + next.off;
                lines.push(Line {
                    alpha: sign * next.first + twice * beta,
                    beta,
                    gamma,
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(speed: f64, acceleration: Option<f64>) -> [Option<Limits>; AXES] {
        let mut all = [None; AXES];
        all[0] = Some(Limits {
            low: -10.0,
            high: 10.0,
            speed: Some(speed),
            acceleration,
        });
        all
    }

    fn rows(count: usize, at: impl Fn(f64) -> f64, step: f64) -> Vec<[f64; AXES]> {
        let row = |i: usize| {
            let mut row = [0.0; AXES];
            row[0] = at(i as f64 * step);
            row
        };
        (0..count).map(row).collect()
    }

    fn found(rows: &[[f64; AXES]], step: f64, limits: &[Option<Limits>; AXES]) -> Vec<f64> {
        rates(&Asked {
            rows,
            step,
            beside: [0, 0],
            limits,
        })
    }

    #[test]
    fn an_even_axis_goes_at_its_limit() {
        let rows = rows(50, |t| 2.0 * t, 0.01);
        for acceleration in [None, Some(1.0)] {
            let x = found(&rows, 0.01, &limits(0.5, acceleration));
            assert!(x.iter().all(|x| (x - 1.0 / 16.0).abs() < 1e-9), "{x:?}");
            let x = found(&rows, 0.01, &limits(2.1, acceleration));
            assert!(x.iter().all(|x| *x == 1.0));
        }
    }

    /// Another axis may go at a third of the pace from 2.1 s on: the first slows down for it in time, by the hand's formula v² = v₁² + 2 a s.
    #[test]
    fn an_axis_slows_down_in_time() {
        let (step, a) = (0.002, 0.8);
        let other = |t: f64| {
            let t = t - 2.0;
            if t < 0.1 {
                15.0 * t.max(0.0) * t.max(0.0)
            } else {
                0.15 + 3.0 * (t - 0.1)
            }
        };
        let mut rows = rows(2000, |t| t, step);
        for (i, row) in rows.iter_mut().enumerate() {
            row[1] = other(i as f64 * step);
        }
        let mut limits = limits(10.0, Some(a));
        limits[1] = limits[0].map(|l| Limits {
            speed: Some(1.0),
            acceleration: None,
            ..l
        });
        let x = found(&rows, step, &limits);
        assert!((x[1500] - 1.0 / 9.0).abs() < 1e-9);
        for j in [780, 900, 1000, 1030] {
            let left = 2.1 - j as f64 * step;
            let wanted = 1.0 / 9.0 + 2.0 * a * left;
            assert!((x[j] - wanted).abs() < 0.01, "{j} {} {wanted}", x[j]);
        }
        assert_eq!(x[770], 1.0);
    }

    /// On a grid a hundred times finer no axis goes or speeds up faster than it can.
    #[test]
    fn nothing_is_exceeded_between_rows() {
        let (step, finer) = (0.004, 100);
        let way = |t: f64| [0.4 * (3.0 * t).sin(), 0.3 * (2.0 * t * t).cos() + 0.2 * t];
        let count = 600;
        let row = |i: usize| {
            let mut row = [0.0; AXES];
            row[..2].copy_from_slice(&way(i as f64 * step));
            row
        };
        let rows: Vec<_> = (0..count).map(row).collect();
        let mut limits = limits(0.7, Some(2.0));
        limits[1] = limits[0].map(|l| Limits {
            speed: Some(0.9),
            acceleration: Some(3.0),
            ..l
        });
        let x = found(&rows, step, &limits);
        assert!(x.iter().any(|x| *x < 0.2) && x.iter().all(|x| *x > 0.0 && *x <= 1.0));
        // times of the finer grid, the rate changing evenly in time
        let (mut time, mut times) = (0.0, vec![0.0]);
        let square = |k: usize| {
            let (j, share) = (k / finer, (k % finer) as f64 / finer as f64);
            x[j] + (x[(j + 1).min(count - 1)] - x[j]) * share
        };
        let h = step / finer as f64;
        let fine = (count - 1) * finer;
        for k in 0..fine {
            time += 2.0 * h / (square(k).sqrt() + square(k + 1).sqrt());
            times.push(time);
        }
        let (mut fastest, mut hardest) = ([0.0_f64; 2], [0.0_f64; 2]);
        for k in 1..fine {
            let at = [k - 1, k, k + 1].map(|k| way(k as f64 * h));
            let [before, after] = [times[k] - times[k - 1], times[k + 1] - times[k]];
            for i in 0..2 {
                let speeds = [
                    (at[1][i] - at[0][i]) / before,
                    (at[2][i] - at[1][i]) / after,
                ];
                fastest[i] = fastest[i].max(speeds[1].abs());
                // where the pace changes its change the mean of both sides is seen
                hardest[i] = hardest[i].max(2.0 * (speeds[1] - speeds[0]).abs() / (before + after));
            }
        }
        for i in 0..2 {
            let l = limits[i].unwrap();
            assert!(fastest[i] <= l.speed.unwrap() * 1.001, "{fastest:?}");
            assert!(hardest[i] <= l.acceleration.unwrap() * 1.001, "{hardest:?}");
        }
        // and something is used up all along
        assert!(fastest[0] > 0.69 && hardest[1] > 2.9);
    }

    #[test]
    fn rows_beside_ask_nothing() {
        let rows = rows(20, |t| if t < 0.05 { 10.0 * t } else { 0.5 }, 0.01);
        let all = found(&rows, 0.01, &limits(1.0, None));
        let inner = rates(&Asked {
            rows: &rows,
            step: 0.01,
            beside: [7, 1],
            limits: &limits(1.0, None),
        });
        assert!(all[2] < 0.02 && inner.len() == 12);
        assert!(inner.iter().all(|x| *x == 1.0), "{inner:?}");
        assert!(found(&rows[..1], 0.01, &limits(1.0, None)) == [1.0]);
        assert!(found(&[], 0.01, &limits(1.0, None)).is_empty());
    }
}
