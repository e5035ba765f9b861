//! Marks that are drawn where others of their layer were drawn before: the same line exposed again, whole or in part.

use std::collections::HashMap;

use meltpath_geometry::math::DVec2;

/// Shorter marks, mm, are none.
const SHORT: f64 = 1e-4;
/// A mark that passes a place nearer than this share of the spot's diameter goes over it: half a standard deviation of its light. Ours.
const OVER: f64 = 0.125;
/// The sine of the angle up to which two marks run along each other.
const ALONG: f64 = 0.2;
/// Edge of the cells in which marks are found, spots; and places of a mark are no farther apart.
const CELL: f64 = 10.0;
/// Places at which a mark is looked at: not fewer, not more.
const PLACES: [f64; 2] = [3.0, 25.0];
/// Earlier marks looked at in a cell, the last ones: of more the oldest are not counted.
const LAST: usize = 2000;

/// A mark as it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnMark {
    /// From where to where, mm.
    pub ends: [DVec2; 2],
    /// When it begins, s.
    pub begin: f64,
    /// mm/s.
    pub speed: f64,
    /// W.
    pub power: f64,
}

impl DrawnMark {
    /// How far along it the place beside a point lies, and how far it is from there, mm; `None` beyond its ends.
    fn beside(&self, p: DVec2) -> Option<[f64; 2]> {
        let [a, b] = self.ends;
        let way = b - a;
        let length = way.length();
        let along = (p - a).dot(way) / length;
        (0.0..=length)
            .contains(&along)
            .then(|| [along, (p - a - way * (along / length)).length()])
    }

    fn direction(&self) -> DVec2 {
        (self.ends[1] - self.ends[0]).normalize_or_zero()
    }
}

/// What an earlier mark did at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// The mark.
    pub mark: DrawnMark,
    /// How far along it the place lies, mm.
    pub along: f64,
    /// How far beside it, mm.
    pub aside: f64,
    /// How long ago it passed, s.
    pub ago: f64,
    /// Whether it runs along the mark that is drawn now, whichever way.
    pub parallel: bool,
}

/// A place of a mark, and what was drawn over it before.
#[derive(Debug)]
pub struct DrawnOver<'a> {
    /// The place, mm.
    pub at: DVec2,
    /// Share of the mark for which it stands.
    pub share: f64,
    /// The earlier marks, in their order.
    pub before: &'a [Passed],
}

/// The marks of a layer, found by their places.
#[derive(Debug)]
pub struct MarksAgain {
    over: f64,
    cell: f64,
    marks: Vec<DrawnMark>,
    cells: HashMap<[i32; 2], Vec<u32>>,
}

impl MarksAgain {
    /// For a spot of that diameter, mm.
    pub fn new(spot: f64) -> Self {
        MarksAgain {
            over: OVER * spot,
            cell: CELL * spot,
            marks: Vec::new(),
            cells: HashMap::new(),
        }
    }

    fn cell_of(&self, p: DVec2) -> [i32; 2] {
        [p.x, p.y].map(|x| (x / self.cell).floor() as i32)
    }

    /// Takes the next mark; `told` hears each place of it that was drawn over before.
    pub fn take(&mut self, mark: DrawnMark, mut told: impl FnMut(&DrawnOver<'_>)) {
        let [a, b] = mark.ends;
        let length = a.distance(b);
        if length < SHORT {
            return;
        }
        let count = (length / self.cell).ceil().clamp(PLACES[0], PLACES[1]);
        let mut before = Vec::new();
        for k in 0..count as usize {
            let share = (k as f64 + 0.5) / count;
            let at = a.lerp(b, share);
            let Some(here) = self.cells.get(&self.cell_of(at)) else {
                continue;
            };
            let now = mark.begin + share * length / mark.speed;
            before.clear();
            for &n in &here[here.len().saturating_sub(LAST)..] {
                let earlier = self.marks[n as usize];
                let Some([along, aside]) = earlier.beside(at).filter(|b| b[1] <= self.over) else {
                    continue;
                };
                let sine = earlier.direction().perp_dot(mark.direction());
                before.push(Passed {
                    mark: earlier,
                    along,
                    aside,
                    ago: (now - earlier.begin - along / earlier.speed).max(0.0),
                    parallel: sine.abs() <= ALONG,
                });
            }
            if !before.is_empty() {
                let share = count.recip();
                told(&DrawnOver {
                    at,
                    share,
                    before: &before,
                });
            }
        }
        self.keep(mark, length);
    }

    /// Keeps a mark in the cells near which it goes.
    fn keep(&mut self, mark: DrawnMark, length: f64) {
        let number = self.marks.len() as u32;
        self.marks.push(mark);
        let [a, b] = mark.ends;
        let steps = (2.0 * length / self.cell).ceil().max(1.0);
        let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        for k in 0..=steps as usize {
            let p = a.lerp(b, k as f64 / steps);
            // within half a step along, and as far beside as it goes over places
            let room = 0.25 * self.cell + self.over;
            for corner in corners {
                let cell = self.cell_of(p + room * DVec2::from(corner));
                let here = self.cells.entry(cell).or_default();
                if here.last() != Some(&number) {
                    here.push(number);
                }
            }
        }
    }
}

/// How often places of a job are marked, and how soon again.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Again {
    /// Length of marks that lie along others of their layer, mm.
    pub length: f64,
    /// The most marks that lie along each other at one place.
    pub most: usize,
    /// The shortest time from one to the next at that place, s.
    pub soonest: f64,
    /// The number of its layer.
    pub layer: u32,
    /// The place, mm.
    pub at: DVec2,
}

impl Again {
    /// Counts a place of a mark of `length` mm.
    pub fn count(&mut self, layer: u32, length: f64, place: &DrawnOver<'_>) {
        let along = || place.before.iter().filter(|p| p.parallel);
        let marks = 1 + along().count();
        if marks < 2 {
            return;
        }
        self.length += place.share * length;
        let soonest = along().map(|p| p.ago).fold(f64::INFINITY, f64::min);
        if marks > self.most || (marks == self.most && soonest < self.soonest) {
            (self.most, self.soonest) = (marks, soonest);
            (self.layer, self.at) = (layer, place.at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is told of lines from one place to another, each at 1000 mm/s and 10 ms after the one before began.
    fn told(lines: &[[[f64; 2]; 2]]) -> Again {
        let mut marks = MarksAgain::new(0.1);
        let mut again = Again::default();
        for (k, line) in lines.iter().enumerate() {
            let mark = DrawnMark {
                ends: line.map(DVec2::from),
                begin: 0.01 * k as f64,
                speed: 1000.0,
                power: 100.0,
            };
            let length = mark.ends[0].distance(mark.ends[1]);
            marks.take(mark, |place| again.count(1, length, place));
        }
        again
    }

    #[test]
    fn a_line_is_found_again_whichever_way_it_runs_and_wherever_it_begins() {
        let line = |y: f64| [[0.0, y], [3.0, y]];
        assert_eq!(told(&[line(0.0), line(0.05)]), Again::default());
        let [a, b] = line(0.05);
        let again = told(&[line(0.05), line(0.0), [b, a]]);
        assert!(
            again.most == 2 && (again.length - 3.0).abs() < 1e-9,
            "{again:?}"
        );
        // 20 ms after the first began, which has passed the place where this one begins last
        assert!((0.017..0.02).contains(&again.soonest), "{again:?}");
        // a part of it, a little beside, and forty of them
        let part = told(&[line(0.0), [[1.0, 0.005], [1.4, 0.003]]]);
        assert!(
            part.most == 2 && (part.length - 0.4).abs() < 1e-3,
            "{part:?}"
        );
        let many: Vec<_> = (0..41)
            .map(|k| [[0.0, 2e-3 * f64::from(k % 5)], [0.3, 0.0]])
            .collect();
        assert_eq!(told(&many).most, 41);
    }

    #[test]
    fn curves_corners_and_crossings_are_not_drawn_again() {
        // facets of a circle, one after the other
        let at = |k: i32| {
            let (s, c) = (0.02 * f64::from(k)).sin_cos();
            [c, s]
        };
        let facets: Vec<_> = (0..300).map(|k| [at(k), at(k + 1)]).collect();
        assert_eq!(told(&facets), Again::default());
        let meander: Vec<_> = (0..20)
            .map(|k| [[0.0, 0.02 * f64::from(k)], [3.0, 0.02 * f64::from(k)]])
            .collect();
        assert_eq!(told(&meander), Again::default());
        let across: Vec<_> = (0..40)
            .flat_map(|k| {
                let x = 0.05 * f64::from(k);
                [[[0.0, x], [2.0, x]], [[x, 0.0], [x, 2.0]]]
            })
            .collect();
        assert_eq!(told(&across), Again::default());
    }
}
