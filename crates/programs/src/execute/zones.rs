//! Corners that are rounded farther than the corner model of the cell reaches: a path that is smoothed in full is left at `blend`.

use meltpath_geometry::arc::Arc;
use meltpath_geometry::math::DVec3;

use super::path::Zone;
use super::{Executed, ExecutedKind, ExecutedMotion, Machine, Missing};

/// Programs hold no more digits, mm.
const DIGIT: f64 = 1e-3;
/// Where on an arc its direction at an end is looked for, as a share of it.
const AT_END: f64 = 1e-4;

impl Machine<'_> {
    /// Remembers the move that is executed, where it is rounded farther than a path that is smoothed in full.
    pub(super) fn round_off(&mut self, distance: f64, full: f64) {
        if distance > full + DIGIT {
            self.zones.push(Zone {
                index: self.executed.len(),
                distance,
                at: self.at,
            });
        }
    }

    /// Tells beads that leave a corner farther than it is simulated, by more than their metal hides. Controllers round a move from its middle on at the most.
    ///
    /// A corner that turns by θ and is rounded from `d` before to `d` behind it, by a parabola, is left by d/2 · sin(θ/2).
    pub(super) fn look_at_zones(&mut self) {
        let full = self.settings.blend.unwrap_or(0.0);
        let at = self.at;
        for zone in std::mem::take(&mut self.zones) {
            let (here, next) = (
                self.executed.get(zone.index),
                self.executed.get(zone.index + 1),
            );
            let (Some(Executed::Motion(here)), Some(Executed::Motion(next))) = (here, next) else {
                continue;
            };
            let burns = here.arc.is_some() || next.arc.is_some();
            let Some(from) = self.came_from(zone.index).filter(|_| burns) else {
                continue;
            };
            let corner = here.target.position;
            let before = Leg::of(from, here);
            let behind = Leg::of(corner, next);
            let most = 0.5 * before.length.min(behind.length);
            let more = zone.distance.min(most) - full;
            let turned = 0.5 * before.end.distance(behind.start);
            if 0.5 * more * turned > self.settings.unseen_way {
                self.at = zone.at;
                self.gap(Missing::Zone(zone.distance, full));
            }
        }
        self.at = at;
    }

    /// Where the move before one began to lead from, mm.
    fn came_from(&self, index: usize) -> Option<DVec3> {
        let before = self.executed.get(..index)?.iter().rev();
        let mut places = before.filter_map(|step| match step {
            Executed::Motion(m) => Some(m.target.position),
            Executed::Wait { .. } => None,
        });
        places.next()
    }
}

/// The way of a move: its length, mm, and its directions where it starts and ends.
struct Leg {
    length: f64,
    start: DVec3,
    end: DVec3,
}

impl Leg {
    fn of(from: DVec3, to: &ExecutedMotion) -> Leg {
        let end = to.target.position;
        let arc = match to.kind {
            ExecutedKind::Circular { via } => Arc::through(from, via, end),
            ExecutedKind::Joint | ExecutedKind::Linear => None,
        };
        let along = (end - from).normalize_or_zero();
        match arc {
            Some(arc) => Leg {
                length: arc.length(),
                start: (arc.at(AT_END) - from).normalize_or_zero(),
                end: (end - arc.at(1.0 - AT_END)).normalize_or_zero(),
            },
            None => Leg {
                length: from.distance(end),
                start: along,
                end: along,
            },
        }
    }
}
