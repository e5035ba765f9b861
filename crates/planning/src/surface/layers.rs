//! Passes on a surface as layers of a toolpath.

use meltpath_toolpath::{Layer, PassHead, PassId, Role};

use super::pass::SurfacePass;
use super::torch::{Torch, torch_axes};

/// The passes as layers of a toolpath, one layer for each number, with the torch axis at every point. Points bear their own heights.
pub fn layers(passes: &[SurfacePass], torch: &Torch) -> Vec<Layer> {
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
            let mut writer = layer.begin(head, first.position);
            writer.axis(axis);
            for (point, axis) in points {
                writer.line_to(point.position).axis(axis);
            }
        }
        layers.push(layer);
    }
    layers
}
