//! The search for the smallest level, and the controller delivered a little above it, verified on its closed loop.

use super::assumptions;
use super::controller::{balancing_state, central};
use super::error::{Obstacle, SynthesisError};
use super::level::{Solved, attempt, direct_floor, relaxed};
use super::normalised::Normalised;
use super::plant::GeneralizedPlant;
use crate::norms::{Peak, peak_gain};
use crate::state_space::StateSpace;

/// How far to search and how far above the optimum to deliver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SynthesisOptions {
    /// Relative width to which the optimum is bracketed.
    pub tolerance: f64,
    /// Delivered level over the optimum: at the optimum itself the controller grows a spurious, very fast pole. Where rounding spoils
    /// the controller there, it is delivered a little higher; [`Synthesis::bound`] says where.
    pub margin: f64,
    /// Levels above this are not accepted.
    pub ceiling: f64,
}

impl Default for SynthesisOptions {
    fn default() -> Self {
        SynthesisOptions {
            tolerance: 1e-7,
            margin: 1.01,
            ceiling: 1e9,
        }
    }
}

/// A controller and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Synthesis {
    /// From measurements to commands.
    pub controller: StateSpace,
    /// The smallest level for which a controller exists (the upper end of its bracket).
    pub optimum: f64,
    /// The level the controller was computed for.
    pub bound: f64,
    /// The true largest gain of the closed loop, from disturbances to errors.
    pub peak: Peak,
    /// The closed loop itself.
    pub closed_loop: StateSpace,
    /// What makes lower levels impossible.
    pub limit: Option<Obstacle>,
    /// Levels tried.
    pub trials: usize,
}

/// Levels over the one asked for that are tried where rounding spoils its controller.
const WIDER: [f64; 5] = [1.02, 1.05, 1.1, 1.25, 1.5];

/// The best level of a plant, and a verified controller slightly above it.
///
/// # Errors
/// [`SynthesisError::Assumption`] names what the plant lacks; [`SynthesisError::Infeasible`] when no level up to the ceiling
/// is reached; [`SynthesisError::Unverified`] when rounding spoils the result.
pub fn synthesise(
    plant: &GeneralizedPlant,
    options: &SynthesisOptions,
) -> Result<Synthesis, SynthesisError> {
    let scaled = prepared(plant)?;
    let search = Search::run(&scaled, options)?;
    let level = options.margin * search.high.gamma;
    let mut found = deliver(plant, &scaled, level);
    for wider in WIDER {
        let Err(SynthesisError::Unverified { .. }) = found else {
            break;
        };
        // the first failure is what is told
        found = deliver(plant, &scaled, wider * level).or(found);
    }
    let mut out = found?;
    out.optimum = search.high.gamma;
    out.limit = Some(search.limit);
    out.trials = search.trials;
    Ok(out)
}

/// The scaled problem, its assumptions checked, in states that control and estimation weigh equally: companion forms of
/// stiff plants are hopeless otherwise. Twice, because the first solutions are themselves computed in the bad states.
fn prepared(plant: &GeneralizedPlant) -> Result<Normalised, SynthesisError> {
    let mut scaled = Normalised::new(plant)?;
    assumptions::check(&scaled)?;
    for _ in 0..2 {
        let better = relaxed(&scaled)
            .and_then(|solved| balancing_state(&scaled, &solved).ok())
            .and_then(|t| scaled.in_state(&t).ok());
        match better {
            Some(next) => scaled = next,
            None => break,
        }
    }
    Ok(scaled)
}

/// Computes the controller in the plain scaled state and, if its closed loop does not keep the bound, in the state balanced
/// between control and estimation.
fn deliver(
    plant: &GeneralizedPlant,
    scaled: &Normalised,
    gamma: f64,
) -> Result<Synthesis, SynthesisError> {
    let solved = match attempt(scaled, gamma)? {
        Ok(solved) => solved,
        Err((obstacle, _)) => return Err(SynthesisError::Infeasible { gamma, obstacle }),
    };
    let mut worst = f64::INFINITY;
    let mut state = scaled.clone();
    let mut known = solved;
    for round in 0..3 {
        if let Ok(done) = verified(plant, &state, &known) {
            if done.peak.gain <= gamma {
                return Ok(done);
            }
            worst = worst.min(done.peak.gain);
        }
        if round < 2 {
            state = state.in_state(&balancing_state(&state, &known)?)?;
            known = match attempt(&state, gamma)? {
                Ok(next) => next,
                Err(_) => break,
            };
        }
    }
    Err(SynthesisError::Unverified { gamma, peak: worst })
}

fn verified(
    plant: &GeneralizedPlant,
    scaled: &Normalised,
    solved: &Solved,
) -> Result<Synthesis, SynthesisError> {
    let controller = scaled.restored(central(scaled, solved)?)?;
    let closed_loop = plant.closed_by(&controller)?;
    let peak = peak_gain(&closed_loop, 1e-8)?;
    Ok(Synthesis {
        controller,
        optimum: solved.gamma,
        bound: solved.gamma,
        peak,
        closed_loop,
        limit: None,
        trials: 1,
    })
}

/// A bracket of the optimum.
struct Search {
    high: Solved,
    limit: Obstacle,
    trials: usize,
}

impl Search {
    fn run(p: &Normalised, options: &SynthesisOptions) -> Result<Self, SynthesisError> {
        const TRIALS: usize = 200;
        const STRIDE: f64 = 8.0;
        let floor = direct_floor(p)?;
        let mut trials = 0;
        let mut at = (2.0 * floor).max(1.0).min(options.ceiling);
        // upwards until a level is reached, then downwards until one is not
        let mut low: Option<(f64, Obstacle, Option<f64>)> = None;
        let mut high = loop {
            trials += 1;
            match attempt(p, at)? {
                Ok(solved) => break solved,
                Err((obstacle, _)) if at >= options.ceiling => {
                    return Err(SynthesisError::Infeasible {
                        gamma: at,
                        obstacle,
                    });
                }
                Err((obstacle, coupling)) => low = Some((at, obstacle, coupling)),
            }
            at = (at * STRIDE).min(options.ceiling);
        };
        let mut low = match low {
            Some(low) => low,
            None => loop {
                at = high.gamma / STRIDE;
                if at <= floor {
                    break (floor, Obstacle::DirectGain { floor }, None);
                }
                trials += 1;
                match attempt(p, at)? {
                    Ok(solved) => high = solved,
                    Err((obstacle, coupling)) => break (at, obstacle, coupling),
                }
                if high.gamma < 1e-12 {
                    break (0.0, Obstacle::DirectGain { floor: 0.0 }, None);
                }
            },
        };
        // ln of the coupling changes sign at the optimum when it is what limits; else plain bisection
        let mut shares = (low.2.map(f64::ln), high.coupling.ln());
        let mut last_side = 0;
        while high.gamma > low.0 * (1.0 + options.tolerance)
            && high.gamma > 1e-12
            && trials < TRIALS
        {
            let (x0, x1) = (low.0.max(high.gamma * 1e-3).ln(), high.gamma.ln());
            let middle = 0.5 * (x0 + x1);
            let guess = match shares.0 {
                Some(f0) if trials % 5 != 0 && shares.1.is_finite() => {
                    let x = x1 - shares.1 * (x1 - x0) / (shares.1 - f0);
                    // never closer to an end than a fraction of the tolerance, so that both ends close in
                    let step = (0.4 * options.tolerance).min(0.25 * (x1 - x0));
                    x.clamp(x0 + step, x1 - step)
                }
                _ => middle,
            };
            trials += 1;
            match attempt(p, guess.exp())? {
                Ok(solved) => {
                    shares.1 = solved.coupling.ln();
                    if last_side == 1 {
                        shares.0 = shares.0.map(|f| 0.5 * f);
                    }
                    last_side = 1;
                    high = solved;
                }
                Err((obstacle, coupling)) => {
                    low = (guess.exp(), obstacle, coupling);
                    shares.0 = coupling.map(f64::ln);
                    if last_side == -1 {
                        shares.1 *= 0.5;
                    }
                    last_side = -1;
                }
            }
        }
        Ok(Search {
            high,
            limit: low.1,
            trials,
        })
    }
}
