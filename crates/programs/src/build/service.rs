//! When a cell is served: its calls between beads, by beads and by time with the arc on.

use super::error::BuildError;
use crate::cell::CellProgramming;
use crate::upkeep::Service;

/// For each service of the cell: beads, and time with the arc on, s, since its last call.
#[derive(Debug)]
pub(super) struct Upkeep(Vec<(u32, f64)>);

impl Upkeep {
    /// # Errors
    /// [`BuildError::Service`] for a service that nobody says when to call.
    pub(super) fn new(cell: &CellProgramming) -> Result<Self, BuildError> {
        let never = |s: &&Service| s.beads.is_none() && s.arc_time.is_none();
        match cell.services.iter().find(never) {
            Some(service) => Err(BuildError::Service(service.call.value.clone())),
            None => Ok(Upkeep(vec![(0, 0.0); cell.services.len()])),
        }
    }

    /// The programs to call before the next bead.
    pub(super) fn due(&mut self, cell: &CellProgramming) -> Vec<String> {
        let mut calls = Vec::new();
        for (service, since) in cell.services.iter().zip(&mut self.0) {
            let beads = service.beads.is_some_and(|most| since.0 >= most);
            let time = service.arc_time.is_some_and(|most| since.1 >= most.0);
            if beads || time {
                *since = (0, 0.0);
                calls.push(service.call.value.clone());
            }
        }
        calls
    }

    /// Counts a bead of so much time with the arc on, s.
    pub(super) fn count(&mut self, time: f64) {
        for since in &mut self.0 {
            since.0 += 1;
            since.1 += time;
        }
    }
}
