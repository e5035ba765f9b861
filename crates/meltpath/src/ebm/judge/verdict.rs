//! The verdict of an electron-beam run. Charts preview and decide nothing; the reference solver judges the whole section, and where its
//! figures are not converged it cannot say either.

use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_melt_strategy::judgement::{CONVERGED, KEPT, Share, Variant};
use meltpath_thermal::criteria::{Class, Tally};
use meltpath_thermal::material::{CELSIUS, Material};

use crate::ebm::gun::drawn as at_gun;
use crate::ebm::judge::advice::{MORE, Needs};
use crate::ebm::judge::cold::on_cold_ground;
use crate::ebm::judge::doubt::{Doubt, coarse, empty, melts_otherwise};
use crate::ebm::judge::drift::{DRIFT, Drift};
use crate::ebm::judge::edge::below_its_ceiling;
use crate::ebm::judge::ends::Ends;
use crate::ebm::judge::facts::Shown;
use crate::ebm::judge::on_lower::on;
use crate::ebm::judge::scale::on_its_scale;
use crate::ebm::judge::{Hole, Hollow, JudgedPath, Run, melts_at_the_edge, of_all};
use crate::ebm::plan::{DrawnPart, Plan};
use crate::ebm::settings::{Good, Judge, Settings};
use crate::ebm::simulate::Outcome;
use crate::job::ebm::{ChecksTable, JudgeGround};

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
const HOLES: [&str; 2] = ["holes", "largest share of a hole or narrow gap that melts"];
/// Share of a section far beside the path from which a remedy names it.
const LEFT_OUT: f64 = 1e-3;
const JUDGE: &str =
    "let the solver judge the whole section: take  solver = \"none\"  out of [judge]";

/// What is judged: of the path with better speeds where there is one.
pub(in crate::ebm) fn checks(plan: &Plan, outcome: &Outcome) -> Vec<Check> {
    let path = outcome.path(plan);
    let spots = path.points().iter().map(|p| p.spot);
    let smallest = spots.fold(f64::INFINITY, f64::min);
    let mut checks = of_temperatures((&plan.settings, smallest), outcome);
    let judged = outcome.judged.as_ref();
    let judged = judged.map(|j| j.better.as_ref().unwrap_or(&j.given));
    if let Some(judged) = judged.filter(|path| path.runs[0].tally.molten() > 0) {
        let asked = plan.settings.job.checks.drift.as_ref().map(|d| d.0);
        let drift = Drift::of(judged, asked);
        let bound = |check: Check| drift.iter().fold(check, |check, drift| drift.bound(check));
        for check in checks
            .iter_mut()
            .filter(|c| c.id == IN_WINDOW[0] || c.id == DRIFT[0])
        {
            let known = on_its_scale(bound(check.clone()), plan);
            *check = below_its_ceiling(known, plan, path, judged);
        }
    }
    if let Some(lower) = judged.and_then(|path| path.lower) {
        checks = on(&lower, checks);
    }
    checks = on_cold_ground(checks, &plan.settings);
    checks.push(at_gun::check(outcome.gun.as_ref()));
    checks.extend(plan.part.as_ref().and_then(whole_layer));
    checks
}

/// A part of several bodies of which one is judged, and the job does not say which.
fn whole_layer(part: &DrawnPart) -> Option<Check> {
    let [islands, island] = part.islands;
    let left_out = islands.saturating_sub(1);
    if left_out == 0 || part.chosen {
        return None;
    }
    let check = Check::judge(
        "areas",
        "separate areas of the layer that are not judged",
        Measure::exact(left_out as f64, ""),
        Limit::AtMost(0.0),
    );
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let words = format!("of {islands}, number {island} by size is drawn");
    Some(check.because(&words).remedy(
        "name the area that you mean by section.island (1 is the largest), and run each of them",
    ))
}

/// What charts foretell where nothing judges.
fn unjudged(settings: &Settings, outcome: &Outcome) -> Vec<Check> {
    let limits = &settings.job.checks;
    // a job without charts has a judge
    let Some(drawn) = Shown::of(outcome) else {
        let nothing = "nothing drew the path";
        return vec![Check::not_checked(IN_WINDOW[0], IN_WINDOW[1], nothing)];
    };
    let remedy = if of_all(drawn.tally, Class::Good) < limits.in_window.0 {
        let change = into_window(settings, Needs::of_window(drawn.tally));
        format!("the preview has less than that in the window: {change}; then {JUDGE}")
    } else {
        JUDGE.to_owned()
    };
    vec![
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
    ]
}

/// What temperatures say.
fn of_temperatures((settings, spot): (&Settings, f64), outcome: &Outcome) -> Vec<Check> {
    let limits = &settings.job.checks;
    let (Some(judged), Some(judging)) = (&outcome.judged, &settings.judge) else {
        return unjudged(settings, outcome);
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
        empty: empty(path),
        melts: melts_otherwise(path),
        material: &settings.material,
        spot,
        needs,
    };
    let first_end = path.ends.passed.first().map(|p| p.kelvin);
    let mut cure = into_window(settings, needs);
    if first_end.is_some_and(|kelvin| judged.classes.window[0] >= kelvin) {
        cure.push_str(match settings.window {
            Good::Limits { .. } => "; a window below the temperature where a pool of conduction ends",
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
    let coarse = coarse(path, limits);
    let rim = |check: Check| match &coarse {
        Some(doubt) => doubt.on(check),
        None => check,
    };
    let mut checks = vec![
        check(IN_WINDOW, &figures.in_window, &drawn(&cure)).because(&words),
        check(UNMELTED, &figures.unmelted, &drawn(&needs.heat())),
        match &figures.unfused {
            Some(figure) => check(UNFUSED, figure, &drawn(&unfused)),
            None => Check::not_checked(
                UNFUSED[0],
                UNFUSED[1],
                "no metal lies below the section, only powder",
            ),
        },
        rim(check(OUTSIDE, &figures.outside, needs.rim()))
            .because(&format!("beyond {} mm of the contour", limits.rim.0)),
        rim(check(FARTHEST, &figures.farthest, needs.rim())),
    ];
    let asked = limits.drift.as_ref().map(|asked| asked.0);
    if let Some(drift) = asked.and_then(|asked| Drift::of(path, Some(asked))) {
        let left = Share {
            value: drift.left,
            ..in_window
        };
        let figure = (Figure::share(left), figures.in_window.1);
        checks.insert(
            1,
            check(DRIFT, &figure, "a wider window, or a steadier power"),
        );
    }
    if let (Some(figure), Some(hole)) = (&figures.holes, path.runs[0].hole) {
        let (wider, told) = match hole.kind {
            Hollow::Hole => ("hole", "a hole"),
            Hollow::Gap => (
                "gap",
                "a gap of the outline, all of it within the rim (checks.rim)",
            ),
        };
        let cure = format!("{}; or a wider {wider}", needs.rim());
        let [x, y] = hole.middle;
        let check = rim(check(HOLES, figure, &cure)).because(told);
        checks.push(check.at(Place::at([x, y, 0.0])));
    }
    checks
}

/// What is judged, each with its limit.
struct Figures {
    in_window: (Figure, Limit),
    unmelted: (Figure, Limit),
    /// `None` where no metal lies below.
    unfused: Option<(Figure, Limit)>,
    /// `None` where the region has no holes.
    holes: Option<(Figure, Limit)>,
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
            unfused: path.runs[0].unfused.map(|_| {
                let figure = share(|run| run.unfused.unwrap_or(f64::NAN));
                (figure, at_most(limits.unfused.0))
            }),
            holes: path.runs[0].hole.map(|_| {
                let of = |hole: Option<Hole>| hole.map_or(f64::NAN, |hole| hole.share);
                let share = path.moved(|run| of(run.hole));
                (Figure::share(share), at_most(limits.holes.0))
            }),
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
        heat: beyond(&figures.unmelted) || figures.unfused.as_ref().is_some_and(beyond),
        cold: !path.ends.passed.is_empty(),
        narrow: beyond(&figures.outside)
            || beyond(&figures.farthest)
            || figures.holes.as_ref().is_some_and(beyond),
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
    if matches!(settings.window, Good::Limits { .. }) {
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
    /// A run in whose cells nothing of the section lies.
    empty: Option<Variant>,
    /// A run in which something melts, where nothing does as set: of those that show whether the model is solved the first.
    melts: Option<Variant>,
    material: &'a Material,
    /// The smallest of the beam's spots, mm.
    spot: f64,
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
        if self.tally.molten() == 0 && self.melts.is_none() {
            return match self.too_coarse() {
                Some(doubt) => doubt.on(Check {
                    status: Status::CannotSay,
                    ..check
                }),
                None => Check {
                    status: Status::Fail,
                    ..check
                }
                .because("nothing melts")
                .remedy(MORE),
            };
        }
        // nothing is known of what a run shows to be unsolved altogether
        if self.melts.is_some_and(|v| !v.is_of_power())
            && let Some(doubt) = self.melts_otherwise()
        {
            return doubt.on(Check {
                status: Status::CannotSay,
                ..check
            });
        }
        let beyond = matches!(check.status, Status::Fail | Status::Warn);
        let mut remedies = Vec::from_iter(beyond.then(|| cure.to_owned()));
        let doubts = [
            self.melts_otherwise(),
            self.moved(figure, "NOT CONVERGED", &figure.share.numerical()),
            self.moved(figure, "NOT ROBUST", &figure.share.of_power()),
            self.too_coarse(),
            self.unknown(),
            self.in_part(),
            self.cut_off(),
            self.no_cell(),
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

    /// Where nothing melts as set, and something does in another run.
    fn melts_otherwise(&self) -> Option<Doubt> {
        let variant = self.melts?;
        let (what, cure) = if variant.is_of_power() {
            ("NOT ROBUST", Some(MORE))
        } else {
            ("NOT CONVERGED", self.settles(variant))
        };
        Some(Doubt {
            reason: format!(
                "{what}: nothing melts as set, something does with {}",
                variant.words()
            ),
            remedy: cure.unwrap_or(MORE).to_owned(),
        })
    }

    /// Cells that see of the beam its mean alone: what melts nothing there may melt, and the reverse.
    fn too_coarse(&self) -> Option<Doubt> {
        let [cell, spot] = [self.judging.resolution.cell, self.spot];
        (cell > 0.5 * spot).then(|| Doubt {
            reason: format!(
                "cells of {:.0} µm are wider than half the beam's spot, {:.0} µm",
                1e3 * cell,
                1e3 * spot
            ),
            remedy: "finer cells (judge.cell)".to_owned(),
        })
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
            Variant::Power(_) => Some("a beam whose figures lie further from their limits"),
        }
    }

    /// Where more may melt than was looked at.
    fn cut_off(&self) -> Option<Doubt> {
        self.cut.then(|| Doubt {
            reason: format!("metal melts up to {KEPT} mm beside the path, as far as was looked"),
            remedy: "less power, a smaller spot, or a beam that does not rest".to_owned(),
        })
    }

    /// Where a coarser run says nothing of the section.
    fn no_cell(&self) -> Option<Doubt> {
        self.empty.map(|variant| Doubt {
            reason: format!(
                "no cell of the run with {} lies in the section: nothing tells what cells change",
                variant.words()
            ),
            remedy: "finer cells (judge.cell)".to_owned(),
        })
    }

    fn in_part(&self) -> Option<Doubt> {
        self.judging.part.map(|_| Doubt {
            reason: "only judge.part was judged, not the whole section".to_owned(),
            remedy: "leave judge.part out".to_owned(),
        })
    }
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
                let left = 100.0 * of_all(&run.as_it_was, Class::Good);
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
