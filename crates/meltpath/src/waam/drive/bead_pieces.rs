//! Beads as they are commanded, in straight pieces.

use meltpath_geometry::math::DVec3;
use meltpath_robot::command::{Kind, Source};

use crate::waam::program::Commands;

/// A straight piece of a bead as it is commanded.
pub(in crate::waam) struct BeadPiece {
    pub(in crate::waam) layer: u32,
    pub(in crate::waam) command: u32,
    /// The wire's tip, mm.
    pub(in crate::waam) ends: [DVec3; 2],
    /// The way that the wire points.
    pub(in crate::waam) wire: DVec3,
}

/// The pieces of the beads of commands, in order; an arc as two.
pub(in crate::waam) fn pieces(moves: &Commands) -> impl Iterator<Item = BeadPiece> {
    let mut here = moves.start.position;
    let each = moves.commands.iter().zip(&moves.layer_of_command);
    each.flat_map(move |(command, layer)| {
        let from = here;
        if matches!(command.kind, Kind::Wait { .. }) {
            return [None, None];
        }
        here = command.target;
        let piece = |a: DVec3, b: DVec3| BeadPiece {
            layer: *layer,
            command: command.id,
            ends: [a, b],
            wire: command.orientation * DVec3::Z,
        };
        match (command.source, command.kind) {
            (Source::On { .. }, Kind::Arc { via }) => {
                [Some(piece(from, via)), Some(piece(via, here))]
            }
            (Source::On { .. }, _) => [Some(piece(from, here)), None],
            (Source::Off, _) => [None, None],
        }
    })
    .flatten()
}
