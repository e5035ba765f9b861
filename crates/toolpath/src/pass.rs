//! A pass: one uninterrupted bead or scan chain, read from the layer that holds it.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use serde::{Deserialize, Serialize};

use crate::layer::Layer;

/// Stable identifier of a pass: survives re-planning of others and restart.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PassId(
    /// The number.
    pub u32,
);

/// What a pass is for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Along the boundary of a region.
    Contour,
    /// Inside a region.
    #[default]
    Fill,
    /// On an outer surface.
    Skin,
    /// Holds what would fall.
    Support,
    /// Moves without depositing.
    Travel,
    /// Goes elsewhere, beam off.
    Jump,
    /// Goes from one line of a fill to the next, beam off.
    Connection,
    /// Runs up to or out of a line at its speed, beam off.
    Run,
}

impl Role {
    /// All of them.
    pub const ALL: [Role; 8] = [
        Role::Contour,
        Role::Fill,
        Role::Skin,
        Role::Support,
        Role::Travel,
        Role::Jump,
        Role::Connection,
        Role::Run,
    ];

    /// Whether metal is laid or melted along the pass: the arc burns, or the beam is on.
    pub fn deposits(self) -> bool {
        match self {
            Role::Contour | Role::Fill | Role::Skin | Role::Support => true,
            Role::Travel | Role::Jump | Role::Connection | Role::Run => false,
        }
    }
}

/// How a pass goes from one of its points to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Move {
    /// Straight.
    Line,
    /// On the circle through the start, `via` and the end.
    Arc {
        /// A point of the arc between its ends, mm.
        via: DVec3,
    },
    /// Stays at the end point for `time` seconds.
    Spot {
        /// Duration, s.
        time: f64,
    },
}

/// A value that may vary along a pass, one per move; where a move says none, the pass' [`crate::Profile`] does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Travel speed, mm/s.
    Speed,
    /// Wire feed speed, mm/s.
    WireFeed,
    /// Beam power, W.
    Power,
    /// Diameter of the beam's spot, mm.
    Spot,
    /// Dwell at the end of the move, s.
    Dwell,
}

impl Channel {
    /// All of them, in the order in which a layer keeps them.
    pub const ALL: [Channel; 5] = [
        Channel::Speed,
        Channel::WireFeed,
        Channel::Power,
        Channel::Spot,
        Channel::Dwell,
    ];
}

/// Something that happens at a point of a pass. A pass that deposits starts its arc at its first point and ends it at its last
/// without saying so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// The arc or the beam goes on within the pass.
    On,
    /// The arc or the beam goes off within the pass.
    Off,
    /// Weaving begins with this schedule of the controller; 0 ends it.
    Weave(u32),
    /// Machines wait here for each other; equal numbers meet.
    Synchronise(u32),
}

/// What a pass is, apart from where it goes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PassHead {
    /// Stable identifier.
    pub id: PassId,
    /// Part, counted from 0.
    pub part: u32,
    /// Region or entity of the layer, counted from 0.
    pub entity: u32,
    /// Bead of the entity, counted from 0.
    pub bead: u32,
    /// Index into [`crate::Toolpath::profiles`].
    pub profile: u16,
    /// What the pass is for.
    pub role: Role,
}

/// Which side of the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Left of the direction of travel, seen against the tool axis.
    Left,
    /// Right of it.
    Right,
}

/// A bead beside this one along an interval of arc length, as placed by the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Start of the interval, mm along the pass.
    pub from: f64,
    /// End of the interval, mm along the pass.
    pub to: f64,
    /// Side of the pass on which the neighbour lies.
    pub side: Side,
    /// The neighbouring pass.
    pub pass: PassId,
    /// Mean distance between the two centre lines on the interval, mm.
    pub distance: f64,
    /// Layer of the neighbour, counted from 1.
    pub layer: u32,
}

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

impl<'a> Pass<'a> {
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
