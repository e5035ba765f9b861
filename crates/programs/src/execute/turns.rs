//! Moves whose tool may turn only so fast: where that takes longer than the way of its tip at its speed, the tip goes more slowly.

use meltpath_geometry::Pose;
use meltpath_geometry::arc::Arc;

use super::{Executed, ExecutedKind, ExecutedMotion, ExecutedSpeed, Machine, Missing};

/// Programs hold no more digits, mm: a way that is shorter is none.
const DIGIT: f64 = 1e-3;

/// Length of the way of a move's tip, mm.
fn length(from: &Pose, to: &ExecutedMotion) -> f64 {
    let (from, end) = (from.position, to.target.position);
    let arc = match to.kind {
        ExecutedKind::Circular { via } => Arc::through(from, via, end),
        ExecutedKind::Joint | ExecutedKind::Linear => None,
    };
    arc.map_or_else(|| from.distance(end), |arc| arc.length())
}

impl Machine<'_> {
    /// Lets moves go as slowly as their tools may turn: a move takes the longer time of the two, as on the controller. A bead that turns in
    /// place is told where that lays metal which shows.
    pub(super) fn keep_turns(&mut self) {
        let at = self.at;
        let mut before: Option<Pose> = None;
        let mut executed = std::mem::take(&mut self.executed);
        for step in &mut executed {
            let Executed::Motion(m) = step else { continue };
            let from = before.replace(m.target);
            let (Some(from), Some(limit), ExecutedSpeed::Path(speed)) = (from, m.turns, m.speed)
            else {
                continue;
            };
            let angle = from
                .orientation
                .angle_between(m.target.orientation)
                .to_degrees();
            let (way, time) = (length(&from, m), angle / limit);
            if speed * time <= way.max(self.settings.unseen_way) {
                continue;
            }
            self.at = (m.program as usize, m.line.saturating_sub(1) as usize);
            if way > DIGIT {
                m.speed = ExecutedSpeed::Path(way / time);
                if m.arc.is_some() {
                    self.note("tool-turns-slowly", format!("{limit} °/s"));
                }
            } else if m.arc.is_some() {
                self.gap(Missing::WaitWithArc);
            }
        }
        self.executed = executed;
        self.at = at;
    }
}
