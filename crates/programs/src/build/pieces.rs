//! Moves in pieces, for a controller that leads a part to a torch that stands point by point: between two points the torch leaves the line over a
//! part that turns meanwhile, by up to a quarter of the move's length times the angle. Of a piece it is a part in the square of their number.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::{DQuat, DVec3};

use super::{Builder, Point, rounded};
use crate::orientation::pose;
use crate::program::Dialect;

/// Longest piece, mm: a part that turns by a degree over it is left by 0.02 mm.
const LONGEST: f64 = 5.0;

impl Builder<'_> {
    /// The pieces of a move by a path: the point on the way of each that is round, and where it ends.
    pub(super) fn pieces(&self, via: Option<Point>, to: Point) -> Vec<(Option<Point>, Point)> {
        let leads_points =
            self.settings.dialect == Dialect::Val3 && self.settings.standing.is_some();
        let Some(from) = self.place.filter(|_| leads_points) else {
            return vec![(via, to)];
        };
        let arc = via.and_then(|via| Arc::through(from.position, via.position, to.position));
        let length = match &arc {
            Some(arc) => (arc.radius * arc.sweep).abs(),
            None => from.position.distance(to.position),
        };
        let count = (length / LONGEST).ceil().max(1.0);
        if count < 2.0 || !count.is_finite() {
            return vec![(via, to)];
        }
        let last = count as u32;
        let piece = |number: u32| {
            let share = |halves: f64| 0.5 * halves / count;
            let whole = 2.0 * f64::from(number);
            let at = |halves: f64| part_way(from, to, arc.as_ref(), share(halves));
            let end = if number == last { to } else { at(whole) };
            (arc.is_some().then(|| at(whole - 1.0)), end)
        };
        (1..=last).map(piece).collect()
    }
}

/// The point at a share of a move.
fn part_way(from: Point, to: Point, arc: Option<&Arc>, share: f64) -> Point {
    let turned = |point: &Point| pose(DVec3::ZERO, point.wpr).orientation;
    let position = match arc {
        Some(arc) => arc.at(share),
        None => from.position.lerp(to.position, share),
    };
    Point {
        position: rounded(position, 0.0),
        wpr: angles(turned(&from).slerp(turned(&to), share)),
        axes: to.axes,
    }
}

/// W, P, R, deg.
fn angles(orientation: DQuat) -> [f64; 3] {
    let pose = meltpath_geometry::Pose {
        position: DVec3::ZERO,
        orientation,
    };
    pose.wpr().to_array().map(f64::to_degrees)
}
