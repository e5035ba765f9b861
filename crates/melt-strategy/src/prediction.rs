//! Predictive control: before each piece of the path is drawn, the model draws it ahead a few times, and the factor is taken
//! at which the metal near the beam will be as hot as wanted.
//!
//! Beyond the thesis, a perspective of its section 3.4. The model is the engine itself, charts or reference solver.

use meltpath_base::{Observer, Quiet};

use crate::error::StrategyError;
use crate::lever::Lever;
use crate::speed::SpeedProfile;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::charts::simulation::ChartSimulation;
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::Solver;
use meltpath_thermal::solver::run::draw;

/// What can be drawn ahead from where it stands.
pub trait Engine: Clone {
    /// Goes on by a piece of a path.
    ///
    /// # Errors
    /// [`StrategyError`].
    fn go_on(&mut self, piece: &BeamPath, observer: &dyn Observer) -> Result<(), StrategyError>;

    /// The hottest temperature now, K.
    fn hottest(&self) -> f64;
}

impl Engine for ChartSimulation {
    fn go_on(&mut self, piece: &BeamPath, observer: &dyn Observer) -> Result<(), StrategyError> {
        Ok(self.draw(piece, &[], &mut |_, _| (), observer)?)
    }

    fn hottest(&self) -> f64 {
        self.hottest_under_beam()
    }
}

/// The reference solver with its beam and longest step.
#[derive(Debug, Clone)]
pub struct Reference<'a> {
    /// The solver.
    pub solver: Solver<f32>,
    /// The beam.
    pub beam: &'a Beam,
    /// Longest explicit step, s.
    pub step: f64,
}

impl Engine for Reference<'_> {
    fn go_on(&mut self, piece: &BeamPath, observer: &dyn Observer) -> Result<(), StrategyError> {
        Ok(draw(
            &mut self.solver,
            piece,
            self.beam,
            self.step,
            &mut [],
            observer,
        )?)
    }

    fn hottest(&self) -> f64 {
        self.solver.hottest()
    }
}

/// How far ahead is looked, and what for.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Temperature wanted near the beam, K.
    pub aim: f64,
    /// Least and greatest factor.
    pub bounds: [f64; 2],
    /// Length of the pieces of one factor, mm.
    pub length: f64,
    /// How long after the end of a piece its effect is looked at, s of the path's own time: the pool answers that late.
    pub ahead: f64,
    /// What the factors change.
    pub lever: Lever,
    /// The only factors that may be used; any where there are none.
    pub levels: Vec<f64>,
}

/// Draws `path` with `engine` piece by piece, each with the factor that is predicted to meet the aim: the factor before it and
/// a second one are drawn ahead, the third comes from the line through both. `engine` ends where the path ends.
///
/// # Errors
/// [`StrategyError`], cancellation included.
pub fn predict<E: Engine>(
    engine: &mut E,
    material: &Material,
    path: &BeamPath,
    prediction: &Prediction,
    observer: &dyn Observer,
) -> Result<SpeedProfile, StrategyError> {
    if prediction.aim <= material.liquidus {
        return Err(StrategyError::Aim {
            celsius: prediction.aim - CELSIUS,
        });
    }
    prediction.lever.check(path)?;
    let mut profile = SpeedProfile::of(path, prediction.length);
    let intervals: Vec<(f64, f64, f64)> = profile.intervals().collect();
    observer.stage("draw ahead", intervals.len() as u64);
    let [low, high] = prediction.bounds;
    let changed = |from: f64, to: f64, factor: f64| {
        let piece = path.between(from, to);
        let constant = SpeedProfile::from_parts(vec![piece.begin(), piece.end()], vec![factor]);
        let constant = constant.snapped(&prediction.levels);
        prediction.lever.apply(&constant, &piece)
    };
    let mut last = 1.0_f64.clamp(low, high);
    for (n, &(from, to, _)) in intervals.iter().enumerate() {
        let quiet = Quiet(observer);
        if !prediction.lever.acts(path, from, to) {
            engine.go_on(&path.between(from, to), &quiet)?;
            observer.advance(1);
            continue;
        }
        // under a beam at rest it is hottest at the end, and what follows lies elsewhere
        let ahead_of = if path.rests_over(from, to) {
            0.0
        } else {
            prediction.ahead
        };
        let excess = |factor: f64| -> Result<f64, StrategyError> {
            let mut ahead = engine.clone();
            ahead.go_on(&changed(from, to + ahead_of, factor)?, &quiet)?;
            Ok((ahead.hottest() - prediction.aim) / (prediction.aim - material.start))
        };
        let first = excess(last)?;
        let second = (last * (1.0 + first).max(0.5)).clamp(low, high);
        let mut factor = second;
        if (second / last - 1.0).abs() > 1e-3 {
            let found = excess(second)?;
            let slope = (found - first) / (second / last).ln();
            // more factor, less heat: anything else is noise, and the guess is kept
            if slope < -1e-3 {
                // a step of at most a third, so that one prediction cannot upset the next
                let step = (-found / slope).clamp(-0.3, 0.3);
                factor = (second * step.exp()).clamp(low, high);
            }
        }
        engine.go_on(&changed(from, to, factor)?, &quiet)?;
        profile.factors_mut()[n] = factor;
        last = factor;
        observer.advance(1);
    }
    Ok(profile.snapped(&prediction.levels))
}
