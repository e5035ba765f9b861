//! How the torch is held along a pass on a surface.
//! Source: Campocasso 2017, § III.D (half of the angle by which the surface leans).

use std::sync::Arc;

use meltpath_geometry::math::{DQuat, DVec3};

use super::field::Field;
use super::pass::{SurfacePass, SurfacePoint};

/// Where the torch points from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TorchRule {
    /// Along the surface, in the direction in which the wall grows.
    Tangent,
    /// Halfway between that and the direction in which the build begins: on the torus of the source a lean of u/2.
    Half,
    /// Always along the direction in which the build begins.
    Fixed,
    /// In the direction of the [`Torch::field`]; along the surface where that says nothing.
    Field,
}

/// How the torch is held.
#[derive(Debug, Clone, PartialEq)]
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
    /// Length along the pass over which the direction is a mean, mm: fronts have kinks, at which a torch cannot turn at once. Zero for
    /// the direction of each point alone.
    pub even: f64,
    /// Directions that a person gives.
    pub field: Option<Arc<Field>>,
}

/// Unit axes of the torch at the points of a pass, from the part towards the torch. The lead comes first, so that the greatest tilt
/// holds for what the torch really does.
pub fn torch_axes(pass: &SurfacePass, torch: &Torch) -> Vec<DVec3> {
    let points = &pass.points;
    let ruled = |p: &SurfacePoint| match torch.rule {
        TorchRule::Tangent => p.growth,
        // where the wall grows straight back there is no half way: the wall itself shows where to
        TorchRule::Half => (torch.begin + p.growth).normalize_or(p.normal),
        TorchRule::Fixed => torch.begin,
        TorchRule::Field => {
            let field = torch.field.as_ref();
            field.and_then(|f| f.at(p.position)).unwrap_or(p.growth)
        }
    };
    let mut ruled: Vec<DVec3> = points.iter().map(ruled).collect();
    if torch.even > 0.0 && torch.even.is_finite() {
        ruled = evened(pass, &ruled, torch.even);
    }
    let axis = |i: usize| {
        let axis = ruled[i];
        let along = pass.travel(i);
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

/// The same along passes, where those that go on from one another are one.
pub fn axes_along(passes: &[SurfacePass], torch: &Torch) -> Vec<Vec<DVec3>> {
    let runs = passes.chunk_by(|a, b| b.goes_on_from(a));
    let run = |run: &[SurfacePass]| -> Vec<Vec<DVec3>> {
        if let [pass] = run {
            return vec![torch_axes(pass, torch)];
        }
        let begin = run[0].points.first();
        let others = run.iter().flat_map(|p| p.points.iter().skip(1));
        let whole = SurfacePass {
            number: run[0].number,
            points: begin.into_iter().chain(others).copied().collect(),
        };
        let axes = torch_axes(&whole, torch);
        let mut at = 0;
        let own = |pass: &SurfacePass| {
            let to = at + pass.points.len();
            let own = axes[at..to].to_vec();
            at = to - 1;
            own
        };
        run.iter().map(own).collect()
    };
    runs.flat_map(run).collect()
}

/// Directions at the points of a pass, each the mean over `length` mm of it about its point; around the end of a closed pass.
fn evened(pass: &SurfacePass, directions: &[DVec3], length: f64) -> Vec<DVec3> {
    let way = |pair: &[SurfacePoint]| pair[0].position.distance(pair[1].position);
    let mut at = vec![0.0];
    // what the directions add up to from the begin on, straight between points
    let mut sums = vec![DVec3::ZERO];
    let (mut s, mut sum) = (0.0, DVec3::ZERO);
    for (pair, ends) in pass.points.windows(2).zip(directions.windows(2)) {
        let step = way(pair);
        s += step;
        sum += 0.5 * step * (ends[0] + ends[1]);
        at.push(s);
        sums.push(sum);
    }
    let (total, all) = (s, sum);
    let closed = pass.is_closed() && total > 0.0;
    let until = |s: f64| {
        let rounds = if closed { (s / total).floor() } else { 0.0 };
        let s = (s - rounds * total).clamp(0.0, total);
        let after = at.partition_point(|a| *a < s).clamp(1, at.len().max(2) - 1);
        let (Some(&a), Some(&b)) = (at.get(after - 1), at.get(after)) else {
            return DVec3::ZERO;
        };
        let share = if b > a { (s - a) / (b - a) } else { 0.0 };
        let [from, to] = [directions[after - 1], directions[after]];
        let part = (b - a) * share * (from + 0.5 * share * (to - from));
        rounds * all + sums[after - 1] + part
    };
    let half = 0.5 * length.min(total);
    let mean = |(s, own): (&f64, &DVec3)| (until(s + half) - until(s - half)).normalize_or(*own);
    at.iter().zip(directions).map(mean).collect()
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
