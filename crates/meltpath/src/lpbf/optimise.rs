//! The recipe search of a job: what is simulated, and what the verdict says of it.

use meltpath_base::{Check, Fact, Measure, Observer, Status};
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::interpolation::sample_count;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::measures::fill_rate::FillRate;
use meltpath_scan_head::measures::hatch::HatchDistance;
use meltpath_scan_head::search::{Bounds, Candidate, Found, Problem, search};

use super::plan::Plan;
use super::result::MODES;
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
    let judged = &MODES[2..];
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
            Work::Layers(_) => FillRate::of_layers(surface(job), spot, judged),
        },
        samples: &samples,
    };
    search(&problem, bounds, observer)
}

/// Tells what the search found: a fact, or what is to be looked at where nothing keeps the bounds.
pub(crate) fn tell(found: &Found, checks: &mut Vec<Check>, facts: &mut Vec<Fact>) {
    const ID: &str = "optimise";
    const TITLE: &str = "time saved by the fastest recipe within the bounds";
    let Some(best) = &found.best else {
        let near = found.nearest();
        let reason = format!(
            "none of {} recipes keeps the bounds; the nearest has {:.1} % of its way along contours and {:.1} % of its fill within them, the bounds are {:.1} and {:.1} %",
            found.tried.len(),
            100.0 * near.contour_share,
            100.0 * near.fill_rate,
            100.0 * found.bounds.contour_share,
            100.0 * found.bounds.fill_rate
        );
        let check = Check {
            status: Status::Warn,
            ..Check::not_checked(ID, "a recipe within the bounds", &reason)
        };
        checks.push(check.remedy("lower the limits in [checks], or give [optimise] slower speeds, longer waits or other filters"));
        return;
    };
    let saved = 100.0 * (1.0 - best.duration / found.start.duration);
    let words = if *best == found.start {
        "the first recipe is the fastest tried".to_owned()
    } else {
        format!(
            "contours at {:.0} mm/s, fills at {:.0} mm/s, {:.2} ms after marks{}",
            best.recipe.contour_speed,
            best.recipe.fill_speed,
            1e3 * best.recipe.mark_wait,
            filter_words(best)
        )
    };
    facts.push(Fact::new(ID, TITLE, Measure::exact(saved, "%"), &words));
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
