//! Cells over a layer: which of them contours enclose, and marks come near.

use meltpath_geometry::math::DVec2;
use meltpath_scan_head::measures::outline::{Boundary, rows_within};
use meltpath_scan_head::measures::segment::distance_to_segment;
use meltpath_toolpath::{Layer, Role};

/// Edge of a cell, in hatch distances.
const CELL: f64 = 0.5;
/// Cells of a layer at most: those of a larger one are larger.
const CELLS: f64 = 16e6;

/// Ways to neighbours of a cell that lie before it in a row from below, in edges, so that ways over cells are as long as straight ones within
/// 5 %: G. Borgefors, Distance transformations in digital images, 1986.
const STEPS: [([isize; 2], f64); 4] = [
    ([1, 0], 0.955),
    ([0, 1], 0.955),
    ([1, 1], 1.369),
    ([-1, 1], 1.369),
];

/// Cells over what the contours of a layer enclose.
pub(super) struct Cells {
    low: DVec2,
    /// Of a cell, mm.
    pub(super) edge: f64,
    size: [usize; 2],
}

impl Cells {
    /// Over what boundaries enclose; none where there are none.
    pub(super) fn of(boundaries: &[Boundary], hatch: f64) -> Option<Cells> {
        let points = || boundaries.iter().flat_map(|b| &b.ring).copied();
        let low = points().reduce(DVec2::min)?;
        let extent = points().reduce(DVec2::max)? - low;
        let edge = (CELL * hatch).max((extent.x * extent.y / CELLS).sqrt());
        let cells = |length: f64| (length / edge).ceil().max(1.0) as usize;
        (edge > 0.0 && edge.is_finite()).then(|| Cells {
            low,
            edge,
            size: [cells(extent.x), cells(extent.y)],
        })
    }

    /// The middle of a cell, mm.
    pub(super) fn middle(&self, cell: usize) -> DVec2 {
        let at = [cell % self.size[0], cell / self.size[0]].map(|n| n as f64 + 0.5);
        self.low + self.edge * DVec2::from(at)
    }

    /// The cells of a row or column whose middles lie between two places.
    fn between(&self, axis: usize, [from, to]: [f64; 2]) -> std::ops::Range<usize> {
        let low = [self.low.x, self.low.y][axis];
        let at = |x: f64| ((x - low) / self.edge - 0.5).ceil().max(0.0) as usize;
        at(from)..at(to).min(self.size[axis])
    }

    /// Cells whose middles are enclosed.
    pub(super) fn enclosed(&self, boundaries: &[Boundary]) -> Vec<bool> {
        let heights: Vec<f64> = (0..self.size[1])
            .map(|row| self.middle(row * self.size[0]).y)
            .collect();
        let spans = rows_within(boundaries, &heights);
        let mut enclosed = vec![false; self.size[0] * self.size[1]];
        for (row, spans) in spans.into_iter().enumerate() {
            for span in spans {
                enclosed[row * self.size[0]..][self.between(0, span)].fill(true);
            }
        }
        enclosed
    }

    /// Whether some cell of `these` has its middle within a distance of a place, or is the one of that place.
    pub(super) fn any_within(&self, these: &[bool], p: DVec2, within: f64) -> bool {
        let at = ((p - self.low) / self.edge).floor();
        let cell = |x: f64, y: f64| {
            let inside = x >= 0.0 && y >= 0.0;
            let [x, y] = [x, y].map(|n| n as usize);
            (inside && x < self.size[0] && y < self.size[1]).then(|| y * self.size[0] + x)
        };
        if cell(at.x, at.y).is_some_and(|c| these[c]) {
            return true;
        }
        let [xs, ys] = [0, 1].map(|axis| {
            let place = [p.x, p.y][axis];
            self.between(axis, [place - within, place + within])
        });
        let mut near = ys.flat_map(|y| xs.clone().map(move |x| y * self.size[0] + x));
        near.any(|c| these[c] && self.middle(c).distance(p) <= within)
    }

    /// Cells whose middles lie within a distance of a mark.
    pub(super) fn marked(&self, layer: &Layer, within: f64) -> Vec<bool> {
        let mut marked = vec![false; self.size[0] * self.size[1]];
        let passes = layer.passes();
        let passes = passes.filter(|p| matches!(p.head.role, Role::Fill | Role::Contour));
        for two in passes.flat_map(|p| p.points.windows(2)) {
            let [a, b] = [two[0].truncate(), two[1].truncate()];
            let along = b - a;
            for row in self.between(1, [a.y.min(b.y) - within, a.y.max(b.y) + within]) {
                let y = self.middle(row * self.size[0]).y;
                // of the line what lies so near the row
                let share = |y: f64| ((y - a.y) / along.y).clamp(0.0, 1.0);
                let shares = if along.y == 0.0 {
                    [0.0, 1.0]
                } else {
                    [share(y - within), share(y + within)]
                };
                let [p, q] = shares.map(|s| a.x + s * along.x);
                for column in self.between(0, [p.min(q) - within, p.max(q) + within]) {
                    let cell = row * self.size[0] + column;
                    marked[cell] =
                        marked[cell] || distance_to_segment(self.middle(cell), a, b) <= within;
                }
            }
        }
        marked
    }

    /// The cell of `these` that lies deepest among them, and how far its middle lies from what is none of them, mm; `None` where there is none.
    pub(super) fn deepest(&self, these: &[bool]) -> Option<(usize, f64)> {
        if !these.contains(&true) {
            return None;
        }
        let [columns, rows] = self.size;
        let mut depth: Vec<f64> = these
            .iter()
            .map(|t| if *t { f64::MAX } else { 0.0 })
            .collect();
        // twice over all, from the cells that are known already: beyond the edge nothing is one of these
        let count = these.len();
        for back in [1, -1] {
            for n in 0..count {
                let here = if back > 0 { n } else { count - 1 - n };
                if depth[here] == 0.0 {
                    continue;
                }
                let [x, y] = [here % columns, here / columns];
                let known = |[dx, dy]: [isize; 2]| {
                    let at = [x.checked_add_signed(dx), y.checked_add_signed(dy)];
                    let inside = at[0].zip(at[1]).filter(|(x, y)| *x < columns && *y < rows);
                    inside.map_or(0.0, |(x, y)| depth[y * columns + x])
                };
                let near = STEPS.map(|(to, way)| known(to.map(|d| -back * d)) + way);
                depth[here] = near.into_iter().fold(depth[here], f64::min);
            }
        }
        let depths = depth.iter().enumerate().filter(|(_, d)| **d > 0.0);
        let (cell, depth) = depths.max_by(|a, b| a.1.total_cmp(b.1))?;
        Some((cell, (depth - 0.5) * self.edge))
    }

    /// Of cells that hang together, by edges or corners, those that reach farthest: the one in their middle, and how far they reach, mm; `None`
    /// where there is none.
    pub(super) fn longest(&self, these: &[bool]) -> Option<(usize, f64)> {
        let [columns, rows] = self.size;
        let mut left = these.to_vec();
        let mut found: Option<(usize, f64)> = None;
        for first in 0..left.len() {
            if !std::mem::take(&mut left[first]) {
                continue;
            }
            let mut together = vec![first];
            let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
            let mut next = 0;
            while let Some(&cell) = together.get(next) {
                next += 1;
                let [x, y] = [cell % columns, cell / columns];
                (low, high) = (low.min(self.middle(cell)), high.max(self.middle(cell)));
                let beside = (y.saturating_sub(1)..(y + 2).min(rows))
                    .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(columns)).map(move |x| [x, y]));
                let open = beside.map(|[x, y]| y * columns + x);
                together.extend(open.filter(|c| std::mem::take(&mut left[*c])));
            }
            let length = low.distance(high) + self.edge;
            if found.is_none_or(|f| length > f.1) {
                found = Some((together[together.len() / 2], length));
            }
        }
        found
    }

    /// Areas of cells that hang together.
    pub(super) fn areas(&self, enclosed: &[bool]) -> Vec<Vec<usize>> {
        let [columns, rows] = self.size;
        let mut left = enclosed.to_vec();
        let mut areas = Vec::new();
        for first in 0..left.len() {
            if !std::mem::take(&mut left[first]) {
                continue;
            }
            let mut area = vec![first];
            let mut next = 0;
            while let Some(&cell) = area.get(next) {
                next += 1;
                let [x, y] = [cell % columns, cell / columns];
                let beside = [
                    (x > 0).then(|| cell - 1),
                    (x + 1 < columns).then(|| cell + 1),
                    (y > 0).then(|| cell - columns),
                    (y + 1 < rows).then(|| cell + columns),
                ];
                let open = beside.into_iter().flatten();
                area.extend(open.filter(|c| std::mem::take(&mut left[*c])));
            }
            areas.push(area);
        }
        areas
    }
}
