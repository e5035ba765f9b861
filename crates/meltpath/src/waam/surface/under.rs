//! What a wall stands on, held against the wall: a plate as wide as its first passes, and a base in which little of the surface lies.

use meltpath_base::{Check, Limit, Measure, Status};
use meltpath_geometry::math::DVec3;
use meltpath_planning::surface::{Base, SurfacePass};

use super::ground::{Spread, spread};
use super::plan::{Ground, SurfacePlan};
use crate::waam::settings::Settings;

/// Share of a surface that may lie in its base unasked, as the root of a blade in its hub does.
const ROOT: f64 = 0.05;
/// Share from which on it is told: less is what a mesh of facets leaves in a cylinder.
const FACETS: f64 = 1e-3;
/// Passes nearer than so many layer heights stand on the plate.
const ON_PLATE: f64 = 1.5;

/// What of the surface is not built, for it lies in the base; `None` where nothing does.
pub(super) fn base_check(plan: &SurfacePlan) -> Option<Check> {
    if plan.in_base < FACETS {
        return None;
    }
    let check = Check::judge(
        "in-base",
        "surface that lies in the base and is not built, share of its area",
        Measure::exact(100.0 * plan.in_base, "%"),
        Limit::AtMost(100.0 * ROOT),
    );
    // whether there is metal already, who draws the surface knows
    let status = match check.status {
        Status::Fail => Status::Warn,
        other => other,
    };
    Some(
        Check { status, ..check }.remedy(
            "surface.base where the wall begins, or a surface without what is there already",
        ),
    )
}

/// Whether the passes that stand on the plate fit on it; `None` where the job gives no plate, or the wall begins on something else.
pub(super) fn plate_check(plan: &SurfacePlan, spacing: f64, settings: &Settings) -> Option<Check> {
    let (Ground::Base(base @ Base::Plane { .. }), Some(size)) = (&plan.ground, settings.plate)
    else {
        return None;
    };
    let Spread {
        top, ways, middle, ..
    } = spread(plan, None)?;
    let on_plate = |p: &DVec3| base.distance(*p) <= ON_PLATE * spacing;
    let points = plan.passes.iter().flat_map(|p: &SurfacePass| &p.points);
    let beyond = points.map(|p| p.position).filter(on_plate).flat_map(|p| {
        [0, 1].map(|i| {
            let aside = ((p - top).dot(ways[i]) - middle[i]).abs();
            aside + 0.5 * settings.bead.width.value - 0.5 * size[i]
        })
    });
    let check = Check::judge(
        "plate",
        "beads beyond the edge of the plate",
        Measure::exact(beyond.fold(0.0, f64::max), "mm"),
        Limit::AtMost(0.0),
    );
    Some(check.remedy("a larger substrate.size"))
}
