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
    let mut thinnest: Option<Stock> = None;
    for (number, piece) in pieces.pieces.iter().enumerate() {
        let wanted = Wanted::new((pieces, number), piece, built)?;
        let off = |height: f64| growth.at(piece.below + height);
        let own = wanted.lacking(&solid, off);
        volumes = [0, 1, 2].map(|n| volumes[n] + own[n]);
        let stock = wanted.thinnest(&solid, &piece.part.mesh, off, settings);
        thinnest = thinnest
            .into_iter()
            .chain(stock)
            .min_by(|a, b| a.thick.total_cmp(&b.thick));
    }
    let [added, lack, low] = volumes;
    let share = |volume: f64| 100.0 * volume / added.max(f64::MIN_POSITIVE);
    let lack = Check::judge(
        "lack",
        "lack of metal, share of the volume to be added",
        Measure::new(share(lack), share(low - lack), "%"),
        Limit::AtMost(100.0 * settings.limits.lack),
    );
    let stock = thinnest.map(|found| {
        let check = Check::judge(
            "stock",
            "machining stock over the finished part",
            Measure::new(found.thick, found.sigma, "mm"),
            Limit::AtLeast(settings.limits.stock_min),
        );
        check.at(Place::at(found.at.to_array()))
    });
    Ok(std::iter::once(lack).chain(stock).collect())
}

/// The least stock over a part.
struct Stock {
    thick: f64,
    sigma: f64,
    at: DVec3,
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

    /// The least stock where the part is out of what it grows out of; `off` is how uncertain a height over that is.
    fn thinnest(
        &self,
        solid: &Solid<'_>,
        part: &Mesh,
        off: impl Fn(f64) -> f64,
        settings: &Settings,
    ) -> Option<Stock> {
        let far = |p: DVec3| {
            let foot = self.near.foot(p);
            foot.map_or((0.0, DVec3::ZERO), |f| (f.distance, f.outward))
        };
        let cell = solid.metal.cell();
        let points = points(part, cell);
        // where the part is less than half a layer out of the body nothing is laid
        let least = 0.5 * settings.surface.as_ref().map_or(0.0, |asked| asked.spacing);
        let free = points.into_par_iter().filter(|p| far(p.position).0 > least);
        let reach = reach(settings.allowance);
        let found: Vec<(f64, SurfacePoint)> = free
            .map(|p| {
                let growing = far(p.position).1;
                let closed = |at: DVec3| solid.closed(at, growing);
                (stock(&p, closed, 0.25 * cell, reach), p)
            })
            .collect();
        let (thick, p) = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (height, growing) = far(p.position);
        Some(Stock {
            thick,
            // a side stays where it is, however the layers grow
            sigma: off(height) * p.normal.dot(growing).abs(),
            at: p.position,
        })
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
