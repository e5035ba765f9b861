//! What the robot holds along moves: positions with the torch on the robot and those with the part on it lie in frames of which it is not known here
//! how they lie to each other.

use super::{Executed, ExecutedMotion, Machine, Missing};
use crate::held::Holds;
use crate::program::Dialect;

impl Machine<'_> {
    /// What the lines of its program say that the robot holds along the move that is executed.
    pub(super) fn holds_here(&self) -> Option<Holds> {
        let (program, at) = self.at;
        let said = self.said_holds.get(program)?;
        let before = said.partition_point(|(from, _)| *from < at);
        let last = before.checked_sub(1).and_then(|i| said.get(i))?;
        Some(last.1)
    }

    /// What the robot holds along the move that is executed, as its program was read.
    pub(super) fn held_here(&mut self) -> Option<Holds> {
        let program = self.at.0;
        let own = self.holds_here();
        if self.programs[program].dialect != Dialect::Krl {
            return own;
        }
        // it is the usual way, and what is set holds for the programs that follow
        let read_as = own.unwrap_or(Holds::Torch);
        if self.holds.unwrap_or(Holds::Torch) != read_as {
            self.gap(Missing::HoldsUnsaid(read_as));
        }
        Some(read_as)
    }

    /// Leaves out moves along which the robot holds something else than along the first bead: they lead through other frames. Tells beads
    /// among them, and those that no controller lays.
    pub(super) fn leave_out_held_otherwise(&mut self) {
        let burns = |m: &ExecutedMotion| m.arc.is_some();
        let moves = |step: &Executed| match step {
            Executed::Motion(m) => Some((m.holds, burns(m), (m.program as usize, m.line as usize))),
            Executed::Wait { .. } => None,
        };
        let all: Vec<_> = self.executed.iter().filter_map(moves).collect();
        let Some(beads) = all.iter().find_map(|(h, burns, _)| h.filter(|_| *burns)) else {
            return;
        };
        let mut next = all.iter().skip(1);
        for (holds, burns, (program, line)) in &all {
            let lays_next = next.next().is_some_and(|(_, burns, _)| *burns);
            let Some(here) = *holds else { continue };
            self.at = (*program, line.saturating_sub(1));
            if !here.is_sound() && *burns {
                self.gap(Missing::Holds(here));
            } else if here != beads && (*burns || lays_next) {
                self.gap(Missing::HeldOtherwise { here, beads });
            } else if here != beads {
                self.note("held-otherwise", here.to_string());
                self.leaves_out(Missing::HeldOtherwise { here, beads });
            }
        }
        self.executed.retain(
            |step| !matches!(step, Executed::Motion(m) if m.holds.is_some_and(|h| h != beads)),
        );
    }
}
