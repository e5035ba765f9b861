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
use rayon::prelude::*;

use super::Correct;
use crate::ebm::error::EbmError;
use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::areas::outside;
use crate::ebm::judge::edge::{DEVIATIONS, ceiling, widest};
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
    /// What its currents were corrected towards.
    pub aimed: Aimed,
    /// The points of the section.
    pub tally: Tally,
    /// What melts outside the contour.
    pub outside: Outside,
    /// The same with less and with more power, where the job asks for it.
    pub drifted: Option<[(Tally, Outside); 2]>,
}

/// What is aimed at beside the middle of the window and the rim of the job.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Aimed {
    /// Hotter than the middle, in widths of the window.
    pub hotter: f64,
    /// Further out than the rim, as a share of how far the beam's edge may lie beyond it.
    pub outward: f64,
}

/// Other aims, those first that gain most: a band along the contour is cold, and overheated metal is rare.
const AIMS: [Aimed; 4] = [
    Aimed {
        hotter: 0.0,
        outward: 0.5,
    },
    Aimed {
        hotter: 0.25,
        outward: 0.0,
    },
    Aimed {
        hotter: 0.25,
        outward: 0.5,
    },
    Aimed {
        hotter: -0.25,
        outward: 0.0,
    },
];

impl Round {
    fn all(&self) -> impl Iterator<Item = (&Tally, &Outside)> {
        let drifted = self.drifted.iter().flatten();
        std::iter::once((&self.tally, &self.outside)).chain(drifted.map(|(t, o)| (t, o)))
    }

    /// Least share of the section in the window, over the powers that were drawn.
    pub fn in_window(&self) -> f64 {
        let shares = self.all().map(|(tally, _)| of_all(tally, Class::Good));
        shares.fold(f64::INFINITY, f64::min)
    }

    /// Greatest area molten outside over the section's, over the powers that were drawn.
    pub fn molten_outside(&self) -> f64 {
        let shares = self.all().map(|(_, outside)| outside.share);
        shares.fold(0.0, f64::max)
    }

    /// What is wrong with it, as shares of the section: powder and metal below the window, metal above it, metal outside.
    pub fn faults(&self) -> [f64; 3] {
        let of = |class| of_all(&self.tally, class);
        [
            of(Class::Unmelted) + of(Class::Porous),
            of(Class::Overheated),
            self.outside.share,
        ]
    }

    /// By how much less and more power move the mean of what melts, K.
    pub fn moves(&self) -> Option<[f64; 2]> {
        let drifted = self.drifted.as_ref()?;
        Some([0, 1].map(|n| drifted[n].0.mean - self.tally.mean))
    }

    /// How good it is: shape first. Of rounds that keep to it the share in the window counts, of others what melts outside; with
    /// every power that was drawn, of equals with the power as set.
    fn merit(&self, most: f64) -> (bool, f64, f64) {
        let keeps = self.molten_outside() <= most;
        let merit = if keeps {
            self.in_window()
        } else {
            -self.molten_outside()
        };
        (keeps, merit, of_all(&self.tally, Class::Good))
    }
}

/// Which rounds no other on the same cells beats: none has less of one fault and no more of the others.
pub fn frontier(rounds: &[Round]) -> Vec<bool> {
    let beats = |a: &Round, b: &Round| {
        let both = || a.faults().into_iter().zip(b.faults());
        a.cell == b.cell && both().all(|(a, b)| a <= b) && both().any(|(a, b)| a < b)
    };
    let unbeaten = |round: &Round| !rounds.iter().any(|other| beats(other, round));
    rounds.iter().map(unbeaten).collect()
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
    /// Greatest share of the section that the edge of the beam lets into the window of the kept round.
    pub ceiling: Option<f64>,
}

/// What the rounds of one resolution go on with.
struct Stage<'a> {
    plan: &'a Plan,
    how: &'a Correct,
    path: &'a BeamPath,
    resolution: Resolution,
    window: [f64; 2],
    rim: Rim,
    /// How far beyond the rim the beam's edge may lie, mm.
    outward: f64,
    /// Other aims that are tried once.
    aims: &'a [Aimed],
}

/// The best so far: which round, its factors, its path and what it was corrected towards, and its highest temperatures.
struct Best {
    round: usize,
    profile: SpeedProfile,
    path: BeamPath,
    highest: Field,
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
    let aims = &AIMS[..(how.aims as usize).min(AIMS.len())];
    let stages = [(coarse, how.rounds[0], aims), (finest, how.rounds[1], &[])];
    let stages = stages.into_iter().filter(|(_, rounds, _)| *rounds > 0);
    let powers = how.robust.map_or(1, |_| 3);
    let counts = stages
        .clone()
        .map(|(_, rounds, aims)| u64::from(rounds) + 1 + aims.len() as u64);
    observer.stage("correct the current", powers * counts.sum::<u64>());
    let (mut profile, mut aimed) = (SpeedProfile::of(path, how.reach), Aimed::default());
    let mut found = Corrected {
        path: path.clone(),
        rounds: Vec::new(),
        kept: 0,
        ceiling: None,
    };
    for (resolution, rounds, aims) in stages {
        let window = windows(&drawn, judging, &resolution, 1, &Quiet(observer))?[0].window;
        let allowed = ceiling(plan, path, window);
        let stage = Stage {
            plan: &drawn,
            how,
            path,
            resolution,
            window,
            rim: Rim {
                melting: plan.settings.material.liquidus,
                beyond: plan.settings.job.checks.rim.0,
                width: widest(path) / DEVIATIONS,
            },
            outward: allowed.map_or(0.0, |ceiling| ceiling.outward),
            aims,
        };
        found.ceiling = allowed.map(|ceiling| ceiling.share);
        (profile, aimed) = stage.run(rounds, (profile, aimed), &mut found, observer)?;
    }
    Ok(found)
}

impl Stage<'_> {
    /// The factors of the best round, which `found` keeps, and what it was corrected towards.
    fn run(
        &self,
        rounds: u32,
        (mut profile, aimed): (SpeedProfile, Aimed),
        found: &mut Corrected,
        observer: &dyn Observer,
    ) -> Result<(SpeedProfile, Aimed), EbmError> {
        let mut best: Option<Best> = None;
        for round in 0..=rounds {
            let (drawn, path, highest) = self.drawn(&profile, aimed, observer)?;
            let next = (round < rounds)
                .then(|| self.towards(aimed, &highest, &profile))
                .transpose()?;
            self.keep(found, &mut best, drawn, (profile.clone(), path, highest));
            profile = next.unwrap_or(profile);
        }
        if let Some(from) = &best {
            let tried = |aimed: &Aimed| {
                let profile = self.towards(*aimed, &from.highest, &from.profile)?;
                let (round, path, highest) = self.drawn(&profile, *aimed, observer)?;
                Ok((round, (profile, path, highest)))
            };
            let tried = self.aims.par_iter().map(tried);
            for (round, made) in tried.collect::<Result<Vec<_>, EbmError>>()? {
                self.keep(found, &mut best, round, made);
            }
        }
        let Some(best) = best else {
            return Ok((profile, aimed));
        };
        found.kept = best.round;
        found.path = best.path;
        Ok((best.profile, found.rounds[best.round].aimed))
    }

    /// Adds a round, and remembers it where it is the best.
    fn keep(
        &self,
        found: &mut Corrected,
        best: &mut Option<Best>,
        round: Round,
        (profile, path, highest): (SpeedProfile, BeamPath, Field),
    ) {
        let most = self.plan.settings.job.checks.outside.0;
        let merit = round.merit(most);
        let kept = best
            .as_ref()
            .map(|best| found.rounds[best.round].merit(most));
        found.rounds.push(round);
        if kept.is_none_or(|kept| merit > kept) {
            *best = Some(Best {
                round: found.rounds.len() - 1,
                profile,
                path,
                highest,
            });
        }
    }

    /// The factors after one correction towards `aimed`.
    fn towards(
        &self,
        aimed: Aimed,
        highest: &Field,
        profile: &SpeedProfile,
    ) -> Result<SpeedProfile, EbmError> {
        let [low, high] = self.window;
        let rim = Rim {
            beyond: self.rim.beyond + aimed.outward * self.outward,
            ..self.rim
        };
        let wanted = 0.5 * (low + high) + aimed.hotter * (high - low);
        let aim = Aim::new(self.plan.settings.material.start, wanted, rim)?;
        let how = Correction {
            gain: self.how.gain,
            reach: self.how.reach,
            powers: self.how.currents,
            freedom: self.how.freedom,
        };
        let depth = |p: [f64; 2]| self.plan.contour.depth(p);
        Ok(Wishes::of(highest, &aim, &depth).corrected(profile, self.path, &how))
    }

    /// A path with these factors, what it makes of the section, and its highest temperatures with the power as set.
    fn drawn(
        &self,
        profile: &SpeedProfile,
        aimed: Aimed,
        observer: &dyn Observer,
    ) -> Result<(Round, BeamPath, Field), EbmError> {
        let path = Lever::Power.apply(profile, self.path)?;
        let as_drawn = at_gun::drawn(self.plan, &path)?;
        let drift = self.how.robust;
        let powers: Vec<f64> = std::iter::once(1.0)
            .chain(drift.into_iter().flat_map(|d| [1.0 - d, 1.0 + d]))
            .collect();
        let fields = powers
            .par_iter()
            .map(|power| self.highest(&as_drawn, *power, observer));
        let mut fields = fields.collect::<Result<Vec<_>, _>>()?.into_iter();
        let Some(highest) = fields.next() else {
            return Err(EbmError::GoodBody);
        };
        let (tally, outside) = self.told(&highest);
        let drifted = fields.next().zip(fields.next());
        let round = Round {
            cell: self.resolution.cell,
            window: self.window,
            aimed,
            tally,
            outside,
            drifted: drifted.map(|(less, more)| [self.told(&less), self.told(&more)]),
        };
        Ok((round, path, highest))
    }

    /// Highest temperatures of a path, as the gun draws it, with so many times its power.
    fn highest(
        &self,
        path: &BeamPath,
        power: f64,
        observer: &dyn Observer,
    ) -> Result<Field, EbmError> {
        let ground = ground(&self.plan.below);
        let body = body(&self.plan.settings, &ground);
        let resolution = Resolution {
            power: power * self.resolution.power,
            ..self.resolution
        };
        let drawn = judge(&body, &self.plan.lower, path, &resolution, &Quiet(observer))?;
        observer.advance(1);
        Ok(drawn.highest)
    }

    /// What highest temperatures make of the section and of what lies beside it.
    fn told(&self, highest: &Field) -> (Tally, Outside) {
        let melting = self.rim.melting;
        let classes = Classes {
            melting,
            window: self.window,
        };
        let contour = &self.plan.contour;
        let area = contour.region().area();
        (
            tally(highest, &classes, contour, 0.0, None),
            outside(highest, melting, contour, self.rim.beyond, None, area),
        )
    }
}
