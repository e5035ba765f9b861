//! The moving window of the reference solver: rows of cells that are as cold as at the start sleep, so that a long path costs
//! only where it is hot.
//!
//! A row along x sleeps in all planes at once while none of its cells, nor of the rows beside it, differs from the start
//! temperature by more than a tolerance and no beam is near. Nothing flows between sleeping and waking rows: heat is kept to
//! the last joule, and what is neglected is conduction at places that differ by less than the tolerance. Paths should run
//! along x, or far along y: the judge of paths turns them.

use std::ops::Range;

use crate::numeric::real::Real;
use crate::solver::source::Spot;
use crate::solver::{Sleep, Solver};

/// Steps between two looks at which rows are needed.
const LOOK: u32 = 16;
/// Rows kept awake beside warm ones and beside a beam: more than heat or beam cross between two looks.
const BUFFER: usize = 3;
/// How far from its centre a beam wakes rows, in diameters: its intensity has fallen to 3e-4 there.
const NEAR: f64 = 1.0;

impl<R: Real> Solver<R> {
    /// From here on rows sleep that are within `tolerance` K of the start temperature.
    pub fn let_rows_sleep(&mut self, tolerance: f64) {
        let start = self.material.start;
        let cold = self.curve.of(start + tolerance);
        self.sleep = Some(Sleep { cold, since: LOOK });
    }

    /// Updates of cells so far.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// All rows are awake.
    pub(crate) fn wake_all(&mut self) {
        self.block.awake = std::iter::once(0..self.grid.cells[1]).collect();
        if let Some(sleep) = &mut self.sleep {
            sleep.since = LOOK;
        }
    }

    /// Decides which rows this step needs.
    pub(crate) fn look_for_rows(&mut self, spots: &[Spot]) {
        let Some(mut sleep) = self.sleep else {
            return;
        };
        let ny = self.grid.cells[1];
        let row = |y: f64| {
            let j = (y - self.grid.origin.y) / self.grid.edge[1];
            (j.max(0.0) as usize).min(ny - 1)
        };
        let beams: Vec<Range<usize>> = spots
            .iter()
            .filter(|s| s.power > 0.0)
            .map(|s| {
                let reach = NEAR * s.diameter;
                row(s.centre[1] - reach)..row(s.centre[1] + reach) + 1
            })
            .collect();
        let awake = &self.block.awake;
        let covered = |r: &Range<usize>| awake.iter().any(|a| a.start <= r.start && a.end >= r.end);
        sleep.since += 1;
        if sleep.since < LOOK && beams.iter().all(covered) {
            self.sleep = Some(sleep);
            return;
        }
        sleep.since = 0;
        let cold = R::of(sleep.cold);
        let mut needed = vec![false; ny];
        let mut keep = |r: Range<usize>| {
            needed[r.start.saturating_sub(BUFFER)..(r.end + BUFFER).min(ny)].fill(true);
        };
        // sleeping rows next to a beam take what little of it reaches so far
        let mut seen = vec![false; ny];
        for r in awake.iter().chain(&beams) {
            let beside = r.len();
            seen[r.start.saturating_sub(beside)..(r.end + beside).min(ny)].fill(true);
        }
        for j in (0..ny).filter(|j| seen[*j]) {
            if self.block.row_differs(j, cold) {
                keep(j..j + 1);
            }
        }
        for r in beams {
            keep(r);
        }
        self.block.awake = joined(&needed);
        self.sleep = Some(sleep);
    }
}

/// Runs of needed rows; runs with fewer than two rows between them are one, since each sees its own face there.
fn joined(needed: &[bool]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for j in (0..needed.len()).filter(|j| needed[*j]) {
        match runs.last_mut() {
            Some(run) if j < run.end + 2 => run.end = j + 1,
            _ => runs.push(j..j + 1),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_keep_two_rows_apart() {
        let of = |text: &str| joined(&text.chars().map(|c| c == 'x').collect::<Vec<_>>());
        assert_eq!(of(".xx..x.x."), vec![1..3, 5..8]);
        assert_eq!(of("x.x"), vec![0..3]);
        assert!(of("...").is_empty());
    }
}
