//! Looks for a better path on the judge's solver: on its coarse cells, over the whole section, shape first.

use meltpath_base::{Observer, Quiet};
use meltpath_melt_strategy::bed::{Domain, Resolution};
use meltpath_melt_strategy::correction::Correction;
use meltpath_melt_strategy::error::StrategyError;
use meltpath_melt_strategy::learning::Freedom;
use meltpath_melt_strategy::prediction::{Reference, predict};
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::Class;
use rayon::prelude::*;

use super::search::{Found, Trial, prediction};
use super::{Optimise, TRIAL_ROUNDS};
use crate::ebm::error::EbmError;
use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::under::{body, ground};
use crate::ebm::judge::{of_all, windows};
use crate::ebm::plan::Plan;
use crate::ebm::rounds::{Aimed, Best, Round, Rounds, coarse};
use crate::ebm::settings::Judge;
use crate::job::ebm::{Change, OptimiseMethod};

/// Share of what places wish for that a round does: as `[correct]` has it, which heat that piles up does not make swing.
const GAIN: f64 = 0.6;
/// The same of a spot's diameter: the power on an area falls with its square.
const GAIN_OF_SPOTS: f64 = 0.3;

/// Candidates on one resolution.
struct Search<'a> {
    plan: &'a Plan,
    drawn: Plan,
    how: &'a Optimise,
    resolution: Resolution,
    window: [f64; 2],
}

/// A candidate that was drawn.
struct Tried {
    name: String,
    path: BeamPath,
    rounds: Vec<Round>,
    best: Best,
}

/// Looks for a better path on the coarse cells of the judge's solver. The path as given is drawn first: what comes back is never worse
/// there.
///
/// # Errors
/// [`EbmError`].
pub fn on_judge(
    plan: &Plan,
    judging: &Judge,
    how: &Optimise,
    observer: &dyn Observer,
) -> Result<Found, EbmError> {
    let drawn = at_gun::plan_as_drawn(plan)?;
    let resolution = coarse(&drawn, judging);
    let window = windows(&drawn, judging, &resolution, 1, &Quiet(observer))?[0].window;
    let search = Search {
        plan,
        drawn,
        how,
        resolution,
        window,
    };
    let candidates = how.candidates(&plan.path, &plan.others)?;
    for (_, path) in &candidates {
        how.lever(&plan.gun)?.check(path)?;
    }
    observer.stage(
        "look for a better path on the judge's solver",
        how.drawings(candidates.len()),
    );
    if candidates.len() == 1 && how.method == OptimiseMethod::Learning {
        let mut rounds = Vec::new();
        let ones = SpeedProfile::of(&plan.path, how.piece);
        let best = search.run(&plan.path, how.rounds, ones, &mut rounds, observer)?;
        return Ok(search.found(rounds, best, Vec::new()));
    }
    search.among(candidates, observer)
}

impl Search<'_> {
    /// Of several candidates, or of one that is drawn ahead, the best one goes on.
    fn among(
        &self,
        candidates: Vec<(String, BeamPath)>,
        observer: &dyn Observer,
    ) -> Result<Found, EbmError> {
        let count = if candidates.len() > 1 {
            TRIAL_ROUNDS
        } else {
            0
        };
        let tried = candidates.into_par_iter().map(|(name, path)| {
            let mut rounds = Vec::new();
            let ones = SpeedProfile::of(&path, self.how.piece);
            let best = self.run(&path, count, ones, &mut rounds, observer)?;
            Ok(Tried {
                name,
                path,
                rounds,
                best,
            })
        });
        let tried = tried.collect::<Result<Vec<_>, EbmError>>()?;
        let trials = match count {
            0 => Vec::new(),
            _ => tried.iter().map(Trial::of).collect(),
        };
        let mut rounds: Vec<Round> = tried.iter().take(1).map(|t| t.rounds[0].clone()).collect();
        let mut tried = tried.into_iter();
        let Some(first) = tried.next() else {
            return Err(EbmError::GoodBody);
        };
        let winner = tried.fold(first, |best, other| {
            let better = self.merit(other.told()) > self.merit(best.told());
            if better { other } else { best }
        });
        let profile = match self.how.method {
            OptimiseMethod::Predictive => self.predicted(&winner.path, observer)?,
            _ => winner.best.profile.clone(),
        };
        let mut best = self.run(
            &winner.path,
            self.how.rounds,
            profile,
            &mut rounds,
            observer,
        )?;
        let before = winner.told().clone();
        let beats = |round: &Round| self.merit(&before) > self.merit(round);
        if beats(&rounds[best.round]) && beats(&rounds[0]) {
            best = winner.best;
            best.round = rounds.len();
            rounds.push(before);
        }
        Ok(self.found(rounds, best, trials))
    }

    fn merit(&self, round: &Round) -> crate::ebm::rounds::Merit {
        round.merit(self.plan.settings.job.checks.outside.0)
    }

    /// What is handed back: the path as given, which is the first of `rounds`, unless the best one is better.
    fn found(&self, rounds: Vec<Round>, best: Best, trials: Vec<Trial>) -> Found {
        let better = self.merit(&rounds[best.round]) > self.merit(&rounds[0]);
        let bounds = self.how.bounds;
        Found {
            path: if better {
                best.path
            } else {
                self.plan.path.clone()
            },
            scores: rounds.iter().map(Round::in_window).collect(),
            trials,
            at_bounds: better.then(|| best.profile.share_at(bounds)),
            reference: None,
            kept: if better { best.round } else { 0 },
            rounds,
        }
    }

    fn run(
        &self,
        path: &BeamPath,
        count: u32,
        profile: SpeedProfile,
        told: &mut Vec<Round>,
        observer: &dyn Observer,
    ) -> Result<Best, EbmError> {
        let [least, greatest] = self.how.bounds;
        let rounds = Rounds {
            plan: &self.drawn,
            path,
            resolution: self.resolution,
            window: self.window,
            lever: self.how.lever(&self.plan.gun)?,
            correction: Correction {
                gain: match self.how.change {
                    Change::Focus => GAIN_OF_SPOTS,
                    Change::Speed | Change::Dwell | Change::Current => GAIN,
                },
                reach: self.how.piece,
                // a factor divides the power
                powers: [1.0 / greatest, 1.0 / least],
                freedom: self.how.freedom(),
            },
            robust: self.how.robust,
            outward: 0.0,
            aims: &[],
        };
        rounds.run(count, (profile, Aimed::default()), told, observer)
    }

    /// Factors that drawing ahead chooses, on even cells as large as the coarse ones, half a millimetre deep: a model of its own, whose
    /// path is scored like any other.
    fn predicted(
        &self,
        path: &BeamPath,
        observer: &dyn Observer,
    ) -> Result<SpeedProfile, EbmError> {
        let (plan, settings) = (self.plan, &self.plan.settings);
        let ground = ground(&plan.below);
        let resolution = Resolution {
            domain: Domain::NARROW,
            ..self.resolution
        };
        let bed = body(settings, &ground).bed(&[path], &plan.lower, &resolution, &Quiet(observer));
        let bed = bed.map_err(StrategyError::from)?;
        let mut engine = Reference {
            solver: bed.solver,
            beam: &bed.beam,
            step: bed.step,
        };
        let aim = 0.5 * (self.window[0] + self.window[1]);
        let how = prediction(plan, self.how, aim)?;
        let found = predict(
            &mut engine,
            &settings.material,
            path,
            &how,
            &Quiet(observer),
        )?;
        Ok(match self.how.freedom() {
            Freedom::Continuous => found,
            Freedom::PerLine => found.by_line(path),
        })
    }
}

impl Tried {
    /// Its best round.
    fn told(&self) -> &Round {
        &self.rounds[self.best.round]
    }
}

impl Trial {
    fn of(tried: &Tried) -> Self {
        let both = [&tried.rounds[0], tried.told()];
        Trial {
            name: tried.name.clone(),
            shares: both.map(|round| of_all(&round.tally, Class::Good)),
            outside: Some(both.map(Round::molten_outside)),
        }
    }
}
