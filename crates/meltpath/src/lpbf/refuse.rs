//! What of a scan-head job cannot run, told at the place of the job where it is written.

use meltpath_base::Length;
use meltpath_base::number::significant;
use meltpath_base::settings::Problem;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::recipe::Recipe;
use meltpath_scan_head::head::survey::Survey;
use meltpath_scan_head::optics::correction::CorrectionError;
use meltpath_scan_head::optics::geometry::GeometryError;

use super::plan::Plan;
use super::{defocus, friction};
use crate::job::lpbf::{DelayChoice, LpbfJob};
use crate::lpbf::plan::work::{Source, Work};
use crate::tune::choose::ready_for;

/// Longest time of a job on the head, s: a day.
const LONGEST_JOB: f64 = 86_400.0;
/// Marks of a file that all lie within less are told in another unit, mm: no laser's spot is as small.
const SMALLEST: f64 = 0.01;

/// Looks through the job of each recipe; refuses a head that cannot be built, squares that are none, and work that leaves the field.
///
/// # Errors
/// [`Problem`] with the place in the job and what to change.
pub(super) fn check(job: &LpbfJob, plan: &Plan) -> Result<Vec<Survey>, Problem> {
    let name = &job.lpbf.head;
    let ready = plan.settings.data.head.ready();
    let head = ready.and_then(|head| head.check_stable().map(|()| head));
    let head = head.map_err(|e| {
        let message = format!("\"{}\" is not sound: {e}", **name);
        name.problem(message).help(head_help(&e))
    })?;
    let ends = friction::ends(&plan.settings.data).into_iter().flatten();
    for (drags, end) in ends.zip(["least", "most"]) {
        let held = head.clone().held_by(drags);
        held.and_then(|held| held.check_stable()).map_err(|e| {
            let message = format!("\"{}\" is not sound with its {end} friction: {e}", **name);
            name.problem(message).help(head_help(&e))
        })?;
    }
    let mut surveys = Vec::with_capacity(plan.settings.recipes.len());
    for (recipe, name) in plan.settings.recipes.iter().zip(job.lpbf.recipes.iter()) {
        if let Some(message) = too_long(recipe, plan) {
            let problem = Problem::new(format!("\"{}\" cannot run: {message}", name.get_ref()));
            let help = "write delays that the head takes, or lpbf.delays = \"tuned\"; where its controller takes longer ones, longest_laser_delay in [head] of its file";
            return Err(problem.at(name.span()).help(help));
        }
        let refused = |what: &str, e: &HeadError| {
            Problem::new(format!("\"{}\" cannot run{what}: {e}", name.get_ref())).at(name.span())
        };
        let layers = || plan.work.layers(recipe);
        let survey = layers().and_then(|layers| head.survey(layers));
        let survey = survey.map_err(|e| match &e {
            HeadError::Field { .. } => outside(job, plan, recipe, &e),
            HeadError::Job(_) | HeadError::Layer(_) => unsound(job, plan, &e),
            _ => refused("", &e),
        })?;
        let problem = too_small(job, plan, survey.extent);
        if let Some(problem) = problem.or_else(|| defocus::refused(job, plan, &survey)) {
            return Err(problem);
        }
        let time = survey.samples as f64 * plan.settings.data.head.period;
        if time > LONGEST_JOB {
            return Err(endless(job, plan, name.get_ref(), time));
        }
        surveys.push(survey);
        layers()
            .and_then(|layers| ready_for(&head, *plan.settings.job.lpbf.path, layers))
            .map_err(|e| refused(" with lpbf.path", &e))?;
    }
    Ok(surveys)
}

/// A job that would keep the head, and this machine, for days.
fn endless(job: &LpbfJob, plan: &Plan, recipe: &str, time: f64) -> Problem {
    let message = format!(
        "with \"{recipe}\" the job takes the head {} h, more than a day",
        significant(time / 3600.0, 3)
    );
    match &plan.work {
        Work::Plate(_) => job
            .plate
            .problem(message)
            .help("fewer squares in plate.block"),
        Work::Layers(set) => match &set.source {
            Source::File(_) => job.lpbf.layers.problem(message).help(
                "look for waits and speeds of a wrong unit, or run fewer layers: [layers] range",
            ),
            Source::Part(_) => job
                .part
                .problem(message)
                .help("fewer layers in section.layers, or a wider hatch"),
        },
    }
}

/// What is wrong with a recipe whose own delays the head does not take.
fn too_long(recipe: &Recipe, plan: &Plan) -> Option<String> {
    let head = &plan.settings.data.head;
    let longest = head.delays_up_to();
    let written = recipe.delays.on.max(recipe.delays.off);
    let run = *plan.settings.job.lpbf.delays == DelayChoice::Recipe;
    let whose = match head.longest_delay {
        Some(_) => "the head's longest_laser_delay",
        None => "any delay of a head whose file tells no longest_laser_delay",
    };
    (run && written > longest).then(|| {
        format!(
            "its laser delay of {:.0} µs is longer than {whose}, {:.0} µs",
            1e6 * written,
            1e6 * longest
        )
    })
}

/// Squares or layers that are no job.
fn unsound(job: &LpbfJob, plan: &Plan, error: &HeadError) -> Problem {
    match &plan.work {
        Work::Plate(_) => job
            .plate
            .problem(error.to_string())
            .help("change it in [plate], or in the plate of the head's file"),
        Work::Layers(set) => match &set.source {
            Source::File(_) => job
                .lpbf
                .layers
                .problem(error.to_string())
                .help("change it in the layers"),
            Source::Part(_) => job
                .part
                .problem(error.to_string())
                .help("change [section] or [hatch]"),
        },
    }
}

/// Layers of a file whose marks all lie within less than a spot: their unit is another one.
fn too_small(job: &LpbfJob, plan: &Plan, extent: f64) -> Option<Problem> {
    let of_file = matches!(&plan.work, Work::Layers(set) if matches!(set.source, Source::File(_)));
    (of_file && extent < SMALLEST).then(|| {
        let message = format!(
            "all marks lie within {:.2} µm, less than any spot of a laser",
            1e3 * extent
        );
        job.lpbf
            .layers
            .problem(message)
            .help("is the unit right? A CLI file's `$$UNITS/1` means that its coordinates are millimetres, `$$UNITS/1000` metres")
    })
}

fn head_help(error: &HeadError) -> &'static str {
    match error {
        HeadError::Geometry(GeometryError::Travel { axis: 'Z', .. }) => {
            "the cam must focus over the whole field: a larger focus.cam_radius, other lenses, a smaller head.field, or the travel that it has"
        }
        HeadError::Correction(CorrectionError::Geometry(GeometryError::Travel { .. })) => {
            "the mirrors must reach the whole field: a smaller head.field, or the travel that they have"
        }
        HeadError::Axis {
            source: AxisError::Oscillates { .. } | AxisError::RanAway { .. },
            ..
        } => {
            "lpbf.controller: one that was tuned on this head (`meltpath tune`); or slower loops or a shorter delay in the table of that axis"
        }
        HeadError::Axis { .. } => "change it in the table of that axis in the head's file",
        _ => "change it in [geometry], [focus] or [head] of the head's file",
    }
}

/// Work beyond the field: where it lies, and what moves it.
fn outside(job: &LpbfJob, plan: &Plan, recipe: &Recipe, error: &HeadError) -> Problem {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for layer in plan.work.layers(recipe).into_iter().flatten().flatten() {
        let ends = layer.job.vectors.iter().map(|v| v.end);
        for p in ends.chain([layer.job.start]).map(DVec3::truncate) {
            (low, high) = (low.min(p), high.max(p));
        }
    }
    let half = plan.settings.data.head.half_field;
    let lies = format!(
        "it lies from ({:.1}, {:.1}) to ({:.1}, {:.1}) mm, the field reaches ±{half:.1} mm",
        low.x, low.y, high.x, high.y
    );
    let set = match &plan.work {
        Work::Plate(_) => {
            let message = format!("the plate leaves the head's field: {error}");
            return job.plate.problem(message).help(format!(
                "{lies}: fewer squares in plate.block, a smaller plate.side, or shorter runs of sky-writing"
            ));
        }
        Work::Layers(set) => set,
    };
    let written = |origin: [Length; 2]| DVec2::from_array(origin.map(|l| l.0));
    let (setting, table, now) = match &set.source {
        Source::File(_) => (
            &job.lpbf.layers,
            "layers",
            Some(written(*job.layers.origin)),
        ),
        // without an origin it lies in the middle already
        Source::Part(_) => (&job.part, "section", job.section.origin.map(written)),
    };
    let message = format!("\"{}\" leaves the head's field: {error}", set.file);
    let fits = now.filter(|_| (high - low).max_element() < 2.0 * half);
    setting.problem(message).help(match fits {
        Some(now) => {
            let at = now + 0.5 * (low + high);
            format!(
                "{lies}: put its middle at the centre of the field with [{table}] origin = [\"{:.1} mm\", \"{:.1} mm\"]",
                at.x, at.y
            )
        }
        None => format!("{lies}: it is larger than the field; cut it, or take a larger head"),
    })
}
