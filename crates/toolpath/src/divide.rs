//! Ends a pass on its way and begins another one there.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::{DQuat, DVec3};

use crate::layer::{Layer, PassWriter};
use crate::pass::Pass;
use crate::toolpath::Toolpath;
use crate::vocabulary::{Channel, Event, Move, Neighbour, PassHead, PassId};

/// A place nearer than this to the end of a move is that end, mm.
const SAME_PLACE: f64 = 1e-6;

/// A place on the way of a pass.
#[derive(Clone, Copy)]
struct Cut {
    /// The move that it lies on, and at which share of it: above 0, and 1 for its end.
    index: usize,
    share: f64,
    point: DVec3,
}

impl Toolpath {
    /// Ends pass number `pass` of layer number `layer` of the list (both from 0) `at` mm along it, and lets another one of the same kind
    /// begin there with an identifier of its own. Values, tool axes, external axes and a weave that is on go on; a dwell stays with the
    /// second one. Beads beside it are divided with it; those that name it as beside them name the first one from then on. `false`, and
    /// nothing changed, where there is no such pass or the place is one of its ends.
    pub fn divide(&mut self, (layer, pass): (usize, usize), at: f64) -> bool {
        let ids = self.passes().map(|p| p.head.id.0);
        let id = PassId(ids.max().map_or(0, |id| id + 1));
        let divided = self.layers.get(layer).and_then(|l| l.divided(pass, at, id));
        match (self.layers.get_mut(layer), divided) {
            (Some(layer), Some(divided)) => {
                *layer = divided;
                true
            }
            _ => false,
        }
    }
}

impl Pass<'_> {
    /// The point `at` mm along the pass, and the number of its move; nothing beyond its ends.
    pub fn along(&self, at: f64) -> Option<(usize, DVec3)> {
        let cut = self.cut(at)?;
        Some((cut.index, cut.point))
    }

    fn cut(&self, at: f64) -> Option<Cut> {
        let mut begin = 0.0;
        for index in 0..self.move_count() {
            let length = self.move_length(index);
            if length > SAME_PLACE && at <= begin + length + SAME_PLACE {
                let share = ((at - begin) / length).clamp(0.0, 1.0);
                let point = match self.arc(index) {
                    Some(arc) => arc.at(share),
                    None => self.points[index].lerp(self.points[index + 1], share),
                };
                let end = (1.0 - share) * length <= SAME_PLACE;
                let (share, point) = if end {
                    (1.0, self.points[index + 1])
                } else {
                    (share, point)
                };
                return (at >= 0.0).then_some(Cut {
                    index,
                    share,
                    point,
                });
            }
            begin += length;
        }
        None
    }

    /// What the pass says at a share of a move, for the last point.
    fn pose_between(&self, to: &mut PassWriter<'_>, (i, share): (usize, f64)) {
        if let (Some(a), Some(b)) = (self.axis(i), self.axis(i + 1)) {
            let turn = DQuat::IDENTITY.slerp(DQuat::from_rotation_arc(a, b), share);
            to.axis((turn * a).normalize_or(a));
        }
        let between = |a: f64, b: f64| a + (b - a) * share;
        if let (Some(a), Some(b)) = (self.turn(i), self.turn(i + 1)) {
            to.turn(between(a, b));
        }
        let both = self.external(i).zip(self.external(i + 1)).enumerate();
        for (axis, values) in both {
            if let (Some(a), Some(b)) = values {
                to.external(axis, between(a, b));
            }
        }
    }
}

/// A part of a move.
fn part(pass: &Pass<'_>, i: usize, [from, to]: [f64; 2]) -> Move {
    match (pass.move_at(i), pass.arc(i)) {
        (Move::Arc { .. }, Some(arc)) => Move::Arc {
            via: Arc::at(&arc, 0.5 * (from + to)),
        },
        (Move::Arc { .. }, None) => Move::Line,
        (whole, _) => whole,
    }
}

impl Layer {
    /// The layer with a pass divided; nothing where it has no such place.
    fn divided(&self, index: usize, at: f64, id: PassId) -> Option<Layer> {
        let pass = self.get(index)?;
        let cut = pass.cut(at).filter(|c| c.index > 0 || c.share > 0.0)?;
        let length = pass.length();
        if length - at <= SAME_PLACE || at <= SAME_PLACE {
            return None;
        }
        let mut layer = Layer::new(self.number, self.height);
        for (i, pass) in self.passes().enumerate() {
            if i == index {
                layer.first_part(pass, cut);
                layer.second_part(pass, cut, id);
            } else {
                layer.push(pass.alone());
            }
        }
        let beside = |(i, n): &(u32, Neighbour)| -> Vec<(u32, Neighbour)> {
            match (*i as usize).cmp(&index) {
                std::cmp::Ordering::Less => vec![(*i, *n)],
                std::cmp::Ordering::Greater => vec![(*i + 1, *n)],
                std::cmp::Ordering::Equal => {
                    let before = clipped(*n, [0.0, at]).map(|n| (*i, n));
                    let after = clipped(*n, [at, length]).map(|n| (*i + 1, n));
                    before.into_iter().chain(after).collect()
                }
            }
        };
        layer.set_neighbours(self.neighbours.iter().flat_map(beside).collect());
        Some(layer)
    }

    fn first_part(&mut self, pass: Pass<'_>, cut: Cut) {
        let mut to = self.begin(pass.head, pass.points[0]);
        to.pose_of(pass, 0);
        let mut events = pass.events().peekable();
        for i in 0..=cut.index {
            while let Some((_, event)) = events.next_if(|e| e.0 == i) {
                to.event(event);
            }
            let last = i == cut.index;
            let share = if last { cut.share } else { 1.0 };
            let end = if last { cut.point } else { pass.points[i + 1] };
            to.go(part(&pass, i, [0.0, share]), end);
            to.values_of(pass, i);
            if last && pass.value(Channel::Dwell, i).is_some() {
                to.set(Channel::Dwell, 0.0);
            }
            to.pose_between_or_end(pass, (i, share));
        }
    }

    fn second_part(&mut self, pass: Pass<'_>, cut: Cut, id: PassId) {
        let head = PassHead { id, ..pass.head };
        let mut to = self.begin(head, cut.point);
        to.pose_between_or_end(pass, (cut.index, cut.share));
        let before = pass.events().filter(|e| e.0 <= cut.index);
        if let Some((_, Event::Weave(on))) = before.last()
            && on > 0
        {
            to.event(Event::Weave(on));
        }
        let mut events = pass.events().filter(|e| e.0 > cut.index).peekable();
        // a move that is whole in the first part is none of the second
        let first = cut.index + usize::from(cut.share >= 1.0);
        for i in first..pass.move_count() {
            while let Some((_, event)) = events.next_if(|e| e.0 == i) {
                to.event(event);
            }
            let from = if i == cut.index { cut.share } else { 0.0 };
            to.go(part(&pass, i, [from, 1.0]), pass.points[i + 1]);
            to.values_of(pass, i);
            to.pose_of(pass, i + 1);
        }
        for (_, event) in events {
            to.event(event);
        }
    }
}

impl PassWriter<'_> {
    /// What `pass` says at a share of a move, for the last point.
    fn pose_between_or_end(&mut self, pass: Pass<'_>, (i, share): (usize, f64)) {
        if share < 1.0 {
            pass.pose_between(self, (i, share));
        } else {
            self.pose_of(pass, i + 1);
        }
    }
}

/// The part of a neighbour within an interval, counted from the interval's begin.
fn clipped(n: Neighbour, [low, high]: [f64; 2]) -> Option<Neighbour> {
    let (from, to) = (n.from.max(low), n.to.min(high));
    (from < to).then_some(Neighbour {
        from: from - low,
        to: to - low,
        ..n
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vocabulary::{Role, Side};
    use proptest::prelude::*;

    /// A bead with an arc, axes, an external axis, speeds, a weave and a neighbour, between two others.
    fn beads() -> Toolpath {
        let mut layer = Layer::new(3, 0.05);
        let head = |id| PassHead {
            id: PassId(id),
            role: Role::Contour,
            ..PassHead::default()
        };
        layer.polyline(head(4), [DVec3::ZERO, DVec3::X]);
        let mut bead = layer.begin(head(7), DVec3::ZERO);
        bead.axis(DVec3::Z).external(0, 10.0).event(Event::Weave(1));
        bead.line_to(DVec3::X * 10.0).axis(DVec3::Y);
        bead.external(0, 20.0).set(Channel::Dwell, 0.5);
        let via = DVec3::new(20.0, 10.0, 0.0);
        bead.go(Move::Arc { via }, DVec3::new(10.0, 20.0, 0.0));
        bead.set(Channel::Speed, 8.0).axis(DVec3::Y);
        bead.line_to(DVec3::new(0.0, 20.0, 0.0));
        layer.polyline(head(8), [DVec3::Y, DVec3::ONE]);
        let beside = Neighbour {
            from: 2.0,
            to: 30.0,
            side: Side::Left,
            pass: PassId(8),
            distance: 4.6,
            layer: 3,
        };
        layer.set_neighbours(vec![(1, beside)]);
        Toolpath {
            profiles: vec![crate::toolpath::Profile::default()],
            weaves: vec![crate::vocabulary::Weave {
                shape: crate::vocabulary::WeaveShape::Sine,
                frequency: 2.0,
                amplitude: 1.0,
                dwell: [0.0; 2],
            }],
            layers: vec![layer],
            ..Toolpath::default()
        }
    }

    proptest! {
        /// Wherever a bead is divided, both parts together go where it went and say what it said.
        #[test]
        fn two_parts_are_the_whole(share in 0.001..0.999f64) {
            let whole = beads();
            let pass = whole.layers[0].pass(1);
            let at = share * pass.length();
            let mut divided = whole.clone();
            prop_assert!(divided.divide((0, 1), at));
            divided.sanity_check().unwrap();
            let layer = &divided.layers[0];
            prop_assert_eq!(layer.len(), 4);
            let [a, b] = [layer.pass(1), layer.pass(2)];
            prop_assert_eq!((a.head.id, b.head.id), (PassId(7), PassId(9)));
            prop_assert!((a.length() - at).abs() < 1e-6);
            prop_assert!((a.length() + b.length() - pass.length()).abs() < 1e-6);
            prop_assert_eq!(a.points.last(), b.points.first());
            prop_assert_eq!(a.axis(a.move_count()), b.axis(0));
            prop_assert_eq!(b.events().collect::<Vec<_>>(), [(0, Event::Weave(1))]);
            let beside = |p: &Pass<'_>| p.neighbours().map(|n| n.to - n.from).sum::<f64>();
            prop_assert!((beside(&a) + beside(&b) - 28.0).abs() < 1e-6);
            for s in [0.1, 0.4, 0.9] {
                let s = s * pass.length();
                let there = if s < at { a.along(s) } else { b.along(s - at) };
                prop_assert!(there.unwrap().1.distance(pass.along(s).unwrap().1) < 1e-6);
            }
        }
    }

    #[test]
    fn ends_and_passes_that_are_not_there_divide_nothing() {
        let whole = beads();
        let length = whole.layers[0].pass(1).length();
        for (pass, at) in [
            (1, 0.0),
            (1, length),
            (1, -1.0),
            (1, length + 1.0),
            (1, f64::NAN),
            (9, 1.0),
        ] {
            let mut divided = whole.clone();
            assert!(!divided.divide((0, pass), at), "{pass} {at}");
            assert_eq!(divided, whole);
        }
        // at a corner no move is cut
        let mut divided = whole.clone();
        assert!(divided.divide((0, 1), 10.0));
        let layer = &divided.layers[0];
        assert_eq!(
            (layer.pass(1).move_count(), layer.pass(2).move_count()),
            (1, 2)
        );
    }
}
