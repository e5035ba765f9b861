//! What is judged of layers on a body: how evenly beads lie on them, and their metal against the part.

use rayon::prelude::*;

use meltpath_base::{Check, Fact, Limit, Measure, Place};
use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::{Voxels, VoxelsError};

use super::Asked;
use super::plan::{OntoMeshes, SurfacePlan};
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

/// The metal against the part, in voxels: what it lacks, and the least stock over it.
///
/// # Errors
/// [`VoxelsError`] where there is no room for the part.
pub(super) fn part_checks(
    built: &Voxels,
    meshes: &OntoMeshes,
    growth: &GrowthError,
    settings: &Settings,
) -> Result<Vec<Check>, VoxelsError> {
    let filled = |mesh: &Mesh| {
        let (low, high) = built.bounds();
        let mut voxels = Voxels::new(low, high, built.cell())?;
        voxels.fill_mesh(mesh)?;
        Ok::<Voxels, VoxelsError>(voxels)
    };
    let wanted = Wanted {
        part: filled(&meshes.part)?,
        body: filled(&meshes.body)?,
        near: Distance::new(&meshes.body),
    };
    let solid = Solid::new(built);
    let far = |p: DVec3| {
        wanted
            .near
            .foot(p)
            .map_or((0.0, DVec3::ZERO), |f| (f.distance, f.outward))
    };
    let [added, lack, low] = wanted.lacking(&solid, |height| growth.at(height));
    let share = |volume: f64| 100.0 * volume / added.max(f64::MIN_POSITIVE);
    let lack = Check::judge(
        "lack",
        "lack of metal, share of the volume to be added",
        Measure::new(share(lack), share(low - lack), "%"),
        Limit::AtMost(100.0 * settings.limits.lack),
    );
    let points = points(&meshes.part, built.cell());
    // where the part is less than half a layer out of the body nothing is laid
    let least = 0.5 * settings.surface.as_ref().map_or(0.0, |asked| asked.spacing);
    let free = points.into_par_iter().filter(|p| far(p.position).0 > least);
    let reach = reach(settings.allowance);
    let step = 0.25 * built.cell();
    let found: Vec<(f64, SurfacePoint)> = free
        .map(|p| {
            let growing = far(p.position).1;
            (stock(&p, |at| solid.closed(at, growing), step, reach), p)
        })
        .collect();
    let thinnest = found.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let mut checks = vec![lack];
    checks.extend(thinnest.map(|(stock, p)| {
        let (height, growing) = far(p.position);
        // a side stays where it is, however the layers grow
        let sigma = growth.at(height) * p.normal.dot(growing).abs();
        let check = Check::judge(
            "stock",
            "machining stock over the finished part",
            Measure::new(*stock, sigma, "mm"),
            Limit::AtLeast(settings.limits.stock_min),
        );
        check.at(Place::at(p.position.to_array()))
    }));
    Ok(checks)
}

/// What mends a check of the metal.
pub(super) fn remedy(id: &str) -> &'static str {
    match id {
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
        _ => "layers.height = \"auto\", or a machine.ctwd farther from the limit",
    }
}

/// What is to be there, in voxels.
struct Wanted {
    part: Voxels,
    body: Voxels,
    near: Distance,
}

impl Wanted {
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
