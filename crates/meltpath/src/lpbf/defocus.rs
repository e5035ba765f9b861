//! Marks whose focus is commanded over or below the plane (`z_mm` of a vector list): the spot on the plane is wider than in focus.
//!
//! A beam of waist `w₀` is `w₀ √(1 + (z/z_R)²)` wide so far from its focus ([`GaussianBeam::radius_at`]), with the Rayleigh length `z_R`. What is
//! reckoned with the spot is reckoned with that in focus.

use meltpath_base::number::significant;
use meltpath_base::settings::Problem;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_scan_head::head::survey::{Raised, Survey};
use meltpath_scan_head::optics::beam::GaussianBeam;

use super::plan::Plan;
use super::plan::work::{Source, Work};
use super::settings::Settings;
use crate::job::LpbfJob;

/// How wide the spot on the plane may be, of that in focus, %: up to there it is a third of the Rayleigh length, and a tenth of the light on a
/// place. Ours.
const WIDE: f64 = 105.0;

const REMEDY: &str = "leave z_mm blank, or 0, for marks in focus (the height of a layer is height_mm); where the spot is meant to be wider, write its radius on the plane as beam.waist in the head's file";

/// How wide the spot of a mark is on the plane, of that in focus, %.
fn width(beam: &GaussianBeam, raised: &Raised) -> f64 {
    100.0 * beam.radius_at(raised.at.z) / beam.waist
}

/// The mark with the widest spot, where it is wider than it may be.
fn widest<'a>(settings: &Settings, survey: &'a Survey) -> Option<&'a Raised> {
    let beam = &settings.data.head.beam;
    let raised = survey.raised.as_ref();
    raised.filter(|raised| width(beam, raised) > WIDE)
}

/// What the focus does to the spot, in words.
fn words(beam: &GaussianBeam, raised: &Raised) -> String {
    let z = raised.at.z;
    let side = if z < 0.0 { "below" } else { "over" };
    format!(
        "its focus is commanded {} mm {side} the plane, where the spot is {} µm in radius for {} µm in focus (Rayleigh length {} mm)",
        significant(z.abs(), 3),
        significant(1e3 * beam.radius_at(z), 3),
        significant(1e3 * beam.waist, 3),
        significant(beam.rayleigh_length(), 3)
    )
}

/// Refuses marks out of focus on a head that cannot move it.
pub(super) fn refused(job: &LpbfJob, plan: &Plan, survey: &Survey) -> Option<Problem> {
    let head = &plan.settings.data.head;
    if head.focus.is_some() {
        return None;
    }
    let raised = widest(&plan.settings, survey)?;
    let Work::Layers(set) = &plan.work else {
        return None;
    };
    let line = match &set.source {
        Source::File(file) => file.line_of(raised.layer, raised.at),
        Source::Part(_) => None,
    };
    let place = match line {
        Some(line) => format!("line {line}"),
        None => format!(
            "layer {}, the mark at ({:.3}, {:.3}) mm",
            raised.layer, raised.at.x, raised.at.y
        ),
    };
    let message = format!(
        "\"{}\", {place}: {}; this head has no axis that moves its focus",
        set.file,
        words(&head.beam, raised)
    );
    Some(job.lpbf.layers.problem(message).help(REMEDY))
}

/// The widest spot of a mark on the plane; `None` where it is hardly wider than in focus.
pub(super) fn check(
    settings: &Settings,
    number: usize,
    recipe: &str,
    survey: &Survey,
) -> Option<Check> {
    let beam = &settings.data.head.beam;
    let raised = widest(settings, survey)?;
    let found = Measure {
        sigma: None,
        ..Measure::exact(width(beam, raised), "%")
    };
    let check = Check::judge(
        &format!("spot-{number}"),
        &format!("{recipe}: widest spot of a mark on the plane, of that in focus"),
        found,
        Limit::AtMost(WIDE),
    );
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let place = Place {
        layer: Some(raised.layer),
        ..Place::at([raised.at.x, raised.at.y, 0.0])
    };
    Some(check.because(&words(beam, raised)).at(place).remedy(REMEDY))
}

/// Whether what is reckoned with the spot in focus holds.
pub(crate) fn in_focus(settings: &Settings, survey: &Survey) -> bool {
    widest(settings, survey).is_none()
}

/// A check that is reckoned with the spot in focus: where it is wider nothing is said.
pub(super) fn unless_wide(check: Check, settings: &Settings, survey: &Survey) -> Check {
    let Some(raised) = widest(settings, survey) else {
        return check;
    };
    if check.status == Status::NotChecked {
        return check;
    }
    let reason = format!(
        "reckoned with the spot in focus, and on the plane that of a mark is {:.0} % as wide",
        width(&settings.data.head.beam, raised)
    );
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    check.because(&reason).remedy(REMEDY)
}
