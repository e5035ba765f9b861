//! Coordinates in which one unit is one allowed chord of the surface, in u and in v.

use super::chart::Chart;
use super::tolerance::Tolerance;
use crate::brep::Surface;
use crate::math::DVec2;

/// Steps that one direction of one face may take at most: beyond this the chord error is finer than doubles allow.
const MOST_STEPS: f64 = 1e5;
/// Cells in which the step is taken as constant, besides the surface's own breaks.
const CELLS: usize = 8;

/// A piecewise linear, rising map of one parameter.
#[derive(Debug, Clone, PartialEq)]
struct Axis {
    knots: Vec<f64>,
    values: Vec<f64>,
}

impl Axis {
    fn map(from: &[f64], to: &[f64], x: f64) -> f64 {
        let last = from.len() - 2;
        let i = from.partition_point(|&k| k <= x).clamp(1, last + 1) - 1;
        let s = (x - from[i]) / (from[i + 1] - from[i]);
        to[i] + s * (to[i + 1] - to[i])
    }
}

/// The map of the parameter plane to chord units and back.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Warp {
    axes: [Axis; 2],
    /// Whether the surface bends along u and along v.
    pub(super) bent: [bool; 2],
}

impl Warp {
    /// The map for a face whose outline lies in a box of the plane.
    pub(super) fn new(chart: &Chart<'_>, lo: DVec2, hi: DVec2, tolerance: &Tolerance) -> Self {
        let size = (hi - lo).max(DVec2::splat(1e-12));
        if let Surface::Plane(_) = chart.surface {
            // both axes alike, so that triangles keep their shape
            let scale = 1.0 / size.max_element();
            let axis = |lo: f64, hi: f64| Axis {
                knots: vec![lo, hi],
                values: vec![0.0, (hi - lo) * scale],
            };
            return Self {
                axes: [axis(lo.x, lo.x + size.x), axis(lo.y, lo.y + size.y)],
                bent: [false, false],
            };
        }
        let range = [[lo.x, lo.x + size.x], [lo.y, lo.y + size.y]];
        let cells = [0, 1].map(|d| cell_ends(chart, d, range[d]));
        let mut bends = [0, 1].map(|d| bends(chart, d, &cells, tolerance.chord, tolerance.angle));
        // where the surface bends both ways the two chord errors add up
        let bent = [0, 1].map(|d| steps(&cells[d], &bends[d]) > 1.0);
        let share = if bent[0] && bent[1] { 0.45 } else { 0.9 };
        bends =
            [0, 1].map(|d| self::bends(chart, d, &cells, share * tolerance.chord, tolerance.angle));
        let axes = [0, 1].map(|d| {
            let knots = cells[d].clone();
            let [lo, hi] = range[d];
            // at least one unit over the whole, at most MOST_STEPS
            let least = 1.0 / (hi - lo);
            let most = MOST_STEPS / (hi - lo);
            let mut values = vec![0.0];
            let mut sum = 0.0;
            for (pair, bend) in knots.windows(2).zip(&bends[d]) {
                sum += (pair[1] - pair[0]) * bend.clamp(least, most);
                values.push(sum);
            }
            Axis { knots, values }
        });
        Self { axes, bent }
    }

    /// Whether one direction would take more steps than a face may.
    pub(super) fn is_too_fine(&self) -> bool {
        // the sum of the cells is rounded
        let capped = |axis: &Axis| axis.values.last() >= Some(&(0.999 * MOST_STEPS));
        self.axes.iter().any(capped)
    }

    /// From parameters to chord units.
    pub(super) fn warp(&self, uv: DVec2) -> DVec2 {
        let [a, b] = &self.axes;
        DVec2::new(
            Axis::map(&a.knots, &a.values, uv.x),
            Axis::map(&b.knots, &b.values, uv.y),
        )
    }

    /// From chord units to parameters.
    pub(super) fn unwarp(&self, w: DVec2) -> DVec2 {
        let [a, b] = &self.axes;
        DVec2::new(
            Axis::map(&a.values, &a.knots, w.x),
            Axis::map(&b.values, &b.knots, w.y),
        )
    }
}

fn steps(knots: &[f64], bends: &[f64]) -> f64 {
    knots
        .windows(2)
        .zip(bends)
        .map(|(p, b)| (p[1] - p[0]) * b)
        .sum()
}

/// Ends of the cells of coordinate `d`: equal parts and the surface's breaks.
fn cell_ends(chart: &Chart<'_>, d: usize, [lo, hi]: [f64; 2]) -> Vec<f64> {
    let uniform = match (chart.surface, d) {
        (
            Surface::Cylinder { .. }
            | Surface::Cone { .. }
            | Surface::Sphere { .. }
            | Surface::Torus { .. },
            _,
        )
        | (Surface::Revolution { .. }, 0)
        | (Surface::Extrusion { .. }, 1) => 1,
        _ => CELLS,
    };
    let mut ends: Vec<f64> = (0..=uniform)
        .map(|i| lo + (hi - lo) * i as f64 / uniform as f64)
        .collect();
    let shifts: Vec<f64> = chart.periods[d].map_or(vec![0.0], |p| vec![-p, 0.0, p]);
    let breaks = &chart.surface.breaks()[d];
    // a spline of thousands of spans is smooth over many of them
    let stride = breaks.len().div_ceil(512).max(1);
    for b in breaks.iter().step_by(stride) {
        ends.extend(shifts.iter().map(|s| b + s).filter(|x| *x > lo && *x < hi));
    }
    ends.sort_by(f64::total_cmp);
    let close = 1e-6 * (hi - lo);
    let mut kept: Vec<f64> = Vec::with_capacity(ends.len());
    for x in ends {
        if kept.last().is_none_or(|last| x - last > close) {
            kept.push(x);
        }
    }
    if let Some(last) = kept.last_mut() {
        *last = hi;
    }
    if kept.len() < 2 {
        kept = vec![lo, hi];
    }
    kept
}

/// Allowed steps per unit of coordinate `d` in each of its cells.
fn bends(chart: &Chart<'_>, d: usize, cells: &[Vec<f64>; 2], chord: f64, angle: f64) -> Vec<f64> {
    let o = 1 - d;
    let across: Vec<f64> = {
        let [lo, hi] = [cells[o][0], cells[o][cells[o].len() - 1]];
        (0..9)
            .map(|i| lo + (hi - lo) * (f64::from(i) + 0.5) / 9.0)
            .collect()
    };
    cells[d]
        .windows(2)
        .map(|cell| {
            let width = cell[1] - cell[0];
            let h = 1e-4 * width;
            let mut most: f64 = 0.0;
            for s in [0.02, 0.25, 0.5, 0.75, 0.98] {
                for &y in &across {
                    let at = |x: f64| {
                        let uv = if d == 0 {
                            DVec2::new(x, y)
                        } else {
                            DVec2::new(y, x)
                        };
                        chart.tangents(uv)
                    };
                    let x = cell[0] + s * width;
                    let here = at(x);
                    let normal = here[1].cross(here[2]).normalize_or_zero();
                    let tangent = here[1 + d].length();
                    if tangent < 1e-12 {
                        continue;
                    }
                    let bend = (at(x + h)[1 + d] - at(x - h)[1 + d]) / (2.0 * h);
                    let l = bend.dot(normal).abs();
                    // sagitta of a chord: l step² / 8; turn of its tangent: l step / |tangent|
                    let by_chord = (l / (8.0 * chord)).sqrt();
                    let by_angle = l / (tangent * angle);
                    if by_chord.is_finite() && by_angle.is_finite() {
                        most = most.max(by_chord).max(by_angle);
                    }
                }
            }
            most
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brep::nurbs::NurbsCurve;
    use crate::brep::{Curve, Sense};
    use crate::math::DVec3;

    #[test]
    fn cells_end_where_a_surface_bends_in_this_turn_and_its_neighbours() {
        // a wall along a bent line, bent at 0.35 of its parameter
        let points = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 2.0, 0.0)];
        let knots = vec![0.0, 0.0, 0.35, 1.0, 1.0];
        let line = NurbsCurve::new(1, knots, points, Vec::new()).unwrap();
        let wall = Surface::Extrusion {
            profile: Curve::Nurbs(line).into(),
            direction: DVec3::Z,
        };
        let mut chart = Chart {
            surface: &wall,
            sense: Sense::Forward,
            periods: [None; 2],
            poles: Vec::new(),
            domain: wall.domain(),
            gap: 1e-5,
        };
        let ends = [0.0, 0.125, 0.25, 0.35, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0];
        assert_eq!(cell_ends(&chart, 0, [0.0, 1.0]), ends);
        assert_eq!(cell_ends(&chart, 1, [-3.0, 5.0]), [-3.0, 5.0]);
        // were it closed, a face over the seam would see the bends of the turns before and after
        chart.periods[0] = Some(1.0);
        let found = cell_ends(&chart, 0, [-0.8, 1.6]);
        for bend in [-0.65, 0.0, 0.35, 1.0, 1.35] {
            assert!(found.iter().any(|x| (x - bend).abs() < 1e-12), "{found:?}");
        }
        assert!(found.is_sorted() && found.first() == Some(&-0.8) && found.last() == Some(&1.6));
    }
}
