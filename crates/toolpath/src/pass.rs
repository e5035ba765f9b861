//! A pass: one uninterrupted bead or scan chain.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;
use serde::{Deserialize, Serialize};

/// Stable identifier of a pass: survives re-planning of others and restart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PassId(
    /// The number.
    pub u32,
);

/// What a pass is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Along the boundary of a region.
    Contour,
    /// Inside a region.
    Fill,
    /// On an outer surface.
    Skin,
    /// Holds what would fall.
    Support,
    /// Moves without depositing.
    Travel,
}

/// How a pass goes from one of its points to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
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

/// Where a pass belongs: the tree Build > Part > Layer is an index over these tags.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Tag {
    /// Part, counted from 0.
    pub part: u32,
    /// Layer, counted from 1.
    pub layer: u32,
    /// Region or entity of the layer, counted from 0.
    pub entity: u32,
}

/// Which side of the direction of travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Left of the direction of travel, seen against the tool axis.
    Left,
    /// Right of it.
    Right,
}

/// A bead beside this one along an interval of arc length, as placed by the plan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

/// Values that vary along a pass, one per move; absent ones come from the pass' [`crate::Profile`].
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Channels {
    /// Travel speed, mm/s.
    pub speed: Option<Vec<f64>>,
    /// Wire feed speed, mm/s.
    pub wire_feed: Option<Vec<f64>>,
    /// Beam power, W.
    pub power: Option<Vec<f64>>,
    /// Focus offset, in the unit of the beam's focus model.
    pub focus: Option<Vec<f64>>,
    /// Dwell at the end of the move, s.
    pub dwell: Option<Vec<f64>>,
}

/// One uninterrupted bead or scan chain, as a structure of arrays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    /// Stable identifier.
    pub id: PassId,
    /// What the pass is for.
    pub role: Role,
    /// Part, layer and entity.
    pub tag: Tag,
    /// Index into [`crate::Toolpath::profiles`].
    pub profile: u32,
    /// The points, mm, part frame; a closed pass repeats its first point at the end.
    pub points: Vec<DVec3>,
    /// The moves between points: `points.len() - 1` of them.
    pub moves: Vec<Move>,
    /// Unit tool axis at each point, from the part towards the tool; empty where the tool stays along the
    /// build direction.
    pub axes: Vec<DVec3>,
    /// Values that vary along the pass.
    pub channels: Channels,
    /// Beads beside this one.
    pub neighbours: Vec<Neighbour>,
}

impl Pass {
    /// A pass of straight moves along `points` with nothing else said.
    pub fn polyline(id: PassId, role: Role, tag: Tag, points: Vec<DVec3>) -> Self {
        let moves = vec![Move::Line; points.len().saturating_sub(1)];
        Pass {
            id,
            role,
            tag,
            profile: 0,
            points,
            moves,
            axes: Vec::new(),
            channels: Channels::default(),
            neighbours: Vec::new(),
        }
    }

    /// The arc of move `i`, where that move is an arc through three distinct points.
    pub fn arc(&self, i: usize) -> Option<Arc> {
        match self.moves[i] {
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
        (0..self.moves.len()).map(|i| self.move_length(i)).sum()
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
        for i in 0..self.moves.len() {
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

    /// The same pass travelled backwards: points, moves, axes, channels and neighbours turned round.
    #[must_use]
    pub fn reversed(mut self) -> Self {
        let length = self.length();
        self.points.reverse();
        self.moves.reverse();
        self.axes.reverse();
        let c = &mut self.channels;
        for channel in [
            &mut c.speed,
            &mut c.wire_feed,
            &mut c.power,
            &mut c.focus,
            &mut c.dwell,
        ]
        .into_iter()
        .flatten()
        {
            channel.reverse();
        }
        for n in &mut self.neighbours {
            (n.from, n.to) = (length - n.to, length - n.from);
            n.side = match n.side {
                Side::Left => Side::Right,
                Side::Right => Side::Left,
            };
        }
        self.neighbours.reverse();
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn half_circle() -> Pass {
        let tag = Tag {
            part: 0,
            layer: 1,
            entity: 0,
        };
        let mut pass = Pass::polyline(
            PassId(1),
            Role::Contour,
            tag,
            vec![DVec3::ZERO, DVec3::X * 10.0, DVec3::new(10.0, 20.0, 0.0)],
        );
        pass.moves[1] = Move::Arc {
            via: DVec3::new(20.0, 10.0, 0.0),
        };
        pass
    }

    #[test]
    fn lengths_follow_arcs() {
        let pass = half_circle();
        assert!((pass.length() - (10.0 + 10.0 * std::f64::consts::PI)).abs() < 1e-9);
        let (points, along) = pass.flatten(0.01);
        assert_eq!(points.len(), along.len());
        assert!((along.last().unwrap() - pass.length()).abs() < 1e-9);
        let centre = DVec3::new(10.0, 10.0, 0.0);
        for pair in points[1..].windows(2) {
            assert!((0.5 * (pair[0] + pair[1])).distance(centre) > 10.0 - 0.0101);
        }
    }

    #[test]
    fn turning_round_twice_is_nothing() {
        let mut pass = half_circle();
        pass.neighbours.push(Neighbour {
            from: 1.0,
            to: 4.0,
            side: Side::Left,
            pass: PassId(2),
            distance: 4.6,
            layer: 1,
        });
        let back = pass.clone().reversed();
        assert_eq!(back.neighbours[0].side, Side::Right);
        assert!((back.neighbours[0].to - (pass.length() - 1.0)).abs() < 1e-9);
        let again = back.reversed();
        assert_eq!(again.points, pass.points);
        assert_eq!(again.moves, pass.moves);
    }
}
