//! How the torch is held along a pass on a surface.
//! Source: Campocasso 2017, § III.D (half of the angle by which the surface leans).

use meltpath_geometry::math::{DQuat, DVec3};

use super::pass::SurfacePass;

/// Where the torch points from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TorchRule {
    /// Along the surface, in the direction in which the wall grows.
    Tangent,
    /// Halfway between that and the direction in which the build begins: on the torus of the source a lean of u/2.
    Half,
    /// Always along the direction in which the build begins.
    Fixed,
}

/// How the torch is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torch {
    /// Where it points from.
    pub rule: TorchRule,
    /// The unit direction in which the build begins, away from its base.
    pub begin: DVec3,
    /// The unit direction against gravity, in the frame of the part.
    pub up: DVec3,
    /// Greatest angle between the torch and `up`, rad; beyond it the torch is turned back to it. π sets no bound.
    pub greatest_tilt: f64,
    /// Angle by which the wire points ahead along the travel, rad: above zero it pushes, below it drags.
    pub lead: f64,
}

impl Torch {
    /// A torch by this rule in a build that begins straight up, neither pushing nor dragging.
    pub fn upwards(rule: TorchRule) -> Self {
        Torch {
            rule,
            begin: DVec3::Z,
            up: DVec3::Z,
            greatest_tilt: std::f64::consts::PI,
            lead: 0.0,
        }
    }
}

/// Unit axes of the torch at the points of a pass, from the part towards the torch. The lead comes first, so that the greatest tilt
/// holds for what the torch really does.
pub fn torch_axes(pass: &SurfacePass, torch: &Torch) -> Vec<DVec3> {
    let points = &pass.points;
    let last = points.len().saturating_sub(1);
    let closed = pass.is_closed();
    let travel = |i: usize| {
        let before = match i {
            0 if closed => last - 1,
            _ => i.saturating_sub(1),
        };
        let after = if i == last && closed {
            1
        } else {
            (i + 1).min(last)
        };
        (points[after].position - points[before].position).normalize_or_zero()
    };
    let axis = |i: usize| {
        let growth = points[i].growth;
        let axis = match torch.rule {
            TorchRule::Tangent => growth,
            // where the wall grows straight back there is no half way: the wall itself shows where to
            TorchRule::Half => (torch.begin + growth).normalize_or(points[i].normal),
            TorchRule::Fixed => torch.begin,
        };
        let along = travel(i);
        let along = (along - axis * along.dot(axis)).normalize_or_zero();
        let (s, c) = torch.lead.sin_cos();
        let led = if along == DVec3::ZERO {
            axis
        } else {
            c * axis - s * along
        };
        held_up(led.normalize_or(axis), torch)
    };
    (0..points.len()).map(axis).collect()
}

/// The axis, turned back towards the vertical where it leans too far.
fn held_up(axis: DVec3, torch: &Torch) -> DVec3 {
    let tilt = axis.angle_between(torch.up);
    if tilt <= torch.greatest_tilt {
        return axis;
    }
    let about = torch
        .up
        .cross(axis)
        .normalize_or(torch.up.any_orthonormal_vector());
    DQuat::from_axis_angle(about, torch.greatest_tilt) * torch.up
}
