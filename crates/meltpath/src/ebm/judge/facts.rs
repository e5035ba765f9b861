//! What is told of a judged path beside the checks.

use meltpath_base::{Fact, Measure, Place};
use meltpath_thermal::criteria::{Class, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::CELSIUS;
use meltpath_thermal::solver::surface::Surface;

use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::drift::Drift;
use crate::ebm::judge::edge;
use crate::ebm::judge::ends::Passed;
use crate::ebm::judge::{JudgedPath, Run, of_all};
use crate::ebm::plan::Plan;
use crate::ebm::settings::{Judge, Settings};
use crate::ebm::simulate::Outcome;

/// The last drawing, on the best model that drew the path.
pub(super) struct Shown<'a> {
    highest: &'a Field,
    pub(super) tally: &'a Tally,
    pub(super) words: &'static str,
}

impl<'a> Shown<'a> {
    pub(super) fn of(outcome: &'a Outcome) -> Option<Self> {
        if let Some(judged) = &outcome.judged {
            let path = judged.better.as_ref().unwrap_or(&judged.given);
            return Some(Shown {
                highest: &path.highest,
                tally: &path.runs[0].tally,
                words: "on the reference solver",
            });
        }
        let there = outcome.found.as_ref().and_then(|f| f.reference.as_ref());
        if let Some(there) = there {
            return Some(Shown {
                highest: &there.better.0,
                tally: &there.better.1,
                words: "preview by one run of the reference solver",
            });
        }
        Self::on_charts(outcome)
    }

    fn on_charts(outcome: &'a Outcome) -> Option<Self> {
        let drawn = outcome.preview.as_ref()?.shown();
        Some(Shown {
            highest: &drawn.highest,
            tally: &drawn.tally,
            words: "preview by charts",
        })
    }

    /// The share in the window of what melts, and what stays powder, as facts.
    fn shares(&self, [window, powder]: [&str; 2]) -> [Fact; 2] {
        let percent = |share: f64| Measure::exact(100.0 * share, "%");
        let unmelted = of_all(self.tally, Class::Unmelted);
        let melt = "molten voxels of the region in the window";
        [
            Fact::new(
                window,
                melt,
                percent(self.tally.share(Class::Good)),
                self.words,
            ),
            Fact::new(
                powder,
                "region that stays powder",
                percent(unmelted),
                self.words,
            ),
        ]
    }
}

/// What is told of vapour beside its figures.
const WITH_CHANGES: &str = "on the reference solver, with what the judge's runs with other cells, planes and steps change of it; of pools that are shallower than a plane more planes (judge.planes) tell it better";

/// A figure of what leaves as vapour, with what other cells, planes, steps and ground change of it.
fn with_changes(path: &JudgedPath, figure: impl Fn(&Run) -> f64, unit: &str) -> Measure {
    let share = path.moved(figure);
    Measure::new(share.value, share.numerical().spread(), unit)
}

/// What leaves as vapour: of the heat, of the metal, and of the element that loses most of itself.
fn vapour(settings: &Settings, path: &JudgedPath) -> Vec<Fact> {
    let (material, ledger) = (&settings.material, &path.runs[0].ledger);
    let words = WITH_CHANGES;
    let title = "heat of the beam that vapour carries away";
    if !matches!(settings.surface, Surface::Evaporating { .. }) {
        let off = "not told: evaporation is off (ebm.evaporation), so that hot places are hotter than they would be";
        return vec![Fact::words("vapour", title, off)];
    }
    let heat = with_changes(path, |run| 100.0 * run.ledger.vapour_share(), "%");
    let mut facts = vec![Fact::new("vapour", title, heat, words)];
    let Some(law) = material.evaporation.as_ref().filter(|_| path.molten > 0.0) else {
        return facts;
    };
    // as much metal as a layer adds where it melts
    let layer = 1e-9 * material.density(material.start) * settings.job.ebm.layer.0 * path.molten;
    let lost: f64 = ledger.vapour.iter().sum();
    let title = "metal of the last layer that leaves as vapour";
    let mass = with_changes(
        path,
        |run| 1e6 * run.ledger.vapour.iter().sum::<f64>(),
        "mg",
    );
    let share = 100.0 * lost / layer.max(f64::MIN_POSITIVE);
    let told = if share < 100.0 {
        format!("{share:.2} % of what the layer adds, {words}")
    } else {
        format!(
            "more than all that the layer adds: the laws of a still surface do not hold there, {words}"
        )
    };
    facts.push(Fact::new("vapour-mass", title, mass, &told));
    let of_all = law.by_mass().into_iter();
    let whole: Vec<f64> = of_all
        .map(|share| (share * layer).max(f64::MIN_POSITIVE))
        .collect();
    let lost = ledger
        .vapour
        .iter()
        .zip(&whole)
        .map(|(lost, all)| lost / all);
    let lost = law.components.iter().enumerate().zip(lost);
    if let Some(((n, component), _)) = lost.max_by(|a, b| a.1.total_cmp(&b.1)) {
        let title = format!("share of its {} that the layer loses", component.name);
        let of = |run: &Run| 100.0 * (run.ledger.vapour[n] / whole[n]).min(1.0);
        let share = with_changes(path, of, "%");
        let told =
            format!("the surface is taken as rich in it as the melt, which tells more; {words}");
        facts.push(Fact::new("vapour-element", &title, share, &told));
    }
    facts
}

/// What the judged layer is laid on, and what is assumed of it.
fn ground(judging: &Judge, path: &JudgedPath) -> Option<Fact> {
    let last = path.layers.last()?;
    let [mean, highest] = last.before.map(|k| k - CELSIUS);
    let words = match (path.layers.len() - 1, judging.between) {
        (0, _) => "assumed: all of it is at the start temperature; with ebm.layers the layers below it are drawn, and keep their heat".to_owned(),
        (below, None) => format!(
            "assumed: each of the {below} layers drawn below it starts at the start temperature (judge.memory = \"metal\")"
        ),
        (below, Some(between)) => format!(
            "at most {highest:.1} °C, left by the {below} layers drawn below it, {} s after each; what lies below these was at the start temperature",
            between.time
        ),
    };
    let title = "mean temperature of what the last layer is laid on";
    let value = Measure::exact(mean, "°C");
    Some(Fact::new("ground-before", title, value, &words))
}

/// What the path as given was worth where a changed one took its place: of the whole section, as the checks count.
fn as_given(given: &JudgedPath, better: &JudgedPath) -> [Fact; 2] {
    let [before, after] = [given, better].map(|path| &path.runs[0]);
    let percent = |share: f64| Measure::exact(100.0 * share, "%");
    let told = |after: f64| {
        let after = 100.0 * after;
        format!("{after:.2} % by the changed one; on the reference solver, one run")
    };
    let [good, better] = [before, after].map(|run| of_all(&run.tally, Class::Good));
    let title = "section in the window by the path as given";
    let window = Fact::new("in-window-given", title, percent(good), &told(better));
    let title = "area molten outside the contour by the path as given, of the section's";
    let [before, after] = [before, after].map(|run| run.outside.share);
    let outside = Fact::new("molten-outside-given", title, percent(before), &told(after));
    [window, outside]
}

/// What is told beside the checks.
pub(in crate::ebm) fn facts(plan: &Plan, outcome: &Outcome) -> Vec<Fact> {
    let path = outcome.path(plan);
    let time = Measure::exact(path.end() - path.begin(), "s");
    let time = Fact::new("time-path", "time of the path", time, "");
    let mut facts = vec![time];
    facts.extend(at_gun::facts(outcome.gun.as_ref()));
    let Some(shown) = Shown::of(outcome) else {
        return facts;
    };
    let (hottest, [i, j, k]) = shown.tally.hottest;
    // of a region without area no place is the hottest
    if hottest.is_finite() {
        let place = Place::at(shown.highest.grid.centre(i, j, k).to_array());
        let celsius = Measure::exact(hottest - CELSIUS, "°C");
        let title = "hottest place of the region";
        facts.push(Fact::new("hottest", title, celsius, shown.words).at(place));
    }
    if let Some(judged) = &outcome.judged {
        let path = judged.better.as_ref().unwrap_or(&judged.given);
        let given = judged.better.as_ref();
        facts.extend(
            given
                .map(|b| as_given(&judged.given, b))
                .into_iter()
                .flatten(),
        );
        let asked = plan.settings.job.checks.drift.as_ref().map(|d| d.0);
        facts.extend(Drift::of(path, asked).map(|drift| drift.fact()));
        facts.extend(edge::fact(plan, outcome.path(plan), path));
        facts.extend(path.ends.fact());
        facts.extend(path.ends.passed.iter().filter_map(Passed::fact));
        facts.extend(vapour(&plan.settings, path));
        let judging = plan.settings.judge.as_ref();
        facts.extend(judging.and_then(|judging| ground(judging, path)));
        for (id, title, class) in [
            (
                "below-window",
                "section molten below the window",
                Class::Porous,
            ),
            (
                "above-window",
                "section above the window",
                Class::Overheated,
            ),
        ] {
            let share = Measure::exact(100.0 * of_all(shown.tally, class), "%");
            facts.push(Fact::new(id, title, share, shown.words));
        }
    } else if outcome
        .found
        .as_ref()
        .is_some_and(|f| f.reference.is_some())
    {
        facts.extend(shown.shares(["in-window-search", "unmelted-search"]));
    }
    let on_charts = Shown::on_charts(outcome);
    facts.extend(
        on_charts
            .iter()
            .flat_map(|s| s.shares(["in-window-charts", "unmelted-charts"])),
    );
    facts
}
