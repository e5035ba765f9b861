//! The page of a health test: what drifted, its steps and ramps, friction and lag against speed, the trend.

use meltpath_base::output::{OutputError, OutputFolder};
use meltpath_base::{Provenance, Status, Verdict};
use meltpath_geometry::math::DVec2;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::Plot;
use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::health::bench::Km0Stage1;
use meltpath_scan_head::health::rating::{Drift, Km0Record, Rating, rate};

use crate::health::history::{Entry, History};

/// Quantities drawn in the trend, at most.
const DRAWN: usize = 6;

/// What is told.
pub(crate) struct Told<'a> {
    /// Machine, head and axis.
    pub(crate) name: &'a str,
    pub(crate) provenance: &'a Provenance,
    pub(crate) first: &'a Km0Stage1,
    /// The tests before this one.
    pub(crate) history: &'a History,
    pub(crate) entry: &'a Entry,
    pub(crate) drifts: &'a [Drift],
    pub(crate) verdict: &'a Verdict,
}

pub(crate) fn write(folder: &OutputFolder, told: &Told<'_>) -> Result<(), OutputError> {
    let record = &told.entry.record;
    let report = Report {
        title: format!("Health of {}", told.name),
        subtitle: format!(
            "{} · test {} · {}",
            record.time,
            told.history.entries().len() + 1,
            told.entry.rating.words()
        ),
        verdict: told.verdict.clone(),
        scene: None,
        sections: vec![drift(told), curves(told), steps(record), ramps(record)],
        sheet: None,
        provenance: told.provenance.clone(),
    };
    crate::outcome::tell(folder, &report)?;
    // plain structs of numbers and strings: their JSON exists
    let json = serde_json::to_string_pretty(told.entry).unwrap_or_default();
    folder.write("test.json", |w| w.write_all(json.as_bytes()))
}

fn drift(told: &Told<'_>) -> Section {
    let mut table = Table::new(
        "Against the accepted test",
        &[
            "quantity",
            "then",
            "now",
            "change, %",
            "±, %",
            "rating",
            "likely fault",
            "action",
        ],
    );
    for d in told.drifts {
        let (fault, action) = match (&d.doubt, d.rating) {
            (Some(_), _) | (None, Rating::Good) => ("", ""),
            _ => (d.fault, d.action),
        };
        table.rows.push(vec![
            Cell::text(&d.quantity),
            Cell::Number(d.reference),
            Cell::Number(d.now),
            Cell::Fixed(100.0 * d.change, 1),
            d.room
                .map_or(Cell::Empty, |room| Cell::Fixed(100.0 * room, 1)),
            Cell::text(if d.doubt.is_some() {
                Status::CannotSay.words()
            } else {
                d.rating.words()
            }),
            Cell::text(fault),
            Cell::text(action),
        ]);
    }
    let mut found = Table::new(
        "Found by the first stage",
        &["quantity", "value", "standard deviation, %"],
    );
    let m = &told.first.motor;
    for (name, value, sigma) in [
        ("resistance, Ω", m.resistance, told.first.sigma[0]),
        ("inductance, µH", 1e6 * m.inductance, told.first.sigma[1]),
        (
            "torque constant, N·m/A",
            m.torque_constant,
            told.first.sigma[2],
        ),
        ("inertia, kg·m²", m.inertia, told.first.sigma[3]),
        (
            "viscous coefficient (dry friction included), N·m·s/rad",
            m.viscous,
            told.first.sigma[4],
        ),
    ] {
        found.rows.push(vec![
            Cell::text(name),
            Cell::Number(value),
            Cell::Fixed(100.0 * sigma, 2),
        ]);
    }
    for (k, mode) in told.first.modes.iter().enumerate() {
        found.rows.push(vec![
            Cell::text(&format!("mode {}, Hz (damping {:.4})", k + 1, mode.damping)),
            Cell::Number(mode.frequency),
            Cell::Empty,
        ]);
    }
    let mut tests = Table::new(
        "Tests",
        &["test", "time", "temperature, °C", "rating", "reasons"],
    );
    let all = || told.history.entries().iter().chain([told.entry]);
    for (k, e) in all().enumerate() {
        let accepted = if e.accepted || k == 0 {
            " (accepted)"
        } else {
            ""
        };
        tests.rows.push(vec![
            Cell::text(&format!("{}{accepted}", k + 1)),
            Cell::text(&e.record.time),
            e.record
                .temperature
                .map_or(Cell::Empty, |t| Cell::Fixed(t, 1)),
            Cell::text(e.rating.words()),
            Cell::text(&e.reasons.join(", ")),
        ]);
    }
    Section::new(
        "Drift",
        "Every quantity against the last accepted test. Likely faults and actions are starting points for a person, not a diagnosis.",
        trend(told),
        vec![table, tests, found],
    )
}

/// Changes of the quantities that change most, over the tests since the accepted one.
fn trend(told: &Told<'_>) -> Vec<Plot> {
    let Some(reference) = told.history.reference() else {
        return Vec::new();
    };
    let all: Vec<Vec<Drift>> = told
        .history
        .entries()
        .iter()
        .chain([told.entry])
        .map(|e| rate(reference, &e.record, &[]))
        .collect();
    let mut plot = Plot::new(
        "Change against the accepted test",
        ["test", ""],
        ["change", "%"],
    );
    let mut most: Vec<&Drift> = told.drifts.iter().collect();
    most.sort_by(|a, b| (b.size / b.limits.1).total_cmp(&(a.size / a.limits.1)));
    for wanted in most.into_iter().take(DRAWN) {
        let points = all.iter().enumerate().filter_map(|(k, drifts)| {
            let d = drifts.iter().find(|d| d.quantity == wanted.quantity)?;
            Some(DVec2::new(k as f64 + 1.0, 100.0 * d.change))
        });
        plot = plot.line(wanted.quantity.clone(), points.collect());
    }
    vec![plot.caption("The quantities nearest to their limit of intervention.")]
}

/// Friction torque and lag against speed, now and then.
fn curves(told: &Told<'_>) -> Section {
    let now = &told.entry.record;
    let reference = told.history.reference();
    let points = |r: &Km0Record, of: &dyn Fn(f64, f64) -> f64, lag: Of| -> Vec<DVec2> {
        r.stage2
            .ramps
            .iter()
            .map(|x| {
                let y = match lag {
                    Of::Lag => x.lag_deg,
                    Of::Torque => x.torque,
                };
                DVec2::new(x.steady_speed_deg, of(x.steady_speed_deg, y))
            })
            .collect()
    };
    let micro = |_: f64, y: f64| 1e6 * y;
    let plain = |_: f64, y: f64| y;
    let mut torque = Plot::new("Friction torque", ["speed", "deg/s"], ["torque", "µN·m"])
        .dots("this test", points(now, &micro, Of::Torque));
    let f = now.stage2.friction;
    let fastest = now
        .stage2
        .ramps
        .iter()
        .map(|r| r.steady_speed_deg.abs())
        .fold(0.0, f64::max);
    let law = |sign: f64| {
        (0..=20).map(move |k| {
            let speed: f64 = sign * fastest * f64::from(k) / 20.0;
            let torque = f.viscous * speed.to_radians() + f.bias + f.coulomb * sign;
            DVec2::new(speed, 1e6 * torque)
        })
    };
    let mut fitted: Vec<DVec2> = law(-1.0).collect();
    fitted.reverse();
    fitted.push(DVec2::splat(f64::NAN));
    fitted.extend(law(1.0));
    torque = torque.line("its fit", fitted);
    let mut lag = Plot::new("Lag", ["speed", "deg/s"], ["lag", "deg"])
        .dots("this test", points(now, &plain, Of::Lag));
    if let Some(reference) = reference {
        torque = torque.dots("accepted test", points(reference, &micro, Of::Torque));
        lag = lag.dots("accepted test", points(reference, &plain, Of::Lag));
    }
    let mut table = Table::new(
        "Friction: T = B ω + T_P + T_C sgn ω",
        &["quantity", "now", "accepted test"],
    );
    let before = reference.map(|r| r.stage2.friction);
    for (name, value, then) in [
        ("B, N·m·s/rad", f.viscous, before.map(|b| b.viscous)),
        ("T_P, N·m", f.bias, before.map(|b| b.bias)),
        ("T_C, N·m", f.coulomb, before.map(|b| b.coulomb)),
        ("residual, N·m", f.residual, before.map(|b| b.residual)),
        (
            "residual of B alone, N·m",
            f.residual_viscous,
            before.map(|b| b.residual_viscous),
        ),
    ] {
        table.rows.push(vec![
            Cell::text(name),
            Cell::Number(value),
            then.map_or(Cell::Empty, Cell::Number),
        ]);
    }
    Section::new(
        "Friction and lag",
        "Mean of the second half of each ramp.",
        vec![torque, lag],
        vec![table],
    )
}

#[derive(Clone, Copy)]
enum Of {
    Lag,
    Torque,
}

fn steps(record: &Km0Record) -> Section {
    let table = Table::of(
        "Steps, up and down",
        record.stage2.steps.iter().map(|s| {
            [
                ("amplitude, deg", Cell::Fixed(s.amplitude_deg, 3)),
                ("steady value, deg", Cell::Fixed(s.steady_deg, 4)),
                ("start delay, µs", Cell::Fixed(1e6 * s.start_delay, 0)),
                ("overshoot, %", Cell::Fixed(s.overshoot, 1)),
                ("response time, ms", Cell::Fixed(1e3 * s.response_time, 2)),
                ("static error, deg", Cell::Fixed(s.static_error_deg, 4)),
            ]
        }),
    );
    Section::new(
        "Steps",
        "Start: a change by 10⁻⁴ deg. Response: within 5 % of the steady value for good.",
        vec![],
        vec![table],
    )
}

fn ramps(record: &Km0Record) -> Section {
    let table = Table::of(
        "Ramps, up and down",
        record.stage2.ramps.iter().map(|r| {
            [
                ("speed commanded, deg/s", Cell::Fixed(r.speed_deg, 1)),
                ("steady speed, deg/s", Cell::Fixed(r.steady_speed_deg, 1)),
                ("angle, deg", Cell::Fixed(r.amplitude_deg, 2)),
                ("lag, deg", Cell::Fixed(r.lag_deg, 4)),
                (
                    "speed response, ms",
                    Cell::Fixed(1e3 * r.speed_response_time, 2),
                ),
                ("current, mA", Cell::Fixed(1e3 * r.current, 2)),
                ("torque, µN·m", Cell::Fixed(1e6 * r.torque, 1)),
            ]
        }),
    );
    Section::new("Ramps", "", vec![], vec![table])
}
