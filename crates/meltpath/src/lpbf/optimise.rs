//! The recipe search of a job: what is simulated, and what the verdict says of it.

use meltpath_base::number::significant;
use meltpath_base::{Check, Fact, Measure, Observer, Status};
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::interpolation::sample_count;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::measures::fill_rate::FillRate;
use meltpath_scan_head::measures::fill_share::FillShare;
use meltpath_scan_head::measures::hatch::HatchDistance;
use meltpath_scan_head::measures::outline::Outlines;
use meltpath_scan_head::search::{Bounds, Candidate, Found, MAY_LOSE, Marks, Problem, search};

use super::friction::unless_guessed;
use super::judge::fill_check;
use super::paced::unless_slowed;
use super::plan::Plan;
use super::result::{JUDGED, MODES, RecipeResult};
use super::strays;
use crate::lpbf::plan::work::Work;

/// Side of the squares that are simulated, at most, mm.
pub(crate) const SIDE: f64 = 5.0;

/// The work on which recipes are tried: two squares of at most [`SIDE`], or the piece of a layer that delays are tuned on.
fn small(work: &Work) -> Work {
    match work {
        Work::Plate(plate) => Work::Plate(SquarePlate {
            columns: 2,
            rows: 1,
            side: plate.side.min(SIDE),
            ..*plate
        }),
        Work::Layers(_) => work.clone(),
    }
}

/// Searches within the job's bounds, beginning with its first recipe.
pub(crate) fn run(
    plan: &Plan,
    bounds: &Bounds,
    observer: &dyn Observer,
) -> Result<Found, HeadError> {
    let settings = &plan.settings;
    let work = small(&plan.work);
    let spot = 2.0 * settings.data.head.beam.waist;
    let judged = &MODES[JUDGED..];
    let job = |recipe: &Recipe| work.tuning_job(recipe);
    let samples = |recipe: &Recipe, period: f64| {
        let layers = plan.work.layers(recipe)?;
        sample_count(layers, period)
    };
    let surface = |job: &ScanJob| match &work {
        Work::Plate(_) => spot,
        Work::Layers(set) => set.hatch.or_else(|| HatchDistance::of(job)).unwrap_or(spot),
    };
    let recipe = &settings.recipes[0];
    let problem = Problem {
        head: &settings.data.head,
        recipe,
        job: &job,
        fill: &|job| match &work {
            Work::Plate(plate) => FillRate::of_rectangles(plate.fill_areas(), spot, judged),
            // a piece of a layer fills no outline
            Work::Layers(_) => FillRate::of_layers(surface(job), Outlines::None, spot, judged),
        },
        samples: &samples,
    };
    search(&problem, bounds, observer)
}

/// What was found, as it did on the whole job.
pub(super) struct OnTheWhole<'a> {
    result: &'a RecipeResult<'a>,
    number: usize,
    /// The least fill rate; none where nothing bounds it.
    fill: Option<f64>,
}

impl<'a> OnTheWhole<'a> {
    /// `None` where nothing was found.
    pub(super) fn of(found: &Found, plan: &Plan, results: &'a [RecipeResult<'a>]) -> Option<Self> {
        let best = found.best.as_ref()?;
        let begun = results.first()?;
        // what was found is run after the recipes of the job, unless it is the first of them
        let result = if *best == found.start {
            begun
        } else {
            results.last()?
        };
        let written = plan.settings.search.as_ref().map(|b| b.fill_rate);
        let lost = |f: FillShare| strays::rate(plan, begun, &f).share - MAY_LOSE;
        let own = begun.fill(JUDGED).map(lost);
        Some(OnTheWhole {
            result,
            number: results
                .iter()
                .position(|r| std::ptr::eq(r, result))
                .map_or(0, |k| k + 1),
            fill: written.filter(|bound| !bound.is_nan()).or(own),
        })
    }

    /// Its fill rate against the bound of the search, where `[checks]` does not judge the same.
    pub(super) fn fill_check(&self, plan: &Plan) -> Option<Check> {
        let settings = &plan.settings;
        let bound = self.fill?;
        if settings.job.checks.fill_rate.is_some_and(|l| l.0 == bound) {
            return None;
        }
        let name = &self.result.recipe.name;
        let title = format!("{name}: fill rate against the bound of the search");
        let check = fill_check(plan, self.result, (FILL, &title), bound)?;
        let remedy =
            "a lower optimise.fill_rate, slower fills in optimise.fill_speed, or a closer hatch";
        let check = unless_guessed(check.remedy(remedy), settings);
        Some(unless_slowed(check, self.result.survey))
    }

    /// The worst that its checks say, and which one says it: all that are of this recipe, and the bound of its fill rate.
    fn worst<'c>(&self, checks: &'c [Check]) -> Option<&'c Check> {
        let number = self.number.to_string();
        let own =
            |c: &&Check| c.id == FILL || c.id.rsplit_once('-').is_some_and(|(_, of)| of == number);
        checks.iter().filter(own).max_by_key(|c| c.status)
    }
}

/// The check of the found recipe's fill rate.
const FILL: &str = "optimise-fill";

/// Tells what the search found: a fact, or what is to be looked at where nothing keeps the bounds.
pub(super) fn tell(
    found: &Found,
    whole: Option<&OnTheWhole<'_>>,
    checks: &mut Vec<Check>,
    facts: &mut Vec<Fact>,
) {
    const ID: &str = "optimise";
    let Some(best) = &found.best else {
        let near = found.nearest();
        let reason = format!(
            "none of {} recipes keeps the bounds; the nearest has {:.1} % of its way along contours and {:.1} % of its fill within them, up to {} mm of contours without light and up to {} mm of light where no mark is; the bounds are {:.1} and {:.1} %, {} and {} mm",
            found.tried.len(),
            100.0 * near.contour_share,
            100.0 * near.fill_rate,
            significant(near.unlit, 3),
            significant(near.stray, 3),
            100.0 * found.bounds.contour_share,
            100.0 * found.bounds.fill_rate,
            significant(found.most_unlit, 3),
            significant(near.most_stray, 3)
        );
        let check = Check {
            status: Status::Warn,
            ..Check::not_checked(ID, "a recipe within the bounds", &reason)
        };
        let fills = |c: &Candidate| c.fill_rate >= found.bounds.fill_rate;
        checks.push(check.remedy(if found.tried.iter().any(fills) {
            "lower the limits in [checks], or give [optimise] slower speeds, longer waits or other filters"
        } else {
            "no speed that was tried fills so much: a closer hatch, or a lower fill_rate in [optimise] or [checks]"
        }));
        return;
    };
    let worst = whole.and_then(|w| w.worst(checks));
    let title = match worst.map(|c| c.status) {
        Some(Status::Pass | Status::Warn | Status::NotChecked) => {
            "time saved by the fastest recipe within the bounds"
        }
        None | Some(Status::CannotSay) => {
            "time saved by the recipe found; whether the whole job keeps the bounds cannot be said"
        }
        Some(Status::Fail) => {
            "time saved by the recipe found, which keeps the bounds where it was searched, not on the whole job"
        }
    };
    let saved = 100.0 * (1.0 - best.duration / found.start.duration);
    let words = if *best == found.start {
        "the first recipe is the fastest tried".to_owned()
    } else {
        found_words(best, found.marks)
    };
    let beyond = worst.filter(|c| matches!(c.status, Status::Fail | Status::CannotSay));
    let words = beyond.map_or(words.clone(), |check| {
        format!("{words}; {}: {}", check.status.words(), check.title)
    });
    facts.push(Fact::new(ID, title, Measure::exact(saved, "%"), &words));
}

/// What was found, in words; of what was not tried, that it stays.
fn found_words(best: &Candidate, marks: Marks) -> String {
    let speed = |what: &str, speed: f64, tried: bool| {
        if tried {
            format!("{what} at {speed:.0} mm/s")
        } else {
            format!("{what} left at the recipe's {speed:.0} mm/s, as none were tried")
        }
    };
    format!(
        "{}, {}, {:.2} ms after marks{}",
        speed("contours", best.recipe.contour_speed, marks.contours),
        speed("fills", best.recipe.fill_speed, marks.fills),
        1e3 * best.recipe.mark_wait,
        filter_words(best)
    )
}

fn filter_words(c: &Candidate) -> String {
    if c.filter_factor == 1.0 {
        String::new()
    } else {
        format!(
            ", first filter of the mirrors at {:.0} %",
            100.0 * c.filter_factor
        )
    }
}
