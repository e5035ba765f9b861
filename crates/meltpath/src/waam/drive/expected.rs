//! The metal that stands there while a program is executed, for collisions, as its beads are commanded.

use meltpath_geometry::math::DVec3;
use meltpath_robot::collision::Metal;

use crate::waam::drive::bead_pieces::pieces;
use crate::waam::drive::columns;
use crate::waam::drive::site::Site;
use crate::waam::drive::solids;
use crate::waam::program::Commands;

/// The metal, of which there is some, while a command is executed; while a layer is laid its metal counts as laid already.
pub(in crate::waam) fn metal_at<'a>(
    moves: &Commands,
    metal: &'a [(u32, Metal)],
    command: u32,
) -> &'a Metal {
    let layer = moves.layer_of_command.get(command as usize);
    let until = metal.partition_point(|(l, _)| layer.is_some_and(|layer| l <= layer));
    &metal[until.saturating_sub(1)].1
}

/// The metal after each layer as the beads are commanded; a plan that could not be laid has none.
pub(in crate::waam) fn expected(moves: &Commands, site: Site<'_>) -> Vec<(u32, Metal)> {
    let settings = site.settings;
    if settings.robot.as_ref().is_none_or(|r| r.shapes.is_none()) {
        return Vec::new();
    }
    if let Some(standing) = site.standing {
        return solids::after_layers(moves, standing, settings);
    }
    // a bead high over the wire's tip, down to the plate
    let bead = &settings.bead;
    let (half, high) = (0.5 * bead.width.value, bead.height.value);
    let beads: Vec<(u32, [DVec3; 2])> = pieces(moves)
        .map(|piece| {
            // a bead that is laid aslant reaches over its middle by half of its width
            let [a, b] = piece.ends;
            let across = (b - a).cross(piece.wire).normalize_or_zero();
            let up = half * across.z.abs() * DVec3::Z;
            (piece.layer, [a + up, b + up])
        })
        .collect();
    columns::columns(&beads, (half, high)).unwrap_or_default()
}
