//! What is judged of layers on a body: how evenly beads lie on them, and their metal against the part.

use rayon::prelude::*;

use meltpath_base::{Check, Fact, Limit, Measure, Place};
use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Union;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::{Voxels, VoxelsError};

use super::Asked;
use super::pieces::{Piece, Pieces};
use super::plan::SurfacePlan;
use super::pores::Solid;
use crate::waam::deposit::stock::{SurfacePoint, points, reach, stock};
use crate::waam::judge::GrowthError;
use crate::waam::judge::worst::worst;
use crate::waam::settings::Settings;

/// Layers that cannot be unrolled: how far the distances between beads are off.
pub(super) fn stretch(plan: &SurfacePlan, asked: &Asked) -> Check {
    let ends = plan
        .layers
        .iter()
        .flat_map(|l| l.stretch.map(|s| (l.number, s)));
    let off = |s: &(u32, (f64, DVec3))| (s.1.0 - 1.0).abs();
    let worst = ends.max_by(|a, b| off(a).total_cmp(&off(b)));
    let check = Check::judge(
        "spacing",
        "distance between beads on layers that cannot be unrolled: largest deviation, share of it",
        Measure::exact(100.0 * worst.as_ref().map_or(0.0, off), "%"),
        Limit::AtMost(100.0 * asked.spacing_limit),
    );
    let check = match worst {
        Some((number, (_, at))) => check.at(Place {
            layer: Some(number),
            ..Place::at(at.to_array())
        }),
        None => check,
    };
    check.remedy("divide the part into smaller pieces; or a larger checks.spacing, where beads may lie unevenly")
}

/// Area of the layers that no bead covers.
pub(super) fn coverage(plan: &SurfacePlan) -> Option<Fact> {
    let all = || plan.layers.iter().flat_map(|l| &l.coverage);
    let area: f64 = all().map(|c| c.area).sum();
    let lack: f64 = all().map(|c| c.lack_area).sum();
    (area > 0.0).then(|| {
        let share = Measure::exact(100.0 * lack / area, "%");
        let words = "of the layers' area; the metal that flows there is in the lack";
        Fact::new("coverage", "area that no bead covers", share, words)
    })
}

/// The metal against the parts, in voxels: what they lack, and the least stock over them.
///
/// # Errors
/// [`VoxelsError`] where there is no room for a part.
pub(super) fn part_checks(
    built: &Voxels,
    pieces: &Pieces,
    growth: &GrowthError,
    settings: &Settings,
) -> Result<Vec<Check>, VoxelsError> {
    let solid = Solid::new(built);
    let mut volumes = [0.0; 3];
    let limit = Limit::AtLeast(settings.limits.stock_min);
    let asked = StockAsked {
        least: 0.5 * settings.surface.as_ref().map_or(0.0, |asked| asked.spacing),
        reach: reach(settings.allowance),
        edge: settings.edge_error(),
        limit,
    };
    let mut least = Vec::new();
    for (number, piece) in pieces.pieces.iter().enumerate() {
        let wanted = Wanted::new((pieces, number), piece, built)?;
        let off = |height: f64| growth.at(piece.below + height);
        let own = wanted.lacking(&solid, off);
        volumes = [0, 1, 2].map(|n| volumes[n] + own[n]);
        least.extend(wanted.thinnest(&solid, &piece.part.mesh, off, &asked));
    }
    let [added, lack, low] = volumes;
    let share = |volume: f64| 100.0 * volume / added.max(f64::MIN_POSITIVE);
    let lack = Check::judge(
        "lack",
        "lack of metal, share of the volume to be added",
        Measure::new(share(lack), share(low - lack), "%"),
        Limit::AtMost(100.0 * settings.limits.lack),
    );
    let stock = worst(least.into_iter(), limit).map(|(at, stock)| {
        let title = "machining stock over the finished part";
        Check::judge("stock", title, stock, limit).at(Place::at(at.to_array()))
    });
    Ok(std::iter::once(lack).chain(stock).collect())
}

/// What stock is looked for by.
struct StockAsked {
    /// Where the part is less out of what it grows out of nothing is laid, mm.
    least: f64,
    /// How far metal is looked for, mm.
    reach: f64,
    /// Standard uncertainty of where metal ends beside the outermost bead, mm.
    edge: f64,
    limit: Limit,
}

/// Standard uncertainty of stock, mm: of how high the layers are, `high`, as far as the face looks along their growth; of where metal ends
/// beside them, `edge`, as far as it looks across; and of where in a voxel of side `cell` it ends.
fn stock_error((high, edge, cell): (f64, f64, f64), normal: DVec3, growing: DVec3) -> f64 {
    let along = normal.dot(growing).clamp(-1.0, 1.0);
    let across = (1.0 - along * along).sqrt();
    (high * along)
        .hypot(edge * across)
        .hypot(cell / 12.0_f64.sqrt())
}

/// What mends a check of the metal, where heights are what beads grow to already or are not.
pub(super) fn remedy(id: &str, asked: Option<&Asked>) -> &'static str {
    let grows = asked.is_some_and(|asked| asked.grows);
    match id {
        "height" if grows => {
            "layers.height of what such layers were measured to grow, or the height corrected at the machine every few layers"
        }
        "height" => {
            "layers.height = \"auto\", or the height corrected at the machine every few layers"
        }
        "flatness" | "accumulation" => {
            "another fill.strategy, a smaller fill.stepover, or more machine.smoothing where the torch waits at corners"
        }
        "loose" => "target.allowance, so that beads at the rim lie on metal; or a narrower bead",
        "lack" | "stock" => {
            "raise target.allowance, target.allowance_top over faces that show away from the body, or take a narrower bead"
        }
        _ if grows => {
            "a machine.ctwd farther from the limit, or the height corrected at the machine every few layers"
        }
        _ => "layers.height = \"auto\", or a machine.ctwd farther from the limit",
    }
}

/// What is to be there, in voxels.
struct Wanted {
    part: Voxels,
    body: Voxels,
    near: Union,
}

impl Wanted {
    /// A piece, with its number from 0, and what stands there before it, in voxels as those that were built.
    fn new(
        (pieces, number): (&Pieces, usize),
        piece: &Piece,
        built: &Voxels,
    ) -> Result<Self, VoxelsError> {
        let empty = || {
            let (low, high) = built.bounds();
            Voxels::new(low, high, built.cell())
        };
        let (mut part, mut body) = (empty()?, empty()?);
        part.fill_mesh(&piece.part.mesh)?;
        for (_, mesh) in pieces.before(number) {
            body.fill_mesh(mesh)?;
        }
        Ok(Wanted {
            part,
            body,
            near: Union::new(pieces.under(piece)),
        })
    }

    /// The stock most likely below its limit where the part is out of what it grows out of, and its place; `off` is how uncertain a height
    /// over that is.
    fn thinnest(
        &self,
        solid: &Solid<'_>,
        part: &Mesh,
        off: impl Fn(f64) -> f64 + Sync,
        asked: &StockAsked,
    ) -> Option<(DVec3, Measure)> {
        let cell = solid.metal.cell();
        let of = |p: SurfacePoint| {
            let foot = self.near.foot(p.position);
            let (height, growing) = foot.map_or((0.0, DVec3::ZERO), |f| (f.distance, f.outward));
            if height <= asked.least {
                return None;
            }
            let closed = |at: DVec3| solid.closed(at, growing);
            let thick = stock(&p, closed, 0.25 * cell, asked.reach);
            let sigma = stock_error((off(height), asked.edge, cell), p.normal, growing);
            Some((p.position, Measure::new(thick, sigma, "mm")))
        };
        let points = points(part, cell).into_par_iter();
        let found: Vec<(DVec3, Measure)> = points.filter_map(of).collect();
        worst(found.into_iter(), asked.limit)
    }

    /// Volumes, mm³: what the part adds to the body, what of it lacks, and what would lack if the metal at each height over the body were
    /// lower by what `off` tells of the height.
    fn lacking(&self, solid: &Solid<'_>, off: impl Fn(f64) -> f64 + Sync) -> [f64; 3] {
        let built = solid.metal;
        let (low, high) = built.bounds();
        let cell = built.cell();
        let count = ((high - low) / cell).round().to_array().map(|n| n as u64);
        let slab = |k: u64| -> [f64; 3] {
            let mut sums = [0.0; 3];
            for (i, j) in (0..count[1]).flat_map(|j| (0..count[0]).map(move |i| (i, j))) {
                let p = low + cell * (DVec3::new(i as f64, j as f64, k as f64) + 0.5);
                let (part, body) = (self.part.sample(p), self.body.sample(p));
                if part <= body {
                    continue;
                }
                let Some(foot) = self.near.foot(p) else {
                    continue;
                };
                let growing = foot.outward;
                let bare = |at: DVec3| {
                    let there = built.sample(at).max(body);
                    if solid.closed(at, growing) {
                        0.0
                    } else {
                        (part - there).max(0.0)
                    }
                };
                let higher = p + off(foot.distance.max(0.0)) * growing;
                let own = [part - body, bare(p), bare(higher)];
                sums = [0, 1, 2].map(|n| sums[n] + own[n]);
            }
            sums
        };
        // summed in one order on any number of threads
        let slabs: Vec<[f64; 3]> = (0..count[2]).into_par_iter().map(slab).collect();
        [0, 1, 2].map(|n| slabs.iter().map(|s| s[n]).sum::<f64>() * cell.powi(3))
    }
}

#[cfg(test)]
mod tests {
    use meltpath_geometry::shapes::cuboid;

    use super::*;

    /// A part on a body with 2 mm of metal over its sides and 2.4 mm over its top, and an uncertain width of the bead: the side is the place
    /// that counts, by what is known of it. Where the height is known worse it is the top.
    #[test]
    fn stock_of_flanks_carries_how_wide_the_bead_is() {
        let of =
            |low: [f64; 3], high: [f64; 3]| cuboid(DVec3::from_array(low), DVec3::from_array(high));
        let body = of([-20.0, -20.0, -5.0], [20.0, 20.0, 0.0]);
        let part = of([-8.0, -8.0, 0.0], [8.0, 8.0, 8.0]);
        let cell = 0.5;
        let (low, high) = (DVec3::new(-20.0, -20.0, -5.0), DVec3::new(20.0, 20.0, 15.0));
        let mut metal = Voxels::new(low, high, cell).unwrap();
        metal.fill_mesh(&body).unwrap();
        metal
            .fill_mesh(&of([-10.0, -10.0, 0.0], [10.0, 10.0, 10.5]))
            .unwrap();
        let empty = || Voxels::new(low, high, cell).unwrap();
        let wanted = Wanted {
            part: empty(),
            body: empty(),
            near: Union::new(vec![&body]),
        };
        let found = |edge: f64, high: f64| {
            let asked = StockAsked {
                least: 1.0,
                reach: 10.0,
                edge,
                limit: Limit::AtLeast(1.9),
            };
            wanted
                .thinnest(&Solid::new(&metal), &part, |_| high, &asked)
                .unwrap()
        };
        let voxel = cell / 12.0_f64.sqrt();
        let (at, side) = found(0.3, 0.1);
        assert!(at.x.abs().max(at.y.abs()) > 7.9, "{at}");
        assert!((side.value - 2.0).abs() < 0.3, "{side:?}");
        assert!((side.sigma.unwrap() - voxel.hypot(0.3)).abs() < 1e-9);
        let (at, top) = found(0.1, 1.5);
        assert!(at.z > 7.9, "{at}");
        assert!((top.sigma.unwrap() - voxel.hypot(1.5)).abs() < 1e-9);
    }
}
