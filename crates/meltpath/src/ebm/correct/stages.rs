//! Corrects the currents of a path on the judge's solver: rounds on coarse cells first, then on its own.

use meltpath_base::{Observer, Quiet};
use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::correction::Correction;
use meltpath_melt_strategy::lever::Lever;
use meltpath_melt_strategy::speed::SpeedProfile;
use meltpath_thermal::beam::BeamPath;

use super::Correct;
use crate::ebm::error::EbmError;
use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::edge::ceiling;
use crate::ebm::judge::windows;
use crate::ebm::plan::Plan;
use crate::ebm::rounds::{Aimed, Round, Rounds, coarse};
use crate::ebm::settings::Judge;

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
    let coarse = coarse(&drawn, judging);
    let finest = Resolution {
        cell: judging.resolution.cell,
        ..coarse
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
    for (resolution, count, aims) in stages {
        let window = windows(&drawn, judging, &resolution, 1, &Quiet(observer))?[0].window;
        let allowed = ceiling(plan, path, window);
        let rounds = Rounds {
            plan: &drawn,
            path,
            resolution,
            window,
            lever: Lever::Power,
            correction: Correction {
                gain: how.gain,
                reach: how.reach,
                powers: how.currents,
                freedom: how.freedom,
            },
            robust: how.robust,
            outward: allowed.map_or(0.0, |ceiling| ceiling.outward),
            aims,
        };
        found.ceiling = allowed.map(|ceiling| ceiling.share);
        let best = rounds.run(count, (profile, aimed), &mut found.rounds, observer)?;
        found.kept = best.round;
        found.path = best.path;
        profile = best.profile;
        aimed = found.rounds[best.round].aimed;
    }
    Ok(found)
}
