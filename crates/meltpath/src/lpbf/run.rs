//! The chain from a job file to a folder of results.

use std::path::Path;

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Check, Observer, Quiet, Reporter, Status, Verdict};
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::gate::Darkness;
use meltpath_scan_head::head::motion::AsMotion;
use meltpath_scan_head::head::ready::ReadyHead;
use meltpath_scan_head::head::recipe::{LaserDelays, Recipe};
use meltpath_scan_head::head::run::RunSummary;
use meltpath_scan_head::head::survey::Survey;
use meltpath_scan_head::measures::contour_error::PathErrors;
use meltpath_scan_head::measures::dark_way::LightReach;
use meltpath_scan_head::measures::delays::{DelayScore, DelayTuning, HitRecord, Tuned};
use meltpath_scan_head::measures::energy::EnergyAlong;
use meltpath_scan_head::measures::fill_rate::FillRate;
use meltpath_scan_head::measures::fill_share::FillShare;
use meltpath_scan_head::measures::stray_light::StrayLight;
use meltpath_scan_head::search::with_filter;
use meltpath_toolpath::MotionSink;

use super::error::LpbfError;
use super::friction;
use super::heat::{self, BeamRecord, InLight, LitPace, Looked, RecipeHeat};
use super::judge::{checks, foretold};
use super::plan::{Plan, plan};
use super::result::{AtEnd, JUDGED, MODES, Path2d, RecipeResult};
use super::settings;
use super::{left_out, marked_again, motion, optimise, refuse, toolpath_file};
use crate::job::lpbf::DelayChoice;
use crate::job::{JobError, LpbfJob, Written};
use crate::lpbf::plan::file_layers::LEFT_TO_THE_JOB;
use crate::lpbf::plan::work::Work;
use crate::lpbf::strays;
use crate::outcome::{Examined, Outcome, RunFolder};
use crate::tune::choose::ready_for;
use crate::views;

/// Lit points are compared with marks commanded at most this long before, s: longer than any lag and off-delay.
const WINDOW: f64 = 4e-3;
/// Step of the delays that are paired in the table of trade-offs, s.
const FRONT_STEP: f64 = 40e-6;
/// Share of the way in light from which on that in jumps is told: less is the beginnings and ends of marks.
const JUMPED: f64 = 0.05;
/// The largest angles that the mirrors X and Y reach, rad.
#[derive(Debug, Default)]
struct Reach([f64; 2]);

impl HeadSink for Reach {
    fn block(&mut self, block: &HeadBlock) {
        for (most, axis) in self.0.iter_mut().zip(&block.axes) {
            *most = axis.angle.iter().fold(*most, |m, a| m.max(a.abs()));
        }
    }
}

/// What was marked at an end of the friction's range.
struct EndMarked {
    errors: PathErrors,
    fill: Option<FillShare>,
    light: Option<InLight>,
}

/// The whole chain.
///
/// # Errors
/// [`LpbfError`]; nothing is written then.
pub fn run(
    path: &Path,
    job: &Written<LpbfJob>,
    text: &str,
    home: RunFolder,
    observer: &dyn Observer,
) -> Result<Outcome, LpbfError> {
    let reporter = Reporter::new();
    let here = path.parent().unwrap_or(Path::new(""));
    let (plan, mut surveys) = resolved(path, job, text, observer)?;
    let settings = &plan.settings;
    let folder = home.create()?;
    let said = plan.warnings.iter();
    said.for_each(|w| reporter.push(w.clone()));
    tell_of_controllers(settings, &reporter);
    let head = settings.data.head.ready()?;
    let found = match &settings.search {
        Some(bounds) => Some(optimise::run(&plan, bounds, observer)?),
        None => None,
    };
    // the first recipe itself is run anyway
    let best = found
        .as_ref()
        .and_then(|f| f.best.as_ref().filter(|b| **b != f.start));
    let mut recipes = settings.recipes.clone();
    recipes.extend(best.map(|c| c.recipe.clone()));
    let other_head = match best {
        Some(c) => Some(with_filter(&settings.data.head, c.filter_factor).ready()?),
        None => None,
    };
    let mut heads = Vec::with_capacity(recipes.len());
    for (k, recipe) in recipes.iter().enumerate() {
        let optimised = k == settings.recipes.len();
        let plain = other_head.as_ref().filter(|_| optimised).unwrap_or(&head);
        if optimised {
            surveys.push(plain.survey(plan.work.layers(recipe)?)?);
        }
        let layers = plan.work.layers(recipe)?;
        heads.push(ready_for(plain, *settings.job.lpbf.path, layers)?);
    }
    if settings.job.output.toolpath.is_some() {
        let named = (&*views::lpbf::title(path), &plan.work);
        for (k, recipe) in recipes.iter().enumerate() {
            toolpath_file::write(&folder, k + 1, named, recipe)?;
        }
    }
    let mut results = Vec::with_capacity(recipes.len());
    for (k, (recipe, (head, survey))) in recipes.iter().zip(heads.iter().zip(&surveys)).enumerate()
    {
        let run = Run {
            number: k + 1,
            head,
            plan: &plan,
            recipe,
            survey,
            reporter: &reporter,
            observer,
        };
        results.push(match *settings.job.output.motion {
            None => run.execute(None)?,
            Some(form) => {
                let name = format!("series/motion-{}", k + 1);
                motion::write_while(&folder, &name, form, |sink| run.execute(Some(sink)))??
            }
        });
    }
    let mut checks = checks(&plan, &results, &reporter);
    checks.extend(plan.enclosed.checks.clone());
    checks.extend(plan.left_out.clone());
    let whole = found
        .as_ref()
        .and_then(|f| optimise::OnTheWhole::of(f, &plan, &results));
    checks.extend(whole.as_ref().and_then(|w| w.fill_check(&plan)));
    undecided(&mut checks, &plan.work);
    let mut facts = views::lpbf::facts(&plan, &results);
    if let Some(found) = &found {
        optimise::tell(found, whole.as_ref(), &mut checks, &mut facts);
    }
    let verdict = Verdict {
        checks,
        facts,
        warnings: reporter.digest(3),
    };
    let mut provenance = settings.provenance.clone();
    let layers = job.lpbf.layers.as_ref().map(|f| here.join(&**f));
    let mut inputs = vec![path];
    let part = job.part.as_ref().map(|f| here.join(&**f));
    inputs.extend(layers.as_deref().into_iter().chain(part.as_deref()));
    crate::outcome::record_inputs(&mut provenance, &inputs)?;
    observer.stage("write results", 0);
    let title = views::lpbf::title(path);
    let told = views::lpbf::Told {
        plan: &plan,
        results: &results,
        found: found.as_ref(),
    };
    views::lpbf::write(&folder, &title, &told, &verdict, &provenance)?;
    crate::inputs::write(&folder, path, text, &[])?;
    observer.check()?;
    Ok(Outcome {
        folder: commit(folder)?,
        verdict,
    })
}

/// Notes of controllers that were made for other motors.
fn tell_of_controllers(settings: &settings::Settings, reporter: &Reporter) {
    for letter in &settings.foreign {
        reporter.warn(
            "controller-other-motor",
            format!(
                "the controller of the {} axis was made for another motor than the head's",
                letter.to_ascii_uppercase()
            ),
            "tune on the head's own motor",
        );
    }
}

/// Takes the decision from checks of marks that say more than is followed.
fn undecided(checks: &mut [Check], work: &Work) {
    let said = work.not_followed();
    if said.is_empty() {
        return;
    }
    for check in checks.iter_mut().filter(|c| c.status != Status::NotChecked) {
        check.status = Status::CannotSay;
        check.reason = format!(
            "not all that the file says is followed: {}",
            said.join("; ")
        );
        check.remedy = Some(LEFT_TO_THE_JOB.to_owned());
    }
}

fn commit(folder: OutputFolder) -> Result<std::path::PathBuf, OutputError> {
    folder.commit()
}

/// One recipe to be executed.
struct Run<'a> {
    number: usize,
    head: &'a ReadyHead,
    plan: &'a Plan,
    recipe: &'a Recipe,
    survey: &'a Survey,
    reporter: &'a Reporter,
    observer: &'a dyn Observer,
}

impl<'a> Run<'a> {
    /// Tunes the delays where the job asks for it; `None` else.
    fn tuned(&self) -> Result<Option<(Tuned, Vec<DelayScore>)>, LpbfError> {
        if *self.plan.settings.job.lpbf.delays == DelayChoice::Recipe {
            return Ok(None);
        }
        let (head, recipe) = (self.head, self.recipe);
        let period = head.head().period;
        let job = self.plan.work.tuning_job(recipe)?;
        let mut record = HitRecord::default();
        head.run(&job, recipe.delays, 1, self.observer, &mut record)?;
        let (radius, longest) = (head.head().beam.waist, head.head().delays_up_to());
        let tuning = DelayTuning::new(&job, &record.hits, period, longest, radius);
        let layers = self.plan.work.layers(recipe)?;
        let tuned = tuning.tune(Darkness::of(layers, recipe.delays, period)?.shortest);
        if tuned.held {
            self.reporter.warn(
                "spurious-light",
                format!(
                    "{}: {:.2} mm of spurious light stay at the starts of marks of the tuning squares: a laser-on delay that avoids it would leave marks dark",
                    recipe.name, tuned.best.spurious_start
                ),
                "let the mirrors settle instead: a wait after jumps, slower jumps, or a run up to the lines (run_in)",
            );
        }
        if tuned.best.delays.on.max(tuned.best.delays.off) > longest - 2.0 * period {
            self.reporter.warn(
                "delays-long",
                format!(
                    "{}: the tuned laser delays reach the longest tried, {:.0} µs",
                    recipe.name,
                    longest * 1e6
                ),
                "longer waits after marks and jumps let the axes settle",
            );
        }
        let step = (FRONT_STEP / period).round().max(1.0) as usize;
        Ok(Some((tuned, tuning.pareto(step))))
    }

    fn execute(
        &self,
        motion: Option<&mut (dyn MotionSink + Send)>,
    ) -> Result<RecipeResult<'a>, LpbfError> {
        let spot = 2.0 * self.head.head().beam.waist;
        let (short, lost) = (self.survey.short, self.survey.lost);
        if short > 0 {
            self.reporter.warn(
                "short-marks",
                format!(
                    "{}: {short} marks are shorter than a sample of the head at their speed; each takes a whole sample, {:.1} ms in all",
                    self.recipe.name,
                    1e3 * lost
                ),
                "export curves with longer chords, or mark slower",
            );
        }
        let named = (self.number, self.recipe.name.as_str());
        marked_again::tell(named, self.survey, self.heat(), self.reporter);
        let (tuned, front) = self
            .tuned()?
            .map_or_else(Default::default, |(t, f)| (Some(t), f));
        let delays = tuned.as_ref().map_or(self.recipe.delays, |t| t.best.delays);
        let darkness = self.judge_delays(delays)?;
        let law = self.recipe.power_law;
        let (hatch, fill) = self.surface();
        let first = self.plan.work.shown(&self.survey.first);
        let last = first.vectors.len().saturating_sub(1) as u32;
        let looked = self.looked()?;
        let mut record = self.recorded(looked.as_ref());
        let wanted = motion.is_some() || record.is_some();
        let mut motion = (motion, record.as_mut());
        let mut sinks = (
            (
                self.errors(),
                (EnergyAlong::new(law, spot), Reach::default()),
            ),
            (
                (
                    fill,
                    Path2d {
                        last,
                        ..Path2d::default()
                    },
                ),
                (self.pace(), wanted.then(|| AsMotion::new(law, &mut motion))),
            ),
        );
        let how = (delays, self.survey.samples);
        let (ran, ended) = rayon::join(
            || {
                let layers = self.plan.work.layers(self.recipe)?;
                self.head
                    .run_layers(layers, how, 1, self.observer, &mut sinks)
            },
            || self.at_ends(delays, looked.as_ref()),
        );
        let RunSummary { duration, .. } = ran?;
        let ((errors, (energy, reach)), ((fill, path), (pace, _))) = sinks;
        self.judge_reach(&reach);
        self.judge_bridges(delays, &darkness, &errors.stray);
        heat::tell_waits(&self.recipe.name, (&first, law), self.reporter);
        let settings = self.heat();
        let hatch = self.apart(looked.as_ref(), hatch);
        let light = self.in_light(record, pace.as_ref());
        let heat = match (settings, looked.as_ref(), light) {
            (Some(settings), Some(looked), Some(light)) => {
                Some(heat::melt(settings, looked, light, hatch, self.observer)?)
            }
            _ => None,
        };
        let ends = match ended {
            None => None,
            Some(ends) => {
                let as_judged = looked.as_ref().zip(heat.as_ref());
                let [least, most] = ends.map(|end| self.melted(end?, as_judged, hatch));
                Some([least?, most?])
            }
        };
        Ok(RecipeResult {
            recipe: self.recipe,
            survey: self.survey,
            first,
            delays,
            darkness,
            tuned,
            front,
            duration,
            errors,
            energy,
            areas: fill.finish(),
            path,
            heat,
            ends,
        })
    }

    fn heat(&self) -> Option<&'a heat::HeatSettings> {
        self.plan.settings.heat.as_ref()
    }

    /// What is looked at where the job asks what melts.
    fn looked(&self) -> Result<Option<Looked>, HeadError> {
        let heat = self.heat();
        let look = |settings| heat::look(settings, &self.plan.work, self.recipe, self.survey);
        heat.map(look).transpose()
    }

    /// What keeps the beam of that.
    fn recorded(&self, looked: Option<&Looked>) -> Option<BeamRecord> {
        let (settings, looked) = (self.heat()?, looked?);
        let vectors = [looked.first, looked.last()];
        Some(BeamRecord::new(vectors, settings.marks, settings.spot))
    }

    /// What looks at the pace of the spot, where the job asks what melts.
    fn pace(&self) -> Option<LitPace<'a>> {
        let settings = self.heat()?;
        Some(LitPace::new(settings, self.recipe.power_law))
    }

    fn in_light(&self, record: Option<BeamRecord>, pace: Option<&LitPace<'_>>) -> Option<InLight> {
        Some(InLight {
            law: self.recipe.power_law,
            record: record?,
            pace: pace?.found(),
        })
    }

    /// Distance of the lines of what is looked at, mm: as the job says it, else its own, else that of all.
    fn apart(&self, looked: Option<&Looked>, all: f64) -> f64 {
        match &self.plan.work {
            Work::Layers(set) if set.hatch.is_none() => {
                looked.and_then(|l| l.spacing).unwrap_or(all)
            }
            _ => all,
        }
    }

    /// What measures the way along contours.
    fn errors(&self) -> PathErrors {
        let head = self.head.head();
        let bound = self.plan.settings.job.checks.contour_error.0;
        PathErrors::new(
            WINDOW,
            head.period,
            LightReach::of(2.0 * head.beam.waist, bound),
        )
    }

    /// Distance of the lines, mm, and what measures the fill.
    fn surface(&self) -> (f64, FillRate) {
        let spot = 2.0 * self.head.head().beam.waist;
        let work = &self.plan.work;
        let hatch = match work {
            Work::Plate(plate) => plate.hatch,
            Work::Layers(set) => set.hatch.or(self.survey.hatch).unwrap_or(spot),
        };
        (hatch, work.fill(hatch, spot, &MODES))
    }

    /// What is judged, with the least and with the most friction of the head's file, and the delays of its value; `None` where it
    /// states no range. Of the beam that of what is looked at is kept.
    fn at_ends(
        &self,
        delays: LaserDelays,
        looked: Option<&Looked>,
    ) -> Option<[Result<EndMarked, HeadError>; 2]> {
        let [least, most] = friction::ends(&self.plan.settings.data)?;
        let run = |drags| self.at_end(&self.head.clone().held_by(drags)?, delays, looked);
        let (least, most) = rayon::join(|| run(least), || run(most));
        Some([least, most])
    }

    fn at_end(
        &self,
        head: &ReadyHead,
        delays: LaserDelays,
        looked: Option<&Looked>,
    ) -> Result<EndMarked, HeadError> {
        let mut record = self.recorded(looked);
        let errors = self.errors();
        let motion = record
            .as_mut()
            .map(|r| AsMotion::new(self.recipe.power_law, r));
        let mut sinks = (errors, (self.surface().1, (self.pace(), motion)));
        let layers = self.plan.work.layers(self.recipe)?;
        let how = (delays, self.survey.samples);
        head.run_layers(layers, how, 1, &Quiet(self.observer), &mut sinks)?;
        let (errors, (fill, (pace, _))) = sinks;
        Ok(EndMarked {
            errors,
            fill: FillShare::of(&fill.finish(), JUDGED),
            light: self.in_light(record, pace.as_ref()),
        })
    }

    /// What an end of the friction's range melts, where the job asks for it.
    fn melted(
        &self,
        end: EndMarked,
        as_judged: Option<(&Looked, &RecipeHeat)>,
        hatch: f64,
    ) -> Result<AtEnd, LpbfError> {
        let settings = self.heat();
        let heat = match (settings, as_judged, end.light) {
            (Some(settings), Some((looked, value)), Some(light)) => {
                let observer = &Quiet(self.observer);
                let again = heat::melt_otherwise(settings, value, looked, light, hatch, observer);
                Some(again?)
            }
            _ => None,
        };
        Ok(AtEnd {
            errors: end.errors,
            fill: end.fill,
            heat,
        })
    }

    /// Refuses delays that leave every mark dark.
    fn judge_delays(&self, delays: LaserDelays) -> Result<Darkness, HeadError> {
        let layers = self.plan.work.layers(self.recipe)?;
        let darkness = Darkness::of(layers, delays, self.head.head().period)?;
        if darkness.dark == darkness.chains {
            return Err(HeadError::Dark {
                on: delays.on,
                off: delays.off,
                longest: darkness.longest,
            });
        }
        Ok(darkness)
    }

    /// Tells delays that keep the light on between marks.
    fn judge_bridges(&self, delays: LaserDelays, darkness: &Darkness, stray: &StrayLight) {
        let Darkness {
            chains, bridged, ..
        } = darkness;
        let jumped = stray.jumped_share();
        if *bridged == 0 && jumped <= JUMPED {
            return;
        }
        let name = &self.recipe.name;
        self.reporter.warn(
            "light-between-marks",
            format!(
                "{name}: the light stays on between {bridged} of {chains} marks, and {:.0} % of the way in light is that of jumps: the laser-off delay is {:.0} µs",
                100.0 * jumped,
                1e6 * delays.off
            ),
            "a shorter laser-off delay, or a longer wait after marks",
        );
    }

    /// Tells mirrors that left their travel.
    fn judge_reach(&self, reach: &Reach) {
        let axes = &self.head.head().mirrors;
        for ((axis, letter), &angle) in axes.iter().zip(['X', 'Y']).zip(&reach.0) {
            if angle > axis.travel() {
                self.reporter.warn(
                    "beyond-travel",
                    format!(
                        "{}: the {letter} mirror turns to {:.2} deg, its travel is ±{:.2} deg: there it strikes its stop, which is not simulated",
                        self.recipe.name,
                        angle.to_degrees(),
                        axis.travel().to_degrees()
                    ),
                    "work nearer the centre of the field, slower jumps, or a controller that does not ring",
                );
            }
        }
    }
}

/// What is resolved in a job.
///
/// # Errors
/// [`LpbfError`] for whatever a run refuses before it computes.
pub fn examine(
    job_file: &Path,
    job: &Written<LpbfJob>,
    text: &str,
    observer: &dyn Observer,
) -> Result<Examined, LpbfError> {
    let (plan, surveys) = resolved(job_file, job, text, observer)?;
    Ok(Examined {
        notes: foretold(&plan, &surveys)?,
        provenance: plan.settings.provenance,
        warnings: plan.warnings,
    })
}

/// The plan, and what the job of each recipe is.
fn resolved(
    job_file: &Path,
    job: &Written<LpbfJob>,
    text: &str,
    observer: &dyn Observer,
) -> Result<(Plan, Vec<Survey>), LpbfError> {
    let here = job_file.parent().unwrap_or(Path::new(""));
    let found = settings::resolve(job, here).and_then(|settings| {
        let mut plan = plan(settings, job, here, observer)?;
        let surveys = refuse::check(job, &plan)?;
        let hatch = surveys.iter().find_map(|s| s.hatch);
        plan.enclosed = strays::enclosure(&plan, hatch);
        plan.left_out = left_out::check(&plan);
        Ok((plan, surveys))
    });
    found.map_err(|problems| match observer.check() {
        // whatever reading the part says of it, the job is not to blame
        Err(cancelled) => cancelled.into(),
        Ok(()) => JobError::in_file(job_file, text, problems).into(),
    })
}
