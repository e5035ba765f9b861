//! Area and volume of a boundary representation, not of its mesh.
//!
//! Each face's parameter region is integrated with the surface itself (Gauss points in the triangles
//! of the parameter plane), and the slivers between the boundary's chords and its curves are added,
//! so that the result converges far faster than the mesh (divergence theorem for the volume).

use std::collections::HashSet;

use meltpath_base::Observer;
use rayon::prelude::*;

use super::chart::Chart;
use super::error::TessellateError;
use super::fill::FaceMesh;
use super::tolerance::Tolerance;
use super::{Parts, triangulate};
use crate::brep::{BrepModel, Sense, ShellRole, Solid};
use crate::math::{DVec2, DVec3};

/// Area and volume.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MassProperties {
    /// Area of all faces, cavities included, mm².
    pub area: f64,
    /// Volume inside the closed shells, mm³; open shells enclose none.
    pub volume: f64,
}

/// Area and volume of all solids of a model, in their places.
///
/// # Errors
/// As [`super::tessellate`].
pub fn measure_model(
    model: &BrepModel,
    tolerance: &Tolerance,
    observer: &dyn Observer,
) -> Result<MassProperties, TessellateError> {
    let mut sum = MassProperties::default();
    for placed in &model.solids {
        let own = measure(&placed.solid, &placed.name, tolerance, observer)?;
        // placements turn, move, mirror and scale alike in all directions
        let scale = placed.part_from_solid.matrix3.determinant().abs();
        sum.area += own.area * scale.powf(2.0 / 3.0);
        sum.volume += own.volume * scale;
    }
    Ok(sum)
}

/// Area and volume of a solid; `name` is for messages.
///
/// `tolerance` sets the triangles over which the surfaces are integrated; at the default the result
/// is good to about 1e-7 of the part.
///
/// # Errors
/// As [`super::tessellate`].
pub fn measure(
    solid: &Solid,
    name: &str,
    tolerance: &Tolerance,
    observer: &dyn Observer,
) -> Result<MassProperties, TessellateError> {
    let parts = triangulate(solid, name, tolerance, observer)?;
    Ok(integrate(solid, &parts))
}

fn integrate(solid: &Solid, parts: &Parts) -> MassProperties {
    // about the middle of the part: keeps digits, and gaps between faces count least
    let origin = middle(&solid.vertices);
    let faces: Vec<[f64; 2]> = (0..solid.faces.len())
        .into_par_iter()
        .map(|f| {
            let chart = Chart::new(&solid.faces[f], solid.uncertainty);
            let mut face = face_integrals(solid, &chart, &parts.faces[f], origin);
            if parts.faces[f].sense == Sense::Reversed {
                face[1] = -face[1];
            }
            face
        })
        .collect();
    let mut sum = MassProperties::default();
    for shell in &solid.shells {
        let mut volume = 0.0;
        for used in &shell.faces {
            let [area, flux] = faces[used.face as usize];
            sum.area += area;
            volume += if used.sense == Sense::Forward {
                flux
            } else {
                -flux
            };
        }
        // shells that are inside out count as the mesh has them: turned
        sum.volume += match shell.role {
            ShellRole::Outer => volume.abs(),
            ShellRole::Void => -volume.abs(),
            ShellRole::Open => 0.0,
        };
    }
    sum
}

/// Middle of the box of some points.
fn middle(points: &[DVec3]) -> DVec3 {
    let Some(&first) = points.first() else {
        return DVec3::ZERO;
    };
    let (lo, hi) = points
        .iter()
        .fold((first, first), |(lo, hi), &p| (lo.min(p), hi.max(p)));
    0.5 * (lo + hi)
}

/// Points and weights of a rule of degree 5 on a triangle (Radon 1948).
fn triangle_rule() -> [([f64; 3], f64); 7] {
    let r = 15f64.sqrt();
    let (a, b) = ((6.0 + r) / 21.0, (6.0 - r) / 21.0);
    let (wa, wb) = ((155.0 + r) / 1200.0, (155.0 - r) / 1200.0);
    let third = 1.0 / 3.0;
    let at = |s: f64| {
        [
            [1.0 - 2.0 * s, s, s],
            [s, 1.0 - 2.0 * s, s],
            [s, s, 1.0 - 2.0 * s],
        ]
    };
    let ([a0, a1, a2], [b0, b1, b2]) = (at(a), at(b));
    [
        ([third; 3], 0.225),
        (a0, wa),
        (a1, wa),
        (a2, wa),
        (b0, wb),
        (b1, wb),
        (b2, wb),
    ]
}

/// Nodes and weights of Gauss and Legendre's rule with five points on 0..1.
fn line_rule() -> [(f64, f64); 5] {
    let r = (10.0f64 / 7.0).sqrt();
    let (x1, x2) = ((5.0 - 2.0 * r).sqrt() / 3.0, (5.0 + 2.0 * r).sqrt() / 3.0);
    let s = 70f64.sqrt();
    let (w1, w2) = ((322.0 + 13.0 * s) / 900.0, (322.0 - 13.0 * s) / 900.0);
    [
        (-x2, w2),
        (-x1, w1),
        (0.0, 128.0 / 225.0),
        (x1, w1),
        (x2, w2),
    ]
    .map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w))
}

/// Area, and flux of position / 3 through the face along its surface's normal.
fn face_integrals(solid: &Solid, chart: &Chart<'_>, mesh: &FaceMesh, origin: DVec3) -> [f64; 2] {
    let density = |uv: DVec2| {
        let [s, du, dv] = chart.tangents(uv);
        let n = du.cross(dv);
        [n.length(), (s - origin).dot(n) / 3.0]
    };
    let mut sum = [0.0; 2];
    let rule = triangle_rule();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|l| mesh.uv[l as usize]);
        let size = 0.5 * (b - a).perp_dot(c - a);
        for ([x, y, z], weight) in rule {
            let f = density(x * a + y * b + z * c);
            sum[0] += size * weight * f[0];
            sum[1] += size * weight * f[1];
        }
    }
    // slivers: the region between a chord and its curve belongs to the face where the curve lies on
    // the other side of the chord than its triangle
    let sides: HashSet<[u32; 2]> = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .collect();
    let line = line_rule();
    for chord in &mesh.boundary {
        let edge = &solid.edges[chord.edge as usize];
        if edge.curve.is_straight() && matches!(chart.surface, crate::brep::Surface::Plane(_)) {
            continue;
        }
        let [from, to] = chord.ends;
        let turn = match (sides.contains(&[from, to]), sides.contains(&[to, from])) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => continue,
        };
        let [a, b] = chord.uv;
        let [t0, t1] = chord.t;
        let d = b - a;
        let height = |s: f64| {
            let on = a + s * d;
            let p = edge.derivatives(t0 + s * (t1 - t0))[0];
            chart.locate(p, Some(on)) - on
        };
        // the sliver is swept by the offset from chord to curve: dA = offset × d(chord), corrected
        // for the offset's own change along the way
        for (s, ws) in line {
            let h = height(s);
            let ds = 1e-4;
            let slope = (height((s + ds).min(1.0)) - height((s - ds).max(0.0)))
                / ((s + ds).min(1.0) - (s - ds).max(0.0));
            for (r, wr) in line {
                let uv = a + s * d + r * h;
                // area element of (s, r): (d + r slope) × h, positive to the left of the chord
                let size = (d + r * slope).perp_dot(h);
                let f = density(uv);
                sum[0] -= turn * ws * wr * size * f[0];
                sum[1] -= turn * ws * wr * size * f[1];
            }
        }
    }
    sum
}
