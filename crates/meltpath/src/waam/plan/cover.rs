//! What layers cover, and the beads that fill it: sections with allowance, corners and holes that beads bear.

use meltpath_base::{Cancelled, Observer, Place, Reporter, Silent};
use meltpath_geometry::boolean::{PlanarError, difference, intersection, union};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::offset::{Join, inset, outset};
use meltpath_geometry::overhang::{OverhangError, distance};
use meltpath_geometry::region::signed_area;
use meltpath_geometry::section::{HeightsError, Slice, SliceError, SlicePlan, slice};
use meltpath_geometry::{Plane, Region};
use meltpath_planning::{LayerPlan, PassIds, PlanError, Spacing, plan_layers};
use meltpath_toolpath::Pass;
use rayon::prelude::*;

use crate::stages::part::Part;
use crate::waam::settings::Settings;
use crate::waam::settings::bead::FREE_EDGE;

/// Holes narrower than this many bead widths, allowance taken off, are closed.
const CLOSED_HOLE: f64 = 2.0;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanStageError {
    /// Cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The part cannot be cut.
    #[error("cannot slice the part: {0}")]
    Slice(#[from] SliceError),
    /// The layer heights make no sense.
    #[error("cannot lay out layers: {0}")]
    Heights(#[from] HeightsError),
    /// A layer cannot be grown or shrunk.
    #[error("cannot offset a layer: {0}")]
    Planar(#[from] PlanarError),
    /// Overhangs cannot be looked for.
    #[error("cannot compare layers: {0}")]
    Overhang(#[from] OverhangError),
    /// A layer cannot be filled.
    #[error("cannot fill a layer: {0}")]
    Fill(#[from] PlanError),
    /// Nothing to build, for the layers have no closed contour.
    #[error(
        "no bead fits into the part: the mesh of {part} is open{}, and its layers there have no contour; close it in CAD and export it as one solid (`meltpath inspect` tells where it is open)", at(*.place)
    )]
    Open {
        /// The part's file.
        part: String,
        /// Where a contour ends, in the build, mm.
        place: Option<[f64; 3]>,
    },
    /// Nothing to build.
    #[error(
        "no bead fits into the part: its walls are thinner than {narrowest:.1} mm everywhere, allowance of {allowance:.1} mm included; choose a narrower bead or a larger allowance{}", small(*.size)
    )]
    NoBead {
        /// Narrowest section that takes a bead, mm.
        narrowest: f64,
        /// Allowance, mm.
        allowance: f64,
        /// Size of the part, mm.
        size: DVec3,
    },
}

/// What a part of this size, mm, may be that is smaller than one bead takes.
fn small(size: DVec3) -> String {
    const SMALL: f64 = 10.0;
    if size.max_element() >= SMALL {
        return String::new();
    }
    let [x, y, z] = size.to_array();
    format!(
        "; the part is {x:.3} x {y:.3} x {z:.3} mm: is it in inches or metres? Then write part_unit"
    )
}

/// A place in words.
fn at(place: Option<[f64; 3]>) -> String {
    let told = |[x, y, z]: [f64; 3]| format!(" at x {x:.1}, y {y:.1}, z {z:.1} mm of the build");
    place.map(told).unwrap_or_default()
}

/// The sections whose union a layer has to cover, so that faces that look up get their allowance too: the part at the layer's
/// mid-height and, at most this many mm apart, down to the allowance of upward faces below it.
const BELOW_STEP: f64 = 1.0;

/// For each height, the sections of the part at that height and down to an allowance below it; none above the part.
pub(in crate::waam) fn cut(
    part: &Part,
    part_top: f64,
    allowance: f64,
    heights: &[f64],
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<Vec<Slice>>, PlanStageError> {
    // the very top and the very bottom belong to the part
    let (lowest, highest) = (1e-4 * part_top, part_top * (1.0 - 1e-4));
    let steps = (allowance / BELOW_STEP).ceil().max(1.0) as u32;
    let wanted = |h: f64| {
        (0..=steps)
            .map(move |i| h - f64::from(i) / f64::from(steps) * allowance)
            .filter(move |z| *z <= part_top)
            .map(move |z| z.clamp(lowest, highest))
    };
    let mut cuts: Vec<f64> = heights.iter().flat_map(|h| wanted(*h)).collect();
    cuts.sort_unstable_by(f64::total_cmp);
    cuts.dedup();
    let slices = slice(
        &part.mesh,
        &SlicePlan::new(Plane::horizontal(0.0), cuts.clone()),
        reporter,
        observer,
    )?;
    let at = |z: f64| slices.get(cuts.partition_point(|c| *c < z)).cloned();
    Ok(heights
        .iter()
        .map(|h| wanted(*h).filter_map(at).collect())
        .collect())
}

fn hole_limit(settings: &Settings) -> f64 {
    let diameter = CLOSED_HOLE * settings.bead.width.value;
    0.25 * std::f64::consts::PI * diameter * diameter
}

/// What layers cover: the union of their sections grown by the allowance, without the holes that are too small to keep, and
/// as much more in corners as a bead needs to reach into them. No corner leans out farther for it than the part does
/// there.
pub(in crate::waam) fn covered(
    sections: &[Vec<Slice>],
    settings: &Settings,
) -> Result<Vec<Vec<Region>>, PlanarError> {
    let alike: Vec<bool> = (0..sections.len())
        .map(|i| i > 0 && are_alike(&sections[i], &sections[i - 1]))
        .collect();
    let wanted: Vec<Option<Wanted>> = sections
        .par_iter()
        .zip(&alike)
        .map(|(slices, alike)| (!alike).then(|| wanted(slices, settings)).transpose())
        .collect::<Result<_, _>>()?;
    let mut layers: Vec<Vec<Region>> = Vec::new();
    let mut before: Option<Wanted> = None;
    for wanted in wanted {
        let Some(wanted) = wanted else {
            // on a layer of the same sections nothing leans out: it gets what that layer got
            layers.extend(layers.last().cloned());
            continue;
        };
        let mut room = wanted.room.clone();
        if let (Some(below), Some(before)) = (layers.last(), &before) {
            let leans = room.iter().map(|piece| {
                let near = outset(
                    std::slice::from_ref(piece),
                    settings.bead.width.value,
                    ROUND,
                )?;
                let carrier = intersection(below, &near)?;
                if carrier.is_empty() {
                    // over no metal, as where a body hangs free over another, no corner reaches out
                    return Ok(Vec::new());
                }
                let own = intersection(&wanted.grown, &near)?;
                let own = farthest_beyond(&own, &before.grown)?;
                let carried = outset(&carrier, own, ROUND)?;
                intersection(std::slice::from_ref(piece), &carried)
            });
            room = leans.collect::<Result<Vec<_>, _>>()?.concat();
        }
        layers.push(if room.is_empty() {
            wanted.grown.clone()
        } else {
            union(&[wanted.grown.as_slice(), &room].concat())?
        });
        before = Some(wanted);
    }
    Ok(layers)
}

/// Whether two layers have the same sections.
fn are_alike(one: &[Slice], other: &[Slice]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.regions == b.regions)
}

/// What one layer is to cover.
struct Wanted {
    /// Its sections with their allowance.
    grown: Vec<Region>,
    /// More of it, where beads would not reach into corners.
    room: Vec<Region>,
}

fn wanted(slices: &[Slice], settings: &Settings) -> Result<Wanted, PlanarError> {
    let limit = hole_limit(settings);
    let all: Vec<Region> = slices
        .iter()
        .flat_map(|s| s.regions.iter().cloned())
        .collect();
    let mut grown = outset(&all, settings.allowance, ROUND)?;
    for region in &mut grown {
        region.holes.retain(|h| signed_area(h).abs() >= limit);
    }
    let mut room = Vec::new();
    if settings.fill.spacing != Spacing::Exact {
        let corners = beyond_reach(&all, &grown, settings)?;
        if !corners.is_empty() {
            room = outset(&corners, REACH * settings.bead.width.value, ROUND)?;
        }
    }
    Ok(Wanted { grown, room })
}

/// How far `regions` reach out over those `below`, mm.
fn farthest_beyond(regions: &[Region], below: &[Region]) -> Result<f64, PlanarError> {
    let beyond = difference(regions, below)?;
    let corners = beyond.iter().flat_map(|piece| &piece.outer);
    Ok(corners.map(|&p| distance(below, p)).fold(0.0, f64::max))
}

/// Corners of sections, with stock between the least and the allowance, that the metal of beads inside `grown` does not reach: at a sharp turn
/// the arm cuts across, and the outside of the bead lacks metal.
fn beyond_reach(
    sections: &[Region],
    grown: &[Region],
    settings: &Settings,
) -> Result<Vec<Region>, PlanarError> {
    let width = settings.bead.width.value;
    let (turn, edge) = (ROUND_TURN * width, FREE_EDGE * width);
    let axes = inset(grown, 0.5 * width, ROUND)?;
    let round = outset(&inset(&axes, turn, ROUND)?, turn, ROUND)?;
    // what is lost by rounding the turns is small; what is large are walls too thin to be rounded
    let mut reached = difference(&axes, &round)?;
    reached.retain(|piece| piece.area() > 4.0 * turn * turn);
    reached.extend(round);
    let least = settings.limits.stock_min.max(0.0);
    let wanted = least + STOCK_SHARE * (settings.allowance - least).max(0.0);
    // never more than flat sides keep: they are as the job wants them
    let flat = settings.allowance - (0.5 * width - edge) - 2.0 * SLIVER;
    let covered = match wanted.min(flat) {
        stock if stock >= 0.0 => outset(sections, stock, ROUND)?,
        stock => inset(sections, -stock, ROUND)?,
    };
    let mut bare = difference(&covered, &outset(&reached, edge, ROUND)?)?;
    // what is wide is a section too thin for a bead: told, not thickened; what is narrow is the offsets' own
    let near = outset(&axes, width, ROUND)?;
    bare = difference(&bare, &difference(&bare, &near)?)?;
    outset(&inset(&bare, SLIVER, ROUND)?, SLIVER, ROUND)
}

/// Radius of the turn that the outside of a bead's metal makes at a right angle of its axis, less that of the metal itself,
/// bead widths: found on the simulated corner of a plate with CNT50, a value of ours.
const ROUND_TURN: f64 = 0.4;
/// Stock that corners keep, share of what the allowance has over the least stock.
const STOCK_SHARE: f64 = 0.5;
/// How far round a corner that is not reached the layer grows, bead widths: the axis then goes beyond its turn.
const REACH: f64 = 0.42;
/// Where beads first lie beyond the metal that stands below them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lean {
    /// Layer, from 1.
    pub layer: u32,
    /// A place there, mm.
    pub place: DVec2,
}

/// The first layer that leans out over all layers below it, by more than a bead's axis may: what a height map cannot hold, for
/// it has metal above a place only where there is metal down to the plate.
pub(in crate::waam) fn lean(
    regions: &[Vec<Region>],
    width: f64,
) -> Result<Option<Lean>, PlanarError> {
    let mut layers = regions.iter().zip(1..);
    let Some((mut foot, _)) = layers.next().map(|(r, n)| (r.clone(), n)) else {
        return Ok(None);
    };
    for (layer, number) in layers {
        // the axes of the outermost beads, less what the melt holds beside its ground
        let axes = inset(layer, (0.5 + HELD) * width, ROUND)?;
        let beyond = difference(&axes, &foot)?;
        if let Some(place) = beyond.first().and_then(|r| r.outer.first()) {
            return Ok(Some(Lean {
                layer: number,
                place: *place,
            }));
        }
        foot = intersection(&foot, layer)?;
    }
    Ok(None)
}

/// How far the axis of a bead may lie beyond the metal below, bead widths: less than the cells of a height map tell.
const HELD: f64 = 0.05;

/// Corners of outlines, mm from the exact curve.
const ROUND: Join = Join::Round {
    arc_tolerance: 0.02,
};
/// Differences of outlines below this are the offsets' own, mm.
const SLIVER: f64 = 0.05;

pub(in crate::waam) fn tell_closed_holes(
    sections: &[Vec<Slice>],
    settings: &Settings,
    reporter: &Reporter,
) {
    let limit = hole_limit(settings);
    let shrunk = |hole: &[DVec2]| {
        // a hole of area a shrunk by the allowance, as if it were round
        let radius = (signed_area(hole).abs() / std::f64::consts::PI).sqrt() - settings.allowance;
        std::f64::consts::PI * radius.max(0.0).powi(2)
    };
    let small = |slice: &Slice| {
        slice
            .regions
            .iter()
            .flat_map(|r| &r.holes)
            .filter(|h| shrunk(h) < limit)
            .count()
    };
    let count = sections
        .iter()
        .filter_map(|s| s.first().map(small))
        .max()
        .unwrap_or(0);
    if count > 0 {
        let narrow = CLOSED_HOLE * settings.bead.width.value;
        reporter.warn(
            "holes-closed",
            format!("{count} holes narrower than {narrow:.0} mm (allowance taken off) are filled, to be drilled: beads round them would start and stop for nothing"),
            "",
        );
    }
}

/// Tells where pieces of the part that stand apart are built as one: metal planned round them fills the gap between.
pub(in crate::waam) fn tell_grown_together(
    sections: &[Vec<Slice>],
    regions: &[Vec<Region>],
    reporter: &Reporter,
) {
    let joined = |slices: &[Slice], regions: &[Region]| {
        let apart = &slices.first()?.regions;
        if regions.len() >= apart.len() {
            return None;
        }
        let one = |region: &Region, a: DVec2, b: DVec2| region.contains(a) && region.contains(b);
        let begins = apart.iter().filter_map(|piece| piece.outer.first());
        let begins: Vec<DVec2> = begins.copied().collect();
        begins.windows(2).find_map(|pair| {
            let [a, b] = [pair[0], pair[1]];
            let in_part = slices.iter().flat_map(|slice| &slice.regions);
            let are_one = in_part.clone().any(|region| one(region, a, b));
            let grown = regions.iter().any(|region| one(region, a, b));
            (grown && !are_one).then_some(a)
        })
    };
    let layers = sections.iter().zip(regions);
    let mut found = (1_u32..)
        .zip(layers)
        .filter_map(|(layer, (slices, regions))| {
            let at = joined(slices, regions)?;
            let height = slices.first()?.height;
            let place = Place::at(at.extend(height).to_array());
            Some(Place {
                layer: Some(layer),
                ..place
            })
        });
    if let Some(first) = found.next() {
        let more = found.count();
        reporter.warn_at(
            "grown-together",
            format!("in {} layers pieces of the part that stand apart are built as one: the metal planned round them fills the gap", 1 + more),
            first,
            "part them farther, plan less round them (target.allowance), or cut them apart afterwards",
        );
    }
}

/// Fills `regions`, a layer each, the wire's tip at the heights `torch`, mm.
pub(in crate::waam) fn fill(
    torch: &[f64],
    regions: &[Vec<Region>],
    settings: &Settings,
    reporter: &Reporter,
    observer: &dyn Observer,
) -> Result<Vec<LayerPlan>, PlanError> {
    let planes: Vec<Plane> = torch.iter().map(|z| Plane::horizontal(*z)).collect();
    let wanted: Vec<meltpath_planning::FillLayer<'_>> = planes
        .iter()
        .zip(regions)
        .enumerate()
        .map(|(i, (plane, regions))| meltpath_planning::FillLayer {
            number: i as u32 + 1,
            plane,
            regions,
        })
        .collect();
    plan_layers(
        &wanted,
        &settings.fill,
        PassIds { part: 0 },
        reporter,
        observer,
    )
}

/// Sections at which a part without a bead is looked at for open contours.
const LOOKS: u32 = 8;

/// Why there is no bead in a part.
pub(in crate::waam) fn no_bead(part: &Part, settings: &Settings) -> PlanStageError {
    open(part).unwrap_or(PlanStageError::NoBead {
        narrowest: settings.fill.narrowest * settings.bead.width.value,
        allowance: settings.allowance,
        size: part
            .mesh
            .bounds()
            .map_or(DVec3::ZERO, |(low, high)| high - low),
    })
}

/// Contours that are open, where no section of the part has another.
fn open(part: &Part) -> Option<PlanStageError> {
    let told = Reporter::new();
    let top = part.mesh.bounds().map_or(0.0, |(_, hi)| hi.z);
    let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(LOOKS) * top;
    let plan = SlicePlan::new(Plane::horizontal(0.0), (0..LOOKS).map(middle).collect());
    let cut = slice(&part.mesh, &plan, &told, &Silent);
    let is_empty = cut.is_ok_and(|s| s.iter().all(|s| s.regions.is_empty()));
    let mut told = told.warnings().into_iter();
    let open = told.find(|w| is_empty && w.code == "slice-contour-open")?;
    Some(PlanStageError::Open {
        part: part.name.clone(),
        place: open.place.and_then(|p| p.position),
    })
}

/// Share of the bead length without a neighbour in its own layer.
pub(in crate::waam) fn single_share<'a>(passes: impl Iterator<Item = Pass<'a>>) -> f64 {
    let (total, beside) = passes.fold((0.0, 0.0), |(total, beside), pass| {
        let mut spans: Vec<(f64, f64)> = pass
            .neighbours()
            .filter(|n| n.layer == pass.layer)
            .map(|n| (n.from, n.to))
            .collect();
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut reached = 0.0_f64;
        let along = spans.iter().fold(0.0, |sum, &(from, to)| {
            let new = (to - from.max(reached)).max(0.0);
            reached = reached.max(to);
            sum + new
        });
        (total + pass.length(), beside + along)
    });
    if total > 0.0 {
        (1.0_f64 - beside / total).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::Mesh;
    use meltpath_geometry::shapes::thin_wall;

    use super::*;

    /// A wall without one of its ends has no closed contour; a whole one that is too thin for any bead has.
    #[test]
    fn a_part_whose_contours_are_open_is_told_as_open() {
        let part = |mesh: Mesh| Part {
            name: "wall.stl".to_owned(),
            volume: mesh.volume(),
            mesh,
            loose_edges: 0,
            findings: Vec::new(),
        };
        let whole = thin_wall(60.0, 10.0, 20.0);
        let mut without = whole.clone();
        let least = whole.bounds().map_or(0.0, |(lo, _)| lo.x);
        without.triangles.retain(|t| {
            t.iter()
                .any(|v| whole.vertices[*v as usize].x > least + 1.0)
        });
        let told = open(&part(without)).unwrap().to_string();
        assert!(told.contains("the mesh of wall.stl is open at x"), "{told}");
        assert!(open(&part(whole)).is_none());
        assert!(open(&part(thin_wall(60.0, 0.5, 20.0))).is_none());
    }
}
