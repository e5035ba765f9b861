//! The top of a part that grows out of a body: found or named, and whether all of the part lies under it.

use meltpath_geometry::Mesh;
use meltpath_geometry::level::LevelError;
use meltpath_geometry::math::DVec3;
use meltpath_geometry::sheet::subdivide;

use super::error::OntoError;
use super::field::Top;
use super::shape::Shape;

/// What faces away from the body by no more than 45° is top, its cosine.
const FACING: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// What looks away from the body by more than 75° in the mean is named as the top by mistake, its cosine.
const ASIDE: f64 = 0.258_819_045_102_520_8;
/// Most triangles of a part or a top.
const MOST: usize = 4_000_000;

/// A top with what it is to be known for.
pub(super) struct Known {
    pub(super) top: Top,
    /// How far it is from the body, raised: least and greatest, mm.
    pub(super) apart: [f64; 2],
}

/// The top of a part: `sheet`, or what faces away from the body. It is looked at in pieces `cell` mm long; what is no more than `least` mm out
/// of the body is not built. The top is raised by `over` mm.
pub(super) fn known(
    part: &Mesh,
    body: &Shape,
    sheet: Option<&Mesh>,
    (cell, least, over): (f64, f64, f64),
) -> Result<Known, OntoError> {
    let fine = |mesh: &Mesh| {
        let mut fine = mesh.clone();
        subdivide(&mut fine, cell, MOST)
            .ok_or_else(|| OntoError::of_grid(LevelError::TooFine { cell }, mesh))?;
        Ok::<Mesh, OntoError>(fine)
    };
    let part = fine(part)?;
    let mut mesh = match sheet {
        Some(sheet) => outwards(fine(sheet)?, body),
        None => part.clone(),
    };
    let normals: Vec<Option<DVec3>> = (0..mesh.triangles.len())
        .map(|t| facing(&mesh, t, body, least))
        .collect();
    if sheet.is_some() {
        looks_away(&mesh, &normals)?;
    }
    let wanted = |t: usize| match (normals[t], sheet) {
        (Some(_), Some(_)) => true,
        (Some(away), None) => normal(&mesh, t).dot(away) >= FACING,
        (None, _) => false,
    };
    let kept: Vec<[u32; 3]> = (0..mesh.triangles.len())
        .filter(|t| wanted(*t))
        .map(|t| mesh.triangles[t])
        .collect();
    mesh.triangles = kept;
    if mesh.triangles.is_empty() {
        return Err(OntoError::NoTop { least });
    }
    let top = Top::new(&mesh, over);
    covers(&top, &part, body, least)?;
    let middles = (0..mesh.triangles.len()).map(|t| body.distance(middle(&mesh, t)) + over);
    let apart = middles.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], d| {
        [low.min(d), high.max(d)]
    });
    Ok(Known { top, apart })
}

/// A sheet turned round where most of it shows towards the body.
fn outwards(mut sheet: Mesh, body: &Shape) -> Mesh {
    let away = |t: usize| {
        let [a, b, c] = sheet.corners(t);
        let foot = body.near.foot(middle(&sheet, t));
        foot.map_or(0.0, |f| (b - a).cross(c - a).dot(f.outward))
    };
    if (0..sheet.triangles.len()).map(away).sum::<f64>() < 0.0 {
        sheet.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    sheet
}

fn middle(mesh: &Mesh, t: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(t);
    (a + b + c) / 3.0
}

fn normal(mesh: &Mesh, t: usize) -> DVec3 {
    let [a, b, c] = mesh.corners(t);
    (b - a).cross(c - a).normalize_or_zero()
}

/// The way out of the body at a triangle that is more than `least` mm out of it.
fn facing(mesh: &Mesh, t: usize, body: &Shape, least: f64) -> Option<DVec3> {
    let foot = body.near.foot(middle(mesh, t))?;
    (foot.distance > least).then_some(foot.outward)
}

/// Whether what is named as the top looks away from the body in the mean, by its area; `normals` are the ways out of the body.
fn looks_away(mesh: &Mesh, normals: &[Option<DVec3>]) -> Result<(), OntoError> {
    let of = |(t, away): (usize, &Option<DVec3>)| {
        let [a, b, c] = mesh.corners(t);
        let cross = (b - a).cross(c - a);
        away.map(|away| [cross.dot(away), cross.length()])
    };
    let each = normals.iter().enumerate().filter_map(of);
    let [out, area] = each.fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
    // nothing that is out of the body is told as no top
    let cosine = if area > 0.0 { out / area } else { 1.0 };
    if cosine < ASIDE {
        return Err(OntoError::TopAside {
            angle: cosine.clamp(-1.0, 1.0).acos(),
        });
    }
    Ok(())
}

/// Whether no place of the part that is built lies above its top by more than `least` mm.
fn covers(top: &Top, part: &Mesh, body: &Shape, least: f64) -> Result<(), OntoError> {
    let all = (0..part.triangles.len()).map(|t| middle(part, t));
    let built = all.filter(|p| body.distance(*p) > least);
    let highest = built
        .map(|p| (top.above(p), p))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match highest {
        Some((by, at)) if by > least => Err(OntoError::OverTop { by, at }),
        _ => Ok(()),
    }
}
