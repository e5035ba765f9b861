//! Draws a beam path with the reference solver and shows its state to whoever listens.

use meltpath_base::Observer;

use crate::beam::{Beam, BeamPath};
use crate::numeric::real::Real;
use crate::solver::source::Spot;
use crate::solver::{Solver, SolverError};

/// Looks at the solver while it runs.
pub trait Sink<R: Real> {
    /// Time between two looks, s.
    fn interval(&self) -> f64;
    /// Called after the step that passes each interval, and at the end of the path.
    fn look(&mut self, solver: &Solver<R>);
}

/// Draws `path` with explicit steps of at most `step` seconds, each with the beam where it is midway, or midway of each stretch
/// where it jumps or is switched within the step; `sinks` look on.
///
/// # Errors
/// [`SolverError`]: a step that is not stable, a path outside the domain, cancellation.
pub fn draw<R: Real>(
    solver: &mut Solver<R>,
    path: &BeamPath,
    beam: &Beam,
    step: f64,
    sinks: &mut [&mut dyn Sink<R>],
    observer: &dyn Observer,
) -> Result<(), SolverError> {
    let duration = path.end() - path.begin();
    let steps = (duration / step * (1.0 - 1e-12)).ceil().max(0.0) as u64;
    let dt = duration / steps.max(1) as f64;
    let mut spots: Vec<Spot> = Vec::new();
    let mut next: Vec<f64> = sinks.iter().map(|s| s.interval()).collect();
    observer.stage("draw the beam path", steps);
    for n in 0..steps {
        if n % 64 == 0 {
            observer.check()?;
            observer.advance(if n == 0 { 0 } else { 64 });
        }
        // a jump or a switching within the step shares it out, so that every spot and line gets its own energy
        let from = path.begin() + n as f64 * dt;
        spots.clear();
        for (share, point) in path.stretches(from, from + dt) {
            let spot = beam.spot(&point);
            spots.push(Spot {
                power: share * spot.power,
                ..spot
            });
        }
        solver.step(dt, &spots)?;
        let elapsed = (n + 1) as f64 * dt;
        for (sink, due) in sinks.iter_mut().zip(&mut next) {
            if elapsed >= *due - 0.5 * dt || n + 1 == steps {
                sink.look(solver);
                *due += sink.interval();
            }
        }
    }
    Ok(())
}
