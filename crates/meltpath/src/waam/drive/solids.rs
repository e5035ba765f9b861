//! Beads laid from any side as rods, on what stands there: no less than their metal, for collisions.

use std::sync::Arc;

use meltpath_geometry::Mesh;
use meltpath_geometry::math::DVec3;
use meltpath_robot::collision::{Metal, Rod, Solids};

use crate::waam::drive::bead_pieces::{BeadPiece, pieces};
use crate::waam::program::Commands;
use crate::waam::settings::Settings;
use crate::waam::settings::holder::Holder;

/// Rods lie side by side within this share of a bead's height.
const CLOSE: f64 = 0.75;

/// What stands on the table before anything is laid, in the part.
#[derive(Debug, Clone, Default)]
pub(crate) struct Standing {
    /// Bodies, the plate, and what holds them, closed.
    pub(crate) meshes: Vec<Mesh>,
    /// What holds them.
    pub(crate) holders: Vec<Holder>,
    /// Beads that another program laid before, in layer 0.
    pub(in crate::waam) beads: Vec<BeadPiece>,
}

/// The metal after each layer as the beads are commanded, and before the first.
pub(in crate::waam) fn after_layers(
    moves: &Commands,
    standing: &Standing,
    settings: &Settings,
) -> Vec<(u32, Metal)> {
    let bead = &settings.bead;
    let (half, high) = (0.5 * bead.width.value, bead.height.value);
    let laid = standing.beads.iter().cloned().chain(pieces(moves));
    let beads = laid.flat_map(|piece| {
        let layer = piece.layer;
        rods(&piece, half, high)
            .into_iter()
            .map(move |rod| (layer, rod))
    });
    let solids = Arc::new(Solids::new(&standing.meshes, beads));
    let mut layers: Vec<u32> = pieces(moves).map(|piece| piece.layer).collect();
    layers.push(0);
    layers.sort_unstable();
    layers.dedup();
    let after = |layer| (layer, Metal::until(&solids, layer));
    layers.into_iter().map(after).collect()
}

/// Rods side by side for a piece of a bead half as wide as `half` and `high` over the wire's tip, which lies on the metal below, mm: together they
/// are as wide, and between two of them as high.
fn rods(piece: &BeadPiece, half: f64, high: f64) -> Vec<Rod> {
    let [a, b] = piece.ends;
    let across = (b - a).cross(piece.wire).normalize_or_zero();
    let room = half - high;
    if room <= 0.0 || across == DVec3::ZERO {
        let radius = half.max(high);
        return vec![Rod {
            ends: piece.ends,
            radius,
        }];
    }
    let count = (room / (CLOSE * high)).ceil().max(1.0) as i32;
    let step = room / f64::from(count);
    let radius = high.hypot(0.5 * step);
    let beside = (-count..=count).map(|i| step * f64::from(i) * across);
    let rod = |aside: DVec3| Rod {
        ends: piece.ends.map(|p| p + aside),
        radius,
    };
    beside.map(rod).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The section of a bead is a parabola at most: nothing of it lies outside, and little beside it is taken for metal.
    #[test]
    fn rods_hold_the_section_of_a_bead() {
        for (half, high) in [(3.3, 2.0), (6.0, 1.5), (2.0, 2.5)] {
            let piece = BeadPiece {
                layer: 1,
                command: 0,
                ends: [DVec3::ZERO, DVec3::new(0.0, 10.0, 0.0)],
                wire: DVec3::NEG_Z,
            };
            let rods = rods(&piece, half, high);
            let inside = |x: f64, z: f64| {
                let p = DVec3::new(x, 5.0, z);
                rods.iter().any(|rod| rod.to_point(p) <= 1e-9)
            };
            for i in -50..=50 {
                let share = f64::from(i) / 50.0;
                let x = half * share;
                assert!(inside(x, high * (1.0 - share * share)), "{half} {high} {x}");
            }
            assert!(!inside(0.0, 1.1 * high.max(half.min(high) * 1.1)));
            assert!(!inside(1.15 * half.max(high), 0.0));
        }
    }
}
