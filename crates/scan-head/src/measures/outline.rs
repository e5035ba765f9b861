//! What is to be filled of a layer: its section where that is known, else what its closed contours enclose.

use std::collections::BTreeMap;
use std::sync::Arc;

use meltpath_geometry::math::DVec2;
use meltpath_geometry::region::{crosses, signed_area};
use meltpath_toolpath::Role;

use super::segment::distance_to_segment;
use crate::head::vector::ScanJob;

/// Hatch distances up to which a ring lies beside the one round it all along: both are contours of one boundary.
const BESIDE: f64 = 1.6;
/// Rings end where they begin, mm.
const CLOSED: f64 = 1e-3;
/// What no mark comes nearer to than so many hatch distances is bare. Lines a hatch apart leave half of one, one missing line a whole one.
pub const NEAR: f64 = 1.05;

/// Rings, mm: what lies within an odd number of them.
pub type Rings = Vec<Vec<DVec2>>;

/// Where outlines of layers come from.
#[derive(Debug, Clone)]
pub enum Outlines {
    /// There are none.
    None,
    /// Of a part's sections, by the number of the layer.
    Known(Arc<BTreeMap<u32, Rings>>),
    /// The closed contours of the layers themselves. Nobody says what they are for: what no line of a fill comes near ([`NEAR`]) is left
    /// out, and a layer without lines, or without closed contours, has no outline.
    OfContours,
}

/// What is to be filled of one layer.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    pub(super) rings: Rings,
    /// Only what lies within so many mm of a line, where that is a bound.
    pub(super) near: Option<(Vec<[DVec2; 2]>, f64)>,
}

impl Outlines {
    /// The outline of layer `number`, whose lines lie `hatch` mm apart.
    pub(super) fn of(&self, number: u32, job: &ScanJob, hatch: f64) -> Option<Outline> {
        match self {
            Outlines::None => None,
            Outlines::Known(all) => {
                let rings = all.get(&number)?.clone();
                Some(Outline { rings, near: None })
            }
            Outlines::OfContours => {
                let marks = |wanted: fn(Role) -> bool| {
                    let marks =
                        (0..job.vectors.len()).filter(move |&i| wanted(job.vectors[i].kind));
                    marks.map(|i| [job.start_of(i).truncate(), job.vectors[i].end.truncate()])
                };
                marks(|role| role == Role::Fill).next()?;
                let rings = rings(marks(|role| role == Role::Contour));
                let bounds = boundaries(&rings, hatch);
                let rings: Rings = bounds.into_iter().map(<[DVec2]>::to_vec).collect();
                // a contour round what has no lines asks for none
                let near = marks(|role| role == Role::Fill).collect();
                (!rings.is_empty()).then_some(Outline {
                    rings,
                    near: Some((near, NEAR * hatch)),
                })
            }
        }
    }
}

/// From where to where, mm along x, rows at the heights `rows`, mm and rising, lie within an odd number of rings: row by row, in order.
///
/// ```
/// use meltpath_geometry::math::DVec2;
/// use meltpath_scan_head::measures::outline::within;
/// let square = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
/// assert_eq!(within([&square[..]], &[-0.5, 0.5]), [vec![], vec![[0.0, 1.0]]]);
/// ```
pub fn within<'a>(
    rings: impl IntoIterator<Item = &'a [DVec2]>,
    rows: &[f64],
) -> Vec<Vec<[f64; 2]>> {
    let mut crossings = vec![Vec::new(); rows.len()];
    for [a, b] in rings.into_iter().flat_map(ends) {
        // half open, so that a corner counts once
        let [first, end] =
            [a.y.min(b.y), a.y.max(b.y)].map(|y| rows.partition_point(|row| *row < y));
        for (row, y) in crossings.iter_mut().zip(rows).take(end).skip(first) {
            row.push(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
        }
    }
    let pairs = |mut row: Vec<f64>| {
        row.sort_by(f64::total_cmp);
        row.as_chunks::<2>().0.to_vec()
    };
    crossings.into_iter().map(pairs).collect()
}

/// The closed rings of contours; what is drawn on from where the last line ended goes on with it.
pub fn rings(lines: impl Iterator<Item = [DVec2; 2]>) -> Rings {
    let (mut found, mut open) = (Vec::new(), Vec::<DVec2>::new());
    for [from, to] in lines {
        if open.last().is_none_or(|end| end.distance(from) > CLOSED) {
            open = vec![from];
        }
        open.push(to);
        let closes = open.len() > 3 && open[0].distance(to) <= CLOSED;
        if closes {
            open.pop();
            found.push(std::mem::take(&mut open));
        }
    }
    found
}

/// A ring with its box and its signed area.
struct Nested<'a> {
    ring: &'a [DVec2],
    low: DVec2,
    high: DVec2,
    area: f64,
}

impl Nested<'_> {
    fn holds(&self, p: DVec2) -> bool {
        if p.cmplt(self.low).any() || p.cmpgt(self.high).any() {
            return false;
        }
        ends(self.ring).filter(|[a, b]| crosses(*a, *b, p)).count() % 2 == 1
    }
}

/// The sides of a ring.
fn ends(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> + '_ {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| [*a, *b])
}

/// The rings that bound what is enclosed, whichever way they run: of contours side by side the outermost.
pub fn boundaries(rings: &[Vec<DVec2>], hatch: f64) -> Vec<&[DVec2]> {
    let mut all: Vec<Nested<'_>> = rings
        .iter()
        .map(|ring| Nested {
            low: ring.iter().copied().fold(DVec2::INFINITY, DVec2::min),
            high: ring.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max),
            area: signed_area(ring),
            ring,
        })
        .collect();
    all.sort_by(|a, b| b.area.abs().total_cmp(&a.area.abs()));
    let doubles = |n: usize| {
        let own = &all[n];
        // the smallest of the larger ones that hold it
        let round = all[..n].iter().rev().find(|r| r.holds(own.ring[0]));
        round.is_some_and(|round| {
            round.area.signum() == own.area.signum() && beside(own.ring, round.ring, BESIDE * hatch)
        })
    };
    let bound = (0..all.len()).filter(|n| !doubles(*n));
    bound.map(|n| all[n].ring).collect()
}

/// Whether every corner of a ring lies within a distance of another.
fn beside(ring: &[DVec2], round: &[DVec2], within: f64) -> bool {
    let near = |p: DVec2| ends(round).any(|[a, b]| distance_to_segment(p, a, b) <= within);
    ring.iter().all(|p| near(*p))
}
