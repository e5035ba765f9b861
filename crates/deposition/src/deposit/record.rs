//! What a deposition tells: per layer, along the path, at arc starts and where metal piles up.

use meltpath_geometry::math::DVec3;
use serde::{Deserialize, Serialize};

/// Mean, extremes and scatter of a quantity over a layer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub greatest: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// Number of values.
    pub count: usize,
}

impl Spread {
    /// Of the finite values; `None` when there are none.
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let finite = values.filter(|v| v.is_finite());
        let (mut sum, mut count) = (0.0, 0usize);
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in finite.clone() {
            sum += v;
            count += 1;
            least = least.min(v);
            greatest = greatest.max(v);
        }
        if count == 0 {
            return None;
        }
        let mean = sum / count as f64;
        let square: f64 = finite.map(|v| (v - mean) * (v - mean)).sum();
        Some(Spread {
            mean,
            least,
            greatest,
            sigma: (square / count as f64).sqrt(),
            count,
        })
    }
}

/// A place on the path of a bead.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PathPoint {
    /// Tool point, mm, part frame.
    pub tool: DVec3,
    /// Time, s.
    pub time: f64,
    /// Command being executed.
    pub command: u32,
    /// Bead of the layer, counted from 0.
    pub bead: u32,
    /// Contact tube to part, mm: nominal distance plus the tool point's height over the surface found by this bead.
    pub ctwd: f64,
    /// Wire fed here over what the program asks for at the reference distance.
    pub feed: f64,
    /// The bead's axis in plan (behind the torch), and the surface left on it, mm.
    pub crest: DVec3,
    /// Thickness laid on the axis by this bead, mm.
    pub thickness: f64,
}

impl PathPoint {
    /// Where the contact tube is.
    pub fn distance(&self) -> TubeDistance {
        TubeDistance {
            distance: self.ctwd,
            tool: self.tool,
            time: self.time,
            command: self.command,
        }
    }
}

/// Where the torch is, when, and by which command.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moment {
    pub(crate) tool: DVec3,
    pub(crate) time: f64,
    pub(crate) command: u32,
}

/// Where and when the contact tube was at a distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TubeDistance {
    /// Contact tube to part, mm.
    pub distance: f64,
    /// Tool point, mm.
    pub tool: DVec3,
    /// Time, s.
    pub time: f64,
    /// Command being executed.
    pub command: u32,
}

/// An ignition of the arc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ArcStart {
    /// Tool point, mm.
    pub position: DVec3,
    /// Time, s.
    pub time: f64,
    /// Command being executed.
    pub command: u32,
}

/// A place where metal piles up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Accumulation {
    /// Highest point of the pile, mm.
    pub position: DVec3,
    /// Thickness over a bead's width of path, over the mean of the layer.
    pub ratio: f64,
}

/// One layer as it was laid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LayerRecord {
    /// Layer, as the caller numbers it.
    pub layer: u32,
    /// Number of beads.
    pub beads: u32,
    /// Wire fed, mm.
    pub wire: f64,
    /// Metal laid, mm³.
    pub volume: f64,
    /// Time with the arc on, s.
    pub arc_time: f64,
    /// Length of beads, mm.
    pub length: f64,
    /// Length of beads of which more than a quarter of the width hangs out over what lies below, mm.
    pub hanging: f64,
    /// Height of the crests, mm, over the middle of the beads (starts and ends excluded).
    pub crest: Option<Spread>,
    /// Thickness of the beads on their axis, mm, likewise.
    pub thickness: Option<Spread>,
    /// Contact tube to part, mm, over the whole length.
    pub ctwd: Option<Spread>,
    /// Where the contact tube was nearest and farthest, of every simulated sample.
    pub tube: Option<[TubeDistance; 2]>,
    /// Wire fed over what the program asks for, over the whole length.
    pub feed: Option<Spread>,
    /// Ignitions.
    pub arc_starts: Vec<ArcStart>,
    /// Places where metal piles up.
    pub accumulations: Vec<Accumulation>,
    /// Places along the beads, in order of time.
    pub path: Vec<PathPoint>,
}

impl LayerRecord {
    pub(crate) fn new(layer: u32) -> Self {
        LayerRecord {
            layer,
            beads: 0,
            wire: 0.0,
            volume: 0.0,
            arc_time: 0.0,
            length: 0.0,
            hanging: 0.0,
            crest: None,
            thickness: None,
            ctwd: None,
            tube: None,
            feed: None,
            arc_starts: Vec::new(),
            accumulations: Vec::new(),
            path: Vec::new(),
        }
    }

    /// Notes a distance of the contact tube.
    pub(crate) fn reach(&mut self, at: TubeDistance) {
        let [nearest, farthest] = self.tube.get_or_insert([at, at]);
        if at.distance < nearest.distance {
            *nearest = at;
        }
        if at.distance > farthest.distance {
            *farthest = at;
        }
    }

    /// Statistics once the layer is whole. `ends` is the length at each end of a bead that is left out of crest and
    /// thickness, mm; `limit` the excess from which a place is an accumulation; `width` that of the bead: over such a length
    /// thickness is taken, and two accumulations lie so far apart.
    pub(crate) fn close(&mut self, ends: f64, limit: f64, width: f64) {
        let middle = middle_of_beads(&self.path, ends);
        let inner = |f: fn(&PathPoint) -> f64| {
            let picked = self.path.iter().zip(&middle).filter(|(_, m)| **m);
            Spread::of(picked.map(|(p, _)| f(p)))
        };
        self.crest = inner(|p| p.crest.z);
        self.thickness = inner(|p| p.thickness);
        self.ctwd = Spread::of(self.path.iter().map(|p| p.ctwd));
        self.feed = Spread::of(self.path.iter().map(|p| p.feed));
        let Some(mean) = self.thickness.map(|t| t.mean).filter(|m| *m > 0.0) else {
            return;
        };
        let thickness = mean_along(&self.path, |p| (p.bead, p.tool, p.thickness), width);
        let mut high: Vec<(f64, DVec3)> = (thickness.iter().zip(&self.path))
            .map(|(t, p)| (t / mean, p.crest))
            .filter(|(ratio, _)| *ratio > 1.0 + limit)
            .collect();
        high.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (ratio, position) in high {
            let known =
                |a: &Accumulation| a.position.truncate().distance(position.truncate()) < width;
            if !self.accumulations.iter().any(known) {
                self.accumulations.push(Accumulation { position, ratio });
            }
        }
    }
}

/// The mean of a value over a length of bead round each point, mm; over what there is of it where the bead begins or ends.
/// `of` tells of a point its bead, its place, mm, and its value. The highest of ten thousand single places is the luck of the cells
/// beneath them; over a length it is what a gauge finds.
///
/// ```
/// use meltpath_deposition::deposit::mean_along;
/// use meltpath_geometry::math::DVec3;
///
/// let point = |x: u32| (0, DVec3::X * f64::from(x), f64::from(x));
/// let means = mean_along(&[0, 1, 2, 3, 4].map(point), |p| *p, 2.0);
/// assert_eq!(means, [0.5, 1.0, 2.0, 3.0, 3.5]);
/// ```
pub fn mean_along<T>(points: &[T], of: impl Fn(&T) -> (u32, DVec3, f64), length: f64) -> Vec<f64> {
    let mut means = Vec::with_capacity(points.len());
    for bead in points.chunk_by(|a, b| of(a).0 == of(b).0) {
        // where each point lies along the bead, and the sum of the value up to there
        let mut along = vec![(0.0, 0.0)];
        for w in bead.windows(2) {
            let [(_, from, a), (_, to, b)] = [of(&w[0]), of(&w[1])];
            let (way, sum) = along.last().copied().unwrap_or_default();
            let step = from.distance(to);
            along.push((way + step, sum + 0.5 * (a + b) * step));
        }
        let total = along.last().map_or(0.0, |l| l.0);
        // the value is linear between points
        let sum_to = |way: f64| {
            let next = along.partition_point(|a| a.0 < way).min(bead.len() - 1);
            let Some(before) = next.checked_sub(1) else {
                return 0.0;
            };
            let step = along[next].0 - along[before].0;
            let share = if step > 0.0 {
                (way - along[before].0) / step
            } else {
                0.0
            };
            let [a, b] = [of(&bead[before]).2, of(&bead[next]).2];
            along[before].1 + step * share * (a + 0.5 * share * (b - a))
        };
        means.extend(bead.iter().zip(&along).map(|(point, (way, _))| {
            let [from, to] = [
                (way - 0.5 * length).max(0.0),
                (way + 0.5 * length).min(total),
            ];
            if to > from {
                (sum_to(to) - sum_to(from)) / (to - from)
            } else {
                of(point).2
            }
        }));
    }
    means
}

/// Which points lie farther than `ends` from both ends of their bead; all of them on beads shorter than that.
fn middle_of_beads(path: &[PathPoint], ends: f64) -> Vec<bool> {
    let mut middle = vec![true; path.len()];
    let mut start = 0;
    for chunk in path.chunk_by(|a, b| a.bead == b.bead) {
        let mut along = vec![0.0; chunk.len()];
        for (i, w) in chunk.windows(2).enumerate() {
            along[i + 1] = along[i] + w[0].crest.truncate().distance(w[1].crest.truncate());
        }
        let total = along.last().copied().unwrap_or(0.0);
        if total > 3.0 * ends {
            for (i, s) in along.iter().enumerate() {
                middle[start + i] = *s > ends && *s < total - ends;
            }
        }
        start += chunk.len();
    }
    middle
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two beads of 5 and 2 mm with a point each mm, one after the other.
    #[test]
    fn the_middle_of_a_bead_is_far_from_its_ends() {
        let point = |bead: u32, x: u32| PathPoint {
            tool: DVec3::ZERO,
            time: 0.0,
            command: 0,
            bead,
            ctwd: 12.0,
            feed: 1.0,
            crest: DVec3::new(3.0 + 0.6 * f64::from(x), 0.8 * f64::from(x), 1.0),
            thickness: 2.0,
        };
        let path: Vec<_> = (0..6)
            .map(|x| point(0, x))
            .chain((0..3).map(|x| point(1, x)))
            .collect();
        let found = middle_of_beads(&path, 1.5);
        // the second is shorter than three times its ends: all of it counts
        let long = [false, false, true, true, false, false];
        assert_eq!(found[..6], long);
        assert_eq!(found[6..], [true; 3]);
    }
}
