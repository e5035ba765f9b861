//! Marks that lie on others of their layer: the same line exposed twice.

use std::collections::HashSet;

use meltpath_geometry::math::DVec2;

/// Ends nearer than this, mm, are the same.
const SAME: f64 = 1e-3;
/// Shorter marks, mm, are pieces of curves, whose ends are told apart badly.
const SHORT: f64 = 10.0 * SAME;

/// The marks of a layer by their ends, whichever is first.
#[derive(Debug, Default)]
pub(super) struct Drawn(HashSet<[i64; 4]>);

impl Drawn {
    /// Whether a mark lies on one that was taken before.
    pub(super) fn again(&mut self, ends: [DVec2; 2]) -> bool {
        if ends[0].distance(ends[1]) < SHORT {
            return false;
        }
        let cell = |p: DVec2| [p.x, p.y].map(|x| (x / SAME).round() as i64);
        let mut both = ends.map(cell);
        both.sort_unstable();
        let [[a, b], [c, d]] = both;
        !self.0.insert([a, b, c, d])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_again_whichever_way_it_runs() {
        let mut drawn = Drawn::default();
        let line = |y: f64| [DVec2::new(0.0, y), DVec2::new(3.0, y)];
        assert!(!drawn.again(line(0.0)) && !drawn.again(line(0.05)));
        let [a, b] = line(0.05);
        assert!(drawn.again([b, a]));
        // facets of a curve
        let facet = |k: u32| DVec2::new(1e-4 * f64::from(k), 1.0);
        assert!((0..50).all(|k| !drawn.again([facet(k), facet(k + 1)])));
    }
}
