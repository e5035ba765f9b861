//! What a log of the tool looks like beside the model of its controller.

use meltpath_base::Provenance;
use meltpath_base::number::with_uncertainty;
use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::Plot;
use meltpath_report::table::{Cell, Table};
use meltpath_robot::identification::{Event, Seen};

use crate::motion_log::Found;

/// Corners that are drawn: those that the model misses most come first.
const DRAWN: usize = 12;
/// Stretches whose speeds are drawn.
const STRETCHES: usize = 8;
/// Points of a curve.
const POINTS: usize = 1500;

/// What an event is, in a word or two.
fn kind(event: &Event) -> &'static str {
    match event.seen {
        Seen::Start => "start",
        Seen::Corner { .. } => "corner",
        Seen::Stop => "stop",
    }
}

/// Turn in degrees and smoothing of a corner.
fn corner(found: &Found, event: &Event) -> (f64, String) {
    match event.seen {
        Seen::Corner { smoothing, turn } => (turn.to_degrees(), found.smoothing(smoothing)),
        Seen::Start | Seen::Stop => (f64::NAN, String::new()),
    }
}

fn part(found: &Found, event: &Event) -> &'static str {
    if found.unseen(event) {
        "held back"
    } else {
        "fitted"
    }
}

fn events(found: &Found) -> Table {
    let all = found.compared.events.iter().enumerate();
    Table::of(
        "Starts, corners and stops",
        all.map(|(k, e)| {
            let (turn, smoothing) = corner(found, e);
            let (program, line) = found.line(e);
            [
                ("", Cell::text(&format!("{}", k + 1))),
                ("what", Cell::text(kind(e))),
                ("line", Cell::text(&format!("{program} {line}"))),
                ("turn (°)", Cell::Fixed(turn, 1)),
                ("smoothing", Cell::text(&smoothing)),
                ("speed (mm/s)", Cell::Fixed(e.speed, 2)),
                ("place, rms (mm)", Cell::Fixed(e.places.rms, 3)),
                ("place, most (mm)", Cell::Fixed(e.places.most, 3)),
                ("speed, rms (%)", Cell::Fixed(100.0 * e.speeds.rms, 1)),
                ("speed, most (%)", Cell::Fixed(100.0 * e.speeds.most, 1)),
                ("slowest, log (mm/s)", Cell::Fixed(e.least[0], 2)),
                ("slowest, model", Cell::Fixed(e.least[1], 2)),
                ("cut, log (mm)", Cell::Fixed(e.away[0], 3)),
                ("cut, model", Cell::Fixed(e.away[1], 3)),
                ("", Cell::text(part(found, e))),
            ]
        }),
    )
    .noted("What the model misses, over the time in which the tool is slowed down there. The noise of the log is taken off root mean squares, and is in what is most. Speeds are slopes over 50 ms, of log and model alike. Cut: how far the tool stays away from the point.")
}

/// Directions before and behind a corner, as the model goes.
fn plane(model: &[DVec3]) -> Option<[DVec3; 2]> {
    let n = model.len();
    let first = (*model.get(n / 6)? - *model.first()?).try_normalize()?;
    let last = (*model.last()? - *model.get(n - 1 - n / 6)?).try_normalize()?;
    let across = (last - first * last.dot(first)).try_normalize();
    Some([
        first,
        across.unwrap_or_else(|| first.any_orthonormal_vector()),
    ])
}

/// A corner from above.
fn drawn(found: &Found, number: usize, event: &Event) -> Option<Plot> {
    let rows = found.compared.stretches.get(event.stretch)?;
    let first = rows.samples.first()?;
    let of = event.samples.start - first..event.samples.end - first;
    let (log, model) = (rows.log.get(of.clone())?, rows.model.get(of)?);
    let [x, y] = plane(model)?;
    let flat = |p: &DVec3| DVec2::new((*p - event.place).dot(x), (*p - event.place).dot(y));
    let points = |all: &[DVec3]| all.iter().map(flat).collect::<Vec<_>>();
    let (from, to) = (points(model), points(log));
    let ends = [from.first().copied()?, DVec2::ZERO, from.last().copied()?];
    let (turn, smoothing) = corner(found, event);
    let title = format!(
        "{number}: {turn:.0}°, smoothing {smoothing}, {:.1} mm/s, {}",
        event.speed,
        part(found, event)
    );
    let mut plot = Plot::new(&title, ["along the way to it", "mm"], ["across", "mm"]);
    plot.aspect = meltpath_report::plot::Aspect::Equal;
    Some(
        plot.line("path", ends.to_vec())
            .dots("log", to)
            .line("model", from),
    )
}

/// Speeds along a stretch.
fn speeds(found: &Found, k: usize) -> Option<Plot> {
    let rows = found.compared.stretches.get(k)?;
    let begin = found.fitted.begins.get(k)?;
    let every = rows.samples.len().div_ceil(POINTS).max(1);
    let points = |speeds: &[f64]| {
        let all = rows.samples.iter().zip(speeds).step_by(every);
        all.map(|(i, v)| DVec2::new(found.log.times[*i] - begin, *v))
            .collect::<Vec<_>>()
    };
    let title = format!("Speed along stretch {}, from a stop to a stop", k + 1);
    Some(
        Plot::new(&title, ["time", "s"], ["speed of the tip", "mm/s"])
            .dots("log", points(&rows.log_speed))
            .line("model", points(&rows.model_speed)),
    )
}

/// The report.
pub fn report(file: &str, found: &Found, provenance: &Provenance) -> Report {
    let mut corners: Vec<(usize, &Event)> = found.compared.events.iter().enumerate().collect();
    corners.retain(|(_, e)| matches!(e.seen, Seen::Corner { .. }));
    corners.sort_by(|a, b| b.1.places.rms.total_cmp(&a.1.places.rms));
    let all = corners.len();
    let drawings = corners.into_iter().take(DRAWN);
    let drawings: Vec<Plot> = drawings
        .filter_map(|(k, e)| drawn(found, k + 1, e))
        .collect();
    let count = found.compared.stretches.len();
    let along = (0..count.min(STRETCHES)).filter_map(|k| speeds(found, k));
    let note = if all > DRAWN {
        format!("The {DRAWN} of {all} corners that the model misses most, the worst first.")
    } else {
        "The worst first.".to_owned()
    };
    let words = if count > STRETCHES {
        format!("The first {STRETCHES} of {count} stretches.")
    } else {
        String::new()
    };
    Report {
        title: "The controller's corners from a log".to_owned(),
        subtitle: format!(
            "{file} · {} samples · {} corners · {:.0} mm",
            found.log.times.len(),
            all,
            found.driven.path.length()
        ),
        verdict: found.verdict.clone(),
        scene: None,
        sections: vec![
            Section::new("Speeds", &words, along.collect(), Vec::new()),
            Section::new("Corners", &note, drawings, vec![events(found)]),
        ],
        sheet: None,
        provenance: provenance.clone(),
    }
}

/// What a terminal shows.
pub fn lines(found: &Found) -> Vec<String> {
    let ms = |value: f64, sigma: f64| with_uncertainty(1e3 * value, 1e3 * sigma);
    let fitted = &found.fitted;
    let [t1, t2] = [0, 1].map(|k| ms(found.filters.value[k], found.filters.sigma[k]));
    let mut lines = vec![format!(
        "T1 + T2 {} ms: T1 {t1} ms, T2 {t2} ms",
        ms(fitted.law.sum, fitted.sigma[0])
    )];
    for (k, dwell) in fitted.law.dwells.iter().enumerate() {
        let sigma = fitted.sigma[2 + k];
        lines.push(format!(
            "dwell at a smoothing of {}: {} ms",
            found.smoothing(k),
            ms(*dwell, sigma)
        ));
    }
    if found.motion.is_some() {
        lines.push(
            "motion.toml: [motion] of this controller; put it into the cell's file".to_owned(),
        );
    }
    lines
}

/// Writes events, log beside model, and the table.
///
/// # Errors
/// [`OutputError`].
pub fn write_files(folder: &OutputFolder, found: &Found) -> Result<(), OutputError> {
    folder.write("corners.csv", |w| {
        writeln!(
            w,
            "number,what,program,line,x_mm,y_mm,z_mm,turn_deg,smoothing,speed_mm_s,time_s,place_rms_mm,place_most_mm,speed_rms,speed_most,least_log_mm_s,least_model_mm_s,cut_log_mm,cut_model_mm,part"
        )?;
        for (k, e) in found.compared.events.iter().enumerate() {
            let (turn, _) = corner(found, e);
            let smoothing = match e.seen {
                Seen::Corner { smoothing, .. } => found.driven.path.smoothings[smoothing],
                Seen::Start | Seen::Stop => 0.0,
            };
            let (program, line) = found.line(e);
            let p = e.place;
            writeln!(
                w,
                "{},{},{program},{line},{},{},{},{turn},{smoothing},{},{},{},{},{},{},{},{},{},{},{}",
                k + 1, kind(e), p.x, p.y, p.z, e.speed, e.time, e.places.rms, e.places.most, e.speeds.rms, e.speeds.most,
                e.least[0], e.least[1], e.away[0], e.away[1], part(found, e)
            )?;
        }
        Ok(())
    })?;
    folder.write("log-and-model.csv", |w| {
        writeln!(
            w,
            "time_s,log_x_mm,log_y_mm,log_z_mm,model_x_mm,model_y_mm,model_z_mm,log_speed_mm_s,model_speed_mm_s"
        )?;
        for rows in &found.compared.stretches {
            for (k, i) in rows.samples.iter().enumerate() {
                let (l, m) = (rows.log[k], rows.model[k]);
                writeln!(
                    w,
                    "{},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4}",
                    found.log.times[*i], l.x, l.y, l.z, m.x, m.y, m.z, rows.log_speed[k], rows.model_speed[k]
                )?;
            }
        }
        Ok(())
    })?;
    match &found.motion {
        Some(motion) => folder.write("motion.toml", |w| w.write_all(motion.as_bytes())),
        None => Ok(()),
    }
}
