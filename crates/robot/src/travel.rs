//! The least time in which the axes of a cell get along a way: none goes faster, or speeds up faster, than it can.
//!
//! The way is straight from place to place in the axes. Along it the speed is the greatest one that every axis allows, speeded up and slowed
//! down as fast as every axis allows: a chain of trapezoids, of one straight piece the trapezoid itself. The bend of the way from one piece to
//! the next costs nothing here, and jerk is not limited, as no robot's file tells it: the time is a least one.

use crate::cell::{AXES, Cell, Values};
use crate::kinematics::Limits;

/// Pieces shorter than this take no time, s.
const NOTHING: f64 = 1e-9;

/// The least time of a way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeastTime {
    /// The time, s.
    pub time: f64,
    /// The same at the greatest speeds all along, s.
    pub steady: f64,
    /// The axis that needs most of it: joints of the arm from 0, then the track and the axes of the positioner.
    pub axis: usize,
    /// Whether the accelerations of all axes that move are known and counted.
    pub accelerated: bool,
}

/// A straight piece in the axes. Its length is the time in which the slowest axis goes along it at its greatest speed, s.
#[derive(Debug, Clone, Copy)]
struct Piece {
    length: f64,
    slowest: usize,
    /// Greatest share of that speed per second; infinite where no acceleration is known.
    speeding: f64,
    untold: bool,
}

/// The least time through `places`, at rest at the first and at the last where `rests` says so, the axes at no more than `share` of their
/// speeds. Nothing where no speed is known or nothing moves.
pub fn least_time(
    cell: &Cell,
    places: &[Values],
    rests: [bool; 2],
    share: f64,
) -> Option<LeastTime> {
    let slower = |limits: Limits| Limits {
        speed: limits.speed.map(|s| s * share),
        ..limits
    };
    let limits = cell.axis_limits().map(|l| l.map(slower));
    let pieces = places.windows(2);
    let pieces: Vec<Piece> = pieces
        .filter_map(|p| piece(cell, &limits, [&p[0], &p[1]]))
        .collect();
    let longest = pieces.iter().max_by(|a, b| a.length.total_cmp(&b.length))?;
    let speeds = speeds(&pieces, rests);
    let times = pieces.iter().zip(speeds.windows(2));
    Some(LeastTime {
        time: times.map(|(p, s)| p.time([s[0], s[1]])).sum(),
        steady: pieces.iter().map(|p| p.length).sum(),
        axis: longest.slowest,
        accelerated: pieces.iter().all(|p| !p.untold),
    })
}

fn piece(cell: &Cell, limits: &[Option<Limits>; AXES], ends: [&Values; 2]) -> Option<Piece> {
    let [from, to] = ends.map(|v| cell.shown(v));
    let moved = (0..AXES).filter_map(|i| Some((i, limits[i]?, (to[i] - from[i]).abs())));
    let moved: Vec<_> = moved.filter(|(.., gone)| *gone > 0.0).collect();
    let takes = moved
        .iter()
        .filter_map(|(i, l, gone)| Some((gone / l.speed?, *i)));
    let (length, slowest) = takes.max_by(|a, b| a.0.total_cmp(&b.0))?;
    if length < NOTHING {
        return None;
    }
    let speeding = moved
        .iter()
        .filter_map(|(_, l, gone)| Some(l.acceleration? * length / gone));
    Some(Piece {
        length,
        slowest,
        speeding: speeding.fold(f64::INFINITY, f64::min),
        untold: moved.iter().any(|(_, l, _)| l.acceleration.is_none()),
    })
}

/// Shares of the greatest speed at the ends of the pieces.
fn speeds(pieces: &[Piece], [rests_first, rests_last]: [bool; 2]) -> Vec<f64> {
    let mut speeds = vec![1.0_f64; pieces.len() + 1];
    let reached = |speed: f64, p: &Piece| (speed * speed + 2.0 * p.speeding * p.length).sqrt();
    if rests_first {
        speeds[0] = 0.0;
    }
    if rests_last {
        speeds[pieces.len()] = 0.0;
    }
    for (i, piece) in pieces.iter().enumerate() {
        speeds[i + 1] = speeds[i + 1].min(reached(speeds[i], piece));
    }
    for (i, piece) in pieces.iter().enumerate().rev() {
        speeds[i] = speeds[i].min(reached(speeds[i + 1], piece));
    }
    speeds
}

impl Piece {
    /// How long it takes between two speeds, s.
    fn time(&self, [from, to]: [f64; 2]) -> f64 {
        if self.speeding.is_infinite() {
            return self.length;
        }
        let most = (0.5 * (from * from + to * to) + self.speeding * self.length).sqrt();
        let most = most.min(1.0).max(from).max(to);
        let speeding = (2.0 * most - from - to) / self.speeding;
        let gone = (2.0 * most * most - from * from - to * to) / (2.0 * self.speeding);
        speeding + (self.length - gone).max(0.0) / most
    }
}
