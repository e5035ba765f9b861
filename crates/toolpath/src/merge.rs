//! Leaves out points of beads that follow one another faster than a controller plans moves, where the bead hardly goes elsewhere without them.

use meltpath_geometry::math::DVec3;

use crate::layer::Layer;
use crate::pass::Pass;
use crate::toolpath::{Profile, Toolpath};
use crate::vocabulary::{Channel, Move};

/// So many points are left out at most one after the other: each is held against the move that they become.
const MOST: usize = 64;
/// An arc is as good as unchanged where its end moves by this share of its length, and of the chord.
const END: [f64; 2] = [0.01, 0.1];

/// How far a tool axis (as the length of a unit vector's difference), a turn (rad) or an external axis (mm or rad) may be from where it is
/// said to be: a sixth of a degree, less than a cell is calibrated to.
const POSE: f64 = 3e-3;

impl Toolpath {
    /// Merges straight moves of beads that take less than `least` s into those beside them, as long as the way stays within `chord` mm of every
    /// point left out and the poses said there are those between the poses kept. An arc takes a move that is far shorter than it and `chord`: it then
    /// begins or ends where that did. Ends, events, spots and places where the tool dwells stay. A move that was merged says what the longest of its
    /// parts said. Returns how many points were left out.
    pub fn merge_short_moves(&mut self, least: f64, chord: f64) -> usize {
        let mut merged = 0;
        for layer in &mut self.layers {
            let kept: Vec<Option<Vec<usize>>> = layer
                .passes()
                .map(|pass| kept(&pass, self.profiles.as_slice(), (least, chord)))
                .collect();
            if kept.iter().all(Option::is_none) {
                continue;
            }
            let before = layer.point_count();
            *layer = with(layer, &kept);
            merged += before - layer.point_count();
        }
        merged
    }
}

/// The points of a pass that stay; `None` where all do.
fn kept(pass: &Pass<'_>, profiles: &[Profile], (least, chord): (f64, f64)) -> Option<Vec<usize>> {
    if !pass.head.role.deposits() {
        return None;
    }
    let set = profiles.get(pass.head.profile as usize);
    let dwell = |i| pass.value(Channel::Dwell, i).or(set.map(|p| p.dwell));
    let speed = |i| pass.value(Channel::Speed, i).or(set.map(|p| p.speed));
    let short = |i: usize, length: f64| speed(i).is_some_and(|speed| length < least * speed);
    let last = pass.move_count();
    let mut kept = vec![0];
    for i in 1..last {
        let from = *kept.last().unwrap_or(&0);
        let beside = short(i - 1, pass.points[from].distance(pass.points[i]))
            || short(i, pass.move_length(i));
        let merges = i - from < MOST && beside && nothing_said(pass, dwell, i);
        if !(merges && (between(pass, [from, i + 1], chord) || at_an_arc(pass, [from, i], chord))) {
            kept.push(i);
        }
    }
    kept.push(last);
    (kept.len() <= last).then_some(kept)
}

/// Whether nothing but the way itself is said at point `i`.
fn nothing_said(pass: &Pass<'_>, dwell: impl Fn(usize) -> Option<f64>, i: usize) -> bool {
    let dwells = dwell(i - 1).is_some_and(|time| time > 0.0);
    !dwells && pass.events().all(|(point, _)| point != i)
}

/// Whether point `i`, the next after `from`, lies between an arc and a straight move that its end may take in.
fn at_an_arc(pass: &Pass<'_>, [from, i]: [usize; 2], chord: f64) -> bool {
    let taken = |line: usize, arc: usize, end: usize| {
        let length = pass.move_length(line);
        pass.move_at(line) == Move::Line
            && pass.arc(arc).is_some_and(|a| length <= END[0] * a.length())
            && length <= END[1] * chord
            && same_pose(pass, [end, i, end], 0.0)
    };
    from + 1 == i && (taken(i - 1, i, i - 1) || taken(i, i - 1, i + 1))
}

/// Whether straight moves lead from one point to another, and all points between lie on the way between the two, poses too.
fn between(pass: &Pass<'_>, [from, to]: [usize; 2], chord: f64) -> bool {
    if (from..to).any(|k| pass.move_at(k) != Move::Line) {
        return false;
    }
    let (a, b) = (pass.points[from], pass.points[to]);
    let along = b - a;
    (from + 1..to).all(|i| {
        let share = share(pass.points[i] - a, along);
        let far = pass.points[i].distance(a + share * along);
        far <= chord && same_pose(pass, [from, i, to], share)
    })
}

/// Where along a way the nearest place to `point` lies, 0 to 1; both from the way's begin.
fn share(point: DVec3, along: DVec3) -> f64 {
    let length = along.length_squared();
    if length > 0.0 {
        (point.dot(along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Whether what is said of the middle one of three points is what lies between the others.
fn same_pose(pass: &Pass<'_>, [from, i, to]: [usize; 3], share: f64) -> bool {
    let near = |a: Option<f64>, said: Option<f64>, b: Option<f64>| match (a, said, b) {
        (None, None, None) => true,
        (Some(a), Some(said), Some(b)) => (a + (b - a) * share - said).abs() <= POSE,
        _ => false,
    };
    let axes = match (pass.axis(from), pass.axis(i), pass.axis(to)) {
        (None, None, None) => true,
        (Some(a), Some(said), Some(b)) => a.lerp(b, share).normalize_or(a).distance(said) <= POSE,
        _ => false,
    };
    let mut outside = pass
        .external(from)
        .zip(pass.external(i))
        .zip(pass.external(to));
    axes && near(pass.turn(from), pass.turn(i), pass.turn(to))
        && outside.all(|((a, said), b)| near(a, said, b))
}

/// The layer with passes of fewer points.
fn with(layer: &Layer, kept: &[Option<Vec<usize>>]) -> Layer {
    let mut fewer = Layer::new(layer.number, layer.height);
    for (pass, kept) in layer.passes().zip(kept) {
        match kept {
            Some(kept) => fewer.push_some(pass.alone(), kept),
            None => fewer.push(pass.alone()),
        }
    }
    fewer.set_neighbours(layer.neighbours.clone());
    fewer
}

impl Layer {
    /// Copies a pass to the end of the layer, by way of these of its points.
    fn push_some(&mut self, pass: Pass<'_>, kept: &[usize]) {
        let mut to = self.begin(pass.head, pass.points[0]);
        to.pose_of(pass, 0);
        let mut events = pass.events().peekable();
        let longest = |from: usize, to: usize| {
            let longer =
                |&a: &usize, &b: &usize| pass.move_length(a).total_cmp(&pass.move_length(b));
            (from..to).max_by(longer).unwrap_or(from)
        };
        for step in kept.windows(2) {
            while let Some((_, event)) = events.next_if(|e| e.0 == step[0]) {
                to.event(event);
            }
            // an arc is longer than what it took in
            let longest = longest(step[0], step[1]);
            to.go(pass.move_at(longest), pass.points[step[1]]);
            to.values_of(pass, longest);
            if let Some(dwell) = pass.value(Channel::Dwell, step[1] - 1) {
                to.set(Channel::Dwell, dwell);
            }
            to.pose_of(pass, step[1]);
        }
        for (_, event) in events {
            to.event(event);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vocabulary::{Event, Neighbour, PassHead, PassId, Role, Side};
    use proptest::prelude::*;

    fn profile() -> Profile {
        Profile {
            speed: 10.0,
            ..Profile::default()
        }
    }

    fn head(role: Role) -> PassHead {
        PassHead {
            role,
            ..PassHead::default()
        }
    }

    fn path(layer: Layer) -> Toolpath {
        Toolpath {
            profiles: vec![profile()],
            layers: vec![layer],
            ..Toolpath::default()
        }
    }

    fn one(points: &[[f64; 2]], role: Role) -> Toolpath {
        let mut layer = Layer::new(1, 0.0);
        layer.polyline(
            head(role),
            points.iter().map(|p| DVec3::new(p[0], p[1], 0.0)),
        );
        path(layer)
    }

    fn xs(path: &Toolpath) -> Vec<f64> {
        path.layers[0].pass(0).points.iter().map(|p| p.x).collect()
    }

    #[test]
    fn short_moves_go_where_the_way_stays() {
        // 10 ms at 10 mm/s are 0.1 mm
        let near = [
            [0.0, 0.0],
            [5.0, 0.0],
            [5.02, 0.001],
            [10.0, 0.0],
            [10.05, 0.0],
        ];
        let mut path = one(&near, Role::Contour);
        assert_eq!(path.merge_short_moves(10e-3, 0.05), 2);
        assert_eq!(
            xs(&path),
            [0.0, 5.02, 10.05],
            "the end of a short move stays, and so do both ends of the bead"
        );
        // a short step to the side is a corner
        let step = [[0.0, 0.0], [5.0, 0.0], [5.0, 0.09], [10.0, 0.09]];
        let mut path = one(&step, Role::Contour);
        assert_eq!(path.merge_short_moves(10e-3, 0.01), 0);
        // a travel lays nothing
        let mut path = one(&near, Role::Travel);
        assert_eq!(path.merge_short_moves(10e-3, 0.05), 0);
        // a bead of one short move stays what it is
        let mut path = one(&[[0.0, 0.0], [0.01, 0.0]], Role::Contour);
        assert_eq!(path.merge_short_moves(10e-3, 0.05), 0);
    }

    #[test]
    fn what_is_said_at_a_point_keeps_it() {
        let short = || {
            let mut layer = Layer::new(1, 0.0);
            let mut to = layer.begin(head(Role::Contour), DVec3::ZERO);
            to.axis(DVec3::Z).line_to(DVec3::X * 5.0).axis(DVec3::Z);
            to.set(Channel::Speed, 8.0);
            layer
        };
        let ends = |mut layer: Layer, axis: DVec3| {
            let mut to = layer.resume().unwrap();
            to.line_to(DVec3::X * 5.05)
                .axis(axis)
                .set(Channel::Speed, 20.0);
            to.line_to(DVec3::X * 10.0)
                .axis(DVec3::Z)
                .set(Channel::Speed, 12.0);
            path(layer)
        };
        let mut plain = ends(short(), DVec3::Z);
        assert_eq!(plain.merge_short_moves(10e-3, 0.05), 1);
        let pass = plain.layers[0].pass(0);
        assert_eq!(pass.points.len(), 3);
        assert_eq!(
            [pass.value(Channel::Speed, 0), pass.value(Channel::Speed, 1)],
            [Some(8.0), Some(12.0)]
        );
        // an axis of its own, an event, a dwell: the other end of the short move may go
        let mut leant = ends(short(), DVec3::new(0.1, 0.0, 1.0).normalize());
        assert_eq!(leant.merge_short_moves(10e-3, 0.05), 0);
        let mut told = short();
        told.resume()
            .unwrap()
            .event(Event::Weave(0))
            .set(Channel::Dwell, 0.5);
        let mut told = ends(told, DVec3::Z);
        assert_eq!(told.merge_short_moves(10e-3, 0.05), 1);
        let pass = told.layers[0].pass(0);
        assert_eq!(pass.points[1].x, 5.0);
        assert_eq!(pass.events().collect::<Vec<_>>(), [(1, Event::Weave(0))]);
        assert_eq!(
            [pass.value(Channel::Dwell, 0), pass.value(Channel::Dwell, 1)],
            [Some(0.5), None]
        );
    }

    /// What is far shorter than an arc and the chord goes into the arc's end; what is not stays, and no arc becomes a line.
    #[test]
    fn an_arc_takes_what_is_nothing_beside_it() {
        let with = |first: f64, last: f64| {
            let mut layer = Layer::new(1, 0.0);
            let mut to = layer.begin(head(Role::Contour), DVec3::X * -first);
            to.line_to(DVec3::ZERO);
            let via = DVec3::new(5.0, 5.0, 0.0);
            to.go(Move::Arc { via }, DVec3::X * 10.0);
            to.line_to(DVec3::X * (10.0 + last))
                .line_to(DVec3::X * 20.0);
            path(layer)
        };
        let mut both = with(3e-4, 3e-4);
        assert_eq!(both.merge_short_moves(10e-3, 0.05), 2);
        let pass = both.layers[0].pass(0);
        assert_eq!(
            pass.points,
            [DVec3::X * -3e-4, DVec3::X * 10.0, DVec3::X * 20.0]
        );
        let arc = pass.arc(0).unwrap();
        assert!((arc.length() - 5.0 * std::f64::consts::PI).abs() < 1e-3);
        assert_eq!(with(0.02, 5.0).merge_short_moves(10e-3, 0.05), 0);
    }

    #[test]
    fn beads_beside_stay_beside() {
        let mut layer = Layer::new(1, 0.0);
        for id in 0..2 {
            let head = PassHead {
                id: PassId(id),
                role: Role::Fill,
                ..PassHead::default()
            };
            let y = DVec3::Y * f64::from(id);
            layer.polyline(
                head,
                [y, y + DVec3::X, y + DVec3::X * 1.01, y + DVec3::X * 9.0],
            );
        }
        let beside = Neighbour {
            from: 0.0,
            to: 9.0,
            side: Side::Left,
            pass: PassId(1),
            distance: 1.0,
            layer: 1,
        };
        layer.set_neighbours(vec![(0, beside)]);
        let mut path = path(layer);
        assert_eq!(path.merge_short_moves(10e-3, 0.05), 2);
        assert_eq!(
            path.layers[0]
                .pass(0)
                .neighbours()
                .copied()
                .collect::<Vec<_>>(),
            [beside]
        );
        assert_eq!(path.layers[0].pass(1).head.id, PassId(1));
    }

    proptest! {
        /// Every point left out lies within the chord of the way that is left, ends stay, and a second time nothing goes.
        #[test]
        fn the_way_stays_within_the_chord(steps in prop::collection::vec((0.001..0.4f64, -0.6..0.6f64), 2..60), chord in 0.001..0.1f64) {
            let mut at = [0.0, 0.0];
            let mut heading = 0.0f64;
            let mut points = vec![at];
            for (length, turn) in steps {
                heading += turn;
                at = [at[0] + length * heading.cos(), at[1] + length * heading.sin()];
                points.push(at);
            }
            let whole = one(&points, Role::Contour);
            let mut fewer = whole.clone();
            fewer.merge_short_moves(10e-3, chord);
            let (all, left) = (whole.layers[0].pass(0).points, fewer.layers[0].pass(0).points);
            prop_assert_eq!([all[0], all[all.len() - 1]], [left[0], left[left.len() - 1]]);
            let mut piece = 0;
            for point in all {
                if left.get(piece + 1) == Some(point) { piece += 1; }
                let far = [piece.saturating_sub(1), piece].into_iter().filter_map(|i| {
                    let (a, b) = (*left.get(i)?, *left.get(i + 1)?);
                    Some(point.distance(a + share(*point - a, b - a) * (b - a)))
                }).fold(f64::INFINITY, f64::min);
                prop_assert!(far <= chord + 1e-12, "{far} mm");
            }
        }
    }
}
