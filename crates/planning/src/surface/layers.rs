//! Passes on a surface as layers of a toolpath.

use meltpath_toolpath::{Channel, Layer, PassHead, PassId, Role};

use super::pass::{SurfacePass, SurfacePoint};
use super::torch::{Torch, axes_along};

/// The passes as layers of a toolpath, one layer for each number, with the torch axis at every point. Points bear their own heights.
/// `how` tells of each pass by its index what it is for and the speed of each of its moves, mm/s. A pass that goes on from the one before
/// has its identifier.
///
/// The wire's tip goes along what a pass is laid on, as on flat layers: over the pass before, or the base. Where there is nothing
/// below, that place is `spacing` mm behind the pass, against its growth.
pub fn paced_layers<'a>(
    passes: &[SurfacePass],
    torch: &Torch,
    spacing: f64,
    how: impl Fn(usize) -> (Role, &'a [Option<f64>]),
) -> Vec<Layer> {
    let mut layers = Vec::new();
    let mut axes = axes_along(passes, torch).into_iter();
    let (mut index, mut id, mut before): (usize, u32, Option<&SurfacePass>) = (0, 0, None);
    for group in passes.chunk_by(|a, b| a.number == b.number) {
        let mut layer = Layer::new(group[0].number, 0.0);
        for (entity, pass) in group.iter().enumerate() {
            let axes = axes.next().unwrap_or_default();
            let mut points = pass.points.iter().zip(axes);
            let Some((first, axis)) = points.next() else {
                continue;
            };
            let (role, speeds) = how(index);
            index += 1;
            id += u32::from(before.is_some_and(|b| !pass.goes_on_from(b)));
            before = Some(pass);
            let mut speeds = speeds.iter();
            let head = PassHead {
                id: PassId(id),
                entity: entity as u32,
                role,
                ..PassHead::default()
            };
            let tip = |p: &SurfacePoint| p.from.unwrap_or(p.position - spacing * p.growth);
            let mut writer = layer.begin(head, tip(first));
            writer.axis(axis);
            for (point, axis) in points {
                writer.line_to(tip(point)).axis(axis);
                if let Some(&Some(speed)) = speeds.next() {
                    writer.set(Channel::Speed, speed);
                }
            }
        }
        layers.push(layer);
    }
    layers
}
