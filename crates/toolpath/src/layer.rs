//! A layer: passes in order of execution, their points and values in common arrays, so that a single hatch costs what its two
//! points cost and little more.

use meltpath_geometry::math::DVec3;

use crate::column::Column;
use crate::vocabulary::{Channel, Event, Move, Neighbour, PassHead, Role};

/// A pass' head and where its points begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Entry {
    pub(crate) head: PassHead,
    /// Number of its first point. Its first move has this number less that of the passes before: each has one move less than
    /// points.
    pub(crate) first: u32,
}

/// Passes of one layer in order of execution. A layer may come several times in a toolpath.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layer {
    /// Its number, counted from 1.
    pub number: u32,
    /// Height of its plane over the part's z = 0, mm: the z of points counts from it. 0 where points bear their own heights.
    pub height: f64,
    pub(crate) entries: Vec<Entry>,
    pub(crate) points: Vec<DVec3>,
    /// Moves that are arcs, by their number, with a point between their ends; those in neither list are lines.
    pub(crate) arcs: Vec<(u32, DVec3)>,
    /// Moves that are spots, by their number, with their time, s.
    pub(crate) spots: Vec<(u32, f64)>,
    /// One column a channel, by moves.
    pub(crate) channels: [Column; Channel::ALL.len()],
    /// Components of the tool axis, by points.
    pub(crate) axes: [Column; 3],
    /// Rotation about the tool axis, by points, rad.
    pub(crate) turns: Column,
    /// External axes, by points.
    pub(crate) external: Vec<Column>,
    /// By the number of the point at which they happen.
    pub(crate) events: Vec<(u32, Event)>,
    /// By the number of the pass beside which they lie.
    pub(crate) neighbours: Vec<(u32, Neighbour)>,
}

impl Layer {
    /// An empty layer.
    pub fn new(number: u32, height: f64) -> Self {
        Layer {
            number,
            height,
            ..Layer::default()
        }
    }

    /// Number of passes.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is no pass.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Number of points of all passes.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Number of moves of all passes.
    pub fn move_count(&self) -> usize {
        self.points.len() - self.entries.len()
    }

    /// Begins a pass at `start`, mm; the writer makes its moves.
    pub fn begin(&mut self, head: PassHead, start: DVec3) -> PassWriter<'_> {
        let first = self.points.len() as u32;
        self.entries.push(Entry { head, first });
        self.points.push(start);
        PassWriter { layer: self }
    }

    /// Writes on where the last pass ended, if there is one.
    pub fn resume(&mut self) -> Option<PassWriter<'_>> {
        (!self.is_empty()).then_some(PassWriter { layer: self })
    }

    /// A pass of straight moves along `points`; none without points.
    pub fn polyline(&mut self, head: PassHead, points: impl IntoIterator<Item = DVec3>) {
        let mut points = points.into_iter();
        if let Some(start) = points.next() {
            self.begin(head, start);
            self.points.extend(points);
        }
    }

    /// Moves every point by `by`, mm.
    pub fn translate(&mut self, by: DVec3) {
        self.place(|point| point + by);
    }

    /// Puts every point where `to` has it, mm.
    pub fn place(&mut self, to: impl Fn(DVec3) -> DVec3) {
        let via = self.arcs.iter_mut().map(|(_, via)| via);
        for point in self.points.iter_mut().chain(via) {
            *point = to(*point);
        }
    }

    /// Changes how long the beam stays on each spot, from where it is and its time, s.
    pub fn set_spot_times(&mut self, mut time: impl FnMut(DVec3, f64) -> f64) {
        let mut index = 0;
        for (number, old) in &mut self.spots {
            // the point after move `number` of all, in the pass that holds it
            while self
                .entries
                .get(index + 1)
                .is_some_and(|e| e.first - (index as u32 + 1) <= *number)
            {
                index += 1;
            }
            let end = *number as usize + index + 1;
            *old = time(self.points[end], *old);
        }
    }

    /// Says which beads lie beside which passes, by the number of the pass in this layer, from 0.
    pub fn set_neighbours(&mut self, mut neighbours: Vec<(u32, Neighbour)>) {
        neighbours.sort_by_key(|n| n.0);
        self.neighbours = neighbours;
    }

    /// Says of every point that external axis number `axis` (from 0) stands at `value`, mm or rad.
    pub fn stand(&mut self, axis: usize, value: f64) {
        for point in 0..self.points.len() {
            self.external_column(axis).set(point, value);
        }
    }

    /// Says of every pass that deposits that weave `number` of the toolpath, from 1, is on from its start.
    pub fn weave(&mut self, number: u32) {
        let laid = self.entries.iter().filter(|e| e.head.role.deposits());
        let woven = laid.map(|e| (e.first, Event::Weave(number)));
        self.events.extend(woven);
        self.events.sort_by_key(|e| e.0);
    }

    fn external_column(&mut self, axis: usize) -> &mut Column {
        if self.external.len() <= axis {
            self.external.resize_with(axis + 1, Column::default);
        }
        &mut self.external[axis]
    }

    /// Whether any pass has this role.
    pub fn has(&self, role: Role) -> bool {
        self.entries.iter().any(|e| e.head.role == role)
    }

    /// Memory that the layer holds, bytes.
    #[cfg(test)]
    fn bytes(&self) -> usize {
        fn of<T>(list: &Vec<T>) -> usize {
            list.capacity() * size_of::<T>()
        }
        let lists = of(&self.entries)
            + of(&self.points)
            + of(&self.arcs)
            + of(&self.spots)
            + of(&self.external)
            + of(&self.events)
            + of(&self.neighbours);
        let columns: usize = self.columns().map(Column::bytes).sum();
        size_of::<Self>() + lists + columns
    }

    /// Gives back memory that was taken for passes to come.
    pub fn shrink_to_fit(&mut self) {
        self.entries.shrink_to_fit();
        self.points.shrink_to_fit();
        self.arcs.shrink_to_fit();
        self.spots.shrink_to_fit();
        self.events.shrink_to_fit();
        self.neighbours.shrink_to_fit();
        let columns = self.channels.iter_mut().chain(&mut self.axes);
        for column in columns.chain([&mut self.turns]).chain(&mut self.external) {
            column.shrink_to_fit();
        }
    }

    #[cfg(test)]
    fn columns(&self) -> impl Iterator<Item = &Column> {
        let fixed = self.channels.iter().chain(&self.axes).chain([&self.turns]);
        fixed.chain(&self.external)
    }
}

/// Writes a pass at the end of its layer, move after move.
#[derive(Debug)]
pub struct PassWriter<'a> {
    layer: &'a mut Layer,
}

impl PassWriter<'_> {
    /// On to `end`, mm, in the given way.
    pub fn go(&mut self, shape: Move, end: DVec3) -> &mut Self {
        let number = self.layer.move_count() as u32;
        match shape {
            Move::Line => {}
            Move::Arc { via } => self.layer.arcs.push((number, via)),
            Move::Spot { time } => self.layer.spots.push((number, time)),
        }
        self.layer.points.push(end);
        self
    }

    /// Straight on to `end`, mm.
    pub fn line_to(&mut self, end: DVec3) -> &mut Self {
        self.go(Move::Line, end)
    }

    /// Says a value of the last move; nothing where there is no move yet.
    pub fn set(&mut self, channel: Channel, value: f64) -> &mut Self {
        let moves = self.layer.move_count();
        let first = self.layer.entries.last().map_or(0, |e| e.first as usize);
        if self.layer.points.len() > first + 1 {
            self.layer.channels[channel as usize].set(moves - 1, value);
        }
        self
    }

    /// Says the unit tool axis at the last point, from the part towards the tool.
    pub fn axis(&mut self, axis: DVec3) -> &mut Self {
        let point = self.last();
        for (column, value) in self.layer.axes.iter_mut().zip(axis.to_array()) {
            column.set(point, value);
        }
        self
    }

    /// Says the rotation about the tool axis at the last point, rad.
    pub fn turn(&mut self, turn: f64) -> &mut Self {
        let point = self.last();
        self.layer.turns.set(point, turn);
        self
    }

    /// Says where external axis number `axis` (from 0) stands at the last point, mm or rad.
    pub fn external(&mut self, axis: usize, value: f64) -> &mut Self {
        let point = self.last();
        self.layer.external_column(axis).set(point, value);
        self
    }

    /// Something happens at the last point.
    pub fn event(&mut self, event: Event) -> &mut Self {
        let point = self.last() as u32;
        self.layer.events.push((point, event));
        self
    }

    fn last(&self) -> usize {
        self.layer.points.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::PathError;
    use crate::vocabulary::{PassId, Side};
    use proptest::prelude::*;

    fn head(id: u32, role: Role) -> PassHead {
        PassHead {
            id: PassId(id),
            role,
            ..PassHead::default()
        }
    }

    /// A contour with an arc, axes and a speed; two hatches; a chain of spots.
    fn mixed() -> Layer {
        let mut layer = Layer::new(3, 0.05);
        let mut contour = layer.begin(head(7, Role::Contour), DVec3::ZERO);
        contour.event(Event::Weave(2));
        contour.line_to(DVec3::X * 10.0).axis(DVec3::Y);
        contour.go(
            Move::Arc {
                via: DVec3::new(20.0, 10.0, 0.0),
            },
            DVec3::new(10.0, 20.0, 0.0),
        );
        contour
            .set(Channel::Speed, 8.0)
            .turn(0.5)
            .external(1, -30.0);
        for id in [8, 9] {
            let from = DVec3::Y * f64::from(id);
            layer.polyline(head(id, Role::Fill), [from, from + DVec3::X]);
        }
        let mut spots = layer.begin(head(10, Role::Fill), DVec3::ZERO);
        spots.go(Move::Spot { time: 0.5 }, DVec3::ZERO);
        spots.go(Move::Spot { time: 0.25 }, DVec3::X);
        let beside = Neighbour {
            from: 1.0,
            to: 4.0,
            side: Side::Left,
            pass: PassId(8),
            distance: 4.6,
            layer: 3,
        };
        layer.set_neighbours(vec![(1, beside), (0, beside)]);
        layer
    }

    #[test]
    fn a_pass_has_its_own_arcs_and_spots_only() {
        let mut layer = Layer::new(1, 0.0);
        for id in 0..3 {
            let mut pass = layer.begin(head(id, Role::Contour), DVec3::ZERO);
            pass.go(
                Move::Arc {
                    via: DVec3::new(1.0, 1.0, 0.0),
                },
                DVec3::Y * f64::from(2 + id),
            );
            pass.go(Move::Spot { time: 0.5 }, DVec3::X);
        }
        for pass in layer.passes() {
            assert_eq!((pass.arcs.len(), pass.spots.len()), (1, 1));
        }
    }

    fn sound(mut layer: Layer) -> Layer {
        // the hatches are 1 mm long
        layer.neighbours.retain(|n| n.0 == 0);
        layer.sanity_check().unwrap();
        layer
    }

    #[test]
    fn passes_are_read_as_they_were_written() {
        let layer = sound(mixed());
        assert_eq!(
            (layer.len(), layer.point_count(), layer.move_count()),
            (4, 10, 6)
        );
        let contour = layer.pass(0);
        assert_eq!(contour.move_at(0), Move::Line);
        assert!(matches!(contour.move_at(1), Move::Arc { .. }));
        assert!((contour.length() - (10.0 + 10.0 * std::f64::consts::PI)).abs() < 1e-9);
        assert_eq!(contour.value(Channel::Speed, 0), None);
        assert_eq!(contour.value(Channel::Speed, 1), Some(8.0));
        assert!(contour.says(Channel::Speed) && !contour.says(Channel::Power));
        assert_eq!((contour.axis(0), contour.axis(1)), (None, Some(DVec3::Y)));
        assert_eq!((contour.turn(1), contour.turn(2)), (None, Some(0.5)));
        let external: Vec<_> = contour.external(2).collect();
        assert_eq!(external, [None, Some(-30.0)]);
        let events: Vec<_> = contour.events().collect();
        assert_eq!(events, [(0, Event::Weave(2))]);
        assert_eq!(contour.neighbours().len(), 1);
        // what one pass says, the others do not
        let hatch = layer.pass(1);
        assert_eq!(hatch.move_at(0), Move::Line);
        assert!(!hatch.says(Channel::Speed) && hatch.axis(0).is_none());
        assert_eq!(hatch.neighbours().len(), 0);
        let times: Vec<_> = layer.pass(3).moves().collect();
        assert_eq!(times, [Move::Spot { time: 0.5 }, Move::Spot { time: 0.25 }]);
        assert!(layer.get(4).is_none());
        // nothing is said of a move that is not there, neither of the next pass nor of the one before
        let mut layer = layer;
        layer.resume().unwrap().set(Channel::Power, 300.0);
        assert_eq!(layer.pass(3).value(Channel::Power, 1), Some(300.0));
        layer.begin(head(11, Role::Fill), DVec3::ZERO);
        let mut next = layer.resume().unwrap();
        next.set(Channel::Power, 5.0).set(Channel::Speed, 5.0);
        next.line_to(DVec3::X).set(Channel::Power, 200.0);
        let before = layer.pass(3);
        assert_eq!(before.value(Channel::Power, 1), Some(300.0));
        assert_eq!(before.value(Channel::Power, 2), None);
        assert!(!before.says(Channel::Speed));
    }

    #[test]
    fn flattened_arcs_keep_their_length_and_their_chords() {
        let layer = mixed();
        let contour = layer.pass(0);
        let (points, along) = contour.flatten(0.01);
        assert_eq!(points.len(), along.len());
        assert!((along.last().unwrap() - contour.length()).abs() < 1e-9);
        // a straight move of 10 mm, then equal chords of half a circle
        let step = 10.0 * std::f64::consts::PI / (points.len() - 2) as f64;
        for (k, s) in along[1..].iter().enumerate() {
            assert!((s - 10.0 - step * k as f64).abs() < 1e-9);
        }
        let centre = DVec3::new(10.0, 10.0, 0.0);
        for pair in points[1..].windows(2) {
            assert!((0.5 * (pair[0] + pair[1])).distance(centre) > 10.0 - 0.0101);
        }
    }

    #[test]
    fn copied_passes_are_the_same() {
        let layer = sound(mixed());
        let mut copy = Layer::new(layer.number, layer.height);
        layer.passes().for_each(|p| copy.push(p));
        assert_eq!(copy, layer);
        copy.push(layer.pass(0).alone());
        assert_eq!(copy.pass(4).neighbours().len(), 0);
        assert_eq!(copy.pass(4).length(), layer.pass(0).length());
        assert_eq!(copy.pass(4).value(Channel::Speed, 1), Some(8.0));
        copy.sanity_check().unwrap();
    }

    #[test]
    fn passes_go_on_where_they_ended_and_become_what_their_heads_say() {
        let mut layer = Layer::default();
        assert!(layer.is_empty() && layer.resume().is_none());
        layer.polyline(head(1, Role::Fill), [DVec3::ZERO, DVec3::X, DVec3::ONE]);
        assert!(!layer.is_empty() && !layer.pass(0).is_closed());
        layer.resume().unwrap().line_to(DVec3::ZERO);
        assert_eq!((layer.len(), layer.pass(0).move_count()), (1, 3));
        assert!(layer.pass(0).is_closed());
        // a point that is said twice encloses nothing
        layer.polyline(head(2, Role::Jump), [DVec3::Y, DVec3::Y]);
        assert!(!layer.pass(1).is_closed());
        assert!(layer.has(Role::Jump) && !layer.has(Role::Contour));
        let laid = 1.0 + 2.0_f64.sqrt() + 3.0_f64.sqrt();
        assert!((layer.deposited_length() - laid).abs() < 1e-12);
        layer.polyline(head(3, Role::Jump), [DVec3::Y, DVec3::Y * 5.0]);
        assert!((layer.deposited_length() - laid).abs() < 1e-12);
        layer.polyline(head(4, Role::Contour), [DVec3::Y, DVec3::Y * 5.0]);
        assert!(layer.has(Role::Contour) && layer.has(Role::Jump));
        assert!((layer.deposited_length() - laid - 4.0).abs() < 1e-12);
    }

    #[test]
    fn moved_layers_keep_their_shape() {
        let (layer, mut moved) = (sound(mixed()), sound(mixed()));
        moved.translate(DVec3::new(-3.0, 5.0, 1.0));
        moved.sanity_check().unwrap();
        for (a, b) in layer.passes().zip(moved.passes()) {
            assert!((a.length() - b.length()).abs() < 1e-9);
            assert!((b.points[0] - a.points[0] - DVec3::new(-3.0, 5.0, 1.0)).length() < 1e-12);
        }
        moved.set_spot_times(|at, time| time + at.x);
        let times: Vec<_> = moved.pass(3).moves().collect();
        // the spots lie at x = 0 and 1, less the 3 mm
        assert_eq!(
            times,
            [Move::Spot { time: -2.5 }, Move::Spot { time: -1.75 }]
        );
        assert!(moved.sanity_check().is_err());
        // each spot is told the point where it stands, whatever passes lie before
        let mut layer = Layer::default();
        for x in [3.0, 5.0, 7.0] {
            let mut pass = layer.begin(head(1, Role::Fill), DVec3::ZERO);
            pass.line_to(DVec3::Y);
            pass.go(Move::Spot { time: 1.0 }, DVec3::X * x);
        }
        layer.set_spot_times(|at, _| at.x);
        let times: Vec<_> = layer.passes().map(|p| p.move_at(1)).collect();
        assert_eq!(times, [3.0, 5.0, 7.0].map(|time| Move::Spot { time }));
    }

    #[test]
    fn broken_promises_are_found() {
        let broken = |breaking: &dyn Fn(&mut Layer)| {
            let mut layer = sound(mixed());
            breaking(&mut layer);
            layer.sanity_check().unwrap_err().to_string()
        };
        assert!(broken(&|l| l.points[3].x = f64::NAN).contains("a point is not"));
        assert!(broken(&|l| l.height = f64::INFINITY).contains("height"));
        assert!(broken(&|l| l.entries[1].first = 0).contains("no point"));
        assert!(broken(&|l| l.arcs[0].0 = 99).contains("an arc belongs"));
        assert!(broken(&|l| l.spots.swap(0, 1)).contains("a spot belongs"));
        assert!(broken(&|l| l.spots[0] = (1, 0.1)).contains("an arc, too"));
        assert!(broken(&|l| l.events[0].0 = 10).contains("event"));
        assert!(broken(&|l| l.channels[0].set(0, 0.0)).contains("speed"));
        assert!(broken(&|l| l.channels[2].set(0, -1.0)).contains("negative"));
        assert!(broken(&|l| l.channels[2].set(6, 1.0)).contains("7 entries"));
        assert!(broken(&|l| l.axes[0].set(1, 0.5)).contains("unit"));
        assert!(broken(&|l| l.neighbours[0].1.to = 99.0).contains("neighbour"));
        // of one pass they follow one another; those of the next one begin anew
        assert!(
            broken(&|l| {
                let mut earlier = l.neighbours[0];
                earlier.1.from = 0.5;
                l.neighbours.push(earlier);
            })
            .contains("follow one another")
        );
        assert!(
            broken(&|l| {
                let mut beyond = l.neighbours[0];
                beyond.0 = 1;
                l.neighbours.push(beyond);
            })
            .contains("along its pass")
        );
        // and where
        let (line, from) = (DVec3::X, DVec3::ZERO);
        let at = |arcs: &[u32]| {
            let mut layer = Layer::default();
            layer.polyline(head(1, Role::Fill), [from, line, from, line]);
            layer.arcs = arcs.iter().map(|n| (*n, DVec3::Y)).collect();
            match layer.sanity_check() {
                Err(PathError::Value { index, .. }) => Some(index),
                _ => None,
            }
        };
        assert_eq!(at(&[0, 1, 2]), None);
        assert_eq!(at(&[0, 1, 1]), Some(2));
        assert_eq!(at(&[0, 1, 3]), Some(2));
    }

    #[test]
    fn a_hatch_costs_less_than_a_hundred_bytes() {
        let mut layer = Layer::new(1, 0.03);
        for k in 0..100_000_u32 {
            let from = DVec3::new(0.0, 0.1 * f64::from(k), 0.0);
            layer.polyline(head(k, Role::Fill), [from, from + DVec3::X * 10.0]);
        }
        layer.shrink_to_fit();
        assert!(layer.bytes() < 73 * 100_000, "{}", layer.bytes());
        // with a speed, a power and a dwell of its own
        for (channel, value) in [(0, 800.0), (2, 300.0), (4, 1e-4)] {
            for k in 0..100_000 {
                layer.channels[channel].set(k, value);
            }
        }
        layer.shrink_to_fit();
        layer.sanity_check().unwrap();
        assert!(layer.bytes() < 97 * 100_000, "{}", layer.bytes());
    }

    proptest! {
        /// Whatever is written, each pass is read back alone, and a copy of all is equal.
        #[test]
        fn any_passes_are_read_back(passes in prop::collection::vec(
            prop::collection::vec((-9.0..9.0_f64, 0_u8..3, prop::option::of(0.1..99.0_f64)), 0..6), 0..8))
        {
            let mut layer = Layer::new(1, 0.0);
            for (id, moves) in passes.iter().enumerate() {
                let mut pass = layer.begin(head(id as u32, Role::Fill), DVec3::ZERO);
                for &(x, kind, speed) in moves {
                    let end = DVec3::new(x, 1.0, 0.0);
                    match kind {
                        0 => pass.line_to(end),
                        1 => pass.go(Move::Arc { via: DVec3::Y * x }, end),
                        _ => pass.go(Move::Spot { time: x.abs() }, end),
                    };
                    if let Some(speed) = speed {
                        pass.set(Channel::Speed, speed);
                    }
                }
            }
            layer.sanity_check().unwrap();
            prop_assert_eq!(layer.len(), passes.len());
            for (pass, moves) in layer.passes().zip(&passes) {
                prop_assert_eq!(pass.move_count(), moves.len());
                for (i, &(x, kind, speed)) in moves.iter().enumerate() {
                    let wanted = match kind {
                        0 => Move::Line,
                        1 => Move::Arc { via: DVec3::Y * x },
                        _ => Move::Spot { time: x.abs() },
                    };
                    prop_assert_eq!(pass.move_at(i), wanted);
                    prop_assert_eq!(pass.value(Channel::Speed, i), speed);
                    prop_assert_eq!(pass.points[i + 1].x, x);
                }
            }
            let mut copy = Layer::new(1, 0.0);
            layer.passes().for_each(|p| copy.push(p));
            prop_assert_eq!(copy, layer);
        }
    }
}
