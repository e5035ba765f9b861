//! Parallel lines across regions: where they lie and the spans they have inside.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::{Region, Ring};

use crate::fill::settings::FillSettings;
use crate::fill::spacing::{Wish, positions};

/// Edges whose ends differ by less across the lines run along them, mm: the grid's rounding and the angle's.
const FLAT: f64 = 1e-4;
/// Lines keep this far from edges that run along them, mm, so that no line lies on one.
const CLEAR: f64 = 3e-4;

/// Where a line meets a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crossing {
    /// Position along the line.
    pub(crate) x: f64,
    /// Ring, counted over all rings of all regions.
    pub(crate) ring: usize,
    /// Edge of the ring, by its first vertex.
    pub(crate) edge: usize,
}

/// The part of a line inside the regions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    /// Position across the lines.
    pub(crate) y: f64,
    /// Left and right end.
    pub(crate) ends: [Crossing; 2],
}

impl Span {
    pub(crate) fn point(&self, end: usize) -> DVec2 {
        DVec2::new(self.ends[end].x, self.y)
    }

    pub(crate) fn length(&self) -> f64 {
        self.ends[1].x - self.ends[0].x
    }
}

/// What lies round the possible centres of beads.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Rim {
    /// The boundary, half a width away.
    Boundary,
    /// A contour this far away, mm.
    Contour(f64),
}

impl Rim {
    /// What an inset may have taken from the room of the lines, mm: that must not cost a line. Where lines end nearer to a contour than
    /// to each other, one that lay just as near beside it would be one too many.
    fn inset_lost(self, settings: &FillSettings) -> f64 {
        let lost = 2.0 * settings.tolerance;
        match self {
            Rim::Contour(away) if away < 0.75 * settings.stepover => -lost,
            Rim::Boundary | Rim::Contour(_) => lost,
        }
    }

    /// Depth of the line nearest to a round end, mm: on a chord there the line lies as far from the middle of the rim
    /// as beads beside each other may lie, and its ends not much nearer.
    fn round_end(self, settings: &FillSettings) -> f64 {
        let d = settings.stepover;
        match self {
            Rim::Boundary => ROUND_END * d,
            Rim::Contour(away) => RIM_MIDDLE * d - away,
        }
    }
}

/// The spans of each line, lines from below; `regions` holds the possible centres of beads.
pub(crate) fn spans(regions: &[Region], rim: Rim, settings: &FillSettings) -> Vec<Vec<Span>> {
    let rings: Vec<&Ring> = regions.iter().flat_map(Region::rings).collect();
    let wishes = wishes(&rings, rim, settings);
    let shortest = 0.15 * settings.width;
    positions(&wishes, rim.inset_lost(settings), settings)
        .into_iter()
        .map(|y| {
            let mut line = cut(&rings, y);
            line.retain(|s| s.length() > shortest);
            line
        })
        .collect()
}

/// The spans at `y`, from left to right.
fn cut(rings: &[&Ring], y: f64) -> Vec<Span> {
    let mut crossings = Vec::new();
    for (ring, points) in rings.iter().enumerate() {
        for (edge, &a) in points.iter().enumerate() {
            let b = points[(edge + 1) % points.len()];
            if (a.y > y) != (b.y > y) {
                let x = a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
                crossings.push(Crossing { x, ring, edge });
            }
        }
    }
    crossings.sort_by(|p, q| {
        p.x.total_cmp(&q.x)
            .then(p.ring.cmp(&q.ring))
            .then(p.edge.cmp(&q.edge))
    });
    crossings
        .as_chunks::<2>()
        .0
        .iter()
        .map(|&ends| Span { y, ends })
        .collect()
}

/// Where lines would lie best: at the extremes of the rings, moved inwards where the end is round so that the first
/// line has a length, and otherwise by [`CLEAR`].
fn wishes(rings: &[&Ring], rim: Rim, settings: &FillSettings) -> Vec<Wish> {
    let mut wishes: Vec<Wish> = rings
        .iter()
        .flat_map(|r| extremes(r, rim, settings))
        .collect();
    wishes.sort_by(|a, b| a.at.total_cmp(&b.at).then(b.flat.total_cmp(&a.flat)));
    let Some((first, last)) = wishes.first().copied().zip(wishes.last().copied()) else {
        return wishes;
    };
    // near ones are one: the flatter counts; beyond a few hundred the small ones do not matter
    let near = 0.1 * settings.stepover;
    let mut kept: Vec<Wish> = Vec::new();
    for wish in wishes {
        match kept.last_mut() {
            Some(before) if wish.at - before.at < near => {
                let flat = before.flat + wish.flat;
                if wish.flat > before.flat {
                    *before = wish;
                }
                before.flat = flat;
            }
            _ => kept.push(wish),
        }
    }
    if kept.len() > 200 {
        let mut flats: Vec<f64> = kept.iter().map(|w| w.flat).collect();
        flats.sort_by(|a, b| b.total_cmp(a));
        let least = flats[198];
        kept.retain(|w| w.flat > least);
    }
    kept.retain(|w| w.at > first.at + near && w.at < last.at - near);
    kept.insert(0, first);
    if last.at > first.at {
        kept.push(last);
    }
    kept
}

fn extremes(ring: &Ring, rim: Rim, settings: &FillSettings) -> Vec<Wish> {
    let n = ring.len();
    let mut found = Vec::new();
    let mut i = 0;
    while i < n {
        // the flat run that starts at vertex i, if the ring comes to it and leaves it on the same side
        let y = ring[i].y;
        let before = ring[(i + n - 1) % n];
        let mut run = 0;
        while run + 1 < n && (ring[(i + run + 1) % n].y - y).abs() < FLAT {
            run += 1;
        }
        let after = ring[(i + run + 1) % n];
        let comes = before.y - y;
        let last = (i + run) % n;
        let is_extreme = comes.abs() >= FLAT && comes * (after.y - y) > 0.0;
        let stands = || stands_out(ring, (i, last), comes.signum(), settings.tolerance);
        if is_extreme && run < n - 1 && stands() {
            // the region lies on the left: along its own lower end the ring goes from left to right
            let up = comes > 0.0;
            let end_of_region = if run > 0 {
                (ring[last].x > ring[i].x) == up
            } else {
                (ring[i] - before).perp_dot(after - ring[i]) > 0.0
            };
            let inwards = if up == end_of_region { 1.0 } else { -1.0 };
            let open = |depth: f64| opening(ring, (i, last), depth * comes.signum(), settings);
            let depth = if end_of_region {
                end_depth(open, rim, settings)
            } else {
                CLEAR
            };
            found.push(Wish {
                at: y + inwards * depth.max(CLEAR),
                flat: open(0.1 * settings.stepover),
            });
        } else if comes.abs() >= FLAT && run > 0 && run < n - 1 {
            // a shoulder, or one with a ripple
            let along = ring[last].x - ring[i].x;
            if along.abs() > 0.5 * settings.width {
                found.push(Wish {
                    at: y + along.signum() * CLEAR,
                    flat: along.abs(),
                });
            }
        }
        i += run + 1;
    }
    found
}

/// Whether the ring goes away from the extreme between two vertices by `far` on both sides before it goes beyond it: what does not is a ripple
/// of the rim, as where sections that differ by micrometres are united.
fn stands_out(ring: &Ring, (first, last): (usize, usize), side: f64, far: f64) -> bool {
    let n = ring.len();
    let leaves = |start: usize, step: usize| {
        let ways = (1..n).map(|k| (ring[(start + k * step) % n].y - ring[start].y) * side);
        let mut ends = ways.filter(|away| *away < 0.0 || *away >= far);
        // a ring that is smaller than that is no ripple of another
        ends.next().is_none_or(|away| away > 0.0)
    };
    leaves(first, n - 1) && leaves(last, 1)
}

/// Width of the ring's two sides at `depth` from the extreme between two vertices; ripples of the sides are none.
fn opening(ring: &Ring, (first, last): (usize, usize), depth: f64, settings: &FillSettings) -> f64 {
    let (n, y) = (ring.len(), ring[first].y);
    let reach = |start: usize, step: usize| {
        let mut at = start;
        // where the side has come deepest
        let mut deepest = (0.0, ring[start].x);
        for _ in 0..n {
            let next = (at + step) % n;
            let (p, q) = (ring[at], ring[next]);
            let (dp, dq) = ((p.y - y) * depth.signum(), (q.y - y) * depth.signum());
            if dp > deepest.0 {
                deepest = (dp, p.x);
            }
            if dq < deepest.0 - settings.tolerance {
                return deepest.1;
            }
            if dq >= depth.abs() {
                return p.x + (depth.abs() - dp) / (dq - dp) * (q.x - p.x);
            }
            at = next;
        }
        ring[start].x
    };
    (reach(first, n - 1) - reach(last, 1)).abs()
}

/// Distance of the line nearest to a round end from the middle of the contour there, stepovers.
const RIM_MIDDLE: f64 = 0.9;
/// The same, from where it would lie along a straight boundary.
const ROUND_END: f64 = 0.3;

/// How far inside an end of the region its first line lies: at once where the end is flat, on a chord where it is
/// round, and where a line has a length at all where it is pointed.
fn end_depth(open: impl Fn(f64) -> f64, rim: Rim, settings: &FillSettings) -> f64 {
    let (shortest, chord) = (0.7 * settings.width, rim.round_end(settings));
    let across = open(chord);
    if open(settings.tolerance) >= 0.5 * across {
        // clear of its ripples
        depth_of_width(open, 0.5 * across, settings.tolerance)
    } else if across >= shortest {
        chord
    } else {
        depth_of_width(open, shortest, 0.5 * settings.stepover)
    }
}

/// The depth at which an end is `width` wide, at most `deepest`.
fn depth_of_width(open: impl Fn(f64) -> f64, width: f64, deepest: f64) -> f64 {
    if open(CLEAR) >= width {
        return CLEAR;
    }
    let (mut low, mut high) = (CLEAR, deepest);
    if open(high) < width {
        return high;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if open(middle) < width {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Spans grouped into cells: within a cell each line has one span, and neighbouring spans face only each other.
pub(crate) fn cells(lines: &[Vec<Span>]) -> Vec<Vec<Span>> {
    let mut cells: Vec<Vec<Span>> = Vec::new();
    // for the spans of the line before: the cell each belongs to
    let mut open: Vec<usize> = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let below: &[Span] = if i > 0 { &lines[i - 1] } else { &[] };
        let faces = |a: &Span, b: &Span| a.ends[0].x < b.ends[1].x && b.ends[0].x < a.ends[1].x;
        let mut now = Vec::with_capacity(line.len());
        for span in line {
            let mut facing = below.iter().enumerate().filter(|(_, b)| faces(span, b));
            let only = facing.next().filter(|_| facing.next().is_none());
            let cell = only.and_then(|(k, b)| {
                let alone = line.iter().filter(|s| faces(s, b)).count() == 1;
                alone.then_some(open[k])
            });
            now.push(if let Some(cell) = cell {
                cells[cell].push(*span);
                cell
            } else {
                cells.push(vec![*span]);
                cells.len() - 1
            });
        }
        open = now;
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shoulder_counts_from_half_a_bead_on() {
        // a shoulder `run` long 6 mm above the bottom of a part 10 mm tall
        let wishes = |run: f64| {
            let left = 12.0 - run;
            let ring = [
                [0.0, 0.0],
                [20.0, 0.0],
                [20.0, 10.0],
                [12.0, 10.0],
                [12.0, 6.0],
                [left, 6.0],
                [left, 2.0],
                [0.0, 2.0],
            ];
            let ring = ring.map(DVec2::from_array).to_vec();
            let found = extremes(&ring, Rim::Boundary, &FillSettings::new(4.0, 3.0));
            found.iter().filter(|w| (w.at - 6.0).abs() < 0.1).count()
        };
        assert_eq!([wishes(1.0), wishes(3.0)], [0, 1]);
    }

    /// Sections that differ by micrometres are united to an outline with notches of a few: where its lines lie stays.
    #[test]
    fn a_ripple_of_the_rim_moves_no_line() {
        let settings = FillSettings::new(6.5, 4.8);
        let round = |ripple: f64| {
            let ring: Ring = (0..720)
                .map(|i| {
                    let turn = DVec2::from_angle(f64::from(i).to_radians() / 2.0);
                    turn * (77.0 - if i % 3 == 0 { ripple } else { 0.0 })
                })
                .collect();
            wishes(&[&ring], Rim::Contour(1.35), &settings)
        };
        let (smooth, rippled) = (round(0.0), round(0.003));
        assert_eq!([smooth.len(), rippled.len()], [2, 2]);
        for (a, b) in smooth.iter().zip(&rippled) {
            assert!((a.at - b.at).abs() < 0.01, "{smooth:?} {rippled:?}");
        }
    }

    #[test]
    fn an_end_is_as_wide_as_its_two_sides_lie_apart() {
        let settings = FillSettings::new(4.0, 3.0);
        let triangle = [[0.0, 1.0], [9.0, 10.0], [-6.0, 7.0]]
            .map(DVec2::from_array)
            .to_vec();
        // sides of slope 1 and -1 from the lowest corner, of 1/5 and 1 from the highest
        let [low, high] = [(0, 2.0), (1, -2.0)]
            .map(|(at, depth)| opening(&triangle, (at, at), depth, &settings).abs());
        assert!((low - 4.0).abs() < 1e-9, "{low}");
        assert!((high - 8.0).abs() < 1e-9, "{high}");
    }
}
