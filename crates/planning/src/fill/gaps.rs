//! What the beads of a region leave without metal: between the last line and a round rim, beside a hole, where nested
//! contours part. Each bead feeds a band one stepover wide; what lies in no band and has room for metal gets a bead on
//! its own centre line, which goes on from the end of a bead nearby where there is one; what is too short for an arc start
//! becomes a way there and back of the bead beside it.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use meltpath_geometry::Region;
use meltpath_geometry::boolean::PlanarError;
use meltpath_geometry::cover::{Band, Ground, bare};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::medial::medial_axis;
use meltpath_geometry::offset::{Join, inset, outset};
use meltpath_geometry::section::simplified;
use meltpath_toolpath::Role;

use crate::fill::bead::Bead;
use crate::fill::chain::{Chain, End, Skeleton, joined, outward};
use crate::fill::outline::{Room, length, nearest_share, ray};
use crate::fill::settings::{FillSettings, Spacing};
use crate::fill::thin::LARGEST_TURN;

/// Gaps narrower than this share of a stepover close as the beads beside them level out.
const NARROWEST: f64 = 0.4;
/// Shortest way that prolongs a bead into a gap, bead widths.
const SHORTEST_TAIL: f64 = 0.4;
/// Least part of its metal, laid as fast as the bead can go, that a way there and back must find room for in the gap.
const LEAST_DETOUR: f64 = 0.7;
/// Gaps wider than a bead takes need another one beside the first.
const ROUNDS: usize = 3;
/// Most places of a piece that are known: more come where lines are turned from layer to layer, and seldom again.
const MOST_KNOWN: usize = 20_000;

/// The beads that fill gaps, by the place: its rings, as the bits of their coordinates.
type Middles = Mutex<HashMap<Vec<u64>, Option<Middle>>>;

/// Where beads leave gaps in a region; what layers of the same region share.
pub(crate) struct Places {
    /// Where bead axes may lie.
    links: Room,
    /// Half the width of the narrowest gap, mm.
    radius: f64,
    /// What metal touches of a disc of that radius.
    touched: Band,
    /// Where such a disc has its centre, before there are beads.
    centres: Ground,
    /// What is known of places.
    middles: Middles,
}

impl Places {
    /// Those of `region`.
    pub(crate) fn new(region: &Region, settings: &FillSettings) -> Result<Self, PlanarError> {
        let whole = std::slice::from_ref(region);
        let (width, stepover, join) = (settings.width, settings.stepover, settings.join());
        // a free edge is fed by the bead half a width inside it
        let fed_to = inset(whole, 0.5 * (width - stepover), join)?;
        let links = Room::new(&inset(whole, 0.48 * width, join)?);
        let radius = 0.5
            * match settings.spacing {
                Spacing::Fill => NARROWEST * stepover,
                // distances stay as written, but no place stays dry in which a bead has room
                Spacing::Exact => width,
            };
        // where a disc has its centre when it touches no metal: no slivers between beads that touch are ever cut out
        let touched = Band {
            reach: 0.5 * stepover + radius,
            arc_tolerance: 1e-2 * width,
        };
        Ok(Places {
            links,
            radius,
            touched,
            centres: Ground::new(inset(&fed_to, radius, join)?, touched)?,
            middles: Mutex::default(),
        })
    }

    /// The bead that fills a gap, if its metal has room there.
    fn middle(&self, place: &Region, settings: &FillSettings) -> Option<Middle> {
        let mut bits = Vec::new();
        for ring in place.rings() {
            bits.push(ring.len() as u64);
            bits.extend(ring.iter().flat_map(DVec2::to_array).map(f64::to_bits));
        }
        let known = || self.middles.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(middle) = known().get(&bits) {
            return middle.clone();
        }
        let found = middle(place, &self.links, settings);
        let mut known = known();
        if known.len() < MOST_KNOWN {
            known.insert(bits, found.clone());
        }
        found
    }
}

/// Fills the gaps that `beads` leave.
pub(crate) fn close(
    gaps: &Places,
    beads: &mut Vec<Bead>,
    settings: &FillSettings,
) -> Result<(), PlanarError> {
    if beads.is_empty() {
        return Ok(());
    }
    let (links, radius) = (&gaps.links, gaps.radius);
    let mut centres = gaps.centres.bare(&points_of(beads))?;
    // discs of few chords: the middle of a place hangs little on them, and a diagram of many costs much
    let coarse = Join::Round {
        arc_tolerance: 0.05 * radius,
    };
    for round in 1..=ROUNDS {
        let places = outset(&centres, radius, coarse)?;
        let mut found: Vec<Middle> = places
            .iter()
            .filter(|place| place.area() >= least_area(settings))
            .filter_map(|place| gaps.middle(place, settings))
            .collect();
        let before: Vec<usize> = beads.iter().map(|b| b.points.len()).collect();
        // the longest first: it has the best claim to a bead's open end
        found.sort_by(|a, b| length(&b.line).total_cmp(&length(&a.line)));
        let mut alone = Vec::new();
        for Middle { line, area } in found {
            let line = prolong(line, beads, links, settings);
            alone.extend(line.map(|line| Middle { line, area }));
        }
        let short: Vec<_> = alone
            .extract_if(.., |m| length(&m.line) + 1e-9 < settings.shortest_bead)
            .collect();
        lay_in_order(alone.into_iter().map(|m| m.line).collect(), beads, settings);
        let mut boxes = Boxes::new(beads);
        for gap in short {
            if let Some(bead) = detour(&gap, beads, &boxes, links, settings) {
                boxes.see(bead, &beads[bead]);
            }
        }
        let grown = beads.iter().zip(before.iter().chain(std::iter::repeat(&0)));
        let new: Vec<Vec<DVec2>> = grown
            .filter(|(bead, before)| bead.points.len() != **before)
            .map(|(bead, _)| bead.points.clone())
            .collect();
        if new.is_empty() || round == ROUNDS {
            break;
        }
        centres = left(centres, &new, gaps.touched)?;
    }
    Ok(())
}

/// The lines of beads.
fn points_of(beads: &[Bead]) -> Vec<Vec<DVec2>> {
    beads.iter().map(|b| b.points.clone()).collect()
}

/// What new lines leave of the places for centres: those that none comes near stay as they are.
fn left(
    centres: Vec<Region>,
    new: &[Vec<DVec2>],
    touched: Band,
) -> Result<Vec<Region>, PlanarError> {
    let boxes: Vec<[DVec2; 2]> = new.iter().flat_map(|line| boxes_round(line)).collect();
    let (mut near, mut left): (Vec<Region>, Vec<Region>) =
        centres.into_iter().partition(|centre| {
            let [low, high] = box_round(&centre.outer);
            let (low, high) = (low - touched.reach, high + touched.reach);
            boxes
                .iter()
                .any(|b| low.cmple(b[1]).all() && b[0].cmple(high).all())
        });
    if !near.is_empty() {
        near = bare(&near, new, touched)?;
    }
    left.append(&mut near);
    Ok(left)
}

/// The bead that would fill a gap.
#[derive(Clone)]
struct Middle {
    line: Vec<DVec2>,
    /// Area of the gap, mm².
    area: f64,
}

/// Leads the nearest bead along the line and back, or towards its middle and back, as far as the metal of both ways has
/// room in the gap; the bead that does.
fn detour(
    gap: &Middle,
    beads: &mut [Bead],
    boxes: &Boxes,
    links: &Room,
    settings: &FillSettings,
) -> Option<usize> {
    let &Middle { ref line, area } = gap;
    let fastest = settings.paces.map_or(1.0, |p| p.fastest);
    // there and back
    let longest = fastest * area / (2.0 * LEAST_DETOUR * settings.stepover);
    let back: Vec<DVec2> = line.iter().rev().copied().collect();
    let middle = middle_of(line);
    [line.as_slice(), &back, &middle].iter().find_map(|way| {
        let (i, k, foot) = boxes.nearest(*way.first()?, beads)?;
        let mut out = [&[foot], *way].concat();
        if let [foot, tip] = out[..] {
            out[1] = foot + (tip - foot).clamp_length_max(longest);
        }
        let long = length(&out);
        if long > longest + 1e-9
            || long < SHORTEST_TAIL * settings.width
            || !links.has_way(foot, out[1], 0.2 * settings.width)
        {
            return None;
        }
        let home = out.iter().rev().skip(1).copied();
        let bead = &mut beads[i];
        bead.tolerance = bead.tolerance.max(settings.facet());
        let there_and_back: Vec<DVec2> = out.iter().copied().chain(home).collect();
        let after = k + 1;
        bead.points.splice(after..after, there_and_back);
        bead.points.dedup();
        Some(i)
    })
}

/// The point half way along a polyline, as a polyline; none for an empty one.
fn middle_of(line: &[DVec2]) -> Vec<DVec2> {
    let mut left = 0.5 * length(line);
    for side in line.windows(2) {
        let long = side[0].distance(side[1]);
        if long >= left && long > 0.0 {
            return vec![side[0].lerp(side[1], left / long)];
        }
        left -= long;
    }
    line.first().copied().into_iter().collect()
}

/// Stretches of a bead that one box of [`Boxes`] holds.
const BOXED: usize = 32;

/// The low and the high corner of the box round points.
fn box_round(points: &[DVec2]) -> [DVec2; 2] {
    let none = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let points = points.iter();
    points.fold(none, |[low, high], &p| [low.min(p), high.max(p)])
}

/// Boxes round a line, one for [`BOXED`] stretches.
fn boxes_round(line: &[DVec2]) -> Vec<[DVec2; 2]> {
    let starts = (0..line.len().saturating_sub(1)).step_by(BOXED);
    starts
        .map(|k| box_round(&line[k..(k + BOXED + 1).min(line.len())]))
        .collect()
}

/// Boxes round the beads, some stretches each: most lie too far from a place to be looked into.
struct Boxes(Vec<Vec<[DVec2; 2]>>);

impl Boxes {
    fn new(beads: &[Bead]) -> Self {
        Boxes(beads.iter().map(|b| boxes_round(&b.points)).collect())
    }

    /// Takes a bead as it has become.
    fn see(&mut self, index: usize, bead: &Bead) {
        self.0[index] = boxes_round(&bead.points);
    }

    /// Where the beads come nearest to a place: bead, stretch, point of it; of equal ones the first.
    fn nearest(&self, place: DVec2, beads: &[Bead]) -> Option<(usize, usize, DVec2)> {
        let mut best: Option<(f64, (usize, usize, DVec2))> = None;
        for (i, (bead, boxes)) in beads.iter().zip(&self.0).enumerate() {
            for (n, &[low, high]) in boxes.iter().enumerate() {
                let away = place.distance_squared(place.clamp(low, high));
                // rounding of the foot below may bring it out of its box by less than this
                if best.is_some_and(|(best, _)| away > best * (1.0 + 1e-9) + 1e-12) {
                    continue;
                }
                let first = n * BOXED;
                let past = (first + BOXED + 1).min(bead.points.len());
                for (k, side) in bead.points[first..past].windows(2).enumerate() {
                    let foot = side[0].lerp(side[1], nearest_share(place, side[0], side[1]));
                    let away = foot.distance_squared(place);
                    if best.is_none_or(|(best, _)| away < best) {
                        best = Some((away, (i, first + k, foot)));
                    }
                }
            }
        }
        best.map(|(_, found)| found)
    }
}

/// Area of the smallest gap whose metal makes the shortest tail, or the shortest way there and back, mm².
fn least_area(settings: &FillSettings) -> f64 {
    let fastest = settings.paces.map_or(1.0, |p| p.fastest);
    let least = settings.least_share().min(2.0 * LEAST_DETOUR / fastest);
    least * settings.stepover * SHORTEST_TAIL * settings.width
}

/// The bead that fills a gap, if its metal has room there.
fn middle(place: &Region, links: &Room, settings: &FillSettings) -> Option<Middle> {
    let stepover = settings.stepover;
    let axis = medial_axis(&simplified(place, 0.02 * stepover), 0.125 * settings.width).ok()?;
    let skeleton = Skeleton::new(axis);
    let chains = skeleton.chains(0.5 * NARROWEST * stepover, f64::INFINITY, &|_| true);
    let line = joined(chains, 0.5 * stepover, LARGEST_TURN)
        .iter()
        .map(|chain| to_the_ends(chain, place, links, settings))
        .max_by(|a, b| length(a).total_cmp(&length(b)))?;
    let line = longest_inside(&line, links, settings);
    let long = length(line);
    let area = place.area();
    let room = area / (stepover * long.max(1e-9));
    (line.len() > 1 && room >= settings.least_share()).then(|| Middle {
        line: line.to_vec(),
        area,
    })
}

/// The longest stretch of a line that stays where bead axes may lie: an end may lead into a corner beside the region.
fn longest_inside<'a>(line: &'a [DVec2], links: &Room, settings: &FillSettings) -> &'a [DVec2] {
    let stays = |a: &DVec2, b: &DVec2| links.has_way(*a, *b, 0.25 * settings.width);
    let stretches = line.chunk_by(stays);
    let longest = stretches.max_by(|a, b| length(a).total_cmp(&length(b)));
    longest.unwrap_or_default()
}

/// The line of a chain, prolonged to where the gap ends: half a stepover before the beads there.
fn to_the_ends(chain: &Chain, place: &Region, links: &Room, settings: &FillSettings) -> Vec<DVec2> {
    let mut line: Vec<DVec2> = chain.nodes.iter().map(|n| n.position).collect();
    for end in [1, 0] {
        let (tip, direction) = outward(chain, end, 0.25 * settings.width);
        let longest = match chain.ends[end] {
            End::Dead => ray(place, tip, direction).unwrap_or(0.0),
            End::Junction | End::Narrow | End::Wide => 0.0,
        };
        let longest = longest.min(settings.stepover);
        // the last point on the first turn, the first one on the second
        line.reverse();
        let shares = [1.0, 0.75, 0.5, 0.25];
        let further = shares.map(|share| tip + direction * (share * longest));
        if let Some(&p) = further.iter().find(|&&p| p != tip && links.contains(p)) {
            line.insert(0, p);
        }
    }
    line
}

/// Puts `line` at an open end of a bead that a link reaches; gives it back where there is none.
fn prolong(
    line: Vec<DVec2>,
    beads: &mut [Bead],
    links: &Room,
    settings: &FillSettings,
) -> Option<Vec<DVec2>> {
    let (Some(&a), Some(&b)) = (line.first(), line.last()) else {
        return None;
    };
    if length(&line) <= SHORTEST_TAIL * settings.width {
        return Some(line);
    }
    let mut best: Option<(f64, usize, bool, bool)> = None;
    for (i, bead) in beads.iter().enumerate() {
        let (Some(&first), Some(&last)) = (bead.points.first(), bead.points.last()) else {
            continue;
        };
        if first == last {
            continue;
        }
        for (at_end, open) in [(true, last), (false, first)] {
            for (turned, near) in [(false, a), (true, b)] {
                let away = open.distance(near);
                if away <= settings.longest_link.min(1.5 * settings.width)
                    && best.is_none_or(|b| away < b.0)
                    && links.has_way(open, near, 0.2 * settings.width)
                {
                    best = Some((away, i, at_end, turned));
                }
            }
        }
    }
    let Some((_, i, at_end, turned)) = best else {
        return Some(line);
    };
    let mut line = line;
    // the line leads away from the open end
    if turned {
        line.reverse();
    }
    let bead = &mut beads[i];
    bead.tolerance = bead.tolerance.max(settings.facet());
    if at_end {
        bead.points.extend(line);
    } else {
        line.reverse();
        line.append(&mut bead.points);
        bead.points = line;
    }
    None
}

/// Lines as beads of their own, each next to the end of the one before.
fn lay_in_order(mut lines: Vec<Vec<DVec2>>, beads: &mut Vec<Bead>, settings: &FillSettings) {
    while !lines.is_empty() {
        let at = beads.last().and_then(|b| b.points.last().copied());
        let away = |line: &Vec<DVec2>, end: fn(&[DVec2]) -> Option<&DVec2>| match (at, end(line)) {
            (Some(p), Some(q)) => p.distance(*q),
            _ => 0.0,
        };
        let ways = lines.iter().enumerate().flat_map(|(i, line)| {
            [
                (away(line, <[DVec2]>::first), i, false),
                (away(line, <[DVec2]>::last), i, true),
            ]
        });
        let Some((_, i, turned)) = ways.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return;
        };
        let mut points = lines.swap_remove(i);
        if turned {
            points.reverse();
        }
        beads.push(Bead {
            points,
            role: Role::Fill,
            tolerance: settings.facet(),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_toolpath::Role;

    #[test]
    fn a_line_goes_to_a_bead_only_where_a_link_may_run() {
        let along = |from: f64, to: f64| vec![DVec2::new(from, 0.0), DVec2::new(to, 0.0)];
        let settings = FillSettings::new(4.0, 3.0);
        let mut beads = [Bead {
            points: along(0.0, 10.0),
            role: Role::Fill,
            tolerance: 0.0,
        }];
        let line = along(11.0, 20.0);
        let back = prolong(line.clone(), &mut beads, &Room::new(&[]), &settings);
        assert_eq!((back, beads[0].points.len()), (Some(line.clone()), 2));
        let corners = [[-5.0, -5.0], [30.0, -5.0], [30.0, 5.0], [-5.0, 5.0]];
        let links = Region {
            outer: corners.map(DVec2::from_array).to_vec(),
            holes: Vec::new(),
        };
        assert_eq!(
            prolong(line, &mut beads, &Room::new(&[links]), &settings),
            None
        );
        assert_eq!(
            beads[0].points,
            [along(0.0, 10.0), along(11.0, 20.0)].concat()
        );
    }

    #[test]
    fn a_detour_is_no_longer_than_its_gap_has_metal_for() {
        let square = |from: [f64; 2], to: [f64; 2]| Region {
            outer: [from, [to[0], from[1]], to, [from[0], to[1]]]
                .map(DVec2::from_array)
                .to_vec(),
            holes: Vec::new(),
        };
        let settings = FillSettings::new(4.0, 3.0);
        let links = Room::new(&[square([-5.0, -5.0], [30.0, 30.0])]);
        let line = [DVec2::new(10.0, 2.0), DVec2::new(10.0, 6.0)];
        let added = |width: f64| {
            let mut beads = [Bead {
                points: vec![DVec2::ZERO, DVec2::new(20.0, 0.0)],
                role: Role::Fill,
                tolerance: 0.0,
            }];
            let gap = Middle {
                line: line.to_vec(),
                area: 14.0 * width,
            };
            let boxes = Boxes::new(&beads);
            let laid = detour(&gap, &mut beads, &boxes, &links, &settings).is_some();
            (laid, length(&beads[0].points) - 20.0)
        };
        // there and back at 3 mm, 0.7 of which must be missing: 1 mm of line is too short, then half of it, then all
        assert_eq!(added(0.3), (false, 0.0));
        assert_eq!(added(1.5), (true, 8.0));
        assert_eq!(added(2.5), (true, 12.0));
    }
}
