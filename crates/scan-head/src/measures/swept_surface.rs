//! How much of a surface the spot sweeps, to any accuracy that is wanted: on rows across the surface, exact along each.
//!
//! Cells as wide as the spot beat with the hatch, so that a rate on them depends on where the grid lies and may exceed what the
//! spot's width over the hatch distance allows. Here each stroke covers an interval of each row it crosses. The rows lie at uneven
//! distances, so that no hatch keeps step with them.

use meltpath_geometry::math::DVec2;

use super::outline::{Outline, rows_within};
use super::sweep::{Covered, Line};

/// Rows across a surface, at most.
const ROWS: f64 = 4000.0;
/// Mean distance of rows over the spot's diameter, at least.
const FINEST: f64 = 0.01;
/// What rows resolve of a share: their halves may agree by chance.
const RESOLVED: f64 = 5e-4;
/// Where in its strip each row lies: multiples of the golden ratio fall into step with nothing.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The share of a surface that is swept, and one standard uncertainty of it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rate {
    /// The share.
    pub share: f64,
    /// How far two halves of the rows differ from their mean, at least what rows resolve; 0 where nothing but cells is counted.
    pub doubt: f64,
}

/// A row: what must be swept of it, and what was.
#[derive(Debug, Clone, Default)]
struct Row {
    wanted: Covered,
    swept: Covered,
}

/// A surface in rows along x.
#[derive(Debug, Clone)]
pub(super) struct SweptSurface {
    low: DVec2,
    /// Mean distance of rows, mm.
    step: f64,
    rows: Vec<Row>,
}

impl SweptSurface {
    fn within(low: DVec2, high: DVec2, spot: f64) -> Self {
        let height = (high.y - low.y).max(0.0);
        let step = (height / ROWS).max(FINEST * spot);
        let count = (height / step).ceil().clamp(0.0, ROWS) as usize;
        SweptSurface {
            low,
            step,
            rows: vec![Row::default(); count],
        }
    }

    /// A rectangle, for a spot of that diameter, mm.
    pub(super) fn rectangle(low: DVec2, high: DVec2, spot: f64) -> Self {
        let mut found = Self::within(low, high, spot);
        for row in &mut found.rows {
            row.wanted.add([0.0, high.x - low.x]);
        }
        found
    }

    /// What lies beside lines, at most half of `hatch` mm away.
    pub(super) fn beside_lines(lines: &[[DVec2; 2]], hatch: f64, spot: f64) -> Self {
        let half = 0.5 * hatch;
        let ends = || lines.iter().flatten();
        let low = ends().fold(DVec2::INFINITY, |l, p| l.min(*p)) - half;
        let high = ends().fold(DVec2::NEG_INFINITY, |h, p| h.max(*p)) + half;
        if lines.is_empty() {
            return Self::within(DVec2::ZERO, DVec2::ZERO, spot);
        }
        let mut found = Self::within(low, high, spot);
        for &line in lines {
            found.cut(line, half, |row, along| {
                if let Some(interval) = along.beside(line, half) {
                    row.wanted.add(interval);
                }
            });
        }
        found
    }

    /// What lies within an outline.
    pub(super) fn within_outline(outline: &Outline, spot: f64) -> Self {
        let points = || outline.boundaries.iter().flat_map(|b| &b.ring);
        let low = points().fold(DVec2::INFINITY, |l, p| l.min(*p));
        let high = points().fold(DVec2::NEG_INFINITY, |h, p| h.max(*p));
        if points().next().is_none() {
            return Self::within(DVec2::ZERO, DVec2::ZERO, spot);
        }
        let mut found = Self::within(low, high, spot);
        let heights: Vec<f64> = (0..found.rows.len()).map(|k| found.height(k)).collect();
        for (row, spans) in found
            .rows
            .iter_mut()
            .zip(rows_within(&outline.boundaries, &heights))
        {
            for span in spans {
                row.wanted.add(span.map(|x| x - low.x));
            }
        }
        if let Some((marks, near)) = &outline.near {
            found.keep_near(marks, *near);
        }
        found
    }

    /// What is wanted only where it lies within a distance of marks, mm.
    fn keep_near(&mut self, marks: &[[DVec2; 2]], near: f64) {
        for mark in marks {
            self.sweep(*mark, near);
        }
        for row in &mut self.rows {
            let mut beside = std::mem::take(&mut row.swept);
            row.wanted.keep(&mut beside);
        }
    }

    /// Where a row lies, mm.
    fn height(&self, k: usize) -> f64 {
        self.low.y + (k as f64 + (k as f64 * GOLDEN).fract()) * self.step
    }

    /// Does something with each row that a stroke of that radius may cross.
    fn cut(&mut self, [a, b]: [DVec2; 2], radius: f64, mut with: impl FnMut(&mut Row, Line)) {
        let from = (a.y.min(b.y) - radius - self.low.y) / self.step - 1.0;
        let to = (a.y.max(b.y) + radius - self.low.y) / self.step + 1.0;
        let end = (to.max(0.0) as usize).min(self.rows.len());
        for k in (from.max(0.0) as usize).min(end)..end {
            let along = Line {
                from: DVec2::new(self.low.x, self.height(k)),
                along: DVec2::X,
            };
            with(&mut self.rows[k], along);
        }
    }

    /// The spot of that radius, mm, goes from `a` to `b`.
    pub(super) fn sweep(&mut self, stroke: [DVec2; 2], radius: f64) {
        self.cut(stroke, radius, |row, along| {
            if let Some(interval) = along.swept(stroke, radius) {
                row.swept.add(interval);
            }
        });
    }

    /// The surface, mm², and the share that was swept.
    pub(super) fn rate(&mut self) -> (f64, Rate) {
        let mut halves = [[0.0; 2]; 2];
        for (k, row) in self.rows.iter_mut().enumerate() {
            let [swept, wanted] = row.wanted.covered_by(&mut row.swept);
            halves[k % 2][0] += swept;
            halves[k % 2][1] += wanted;
        }
        let [even, odd] = halves;
        let wanted = even[1] + odd[1];
        let share = |[swept, wanted]: [f64; 2]| if wanted > 0.0 { swept / wanted } else { 0.0 };
        let all = share([even[0] + odd[0], wanted]);
        let differ = 0.5 * (share(even) - share(odd)).abs();
        let rate = Rate {
            share: all,
            // nothing is doubtful where all is swept
            doubt: if all < 1.0 - RESOLVED {
                differ.max(RESOLVED)
            } else {
                differ
            },
        };
        (self.step * wanted, rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::outline::{Boundary, Within};

    /// A square with a square hole, lines over it and beside it: what is wanted is the square without its hole, near marks alone where
    /// that is a bound.
    #[test]
    fn an_outline_is_what_its_rings_enclose() {
        let square = |low: f64, high: f64| {
            let corners = [[low, low], [high, low], [high, high], [low, high]];
            corners.map(|[x, y]| DVec2::new(x, y)).to_vec()
        };
        let bound = |ring, within| Boundary { ring, within };
        let boundaries = vec![
            bound(square(0.0, 6.0), Within::Area),
            bound(square(2.0, 4.0), Within::Hole),
        ];
        let of = |near| {
            let outline = Outline {
                boundaries: boundaries.clone(),
                near,
            };
            let mut surface = SweptSurface::within_outline(&outline, 0.1);
            let across = [DVec2::new(-1.0, 3.0), DVec2::new(7.0, 3.0)];
            surface.sweep(across, 0.5);
            surface.rate()
        };
        let (area, rate) = of(None);
        assert!((area - 32.0).abs() < 0.05, "{area}");
        // 4 of 32 mm², the hole apart
        assert!((rate.share - 0.125).abs() < 2e-3, "{rate:?}");
        let mark = [DVec2::new(0.0, 3.0), DVec2::new(6.0, 3.0)];
        let (area, rate) = of(Some((vec![mark], 1.0)));
        assert!((area - 8.0).abs() < 0.05, "{area}");
        assert!((rate.share - 0.5).abs() < 4e-3, "{rate:?}");
    }

    /// Lines whose distance the spot does not bridge: what is swept is the spot's width over the hatch distance, wherever they lie
    /// and however they turn.
    #[test]
    fn what_lines_sweep_is_the_spot_over_the_hatch() {
        for (spot, hatch) in [(0.08, 0.12), (0.05, 0.075), (0.08, 0.1), (0.07, 0.1)] {
            for (turn, shift) in [(0.0, 0.0), (0.0, 0.037), (0.3, 0.01), (1.57, 0.0)] {
                let way = DVec2::from_angle(turn);
                let lines: Vec<[DVec2; 2]> = (0..40)
                    .map(|k| {
                        let from = way.perp() * (hatch * f64::from(k)) + DVec2::splat(shift);
                        [from, from + 6.0 * way]
                    })
                    .collect();
                let mut surface = SweptSurface::beside_lines(&lines, hatch, spot);
                for line in &lines {
                    surface.sweep(*line, 0.5 * spot);
                }
                let (area, rate) = surface.rate();
                assert!((area - 40.0 * 6.0 * hatch).abs() < 1e-2 * area, "{area}");
                let off = rate.share - spot / hatch;
                assert!(off.abs() < 2e-3, "{spot} {hatch} {turn}: {rate:?}");
                assert!(off.abs() < 4.0 * rate.doubt, "{off} {rate:?}");
            }
        }
    }
}
