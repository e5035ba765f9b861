//! What of a scan-head job cannot run, told at the place of the job where it is written.

use meltpath_base::settings::Problem;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::optics::correction::CorrectionError;
use meltpath_scan_head::optics::geometry::GeometryError;

use super::settings::Settings;
use super::work::Work;
use crate::job::lpbf::LpbfJob;
use crate::tune::choose::ready_for;

/// Refuses a head that cannot be built, squares that are none, and work that leaves the field.
///
/// # Errors
/// [`Problem`] with the place in the job and what to change.
pub(super) fn check(job: &LpbfJob, settings: &Settings) -> Result<(), Problem> {
    let name = &job.lpbf.head;
    let head = settings.data.head.ready().map_err(|e| {
        let message = format!("\"{}\" is not sound: {e}", **name);
        name.problem(message).help(head_help(&e))
    })?;
    for (recipe, name) in settings.recipes.iter().zip(job.lpbf.recipes.iter()) {
        let refused = |what: &str, e: &HeadError| {
            Problem::new(format!("\"{}\" cannot run{what}: {e}", name.get_ref())).at(name.span())
        };
        let prepared = settings.work.job(recipe).map_err(|e| match settings.work {
            Work::Plate(_) => job
                .plate
                .problem(e.to_string())
                .help("change it in [plate], or in the plate of the head's file"),
            Work::Layers(_) => job
                .lpbf
                .layers
                .problem(e.to_string())
                .help("change it in the layers"),
        })?;
        head.check(&prepared.job).map_err(|e| match &e {
            HeadError::Field { .. } => outside(job, settings, &prepared.job, &e),
            _ => refused("", &e),
        })?;
        ready_for(&head, settings.path, &prepared.job)
            .map_err(|e| refused(" with lpbf.path", &e))?;
    }
    Ok(())
}

fn head_help(error: &HeadError) -> &'static str {
    match error {
        HeadError::Geometry(GeometryError::Travel { axis: 'Z', .. }) => {
            "the cam must focus over the whole field: a larger focus.cam_radius, other lenses, a smaller head.field, or the travel that it has"
        }
        HeadError::Correction(CorrectionError::Geometry(GeometryError::Travel { .. })) => {
            "the mirrors must reach the whole field: a smaller head.field, or the travel that they have"
        }
        HeadError::Axis { .. } => "change it in the table of that axis in the head's file",
        _ => "change it in [geometry], [focus] or [head] of the head's file",
    }
}

/// Work beyond the field: where it lies, and what moves it.
fn outside(job: &LpbfJob, settings: &Settings, scan: &ScanJob, error: &HeadError) -> Problem {
    let ends = scan.vectors.iter().map(|v| v.end);
    let (low, high) = ends
        .chain([scan.start])
        .map(DVec3::truncate)
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    let half = settings.data.head.half_field;
    let lies = format!(
        "it lies from ({:.1}, {:.1}) to ({:.1}, {:.1}) mm, the field reaches ±{half:.1} mm",
        low.x, low.y, high.x, high.y
    );
    match &settings.work {
        Work::Plate(_) => {
            let message = format!("the plate leaves the head's field: {error}");
            job.plate.problem(message).help(format!(
                "{lies}: fewer squares in plate.block, a smaller plate.side, or shorter runs of sky-writing"
            ))
        }
        Work::Layers(set) => {
            let middle = 0.5 * (low + high);
            let at = DVec2::from_array(job.layers.origin.map(|l| l.0)) + middle;
            let fits = (high - low).max_element() < 2.0 * half;
            let message = format!("\"{}\" leaves the head's field: {error}", set.file);
            job.lpbf.layers.problem(message).help(if fits {
                format!(
                    "{lies}: put its middle at the centre of the field with [layers] origin = [\"{:.1} mm\", \"{:.1} mm\"]",
                    at.x, at.y
                )
            } else {
                format!("{lies}: it is larger than the field; cut it, or take a larger head")
            })
        }
    }
}
