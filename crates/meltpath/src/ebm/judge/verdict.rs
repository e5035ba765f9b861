//! The verdict of an electron-beam run. Charts preview and decide nothing; the reference solver judges the whole section, and where its
//! figures are not converged it cannot say either.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Status};
use meltpath_melt_strategy::judgement::{CONVERGED, KEPT, Share, Variant};
use meltpath_thermal::criteria::{Class, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::{CELSIUS, Material};

use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::advice::{MORE, Needs};
use crate::ebm::judge::ends::{Ends, Passed};
use crate::ebm::judge::{JudgedPath, Run, melts_at_the_edge, of_all};
use crate::ebm::plan::Plan;
use crate::ebm::settings::{Good, Judge, Settings};
use crate::ebm::simulate::Outcome;
use crate::job::ebm::ChecksTable;
use crate::job::ebm::JudgeGround;

const IN_WINDOW: [&str; 2] = [
    "in-window",
    "section whose highest temperature lies in the window",
];
const UNMELTED: [&str; 2] = ["unmelted", "section that stays powder"];
const UNFUSED: [&str; 2] = [
    "unfused",
    "section over metal that does not melt down to it",
];
const OUTSIDE: [&str; 2] = [
    "molten-outside",
    "area molten outside the contour, of the section's",
];
const FARTHEST: [&str; 2] = [
    "molten-farthest",
    "farthest from the contour that metal melts",
];
/// Share of a section far beside the path from which a remedy names it.
const LEFT_OUT: f64 = 1e-3;
const JUDGE: &str =
    "let the solver judge the whole section: take  solver = \"none\"  out of [judge]";

/// What is judged: of the path with better speeds where there is one.
pub(in crate::ebm) fn checks(settings: &Settings, outcome: &Outcome) -> Vec<Check> {
    let mut checks = of_temperatures(settings, outcome);
    checks.push(at_gun::check(outcome.gun.as_ref()));
    checks
}

/// What temperatures say.
fn of_temperatures(settings: &Settings, outcome: &Outcome) -> Vec<Check> {
    let limits = &settings.job.checks;
    let (Some(judged), Some(judging)) = (&outcome.judged, &settings.judge) else {
        // a job without charts has a judge
        let Some(drawn) = Shown::of(outcome) else {
            let nothing = "nothing drew the path";
            return vec![Check::not_checked(IN_WINDOW[0], IN_WINDOW[1], nothing)];
        };
        let remedy = if of_all(drawn.tally, Class::Good) < limits.in_window.0 {
            let needs = Needs::of_window(drawn.tally);
            let change = into_window(settings, needs);
            format!("the preview has less than that in the window: {change}; then {JUDGE}")
        } else {
            JUDGE.to_owned()
        };
        return vec![
            preview(
                IN_WINDOW,
                Limit::AtLeast(100.0 * limits.in_window.0),
                &drawn,
            )
            .remedy(remedy),
            preview(UNMELTED, Limit::AtMost(100.0 * limits.unmelted.0), &drawn).remedy(JUDGE),
            Check::not_checked(UNFUSED[0], UNFUSED[1], "only the solver of [judge] tells"),
            Check::not_checked(OUTSIDE[0], OUTSIDE[1], "only the solver of [judge] tells"),
            Check::not_checked(FARTHEST[0], FARTHEST[1], "only the solver of [judge] tells"),
        ];
    };
    let path = judged.better.as_ref().unwrap_or(&judged.given);
    let figures = Figures::of(path, limits);
    let in_window = path.in_window();
    let words = in_words(path, &in_window, judged.classes.window);
    let needs = needs(path, &figures);
    let section = Section {
        judging,
        tally: &path.runs[0].tally,
        ends: &path.ends,
        cut: melts_at_the_edge(&path.highest, settings.material.liquidus),
        material: &settings.material,
        needs,
    };
    let first_end = path.ends.passed.first().map(|p| p.kelvin);
    let mut cure = into_window(settings, needs);
    if first_end.is_some_and(|kelvin| judged.classes.window[0] >= kelvin) {
        cure.push_str(match settings.window {
            Good::Limits(_) => "; a window below the temperature where a pool of conduction ends",
            Good::Path { .. } | Good::Body { .. } => {
                "; a good body, which places the window, that stays below the temperature where a pool of conduction ends"
            }
        });
    }
    let unfused = format!("{}, or thinner layers", needs.heat());
    let drawn = |cure: &str| {
        if path.undrawn < LEFT_OUT {
            return cure.to_owned();
        }
        let share = 100.0 * path.undrawn;
        format!(
            "a path that draws all of the section: {share:.1} % of it lie more than {KEPT} mm beside this one; {cure}"
        )
    };
    let check = |[id, title]: [&str; 2], (figure, limit): &(Figure, Limit), cure: &str| {
        section.check([id, title], figure, *limit, cure)
    };
    vec![
        check(IN_WINDOW, &figures.in_window, &drawn(&cure)).because(&words),
        check(UNMELTED, &figures.unmelted, &drawn(&needs.heat())),
        check(UNFUSED, &figures.unfused, &drawn(&unfused)),
        check(OUTSIDE, &figures.outside, needs.rim())
            .because(&format!("beyond {} mm of the contour", limits.rim.0)),
        check(FARTHEST, &figures.farthest, needs.rim()),
    ]
}

/// What is judged, each with its limit.
struct Figures {
    in_window: (Figure, Limit),
    unmelted: (Figure, Limit),
    unfused: (Figure, Limit),
    outside: (Figure, Limit),
    farthest: (Figure, Limit),
}

impl Figures {
    fn of(path: &JudgedPath, limits: &ChecksTable) -> Self {
        let at_most = |share: f64| Limit::AtMost(100.0 * share);
        let share = |figure: fn(&Run) -> f64| Figure::share(path.moved(figure));
        let farthest = Figure {
            share: path.moved(|run| run.outside.farthest),
            // a cell more or less is what an outline on cells is known to: on those of the runs that are compared
            converged: path
                .runs
                .iter()
                .map(|run| run.resolution.cell)
                .fold(0.0, f64::max),
            factor: 1.0,
            unit: "mm",
        };
        Figures {
            in_window: (
                Figure::share(path.in_window()),
                Limit::AtLeast(100.0 * limits.in_window.0),
            ),
            unmelted: (
                share(|run| of_all(&run.tally, Class::Unmelted)),
                at_most(limits.unmelted.0),
            ),
            unfused: (share(|run| run.unfused), at_most(limits.unfused.0)),
            outside: (share(|run| run.outside.share), at_most(limits.outside.0)),
            farthest: (farthest, Limit::AtMost(limits.farthest.0)),
        }
    }
}

/// What all findings ask for together.
fn needs(path: &JudgedPath, figures: &Figures) -> Needs {
    let beyond = |(figure, limit): &(Figure, Limit)| {
        let status = Check::judge("", "", figure.measure(), *limit).status;
        matches!(status, Status::Fail | Status::Warn)
    };
    let run = &path.runs[0];
    let of_others = Needs {
        heat: beyond(&figures.unmelted) || beyond(&figures.unfused),
        cold: !path.ends.passed.is_empty(),
        narrow: beyond(&figures.outside) || beyond(&figures.farthest),
    };
    let first_end = path.ends.passed.first().map(|p| p.kelvin);
    let out_of_reach = first_end.is_some_and(|kelvin| run.classes.window[0] >= kelvin);
    if beyond(&figures.in_window) && !out_of_reach {
        of_others.and(Needs::of_window(&run.tally))
    } else {
        of_others
    }
}

/// A check of which only a preview is known.
fn preview([id, title]: [&str; 2], limit: Limit, drawn: &Shown<'_>) -> Check {
    Check {
        status: Status::CannotSay,
        limit: Some(limit),
        ..Check::not_checked(
            id,
            title,
            &format!(
                "there is only a {}, which is told beside the checks",
                drawn.words
            ),
        )
    }
}

/// What brings more of the section into the window: by what the findings ask for, and by what the job says already.
fn into_window(settings: &Settings, needs: Needs) -> String {
    let mut remedy = needs.heat();
    if settings.optimise.is_none() && settings.correct.is_none() {
        // [correct] draws on the judge's solver
        remedy.push_str(match settings.judge {
            Some(_) => "; or let [correct] change the currents",
            None => "; or let [optimise] change the speeds",
        });
    }
    if matches!(settings.window, Good::Limits(_)) {
        remedy.push_str(
            "; or, where the beam is one that builds well, centre the window on what it reaches (window.body)",
        );
    }
    remedy
}

/// A figure of the judge with what moves it.
struct Figure {
    share: Share,
    /// Largest change that is called converged, as the share is.
    converged: f64,
    /// To the unit in which it is told.
    factor: f64,
    unit: &'static str,
}

impl Figure {
    fn share(share: Share) -> Self {
        Figure {
            share,
            converged: CONVERGED,
            factor: 100.0,
            unit: "%",
        }
    }

    /// Its value with what moves it.
    fn measure(&self) -> Measure {
        let spread = self.factor * self.share.spread();
        Measure::new(self.factor * self.share.value, spread, self.unit)
    }
}

/// What is judged, and how.
struct Section<'a> {
    judging: &'a Judge,
    tally: &'a Tally,
    ends: &'a Ends,
    /// Whether metal melts up to the edge of what is kept.
    cut: bool,
    material: &'a Material,
    needs: Needs,
}

impl Section<'_> {
    /// A figure against its limit. Beyond it in every run it fails, and `cure` says what to do; else it passes only where it is
    /// converged, over the whole section, and where something melts at all. Each doubt says how to end it.
    fn check(&self, [id, title]: [&str; 2], figure: &Figure, limit: Limit, cure: &str) -> Check {
        let title = format!("{title}, on the reference solver");
        let check = Check::judge(id, &title, figure.measure(), limit);
        if self.tally.voxels == 0 {
            let check = Check {
                status: check.status.max(Status::CannotSay),
                ..check
            };
            return check
                .because("no cell of the judge lies in what is to be judged")
                .remedy("a larger judge.part, or finer cells (judge.cell)");
        }
        if self.tally.molten() == 0 {
            let check = Check {
                status: Status::Fail,
                ..check
            };
            return check.because("nothing melts").remedy(MORE);
        }
        let beyond = matches!(check.status, Status::Fail | Status::Warn);
        let mut remedies = Vec::from_iter(beyond.then(|| cure.to_owned()));
        let doubts = [
            self.moved(figure, "NOT CONVERGED", &figure.share.numerical()),
            self.moved(figure, "NOT ROBUST", &figure.share.of_power()),
            self.unknown(),
            self.in_part(),
            self.cut_off(),
        ];
        let doubts = doubts.into_iter().flatten().chain(self.hot());
        let check = doubts.fold(check, |check, doubt| {
            // what fails fails whatever the doubt: its cure alone stands, which may ask for the opposite
            if check.status != Status::Fail && !remedies.contains(&doubt.remedy) {
                remedies.push(doubt.remedy);
            }
            Check {
                status: check.status.max(Status::CannotSay),
                ..check.because(&doubt.reason)
            }
        });
        if remedies.is_empty() {
            // the uncertainty alone is larger than the limit
            remedies.push(cure.to_owned());
        }
        check.remedy(remedies.join("; "))
    }

    /// Where a figure is not `what`: what moves it among the changes of `share`.
    fn moved(&self, figure: &Figure, what: &str, share: &Share) -> Option<Doubt> {
        let Figure {
            converged,
            factor,
            unit,
            ..
        } = figure;
        if share.within(*converged) {
            return None;
        }
        let moved = || {
            let changes = share.changes.iter();
            let by = changes.filter(|(_, c)| c.is_nan() || c.abs() > *converged);
            by.map(|(variant, _)| *variant)
        };
        let by: Vec<&str> = moved().map(Variant::words).collect();
        let mut remedies: Vec<&str> = moved().filter_map(|v| self.settles(v)).collect();
        remedies.dedup();
        Some(Doubt {
            reason: format!(
                "{what}: it moves by more than {} {} with {}",
                factor * converged,
                if *unit == "%" { "points" } else { unit },
                by.join(", ")
            ),
            remedy: remedies.join(", "),
        })
    }

    /// Where a pool of conduction ends: the first end passed says what to do, the others what it is worth.
    fn hot(&self) -> Option<Doubt> {
        let passed = &self.ends.passed;
        let words: Vec<String> = passed
            .iter()
            .map(|p| p.words(&self.material.name))
            .collect();
        (!passed.is_empty()).then(|| Doubt {
            reason: words.join("; "),
            remedy: self.needs.heat(),
        })
    }

    /// Where nobody knows what vapour does to the pool.
    fn unknown(&self) -> Option<Doubt> {
        (!self.ends.known).then(|| Doubt {
            reason: format!(
                "{} tells no evaporation or no surface tension: where vapour begins to move the pool is not known",
                self.material.name
            ),
            remedy: "a material file with [evaporation] and [surface_tension] (ebm.material)"
                .to_owned(),
        })
    }

    /// What makes a figure move less with a variant.
    fn settles(&self, variant: Variant) -> Option<&'static str> {
        match variant {
            Variant::Base | Variant::TwiceCell => Some("finer cells (judge.cell)"),
            Variant::MorePlanes => Some("more planes (judge.planes)"),
            Variant::HalfStep => Some("shorter steps (judge.step)"),
            Variant::Deeper | Variant::Wider => (self.judging.ground != JudgeGround::HalfSpace)
                .then_some("judge.ground = \"half-space\""),
            Variant::LessPower | Variant::MorePower | Variant::LittleLess | Variant::LittleMore => {
                Some("a beam whose figures lie further from their limits")
            }
        }
    }

    /// Where more may melt than was looked at.
    fn cut_off(&self) -> Option<Doubt> {
        self.cut.then(|| Doubt {
            reason: format!("metal melts up to {KEPT} mm beside the path, as far as was looked"),
            remedy: "less power, a smaller spot, or a beam that does not rest".to_owned(),
        })
    }

    fn in_part(&self) -> Option<Doubt> {
        self.judging.part.map(|_| Doubt {
            reason: "only judge.part was judged, not the whole section".to_owned(),
            remedy: "leave judge.part out".to_owned(),
        })
    }
}

/// Why a figure decides nothing, and what ends that.
struct Doubt {
    reason: String,
    remedy: String,
}

/// The share in the window as the reports tell it.
fn in_words(path: &JudgedPath, share: &Share, window: [f64; 2]) -> String {
    let Run {
        resolution, tally, ..
    } = &path.runs[0];
    let changes: Vec<String> = path.runs[1..]
        .iter()
        .zip(&share.changes)
        .map(|(run, (v, c))| {
            let told = format!("{:+.1} at {}", 100.0 * c, v.words());
            if v.is_of_power() {
                let left = 100.0 * run.as_it_was;
                format!("{told}, {left:.1} % in the window as it was")
            } else {
                told
            }
        })
        .collect();
    if tally.molten() == 0 {
        return format!(
            "the window is {:.0} to {:.0} °C",
            window[0] - CELSIUS,
            window[1] - CELSIUS
        );
    }
    format!(
        "the mean is {:.0} °C, the window {:.0} to {:.0} °C; cells of {:.1} µm, steps of {:.2} µs ({})",
        tally.mean - CELSIUS,
        window[0] - CELSIUS,
        window[1] - CELSIUS,
        1e3 * resolution.cell,
        1e6 * resolution.step,
        changes.join("; ")
    )
}

/// The last drawing, on the best model that drew the path.
struct Shown<'a> {
    highest: &'a Field,
    tally: &'a Tally,
    words: &'static str,
}

impl<'a> Shown<'a> {
    fn of(outcome: &'a Outcome) -> Option<Self> {
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

/// What leaves as vapour: of the heat, of the metal, and of the element that loses most of itself.
fn vapour(settings: &Settings, path: &JudgedPath) -> Vec<Fact> {
    let (material, ledger) = (&settings.material, &path.runs[0].ledger);
    let words = "on the reference solver";
    let heat = Measure::exact(100.0 * ledger.vapour_share(), "%");
    let title = "heat of the beam that vapour carries away";
    let mut facts = vec![Fact::new("vapour", title, heat, words)];
    let Some(law) = material.evaporation.as_ref().filter(|_| path.molten > 0.0) else {
        return facts;
    };
    // as much metal as a layer adds where it melts
    let layer = 1e-9 * material.density(material.start) * settings.job.ebm.layer.0 * path.molten;
    let lost: f64 = ledger.vapour.iter().sum();
    let title = "metal of the last layer that leaves as vapour";
    let mass = Measure::exact(1e6 * lost, "mg");
    let share = 100.0 * lost / layer.max(f64::MIN_POSITIVE);
    let told = format!("{share:.2} % of what the layer adds, {words}");
    facts.push(Fact::new("vapour-mass", title, mass, &told));
    let shares = law.by_mass().into_iter().zip(ledger.vapour);
    let lost = shares.map(|(share, lost)| lost / (share * layer).max(f64::MIN_POSITIVE));
    let lost = law.components.iter().zip(lost);
    if let Some((component, share)) = lost.max_by(|a, b| a.1.total_cmp(&b.1)) {
        let title = format!("share of its {} that the layer loses", component.name);
        let share = Measure::exact(100.0 * share, "%");
        let told = format!("at most: the surface is taken as rich in it as the melt, {words}");
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
            "at most {highest:.0} °C, left by the {below} layers drawn below it, {} s after each; what lies below these was at the start temperature",
            between.time
        ),
    };
    let title = "mean temperature of what the last layer is laid on";
    let value = Measure::exact(mean, "°C");
    Some(Fact::new("ground-before", title, value, &words))
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
