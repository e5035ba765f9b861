//! Overhang between layers: how far each slice reaches out over the one below
//! (Rouchon 2022, § 1.2.3.1: the shift between contours must stay below a fraction of the bead width).

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use meltpath_base::{Cancelled, Observer, Place, Reporter};

use crate::{
    boolean::{PlanarError, difference},
    math::{DVec2, DVec3},
    offset::{Join, outset},
    region::Region,
    section::Slice,
    segments::nearest_share,
};

/// Overhanging pieces smaller than this, mm², are rounding.
const SLIVER: f64 = 1e-3;

/// How slices are grown: round, with a chord error of 2 µm.
const ROUND: Join = Join::Round {
    arc_tolerance: 0.002,
};

/// A piece of a slice that reaches out too far.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Overhang {
    /// Number of the slice, counted from 0; the one below it is `slice - 1`.
    pub slice: usize,
    /// How far the piece reaches beyond the slice below, mm; `None` where there is nothing below at all.
    pub shift: Option<f64>,
    /// Its farthest corner.
    pub place: DVec3,
    /// Area beyond what is accepted, mm².
    pub area: f64,
}

/// How far a slice reaches out over the one below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shift {
    /// Number of the slice, counted from 0; the one below it is `slice - 1`.
    pub slice: usize,
    /// How far, mm.
    pub shift: f64,
    /// The corner that does.
    pub place: DVec3,
}

/// Why overhangs could not be looked for.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum OverhangError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A slice cannot be compared with the one below it.
    #[error(transparent)]
    Planar(#[from] PlanarError),
    /// The accepted shift makes no sense.
    #[error(
        "the accepted overhang, {fraction} of a bead width of {bead_width} mm, must be zero or more and finite"
    )]
    Limit {
        /// Bead width, mm.
        bead_width: f64,
        /// Fraction of it.
        fraction: f64,
    },
}

/// Pieces of slices (from bottom to top, of one plan) that reach more than `fraction` × `bead_width` (mm) beyond
/// the slice below. The first slice that holds anything rests on the plate.
///
/// Warns once (`overhang`) with the number of slices and the worst place. The shift of a piece is taken at its
/// corners, that of the piece that reaches farthest to a hundredth of `bead_width` ([`largest_shift`]).
///
/// # Errors
/// A limit that makes no sense; cancellation.
pub fn overhangs(
    slices: &[Slice],
    bead_width: f64,
    fraction: f64,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<Overhang>, OverhangError> {
    let accepted = bead_width * fraction;
    if !(accepted.is_finite() && accepted >= 0.0) {
        return Err(OverhangError::Limit {
            bead_width,
            fraction,
        });
    }
    observer.stage("check overhangs", slices.len() as u64);
    let Some(first) = slices.iter().position(|s| !s.regions.is_empty()) else {
        return Ok(Vec::new());
    };
    let found: Vec<Vec<Overhang>> = (first + 1..slices.len())
        .into_par_iter()
        .map(|k| {
            observer.check()?;
            let found = between(&slices[k - 1], &slices[k], k, accepted)?;
            observer.advance(1);
            Ok(found)
        })
        .collect::<Result<_, OverhangError>>()?;
    let mut found: Vec<Overhang> = found.into_iter().flatten().collect();
    let mut open: Vec<Beyond> = Vec::new();
    for k in found.iter().filter(|o| o.shift.is_some()).map(|o| o.slice) {
        if open.last().is_none_or(|b| b.slice != k) {
            let regions = slices[k].regions.clone();
            open.push(Beyond { slice: k, regions });
        }
    }
    let least = found
        .iter()
        .filter_map(|o| o.shift)
        .fold(accepted, f64::max);
    let step = STEP * bead_width;
    if let Some(worst) = deepest(slices, open, least, step, observer)? {
        let of_slice = found.iter_mut().filter(|o| o.slice == worst.slice);
        let nearest = of_slice.min_by(|a, b| {
            let to = |o: &Overhang| o.place.distance(worst.place);
            to(a).total_cmp(&to(b))
        });
        if let Some(piece) = nearest {
            (piece.shift, piece.place) = (Some(worst.shift), worst.place);
        }
    }
    let reach = |o: &Overhang| o.shift.unwrap_or(f64::INFINITY);
    if let Some(worst) = found
        .iter()
        .max_by(|a, b| reach(a).total_cmp(&reach(b)).then(b.slice.cmp(&a.slice)))
    {
        let mut layers: Vec<usize> = found.iter().map(|o| o.slice).collect();
        layers.dedup();
        let how_far = worst.shift.map_or_else(
            || "has nothing below it".to_owned(),
            |shift| format!("reaches {shift:.2} mm beyond the one below"),
        );
        reporter.warn_at(
            "overhang",
            format!(
                "{} of {} slices overhang more than {accepted:.2} mm ({fraction} of the bead width); \
                 at worst a slice {how_far}",
                layers.len(),
                slices.len()
            ),
            Place {
                layer: u32::try_from(worst.slice + 1).ok(),
                ..Place::at(worst.place.to_array())
            },
            "turn the part, choose another build direction or thinner layers",
        );
    }
    Ok(found)
}

/// The farthest that any slice reaches beyond the slice below, whatever is accepted; `None` where none does. Of all points of a slice the one
/// that is farthest from the slice below counts, in the middle of a piece that is held on two sides too: to a hundredth of `bead_width`, mm.
/// Slices over nothing at all have none, and are told by [`overhangs`].
///
/// # Errors
/// Slices that cannot be compared; cancellation.
pub fn largest_shift(
    slices: &[Slice],
    bead_width: f64,
    observer: &dyn Observer,
) -> Result<Option<Shift>, OverhangError> {
    let found: Vec<Option<(Option<Shift>, Beyond)>> = (1..slices.len())
        .into_par_iter()
        .map(|k| {
            observer.check()?;
            let (below, above) = (&slices[k - 1], &slices[k]);
            if below.regions.is_empty() || above.regions.is_empty() {
                return Ok(None);
            }
            let beyond = Beyond::of(k, &above.regions, &below.regions)?;
            let corners = beyond.regions.iter().flat_map(|r| r.outer.iter().copied());
            let at_corners = farthest(&below.regions, corners).map(|(shift, p)| Shift {
                slice: k,
                shift,
                place: above.surface.from_local(p),
            });
            Ok((!beyond.regions.is_empty()).then_some((at_corners, beyond)))
        })
        .collect::<Result<_, OverhangError>>()?;
    let (corners, beyond): (Vec<_>, Vec<_>) = found.into_iter().flatten().unzip();
    let at_corners = corners.into_iter().flatten().max_by(Shift::order);
    let least = at_corners.map_or(0.0, |s| s.shift);
    let inside = deepest(slices, beyond, least, STEP * bead_width, observer)?;
    Ok(inside.or(at_corners))
}

/// Places within pieces are looked for in steps of this share of a bead's width.
const STEP: f64 = 0.01;

impl Shift {
    /// By how far, the lower slice first of those that reach as far.
    fn order(&self, other: &Shift) -> std::cmp::Ordering {
        let far = self.shift.total_cmp(&other.shift);
        far.then(other.slice.cmp(&self.slice))
    }
}

/// What of a slice lies farther than some distance from the slice below.
struct Beyond {
    slice: usize,
    regions: Vec<Region>,
}

impl Beyond {
    fn of(slice: usize, regions: &[Region], supported: &[Region]) -> Result<Self, PlanarError> {
        let mut regions = difference(regions, supported)?;
        regions.retain(|piece| piece.area() >= SLIVER);
        Ok(Beyond { slice, regions })
    }

    /// What lies farther than `distance`, mm; nothing where all is nearer.
    fn farther(
        &self,
        slices: &[Slice],
        distance: f64,
        join: Join,
    ) -> Result<Option<Self>, PlanarError> {
        let supported = outset(&slices[self.slice - 1].regions, distance, join)?;
        let beyond = Beyond::of(self.slice, &self.regions, &supported)?;
        Ok((!beyond.regions.is_empty()).then_some(beyond))
    }
}

/// The point of `open` that is farthest from the slice below its own, where that is more than `least` + `step`, mm: slices below are grown until
/// they cover all, and the growth is halved down to `step`. Slices that are covered are not looked at again.
fn deepest(
    slices: &[Slice],
    mut open: Vec<Beyond>,
    least: f64,
    step: f64,
    observer: &dyn Observer,
) -> Result<Option<Shift>, OverhangError> {
    let join = Join::Round {
        arc_tolerance: 0.1 * step,
    };
    let (mut low, mut high) = (least + step, f64::INFINITY);
    let mut next = low;
    let mut beyond = false;
    while !open.is_empty() && step > 0.0 {
        observer.check()?;
        let farther: Vec<Option<Beyond>> = open
            .par_iter()
            .map(|piece| piece.farther(slices, next, join))
            .collect::<Result<_, PlanarError>>()?;
        let farther: Vec<Beyond> = farther.into_iter().flatten().collect();
        if farther.is_empty() {
            high = next;
            if !beyond {
                return Ok(None);
            }
        } else {
            (open, low, beyond) = (farther, next, true);
        }
        if high - low <= step {
            break;
        }
        next = if high.is_finite() {
            0.5 * (low + high)
        } else {
            2.0 * low
        };
    }
    let found = open.iter().filter_map(|piece| {
        let corners = piece.regions.iter().flat_map(|r| r.outer.iter().copied());
        let (shift, p) = farthest(&slices[piece.slice - 1].regions, corners)?;
        Some(Shift {
            slice: piece.slice,
            shift,
            place: slices[piece.slice].surface.from_local(p),
        })
    });
    Ok(found.filter(|_| beyond).max_by(Shift::order))
}

/// The point that lies farthest from the boundary of regions, with its distance, mm.
fn farthest(regions: &[Region], points: impl Iterator<Item = DVec2>) -> Option<(f64, DVec2)> {
    let rings = regions.iter().flat_map(Region::rings);
    let edges: Vec<[DVec2; 2]> = rings
        .flat_map(|ring| {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(a, b)| [*a, *b])
        })
        .collect();
    let mut near = 0;
    let mut worst: Option<(f64, DVec2)> = None;
    for p in points {
        let most = worst.map_or(f64::NEG_INFINITY, |w| w.0);
        let mut least = (f64::INFINITY, near);
        // neighbouring corners have neighbouring edges nearest to them, and most are nearer than the farthest one
        for k in 0..edges.len() {
            let i = (near + edges.len() - 1 + k) % edges.len();
            let d = to_segment(edges[i], p);
            if d < least.0 {
                least = (d, i);
            }
            if least.0 <= most {
                break;
            }
        }
        near = least.1;
        if least.0.is_finite() && least.0 > most {
            worst = Some((least.0, p));
        }
    }
    worst
}

/// Distance from a point to a segment.
fn to_segment([a, b]: [DVec2; 2], p: DVec2) -> f64 {
    let ab = b - a;
    let t = nearest_share((p - a).dot(ab), ab.length_squared());
    p.distance(a + ab * t)
}

/// Overhanging pieces of one slice over another.
fn between(
    below: &Slice,
    above: &Slice,
    slice: usize,
    accepted: f64,
) -> Result<Vec<Overhang>, PlanarError> {
    if above.regions.is_empty() {
        return Ok(Vec::new());
    }
    let supported = outset(&below.regions, accepted, ROUND)?;
    let mut found = Vec::new();
    for piece in difference(&above.regions, &supported)? {
        let area = piece.area();
        if area < SLIVER {
            continue;
        }
        let corner = piece
            .outer
            .iter()
            .map(|&p| (distance(&below.regions, p), p))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((shift, p)) = corner {
            found.push(Overhang {
                slice,
                shift: (!below.regions.is_empty()).then_some(shift),
                place: above.surface.from_local(p),
                area,
            });
        }
    }
    // a stable order whatever the clipping library's
    found.sort_by(|a, b| (b.area.total_cmp(&a.area)).then(a.place.x.total_cmp(&b.place.x)));
    Ok(found)
}

/// Distance from a point outside regions to their nearest boundary; infinite for no regions.
pub fn distance(regions: &[Region], p: DVec2) -> f64 {
    let mut least = f64::INFINITY;
    for ring in regions.iter().flat_map(Region::rings) {
        for (i, &a) in ring.iter().enumerate() {
            least = least.min(to_segment([a, ring[(i + 1) % ring.len()]], p));
        }
    }
    least
}
