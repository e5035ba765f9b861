//! Whole parts, standing on z = 0: bodies built from terraces and revolutions. All lengths mm.

use std::f64::consts::TAU;

use super::{
    Terrace, extrude,
    outlines::{plate, polygon, reversed},
    revolve, terrace,
};
use crate::{Mesh, math::DVec2, region::Region};

/// Sides of the polygons that stand for circles, and segments of revolutions.
const SEGMENTS: u32 = 180;

/// A straight wall along x.
pub fn thin_wall(length: f64, thickness: f64, height: f64) -> Mesh {
    extrude(&[plate(length, thickness)], height)
}

/// Four walls around an open rectangle; outer sizes `length` by `width`.
pub fn box_wall(length: f64, width: f64, thickness: f64, height: f64) -> Mesh {
    let mut inner = plate(length - 2.0 * thickness, width - 2.0 * thickness).outer;
    for p in &mut inner {
        *p += DVec2::splat(thickness);
    }
    let region = Region {
        outer: plate(length, width).outer,
        holes: vec![reversed(inner)],
    };
    extrude(&[region], height)
}

/// A full cone frustum.
pub fn cone(bottom_radius: f64, top_radius: f64, height: f64) -> Mesh {
    let profile = [
        [0.0, 0.0],
        [bottom_radius, 0.0],
        [top_radius, height],
        [0.0, height],
    ];
    revolve(&profile.map(DVec2::from), SEGMENTS)
}

/// An open vase: a wall of `thickness` (measured along the radius) whose radius swells by `swell` half-way up.
pub fn vase(
    radius: f64,
    swell: f64,
    thickness: f64,
    height: f64,
    segments: u32,
    rows: u32,
) -> Mesh {
    let rows = rows.max(2);
    let side = |k: u32, inset: f64| {
        let t = f64::from(k) / f64::from(rows);
        let bulge = swell * (0.5 * TAU * t).sin();
        DVec2::new(radius + bulge - inset, height * t)
    };
    let outside = (0..=rows).map(|k| side(k, 0.0));
    let inside = (0..=rows).rev().map(|k| side(k, thickness));
    let profile: Vec<DVec2> = outside.chain(inside).collect();
    revolve(&profile, segments)
}

/// A flange: a disc with a hub, a bore through both and `bolts` holes on a circle.
///
/// `disc` and `hub` are (outer radius, height over the floor).
pub fn flange(
    disc: (f64, f64),
    hub: (f64, f64),
    bore_radius: f64,
    bolts: u32,
    bolt_circle_radius: f64,
    bolt_hole_radius: f64,
) -> Mesh {
    let bore = reversed(polygon(DVec2::ZERO, bore_radius, SEGMENTS));
    let bolt_holes = (0..bolts).map(|k| {
        let at = bolt_circle_radius * DVec2::from_angle(TAU * f64::from(k) / f64::from(bolts));
        reversed(polygon(at, bolt_hole_radius, 48))
    });
    let body = |radius, holes| Region {
        outer: polygon(DVec2::ZERO, radius, SEGMENTS),
        holes,
    };
    terrace(&[
        Terrace {
            regions: vec![body(
                disc.0,
                std::iter::once(bore.clone()).chain(bolt_holes).collect(),
            )],
            height: disc.1,
        },
        Terrace {
            regions: vec![body(hub.0, vec![bore])],
            height: hub.1,
        },
    ])
}

/// An impeller blank: a bored hub with a disc that tapers outwards.
///
/// `hub` is (radius, height); the disc goes from `hub` to `rim` = (radius, thickness at the rim).
pub fn impeller_blank(hub: (f64, f64), rim: (f64, f64), bore_radius: f64) -> Mesh {
    let shoulder = 0.5 * (rim.1 + hub.1);
    let profile = [
        [bore_radius, 0.0],
        [rim.0, 0.0],
        [rim.0, rim.1],
        [hub.0, shoulder],
        [hub.0, hub.1],
        [bore_radius, hub.1],
    ];
    revolve(&profile.map(DVec2::from), SEGMENTS)
}

/// A round boss with a bore standing on a rectangular plate; `plate_size` is (length, width, thickness).
pub fn boss_on_plate(
    plate_size: (f64, f64, f64),
    boss_radius: f64,
    bore_radius: f64,
    boss_height: f64,
) -> Mesh {
    let (length, width, thickness) = plate_size;
    let centre = 0.5 * DVec2::new(length, width);
    let bore = reversed(polygon(centre, bore_radius, SEGMENTS));
    let body = |outer| Region {
        outer,
        holes: vec![bore.clone()],
    };
    terrace(&[
        Terrace {
            regions: vec![body(plate(length, width).outer)],
            height: thickness,
        },
        Terrace {
            regions: vec![body(polygon(centre, boss_radius, SEGMENTS))],
            height: thickness + boss_height,
        },
    ])
}

/// A base plate with `ribs` parallel upright ribs across it; `base` is (length, width, thickness).
pub fn ribbed_bracket(base: (f64, f64, f64), ribs: u32, rib_width: f64, rib_height: f64) -> Mesh {
    let (length, width, thickness) = base;
    let pitch = length / f64::from(ribs.max(1));
    let rib = |k: u32| {
        let x = pitch * (f64::from(k) + 0.5) - 0.5 * rib_width;
        let mut region = plate(rib_width, 0.8 * width);
        let corner = DVec2::new(x, 0.1 * width);
        region.outer.iter_mut().for_each(|p| *p += corner);
        region
    };
    terrace(&[
        Terrace {
            regions: vec![plate(length, width)],
            height: thickness,
        },
        Terrace {
            regions: (0..ribs).map(rib).collect(),
            height: thickness + rib_height,
        },
    ])
}
