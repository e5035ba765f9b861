//! Whether two averages and a dwell describe the controller of a log, and what should be known of it.

use meltpath_base::{Check, Fact, Limit, Measure, Place, Reporter, Status};
use meltpath_robot::identification::fit::Apart;
use meltpath_robot::identification::{Event, Seen};

use super::found::Found;

/// The shorter filter lasts at least so many samples: else what it does lies between them.
const SAMPLES: f64 = 2.0;
/// The sum of the filters is known where its deviation is no more of it, %.
const KNOWN: f64 = 5.0;
/// A dwell is known within so much, ms: at 12.5 mm/s wire for 0.06 mm of bead.
const DWELL: f64 = 5.0;
/// A log leaves so much of its noise where the model lacks nothing.
const LACKS: f64 = 1.5;
/// Speeds at corners that are at least so far apart tell a model of time from one of distance.
const TWO_SPEEDS: f64 = 1.4;
/// A stop that lasts so much longer than that of the model is told, s.
const LONGER: f64 = 0.02;

fn at(found: &Found, check: Check, event: &Event) -> Check {
    let (file, line) = found.line(event);
    check.at(Place {
        file: Some(file).filter(|f| !f.is_empty()),
        line: Some(line).filter(|l| *l > 0),
        ..Place::at(event.place.to_array())
    })
}

/// A check of the worst event.
fn worst<'f>(
    found: &'f Found,
    (id, title, unit): (&str, &str, &str),
    events: &[&'f Event],
    of: impl Fn(&Event) -> [f64; 2],
    limit: f64,
) -> Option<(Check, &'f Event)> {
    let all = events.iter().copied();
    let event = all.max_by(|a, b| of(a)[0].total_cmp(&of(b)[0]))?;
    let [value, sigma] = of(event);
    let check = Check::judge(
        id,
        title,
        Measure::new(value, sigma, unit),
        Limit::AtMost(limit),
    );
    Some((at(found, check, event), event))
}

/// How corners of the slowest and of the fastest moves are cut, mm: measured and by the model; nothing for one speed.
fn by_speed(found: &Found) -> Option<String> {
    let [low, high] = found.speeds();
    if high < TWO_SPEEDS * low {
        return None;
    }
    let mean = |speed: f64, which: usize| {
        let near = found
            .corners()
            .filter(|e| (e.speed / speed - 1.0).abs() < 0.05);
        let all: Vec<f64> = near.map(|e| e.away[which]).collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    Some(format!(
        "corners are cut by {:.2} mm at {low:.1} mm/s and by {:.2} mm at {high:.1} mm/s, by the model by {:.2} and {:.2} mm: two averages cut in proportion to the speed, blends by distance alike at every speed",
        mean(low, 0),
        mean(high, 0),
        mean(low, 1),
        mean(high, 1),
    ))
}

/// The checks; where all of them hold the model describes the controller.
pub(super) fn checks(found: &Found) -> Vec<Check> {
    let all = &found.compared.events;
    let (unseen, fitted): (Vec<&Event>, Vec<&Event>) = all.iter().partition(|e| found.unseen(e));
    let [place, speed] = [
        found.told.file.place_bound.0,
        100.0 * found.told.file.speed_bound.0,
    ];
    let noise = found.compared.noise;
    let places = |e: &Event| [e.places.rms, 0.3 * noise];
    let speeds = |e: &Event| {
        let sigma = 0.3 * found.compared.speed_noise / e.speed;
        [e.speeds.rms, sigma].map(|v| 100.0 * v)
    };
    let form = by_speed(found).unwrap_or_else(|| {
        "two averages and a dwell do not describe how this controller drives there".to_owned()
    });
    let remedy = "look at its plot: was the log written at 100 % override, without a hold, and is the smoothing that of the path? A controller of another form has no [motion] here, and its metal stays \"cannot say\"";
    let mut checks = Vec::new();
    for (part, events) in [("fitted", &fitted), ("unseen", &unseen)] {
        let whose = match part {
            "fitted" => "at starts, corners and stops that were fitted",
            _ => "at corners that the fit has not seen",
        };
        let ids = [format!("place-{part}"), format!("speed-{part}")];
        let titles = [
            format!("what the model misses of the place {whose}"),
            format!("what it misses of the speed {whose}"),
        ];
        let found_of = [
            worst(found, (&ids[0], &titles[0], "mm"), events, places, place),
            worst(found, (&ids[1], &titles[1], "%"), events, speeds, speed),
        ];
        for (i, judged) in found_of.into_iter().enumerate() {
            checks.push(match judged {
                Some((check, _)) if check.status == Status::Fail => {
                    check.because(&form).remedy(remedy)
                }
                Some((check, _)) => check.remedy(remedy),
                None => Check {
                    status: Status::CannotSay,
                    ..Check::not_checked(
                        &ids[i],
                        &titles[i],
                        "no smoothing has three corners, so none was held back",
                    )
                }
                .remedy("drive at least three corners at each smoothing"),
            });
        }
    }
    checks.extend(known(found));
    checks
}

/// Whether the log tells what it should.
fn known(found: &Found) -> Vec<Check> {
    let unsaid = |check: Check| match check.status {
        Status::Fail => Check {
            status: Status::CannotSay,
            ..check
        },
        _ => check,
    };
    let sum = 100.0 * found.fitted.sigma[0] / found.fitted.law.sum;
    let dwells = found.fitted.sigma.get(2..).unwrap_or_default();
    let dwell = 1e3 * dwells.iter().copied().fold(0.0, f64::max);
    let samples = found.fitted.law.sum * 0.5 / found.log.interval();
    let shortest = found.filters.value[1] / found.log.interval();
    let of = |id, title, value, unit, limit, remedy: &str| {
        let check = Check::judge(id, title, Measure::exact(value, unit), limit);
        unsaid(check).remedy(remedy)
    };
    let more = "drive more corners of 60° to 150°, at two speeds, with legs so long that the full speed is reached, and log with less noise";
    let mut checks = vec![
        of(
            "sampling",
            "samples in the shorter filter",
            // filters that are not told apart are each half of their sum
            match found.filters.apart {
                Apart::Told => shortest,
                Apart::Open => samples,
            },
            "",
            Limit::AtLeast(SAMPLES),
            "log faster: every 4 to 12 ms",
        ),
        of(
            "sum-known",
            "uncertainty of T1 + T2, of it",
            sum,
            "%",
            Limit::AtMost(KNOWN),
            more,
        ),
        of(
            "dwell-known",
            "greatest uncertainty of a dwell",
            dwell,
            "ms",
            Limit::AtMost(DWELL),
            more,
        ),
    ];
    let law = &found.fitted.law.dwells;
    let rises = law.windows(2).zip(dwells.windows(2)).map(|(d, s)| {
        // by what noise explains
        1e3 * (d[1] - d[0] - 2.0 * s[0].hypot(s[1])).max(0.0)
    });
    let rise = rises.fold(0.0, f64::max);
    checks.push(of(
        "dwell-falls",
        "by how much a dwell is longer at more smoothing",
        rise,
        "ms",
        Limit::AtMost(2.0),
        "look at the corners: more smoothing should slow the tool less; are the smoothings of the path those that were driven?",
    ));
    checks
}

/// What should be known besides.
pub(super) fn warn(found: &Found, reporter: &Reporter) {
    if found.filters.apart == Apart::Open {
        reporter.warn(
            "filters-not-apart",
            format!(
                "T1 and T2 cannot be told apart: {:.0} ms together, each {:.0} ± {:.0} ms",
                1e3 * found.fitted.law.sum,
                1e3 * found.filters.value[0],
                1e3 * found.filters.sigma[0]
            ),
            "a faster run (the effect grows with the speed), sharper corners, a log with less noise; for places and speeds at corners their sum matters most",
        );
    }
    let over = found.over_noise();
    if over > LACKS && found.motion.is_some() {
        reporter.warn(
            "another-form",
            format!(
                "what is left is {over:.1} times the noise of the log: the controller is of another form than two averages, though within the bounds; the deviations are raised by it"
            ),
            "look at the plots; lower place_bound and speed_bound where more is needed",
        );
    }
    let [low, high] = found.speeds();
    if high < TWO_SPEEDS * low {
        reporter.warn(
            "one-speed",
            format!(
                "all corners were driven at {low:.1} to {high:.1} mm/s: at one speed two averages and a blend by distance look alike, so nothing is decided by this at others (motion.speeds)"
            ),
            "drive the path at a second speed, at least 1.4 times the first",
        );
    }
    if !found.driven.path.smoothings.iter().any(|s| *s > 0.999) {
        reporter.warn(
            "no-full-smoothing",
            "no corner was driven at 100 % of smoothing: its dwell is taken from the greatest that was",
            "drive corners at 100 %, too, or let programs use no more smoothing than was driven",
        );
    }
    for (k, pair) in found.driven.path.stretches.windows(2).enumerate() {
        let begins = &found.fitted.begins;
        if pair[0].wait.is_some() {
            continue;
        }
        let lasts = nominal(found, k);
        let longer = begins[k + 1] - begins[k] - lasts;
        if longer > LONGER {
            let place = Place::at(pair[1].start.position.to_array());
            reporter.warn_at(
                "stop-longer",
                format!(
                    "a stop lasts {:.0} ms longer than T1 + T2, by which the model stops",
                    1e3 * longer
                ),
                place,
                "with the arc on more metal is laid at stops than is simulated: let beads go round corners, or count it",
            );
            break;
        }
    }
}

/// How long a stretch lasts by the model until the next begins, s.
fn nominal(found: &Found, k: usize) -> f64 {
    let stretch = found.driven.path.stretches.get(k);
    let trace = stretch
        .and_then(|s| meltpath_robot::identification::model::trace(s, &found.fitted.law).ok());
    trace
        .and_then(|t| t.passages.last().copied())
        .unwrap_or(f64::INFINITY)
}

/// What is told.
pub(super) fn facts(found: &Found) -> Vec<Fact> {
    let ms = |value: f64, sigma: f64| Measure::new(1e3 * value, 1e3 * sigma, "ms");
    let [t1, t2] = found.filters.value;
    let [s1, s2] = found.filters.sigma;
    let fitted = &found.fitted;
    let mut facts = vec![
        Fact::new(
            "filter-sum",
            "T1 + T2",
            ms(fitted.law.sum, fitted.sigma[0]),
            "every transition lasts so long, and a stop",
        ),
        Fact::new("t1", "first average T1", ms(t1, s1), ""),
        Fact::new("t2", "second average T2", ms(t2, s2), ""),
    ];
    let dwells = fitted.law.dwells.iter().zip(fitted.sigma.iter().skip(2));
    for (k, (dwell, sigma)) in dwells.enumerate() {
        let title = format!("dwell at a smoothing of {}", found.smoothing(k));
        let corners = found.corners();
        let own =
            corners.filter(|e| matches!(e.seen, Seen::Corner { smoothing, .. } if smoothing == k));
        let told = format!("{} corners", own.count());
        facts.push(Fact::new(
            &format!("dwell-{}", k + 1),
            &title,
            ms(*dwell, *sigma),
            &told,
        ));
    }
    let held = found.corners().filter(|e| found.unseen(e)).count();
    let frame = &fitted.frame;
    let turn = 2.0 * frame.orientation.w.abs().min(1.0).acos().to_degrees();
    let number = |value: f64, unit: &str| Measure::exact(value, unit);
    facts.extend([
        Fact::new(
            "held-back",
            "corners held back from the fit",
            number(held as f64, ""),
            "the last third of each smoothing",
        ),
        Fact::new(
            "log-noise",
            "noise of the log, one component",
            number(found.compared.noise, "mm"),
            "from how far samples lie off the chord of their neighbours",
        ),
        Fact::new(
            "left",
            "what the model leaves, one component, root mean square",
            number(fitted.rms, "mm"),
            "",
        ),
        Fact::new(
            "over-noise",
            "what it leaves over the noise",
            number(found.over_noise(), ""),
            "1 where the model lacks nothing",
        ),
        Fact::new(
            "log-interval",
            "time between samples",
            number(1e3 * found.log.interval(), "ms"),
            "",
        ),
        Fact::new(
            "pace",
            "measured over programmed speed",
            number(100.0 * found.aligned.pace, "%"),
            "on straight parts",
        ),
        Fact::new(
            "frame-turn",
            "by how much the log's frame is turned against the path's",
            number(turn, "°"),
            "",
        ),
        Fact::new(
            "frame-origin",
            "where the log's origin lies in the path's frame",
            number(frame.position.length(), "mm"),
            "its distance from the path's origin",
        ),
    ]);
    if let Some(blend) = found.driven.blend {
        facts.push(Fact::new(
            "blend",
            "distance of blending that is 100 % of smoothing (program.blend)",
            number(blend, "mm"),
            "",
        ));
    }
    facts
}
