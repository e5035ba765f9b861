//! Passes on surfaces in space: the torus of Campocasso 2017 as a parametric surface and as a mesh, other meshes, the torch.

use std::f64::consts::{FRAC_PI_2, TAU};

use meltpath_geometry::Mesh;
use meltpath_geometry::brep::{Frame, Surface, TorusSheet};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::shapes;
use meltpath_planning::surface::{
    Parameter, Patch, SurfacePass, SurfaceSettings, SurfaceStrategy, Torch, TorchRule, plan_patch,
};

mod flange;
mod meshes;
mod spiral;
mod torch;
mod torus;

/// A torch by this rule in a build that begins straight up, neither pushing nor dragging.
fn upwards(rule: TorchRule) -> Torch {
    Torch {
        rule,
        begin: DVec3::Z,
        up: DVec3::Z,
        greatest_tilt: std::f64::consts::PI,
        lead: 0.0,
        even: 0.0,
        field: None,
    }
}

/// Distance between passes in the figures of the source, mm.
const STEP: f64 = 5.0;
const PLANES: SurfaceStrategy = SurfaceStrategy::Planes {
    direction: DVec3::Z,
};

fn settings(strategy: SurfaceStrategy) -> SurfaceSettings {
    SurfaceSettings {
        strategy,
        spacing: STEP,
        chord_error: 1e-3,
    }
}

/// Passes on the quarter of the torus.
fn planned(strategy: SurfaceStrategy) -> Vec<SurfacePass> {
    let surface = torus();
    let patch = Patch {
        surface: &surface,
        growth: Parameter::U,
        along: [0.0, FRAC_PI_2],
        across: [TAU, 0.0],
    };
    plan_patch(&patch, &settings(strategy)).unwrap()
}

/// The torus of the source's eq. 1: R = 50 mm, r = 15 mm; its u is the source's, its v runs the other way.
fn torus() -> Surface {
    let frame = Frame::new(DVec3::new(-50.0, 0.0, 0.0), -DVec3::Y, DVec3::X).unwrap();
    Surface::Torus {
        frame,
        major: 50.0,
        minor: 15.0,
        sheet: TorusSheet::Outer,
    }
}

/// Eq. 1 of the source.
fn eq1(u: f64, v: f64) -> DVec3 {
    let rho = 50.0 + 15.0 * v.cos();
    DVec3::new(rho * u.cos() - 50.0, 15.0 * v.sin(), rho * u.sin())
}

/// The source's u and v of a point of the torus, rad.
fn parameters(p: DVec3) -> DVec2 {
    let rho = (p.x + 50.0).hypot(p.z);
    DVec2::new(p.z.atan2(p.x + 50.0), p.y.atan2(rho - 50.0).rem_euclid(TAU))
}

/// The quarter torus as a mesh that lies within `tolerance` mm of it.
fn torus_mesh(tolerance: f64) -> Mesh {
    let parts = |radius: f64, angle: f64| {
        // half of it for each of the two directions
        (angle / (2.0 * (1.0 - 0.5 * tolerance / radius).acos())).ceil() as u32
    };
    shapes::tube(parts(65.0, FRAC_PI_2), parts(15.0, TAU), |u, v| {
        eq1(u * FRAC_PI_2, v * TAU)
    })
}

/// Distance of a point from a polyline, mm, directly.
fn distance(p: DVec3, line: &SurfacePass) -> f64 {
    let pairs = line.points.windows(2).map(|w| {
        let (a, way) = (w[0].position, w[1].position - w[0].position);
        let share = ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
        p.distance(a + share * way)
    });
    pairs.fold(f64::INFINITY, f64::min)
}

fn numbered(passes: &[SurfacePass], number: u32) -> Vec<&SurfacePass> {
    passes.iter().filter(|p| p.number == number).collect()
}
