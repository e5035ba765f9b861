//! Turning points of a zigzag, laid by wire or drawn by a beam (whose hatch is `powder/hatch.rs`): the way from the end of one line to the start of the next, along the boundary or straight.

use meltpath_geometry::Ring;
use meltpath_geometry::math::DVec2;

use crate::fill::lines::{Crossing, Span};
use crate::fill::outline::{Room, length};
use crate::fill::settings::FillSettings;

/// Longest link along the boundary between two lines of a cell, in stepovers.
const LONGEST_EDGE_LINK: f64 = 10.0;

/// The points between the end of one line and the start of the next: along the boundary where that is short, straight
/// where that stays inside; `None` where neither will do.
pub(crate) fn link(
    from: (&Span, usize),
    to: (&Span, usize),
    rings: &[&Ring],
    links: &Room,
    settings: &FillSettings,
) -> Option<Vec<DVec2>> {
    let (a, b) = (from.0.point(from.1), to.0.point(to.1));
    let (ca, cb) = (from.0.ends[from.1], to.0.ends[to.1]);
    let straight = a.distance(b);
    let longest = settings.longest_link.max(2.0 * (b.y - a.y).abs());
    // along the boundary the link is a bead in its place: round ends of a region need long ones
    let longest_along = longest.max(LONGEST_EDGE_LINK * settings.stepover);
    if ca.ring == cb.ring {
        let ring = rings[ca.ring];
        let ways = [along(ring, ca, cb), {
            let mut back = along(ring, cb, ca);
            back.reverse();
            back
        }];
        let shortest = ways
            .into_iter()
            .map(|way| (length(&[&[a], way.as_slice(), &[b]].concat()), way))
            .min_by(|p, q| p.0.total_cmp(&q.0));
        if let Some((long, way)) = shortest
            && long <= longest_along
        {
            return Some(way);
        }
    }
    (straight <= longest && links.has_way(a, b, 0.2 * settings.width)).then(Vec::new)
}

/// The vertices of a ring between two crossings, in the ring's sense.
fn along(ring: &Ring, from: Crossing, to: Crossing) -> Vec<DVec2> {
    let n = ring.len();
    let count = (to.edge + n - from.edge) % n;
    (1..=count).map(|k| ring[(from.edge + k) % n]).collect()
}
