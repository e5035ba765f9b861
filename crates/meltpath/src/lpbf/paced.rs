//! Marks that do not run as fast as they are commanded: the head's clock makes short ones slower, and mirrors have a top speed.

use meltpath_base::number::significant;
use meltpath_base::{Check, Limit, Measure, Place, Status};
use meltpath_scan_head::head::survey::{OffPace, Survey};

/// Share of the length of contours that may run slower than commanded, and of lines of fills, which corners of a part leave short, %. Ours.
const SLOWED: [f64; 2] = [5.0, 20.0];

/// A share of a length, %.
fn share(of: f64, all: f64) -> f64 {
    if all > 0.0 { 100.0 * of / all } else { 0.0 }
}

/// What the clock slows: contours, or lines of fills.
struct Slowed<'a> {
    kind: &'static str,
    /// %.
    share: f64,
    /// How much may be, %.
    most: f64,
    marks: &'a OffPace,
}

impl Slowed<'_> {
    /// `None` where they are few.
    fn of(survey: &Survey) -> Option<Slowed<'_>> {
        let paces = &survey.paces;
        let contours = Slowed {
            kind: "contours",
            share: share(paces.slowed_contours.length, survey.contours),
            most: SLOWED[0],
            marks: &paces.slowed_contours,
        };
        let fills = Slowed {
            kind: "lines of fills",
            share: share(paces.slowed_fills.length, survey.fills),
            most: SLOWED[1],
            marks: &paces.slowed_fills,
        };
        [contours, fills].into_iter().find(|s| s.share > s.most)
    }
}

fn place(of: &OffPace) -> Place {
    Place {
        layer: Some(of.layer),
        ..Place::at(of.at.to_array())
    }
}

/// The worst mark in words.
fn worst(of: &OffPace) -> String {
    format!(
        "{} mm/s of {} mm/s",
        significant(of.possible, 3),
        significant(of.commanded, 3)
    )
}

/// Marks that the clock of the head makes slower; `None` where they are few.
pub(super) fn slowed(number: usize, recipe: &str, survey: &Survey) -> Option<Check> {
    let Slowed {
        kind,
        share,
        most,
        marks,
    } = Slowed::of(survey)?;
    let check = Check::judge(
        &format!("clock-{number}"),
        &format!(
            "{recipe}: share of the length of {kind} that runs more than 5 % slower than commanded"
        ),
        Measure::exact(share, "%"),
        Limit::AtMost(most),
    );
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    let reason = format!(
        "each mark takes whole samples of the head's clock; the slowest runs at {}: a controller that carries what is left of a sample on marks them at full speed",
        worst(marks)
    );
    Some(check.because(&reason).at(place(marks)).remedy(LONGER))
}

const LONGER: &str = "export curves with longer chords, or mark slower";

/// A check of how marks run: where the clock slows many of them nothing is promised.
pub(super) fn unless_slowed(check: Check, survey: &Survey) -> Check {
    if matches!(check.status, Status::NotChecked | Status::Fail) {
        return check;
    }
    let Some(Slowed {
        kind, share, marks, ..
    }) = Slowed::of(survey)
    else {
        return check;
    };
    let reason = format!(
        "{share:.0} % of the length of {kind} run slower than commanded here, as each mark takes whole samples: as slow as {}",
        worst(marks)
    );
    let check = Check {
        status: Status::CannotSay,
        ..check
    };
    check.because(&reason).remedy(LONGER)
}

/// What the clock does to the time of a job, in words; none where it is little.
pub(crate) fn words(survey: &Survey) -> Option<String> {
    let Slowed { kind, share, .. } = Slowed::of(survey)?;
    Some(format!(
        "longer than commanded: {share:.0} % of the length of {kind} run slower, as each mark takes whole samples of the head's clock"
    ))
}

/// Marks that are commanded faster than a mirror turns; `None` where there is none.
pub(super) fn too_fast(number: usize, recipe: &str, survey: &Survey) -> Option<Check> {
    let marks = &survey.paces.too_fast;
    if marks.marks == 0 {
        return None;
    }
    let check = Check::judge(
        &format!("top-speed-{number}"),
        &format!("{recipe}: largest commanded speed of a mark, of what the mirrors can do there"),
        Measure::exact(100.0 * marks.ratio(), "%"),
        Limit::AtMost(100.0),
    );
    let reason = format!(
        "{} marks, {:.0} % of the length of all; the mirrors mark this one at {} at the most",
        marks.marks,
        share(marks.length, survey.contours + survey.fills),
        worst(marks)
    );
    let remedy =
        "a slower speed in the recipe or in the layers, or the top_speed that the head has";
    Some(check.because(&reason).at(place(marks)).remedy(remedy))
}
