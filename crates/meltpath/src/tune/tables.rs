//! Tables of a tuning: gains as the thesis tells them, loops, combinations, scattered motors.

use meltpath_report::table::{Cell, Table};
use meltpath_scan_head::axis::control::CascadeGains;
use meltpath_scan_head::servo::compare::TrackingError;
use meltpath_scan_head::servo::h_infinity::LoopQuality;
use meltpath_scan_head::servo::model::{Actions, Loop, ServoModel};
use meltpath_scan_head::servo::refine::Refined;
use meltpath_scan_head::servo::synthesis::Stage;

use super::bode::loop_name;
use super::design::{AxisResult, Trial};
use super::file::Choice;

/// Rasoanarivo 2020, table 2.1, after the synthesis and after the swarm, and what of ours was fitted to it.
const THESIS: [([f64; 2], &str); 8] = [
    ([1.91, 2.15], COIL),
    ([7e-5, 8e-5], COIL),
    (
        [7.48e-4, 7.08e-4],
        "fitted to the thesis: the motor's inertia",
    ),
    (
        [0.04, 0.005],
        "taken from the thesis where no phase is spare",
    ),
    ([32.0, 24.0], NOT_FITTED),
    ([0.1, 0.09], NOT_FITTED),
    ([1.0, 1.0], NOT_FITTED),
    ([1.0, 1.0], NOT_FITTED),
];
const COIL: &str = "fitted to the thesis: the motor's coil";
const NOT_FITTED: &str = "not fitted";

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

/// Crossover (rad/s) and phase margin (deg) that the thesis tells for the loops after the synthesis.
const THESIS_LOOPS: [(Loop, [&str; 2]); 3] = [
    (Loop::Current, ["≈ 10000", "above 90"]),
    (Loop::Speed, ["≈ 5000", "65"]),
    (Loop::Position, ["≈ 3000", "75"]),
];

/// The head whose Y axis the thesis' table is about.
const THESIS_HEAD: &str = "two-axis head, 150 mm";

fn values(g: &CascadeGains) -> [f64; 8] {
    [
        g.current.gain,
        g.current.integral_time,
        g.speed_gain,
        g.speed_integral_time,
        g.position_gain,
        g.position_derivative_time,
        g.feed_forward.speed,
        g.feed_forward.current,
    ]
}

/// The table of gains, one a row; where the thesis' head is tuned its value stands beside ours.
pub(super) fn gains(result: &AxisResult, head: &str) -> Table {
    let with_thesis = head == THESIS_HEAD;
    let mut headings = vec!["", "after the synthesis"];
    let mut columns: Vec<[Cell; 8]> = vec![values(&result.tuned.gains).map(Cell::Number)];
    if with_thesis {
        headings.push("thesis, after the synthesis");
        columns.push(THESIS.map(|(v, _)| Cell::Number(v[0])));
    }
    if let Some(refined) = &result.refined {
        headings.push(if refined.gains == result.gains {
            "after the swarm"
        } else {
            "after the swarm, not kept"
        });
        columns.push(values(&refined.gains).map(Cell::Number));
    }
    if with_thesis {
        headings.extend(["thesis, after the swarm", "what was fitted"]);
        columns.push(THESIS.map(|(v, _)| Cell::Number(v[1])));
        columns.push(THESIS.map(|(_, fitted)| Cell::text(fitted)));
    } else if let Some(own) = &result.task.own {
        headings.push("those of the head's file");
        columns.push(values(own).map(Cell::Number));
    }
    let mut table = Table::new("Gains of the cascade", &headings);
    for (k, name) in PARAMETERS.into_iter().enumerate() {
        let mut row = vec![Cell::text(name)];
        row.extend(columns.iter().map(|column| column[k].clone()));
        table.rows.push(row);
    }
    if with_thesis {
        "Thesis: Rasoanarivo 2020, table 2.1, Y axis of the two-axis head. Its motor is not printed: inertia and coil of the head's file \
         were chosen so that its current and speed loops cross where it says; position loop and margins were not fitted. Its swarm follows a record of \
         the real drive, which is not printed either."
            .clone_into(&mut table.note);
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
    let mut table = Table::new(
        "Step by step",
        &[
            "loop",
            "step",
            "gain",
            "time (s)",
            "|open loop| at the wanted crossover",
            "margin there (deg)",
        ],
    );
    for s in &result.tuned.steps {
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
        table.rows.push(vec![
            Cell::text(loop_name(s.which)),
            Cell::text(what),
            Cell::Number(gain),
            if time.is_finite() {
                Cell::Number(time)
            } else {
                Cell::text("∞")
            },
            Cell::Number(s.gain_there),
            Cell::Fixed(s.margin_there.to_degrees(), 1),
        ]);
    }
    table
}

/// Crossovers and margins of the loops.
pub(super) fn loops(result: &AxisResult, head: &str) -> Table {
    let mut table = Table::new(
        "Loops",
        &[
            "gains",
            "loop",
            "crossover (rad/s)",
            "phase margin (deg)",
            "distance to the critical point",
        ],
    );
    let with_thesis = head == THESIS_HEAD;
    if with_thesis {
        for heading in ["thesis: crossover (rad/s)", "thesis: phase margin (deg)"] {
            table.columns.push(heading.to_owned());
        }
    }
    let mut ways = vec![("synthesis", result.tuned.gains)];
    if result.gains != result.tuned.gains {
        ways.push(("refined", result.gains));
    }
    let motor = &result.task.axis.motor;
    let mut notes = Vec::new();
    for (name, gains) in ways {
        let model = ServoModel::new(motor, &gains);
        for (which, thesis) in THESIS_LOOPS {
            let Some(f) = model.figures(which) else {
                continue;
            };
            let mut row = vec![
                Cell::text(name),
                Cell::text(loop_name(which)),
                Cell::Fixed(f.crossover.omega, 0),
                Cell::Fixed(f.crossover.value.to_degrees(), 1),
                Cell::Fixed(f.margins.modulus.value, 3),
            ];
            if with_thesis && name == "synthesis" {
                row.extend(thesis.map(Cell::text));
            }
            table.rows.push(row);
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
    table.note = format!("{}.", notes.join("; "));
    if with_thesis {
        table.note.push_str(
            " Thesis: Rasoanarivo 2020, § 2.2.2.2. Crossovers are asked for, and the motor was fitted to the thesis so that its printed gains cross there; margins were not fitted.",
        );
    }
    table
}

/// The H-infinity loops: as designed, sampled, and of the robust controller.
pub(super) fn hinf(result: &AxisResult) -> Table {
    let mut table = Table::new(
        "H-infinity loops on their own motor",
        &[
            "controller",
            "order",
            "crossover (rad/s)",
            "phase margin (deg)",
            "distance to the critical point",
            "|S| = 1 at (rad/s)",
            "|S| at 100 Hz",
            "−3 dB (Hz)",
            "largest |T|",
        ],
    );
    let mut push = |name: &str, order: usize, q: &LoopQuality| {
        table.rows.push(vec![
            Cell::text(name),
            Cell::Fixed(order as f64, 0),
            Cell::Fixed(q.crossover, 0),
            Cell::Fixed(q.phase_margin.to_degrees(), 1),
            Cell::Fixed(q.modulus_margin, 3),
            Cell::Fixed(q.error_band, 0),
            Cell::Fixed(q.slow_error, 3),
            Cell::Fixed(q.bandwidth / std::f64::consts::TAU, 0),
            Cell::Fixed(q.resonance, 2),
        ]);
    };
    let order = result.hinf.simplified.controller.poles.len();
    push("three weights, continuous", order, &result.quality[0]);
    push("three weights, sampled", order, &result.quality[1]);
    if let Some(robust) = &result.robust
        && let Some(q) = robust
            .loops
            .iter()
            .find(|l| l.mode_shift == 1.0 && l.delay == 0.0)
    {
        push("robust, sampled", robust.servo.sampled.order(), q);
    }
    let removed = &result.hinf.simplified.removed;
    table.note = format!(
        "Best level γ* = {:.4}, controller of order {}; {} pair(s) removed, slowest pole {:.3} rad/s made an integrator, gain changed by at most {:.2} dB from a tenth to a hundred times the crossover.",
        result.hinf.level,
        result.hinf.full.poles.len(),
        removed.len(),
        result.hinf.simplified.integrated,
        20.0 * result.hinf.simplified.change.log10()
    );
    table
}

/// Controller and pre-filter, all combinations.
pub(super) fn two_by_two(result: &AxisResult, head: &str) -> Table {
    let mut table = Table::new(
        "Controller and pre-filter, each with each",
        &[
            "controller",
            "pre-filter",
            "rms (deg)",
            "largest (deg)",
            "99 % (deg)",
            "below 0.05° (%)",
            "below 0.1° (%)",
            "below 0.2° (%)",
            "peak current (A)",
        ],
    );
    let with_thesis = head == THESIS_HEAD;
    if with_thesis {
        for heading in [
            "thesis: largest (deg)",
            "thesis: below 0.1° (%)",
            "thesis: below 0.2° (%)",
        ] {
            table.columns.push(heading.to_owned());
        }
    }
    let mut push = |name: &str, filter: &str, t: &Trial, thesis: [Cell; 3]| {
        let below = |d: f64| Cell::Fixed(100.0 * t.error.share_below(d.to_radians()), 2);
        let mut row = vec![
            Cell::text(name),
            Cell::text(filter),
            Cell::Fixed(t.error.rms().to_degrees(), 4),
            Cell::Fixed(t.error.largest().to_degrees(), 3),
            Cell::Fixed(t.error.quantile(0.99).to_degrees(), 4),
            below(0.05),
            below(0.1),
            below(0.2),
            Cell::Fixed(t.peak_current, 2),
        ];
        if with_thesis {
            row.extend(thesis);
        }
        table.rows.push(row);
    };
    let none = || [Cell::Empty, Cell::Empty, Cell::Empty];
    for c in &result.candidates {
        let thesis = if c.choice == Choice::HInfinity {
            [
                Cell::text("below 0.2"),
                Cell::Fixed(99.44, 2),
                Cell::Fixed(100.0, 2),
            ]
        } else {
            none()
        };
        push(c.name, "no", &c.bare, thesis);
    }
    for c in &result.candidates {
        if let Some(t) = &c.filtered {
            let thesis = if c.choice == Choice::Cascade {
                [Cell::text("up to 0.5"), Cell::Fixed(90.84, 2), Cell::Empty]
            } else {
                none()
            };
            push(c.name, "yes", t, thesis);
        }
    }
    if let Some(t) = &result.as_exported {
        let name = format!("{}, as exported", result.chosen().name);
        push(&name, "no", t, none());
    }
    if with_thesis {
        "Thesis: Rasoanarivo 2020, fig. 3.8. Slope and hold of the signal were fitted to that figure (fitted to the thesis): agreement of the shares \
            is no evidence. The thesis compares its conventional control, behind the pre-filter, with H-infinity, of which it does not say whether \
            a pre-filter stood before it: controller and pre-filter change together."
            .clone_into(&mut table.note);
    } else {
        "Against the set-point before the pre-filter.".clone_into(&mut table.note);
    }
    table
}

/// What became of the scattered motors.
pub(super) fn scattered(result: &AxisResult) -> Table {
    let mut table = Table::new(
        "Scattered motors",
        &[
            "controller",
            "motors",
            "lost",
            "rms, median (deg)",
            "rms, worst of those kept (deg)",
            "largest error of those kept (deg)",
        ],
    );
    for c in &result.candidates {
        let kept = c.errors_kept();
        let degrees = |v: Option<f64>| v.map_or(Cell::Empty, |v| Cell::Fixed(v.to_degrees(), 4));
        table.rows.push(vec![
            Cell::text(c.name),
            Cell::Fixed(c.draws.len() as f64, 0),
            Cell::Fixed(c.lost() as f64, 0),
            degrees(kept.get(kept.len() / 2).map(|e| e.0)),
            degrees(kept.last().map(|e| e.0)),
            degrees(kept.iter().map(|e| e.1).reduce(f64::max)),
        ]);
    }
    "Lost: ran away, or an error beyond a twentieth of the first amplitude."
        .clone_into(&mut table.note);
    table
}
