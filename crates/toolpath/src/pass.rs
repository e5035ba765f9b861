//! A pass: one uninterrupted bead or scan chain, read from the layer that holds it, and copied from layer to layer.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;

use crate::layer::{Layer, PassWriter};
use crate::vocabulary::{Channel, Event, Move, Neighbour, PassHead};

/// One uninterrupted bead or scan chain: at least one point, and a move between each point and the next.
#[derive(Debug, Clone, Copy)]
pub struct Pass<'a> {
    /// What it is.
    pub head: PassHead,
    /// Number of its layer, counted from 1.
    pub layer: u32,
    /// The points, mm; their z counts from the layer's [`Layer::height`]. A closed pass repeats its first point at the end.
    pub points: &'a [DVec3],
    pub(crate) store: &'a Layer,
    /// Number of the first point and of the first move in the layer.
    pub(crate) first: (usize, usize),
    pub(crate) arcs: &'a [(u32, DVec3)],
    pub(crate) spots: &'a [(u32, f64)],
    pub(crate) events: &'a [(u32, Event)],
    pub(crate) neighbours: &'a [(u32, Neighbour)],
}

/// Which pass, for people: where it stands in the order, and where it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassPlace {
    /// Its number in its layer, counted from 1.
    pub number: u32,
    /// Its layer, counted from 1.
    pub layer: u32,
    /// Its first point, mm.
    pub start: DVec3,
}

impl std::fmt::Display for PassPlace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let PassPlace {
            number,
            layer,
            start: DVec3 { x, y, z },
        } = self;
        write!(
            f,
            "pass {number} of layer {layer} (from x {x:.1}, y {y:.1}, z {z:.1} mm)"
        )
    }
}

impl<'a> Pass<'a> {
    /// Which pass it is, for people.
    pub fn place(&self) -> PassPlace {
        // a pass has one move less than points
        let before = self.first.0 - self.first.1;
        PassPlace {
            number: before as u32 + 1,
            layer: self.layer,
            start: self.points[0],
        }
    }

    /// Number of moves.
    pub fn move_count(&self) -> usize {
        self.points.len().saturating_sub(1)
    }

    /// How the pass goes from point `i` to the next.
    pub fn move_at(&self, i: usize) -> Move {
        let index = (self.first.1 + i) as u32;
        if let Ok(k) = self.arcs.binary_search_by_key(&index, |a| a.0) {
            return Move::Arc {
                via: self.arcs[k].1,
            };
        }
        match self.spots.binary_search_by_key(&index, |s| s.0) {
            Ok(k) => Move::Spot {
                time: self.spots[k].1,
            },
            Err(_) => Move::Line,
        }
    }

    /// The moves, in order.
    pub fn moves(&self) -> impl ExactSizeIterator<Item = Move> + '_ {
        (0..self.move_count()).map(|i| self.move_at(i))
    }

    /// What the pass says of a channel for move `i`; `None` leaves it to the profile.
    pub fn value(&self, channel: Channel, i: usize) -> Option<f64> {
        let column = &self.store.channels[channel as usize];
        (i < self.move_count())
            .then(|| column.get(self.first.1 + i))
            .flatten()
    }

    /// Whether the pass says anything of a channel.
    pub fn says(&self, channel: Channel) -> bool {
        let column = &self.store.channels[channel as usize];
        column.any(self.first.1..self.first.1 + self.move_count())
    }

    /// Unit tool axis at point `i`, from the part towards the tool; `None` where the tool stays along the build direction.
    pub fn axis(&self, i: usize) -> Option<DVec3> {
        let at = |k: usize| self.store.axes[k].get(self.first.0 + i);
        Some(DVec3::new(at(0)?, at(1)?, at(2)?))
    }

    /// Rotation about the tool axis at point `i`, rad; `None` where it is free.
    pub fn turn(&self, i: usize) -> Option<f64> {
        self.store.turns.get(self.first.0 + i)
    }

    /// Positions of the external axes at point `i`, mm or rad; `None` for those that the pass leaves free.
    pub fn external(&self, i: usize) -> impl Iterator<Item = Option<f64>> + '_ {
        let columns = self.store.external.iter();
        columns.map(move |c| c.get(self.first.0 + i))
    }

    /// What happens along the pass: at which of its points, and what.
    pub fn events(&self) -> impl ExactSizeIterator<Item = (usize, Event)> + '_ {
        let events = self.events.iter();
        events.map(|&(point, event)| (point as usize - self.first.0, event))
    }

    /// Beads beside this one, by the start of their intervals.
    pub fn neighbours(&self) -> impl ExactSizeIterator<Item = &'a Neighbour> + use<'a> {
        self.neighbours.iter().map(|(_, n)| n)
    }

    /// The same pass without neighbours: they are known to the layer they were found in.
    #[must_use]
    pub fn alone(self) -> Self {
        Pass {
            neighbours: &[],
            ..self
        }
    }

    /// The arc of move `i`, where that move is an arc through three distinct points.
    pub fn arc(&self, i: usize) -> Option<Arc> {
        match self.move_at(i) {
            Move::Arc { via } => Arc::through(self.points[i], via, self.points[i + 1]),
            Move::Line | Move::Spot { .. } => None,
        }
    }

    /// Length of move `i`, mm.
    pub fn move_length(&self, i: usize) -> f64 {
        self.arc(i).map_or_else(
            || self.points[i].distance(self.points[i + 1]),
            |a| a.length(),
        )
    }

    /// Length of the whole pass, mm.
    pub fn length(&self) -> f64 {
        (0..self.move_count()).map(|i| self.move_length(i)).sum()
    }

    /// Whether the pass ends where it starts.
    pub fn is_closed(&self) -> bool {
        self.points.len() > 2 && self.points.first() == self.points.last()
    }

    /// The pass as a polyline whose chords stay within `chord_error` mm of its arcs, with the arc length at each point.
    pub fn flatten(&self, chord_error: f64) -> (Vec<DVec3>, Vec<f64>) {
        let mut points: Vec<DVec3> = self.points.first().copied().into_iter().collect();
        let mut along = vec![0.0; points.len()];
        let mut s = 0.0;
        for i in 0..self.move_count() {
            if let Some(arc) = self.arc(i) {
                let n = arc.chords(chord_error);
                for k in 1..n {
                    let t = k as f64 / n as f64;
                    points.push(arc.at(t));
                    along.push(s + t * arc.length());
                }
                s += arc.length();
            } else {
                s += self.points[i].distance(self.points[i + 1]);
            }
            points.push(self.points[i + 1]);
            along.push(s);
        }
        (points, along)
    }
}

/// The entries of a sorted list whose numbers lie in a range.
fn within<T>(list: &[(u32, T)], from: usize, to: usize) -> &[(u32, T)] {
    if list.is_empty() {
        return list;
    }
    let at = |number: usize| list.partition_point(|e| (e.0 as usize) < number);
    &list[at(from)..at(to)]
}

impl Layer {
    /// Pass number `index`, from 0.
    pub fn get(&self, index: usize) -> Option<Pass<'_>> {
        let entry = self.entries.get(index)?;
        let first = entry.first as usize;
        let next = self.entries.get(index + 1);
        let end = next.map_or(self.points.len(), |n| n.first as usize);
        let (first_move, end_move) = (first - index, end - index - 1);
        Some(Pass {
            head: entry.head,
            layer: self.number,
            points: &self.points[first..end],
            store: self,
            first: (first, first_move),
            arcs: within(&self.arcs, first_move, end_move),
            spots: within(&self.spots, first_move, end_move),
            events: within(&self.events, first, end),
            neighbours: within(&self.neighbours, index, index + 1),
        })
    }

    /// The passes in order of execution.
    pub fn passes(&self) -> impl DoubleEndedIterator<Item = Pass<'_>> + ExactSizeIterator {
        // every index of the range has its pass
        (0..self.len()).map(|i| self.pass(i))
    }

    /// Pass number `index`, from 0.
    ///
    /// # Panics
    /// Where there is none.
    pub fn pass(&self, index: usize) -> Pass<'_> {
        match self.get(index) {
            Some(pass) => pass,
            #[expect(clippy::panic, reason = "an index out of range, as for a slice")]
            None => panic!("pass {index} of a layer of {}", self.len()),
        }
    }

    /// Copies a pass with all it says to the end of this layer.
    pub fn push(&mut self, pass: Pass<'_>) {
        let index = self.entries.len() as u32;
        let mut to = self.begin(pass.head, pass.points[0]);
        to.pose_of(pass, 0);
        for (i, shape) in pass.moves().enumerate() {
            to.go(shape, pass.points[i + 1]);
            to.values_of(pass, i);
            to.pose_of(pass, i + 1);
        }
        let first = self.points.len() - pass.points.len();
        let events = pass.events();
        self.events
            .extend(events.map(|(point, event)| ((first + point) as u32, event)));
        self.neighbours
            .extend(pass.neighbours().map(|n| (index, *n)));
    }

    /// Length of the passes that deposit, mm.
    pub fn deposited_length(&self) -> f64 {
        let laid = self.passes().filter(|p| p.head.role.deposits());
        laid.map(|p| p.length()).sum()
    }
}

impl PassWriter<'_> {
    /// What `pass` says of its move `i`, for the last move.
    pub(crate) fn values_of(&mut self, pass: Pass<'_>, i: usize) {
        for channel in Channel::ALL {
            if let Some(value) = pass.value(channel, i) {
                self.set(channel, value);
            }
        }
    }

    /// What `pass` says of its point `i`, for the last point.
    pub(crate) fn pose_of(&mut self, pass: Pass<'_>, i: usize) {
        if let Some(axis) = pass.axis(i) {
            self.axis(axis);
        }
        if let Some(turn) = pass.turn(i) {
            self.turn(turn);
        }
        for (axis, value) in pass.external(i).enumerate() {
            if let Some(value) = value {
                self.external(axis, value);
            }
        }
    }
}
