//! What closed contours of a file's layers enclose and no mark comes near: lines that a file lost are missed by no measure of what is drawn.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_geometry::math::DVec2;
use meltpath_scan_head::measures::outline::{self, NEAR, Rings, boundaries, within};
use meltpath_scan_head::measures::segment::distance_to_segment;
use meltpath_toolpath::{Layer, Role};

use crate::lpbf::plan::work::{Source, Work};

/// Share of one enclosed area that may stay bare, %: a hatch that is drawn a little short of its contour.
const BARE: f64 = 2.0;
/// Edge of a cell, in hatch distances.
const CELL: f64 = 0.5;
/// Cells of a layer at most: those of a larger one are larger.
const CELLS: f64 = 16e6;
/// An area of a layer that stays bare.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bare {
    layer: u32,
    /// Share of what its contours enclose.
    share: f64,
    /// mm².
    enclosed: f64,
    /// A bare place.
    at: DVec2,
}

/// What was found in the layers of a file.
#[derive(Debug, Default)]
struct Found {
    /// Whether some layer has lines.
    filled: bool,
    /// Areas looked at, and how many of them stay bare by more than they may.
    areas: [usize; 2],
    worst: Option<Bare>,
}

impl Found {
    /// Looks at a layer whose lines lie `hatch` mm apart.
    fn take(&mut self, layer: &Layer, hatch: f64) {
        self.filled |= layer.passes().any(|p| p.head.role == Role::Fill);
        let rings = rings(layer);
        let boundaries = boundaries(&rings, hatch);
        let Some(cells) = Cells::of(&boundaries, hatch) else {
            return;
        };
        let marked = cells.marked(layer, NEAR * hatch);
        for area in cells.areas(&cells.enclosed(&boundaries)) {
            let bare: Vec<usize> = area.iter().copied().filter(|c| !marked[*c]).collect();
            let share = bare.len() as f64 / area.len() as f64;
            self.areas[0] += 1;
            self.areas[1] += usize::from(100.0 * share > BARE);
            if self.worst.is_none_or(|w| share > w.share) {
                self.worst = Some(Bare {
                    layer: layer.number,
                    share,
                    enclosed: area.len() as f64 * cells.edge * cells.edge,
                    at: cells.middle(bare.get(bare.len() / 2).copied().unwrap_or(area[0])),
                });
            }
        }
    }

    /// A file of contours alone asks for no lines.
    fn check(&self) -> Option<Check> {
        let worst = self.worst.filter(|_| self.filled)?;
        let check = Check::judge(
            "enclosed",
            "largest share of an area within closed contours that no mark comes near",
            Measure::exact(100.0 * worst.share, "%"),
            Limit::AtMost(BARE),
        );
        let place = Place {
            layer: Some(worst.layer),
            ..Place::at([worst.at.x, worst.at.y, 0.0])
        };
        if check.status == Status::Pass {
            return Some(check);
        }
        let [of, bare] = self.areas;
        let reason = format!(
            "of {} mm² in one area; {bare} of {of} areas of the file's layers; whether that is meant the file does not say",
            significant(worst.enclosed, 3)
        );
        let check = Check {
            status: Status::CannotSay,
            ..check
        };
        Some(check.because(&reason).at(place).remedy(
            "lines that the file lost: hatch the part anew; where contours alone, or lines of other layers, are to fill it, judge a file without these contours",
        ))
    }
}

/// Judges the layers of a file that have closed contours; `hatch` is the distance of their lines, mm, where the job does not say it. Whatever
/// cannot be read is told where it runs.
pub(in crate::lpbf) fn check(work: &Work, hatch: Option<f64>) -> Option<Check> {
    let Work::Layers(set) = work else {
        return None;
    };
    let Source::File(file) = &set.source else {
        return None;
    };
    let hatch = set.hatch.or(hatch)?;
    let mut found = Found::default();
    let layers = file.layers().ok()?;
    layers.flatten().for_each(|layer| found.take(&layer, hatch));
    found.check()
}

/// Cells over what the contours of a layer enclose.
struct Cells {
    low: DVec2,
    edge: f64,
    size: [usize; 2],
}

impl Cells {
    fn of(boundaries: &[&[DVec2]], hatch: f64) -> Option<Cells> {
        let points = || boundaries.iter().copied().flatten().copied();
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

    fn middle(&self, cell: usize) -> DVec2 {
        let at = [cell % self.size[0], cell / self.size[0]].map(|n| n as f64 + 0.5);
        self.low + self.edge * DVec2::from(at)
    }

    /// The cells of a row or column whose middles lie between two places.
    fn between(&self, axis: usize, [from, to]: [f64; 2]) -> std::ops::Range<usize> {
        let low = [self.low.x, self.low.y][axis];
        let at = |x: f64| ((x - low) / self.edge - 0.5).ceil().max(0.0) as usize;
        at(from)..at(to).min(self.size[axis])
    }

    /// Cells whose middles lie within an odd number of boundaries.
    fn enclosed(&self, boundaries: &[&[DVec2]]) -> Vec<bool> {
        let heights: Vec<f64> = (0..self.size[1])
            .map(|row| self.middle(row * self.size[0]).y)
            .collect();
        let spans = within(boundaries.iter().copied(), &heights);
        let mut enclosed = vec![false; self.size[0] * self.size[1]];
        for (row, spans) in spans.into_iter().enumerate() {
            for span in spans {
                enclosed[row * self.size[0]..][self.between(0, span)].fill(true);
            }
        }
        enclosed
    }

    /// Cells whose middles lie within a distance of a mark.
    fn marked(&self, layer: &Layer, within: f64) -> Vec<bool> {
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

    /// Areas of cells that hang together.
    fn areas(&self, enclosed: &[bool]) -> Vec<Vec<usize>> {
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

/// The closed contours of a layer.
fn rings(layer: &Layer) -> Rings {
    let contours = layer.passes().filter(|p| p.head.role == Role::Contour);
    let lines = contours.flat_map(|p| p.points.windows(2));
    outline::rings(lines.map(|two| [two[0].truncate(), two[1].truncate()]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_toolpath::PassHead;

    /// A layer of rectangles (x and y of two corners, which way round they run) and of lines along x, 0.1 mm apart, over others.
    fn layer(rings: &[([f64; 4], f64)], filled: &[[f64; 4]]) -> Layer {
        let mut layer = Layer::new(1, 0.0);
        let head = |role| PassHead {
            role,
            ..PassHead::default()
        };
        for ([x, y, u, v], way) in rings {
            let mut corners = vec![[*x, *y], [*u, *y], [*u, *v], [*x, *v], [*x, *y]];
            if *way < 0.0 {
                corners.reverse();
            }
            let points = corners.into_iter().map(|[x, y]| DVec3::new(x, y, 0.0));
            layer.polyline(head(Role::Contour), points);
        }
        for [x, y, u, v] in filled {
            for n in 0..((v - y) / 0.1).round() as u32 {
                let y = y + 0.1 * f64::from(n);
                layer.polyline(
                    head(Role::Fill),
                    [DVec3::new(*x, y, 0.0), DVec3::new(*u, y, 0.0)],
                );
            }
        }
        layer
    }

    fn said(layers: &[Layer]) -> Option<Check> {
        let mut found = Found::default();
        for layer in layers {
            found.take(layer, 0.1);
        }
        found.check()
    }

    fn passes(layers: &[Layer]) -> bool {
        said(layers).unwrap().status == Status::Pass
    }

    const WHOLE: [f64; 4] = [0.0, 0.0, 6.0, 4.0];

    #[test]
    fn lines_that_are_missing_are_told() {
        let half = layer(&[(WHOLE, 1.0)], &[[0.0, 0.0, 6.0, 2.0]]);
        let full = layer(&[(WHOLE, 1.0)], &[WHOLE]);
        assert!(passes(std::slice::from_ref(&full)));
        let check = said(&[full.clone(), half]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        // two hatch distances of the half are near its last line and its contour
        assert!((check.value.unwrap().value - 45.0).abs() < 2.0);
        // a layer that lost all its lines; a file of contours alone; one without contours
        let bare = layer(&[(WHOLE, 1.0)], &[]);
        assert!(!passes(&[full, bare.clone()]));
        assert_eq!(said(&[bare]), None);
        assert_eq!(said(&[layer(&[], &[[0.0, 0.0, 6.0, 2.0]])]), None);
    }

    /// One line may miss, as hatches that begin anew leave it; three in the middle of a layer may not, nor all of a small body beside a large
    /// one, nor five of six all over.
    #[test]
    fn few_lines_and_small_bodies_count() {
        let without = |gap: f64| {
            layer(
                &[(WHOLE, 1.0)],
                &[[0.0, 0.0, 6.0, 2.0], [0.0, 2.0 + gap, 6.0, 4.0]],
            )
        };
        assert!(passes(&[without(0.1)]));
        assert!(!passes(&[without(0.3)]));
        let small = [8.0, 0.0, 9.0, 1.0];
        let shell = layer(&[(WHOLE, 1.0), (small, 1.0)], &[WHOLE]);
        let check = said(&[shell]).unwrap();
        assert_eq!(check.status, Status::CannotSay);
        assert!((check.value.unwrap().value - 64.0).abs() < 6.0);
        let mut thin = layer(&[(WHOLE, 1.0)], &[]);
        for n in 0..7 {
            let y = 0.6 * f64::from(n);
            let head = PassHead {
                role: Role::Fill,
                ..PassHead::default()
            };
            let ends = [DVec3::new(0.0, y, 0.0), DVec3::new(6.0, y, 0.0)];
            thin.polyline(head, ends);
        }
        assert!(!passes(&[thin]));
    }

    /// A hatch that runs across, as one along: cells are looked for along each line alone.
    #[test]
    fn lines_across_fill_as_those_along() {
        let mut slant = layer(&[(WHOLE, 1.0)], &[]);
        for n in -60..100 {
            let x = 0.1 * 2.0_f64.sqrt() * f64::from(n);
            let head = PassHead {
                role: Role::Fill,
                ..PassHead::default()
            };
            let ends = [DVec3::new(x, 0.0, 0.0), DVec3::new(x + 4.0, 4.0, 0.0)];
            slant.polyline(head, ends);
        }
        assert!(passes(&[slant]));
    }

    /// Holes of either way round are not to be filled, islands in them are; contours side by side are one boundary.
    #[test]
    fn what_contours_enclose_is_theirs_without_holes() {
        let hole = [1.0, 0.5, 5.0, 3.5];
        let frame = [
            [0.0, 0.0, 6.0, 0.5],
            [0.0, 3.5, 6.0, 4.0],
            [0.0, 0.5, 1.0, 3.5],
            [5.0, 0.5, 6.0, 3.5],
        ];
        for way in [1.0, -1.0] {
            assert!(passes(&[layer(&[(WHOLE, 1.0), (hole, way)], &frame)]));
        }
        let inner = [0.1, 0.1, 5.9, 3.9];
        let half = [[0.0, 0.0, 6.0, 2.0]];
        assert!(!passes(&[layer(&[(inner, 1.0), (WHOLE, 1.0)], &half)]));
        let island = [2.0, 1.0, 4.0, 3.0];
        let rings = [(WHOLE, 1.0), (hole, -1.0), (island, 1.0)];
        let areas: f64 = 24.0 - 12.0 + 4.0;
        let found = super::rings(&layer(&rings, &[]));
        let boundaries = boundaries(&found, 0.1);
        let cells = Cells::of(&boundaries, 0.1).unwrap();
        let enclosed = cells.enclosed(&boundaries);
        let count = enclosed.iter().filter(|c| **c).count() as f64;
        assert!((count * cells.edge * cells.edge - areas).abs() < 0.5);
        assert_eq!(cells.areas(&enclosed).len(), 2);
    }
}
