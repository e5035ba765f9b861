//! Acceptance of the controller model (cases waam AC-11 to AC-16, and the demands on curves), through the streaming
//! simulation.

mod closed_form;

use meltpath_base::{Observer, Silent};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DQuat, DVec3};
use meltpath_robot::{
    Command, Controller, Kind, MotionError, Smoothing, Source, Summary, simulate,
};
use meltpath_toolpath::MotionBlock;

fn arcmate() -> Controller {
    let text = meltpath_data::cells::ARCMATE_120IC.text;
    meltpath_base::settings::peek(text, &["motion"])
        .unwrap()
        .unwrap()
}

const T1: f64 = 0.132;
const T2: f64 = 0.084;
/// 0.75 and 0.5 m/min.
const SPEEDS: [f64; 2] = [12.5, 25.0 / 3.0];

struct Record {
    t: Vec<f64>,
    position: Vec<DVec3>,
    speed: Vec<f64>,
    wire: f64,
    summary: Summary,
}

fn start_at(position: DVec3) -> Pose {
    Pose {
        position,
        orientation: DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
    }
}

fn record(start: DVec3, commands: &[Command], controller: &Controller, dt: f64) -> Record {
    let mut blocks: Vec<MotionBlock> = Vec::new();
    let summary = simulate(
        start_at(start),
        commands,
        controller,
        dt,
        &Silent,
        &mut blocks,
    )
    .unwrap();
    let mut r = Record {
        t: vec![],
        position: vec![],
        speed: vec![],
        wire: 0.0,
        summary,
    };
    for b in &blocks {
        r.t.extend((0..b.len()).map(|i| b.time(i)));
        r.position.extend(&b.position);
        r.speed.extend(&b.speed);
        r.wire += b.wire.iter().sum::<f64>();
    }
    r
}

fn turned(degrees: f64) -> DVec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    DVec3::new(cos, sin, 0.0)
}

/// Two segments of 50 mm that turn by `degrees`, with the dwell `dwell` s at the corner.
fn corner(degrees: f64, speed: f64, dwell: f64) -> Record {
    let mut controller = arcmate();
    // point to point, this dwell at CNT 50, none at CNT 100
    controller.dwell.remove(3);
    controller.dwell.remove(1);
    controller.dwell[1].time.value.0 = dwell.min(0.216);
    let smoothing = match dwell {
        0.0 => Smoothing::Cnt(1.0),
        d if d >= T1 + T2 => Smoothing::Cnt(0.0),
        _ => Smoothing::Cnt(0.5),
    };
    let at = DVec3::X * 50.0;
    let commands = [
        Command::line(1, at, speed, smoothing),
        Command::line(2, at + turned(degrees) * 50.0, speed, Smoothing::Fine),
    ];
    record(DVec3::ZERO, &commands, &controller, 0.002)
}

/// Lowest speed in the middle of the run, between half a second before and after the corner.
fn lowest(r: &Record) -> f64 {
    let middle = r.summary.commands[0].end;
    let near =
        r.t.iter()
            .zip(&r.speed)
            .filter(|(t, _)| (*t - middle).abs() < 0.5);
    near.map(|(_, v)| *v).fold(f64::INFINITY, f64::min)
}

#[test]
fn waam_ac11_full_smoothing_slows_by_the_half_angle() {
    for speed in SPEEDS {
        for (angle, ratio) in [(45.0, 0.924), (90.0, 0.707), (135.0, 0.383)] {
            let r = corner(angle, speed, 0.0);
            let found = lowest(&r) / speed;
            assert!((found - ratio).abs() < 1e-3, "{angle}° at {speed}: {found}");
            assert!(
                (found - closed_form::minimum_speed_ratio(T1, T2, 0.0, angle.to_radians())).abs()
                    < 1e-4
            );
            assert!((r.summary.commands[0].passage_speed / speed - found).abs() < 1e-9);
        }
    }
}

#[test]
fn waam_ac12_point_to_point_passes_exactly() {
    for angle in [0.0, 45.0, 90.0, 150.0] {
        let r = corner(angle, 12.5, T1 + T2);
        assert!(lowest(&r) < 1e-6, "{}", lowest(&r));
        assert!(r.summary.commands[0].deviation < 1e-6);
        let at = DVec3::X * 50.0;
        let nearest = r
            .position
            .iter()
            .map(|p| p.distance(at))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-6, "{nearest}");
    }
}

#[test]
fn waam_ac13_half_smoothing_gives_the_slow_downs_of_the_thesis() {
    for (angle, slower) in [(150.0, 84.0), (45.0, 42.0)] {
        let found = 100.0 * (1.0 - lowest(&corner(angle, 12.5, 0.0495)) / 12.5);
        assert!((found - slower).abs() < 1.0, "{angle}°: {found} %");
    }
}

#[test]
fn waam_ac14_deviation_at_the_corner() {
    let of = |angle, speed, dwell| corner(angle, speed, dwell).summary.commands[0].deviation;
    for (angle, mm) in [
        (30.0, 0.121),
        (45.0, 0.179),
        (90.0, 0.331),
        (135.0, 0.433),
        (150.0, 0.452),
    ] {
        let found = of(angle, 12.5, 0.0);
        assert!((found / mm - 1.0).abs() < 0.02, "{angle}°: {found}");
        let slow = of(angle, 25.0 / 3.0, 0.0);
        assert!(
            (slow / found - 2.0 / 3.0).abs() < 1e-4,
            "{angle}°: {slow} / {found}"
        );
        let closed = closed_form::corner_deviation(T1, T2, 0.0, angle.to_radians(), 12.5);
        assert!(
            (found - closed).abs() < 1e-4,
            "{angle}°: {found}, closed form {closed}"
        );
    }
    for (angle, mm) in [(45.0, 0.082), (90.0, 0.152), (135.0, 0.199), (150.0, 0.208)] {
        let found = of(angle, 12.5, 0.050);
        assert!((found / mm - 1.0).abs() < 0.02, "{angle}°: {found}");
    }
}

#[test]
fn waam_ac15_every_transition_lasts_the_same() {
    for speed in SPEEDS {
        for angle in [30.0, 45.0, 90.0, 135.0, 150.0] {
            for dwell in [0.0, 0.050] {
                let r = corner(angle, speed, dwell);
                // nominal constant speed before and after, seen from the middle of each segment
                let velocity = |k: usize| (r.position[k + 1] - r.position[k]) / 0.002;
                let (before, after) = (velocity(1000), velocity(r.t.len() - 1000));
                let away = |k: &usize| {
                    let v = velocity(*k);
                    v.distance(before).min(v.distance(after)) > 1e-6 * speed
                };
                let middle = (1000..r.t.len() - 1000).filter(away).collect::<Vec<_>>();
                let last = (middle.last().unwrap() + 1 - middle[0]) as f64 * 0.002;
                let wanted = closed_form::transition_duration(T1, T2, dwell);
                assert!(
                    (last - wanted).abs() < 0.0045,
                    "{angle}° {speed} {dwell}: {last}"
                );
                let total = 100.0 / speed + 0.216 + dwell;
                assert!((r.summary.total_time - total).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn waam_ac16_angle_and_smoothing_act_as_observed() {
    let angles = [30.0, 60.0, 90.0, 120.0, 150.0];
    let dwells = [0.0, 0.011, 0.0495, 0.1];
    for d in dwells {
        for pair in angles.windows(2) {
            let (a, b) = (corner(pair[0], 12.5, d), corner(pair[1], 12.5, d));
            assert!(lowest(&b) < lowest(&a));
            assert!(b.summary.commands[0].deviation > a.summary.commands[0].deviation);
        }
    }
    for angle in angles {
        for pair in dwells.windows(2) {
            let (smooth, sharp) = (corner(angle, 12.5, pair[0]), corner(angle, 12.5, pair[1]));
            assert!(lowest(&sharp) < lowest(&smooth));
            assert!(sharp.summary.commands[0].deviation < smooth.summary.commands[0].deviation);
        }
    }
}

fn on_circle(radius: f64, angle: f64) -> DVec3 {
    DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
}

/// Mean speed along the simulated path over the whole of a closed path, start and stop excluded.
fn mean_speed(r: &Record, edge: f64) -> f64 {
    let inside: Vec<_> = (0..r.t.len())
        .filter(|&i| r.t[i] > edge && r.t[i] < r.summary.total_time - edge)
        .map(|i| r.position[i])
        .collect();
    let length: f64 = inside.windows(2).map(|w| w[0].distance(w[1])).sum();
    length / ((inside.len() - 1) as f64 * 0.002)
}

#[test]
fn circles_cut_in_any_chord_keep_their_speed() {
    let c = arcmate();
    for chord in [0.2, 0.35, 0.5, 1.0, 2.0, 3.3, 5.0] {
        let step = 2.0 * (0.5_f64 * chord / 30.0).asin();
        let n = (std::f64::consts::TAU / step) as u32;
        let mut commands: Vec<_> = (1..=n)
            .map(|i| {
                Command::line(
                    i,
                    on_circle(30.0, f64::from(i) * step),
                    12.5,
                    Smoothing::Cnt(0.5),
                )
            })
            .collect();
        commands.push(Command::line(
            n + 1,
            on_circle(30.0, 0.0),
            12.5,
            Smoothing::Fine,
        ));
        let r = record(on_circle(30.0, 0.0), &commands, &c, 0.002);
        let mean = mean_speed(&r, 0.3);
        assert!((mean / 12.5 - 1.0).abs() < 0.01, "chord {chord}: {mean}");
        // and the whole turn takes its nominal time plus one stop
        let nominal = 60.0 * std::f64::consts::PI / 12.5 + 0.216;
        assert!(
            (r.summary.total_time / nominal - 1.0).abs() < 0.01,
            "chord {chord}"
        );
        let slowest = r.speed[300..r.speed.len() - 300]
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        assert!(slowest > 0.98 * 12.5, "chord {chord}: {slowest}");
    }
}

#[test]
fn a_true_circle_runs_inside_the_programmed_one_by_the_filters_only() {
    let c = arcmate();
    let quarter = |i: u32, smoothing| {
        let angle = f64::from(i) * std::f64::consts::FRAC_PI_2;
        Command {
            kind: Kind::Arc {
                via: on_circle(30.0, angle - std::f64::consts::FRAC_PI_4),
            },
            ..Command::line(i, on_circle(30.0, angle), 12.5, smoothing)
        }
    };
    let mut commands: Vec<_> = (1..8).map(|i| quarter(i, Smoothing::Cnt(0.5))).collect();
    commands.push(quarter(8, Smoothing::Fine));
    let r = record(on_circle(30.0, 0.0), &commands, &c, 0.002);
    let omega = 12.5 / 30.0;
    let sinc = |x: f64| x.sin() / x;
    let radius = 30.0 * sinc(0.5 * omega * T1) * sinc(0.5 * omega * T2);
    for i in 500..r.t.len() - 500 {
        assert!((r.position[i].length() - radius).abs() < 1e-9);
        assert!((r.speed[i] - radius * omega).abs() < 1e-9);
        let angle = omega * (r.t[i] - 0.108);
        assert!(r.position[i].distance(on_circle(radius, angle)) < 1e-8);
    }
}

#[test]
fn a_line_cut_in_points_takes_its_nominal_time() {
    let c = arcmate();
    for share in [0.01, 0.5, 1.0] {
        let mut commands: Vec<_> = (1..=50)
            .map(|i| {
                Command::line(
                    i,
                    DVec3::new(2.0, 1.0, 0.5) * f64::from(i),
                    12.5,
                    Smoothing::Cnt(share),
                )
            })
            .collect();
        commands[49].smoothing = Smoothing::Fine;
        let r = record(DVec3::ZERO, &commands, &c, 0.002);
        let nominal = DVec3::new(100.0, 50.0, 25.0).length() / 12.5;
        assert!((r.summary.total_time - nominal - 0.216).abs() < 1e-9);
        assert!(r.summary.commands.iter().all(|c| c.deviation < 1e-9));
    }
}

#[test]
fn a_polygon_of_long_sides_is_corners() {
    let c = arcmate();
    let mut p = DVec3::ZERO;
    let commands: Vec<_> = (0..12)
        .map(|i| {
            p += turned(f64::from(i) * 30.0) * 50.0;
            Command::line(i as u32, p, 12.5, Smoothing::Cnt(0.5))
        })
        .collect();
    let r = record(DVec3::ZERO, &commands, &c, 0.002);
    assert!((r.summary.total_time - (48.0 + 11.0 * 0.0495 + 0.216)).abs() < 1e-9);
    for c in &r.summary.commands[..11] {
        let wanted = 12.5 * closed_form::minimum_speed_ratio(T1, T2, 0.0495, 30_f64.to_radians());
        assert!(
            (c.passage_speed - wanted).abs() < 0.02,
            "{}",
            c.passage_speed
        );
    }
}

#[test]
fn wire_is_fed_exactly_while_the_arc_is_on() {
    let c = arcmate();
    let cnt = |id, x, y| Command {
        source: Source::On { wire_feed: 153.3 },
        ..Command::line(id, DVec3::new(x, y, 0.0), 12.5, Smoothing::Cnt(0.5))
    };
    let fine = |id, x, y| Command::line(id, DVec3::new(x, y, 0.0), 40.0, Smoothing::Fine);
    let commands = [
        fine(1, 10.0, 0.0),
        cnt(2, 37.7, 0.0),
        cnt(3, 37.7, 21.3),
        Command {
            smoothing: Smoothing::Fine,
            ..cnt(4, 3.1, 21.3)
        },
        Command {
            kind: Kind::Wait { time: 0.5 },
            ..cnt(5, 0.0, 0.0)
        },
        fine(6, 0.0, 0.0),
        Command {
            kind: Kind::Wait { time: 2.0 },
            ..fine(7, 0.0, 0.0)
        },
    ];
    for dt in [0.001, 0.002, 0.004, 0.012] {
        let r = record(DVec3::ZERO, &commands, &c, dt);
        let s = &r.summary;
        let arc = (27.7 + 21.3 + 34.6) / 12.5 + 2.0 * 0.0495 + 0.216 + 0.5;
        assert!((s.arc_time - arc).abs() < 1e-9, "{}", s.arc_time);
        assert!(
            (r.wire - 153.3 * arc).abs() < 1e-7,
            "{} {}",
            r.wire,
            153.3 * arc
        );
        assert!((s.wire - r.wire).abs() < 1e-7);
        assert!((s.pause_time - 2.0).abs() < 1e-9);
        assert!((s.total_time - s.arc_time - s.pause_time - s.travel_time).abs() < 1e-9);
        // the arc starts at rest on the start point and ends at rest on the end point
        let at = |t: f64| r.position[(t / dt).ceil() as usize];
        assert!(at(s.commands[0].end).distance(DVec3::X * 10.0) < 0.01);
        assert!(at(s.commands[4].end).distance(DVec3::new(3.1, 21.3, 0.0)) < 0.01);
    }
}

#[test]
fn samples_do_not_depend_on_the_sampling() {
    let c = arcmate();
    let commands: Vec<_> = (1..60)
        .map(|i| {
            let x = f64::from(i);
            let p = DVec3::new(x * 1.7, (x * 0.9).sin() * 4.0, (x * 0.3).cos());
            Command::line(i, p, 12.5 + f64::from(i % 3), Smoothing::Cnt(0.5))
        })
        .collect();
    let (fine, coarse) = (
        record(DVec3::ZERO, &commands, &c, 0.001),
        record(DVec3::ZERO, &commands, &c, 0.012),
    );
    for (i, p) in coarse.position.iter().enumerate() {
        if let Some(q) = fine.position.get(12 * i) {
            assert!(p.distance(*q) < 1e-9, "sample {i}: {}", p.distance(*q));
            assert!((coarse.speed[i] - fine.speed[12 * i]).abs() < 1e-8);
        }
    }
}

#[test]
fn a_million_points_end_exactly() {
    struct Last(DVec3, u64, usize);
    impl meltpath_toolpath::MotionSink for Last {
        fn block(&mut self, b: &MotionBlock) {
            self.0 = b.position[b.len() - 1];
            self.1 += b.len() as u64;
            self.2 = self.2.max(b.len());
        }
    }
    let c = arcmate();
    let commands: Vec<_> = (0..1_000_000_u32)
        .map(|i| {
            let t = f64::from(i) * 1e-3;
            let p = DVec3::new(80.0 * t.cos(), 60.0 * (1.3 * t).sin(), 0.01 * t);
            Command {
                source: Source::On { wire_feed: 150.0 },
                ..Command::line(i, p, 12.5, Smoothing::Cnt(0.5))
            }
        })
        .collect();
    let mut last = Last(DVec3::ZERO, 0, 0);
    let start = start_at(commands[0].target);
    let s = simulate(start, &commands, &c, 0.002, &Silent, &mut last).unwrap();
    assert!(last.0.distance(commands[999_999].target) < 1e-9);
    assert_eq!(last.1, s.samples);
    assert!(last.2 <= 4096);
    assert_eq!(s.commands.len(), 1_000_000);
    assert!((s.wire - 150.0 * s.arc_time).abs() < 1e-6);
    assert!(s.samples > 2_000_000);
}

#[test]
fn the_tool_axis_turns_with_the_move() {
    let c = arcmate();
    let tilted = DQuat::from_rotation_y(0.6) * DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
    let commands = [
        Command {
            orientation: tilted,
            ..Command::line(1, DVec3::X * 50.0, 12.5, Smoothing::Fine)
        },
        // turning back in place takes the time of the turn
        Command::line(2, DVec3::X * 50.0, 12.5, Smoothing::Fine),
    ];
    let mut blocks: Vec<MotionBlock> = Vec::new();
    let s = simulate(
        start_at(DVec3::ZERO),
        &commands,
        &c,
        0.002,
        &Silent,
        &mut blocks,
    )
    .unwrap();
    let block = &blocks[0];
    let wanted = tilted * -DVec3::Z;
    let (axis, position) = ((4.108_f64 / 0.002) as usize, (2.108_f64 / 0.002) as usize);
    assert!(block.axis[axis + 54].distance(wanted) < 1e-3);
    assert!(block.axis.iter().all(|a| (a.length() - 1.0).abs() < 1e-12));
    let half = block.axis[position].angle_between(DVec3::Z);
    assert!((half - 0.3).abs() < 1e-3, "{half}");
    let turn = 0.6 / c.rotation_speed.value.0;
    assert!((s.total_time - (4.0 + turn + 2.0 * 0.216)).abs() < 1e-9);
    assert!(
        blocks
            .last()
            .unwrap()
            .axis
            .last()
            .unwrap()
            .distance(DVec3::Z)
            < 1e-9
    );
}

#[test]
fn what_cannot_be_executed_is_refused_by_number() {
    let c = arcmate();
    let good = Command::line(7, DVec3::X, 12.5, Smoothing::Fine);
    let try_it = |command: Command| {
        let mut none: Vec<MotionBlock> = Vec::new();
        simulate(
            start_at(DVec3::ZERO),
            &[good, command],
            &c,
            0.002,
            &Silent,
            &mut none,
        )
    };
    for bad in [
        Command { speed: 0.0, ..good },
        Command {
            speed: f64::NAN,
            ..good
        },
        Command {
            target: DVec3::NAN,
            ..good
        },
        Command {
            smoothing: Smoothing::Cnt(1.2),
            ..good
        },
        Command {
            kind: Kind::Wait { time: -1.0 },
            ..good
        },
        Command {
            source: Source::On {
                wire_feed: f64::INFINITY,
            },
            ..good
        },
    ] {
        let error = try_it(bad).unwrap_err();
        assert!(
            matches!(
                error,
                MotionError::Command {
                    index: 1,
                    id: 7,
                    ..
                }
            ),
            "{error}"
        );
    }
    let mut none: Vec<MotionBlock> = Vec::new();
    assert!(matches!(
        simulate(
            start_at(DVec3::ZERO),
            &[good],
            &c,
            0.005,
            &Silent,
            &mut none
        ),
        Err(MotionError::Controller(_))
    ));
}

#[test]
fn a_cancelled_run_stops() {
    struct Stop;
    impl Observer for Stop {
        fn stage(&self, _: &str, _: u64) {}
        fn advance(&self, _: u64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let far = Command::line(1, DVec3::X * 1e6, 12.5, Smoothing::Fine);
    let mut blocks: Vec<MotionBlock> = Vec::new();
    let result = simulate(
        start_at(DVec3::ZERO),
        &[far],
        &arcmate(),
        0.002,
        &Stop,
        &mut blocks,
    );
    assert!(matches!(result, Err(MotionError::Cancelled(_))));
    assert_eq!(blocks.len(), 1);
}

#[test]
fn nothing_to_do_is_one_sample() {
    let r = record(DVec3::Y, &[], &arcmate(), 0.002);
    assert_eq!(r.position, [DVec3::Y]);
    assert_eq!(r.summary.total_time, 0.0);
}
