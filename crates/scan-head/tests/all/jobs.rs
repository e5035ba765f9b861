//! Jobs, contour error, delays, fill rates.

use std::sync::Arc;

use meltpath_base::Silent;
use meltpath_geometry::math::DVec2;
use meltpath_planning::powder::plate::SquarePlate;
use meltpath_scan_head::axis::error::AxisError;
use meltpath_scan_head::axis::friction::Friction;
use meltpath_scan_head::head::block::{HeadBlock, HeadSink};
use meltpath_scan_head::head::error::HeadError;
use meltpath_scan_head::head::gate::{Darkness, Gate};
use meltpath_scan_head::head::interpolation::{CommandBlock, Interpolator, sample_count};
use meltpath_scan_head::head::prepared::{Prepared, alone};
use meltpath_scan_head::head::recipe::{LaserDelays, Recipe};
use meltpath_scan_head::head::scan_head::ScanHead;
use meltpath_scan_head::head::vector::ScanJob;
use meltpath_scan_head::head::window::Window;
use meltpath_scan_head::measures::delays::{DelayTuning, HitRecord};
use meltpath_scan_head::measures::fill_rate::{Cells, FillMode, FillRate};
use meltpath_scan_head::measures::fill_share::AreaFill;
use meltpath_scan_head::measures::hatch::HatchDistance;

use super::reference::{job_of, measured, one, recipes, three_axis_data, two_axis_data};
use meltpath_toolpath::Role;

/// AC-39 (T): job times and their ratios.
#[test]
fn lpbf_ac39_job_times() {
    let time = |plate: SquarePlate, recipe: &Recipe, period: f64| {
        let job = job_of(&plate, recipe);
        (sample_count(alone(&job), period).unwrap() - 1) as f64 * period
    };
    let [r1, r2, r3] = recipes();
    let three = three_axis_data();
    let two = two_axis_data();
    let t3: Vec<f64> = [&r1, &r2, &r3]
        .map(|r| time(three.plate, r, three.head.period))
        .to_vec();
    let t2: Vec<f64> = [&r1, &r2]
        .map(|r| time(two.plate, r, two.head.period))
        .to_vec();
    println!("three axes {t3:?}; two axes {t2:?}");
    for (ours, printed) in t3
        .iter()
        .zip([354.326, 263.441, 131.928])
        .chain(t2.iter().zip([118.014, 87.714]))
    {
        assert!(
            (ours / printed - 1.0).abs() < 0.05,
            "{ours} against {printed} s"
        );
    }
    for (ratio, printed) in [
        (t3[1] / t3[0], 0.7435),
        (t2[1] / t2[0], 0.7433),
        (t3[2] / t3[0], 0.3723),
    ] {
        assert!(
            (ratio / printed - 1.0).abs() < 0.01,
            "{ratio} against {printed}"
        );
    }
    let job = job_of(&one(three.plate), &r1);
    assert!((job.length(Role::Fill) - 910.0).abs() < 1.0);
    assert_eq!(
        job.vectors.iter().filter(|v| v.kind == Role::Fill).count(),
        135
    );
}

fn shares(area: &AreaFill) -> Vec<f64> {
    area.rates.iter().map(|rate| rate.share).collect()
}

/// Fill rates of the commanded path itself, in the given modes.
fn ideal(plate: SquarePlate, speed: f64, period: f64, modes: &[FillMode]) -> Vec<f64> {
    let mut recipe = recipes()[0].clone();
    recipe.fill_speed = speed;
    recipe.delays = LaserDelays::default();
    let job = job_of(&plate, &recipe);
    let mut window = Window::new(alone(&job));
    let mut path = Interpolator::new(period, 0);
    let mut gate = Gate::new(&mut window, recipe.delays, period);
    let mut rate = FillRate::of_rectangles(plate.fill_areas(), 0.07, modes);
    let mut command = CommandBlock::default();
    let whole = Arc::new(Prepared::of(job));
    while path.fill(&mut window, &mut command, 5000) {
        let block = HeadBlock {
            period,
            hit: command.position.iter().map(|p| p.truncate()).collect(),
            focus: vec![0.0; command.position.len()],
            lit: (0..command.position.len())
                .map(|k| gate.lit(&mut window, command.first + k as u64))
                .collect(),
            command: command.clone(),
            layers: vec![Arc::clone(&whole)],
            ..HeadBlock::default()
        };
        rate.block(&block);
    }
    shares(&rate.finish()[0])
}

#[test]
fn the_hatch_distance_of_a_job_is_its_plates() {
    let plate = one(three_axis_data().plate);
    let found = HatchDistance::of(&job_of(&plate, &recipes()[0])).unwrap();
    assert!((found - plate.hatch).abs() < 1e-9, "{found}");
}

/// AC-42 (R): fill rates of the ideal path (docs/theory/sources.md, reference runs), ± 1.5 point.
#[test]
fn lpbf_ac42_ideal_fill_rates() {
    let reference = one(three_axis_data().plate);
    let mut told = Vec::new();
    let mut off = Vec::new();
    for (hatch, inset, frequency, expected) in [
        (
            0.09,
            0.0,
            93_750.0,
            vec![(1000.0, 99.94), (1500.0, 98.82), (3000.0, 91.87)],
        ),
        (0.09, 0.0, 20_000.0, vec![(1000.0, 81.95), (1500.0, 68.24)]),
        (
            0.10,
            0.0,
            93_750.0,
            vec![(1000.0, 94.00), (1500.0, 91.53), (3000.0, 83.81)],
        ),
        (0.10, 0.0, 20_000.0, vec![(1000.0, 74.97), (1500.0, 61.56)]),
        (
            0.10,
            0.0,
            500_000.0,
            vec![(1000.0, 98.07), (1500.0, 97.64), (3000.0, 96.00)],
        ),
        (
            0.10,
            0.23,
            187_500.0,
            vec![(1000.0, 95.99), (1500.0, 94.55), (3000.0, 90.26)],
        ),
        (
            0.10,
            0.23,
            500_000.0,
            vec![(1000.0, 97.83), (1500.0, 97.37), (3000.0, 95.53)],
        ),
        (
            0.11,
            0.0,
            93_750.0,
            vec![(1000.0, 85.07), (1500.0, 83.05), (3000.0, 75.38)],
        ),
        (0.11, 0.0, 20_000.0, vec![(1000.0, 67.16), (1500.0, 55.85)]),
    ] {
        let plate = SquarePlate {
            hatch,
            inset,
            ..reference
        };
        for (speed, rate) in expected {
            let ours = 100.0
                * ideal(
                    plate,
                    speed,
                    1.0 / frequency,
                    &[FillMode::SampledPoints { every: 1 }],
                )[0];
            told.push(format!(
                "{hatch}/{inset} {frequency} Hz {speed}: {ours:.2} (table {rate})"
            ));
            off.push((ours - rate).abs());
        }
    }
    println!("{}", told.join("\n"));
    let worst = off.iter().copied().fold(0.0, f64::max);
    assert!(worst < 1.5, "{worst}");
}

#[test]
fn cells_of_a_segment_and_of_a_spot() {
    let cells = |f: &dyn Fn(&mut Cells)| {
        let mut c = Cells::new(DVec2::ZERO, DVec2::splat(1.0), 0.1);
        f(&mut c);
        c.counts()
    };
    assert_eq!(
        cells(&|c| c.segment(DVec2::new(0.05, 0.05), DVec2::new(0.95, 0.05))),
        (100, 10)
    );
    assert_eq!(
        cells(&|c| c.segment(DVec2::new(0.01, 0.05), DVec2::new(0.99, 0.98))).1,
        19
    );
    assert_eq!(
        cells(&|c| c.swept(DVec2::new(0.05, 0.05), DVec2::new(0.95, 0.05), 0.12)).1,
        20
    );
    assert_eq!(cells(&|c| c.point(DVec2::new(1.5, 0.5))).1, 0);
}

#[test]
fn the_gate_lights_what_was_asked_for_as_long_as_asked() {
    let recipe = &recipes()[0];
    let job = job_of(&one(three_axis_data().plate), recipe);
    let period = 1.0 / 93_750.0;
    let lit = |delays| -> f64 {
        let mut window = Window::new(alone(&job));
        let mut gate = Gate::new(&mut window, delays, period);
        (0..sample_count(alone(&job), period).unwrap() + 1000)
            .map(|k| gate.lit(&mut window, k))
            .sum::<f64>()
            * period
    };
    let plain = lit(LaserDelays::default());
    // whole samples round each vector up
    let marks = job.length(Role::Contour) / 1500.0 + job.length(Role::Fill) / 1000.0 + 6.0 * 1.5e-3;
    assert!((plain - marks).abs() < 145.0 * period, "{plain} {marks}");
    let chains = 137.0;
    let both = lit(LaserDelays {
        on: 100e-6,
        off: 250e-6,
    });
    // lines shorter than 100 µs lose less
    assert!(
        (both - plain - chains * 150e-6).abs() < 2e-4,
        "{both} {plain}"
    );
}

fn run(head: &ScanHead, plate: &SquarePlate, recipe: &Recipe) -> (PathTold, Vec<Vec<f64>>) {
    let job = job_of(plate, recipe);
    let ready = head.ready().unwrap();
    let mut sinks = measured(plate, head.period);
    ready
        .run(&job, recipe.delays, 1, &Silent, &mut sinks)
        .unwrap();
    let told = PathTold {
        tracking: [0, 1].map(|i| sinks.0.tracking[i].quantile(0.5)),
        p99: sinks.0.tracking[0].quantile(0.99),
        below: [0.01, 0.02, 0.03, 0.1].map(|t| sinks.0.contour.share_below(t)),
    };
    (told, sinks.1.finish().iter().map(shares).collect())
}

/// Tracking medians of X and Y (deg), their 99th percentile on X, shares of contour points below 10, 20, 30, 100 µm.
#[derive(Debug)]
struct PathTold {
    tracking: [f64; 2],
    p99: f64,
    below: [f64; 4],
}

fn tell(head: &str, recipe: &Recipe, told: &PathTold, fill: &[f64]) {
    println!(
        "{head}, {}: delays {:.0}/{:.0} µs, tracking medians {:?} deg, X p99 {:.4} deg, contours below 10, 20, 30, 100 µm {:?}, fill {fill:?}",
        recipe.name,
        recipe.delays.on * 1e6,
        recipe.delays.off * 1e6,
        told.tracking,
        told.p99,
        told.below
    );
}

/// Duration of the shortest chain of marks, s.
fn shortest(job: &ScanJob, period: f64) -> f64 {
    Darkness::of(alone(job), LaserDelays::default(), period)
        .unwrap()
        .shortest
}

/// Tuned delays of a head and recipe on two squares.
fn tuned(head: &ScanHead, plate: &SquarePlate, recipe: &Recipe) -> LaserDelays {
    let two = SquarePlate {
        columns: 2,
        rows: 1,
        ..*plate
    };
    let job = job_of(&two, recipe);
    let mut record = HitRecord::default();
    head.ready()
        .unwrap()
        .run(&job, recipe.delays, 1, &Silent, &mut record)
        .unwrap();
    DelayTuning::new(&job, &record.hits, head.period, 800e-6, 0.035)
        .tune(shortest(&job, head.period))
        .best
        .delays
}

/// AC-40 (T): without on-delay beads between squares, without off-delay incomplete ends, with a long one excess; tuned
/// values in the ranges stated.
#[test]
fn lpbf_ac40_laser_delays() {
    let data = three_axis_data();
    let recipe = &recipes()[0];
    let two = SquarePlate {
        columns: 2,
        rows: 1,
        ..data.plate
    };
    let job = job_of(&two, recipe);
    let mut record = HitRecord::default();
    data.head
        .ready()
        .unwrap()
        .run(&job, recipe.delays, 1, &Silent, &mut record)
        .unwrap();
    let tuning = DelayTuning::new(&job, &record.hits, data.head.period, 3e-3, 0.035);
    let at = |on: f64, off: f64| tuning.score(LaserDelays { on, off });
    let found = tuning.tune(shortest(&job, data.head.period));
    let best = found.best;
    let lit = Darkness::of(alone(&job), best.delays, data.head.period).unwrap();
    assert_eq!(lit.dark, 0, "{best:?}");
    println!(
        "tuned {best:?}: on {:.0} µs, off {:.0} µs; spurious {:.3} mm, missing {:.3} mm; none: spurious {:.3} mm, missing {:.3} mm; 2.5 ms off: spurious {:.3} mm",
        best.delays.on * 1e6,
        best.delays.off * 1e6,
        best.spurious(),
        best.missing(),
        at(0.0, 0.0).spurious_start,
        at(0.0, 0.0).missing_end,
        at(best.delays.on, 2.5e-3).spurious_end
    );
    assert!(
        at(0.0, 0.0).spurious_start > 1.0,
        "beads between lines and squares"
    );
    // next to none with the longer on-delay that leaves the shortest marks dark
    assert!(best.spurious_start < 0.1 * at(0.0, 0.0).spurious_start);
    assert!(at(best.delays.on, 0.0).missing_end > 2.0 * best.missing_end);
    // light beyond the wait at the line's end draws a bead towards the next
    assert!(at(best.delays.on, 2.5e-3).spurious_end > best.spurious_end + 1.0);
    assert!((100e-6..=450e-6).contains(&best.delays.on), "{best:?}");
    assert!((20e-6..=350e-6).contains(&best.delays.off), "{best:?}");
    let front = tuning.pareto(16);
    assert!(
        front
            .windows(2)
            .all(|w| w[0].spurious() <= w[1].spurious() && w[0].missing() > w[1].missing())
    );
}

/// AC-41, AC-43, AC-44, AC-46 and the contour shares of the conventional structure, one square at the centre of the field.
#[test]
fn lpbf_ac41_ac43_ac44_ac46_recipes_on_one_square() {
    let mut three = Vec::new();
    let data = three_axis_data();
    let plate = one(data.plate);
    for recipe in &recipes() {
        let mut recipe = recipe.clone();
        recipe.delays = tuned(&data.head, &plate, &recipe);
        let (told, fill) = run(&data.head, &plate, &recipe);
        tell("three axes", &recipe, &told, &fill[0]);
        three.push((told, fill));
    }
    // AC-41: the rate falls when the speed rises
    assert!(three[0].1[0][0] > three[1].1[0][0] && three[1].1[0][0] > three[2].1[0][0]);
    // AC-46: the lag is a time: errors grow as the fill speeds 1 : 1.5 : 3
    let lag = |k: usize, axis: usize| three[k].0.tracking[axis];
    for axis in [0, 1] {
        assert!(
            (lag(1, axis) / lag(0, axis) / 1.5 - 1.0).abs() < 0.25,
            "{axis}"
        );
        assert!(
            (lag(2, axis) / lag(0, axis) / 3.0 - 1.0).abs() < 0.25,
            "{axis}"
        );
    }
    let data = two_axis_data();
    let plate = one(data.plate);
    let mut two = Vec::new();
    for recipe in &recipes()[..2] {
        let mut recipe = recipe.clone();
        recipe.delays = tuned(&data.head, &plate, &recipe);
        let (told, fill) = run(&data.head, &plate, &recipe);
        tell("two axes", &recipe, &told, &fill[0]);
        two.push((told, fill));
    }
    // AC-43: sampled at 20 kHz
    assert!((two[0].1[0][0] - 0.6847).abs() < 0.08, "{:?}", two[0].1);
    assert!((two[1].1[0][0] - 0.5428).abs() < 0.08, "{:?}", two[1].1);
    // AC-44: conventional with pre-filter, recipe 1: median within 0.020 to 0.030 deg
    assert!(
        (0.015..0.035).contains(&two[0].0.tracking[0]),
        "{:?}",
        two[0].0
    );
}

/// AC-41 (T): where the fill goes. Cells with a lit sample, % of recipes 1 to 3, one square: the commanded path, the path with
/// delays equal to the steady lag, with tuned delays, without friction; at 93.75 and 187.5 kHz.
#[test]
fn lpbf_ac41_where_the_fill_goes() {
    let data = three_axis_data();
    let plate = one(data.plate);
    let modes = [FillMode::SampledPoints { every: 1 }, FillMode::SweptSpot];
    let mut smooth = data.head.clone();
    for axis in smooth.driven_mirrors() {
        axis.motor.friction = Friction::None;
    }
    // X and Y with the same filters: equal lags
    let mut alike = smooth.clone();
    alike.filter_alike();
    let mut sticky = data.head.clone();
    sticky.filter_alike();
    let apart = |head: &ScanHead| {
        let [x, y] = head
            .mirrors
            .each_ref()
            .map(|m| m.motor().unwrap().prefilter.unwrap().lag());
        (x - y).abs()
    };
    assert!(apart(&data.head) > 10e-6 && apart(&alike) < 1e-9);
    let mirror_lag = |head: &ScanHead| {
        head.mirrors[0]
            .motor()
            .unwrap()
            .prefilter
            .as_ref()
            .map_or(0.0, |p| p.lag() + 15e-6)
    };
    let mut found = Vec::new();
    for frequency in [93_750.0, 187_500.0] {
        let at = |head: &ScanHead| ScanHead {
            period: 1.0 / frequency,
            ..head.clone()
        };
        let (head, smooth) = (at(&data.head), at(&smooth));
        let (alike, sticky) = (at(&alike), at(&sticky));
        let mut rates = Vec::new();
        for recipe in &recipes() {
            let rate = |head: &ScanHead, delays: LaserDelays| {
                let recipe = Recipe {
                    delays,
                    ..recipe.clone()
                };
                let job = job_of(&plate, &recipe);
                let mut fill = FillRate::of_rectangles(plate.fill_areas(), 0.07, &modes);
                let ready = head.ready().unwrap();
                ready.run(&job, delays, 1, &Silent, &mut fill).unwrap();
                100.0 * shares(&fill.finish()[0])[0]
            };
            let ideal = 100.0 * ideal(plate, recipe.fill_speed, head.period, &modes)[0];
            let lag = mirror_lag(&head);
            let late = LaserDelays { on: lag, off: lag };
            let slow = mirror_lag(&alike);
            let own = tuned(&head, &plate, recipe);
            let long = LaserDelays {
                on: lag,
                off: own.off,
            };
            let row = [
                ideal,
                rate(&head, late),
                rate(&head, long),
                rate(&head, own),
                rate(&smooth, late),
                rate(
                    &alike,
                    LaserDelays {
                        on: slow,
                        off: slow,
                    },
                ),
                rate(&sticky, tuned(&sticky, &plate, recipe)),
            ];
            println!(
                "{frequency} Hz, {}: commanded {:.1}, delays of the lag ({:.0} µs) {:.1}, tuned off-delay {:.1}, tuned ({:.0}/{:.0} µs) {:.1}, delays of the lag without friction {:.1}, and X and Y filtered alike {:.1}; filtered alike with friction and tuned delays {:.1} %",
                recipe.name,
                row[0],
                1e6 * lag,
                row[1],
                row[2],
                1e6 * own.on,
                1e6 * own.off,
                row[3],
                row[4],
                row[5],
                row[6]
            );
            rates.push(row);
        }
        found.push(rates);
    }
    for rates in &found {
        // the rate falls when the speed rises, whatever the delays
        for k in [0, 3] {
            assert!(rates[0][k] > rates[1][k] && rates[1][k] > rates[2][k]);
        }
        // what X and Y out of step cost, and that friction does not
        for row in rates {
            assert!(row[5] > row[4] + 2.0 && row[5] < row[0] + 0.5, "{row:?}");
            assert!((row[4] - row[1]).abs() < 2.0, "{row:?}");
        }
    }
}

/// Contour shares of the conventional structure, three axes, recipe 1 (table 3.1: 93.51, 98.3, 99.32 % below 10, 20, 30 µm).
/// Not reproduced with the reference friction, which leaves the axis at rest beside its set-point; near it without friction.
#[test]
fn lpbf_table_3_1_contour_shares_hang_on_friction() {
    let mut data = three_axis_data();
    let plate = one(data.plate);
    let recipe = &recipes()[0];
    let share = |head: &ScanHead| run(head, &plate, recipe).0.below;
    let with = share(&data.head);
    for axis in data.head.driven_mirrors() {
        axis.motor.friction = Friction::None;
    }
    let without = share(&data.head);
    println!("contour shares with friction {with:?}, without {without:?}");
    assert!(with[2] < 0.5, "{with:?}");
    assert!(
        without[0] > 0.7 && without[1] > 0.94 && without[2] > 0.97,
        "{without:?}"
    );
}

#[test]
fn jobs_that_cannot_run_are_refused() {
    let data = three_axis_data();
    let ready = data.head.ready().unwrap();
    let recipe = &recipes()[0];
    let far = SquarePlate {
        columns: 2,
        rows: 1,
        column_pitch: 345.0,
        ..data.plate
    };
    let job = job_of(&far, recipe);
    let error = ready
        .run(&job, recipe.delays, 1, &Silent, &mut Vec::new())
        .unwrap_err();
    assert!(matches!(error, HeadError::Field { .. }), "{error}");
    // found before anything moves, too
    let mut unstable = data.head.clone();
    unstable.driven_mirrors().next().unwrap().delay = 300e-6;
    assert!(ready.check_stable().is_ok());
    let error = unstable.ready().unwrap().check_stable();
    assert!(
        matches!(
            &error,
            Err(HeadError::Axis {
                axis: 'X',
                source: AxisError::Oscillates { .. }
            })
        ),
        "{error:?}"
    );
    let job = job_of(&one(data.plate), recipe);
    let error = unstable
        .ready()
        .unwrap()
        .run(&job, recipe.delays, 1, &Silent, &mut Vec::new());
    assert!(
        matches!(error, Err(HeadError::Axis { axis: 'X', .. })),
        "{error:?}"
    );
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let data = three_axis_data();
    let mut head = data.head;
    head.driven_mirrors().next().unwrap().encoder.noise = 1e-6;
    let recipe = &recipes()[1];
    let small = SquarePlate {
        side: 2.0,
        ..one(data.plate)
    };
    let job = job_of(&small, recipe);
    let ready = head.ready().unwrap();
    let on = |threads| {
        let pool = crate::threads(threads);
        let mut blocks: Vec<HeadBlock> = Vec::new();
        pool.install(|| ready.run(&job, recipe.delays, 7, &Silent, &mut blocks))
            .unwrap();
        blocks
    };
    assert_eq!(on(1), on(3));
}
