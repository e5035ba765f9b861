//! Plots of loops in frequency and time.

use std::f64::consts::TAU;

use meltpath_control::frequency::logarithmic;
use meltpath_control::h_infinity::Template;
use meltpath_control::simulate::step_response;
use meltpath_control::{Complex64, SystemError};
use meltpath_geometry::math::DVec2;
use meltpath_report::plot::{Axis, Mark, Plot};
use meltpath_scan_head::axis::control::{AngleUnit, CascadeGains};
use meltpath_scan_head::servo::h_infinity::current_plant;
use meltpath_scan_head::servo::model::{Actions, Loop, ServoModel};
use meltpath_scan_head::servo::synthesis::{Stage, Step};

use crate::tune::design::{AxisResult, Candidate};

/// Points of a drawn response.
const POINTS: usize = 700;
/// Length of a drawn step over the wanted time of its first maximum.
const STEPS_LONG: f64 = 6.0;

fn hertz() -> Axis {
    Axis::logarithmic("frequency", "Hz")
}

fn line(name: &str, points: Vec<DVec2>) -> Mark {
    Mark::Line {
        name: name.to_owned(),
        points,
    }
}

fn decibels(z: Complex64) -> f64 {
    20.0 * z.norm().log10()
}

/// Gain in dB over Hz.
fn gain(name: &str, grid: &[f64], response: impl Fn(Complex64) -> Complex64) -> Mark {
    let points = grid
        .iter()
        .map(|&w| DVec2::new(w / TAU, decibels(response(Complex64::new(0.0, w)))))
        .collect();
    line(name, points)
}

/// Phase in degrees, followed without jumps from the lowest frequency on.
fn phase(name: &str, grid: &[f64], response: impl Fn(Complex64) -> Complex64) -> Mark {
    let mut last: Option<f64> = None;
    let points = grid
        .iter()
        .map(|&w| {
            let mut angle = response(Complex64::new(0.0, w)).arg();
            if let Some(before) = last {
                angle += TAU * ((before - angle) / TAU).round();
            }
            last = Some(angle);
            DVec2::new(w / TAU, angle.to_degrees())
        })
        .collect();
    line(name, points)
}

/// Frequencies to draw, rad/s, finer at the modes.
fn grid(result: &AxisResult, low: f64, high: f64) -> Vec<f64> {
    let mut all = logarithmic(TAU * low, TAU * high, POINTS);
    for mode in &result.task.axis.motor.modes {
        all.extend(logarithmic(0.9 * mode.omega, 1.1 * mode.omega, 120));
    }
    all.retain(|w| (TAU * low..=TAU * high).contains(w));
    all.sort_by(f64::total_cmp);
    all
}

/// What stands in the legend for a step of the synthesis.
fn words(step: &Step) -> String {
    match (step.which, step.stage) {
        (_, Stage::Uncorrected) => "uncorrected".to_owned(),
        (_, Stage::Trial) => "trial".to_owned(),
        (Loop::Position, Stage::Time) => "with derivative".to_owned(),
        (_, Stage::Time) => "with integral".to_owned(),
        (_, Stage::Gain) => "gain set".to_owned(),
    }
}

/// Gain and phase of one open loop through its synthesis, with the wanted crossover and margin.
pub(super) fn synthesis(result: &AxisResult, which: Loop) -> Vec<Plot> {
    let motor = &result.task.axis.motor;
    let target = match which {
        Loop::Current => result.task.targets.current,
        Loop::Speed => result.task.targets.speed,
        Loop::Position => result.task.targets.position,
    };
    let name = which.name();
    let at = target.crossover / TAU;
    let grid = grid(result, (0.01 * at).max(0.1), 30.0 * at);
    let mut gains = Plot::new(&format!("{name} loop, open: gain"), hertz(), ["gain", "dB"])
        .caption(&format!(
            "The set gain crosses 0 dB at {:.0} rad/s ({at:.0} Hz).",
            target.crossover
        ));
    let mut phases = Plot::new(&format!("{name} loop, open: phase"), hertz(), ["phase", "deg"])
    .caption("At the crossover the phase has to stay above the limit: the least margin. A gain does not change the phase.");
    for step in result.tuned.steps.iter().filter(|s| s.which == which) {
        if step.stage == Stage::Trial {
            continue;
        }
        let model = ServoModel::new(motor, &step.gains);
        let open = |s| model.open(which, s);
        gains = gains.with(gain(&words(step), &grid, open));
        if step.stage != Stage::Gain {
            phases = phases.with(phase(&words(step), &grid, open));
        }
    }
    let zero = Mark::Limit {
        name: "0 dB".to_owned(),
        value: 0.0,
    };
    let margin = Mark::Limit {
        name: format!("margin {:.0} deg", target.margin.to_degrees()),
        value: target.margin.to_degrees() - 180.0,
    };
    vec![gains.with(zero), phases.with(margin)]
}

/// Steps of the closed loops, each over its own time.
pub(super) fn steps(result: &AxisResult) -> Result<Vec<Plot>, SystemError> {
    let targets = &result.task.targets;
    let mut plots = Vec::new();
    for (which, target) in [
        (Loop::Current, targets.current),
        (Loop::Speed, targets.speed),
        (Loop::Position, targets.position),
    ] {
        let wanted = 3.0 / target.crossover;
        let count = 400;
        let period = STEPS_LONG * wanted / f64::from(count);
        let mut plot = Plot::new(
            &format!("{} loop, closed: step", which.name()),
            ["time", "ms"],
            ["response to a step of one", ""],
        );
        let mut ways = vec![("synthesis", result.tuned.gains)];
        if result.refined.is_some() {
            ways.push(("refined", result.gains));
        }
        for (name, gains) in ways {
            let alone = feedback_only(&gains);
            let system = ServoModel::new(&result.task.axis.motor, &alone).loop_system(which)?;
            let response = step_response(&system, 0, period, count as usize)?;
            let points = (0..count)
                .map(|k| DVec2::new(1e3 * f64::from(k) * period, response[(k as usize, 0)]))
                .collect();
            plot = plot.with(line(name, points));
        }
        plots.push(plot.caption(&format!(
            "Wanted: first maximum at {:.2} ms. Linear, feedback alone.",
            1e3 * wanted
        )));
    }
    Ok(plots)
}

fn feedback_only(gains: &CascadeGains) -> CascadeGains {
    let mut alone = *gains;
    alone.feed_forward.speed = 0.0;
    alone.feed_forward.current = 0.0;
    alone
}

/// What feedback, feed-forward and pre-filter each bring.
pub(super) fn actions(result: &AxisResult) -> Plot {
    let model = ServoModel::new(&result.task.axis.motor, &result.gains);
    let grid = grid(result, 1.0, 2e4);
    let mut plot = Plot::new(
        "Angle over set-point, cascade",
        hertz(),
        Axis::new("gain", "dB").between(-60.0, 15.0),
    )
    .with(gain("feedback alone", &grid, |s| {
        model.complete(Actions::Feedback, s)
    }))
    .with(gain("with feed-forward", &grid, |s| {
        model.complete(Actions::FeedForward, s)
    }));
    if let Some(filter) = &result.task.axis.prefilter {
        plot = plot.with(gain("and pre-filter", &grid, |s| {
            model.complete(Actions::PreFiltered(filter), s)
        }));
    }
    plot.caption(
        "Feed-forward brings the gain back to one; the pre-filter takes the mode away, and delays.",
    )
}

/// S, KS, SG and T under their templates, the controller before and after its changes, and the open loop.
pub(super) fn h_infinity(result: &AxisResult) -> Result<Vec<Plot>, SystemError> {
    let targets = &result.task.h_infinity;
    let servo = &result.h_infinity;
    let unit = AngleUnit::Degree;
    let plant = current_plant(&result.task.axis.motor, &result.tuned.gains.current, unit)?;
    let grid = grid(result, 1.0, 5e4);
    let g = |s: Complex64| plant.at(s)[(0, 0)];
    let k = |s: Complex64| servo.simplified.controller.at(s);
    let full = |s: Complex64| servo.full.at(s);
    let loop_gain = |s: Complex64| g(s) * k(s);
    let w = &targets.weights;
    let inverse = |t: &Template| {
        let transfer = t.inverse();
        move |s: Complex64| transfer.at(s)
    };
    let (one, two, three) = (
        inverse(&w.sensitivity),
        inverse(&w.command),
        inverse(&w.disturbance),
    );
    let level = servo.level;
    let amperes = targets.command_unit;
    let plot = |title: &str, what: &str| {
        Plot::new(title, hertz(), Axis::new(&format!("gain {what}"), "dB"))
    };
    Ok(vec![
        plot("Sensitivity S", "")
            .with(gain("S", &grid, |s| 1.0 / (1.0 + loop_gain(s))))
            .with(gain("template", &grid, |s| level * one(s)))
            .caption("Error over set-point: bandwidth and precision."),
        plot("Set-point to command, KS", "(A/deg)")
            .with(gain("KS", &grid, |s| k(s) / (1.0 + loop_gain(s))))
            .with(gain("template", &grid, |s| level * amperes * two(s)))
            .caption("The command may be large where the bandwidth needs it and small above: the controller notches the mode."),
        plot("Disturbance to error, SG", "(deg/A)")
            .with(gain("SG", &grid, |s| g(s) / (1.0 + loop_gain(s))))
            .with(gain("template", &grid, |s| level / amperes * one(s) * three(s)))
            .caption("Friction and other disturbances of current."),
        plot("Complementary sensitivity T", "")
            .with(gain("T", &grid, |s| loop_gain(s) / (1.0 + loop_gain(s))))
            .with(gain("template", &grid, |s| level * two(s) * three(s))),
        plot("Controller K", "(A/deg)")
            .with(gain(
                &format!("as synthesised, order {}", servo.full.poles.len()),
                &grid,
                full,
            ))
            .with(gain(
                &format!("after changes, order {}", servo.simplified.controller.poles.len()),
                &grid,
                k,
            ))
            .caption("The changes: a nearly cancelling pair away, the slowest pole made an integrator."),
        plot("Open loop", "")
            .with(gain("GK", &grid, loop_gain))
            .limit("0 dB", 0.0),
    ])
}

/// The third and following steps of the comparison signal, and the error over all of it.
pub(super) fn responses(result: &AxisResult, period: f64) -> Vec<Plot> {
    let mut errors = Plot::new(
        "Error on the multi-step, without pre-filter",
        ["time", "s"],
        ["set-point − angle", "deg"],
    );
    let mut filtered = Plot::new(
        "Error on the multi-step, with pre-filter",
        ["time", "s"],
        ["set-point − angle", "deg"],
    );
    let mut small = Plot::new("A small step of it", ["time", "ms"], ["angle", "deg"]);
    let span = small_step(&result.set_points);
    let stretch = |values: &[f64]| -> Vec<DVec2> {
        let (from, to) = span;
        values[from..to]
            .iter()
            .enumerate()
            .map(|(k, v)| DVec2::new(1e3 * k as f64 * period, v.to_degrees()))
            .collect()
    };
    small = small.with(line("set-point", stretch(&result.set_points)));
    let difference = |angles: &[f64]| -> Vec<DVec2> {
        result
            .set_points
            .iter()
            .zip(angles)
            .enumerate()
            .map(|(k, (s, a))| DVec2::new(k as f64 * period, (s - a).to_degrees()))
            .collect()
    };
    for c in &result.candidates {
        errors = errors.with(line(c.name, difference(&c.bare.record.angle)));
        small = small.with(line(c.name, stretch(&c.bare.record.angle)));
        if let Some(trial) = &c.filtered {
            filtered = filtered.with(line(c.name, difference(&trial.record.angle)));
        }
    }
    let mut plots = vec![errors];
    if !filtered.marks.is_empty() {
        plots.push(filtered.caption(
            "Against the set-point before the pre-filter: its delay is most of this error.",
        ));
    }
    plots.push(small.caption("Without pre-filter."));
    plots
}

/// The samples about the start of a change in the last third of a signal.
fn small_step(set_points: &[f64]) -> (usize, usize) {
    let n = set_points.len();
    let from = 2 * n / 3;
    let start = (from.max(1)..n)
        .find(|&k| {
            set_points[k] != set_points[k - 1]
                && set_points[k - 1] == set_points[k.saturating_sub(2)]
        })
        .unwrap_or(from);
    let width = n / 100;
    (start.saturating_sub(width / 10), (start + width).min(n))
}

/// Distance to the critical point over moved modes.
pub(super) fn sweep(result: &AxisResult, limit: f64) -> Plot {
    let mut plot = Plot::new(
        "Modes that moved",
        ["frequency of the modes over the design's", "%"],
        ["distance to the critical point", ""],
    );
    for c in &result.candidates {
        let points = c
            .sweep
            .chunk_by(|a, b| a.shift == b.shift)
            .map(|of_shift| {
                let least = of_shift.iter().map(|s| s.distance).fold(f64::MAX, f64::min);
                DVec2::new(100.0 * (of_shift[0].shift - 1.0), least)
            })
            .collect();
        plot = plot.with(line(c.name, points));
    }
    plot.limit("limit", limit)
    .caption("The loop as it runs, the worst delay at each; 0 where it is unstable. Cascade: the smaller one of the loops opened at angle and current.")
}

/// The error of every scattered motor.
pub(super) fn scattered(candidates: &[Candidate]) -> Plot {
    let mut plot = Plot::new(
        "Scattered motors",
        ["frequency of the modes over the design's", "%"],
        Axis::logarithmic("error, root mean square", "deg"),
    );
    for c in candidates {
        let points = c
            .draws
            .iter()
            .filter_map(|d| {
                let (rms, _) = d.error?;
                Some(DVec2::new(100.0 * (d.modes - 1.0), rms.to_degrees()))
            })
            .collect();
        plot = plot.dots(c.name.to_owned(), points);
    }
    plot.caption("The same motors for every controller; those that ran away are not drawn but counted in the table.")
}
