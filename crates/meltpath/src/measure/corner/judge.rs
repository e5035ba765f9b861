//! What can be said of measured corners.

use meltpath_base::{Check, Limit, Measure, Place, Status};

use meltpath_deposition::corner::REACH;

use super::super::found::MeasuredCorner;

/// How far the legs may turn from what is told, degrees: a programmed angle is held better, the middles of legs show it to half a degree.
const ANGLE: f64 = 2.0;
/// How far the crest may lie off the curve, root mean square, of the bead's width, %.
const OFF: f64 = 6.0;
/// The crest lies at most so much as far off the curve of the way told as off that of the other way.
const WAY: f64 = 0.9;
/// Uncertainty of the length up to which it is one, of the length, %.
const KNOWN: f64 = 10.0;
/// Least share of the corner that is seen, %.
const SHOWN: f64 = 90.0;

/// How far the legs turn from what is told, degrees.
fn angle_off(c: &MeasuredCorner) -> f64 {
    (c.seen - c.told.turn.abs()).abs().to_degrees()
}

/// The crest off the curve, of the width, %.
fn off(c: &MeasuredCorner) -> f64 {
    let off = c.pursuit.as_ref().map_or(f64::NAN, |p| p.off);
    100.0 * off / c.mean[0]
}

/// How much farther the crest lies off the curve of the way told than off that of the other way; none where neither fits.
fn way(c: &MeasuredCorner) -> f64 {
    match (&c.pursuit, c.other_way) {
        (Ok(told), Some(other)) => told.off / other,
        (Ok(_), None) => 0.0,
        (Err(_), Some(_)) => f64::INFINITY,
        (Err(_), None) => f64::NAN,
    }
}

/// Uncertainty of the length, of it, %.
fn known(c: &MeasuredCorner) -> f64 {
    c.pursuit
        .as_ref()
        .map_or(f64::NAN, |p| 100.0 * p.sigma / p.length)
}

/// Whether a corner gives a length that jobs may take.
///
/// # Errors
/// Why not.
pub(crate) fn usable(c: &MeasuredCorner) -> Result<(), String> {
    let degrees = c.told.turn.to_degrees();
    if let Err(why) = &c.pursuit {
        return Err(format!("the corner of {degrees:.0}°: {why}"));
    }
    for (value, limit, what) in [
        (angle_off(c), ANGLE, "its legs turn by another angle"),
        (off(c), OFF, "its crest is no pursuit curve"),
        (way(c), WAY, "the way of the torch is not seen"),
        (
            known(c),
            KNOWN,
            "it is too blunt, or its crest too rough, for a length",
        ),
        (-100.0 * c.shown, -SHOWN, "the scan shows too little of it"),
    ] {
        if value.is_nan() || value > limit {
            return Err(format!("the corner of {degrees:.0}°: {what}"));
        }
    }
    Ok(())
}

/// The corner that is worst in what `of` tells of it; what is no number is worse than all.
fn worst(
    corners: &[MeasuredCorner],
    of: impl Fn(&MeasuredCorner) -> f64,
) -> Option<&MeasuredCorner> {
    let rank = |c: &MeasuredCorner| {
        let value = of(c);
        if value.is_nan() { f64::INFINITY } else { value }
    };
    corners.iter().max_by(|a, b| rank(a).total_cmp(&rank(b)))
}

fn at(check: Check, c: &MeasuredCorner) -> Check {
    let told = format!("the corner of {:.0}°", c.told.turn.to_degrees());
    check.at(Place::at(c.place.to_array())).because(&told)
}

/// The checks of corners: none where there are none.
pub(crate) fn checks(corners: &[MeasuredCorner], metal: [f64; 2]) -> Vec<Check> {
    let mut checks = Vec::new();
    let judged = |id, title, unit, of: &dyn Fn(&MeasuredCorner) -> f64, limit, remedy: &str| {
        let one = worst(corners, of)?;
        let value = of(one);
        let mut check = Check::judge(id, title, Measure::exact(value, unit), limit);
        if let (Err(why), true) = (&one.pursuit, value.is_nan()) {
            check.reason = format!("no pursuit length was found: {why}");
        }
        Some(at(check.remedy(remedy), one))
    };
    checks.extend(judged(
        "corner-angle",
        "angle between the legs against the one told",
        "°",
        &angle_off,
        Limit::AtMost(ANGLE),
        "look at corner, and at the order of the beads: corners count from low to high x or y",
    ));
    checks.extend(judged(
        "corner-fit",
        "crest off the pursuit curve, of the bead's width",
        "%",
        &off,
        Limit::AtMost(OFF),
        "look at the crest in the report: a bead that touches another, spatter on it or a torch that left its path have no pursuit curve",
    ));
    checks.extend(judged(
        "corner-way",
        "crest off the curve of the way told over that of the other way",
        "",
        &|c| way(c).min(1e3),
        Limit::AtMost(WAY),
        "the bead looks as if the torch had come the other way: turn the sign of corner, positive is to the left; a blunt corner does not show it",
    ));
    // an uncertain length is no fault of the bead
    let length = judged(
        "pursuit-length",
        "uncertainty of the pursuit length",
        "%",
        &known,
        Limit::AtMost(KNOWN),
        "scan a sharper corner, or more closely: blunt ones hardly show how far the bead stays behind",
    );
    checks.extend(length.map(|mut check| {
        if check.status == Status::Fail {
            check.status = Status::CannotSay;
        }
        check
    }));
    let shown = |c: &MeasuredCorner| -100.0 * c.shown;
    if let Some(one) = worst(corners, shown) {
        let value = Measure::exact(100.0 * one.shown, "%");
        let title = "cells of the corner that the scan shows";
        let check = Check::judge("corner-shown", title, value, Limit::AtLeast(SHOWN));
        let remedy = "scan the corner again: what is not seen is guessed from beside it";
        checks.push(at(check.remedy(remedy), one));
    }
    checks.extend(metal_checks(corners, metal));
    checks
}

/// Metal at the corner over the wire that was fed there.
fn metal_checks(corners: &[MeasuredCorner], [least, most]: [f64; 2]) -> Vec<Check> {
    let kept = |c: &MeasuredCorner| {
        let wire = c.balance.wire.unwrap_or(f64::NAN);
        let of_area = c.scatter.0 / (c.scatter.1 as f64).sqrt() * 2.0 * REACH;
        [100.0 * c.balance.measured / wire, 100.0 * of_area / wire]
    };
    let titles = [
        "most metal at a corner over the wire fed",
        "least metal at a corner over the wire fed",
    ];
    let all = [
        ("corner-metal-most", titles[0], Limit::AtMost(most), 1.0),
        ("corner-metal-least", titles[1], Limit::AtLeast(least), -1.0),
    ];
    if corners.is_empty() {
        return Vec::new();
    }
    all.map(|(id, title, limit, sign)| {
        let one = worst(corners, |c| sign * kept(c)[0]).filter(|c| c.balance.wire.is_some());
        match one {
            None => Check::not_checked(id, title, "the file tells no wire"),
            Some(one) => {
                let [value, sigma] = kept(one);
                let check = Check::judge(id, title, Measure::new(value, sigma, "%"), limit);
                let remedy = "look at the unit, the wire's diameter and the settings; where the torch slows down at the corner more is fed there: tell its record (torch)";
                at(check.remedy(remedy), one)
            }
        }
    })
    .to_vec()
}
