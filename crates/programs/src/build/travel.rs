//! Ways between beads: up, over and down again, or out of a flank and back to it.

use meltpath_geometry::math::DVec3;

use super::flank::same;
use super::{Builder, Point, rounded};
use crate::program::{ArcWord, Dialect, MotionKind, Speed, Termination};

impl Builder<'_> {
    /// To over `to` at clearance, from wherever the tool is.
    fn travel(&mut self, to: Point) {
        let clear = (self.highest + self.cell.clearance.0).max(to.position.z);
        let speed = self.cell.travel_speed.0;
        let over = self.wording.smoothed(*self.cell.travel_smoothing);
        if let Some(place) = self.place {
            if place.position.z < clear {
                self.line(place.at_height(clear), speed, over.clone(), None);
            }
            self.line(to.at_height(clear), speed, over, None);
        } else {
            let first = match self.settings.dialect {
                // its joint moves have the speed of the tool
                Dialect::Rapid => self.wording.speed(self.cell.travel_speed.0),
                _ => Speed::share((self.cell.first_move.0 * 100.0).round()),
            };
            let to = to.at_height(clear);
            self.motion(MotionKind::Joint, to, first, Termination::Fine, None);
        }
    }

    /// Down to the start of a bead, where the arc is struck; `way` leads out of the flank that it lies on.
    pub(super) fn strike(&mut self, start: Point, way: Option<DVec3>, on: ArcWord) {
        let asked = self.cell.approach_height.map(|h| h.0);
        let beyond = way.map(|way| self.raised(start, way));
        let far = |p: &Point| p.position.distance(start.position);
        let near = asked.map(|height| start.drawn_back(height));
        let near = near.into_iter().chain(beyond);
        let near = near.max_by(|a, b| far(a).total_cmp(&far(b)));
        match near {
            Some(near) => {
                match (way, self.flank, self.place) {
                    (Some(way), Some(before), Some(place)) if same(way, before) => {
                        let speed = self.cell.travel_speed.0;
                        let over = self.wording.smoothed(*self.cell.travel_smoothing);
                        let up = self.raised(place, way);
                        if up.position != place.position {
                            self.line(up, speed, over, None);
                        }
                    }
                    _ => self.travel(near),
                }
                let over = self.wording.smoothed(*self.cell.travel_smoothing);
                self.line(near, self.cell.travel_speed.0, over, None);
            }
            None => self.travel(start),
        }
        let approach = self.cell.approach_speed.0;
        self.line(start, approach, Termination::Fine, Some(on));
    }

    /// A point moved out of a flank, beyond all metal along the way out of it; one that is beyond stays.
    fn raised(&self, point: Point, way: DVec3) -> Point {
        let level = self.flanks.level(way) + self.cell.clearance.0;
        let short = level - point.position.dot(way);
        if short <= 0.0 {
            return point;
        }
        let position = rounded(point.position + short * way, 0.0);
        Point { position, ..point }
    }

    /// Away from the end of a bead, up to the height of travels; `way` leads out of the flank that it lies on.
    pub(super) fn leave(&mut self, way: Option<DVec3>) {
        let over = self.wording.smoothed(*self.cell.travel_smoothing);
        self.flank = way;
        if let (Some(height), Some(end)) = (*self.cell.retract_height, self.place) {
            let approach = self.cell.approach_speed.0;
            self.line(end.drawn_back(height.0), approach, over.clone(), None);
        }
        let Some(end) = self.place else { return };
        if let Some(way) = way {
            let end = self.raised(end, way);
            self.line(end, self.cell.travel_speed.0, over, None);
            return;
        }
        let clear = self.highest + self.cell.clearance.0;
        if self.cell.retract_height.is_none() || end.position.z < clear {
            self.line(end.at_height(clear), self.cell.travel_speed.0, over, None);
        }
    }
}
