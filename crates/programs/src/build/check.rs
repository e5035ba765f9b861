//! What a pass must be to become a part of a program.

use meltpath_toolpath::{Channel, Move, Pass};

use super::{BuildError, Builder, Schedule};
use crate::program::Dialect;

impl Builder<'_> {
    pub(super) fn check(&self, pass: &Pass<'_>) -> Result<(), BuildError> {
        let fail = |what, value, wanted| {
            Err(BuildError::Pass {
                pass: pass.place(),
                what,
                value,
                wanted,
            })
        };
        let via = pass.moves().filter_map(|m| match m {
            Move::Arc { via } => Some(via),
            Move::Line | Move::Spot { .. } => None,
        });
        let axes = (0..pass.points.len()).filter_map(|i| pass.axis(i));
        let mut all = pass.points.iter().copied().chain(axes).chain(via);
        if let Some(bad) = all.find(|p| !p.is_finite()) {
            return fail("a point", bad.length(), "finite");
        }
        if let Some(coordination) = &self.coordination {
            let count = coordination.count();
            let said = |i: usize| pass.external(i).flatten().count();
            if let Some(other) = (0..pass.points.len()).map(said).find(|n| *n != count) {
                return fail(
                    "the number of external axes that a point says",
                    other as f64,
                    "that of the cell's track and positioner (program.track, program.positioner.axis)",
                );
            }
            let mut external = (0..pass.points.len()).flat_map(|i| pass.external(i).flatten());
            if let Some(value) = external.find(|v| !v.is_finite()) {
                return fail("an external axis", value, "finite");
            }
        }
        self.check_weaves(pass)?;
        let Some(profile) = self.toolpath.profiles.get(usize::from(pass.head.profile)) else {
            let index = f64::from(pass.head.profile);
            return fail("its profile", index, "one of the toolpath's");
        };
        for i in 0..pass.move_count() {
            let speed = pass.value(Channel::Speed, i).unwrap_or(profile.speed);
            // the slowest that can be written
            let slowest = 0.1_f64.powi(self.cell.speed_decimals.cast_signed()) * 10.0 / 60.0;
            if !(speed.is_finite() && speed >= slowest) {
                return fail(
                    "the speed",
                    speed,
                    "finite and not too slow to write (mm/s)",
                );
            }
            let feed = pass.value(Channel::WireFeed, i);
            let feed = feed.unwrap_or(profile.wire_feed);
            if pass.head.role.deposits() && !(feed > 0.0 && feed.is_finite()) {
                return fail("the wire feed", feed, "positive and finite (mm/s)");
            }
        }
        Ok(())
    }

    /// Refuses a pass that needs more schedules than the cell has.
    pub(super) fn count_schedules(&mut self, pass: &Pass<'_>) -> Result<(), BuildError> {
        if !pass.head.role.deposits() {
            return Ok(());
        }
        for i in 0..pass.move_count() {
            let wire_feed = self.feed(pass, i);
            if self.needed.iter().any(|s| s.wire_feed == wire_feed) {
                continue;
            }
            let taken = |n: u32| self.needed.iter().any(|s| s.number == n);
            let number = self.wording.number(wire_feed, taken);
            let number = number.ok_or_else(|| match self.settings.dialect {
                Dialect::FanucLs => BuildError::Schedules {
                    available: *self.cell.arc.schedules,
                    pass: pass.place(),
                },
                _ => BuildError::NoSchedule {
                    wire_feed,
                    known: self.cell.schedules.iter().map(|s| s.wire_feed.0).collect(),
                    pass: pass.place(),
                },
            })?;
            self.needed.push(Schedule { number, wire_feed });
        }
        Ok(())
    }
}
