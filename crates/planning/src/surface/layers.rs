//! Passes on a surface as layers of a toolpath.

use meltpath_toolpath::{Layer, PassHead, PassId, Role};

use super::pass::{SurfacePass, SurfacePoint};
use super::torch::{Torch, torch_axes};

/// The passes as layers of a toolpath, one layer for each number, with the torch axis at every point. Points bear their own heights.
///
/// The wire's tip goes along what a pass is laid on, as on flat layers: over the pass before, or the base. Where there is nothing
/// below, that place is `spacing` mm behind the pass, against its growth.
pub fn layers(passes: &[SurfacePass], torch: &Torch, spacing: f64) -> Vec<Layer> {
    let mut layers = Vec::new();
    let mut id = 0;
    for group in passes.chunk_by(|a, b| a.number == b.number) {
        let mut layer = Layer::new(group[0].number, 0.0);
        for (entity, pass) in group.iter().enumerate() {
            let axes = torch_axes(pass, torch);
            let mut points = pass.points.iter().zip(axes);
            let Some((first, axis)) = points.next() else {
                continue;
            };
            let head = PassHead {
                id: PassId(id),
                entity: entity as u32,
                role: Role::Contour,
                ..PassHead::default()
            };
            id += 1;
            let tip = |p: &SurfacePoint| p.from.unwrap_or(p.position - spacing * p.growth);
            let mut writer = layer.begin(head, tip(first));
            writer.axis(axis);
            for (point, axis) in points {
                writer.line_to(tip(point)).axis(axis);
            }
        }
        layers.push(layer);
    }
    layers
}
