//! Tables of a tuning: gains, loops, combinations, scattered motors.

use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::servo::compare::TrackingError;
use meltpath_scan_head::servo::h_infinity::LoopQuality;
use meltpath_scan_head::servo::model::{Actions, Loop, ServoModel};
use meltpath_scan_head::servo::refine::Refined;
use meltpath_scan_head::servo::synthesis::Stage;

use crate::tune::design::AxisResult;
use crate::tune::trial::Trial;

/// What the loops are called, with the unit.
const PARAMETERS: [&str; 8] = [
    "K_ii (V/A)",
    "T_ii (s)",
    "K_iω (A·s/deg)",
    "T_iω (s)",
    "K_θ (1/s)",
    "T_dθ (s)",
    "K1",
    "K2",
];

/// The table of gains, one a row, beside those of the head's file.
pub(super) fn gains(result: &AxisResult) -> Table {
    let mut headings = vec!["", "after the synthesis"];
    let mut columns: Vec<[Cell; 8]> = vec![result.tuned.gains.values().map(Cell::Number)];
    if let Some(refined) = &result.refined {
        headings.push(if refined.gains == result.gains {
            "after the swarm"
        } else {
            "after the swarm, not kept"
        });
        columns.push(refined.gains.values().map(Cell::Number));
    }
    if let Some(own) = &result.task.own {
        headings.push("those of the head's file");
        columns.push(own.values().map(Cell::Number));
    }
    let mut table = Table::new("Gains of the cascade", &headings);
    for (k, name) in PARAMETERS.into_iter().enumerate() {
        let mut row = vec![Cell::text(name)];
        row.extend(columns.iter().map(|column| column[k].clone()));
        table.rows.push(row);
    }
    table
}

/// The runs of the swarm, before and after.
pub(super) fn refinement(refined: &Refined) -> Table {
    let mut table = Table::new(
        "Refinement: the swarm's runs",
        &[
            "run",
            "rms before (deg)",
            "rms after (deg)",
            "largest before (deg)",
            "largest after (deg)",
        ],
    );
    for run in &refined.runs {
        let both = |of: fn(&TrackingError) -> f64, digits| {
            [&run.before, &run.after].map(|e| {
                e.as_ref().map_or(Cell::text("ran away"), |e| {
                    Cell::Fixed(of(e).to_degrees(), digits)
                })
            })
        };
        let mut cells = vec![Cell::text(&run.name)];
        cells.extend(both(TrackingError::rms, 5));
        cells.extend(both(TrackingError::largest, 4));
        table.rows.push(cells);
    }
    table
}

/// Every step of the synthesis.
pub(super) fn steps(result: &AxisResult) -> Table {
    Table::of(
        "Step by step",
        result.tuned.steps.iter().map(|s| {
            let (gain, time) = match s.which {
                Loop::Current => (s.gains.current.gain, s.gains.current.integral_time),
                Loop::Speed => (s.gains.speed_gain, s.gains.speed_integral_time),
                Loop::Position => (s.gains.position_gain, s.gains.position_derivative_time),
            };
            let what = match (s.stage, s.which) {
                (Stage::Uncorrected, _) => "uncorrected",
                (Stage::Trial, _) => "a time tried",
                (Stage::Time, Loop::Position) => "longest derivative that leaves the margin",
                (Stage::Time, _) => "shortest integral that leaves the margin",
                (Stage::Gain, _) => "gain for the crossover",
            };
            [
                ("loop", Cell::text(s.which.name())),
                ("step", Cell::text(what)),
                ("gain", Cell::Number(gain)),
                (
                    "time (s)",
                    if time.is_finite() {
                        Cell::Number(time)
                    } else {
                        Cell::text("∞")
                    },
                ),
                (
                    "|open loop| at the wanted crossover",
                    Cell::Number(s.gain_there),
                ),
                (
                    "margin there (deg)",
                    Cell::Fixed(s.margin_there.to_degrees(), 1),
                ),
            ]
        }),
    )
}

/// Crossovers and margins of the loops.
pub(super) fn loops(result: &AxisResult) -> Table {
    let mut ways = vec![("synthesis", result.tuned.gains)];
    if result.gains != result.tuned.gains {
        ways.push(("refined", result.gains));
    }
    let motor = &result.task.axis.motor;
    let mut notes = Vec::new();
    let mut rows = Vec::new();
    for (name, gains) in ways {
        let model = ServoModel::new(motor, &gains);
        for which in [Loop::Current, Loop::Speed, Loop::Position] {
            let Some(f) = model.figures(which) else {
                continue;
            };
            rows.push([
                ("gains", Cell::text(name)),
                ("loop", Cell::text(which.name())),
                ("crossover (rad/s)", Cell::Fixed(f.crossover.omega, 0)),
                (
                    "phase margin (deg)",
                    Cell::Fixed(f.crossover.value.to_degrees(), 1),
                ),
                (
                    "distance to the critical point",
                    Cell::Fixed(f.margins.modulus.value, 3),
                ),
            ]);
        }
        let hertz = |actions| {
            model.bandwidth(actions).map_or("none".to_owned(), |w| {
                format!("{:.0} Hz", w / std::f64::consts::TAU)
            })
        };
        notes.push(format!(
            "{name}: −3 dB at {} with feedback alone, {} with feed-forward",
            hertz(Actions::Feedback),
            hertz(Actions::FeedForward)
        ));
    }
    Table::of("Loops", rows).noted(&format!("{}.", notes.join("; ")))
}

/// The H-infinity loops: as designed, sampled, and of the robust controller.
pub(super) fn h_infinity(result: &AxisResult) -> Table {
    let row = |name: &str, order: usize, q: &LoopQuality| {
        [
            ("controller", Cell::text(name)),
            ("order", Cell::Fixed(order as f64, 0)),
            ("crossover (rad/s)", Cell::Fixed(q.crossover, 0)),
            (
                "phase margin (deg)",
                Cell::Fixed(q.phase_margin.to_degrees(), 1),
            ),
            (
                "distance to the critical point",
                Cell::Fixed(q.modulus_margin, 3),
            ),
            ("|S| = 1 at (rad/s)", Cell::Fixed(q.error_band, 0)),
            ("|S| at 100 Hz", Cell::Fixed(q.slow_error, 3)),
            (
                "−3 dB (Hz)",
                Cell::Fixed(q.bandwidth / std::f64::consts::TAU, 0),
            ),
            ("largest |T|", Cell::Fixed(q.resonance, 2)),
        ]
    };
    let order = result.h_infinity.simplified.controller.poles.len();
    let mut rows = vec![
        row("three weights, continuous", order, &result.quality[0]),
        row("three weights, sampled", order, &result.quality[1]),
    ];
    if let Some(robust) = &result.robust
        && let Some(q) = robust.loops.iter().find(|l| l.mode_shift == 1.0)
    {
        rows.push(row("robust, sampled", robust.servo.sampled.order(), q));
    }
    let removed = &result.h_infinity.simplified.removed;
    Table::of("H-infinity loops on their own motor", rows).noted(&format!(
        "Best level γ* = {:.4}, controller of order {}; {} pair(s) removed, slowest pole {:.3} rad/s made an integrator, gain changed by at most {:.2} dB from a tenth to a hundred times the crossover.",
        result.h_infinity.level,
        result.h_infinity.full.poles.len(),
        removed.len(),
        result.h_infinity.simplified.integrated,
        20.0 * result.h_infinity.simplified.change.log10()
    ))
}

/// Controller and pre-filter, all combinations.
pub(super) fn two_by_two(result: &AxisResult) -> Table {
    let row = |name: &str, filter, t: &Trial| {
        let below = |d: f64| Cell::Fixed(100.0 * t.error.share_below(d.to_radians()), 2);
        [
            ("controller", Cell::text(name)),
            ("pre-filter", Cell::text(filter)),
            ("rms (deg)", Cell::Fixed(t.error.rms().to_degrees(), 4)),
            (
                "largest (deg)",
                Cell::Fixed(t.error.largest().to_degrees(), 3),
            ),
            (
                "99 % (deg)",
                Cell::Fixed(t.error.quantile(0.99).to_degrees(), 4),
            ),
            ("below 0.05° (%)", below(0.05)),
            ("below 0.1° (%)", below(0.1)),
            ("below 0.2° (%)", below(0.2)),
            ("peak current (A)", Cell::Fixed(t.peak_current, 2)),
        ]
    };
    let bare = result.candidates.iter().map(|c| row(c.name, "no", &c.bare));
    let mut rows: Vec<_> = bare.collect();
    for c in &result.candidates {
        if let Some(t) = &c.filtered {
            rows.push(row(c.name, "yes", t));
        }
    }
    if let Some(t) = &result.as_exported {
        let name = format!("{}, as exported", result.chosen().name);
        rows.push(row(&name, "no", t));
    }
    Table::of("Controller and pre-filter, each with each", rows)
        .noted("Against the set-point before the pre-filter.")
}

/// What became of the scattered motors.
pub(super) fn scattered(result: &AxisResult) -> Table {
    Table::of(
        "Scattered motors",
        result.candidates.iter().map(|c| {
            let kept = c.errors_kept();
            let degrees =
                |v: Option<f64>| v.map_or(Cell::Empty, |v| Cell::Fixed(v.to_degrees(), 4));
            [
                ("controller", Cell::text(c.name)),
                ("motors", Cell::Fixed(c.draws.len() as f64, 0)),
                ("lost", Cell::Fixed(c.lost() as f64, 0)),
                (
                    "rms, median (deg)",
                    degrees(kept.get(kept.len() / 2).map(|e| e.0)),
                ),
                (
                    "rms, worst of those kept (deg)",
                    degrees(kept.last().map(|e| e.0)),
                ),
                (
                    "largest error of those kept (deg)",
                    degrees(kept.iter().map(|e| e.1).reduce(f64::max)),
                ),
            ]
        }),
    )
    .noted("Lost: ran away, or an error beyond a twentieth of the first amplitude.")
}
