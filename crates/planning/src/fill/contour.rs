//! Contours as beads: where they start, and how a family of them is joined in one corner.

use std::f64::consts::TAU;

use meltpath_geometry::Ring;
use meltpath_geometry::math::DVec2;

use crate::fill::outline::{Room, nearest_share};
use crate::fill::rings::{Contour, families};
use crate::fill::settings::{CORNER, ContourOrder, FillSettings, LayerDirection, StartPoints};

/// The share of the way round at which contours of a layer start, or of the corners there are.
pub(crate) fn start_share(starts: StartPoints, layer: u32, which: u32) -> f64 {
    match starts {
        StartPoints::Aligned => 0.0,
        // the golden section never repeats and spreads evenly
        StartPoints::Spread => (f64::from(layer.saturating_sub(1)) * 0.618_033_988_749_895).fract(),
        StartPoints::Random { seed } => {
            // splitmix64 of seed, layer and contour
            let mut z = seed ^ (u64::from(layer) << 32 | u64::from(which));
            z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        }
    }
}

/// The ring as a closed polyline that starts at the given share of the way from its lower left corner, at a corner if
/// it has any.
pub(crate) fn started(ring: &Ring, share: f64) -> Vec<DVec2> {
    let lower_left = |candidates: &[usize]| {
        candidates
            .iter()
            .copied()
            .enumerate()
            .min_by(|a, b| ring[a.1].element_sum().total_cmp(&ring[b.1].element_sum()))
    };
    let corners = corners(ring);
    if let Some((first, _)) = lower_left(&corners) {
        let k = (first + (share * corners.len() as f64) as usize) % corners.len();
        return from_vertex(ring, corners[k]);
    }
    let all: Vec<usize> = (0..ring.len()).collect();
    let Some((first, _)) = lower_left(&all) else {
        return Vec::new();
    };
    let closed = from_vertex(ring, first);
    let mut left = share * crate::fill::outline::length(&closed);
    for (i, s) in closed.windows(2).enumerate() {
        let step = s[0].distance(s[1]);
        if left < step {
            return from_point(ring, (first + i) % ring.len(), s[0].lerp(s[1], left / step));
        }
        left -= step;
    }
    closed
}

/// The ring as a closed polyline that starts near `near`: at a corner within `reach`, else at the nearest point.
fn started_near(ring: &Ring, near: DVec2, reach: f64) -> Vec<DVec2> {
    let corner = corners(ring)
        .into_iter()
        .map(|i| (ring[i].distance(near), i))
        .filter(|&(away, _)| away <= reach)
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, i)) = corner {
        return from_vertex(ring, i);
    }
    let n = ring.len();
    let nearest = (0..n)
        .map(|i| {
            let (a, b) = (ring[i], ring[(i + 1) % n]);
            let p = a.lerp(b, nearest_share(near, a, b));
            (p.distance(near), i, p)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or_else(Vec::new, |(_, i, p)| from_point(ring, i, p))
}

fn corners(ring: &Ring) -> Vec<usize> {
    let n = ring.len();
    (0..n)
        .filter(|&i| {
            let (a, b, c) = (ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]);
            let turn = (b - a).angle_to(c - b);
            // not the half turn of a ring without width
            turn.abs() > CORNER && turn.abs() < 0.49 * TAU
        })
        .collect()
}

fn from_vertex(ring: &Ring, i: usize) -> Vec<DVec2> {
    (0..=ring.len())
        .map(|k| ring[(i + k) % ring.len()])
        .collect()
}

fn from_point(ring: &Ring, edge: usize, p: DVec2) -> Vec<DVec2> {
    let mut closed = vec![p];
    closed.extend((1..=ring.len()).map(|k| ring[(edge + k) % ring.len()]));
    closed.push(p);
    closed.dedup_by(|a, b| a.distance(*b) < 1e-9);
    closed
}

/// A family of contours, outside first, each a closed polyline that starts beside the start of the one before.
pub(crate) fn aligned_family(
    contours: &[Contour],
    family: &[usize],
    layer: u32,
    settings: &FillSettings,
) -> Vec<Vec<DVec2>> {
    let mut turns: Vec<Vec<DVec2>> = Vec::new();
    for &i in family {
        let ring = &contours[i].ring;
        turns.push(match turns.last().and_then(|t| t.first()) {
            Some(&before) => started_near(ring, before, 2.0 * settings.stepover),
            None => started(ring, start_share(settings.starts, layer, i as u32)),
        });
    }
    if settings.layers == LayerDirection::Alternate && layer.is_multiple_of(2) {
        for turn in &mut turns {
            turn.reverse();
        }
    }
    turns
}

/// The beads of nested contours: each family in one bead where the links between its turns stay inside `links`.
pub(crate) fn contour_beads(
    contours: &[Contour],
    links: &Room,
    order: ContourOrder,
    layer: u32,
    settings: &FillSettings,
) -> Vec<Vec<DVec2>> {
    let mut beads = Vec::new();
    for family in families(contours) {
        let mut turns = aligned_family(contours, &family, layer, settings);
        if order == ContourOrder::InsideOut {
            turns.reverse();
        }
        let mut bead: Vec<DVec2> = Vec::new();
        let mut family_beads = Vec::new();
        for turn in turns {
            if let (Some(&end), Some(&start)) = (bead.last(), turn.first())
                && (end.distance(start) > settings.longest_link
                    || !links.has_way(end, start, 0.2 * settings.width))
            {
                family_beads.push(std::mem::take(&mut bead));
            }
            bead.extend(turn);
        }
        family_beads.push(bead);
        beads.push(family_beads);
    }
    if order == ContourOrder::InsideOut {
        beads.reverse();
    }
    beads.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::Region;

    fn square(low: f64, high: f64) -> Ring {
        [[low, low], [high, low], [high, high], [low, high]]
            .map(DVec2::from_array)
            .to_vec()
    }

    /// The first number of splitmix64 from the seed 0 (S. Vigna's reference).
    #[test]
    fn random_starts_are_those_of_splitmix64() {
        let first = (0xe220_a839_7b1d_cdaf_u64 >> 11) as f64 / (1_u64 << 53) as f64;
        assert_eq!(start_share(StartPoints::Random { seed: 0 }, 0, 0), first);
    }

    /// Shares of the corners are counted along the ring, from the lower left one on, wherever the ring begins.
    #[test]
    fn starts_go_on_along_the_ring_from_its_lower_left_corner() {
        for first in 0..4 {
            let mut ring = square(0.0, 10.0);
            ring.rotate_left(first);
            for (share, corner) in [0.0, 0.25, 0.5, 0.75].into_iter().zip(square(0.0, 10.0)) {
                let line = started(&ring, share);
                assert_eq!((line[0], line.len()), (corner, 5), "{share} of {ring:?}");
            }
        }
    }

    /// Thin beads are looked after in thin steps: a hole of a seventh of a width parts them.
    #[test]
    fn turns_are_joined_where_the_link_stays_inside() {
        let settings = FillSettings {
            starts: StartPoints::Aligned,
            ..FillSettings::new(0.5, 0.35)
        };
        let contours =
            [(0.0, 10.0, None), (0.4, 9.6, Some(0))].map(|(low, high, parent)| Contour {
                ring: square(low, high),
                parent,
            });
        let beads = |holes: Vec<Ring>| {
            let links = Region {
                outer: square(-1.0, 11.0),
                holes,
            };
            contour_beads(
                &contours,
                &Room::new(&[links]),
                ContourOrder::OutsideIn,
                1,
                &settings,
            )
            .len()
        };
        let mut hole = square(0.08, 0.15);
        hole.reverse();
        assert_eq!([beads(Vec::new()), beads(vec![hole])], [1, 2]);
    }
}
