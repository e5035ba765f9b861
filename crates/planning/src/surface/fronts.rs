//! Passes on a mesh: level lines of planes, or fronts at a constant distance, from a base.

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::segments::Segments;
use meltpath_geometry::sheet::{FrontEnd, FrontPoint, Sheet, SheetError, SheetLine, thinned};

use super::base::Base;
use super::error::SurfaceError;
use super::pass::{SurfacePass, SurfacePoint};
use super::{MOST_PASSES, SurfaceSettings, SurfaceStrategy};

/// Passes on a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshPasses {
    /// The passes by number; pieces of one pass follow one another.
    pub passes: Vec<SurfacePass>,
    /// Where fronts end: caps, rims, other fronts. Planes have none.
    pub ends: Vec<FrontEnd>,
    /// Area in front of the base that no pass reaches, as it hangs together with the base nowhere, mm². Planes leave none.
    pub unreached: f64,
}

/// Passes on a mesh with welded vertices, from `base` on. Planes start at the base's origin and follow their own direction.
///
/// # Errors
/// [`SurfaceError`]: settings out of range, what is not a surface, a base that touches nothing, no room for a pass.
pub fn plan_mesh(
    mesh: &Mesh,
    base: &Base,
    settings: &SurfaceSettings,
) -> Result<MeshPasses, SurfaceError> {
    settings.check()?;
    base.check()?;
    let found = match settings.strategy {
        SurfaceStrategy::Parameter => return Err(SurfaceError::NoParameter),
        SurfaceStrategy::Planes { direction } => by_planes(mesh, base, direction, settings)?,
        SurfaceStrategy::Distance => by_fronts(mesh, base, settings)?,
    };
    if found.passes.is_empty() {
        let reach = mesh.vertices.iter().map(|p| base.distance(*p));
        return Err(SurfaceError::TooSmall {
            spacing: settings.spacing,
            reach: reach.fold(0.0, f64::max),
        });
    }
    Ok(found)
}

fn by_fronts(
    mesh: &Mesh,
    base: &Base,
    settings: &SurfaceSettings,
) -> Result<MeshPasses, SurfaceError> {
    let sheet = Sheet::new(mesh, settings.spacing)?;
    let fronts = sheet.fronts(|p| base.distance(p), settings.spacing, settings.chord_error)?;
    let point = |p: &FrontPoint| {
        let way = p.position - p.from;
        SurfacePoint {
            position: p.position,
            normal: p.normal,
            growth: way
                .reject_from(p.normal)
                .normalize_or(way.normalize_or_zero()),
            from: Some(p.from),
        }
    };
    let lines = (1..).zip(&fronts.fronts);
    let passes = lines.flat_map(|(number, front)| {
        front.lines.iter().map(move |line| SurfacePass {
            number,
            points: line.points.iter().map(point).collect(),
        })
    });
    Ok(MeshPasses {
        passes: passes.collect(),
        ends: fronts.ends,
        unreached: fronts.unreached,
    })
}

fn by_planes(
    mesh: &Mesh,
    base: &Base,
    direction: DVec3,
    settings: &SurfaceSettings,
) -> Result<MeshPasses, SurfaceError> {
    let direction = direction.normalize();
    let origin = base.origin();
    let sheet = Sheet::new(mesh, settings.spacing)?;
    let height = |p: DVec3| (p - origin).dot(direction);
    let heights = mesh.triangles.iter().flatten();
    let heights = heights.map(|&v| (height(mesh.vertices[v as usize]), v));
    let (mut least, mut top) = ((f64::INFINITY, 0), f64::NEG_INFINITY);
    for place in heights {
        least = if place.0 < least.0 { place } else { least };
        top = top.max(place.0);
    }
    if least.0 > settings.chord_error {
        return Err(SurfaceError::Sheet(SheetError::NoBase {
            gap: least.0,
            at: mesh.vertices[least.1 as usize],
        }));
    }
    if top / settings.spacing > MOST_PASSES as f64 {
        return Err(SurfaceError::TooMany {
            spacing: settings.spacing,
            most: MOST_PASSES,
        });
    }
    let positions = |lines: &[SheetLine]| -> Vec<Vec<DVec3>> {
        let line = |l: &SheetLine| l.points.iter().map(|p| p.0).collect();
        lines.iter().map(line).collect()
    };
    let mut passes: Vec<SurfacePass> = Vec::new();
    // the first pass is laid on the base
    let mut before = positions(&sheet.level_lines(height));
    let mut number = 0_u32;
    loop {
        number += 1;
        let level = f64::from(number) * settings.spacing;
        if level > top {
            break;
        }
        let lines = sheet.level_lines(|p| height(p) - level);
        let near = Segments::new(before.iter().map(Vec::as_slice), settings.spacing);
        let point = |&(position, normal): &(DVec3, DVec3)| SurfacePoint {
            position,
            normal,
            growth: direction.reject_from(normal).normalize_or(direction),
            from: near
                .nearest(position, 10.0 * settings.spacing)
                .map(|n| n.point),
        };
        let all = positions(&lines);
        passes.extend(lines.iter().zip(&all).map(|(line, places)| {
            // a point on each edge of a fine mesh says nothing of the course, and is more than controllers follow
            let stays = thinned(places, 0.5 * settings.chord_error);
            let kept = line.points.iter().zip(stays).filter(|(_, stays)| *stays);
            SurfacePass {
                number,
                points: kept.map(|(p, _)| point(p)).collect(),
            }
        }));
        before = all;
    }
    Ok(MeshPasses {
        passes,
        ends: Vec::new(),
        unreached: 0.0,
    })
}
