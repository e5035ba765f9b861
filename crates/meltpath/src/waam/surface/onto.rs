//! What is judged of layers on a body: how evenly beads lie on them, and their metal against the part.

use rayon::prelude::*;

use meltpath_base::{Check, Fact, Limit, Measure, Place};
use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::{Voxels, VoxelsError};

use super::Asked;
use super::plan::SurfacePlan;
use crate::waam::deposit::target::{SurfacePoint, lattice};
use crate::waam::judge::GrowthError;
use crate::waam::settings::Settings;

/// The part and the body that it grows out of, in the build.
#[derive(Debug, Clone)]
pub struct OntoMeshes {
    /// As it is to be, or what is to be added alone.
    pub part: Mesh,
    /// As it is now.
    pub body: Mesh,
}

impl OntoMeshes {
    /// How far the part reaches out of the body, mm.
    pub(super) fn reach(&self) -> f64 {
        let body = Distance::new(&self.body);
        let far = |p: &DVec3| body.foot(*p).map_or(0.0, |f| f.distance);
        self.part.vertices.iter().map(far).fold(0.0, f64::max)
    }
}

/// Distance between the points at which stock is measured, mm.
const SPACING: f64 = 2.0;
/// Stock is looked for as far as so many allowances, and so far at least, mm.
const REACH: (f64, f64) = (3.0, 10.0);

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
    let (part, body) = (filled(&meshes.part)?, filled(&meshes.body)?);
    let (added, lack) = (beyond(&part, &body), beyond(&part, built));
    let share = 100.0 * lack / added.max(f64::MIN_POSITIVE);
    let lack = Check::judge(
        "lack",
        "lack of metal, share of the volume to be added",
        // a share of growth too little is that share of the top layer alone where there is stock: all of it is the safe side
        Measure::new(share, 100.0 * growth.share * share.min(100.0), "%"),
        Limit::AtMost(100.0 * settings.limits.lack),
    );
    let advice = "raise target.allowance, or take a narrower bead";
    let body = Distance::new(&meshes.body);
    let far = |p: DVec3| body.foot(p).map_or(0.0, |f| f.distance);
    let points = lattice(&meshes.part, SPACING);
    // where the part is less than half a layer out of the body nothing is laid
    let least = 0.5 * settings.surface.as_ref().map_or(0.0, |asked| asked.spacing);
    let free = points.into_par_iter().filter(|p| far(p.position) > least);
    let reach = (REACH.0 * settings.allowance).max(REACH.1);
    let found: Vec<(f64, SurfacePoint)> = free.map(|p| (stock(built, &p, reach), p)).collect();
    let thinnest = found.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let mut checks = vec![lack.remedy(advice)];
    checks.extend(thinnest.map(|(stock, p)| {
        let sigma = growth.share * far(p.position);
        let check = Check::judge(
            "stock",
            "machining stock over the finished part",
            Measure::new(*stock, sigma, "mm"),
            Limit::AtLeast(settings.limits.stock_min),
        );
        check.at(Place::at(p.position.to_array())).remedy(advice)
    }));
    Ok(checks)
}

/// Metal over a point of the part's surface along its normal, mm; below zero where it is missing.
fn stock(built: &Voxels, point: &SurfacePoint, reach: f64) -> f64 {
    let step = 0.25 * built.cell();
    let solid = |p: DVec3| built.sample(p) >= 0.5;
    let bare = !solid(point.position);
    let direction = if bare { -point.normal } else { point.normal };
    let mut far = 0.0;
    while far < reach && solid(point.position + far * direction) != bare {
        far += step;
    }
    if bare { -far } else { far }
}

/// Volume that `of` holds and `other` does not, voxel by voxel, mm³.
fn beyond(of: &Voxels, other: &Voxels) -> f64 {
    let (low, high) = of.bounds();
    let cell = of.cell();
    let count = ((high - low) / cell).round().to_array().map(|n| n as u64);
    let slab = |k: u64| -> f64 {
        let mut sum = 0.0;
        for j in 0..count[1] {
            for i in 0..count[0] {
                let p = low + cell * (DVec3::new(i as f64, j as f64, k as f64) + 0.5);
                let own = of.sample(p);
                if own > 0.0 {
                    sum += (own - other.sample(p)).max(0.0);
                }
            }
        }
        sum
    };
    // summed in one order on any number of threads
    let slabs: Vec<f64> = (0..count[2]).into_par_iter().map(slab).collect();
    slabs.iter().sum::<f64>() * cell.powi(3)
}
