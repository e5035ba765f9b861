//! Bodies of revolution about z from a profile in the (radius, z) half-plane.

use std::f64::consts::TAU;

use crate::{
    Mesh,
    math::{DVec2, DVec3},
    region::signed_area,
};

/// Revolves a closed profile about the z axis into a closed mesh with outward normals.
///
/// `profile` holds (radius, z) in mm with radius ≥ 0; either sense of rotation; the closing edge is implied.
/// Points on the axis become poles, edges along it vanish. `segments` is taken as at least 3. Negative radii
/// are taken as 0.
///
/// ```
/// use meltpath_geometry::{math::DVec2, shapes::revolve};
/// let cylinder = revolve(&[[0.0, 0.0], [5.0, 0.0], [5.0, 10.0], [0.0, 10.0]].map(DVec2::from), 720);
/// assert!((cylinder.volume() / (250.0 * std::f64::consts::PI) - 1.0).abs() < 2e-5);
/// ```
pub fn revolve(profile: &[DVec2], segments: u32) -> Mesh {
    let segments = segments.max(3);
    let mut profile: Vec<DVec2> = profile
        .iter()
        .map(|p| DVec2::new(p.x.max(0.0), p.y))
        .collect();
    if signed_area(&profile) < 0.0 {
        profile.reverse();
    }
    let mut mesh = Mesh::default();
    // first vertex of each profile point, and whether it is a single pole
    let mut rows = Vec::with_capacity(profile.len());
    for p in &profile {
        let pole = p.x == 0.0;
        rows.push((mesh.vertices.len() as u32, pole));
        for k in 0..if pole { 1 } else { segments } {
            let direction = DVec2::from_angle(TAU * f64::from(k) / f64::from(segments));
            mesh.vertices
                .push(DVec3::new(p.x * direction.x, p.x * direction.y, p.y));
        }
    }
    let at = |(first, pole): (u32, bool), k: u32| if pole { first } else { first + k % segments };
    for i in 0..profile.len() {
        let (a, b) = (rows[i], rows[(i + 1) % profile.len()]);
        if a.1 && b.1 {
            continue;
        }
        for k in 0..segments {
            // a counter-clockwise profile in (r, z) has its outside to the right: towards +r on the way up
            let quad = [at(a, k), at(a, k + 1), at(b, k + 1), at(b, k)];
            if !a.1 {
                mesh.triangles.push([quad[0], quad[1], quad[2]]);
            }
            if !b.1 {
                mesh.triangles.push([quad[0], quad[2], quad[3]]);
            }
        }
    }
    mesh
}
