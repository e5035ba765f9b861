//! What a head's data sheet leaves out of the spot's place (`left_out`), and what it does to fills, to contours that get no light, and to passes
//! where it is a guess.

use meltpath_base::number::significant;
use meltpath_base::{Check, Status};
use meltpath_scan_head::measures::fill_share::FillShare;
use meltpath_scan_head::measures::strays::lost_by_straying;
use meltpath_scan_head::measures::swept_surface::Rate;

use super::plan::Plan;
use super::plan::apart::Apart;
use super::plan::enclosed::{self, BARE_ID, Enclosure};
use super::plan::work::Work;
use super::result::RecipeResult;
use super::settings::Settings;

/// What measures it.
pub(super) const MEASURE: &str =
    "measure how far the spot strays, and write it as left_out in [servo] of the head's file";
/// How far nearly all strays lie, in standard deviations.
const NEARLY_ALL: f64 = 2.0;

/// What contours of a file's layers tell, whose lines lie `hatch` mm apart where the job does not say it; with the straying of the head's spot.
pub(super) fn enclosure(plan: &Plan, hatch: Option<f64>) -> Enclosure {
    let settings = &plan.settings;
    let spot = 2.0 * settings.data.head.beam.waist;
    let limited = settings.job.checks.fill_rate.is_some();
    let said = match &plan.work {
        Work::Layers(set) => set.hatch,
        Work::Plate(_) => None,
    };
    let found = enclosed::check(&plan.work, hatch, spot);
    let mut found = Apart::of(said, hatch, limited).leaves_open(found, spot);
    let most = said.or(hatch).unwrap_or(spot);
    for check in &mut found.checks {
        if check.id == BARE_ID {
            *check = unless_wider(check.clone(), settings, most);
        }
    }
    found
}

/// The share of the surface that straying lines lose, and the straying, mm; none where the head's file tells of none.
fn lost(plan: &Plan, result: &RecipeResult<'_>) -> Option<[f64; 2]> {
    let head = &plan.settings.data.head;
    let sigma = head.left_out.flatten()?;
    let spot = 2.0 * head.beam.waist;
    let hatch = match &plan.work {
        Work::Plate(plate) => plate.hatch,
        Work::Layers(set) => set.hatch.or(result.survey.hatch).unwrap_or(spot),
    };
    Some([lost_by_straying(sigma, hatch, spot), sigma])
}

/// How a job is filled where lines stray: less by what that loses in the mean, and half of it in doubt.
pub(crate) fn rate(plan: &Plan, result: &RecipeResult<'_>, fill: &FillShare) -> Rate {
    let rate = fill.judged();
    match lost(plan, result) {
        Some([lost, _]) => Rate {
            share: (rate.share - lost).max(0.0),
            doubt: rate.doubt.hypot(0.5 * lost),
        },
        None => rate,
    }
}

/// What straying does to the check of a fill, in words; without a word of how far the spot strays a fill promises nothing.
pub(super) fn told(plan: &Plan, result: &RecipeResult<'_>, check: Check) -> Check {
    if plan.settings.data.head.left_out == Some(None) {
        return unless_measured(check);
    }
    match lost(plan, result) {
        Some([lost, sigma]) if lost >= 5e-4 => check.because(&format!(
            "{} points less since lines stray by {} µm (left_out of the head's file)",
            significant(100.0 * lost, 2),
            significant(1e3 * sigma, 3)
        )),
        _ => check,
    }
}

/// A head that its data sheet alone tells: what it leaves out only makes things worse.
pub(super) fn unless_measured(check: Check) -> Check {
    if check.status == Status::Fail || check.status == Status::NotChecked {
        return check;
    }
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let why =
        "the head is known by its data sheet alone, which leaves out friction, dither and drift";
    check.because(why).remedy(MEASURE)
}

/// A check that holds only while the spot strays less than `most` mm.
pub(super) fn unless_wider(check: Check, settings: &Settings, most: f64) -> Check {
    let head = &settings.data.head;
    let Some(sigma) = head.left_out.flatten() else {
        return check;
    };
    if check.status != Status::Pass || NEARLY_ALL * sigma <= most {
        return check;
    }
    let reason = format!(
        "the spot strays by {} µm (left_out of the head's file), as far as this looks",
        significant(1e3 * sigma, 3)
    );
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    check
        .because(&reason)
        .remedy("a head whose spot strays less than half a spot's diameter")
}

/// A check on a head of which the straying is a guess by its own file: no promise.
pub(super) fn unless_guessed(check: Check, settings: &Settings) -> Check {
    let guessed = settings.data.guesses.join(", ");
    if guessed.is_empty() || check.status == Status::NotChecked {
        return check;
    }
    let check = Check {
        status: check.status.max(Status::CannotSay),
        ..check
    };
    let fails = check.status == Status::Fail;
    let check = check.because(&format!("by the head's own file a guess: {guessed}"));
    if fails { check } else { check.remedy(MEASURE) }
}
