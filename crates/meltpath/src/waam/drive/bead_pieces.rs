//! Beads as they are commanded or planned, in straight pieces.

use meltpath_geometry::math::DVec3;
use meltpath_robot::command::{Kind, Source};
use meltpath_toolpath::{Move, Pass};

use crate::waam::program::Commands;

/// A straight piece of a bead as it is commanded.
#[derive(Debug, Clone)]
pub(in crate::waam) struct BeadPiece {
    pub(in crate::waam) layer: u32,
    pub(in crate::waam) command: u32,
    /// The wire's tip, mm.
    pub(in crate::waam) ends: [DVec3; 2],
    /// The way that the wire points.
    pub(in crate::waam) wire: DVec3,
}

/// The pieces of a bead of a plan that stands before a program begins: of no command of its, in layer 0.
pub(in crate::waam) fn standing(pass: &Pass<'_>) -> Vec<BeadPiece> {
    let piece = |i: usize| {
        let [from, to] = [pass.points[i], pass.points[i + 1]];
        let wire = -pass.axis(i).unwrap_or(DVec3::Z);
        let piece = move |a: DVec3, b: DVec3| BeadPiece {
            layer: 0,
            command: 0,
            ends: [a, b],
            wire,
        };
        match pass.move_at(i) {
            Move::Arc { via } => vec![piece(from, via), piece(via, to)],
            _ => vec![piece(from, to)],
        }
    };
    (0..pass.move_count()).flat_map(piece).collect()
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
