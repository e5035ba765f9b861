//! The `[motion]` table that a log makes.

use std::fmt::Write as _;

use meltpath_base::{Check, Status};
use meltpath_robot::Controller;
use meltpath_robot::identification::Seen;
use toml::Value;

use super::found::Found;

/// Filters and dwells are told to so much, s, where the controller's period is not.
const STEP: f64 = 1e-3;

/// The table, as text; why not, where the model does not describe the controller.
pub(super) fn of(found: &Found, checks: &[Check]) -> Result<String, String> {
    let bad = |c: &&Check| !matches!(c.status, Status::Pass | Status::Warn);
    if let Some(check) = checks.iter().find(bad) {
        let why = match check.status {
            Status::Fail => "two averages and a dwell miss the controller by more than the bound",
            _ => "the log does not tell enough",
        };
        return Err(format!("{why} ({}: {})", check.id, check.title));
    }
    let text = written(found);
    // what is written must be read by cells
    let read = meltpath_base::settings::peek::<Controller>(&text, &["motion"]);
    let problems = match read {
        Ok(Some(controller)) => controller.check(),
        Ok(None) => Vec::new(),
        Err(problems) => problems.0,
    };
    match problems.first() {
        None => Ok(text),
        Some(problem) => Err(format!(
            "the law that was found is none of this model: {problem}"
        )),
    }
}

/// A time in ms, to a nanosecond, without zeros at its end.
fn ms(seconds: f64) -> String {
    let text = format!("{:.6}", 1e3 * seconds);
    format!("{} ms", text.trim_end_matches('0').trim_end_matches('.'))
}

/// A text as a TOML string.
fn word(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

/// A value that is no measurement, with its source.
fn guess(value: &str, why: &str) -> String {
    format!("{{ value = \"{value}\", source = {} }}", word(why))
}

/// Where the table comes from, and how well it fits, as comments.
fn heading(found: &Found) -> String {
    let misses = found.compared.events.iter();
    let [place, speed] = misses.fold([0.0, 0.0], |[p, v]: [f64; 2], e| {
        [p.max(e.places.rms), v.max(e.speeds.rms)]
    });
    let log = &found.told.file.log.0;
    let mut text = format!(
        "# Written by `meltpath measure` from {log}: put it into the file of this controller's cell.\n# At starts, corners and stops the model misses the place by at most {place:.3} mm and the speed by {:.1} % (root mean square); the noise\n# of the log is {:.3} mm.\n",
        100.0 * speed,
        found.compared.noise
    );
    if let Some(blend) = found.driven.blend {
        // writing into a string does not fail
        let _ = writeln!(
            text,
            "# 100 % of smoothing is a distance of {blend} mm: the cell needs [program] blend = \"{blend} mm\".",
        );
    }
    text
}

fn written(found: &Found) -> String {
    let log = &found.told.file.log.0;
    let [low, high] = found.speeds();
    let corners = found.corners().count();
    let origin = format!("identified from {log} by meltpath measure: {corners} corners");
    let source = word(&origin);
    let period = found.told.file.period.0;
    let whole = |t: f64| (t / period).round().max(1.0) * period;
    let [t1, t2] = found.filters.value.map(whole);
    let rounding = period / 12.0_f64.sqrt();
    let [s1, s2] = found.filters.sigma.map(|s| s.hypot(rounding));
    let figure = |value: f64, sigma: f64| {
        let (value, sigma) = (ms(value), 1e3 * sigma);
        format!("{{ value = \"{value}\", uncertainty = \"{sigma:.2} ms\", source = {source} }}")
    };
    let told = if found.told.file.period.is_written() {
        "told in the file of the log"
    } else {
        "not known: filters are told to a millisecond"
    };
    let cell = found.told.cell.as_ref().and_then(|c| c.motion.as_ref());
    let choice = "not in the log: a choice; set it from the cell's own limit";
    let rotation = cell.map_or_else(
        || guess("90 deg/s", choice),
        |c| {
            let speed = &c.rotation_speed;
            guess(&speed.value.value.to_string(), &speed.source)
        },
    );
    let joint = cell.map_or_else(
        || {
            guess(
                "1 m/s",
                "not in the log: a choice; counts where no robot is named",
            )
        },
        |c| {
            guess(
                &c.joint_speed.value.value.to_string(),
                &c.joint_speed.source,
            )
        },
    );
    let mut text = heading(found);
    let _ = write!(
        text,
        "[motion]\nperiod = {}\nt1 = {}\nt2 = {}\nrotation_speed = {rotation}\njoint_speed = {joint}\nspeeds = [\"{low:.3} mm/s\", \"{high:.3} mm/s\"]\n\n",
        guess(&ms(period), told),
        figure(t1, s1),
        figure(t2, s2),
    );
    dwells(found, t1 + t2, s1.hypot(s2), &origin, &mut text);
    text + &corner(found)
}

/// What a change of direction is: as the cell says, or as the cell that ships does.
fn corner(found: &Found) -> String {
    let least = found.corners().filter_map(|e| match e.seen {
        Seen::Corner { turn, .. } => Some(turn.to_degrees()),
        Seen::Start | Seen::Stop => None,
    });
    let least = least.fold(180.0, f64::min);
    let below = format!("assumption: the log's corners turn by {least:.0}° and more");
    let chords = "assumption: chords closer than this to a smooth curve are that curve";
    let cell = found.told.cell.as_ref().and_then(|c| c.motion.as_ref());
    let [none, full, chord] = match cell.map(|c| &c.corner) {
        Some(c) => [
            guess(&c.none_below.value.value.to_string(), &c.none_below.source),
            guess(&c.full_above.value.value.to_string(), &c.full_above.source),
            guess(
                &c.chord_error.value.value.to_string(),
                &c.chord_error.source,
            ),
        ],
        None => [
            guess("5 deg", &below),
            guess("30 deg", &below),
            guess("0.15 mm", chords),
        ],
    };
    format!("\n[motion.corner]\nnone_below = {none}\nfull_above = {full}\nchord_error = {chord}\n")
}

/// The law of the dwell: from a stop to full smoothing, never rising.
fn dwells(found: &Found, stop: f64, stop_sigma: f64, origin: &str, text: &mut String) {
    let mut rows = vec![(0.0, stop, stop_sigma, format!("{origin}: T1 + T2, a stop"))];
    let law = &found.fitted.law.dwells;
    for (k, share) in found.driven.path.smoothings.iter().enumerate() {
        let before = rows.last().map_or(stop, |r| r.1);
        let dwell = law[k].min(before);
        let sigma = found.fitted.sigma[2 + k]
            .max(dwell - law[k])
            .max(STEP * 0.01);
        let told = found.smoothing(k);
        rows.push((*share, dwell, sigma, format!("{origin}, smoothing {told}")));
    }
    if rows.last().is_some_and(|r| r.0 < 0.999) {
        let (_, dwell, sigma, _) = rows[rows.len() - 1].clone();
        let why = format!(
            "not driven: taken as at the greatest smoothing of {}",
            found.told.file.log.0
        );
        rows.push((1.0, dwell, dwell.max(sigma), why));
    }
    let last = rows.len() - 1;
    for (k, (share, dwell, sigma, source)) in rows.into_iter().enumerate() {
        let share = if k == last { 1.0 } else { share };
        let source = word(&source);
        let _ = writeln!(
            text,
            "[[motion.dwell]]\nsmoothing = \"{} %\"\ntime = {{ value = \"{}\", uncertainty = \"{:.2} ms\", source = {source} }}",
            (1e6 * share).round() / 1e4,
            ms(dwell),
            1e3 * sigma
        );
    }
}
