//! What can be said of measured beads.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Reporter, Status};
use meltpath_deposition::consumable::Wire;
use meltpath_perception::cloud::Cloud;
use meltpath_perception::plate::Plate;

use super::file::Scan;
use super::found::Measured;

/// Where two thirds of width times height are so much of the area off, or points of the height off the parabola, the section is none.
/// Beads of the source are within 1.2 %.
const FORM: f64 = 0.05;
/// Width along a bead may scatter by so much, %: a bead that does more has no width.
const STEADY: f64 = 10.0;
/// Points may be so much of the height off the parabola, %: two beads side by side are 18 % off.
const ROUND: f64 = 10.0;
/// Most metal over the wire that was measured, and over that which was set, %: installations of the source feed up to 26 % more than is set.
const MOST: [f64; 2] = [100.0, 130.0];
/// Least metal over the wire that was fed, %: what else is lost as spatter or was never fed.
const LEAST: f64 = 70.0;
/// Uncertainty of a width up to which it is one, of it, %.
const KNOWN: f64 = 5.0;
/// Least share of a bead's width that points show, %.
const SHOWN: f64 = 90.0;
/// Least and most of the area over width times height, %: of a parabola 67, of half an ellipse 79, of a flat top (1 - u⁴) 80. What has less
/// thins out towards the plate, so that its feet are not seen; what has more has no form of liquid metal.
const FULL: [f64; 2] = [62.0, 85.0];
/// Where `near` is more of the height, the feet of a bead are not seen.
const LOW: f64 = 0.2;
/// Least share of a scan that is its plate.
const PLATE: f64 = 0.1;

/// What should be known of a scan.
pub(super) fn warn(beads: &[Measured], cloud: &Cloud, plate: &Plate, reporter: &Reporter) {
    if plate.share < PLATE {
        reporter.warn(
            "little-plate",
            format!(
                "{:.0} % of the scan lie on its largest plane: is that the plate?",
                100.0 * plate.share
            ),
            "scan more of the plate beside the beads, or take out what is not the plate",
        );
    }
    if cloud.unseen > 0 {
        reporter.warn(
            "unseen",
            format!(
                "{} points of the scan are no numbers and left out",
                cloud.unseen
            ),
            "nothing, where the scanner writes so what it did not see",
        );
    }
    for (k, bead) in beads.iter().enumerate() {
        let (form, off) = (bead.form(), bead.off());
        if form.abs() > FORM || off > FORM {
            reporter.warn(
                "no-parabola",
                format!(
                    "bead {}: two thirds of width times height are {:+.0} % off the area, and points {:.0} % of the height off the parabola of least squares: its section is none",
                    k + 1,
                    100.0 * form,
                    100.0 * off
                ),
                "look at its section in the report: two beads that touch count as one; width, height and area are those of its points, where full-least and full-most pass",
            );
        }
    }
}

/// The bead that is worst in what `of` tells of it.
fn worst(beads: &[Measured], of: impl Fn(&Measured) -> f64) -> Option<(usize, &Measured)> {
    let all = beads.iter().enumerate();
    all.max_by(|a, b| of(a.1).total_cmp(&of(b.1)))
}

fn at(check: Check, (k, bead): (usize, &Measured)) -> Check {
    Check {
        place: Some(Place {
            bead: Some(k as u32 + 1),
            ..Place::at(bead.bead.middle.to_array())
        }),
        ..check
    }
}

/// The checks.
pub(super) fn checks(scan: &Scan, beads: &[Measured]) -> Vec<Check> {
    let scatter = |b: &Measured| 100.0 * b.width[1] / b.width[0];
    let mut checks = Vec::new();
    if let Some(one) = worst(beads, scatter) {
        let value = Measure::exact(scatter(one.1), "%");
        let title = "scatter of the width along a bead";
        let check = Check::judge("steady", title, value, Limit::AtMost(STEADY));
        let remedy = "lay the bead again, or measure a stretch where it is steady";
        checks.push(at(check.remedy(remedy), one));
    }
    let off = |b: &Measured| 100.0 * b.off();
    if let Some(one) = worst(beads, off) {
        let value = Measure::exact(off(one.1), "%");
        let title = "points off the parabola, of the bead's height";
        let check = Check::judge("form", title, value, Limit::AtMost(ROUND));
        let remedy = "look at its section in the report: two beads that touch count as one";
        checks.push(at(check.remedy(remedy), one));
    }
    checks.extend(seen(scan, beads));
    if beads.is_empty() {
        return checks;
    }
    let diameter = |w: &Wire| 2.0 * w.diameter.uncertainty.unwrap_or(0.0) / w.diameter.0;
    let sigma = scan.wire.as_ref().map_or(0.0, diameter);
    let kept = |b: &Measured| b.kept(sigma).map(|k| k.map(|v| 100.0 * v));
    let measured = scan
        .beads
        .first()
        .is_some_and(|b| b.measured_feed.is_some());
    let title = [
        "most metal in a bead over the wire fed",
        "least metal in a bead over the wire fed",
    ];
    let value = |b: &Measured| kept(b).map_or(f64::NAN, |k| k[0]);
    let known = beads.iter().all(|b| b.fed.is_some());
    for (id, title, limit, sign) in [
        (
            "metal-most",
            title[0],
            Limit::AtMost(MOST[usize::from(!measured)]),
            1.0,
        ),
        ("metal-least", title[1], Limit::AtLeast(LEAST), -1.0),
    ] {
        let one = worst(beads, |b| sign * value(b)).filter(|_| known);
        let found = one.and_then(|one| Some((one, kept(one.1)?)));
        checks.push(match found {
            None => Check::not_checked(
                id,
                title,
                "the file tells no wire, or no settings of the beads ([[bead]])",
            ),
            Some((one, [value, sigma])) => {
                let check = Check::judge(id, title, Measure::new(value, sigma, "%"), limit);
                let remedy = if measured {
                    "look at the unit and the order of the beads, the wire's diameter and the measured feed: a bead holds no more than its wire"
                } else {
                    "look at the unit and the order of the beads and at the wire's diameter; tell the feed that was measured (measured_feed), which may be a quarter off"
                };
                at(check.remedy(remedy), one)
            }
        });
    }
    checks
}

/// A check of what a scan shows: where it does not, nothing is wrong with the bead, and nothing can be said of it.
fn unsaid(check: Check) -> Check {
    match check.status {
        Status::Fail => Check {
            status: Status::CannotSay,
            ..check
        },
        _ => check,
    }
}

/// Whether the scan shows the widths of its beads.
fn seen(scan: &Scan, beads: &[Measured]) -> Vec<Check> {
    let known = |b: &Measured| 100.0 * b.width_sigma / b.width[0];
    let shown = |b: &Measured| 100.0 * b.shown();
    let full = |b: &Measured| 100.0 * b.area[0] / (b.width[0] * b.height[0]);
    let low = |b: &Measured| scan.near > LOW * b.height[0];
    let judged = |id, title, of: &dyn Fn(&Measured) -> f64, limit, remedy: &str| {
        let sign = if matches!(limit, Limit::AtMost(_)) {
            1.0
        } else {
            -1.0
        };
        let one = worst(beads, |b| sign * of(b))?;
        let check = Check::judge(id, title, Measure::exact(of(one.1), "%"), limit);
        Some(at(unsaid(check.remedy(remedy)), one))
    };
    let rows = "scan more closely across the bead: what lies between rows of points, or in a hole of the scan, is not known";
    let smaller = "the bead is hardly higher than near, below which points may be the plate's: take a smaller near, four times the noise of the scanner";
    let worst_known = worst(beads, known).is_some_and(|one| low(one.1));
    [
        judged(
            "width-known",
            "uncertainty of a bead's width, of it",
            &known,
            Limit::AtMost(KNOWN),
            if worst_known { smaller } else { rows },
        ),
        judged(
            "shown",
            "width of a bead's sections that the scan shows",
            &shown,
            Limit::AtLeast(SHOWN),
            "scan the bead again, from the side that is hidden or more closely: what is not seen is drawn as the parabola of the rest",
        ),
        judged(
            "full-least",
            "least area of a bead over its width times its height",
            &full,
            Limit::AtLeast(FULL[0]),
            "look at its section in the report: it is pointed, or thins out towards the plate, and where it ends is not seen; measure its width otherwise",
        ),
        judged(
            "full-most",
            "most area of a bead over its width times its height",
            &full,
            Limit::AtMost(FULL[1]),
            "look at its section in the report: the scan misses its feet, or it is no single bead",
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Least and most metal over the wire that was fed at corners, %.
pub(super) fn metal(scan: &Scan) -> [f64; 2] {
    let measured = !scan.corners.is_empty()
        && scan
            .corners
            .iter()
            .all(|c| c.setting.measured_feed.is_some());
    [LEAST, MOST[usize::from(!measured)]]
}

/// What is told besides.
pub(super) fn facts(beads: usize, corners: usize, cloud: &Cloud, plate: &Plate) -> Vec<Fact> {
    let count = |n: usize| Measure::exact(n as f64, "");
    vec![
        Fact::new("beads", "straight beads found", count(beads), ""),
        Fact::new("corners", "beads with a corner found", count(corners), ""),
        Fact::new(
            "points",
            "points of the scan",
            count(cloud.points.len()),
            "",
        ),
        Fact::new(
            "plate-noise",
            "root mean square distance of the plate's points from it",
            Measure::exact(plate.rms, "mm"),
            "noise of the scanner, and how far the plate is from flat",
        ),
    ]
}
