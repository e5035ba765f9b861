//! What the judge costs: the time of its runs and of the rounds of `[correct]`, and the memory that they take at once.

use meltpath_melt_strategy::bed::Resolution;
use meltpath_melt_strategy::judgement::Variant;
use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::beam::BeamPath;
use meltpath_thermal::material::Material;
use meltpath_thermal::material::enthalpy::Enthalpy;

use super::room;
use crate::ebm::correct::Correct;
use crate::ebm::judge::under::domain;
use crate::ebm::optimise::Optimise;
use crate::ebm::plan::{Plan, Window};
use crate::ebm::settings::Judge;

/// Time of computing of the judge's finest run for a second of the path with the beam on, s of one core, on cells of `CELL` mm and
/// layers of `LAYER` mm: 36 s on a square of 10 mm, 38 s in the mean of 25 m. With nine of `OTHER` it gives the 137 s that the
/// triangle of the examples took.
const JUDGED: f64 = 37.0;
/// The same for a second with the beam off, when most tiles sleep: 12.8 s for all runs of 10 s on a region of 4 x 2 mm.
const DARK: f64 = 0.5;
/// See `JUDGED`.
const CELL: f64 = 0.031_25;
/// See `JUDGED`.
const LAYER: f64 = 0.05;
/// The least that larger cells cost: 490 s for the 8.2 s of a section of 40 x 40 mm on cells of 0.125 mm.
const COARSE: f64 = 0.5;
/// Stable step there, s.
const STEP: f64 = 2e-5;
/// How deep planes are as high as those of the layer, mm, and how many lie below them.
const EVEN: (f64, f64) = (0.2, 6.0);
/// Time of computing of all runs of the judge for a second of what lies between two layers, s of one core, on cells of `CELL` mm. An
/// estimate.
const RESTED: f64 = 1.5;
/// What each other run of the judge takes beside the finest one, on cells twice as large. An estimate.
const OTHER: f64 = 1.5 / 9.0;
/// How many of these there are.
const OTHERS: usize = Variant::ALL.len() - 1;

/// Largest diffusivity of the solid metal that it was measured on, Ti6Al4V, mm²/s: metals that conduct better take shorter steps.
const DIFFUSIVITY: f64 = 8.6;
/// Power of the diffusivity with which the time grows: a hatch of 3 x 2 mm at 1.2 m/s took 3.1 s in Ti6Al4V, 8.5 s in tungsten
/// (42 mm²/s), 20.9 s in CuCrZr (91 mm²/s), each on its own start temperature. Told are 5, 12 and 19 s.
const CONDUCTING: f64 = 0.6;

/// Seconds with the beam on and off.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Seconds {
    pub(super) lit: f64,
    pub(super) dark: f64,
}

impl Seconds {
    pub(super) fn of<'a>(paths: impl IntoIterator<Item = &'a BeamPath>) -> Self {
        let mut seconds = Seconds::default();
        for pair in paths.into_iter().flat_map(|p| p.points().windows(2)) {
            let time = pair[1].time - pair[0].time;
            if pair[0].is_on() {
                seconds.lit += time;
            } else {
                seconds.dark += time;
            }
        }
        seconds
    }
}

/// Cells, planes and steps of the judge, of which its time follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fineness {
    pub(super) cell: f64,
    pub(super) planes: u32,
    pub(super) step: f64,
    pub(super) layer: f64,
}

impl Fineness {
    pub(super) fn of(judge: &Judge, layer: f64) -> Self {
        let Resolution {
            cell, planes, step, ..
        } = judge.resolution;
        Fineness {
            cell,
            planes,
            step,
            layer,
        }
    }

    /// Steps in a second of the path, as a multiple of those where it was measured.
    fn steps(&self) -> f64 {
        let stiff = |cell: f64, height: f64| 2.0 / cell.powi(2) + height.powi(-2);
        let height = self.layer / f64::from(self.planes);
        (stiff(self.cell, height) / stiff(CELL, LAYER)).max(STEP / self.step)
    }

    /// Time of a second of the path with the beam on, as a multiple of that where it was measured.
    pub(super) fn times(&self) -> f64 {
        let (even, below) = EVEN;
        let planes = |height: f64| even / height + below;
        let height = self.layer / f64::from(self.planes);
        let fine = self.steps() * (CELL / self.cell).powi(2) * planes(height) / planes(LAYER);
        // what stays warm behind the beam is on coarse cells already
        fine.max(COARSE)
    }

    /// Seconds of one core that the finest run of paths takes in a metal.
    fn finest(&self, paths: Seconds, material: &Material) -> f64 {
        let fine = JUDGED * self.times() * paths.lit + DARK * self.steps() * paths.dark;
        fine * conducting(material)
    }
}

/// Time in a metal, as a multiple of that in the one where it was measured.
fn conducting(material: &Material) -> f64 {
    // laws that give no curve are refused where they are read
    Enthalpy::new(material).map_or(1.0, |curve| {
        (curve.diffusivity_solid / DIFFUSIVITY).powf(CONDUCTING)
    })
}

/// Seconds of one core that the rounds of `[correct]` take, each drawn once more than there are corrections, on the
/// coarse cells with other aims too, and all with three powers where paths are to be robust.
pub(super) fn corrected(plan: &Plan, judge: &Judge, correct: &Correct) -> f64 {
    let drawings = |rounds: u32, aims: u32| match rounds {
        0 => 0.0,
        some => f64::from(some + 1 + aims),
    };
    let [coarse, finest] = correct.rounds;
    let (coarse, finest) = (drawings(coarse, correct.aims), drawings(finest, 0));
    let powers = correct.robust.map_or(1.0, |_| 3.0);
    let fineness = Fineness::of(judge, plan.settings.job.ebm.layer.0);
    let once = fineness.finest(Seconds::of([&plan.path]), &plan.settings.material);
    once * powers * (coarse * OTHER + finest)
}

/// Seconds of one core that looking for a path on the judge's coarse cells takes; what is drawn ahead counts as as many drawings.
pub(super) fn searched(plan: &Plan, judge: &Judge, how: &Optimise) -> f64 {
    let fineness = Fineness::of(judge, plan.settings.job.ebm.layer.0);
    let once = fineness.finest(Seconds::of([&plan.path]), &plan.settings.material);
    once * OTHER * (how.drawings(how.tried()) as f64 + how.ahead())
}

/// Seconds of one core that the judge takes: as asked, and with all that moves it, for the path and the good body.
pub(super) fn judged(plan: &Plan, judge: &Judge) -> f64 {
    let fineness = Fineness::of(judge, plan.settings.job.ebm.layer.0);
    // a path that gives way to a better one is drawn once as asked, too
    let changed = plan.settings.optimise.is_some() || plan.settings.correct.is_some();
    let given = if changed {
        Seconds::of([&plan.path])
    } else {
        Seconds::default()
    };
    let finest = |paths| fineness.finest(paths, &plan.settings.material);
    finest(Seconds::of(plan.drawn())) * (1.0 + OTHER * OTHERS as f64)
        + finest(given)
        + rested(plan, judge)
}

/// Seconds of one core that layers take to cool on each other, those of a good body too.
fn rested(plan: &Plan, judge: &Judge) -> f64 {
    let Some(between) = judge.between else {
        return 0.0;
    };
    let paths = match plan.window {
        Window::Fixed(_) => 1,
        Window::Good { .. } => 2,
    };
    let cells = (CELL / judge.resolution.cell).powi(2);
    RESTED * between.time * cells * (paths * plan.lower.len()) as f64
}

/// Where the beam is on along paths, mm.
pub(super) fn hull<'a>(paths: impl IntoIterator<Item = &'a BeamPath>) -> Rectangle {
    let mut hull = Rectangle {
        low: [f64::INFINITY; 2],
        high: [f64::NEG_INFINITY; 2],
    };
    let pairs = paths.into_iter().flat_map(|p| p.points().windows(2));
    for p in pairs.filter(|w| w[0].is_on()).flatten() {
        for (a, x) in [p.x, p.y].into_iter().enumerate() {
            hull.low[a] = hull.low[a].min(x);
            hull.high[a] = hull.high[a].max(x);
        }
    }
    hull
}

/// The judge's resolution with the ground that it draws on.
pub(super) fn resolution(plan: &Plan, judge: &Judge) -> Resolution {
    Resolution {
        domain: domain(plan, judge),
        ..judge.resolution
    }
}

/// Bytes that the judge takes with as many of its runs at once as there are `cores`.
pub(super) fn memory(plan: &Plan, judge: &Judge, cores: usize) -> f64 {
    let drawn = (&hull(plan.drawn()), plan.lower.len());
    room::judge(
        &plan.settings,
        judge,
        drawn,
        &resolution(plan, judge),
        cores,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_data::materials;
    use meltpath_thermal::material::file::{Readings, read};

    /// A metal that conducts ten times as well takes 10 to the 0.6 as long; the one that it was measured on takes what was measured.
    #[test]
    fn metals_that_conduct_well_take_longer() {
        let text = materials::TI6AL4V_EBM.text;
        let metal = |text: &str| conducting(&read(text, Readings::default()).unwrap());
        let own = metal(text);
        assert!((own - 1.0).abs() < 0.02, "{own}");
        let conducts = text.replace("[7.0, 0.0125]", "[70.0, 0.125]");
        assert_ne!(text, conducts);
        let ratio = metal(&conducts) / own;
        assert!((ratio - 10_f64.powf(0.6)).abs() < 0.01, "{ratio}");
        let fineness = Fineness {
            cell: CELL,
            planes: 1,
            step: STEP,
            layer: LAYER,
        };
        let second = Seconds {
            lit: 1.0,
            dark: 0.0,
        };
        let material = read(&conducts, Readings::default()).unwrap();
        let seconds = fineness.finest(second, &material);
        assert!((seconds / JUDGED / ratio / own - 1.0).abs() < 1e-9);
    }
}
