//! A path drawn again and again on the judge's solver and corrected in between: what a round makes of the section, which round is
//! the best, how the next one follows from it. `[correct]` and `[optimise]` both go through here.

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

use crate::ebm::error::EbmError;
use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::areas::outside;
use crate::ebm::judge::edge::{DEVIATIONS, widest};
use crate::ebm::judge::fused::unfused;
use crate::ebm::judge::under::{body, domain, ground};
use crate::ebm::judge::{Outside, of_all, tally};
use crate::ebm::plan::Plan;
use crate::ebm::settings::Judge;

/// What a path of one round makes of the section.
#[derive(Debug, Clone)]
pub struct Round {
    /// Edge of the finest cells, mm.
    pub cell: f64,
    /// The window there, K.
    pub window: [f64; 2],
    /// What the path was corrected towards.
    pub aimed: Aimed,
    /// The points of the section.
    pub tally: Tally,
    /// What melts outside the contour.
    pub outside: Outside,
    /// Share of what lies over metal that does not melt down to it; `None` where no metal lies below.
    pub unfused: Option<f64>,
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

/// How good a path is, shape first: whether it keeps to the shape, then the share in the window, or less what melts outside; of equals
/// the share with the power as set.
pub type Merit = (bool, f64, f64);

/// Of a path by its least share in the window, what melts outside at most, and the share with the power as set; `most` may melt outside.
pub fn merit([least, molten_outside, as_set]: [f64; 3], most: f64) -> Merit {
    let keeps = molten_outside <= most;
    let merit = if keeps { least } else { -molten_outside };
    (keeps, merit, as_set)
}

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

    /// What is wrong with it, as shares of the section: powder and metal below the window, metal above it, metal outside, what is
    /// not fused to the layer below, none where that is not known.
    pub fn faults(&self) -> [f64; 4] {
        let of = |class| of_all(&self.tally, class);
        [
            of(Class::Unmelted) + of(Class::Porous),
            of(Class::Overheated),
            self.outside.share,
            self.unfused.unwrap_or(0.0),
        ]
    }

    /// By how much less and more power move the mean of what melts, K.
    pub fn moves(&self) -> Option<[f64; 2]> {
        let drifted = self.drifted.as_ref()?;
        Some([0, 1].map(|n| drifted[n].0.mean - self.tally.mean))
    }

    /// How good it is, with every power that was drawn, where `most` may melt outside.
    pub fn merit(&self, most: f64) -> Merit {
        let as_set = of_all(&self.tally, Class::Good);
        merit([self.in_window(), self.molten_outside(), as_set], most)
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

/// The judge's resolution with cells twice as large: what most rounds are drawn on, at a sixth of the cost.
pub(in crate::ebm) fn coarse(drawn: &Plan, judging: &Judge) -> Resolution {
    Resolution {
        domain: domain(drawn, judging),
        cell: 2.0 * judging.resolution.cell,
        ..judging.resolution
    }
}

/// What rounds of one resolution change and draw.
pub(in crate::ebm) struct Rounds<'a> {
    /// The plan as the gun draws it.
    pub(in crate::ebm) plan: &'a Plan,
    /// The path, which no gun has drawn yet.
    pub(in crate::ebm) path: &'a BeamPath,
    pub(in crate::ebm) resolution: Resolution,
    /// The window on it, K.
    pub(in crate::ebm) window: [f64; 2],
    /// What is changed along the path.
    pub(in crate::ebm) lever: Lever,
    /// How much at once, and how often.
    pub(in crate::ebm) correction: Correction,
    /// Drift of the power, a share, over which paths are worth the least that they do.
    pub(in crate::ebm) robust: Option<f64>,
    /// How far beyond the rim the beam's edge may lie, mm.
    pub(in crate::ebm) outward: f64,
    /// Other aims that are tried once, from the best round.
    pub(in crate::ebm) aims: &'a [Aimed],
}

/// The best of some rounds.
pub(in crate::ebm) struct Best {
    /// Which one.
    pub(in crate::ebm) round: usize,
    /// Its factors.
    pub(in crate::ebm) profile: SpeedProfile,
    /// Its path.
    pub(in crate::ebm) path: BeamPath,
    highest: Field,
}

impl Rounds<'_> {
    /// Draws the path with `profile`, which was corrected towards `aimed`, and corrects it `count` times; then the other aims. Every round
    /// goes to the end of `told`.
    ///
    /// # Errors
    /// [`EbmError`]: a window that does not lie above melting, what the solver refuses, cancellation.
    pub(in crate::ebm) fn run(
        &self,
        count: u32,
        (profile, aimed): (SpeedProfile, Aimed),
        told: &mut Vec<Round>,
        observer: &dyn Observer,
    ) -> Result<Best, EbmError> {
        let towards = |aimed: Aimed, from: &Best| {
            let profile = self.towards(aimed, &from.highest, &from.profile)?;
            self.drawn(profile, aimed, observer)
        };
        let (round, mut last) = self.drawn(profile, aimed, observer)?;
        last.round = told.len();
        told.push(round);
        let mut best = None;
        for _ in 0..count {
            let next = towards(aimed, &last)?;
            let before = std::mem::replace(&mut last, next.1);
            keep(told, &mut best, before, self.most());
            last.round = told.len();
            told.push(next.0);
        }
        keep(told, &mut best, last, self.most());
        let Some(mut best) = best else {
            return Err(EbmError::GoodBody);
        };
        let tried = self.aims.par_iter().map(|aimed| towards(*aimed, &best));
        let tried = tried.collect::<Result<Vec<_>, EbmError>>()?;
        for (round, mut drawn) in tried {
            drawn.round = told.len();
            told.push(round);
            if told[drawn.round].merit(self.most()) > told[best.round].merit(self.most()) {
                best = drawn;
            }
        }
        Ok(best)
    }

    /// How much may melt outside.
    fn most(&self) -> f64 {
        self.plan.settings.job.checks.outside.0
    }

    /// What the rim asks for.
    fn rim(&self) -> Rim {
        Rim {
            melting: self.plan.settings.material.liquidus,
            beyond: self.plan.settings.job.checks.rim.0,
            width: widest(self.path) / DEVIATIONS,
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
        let rim = self.rim();
        let rim = Rim {
            beyond: rim.beyond + aimed.outward * self.outward,
            ..rim
        };
        let wanted = 0.5 * (low + high) + aimed.hotter * (high - low);
        let aim = Aim::new(self.plan.settings.material.start, wanted, rim)?;
        let depth = |p: [f64; 2]| self.plan.contour.depth(p);
        Ok(Wishes::of(highest, &aim, &depth).corrected(profile, self.path, &self.correction))
    }

    /// A path with these factors, what it makes of the section, and its highest temperatures with the power as set.
    fn drawn(
        &self,
        profile: SpeedProfile,
        aimed: Aimed,
        observer: &dyn Observer,
    ) -> Result<(Round, Best), EbmError> {
        let path = self.lever.apply(&profile, self.path)?;
        let as_drawn = at_gun::drawn(self.plan, &path)?;
        let drift = self.robust;
        let powers: Vec<f64> = std::iter::once(1.0)
            .chain(drift.into_iter().flat_map(|d| [1.0 - d, 1.0 + d]))
            .collect();
        let fields = powers
            .par_iter()
            .map(|power| self.highest(&as_drawn, *power, observer));
        let mut fields = fields.collect::<Result<Vec<_>, _>>()?.into_iter();
        let Some((highest, foot)) = fields.next() else {
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
            unfused: unfused(self.plan, None, &foot),
            drifted: drifted.map(|(less, more)| [self.told(&less.0), self.told(&more.0)]),
        };
        let made = Best {
            round: 0,
            profile,
            path,
            highest,
        };
        Ok((round, made))
    }

    /// Highest temperatures of a path, as the gun draws it, with so many times its power, and those at the foot of the layer.
    fn highest(
        &self,
        path: &BeamPath,
        power: f64,
        observer: &dyn Observer,
    ) -> Result<(Field, Field), EbmError> {
        let ground = ground(&self.plan.below);
        let body = body(&self.plan.settings, &ground);
        let resolution = Resolution {
            power: power * self.resolution.power,
            ..self.resolution
        };
        let drawn = judge(&body, &self.plan.lower, path, &resolution, &Quiet(observer))?;
        observer.advance(1);
        Ok((drawn.highest, drawn.foot))
    }

    /// What highest temperatures make of the section and of what lies beside it.
    fn told(&self, highest: &Field) -> (Tally, Outside) {
        let Rim {
            melting, beyond, ..
        } = self.rim();
        let classes = Classes {
            melting,
            window: self.window,
        };
        let contour = &self.plan.contour;
        let area = contour.region().area();
        (
            tally(highest, &classes, contour, 0.0, None),
            outside(highest, melting, contour, beyond, None, area),
        )
    }
}

/// Remembers a round where it is the best.
fn keep(told: &[Round], best: &mut Option<Best>, drawn: Best, most: f64) {
    let merit = |b: &Best| told[b.round].merit(most);
    if best.as_ref().is_none_or(|best| merit(&drawn) > merit(best)) {
        *best = Some(drawn);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shape first, then the window; without shape what melts outside; of equals the power as set.
    #[test]
    fn shape_comes_before_the_window() {
        let of = |window: f64, outside: f64| merit([window, outside, window], 0.01);
        assert!(of(0.1, 0.01) > of(0.9, 0.011));
        assert!(of(0.3, 0.009) > of(0.2, 0.0));
        assert!(of(0.1, 0.02) > of(0.9, 0.03));
        assert!(merit([0.0, 0.0, 0.4], 0.01) > merit([0.0, 0.0, 0.3], 0.01));
    }
}
