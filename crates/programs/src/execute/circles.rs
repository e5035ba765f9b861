//! Circular moves whose points tell no circle: where a move ends where it began, goes over one of its ends, or over a point of its line
//! that does not lie between them, what a controller does is not known.

use meltpath_geometry::math::DVec3;

use super::{Executed, ExecutedKind, Machine, Missing};

/// Programs hold no more digits, mm: points that are nearer are one.
const DIGIT: f64 = 1e-3;

/// Why three points tell no way from the first over the second to the third; nothing where they do. Points that lie in this order on a
/// straight line tell that line.
pub(super) fn no_way(from: DVec3, via: DVec3, end: DVec3) -> Option<&'static str> {
    let near = |a: DVec3, b: DVec3| a.distance(b) < DIGIT;
    if near(from, end) {
        return Some("it ends where it begins");
    }
    if near(via, from) {
        return Some("the point on its way is where it begins");
    }
    if near(via, end) {
        return Some("the point on its way is where it ends");
    }
    let chord = end - from;
    let along = chord.normalize_or_zero();
    let way = (via - from).dot(along);
    let beside = (via - from - along * way).length();
    (beside < DIGIT && !(0.0..=chord.length()).contains(&way))
        .then_some("the point on its way lies on the line through its ends, but not between them")
}

impl Machine<'_> {
    /// Tells circular moves whose points tell no circle: along a bead as a gap, elsewhere as a travel that is not known.
    pub(super) fn look_at_circles(&mut self) {
        let mut from = None;
        let mut found = Vec::new();
        for (index, step) in self.executed.iter().enumerate() {
            let Executed::Motion(m) = step else { continue };
            let end = m.target.position;
            if let (ExecutedKind::Circular { via }, Some(from)) = (m.kind, from)
                && let Some(why) = no_way(from, via, end)
            {
                found.push((index, why));
            }
            from = Some(end);
        }
        for (index, why) in found {
            self.tell_circle(index, why);
        }
    }

    /// Tells that points give no circle for a move among those executed.
    pub(super) fn tell_circle(&mut self, index: usize, why: &'static str) {
        let Some(Executed::Motion(m)) = self.executed.get(index) else {
            return;
        };
        // lines count from 1
        let place = (m.program as usize, m.line.saturating_sub(1) as usize);
        let burns = m.arc.is_some();
        let at = std::mem::replace(&mut self.at, place);
        if burns {
            self.gap(Missing::Circle(why));
        } else {
            self.leaves_out(Missing::Circle(why));
        }
        self.at = at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_that_tell_no_way() {
        let x = |x: f64| DVec3::new(x, 0.0, 0.0);
        let side = DVec3::new(40.0, 30.0, 0.0);
        assert_eq!(no_way(x(0.0), side, x(80.0)), None);
        // more than half a circle, with a point far behind its end
        assert_eq!(no_way(x(0.0), DVec3::new(90.0, 30.0, 0.0), x(80.0)), None);
        assert_eq!(no_way(x(0.0), x(40.0), x(80.0)), None);
        for (via, end) in [
            (side, x(0.0)),
            (x(0.0), x(80.0)),
            (x(80.0), x(80.0)),
            (x(90.0), x(80.0)),
            (x(-10.0), x(80.0)),
        ] {
            assert!(no_way(x(0.0), via, end).is_some(), "{via} {end}");
        }
    }
}
