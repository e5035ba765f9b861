//! The surfaces through the middles of layers at one distance from a body, as far as the part reaches.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::level::{Sampled, piece};
use meltpath_geometry::math::DVec3;

use super::{OntoError, OntoSettings, Shape};

/// Cells of the grid on which layers are found, along a stepover.
const CELLS: f64 = 3.0;

/// One surface for each layer, from the body on, showing away from it.
pub(super) fn sheets(
    part: &Shape,
    body: &Shape,
    settings: &OntoSettings<'_>,
) -> Result<Vec<Mesh>, OntoError> {
    let OntoSettings {
        height, allowance, ..
    } = *settings;
    touching(part, body, height)?;
    let (low, high) = part.mesh.bounds().unwrap_or_default();
    let cell = (settings.fill.stepover / CELLS).min(height);
    let room = DVec3::splat(allowance.max(0.0) + 2.0 * cell);
    let from_body = |p: DVec3| body.distance(p);
    let sampled = Sampled::new((low - room, high + room), cell, from_body)?;
    let middle = |k: u32| (f64::from(k) - 0.5) * height;
    let layer = |k: u32| sampled.surface(middle(k), from_body);
    let first = piece(&layer(1), |p| part.distance(p));
    if first.triangles.is_empty() {
        let vertices = part.mesh.vertices.iter();
        let reach = vertices.map(|p| body.distance(*p)).fold(0.0, f64::max);
        return Err(OntoError::Nothing { reach, height });
    }
    // metal beyond the part is laid around what grows, not all over the body that the part leaves as it is
    let around = Distance::new(&first);
    let beside = |p: DVec3| {
        let foot = body.near.foot(p)?;
        let below = around.foot(foot.point + middle(1) * foot.outward)?;
        Some(below.distance.abs())
    };
    let outside = |p: DVec3| {
        let beyond = part.distance(p) - allowance;
        match allowance > 0.0 {
            true => beyond.max(beside(p).unwrap_or(f64::INFINITY) - allowance),
            false => beyond,
        }
    };
    let mut sheets = Vec::new();
    for k in 1..=settings.count.unwrap_or(u32::MAX) {
        if middle(k) > sampled.range()[1] {
            break;
        }
        let sheet = piece(&layer(k), outside);
        if sheet.triangles.is_empty() {
            break;
        }
        sheets.push(sheet);
    }
    Ok(sheets)
}

/// Whether the part begins on the body, to within half a layer.
fn touching(part: &Shape, body: &Shape, height: f64) -> Result<(), OntoError> {
    let vertices = part.mesh.vertices.iter().map(|&p| (body.distance(p), p));
    let nearest = vertices.min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((gap, at)) if gap > 0.5 * height => Err(OntoError::Apart { gap, at }),
        _ => Ok(()),
    }
}
