//! Draws a path again and again on the judge's solver, on coarse cells first, and corrects its currents in between.

use meltpath_base::{Observer, Quiet};
use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::correction::{Aim, Correction, Rim, Wishes};
use meltpath_melt_strategy::judgement::judge;
use meltpath_melt_strategy::lever::Lever;
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::criteria::{Class, Classes, Tally};
use meltpath_thermal::grid::Field;

use super::Correct;
use crate::ebm::error::EbmError;
use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::areas::outside;
use crate::ebm::judge::under::{body, domain, ground};
use crate::ebm::judge::{Outside, of_all, tally, windows};
use crate::ebm::plan::Plan;
use crate::ebm::settings::Judge;

/// What a path of one round makes of the section.
#[derive(Debug, Clone)]
pub struct Round {
    /// Edge of the finest cells, mm.
    pub cell: f64,
    /// The window there, K.
    pub window: [f64; 2],
    /// The points of the section.
    pub tally: Tally,
    /// What melts outside the contour.
    pub outside: Outside,
}

/// A path with corrected currents.
#[derive(Debug, Clone)]
pub struct Corrected {
    /// The path.
    pub path: BeamPath,
    /// Every round, the first as the path was.
    pub rounds: Vec<Round>,
    /// Which one is kept.
    pub kept: usize,
}

/// Spots are four standard deviations wide.
const DEVIATIONS: f64 = 4.0;

/// What the rounds of one resolution go on with.
struct Stage<'a> {
    plan: &'a Plan,
    how: &'a Correct,
    path: &'a BeamPath,
    resolution: Resolution,
    window: [f64; 2],
    aim: Aim,
}

/// Corrects the currents of `path`, which no gun has drawn yet; a round draws what the job's gun makes of it.
///
/// # Errors
/// [`EbmError`]: a window that does not lie above melting, what the solver refuses, cancellation.
pub fn corrected(
    plan: &Plan,
    judging: &Judge,
    how: &Correct,
    path: &BeamPath,
    observer: &dyn Observer,
) -> Result<Corrected, EbmError> {
    let drawn = at_gun::plan_as_drawn(plan)?;
    let finest = Resolution {
        domain: domain(&drawn, judging),
        ..judging.resolution
    };
    let coarse = Resolution {
        cell: 2.0 * finest.cell,
        ..finest
    };
    let stages = [(coarse, how.rounds[0]), (finest, how.rounds[1])];
    let stages = stages.into_iter().filter(|(_, rounds)| *rounds > 0);
    let total: u32 = stages.clone().map(|(_, rounds)| rounds + 1).sum();
    observer.stage("correct the current", u64::from(total));
    let mut profile = SpeedProfile::of(path, how.reach);
    let mut found = Corrected {
        path: path.clone(),
        rounds: Vec::new(),
        kept: 0,
    };
    for (resolution, rounds) in stages {
        let window = windows(&drawn, judging, &resolution, 1, &Quiet(observer))?[0].window;
        let spots = path.points().iter().filter(|p| p.is_on());
        let spot = spots.map(|p| p.spot).fold(0.0, f64::max);
        let material = &plan.settings.material;
        let rim = Rim {
            melting: material.liquidus,
            beyond: plan.settings.job.checks.rim.0,
            width: spot / DEVIATIONS,
        };
        let stage = Stage {
            plan: &drawn,
            how,
            path,
            resolution,
            window,
            aim: Aim::new(material.start, 0.5 * (window[0] + window[1]), rim)?,
        };
        profile = stage.run(rounds, profile, &mut found, observer)?;
    }
    Ok(found)
}

impl Stage<'_> {
    /// The factors of the best round, which `found` keeps.
    fn run(
        &self,
        rounds: u32,
        mut profile: SpeedProfile,
        found: &mut Corrected,
        observer: &dyn Observer,
    ) -> Result<SpeedProfile, EbmError> {
        let how = Correction {
            gain: self.how.gain,
            reach: self.how.reach,
            powers: self.how.currents,
            freedom: self.how.freedom,
        };
        let contour = &self.plan.contour;
        let depth = |p: [f64; 2]| contour.depth(p);
        let mut best: Option<(usize, SpeedProfile, BeamPath)> = None;
        for round in 0..=rounds {
            let path = Lever::Power.apply(&profile, self.path)?;
            let highest = self.drawn(&path, observer)?;
            observer.advance(1);
            found.rounds.push(self.round(&highest));
            let here = found.rounds.len() - 1;
            let next = (round < rounds).then(|| {
                Wishes::of(&highest, &self.aim, &depth).corrected(&profile, self.path, &how)
            });
            let better = |(kept, _, _): &(usize, SpeedProfile, BeamPath)| {
                self.merit(&found.rounds[here]) > self.merit(&found.rounds[*kept])
            };
            if best.as_ref().is_none_or(better) {
                best = Some((here, profile.clone(), path));
            }
            profile = next.unwrap_or(profile);
        }
        if let Some((kept, of_best, path)) = best {
            found.kept = kept;
            found.path = path;
            profile = of_best;
        }
        Ok(profile)
    }

    /// Highest temperatures of a path as the gun draws it.
    fn drawn(&self, path: &BeamPath, observer: &dyn Observer) -> Result<Field, EbmError> {
        let settings = &self.plan.settings;
        let ground = ground(&self.plan.below);
        let path = at_gun::drawn(self.plan, path)?;
        let lower = &self.plan.lower;
        let body = body(settings, &ground);
        Ok(judge(&body, lower, &path, &self.resolution, &Quiet(observer))?.highest)
    }

    fn round(&self, highest: &Field) -> Round {
        let (melting, window) = (self.plan.settings.material.liquidus, self.window);
        let classes = Classes { melting, window };
        let contour = &self.plan.contour;
        let tally = tally(highest, &classes, contour, 0.0, None);
        let rim = self.plan.settings.job.checks.rim.0;
        Round {
            cell: self.resolution.cell,
            window,
            outside: outside(
                highest,
                melting,
                contour,
                rim,
                None,
                contour.region().area(),
            ),
            tally,
        }
    }

    /// How good a round is: shape first. Of rounds that keep to it the share in the window counts, of others what melts outside.
    fn merit(&self, round: &Round) -> (bool, f64) {
        let keeps = round.outside.share <= self.plan.settings.job.checks.outside.0;
        let merit = if keeps {
            of_all(&round.tally, Class::Good)
        } else {
            -round.outside.share
        };
        (keeps, merit)
    }
}
