//! Where in a plan a program begins that goes along the rest of it, with the arc on or off.

use meltpath_geometry::math::DVec3;
use meltpath_robot::command::Kind;
use meltpath_toolpath::{Pass, Toolpath};

use crate::waam::program::Commands;

/// How far ends of moves may lie apart, mm: the digits of programs of different controllers.
pub(super) const SAME_PLACE: f64 = 0.02;
/// Lengths of a bead that differ by less, in relation, are of one: a controller leaves out moves that are too short for it.
const SAME_BEAD: f64 = 0.01;

/// The beads of a plan, in order.
pub(in crate::waam) fn beads(toolpath: &Toolpath) -> impl DoubleEndedIterator<Item = Pass<'_>> {
    toolpath.passes().filter(|p| p.head.role.deposits())
}

/// The number, from 0, of the first bead of a plan along which a program goes, and along all those after it, one after the other, to the last;
/// nothing where it does not go along the last.
pub(in crate::waam) fn begins_at(toolpath: &Toolpath, moves: &Commands) -> Option<usize> {
    let ends = moves.commands.iter();
    let ends = ends.filter(|c| !matches!(c.kind, Kind::Wait { .. }));
    let start = std::iter::once(moves.start.position);
    let way: Vec<DVec3> = start.chain(ends.map(|c| c.target)).collect();
    let beads: Vec<Pass<'_>> = beads(toolpath).collect();
    let (mut left, mut first) = (&way[..], None);
    for (number, bead) in beads.iter().enumerate().rev() {
        let Some(from) = along(bead.points, left) else {
            break;
        };
        left = &left[..=from];
        first = Some(number);
    }
    first
}

/// Where on a way the last stretch begins that goes from the first to the last of these points and is as long as they are.
fn along(points: &[DVec3], way: &[DVec3]) -> Option<usize> {
    let near = |a: &DVec3, b: &DVec3| a.distance(*b) <= SAME_PLACE;
    let (first, last) = (points.first()?, points.last()?);
    let whole: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
    let off = SAME_BEAD * whole + SAME_PLACE;
    let ends = (0..way.len()).rev().filter(|i| near(&way[*i], last));
    let begins = |end: usize| {
        let mut length = 0.0;
        for from in (0..end).rev() {
            length += way[from].distance(way[from + 1]);
            if length > whole + off {
                return None;
            }
            if length >= whole - off && near(&way[from], first) {
                return Some(from);
            }
        }
        None
    };
    ends.into_iter().find_map(begins)
}
