//! The drawn beam against a step-by-step integration, closed formulas, and itself cut otherwise.

use meltpath_geometry::math::DVec2;
use meltpath_gun::Machine;
use meltpath_gun::follow::follow;
use meltpath_gun::stretch::stretches;
use meltpath_toolpath::MotionBlock;
use proptest::prelude::*;

use crate::{gun, motion};

/// Two lines of a hatch with a jump at once between them, and a third at an angle, of another power.
fn hatch() -> MotionBlock {
    motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [2e-3, 2.0, 0.0, 300.0],
        [2e-3, 0.0, 0.125, 0.0],
        [4e-3, 2.0, 0.125, 300.0],
        [5e-3, 3.0, 1.0, 200.0],
    ])
}

fn dynamic(damping: f64) -> Machine {
    gun(&format!(
        "[current]\nslew = {{ value = \"40 mA/ms\", source = \"log\" }}\nbandwidth = {{ value = \"5 kHz\", source = \"log\" }}\nbetween = \"ramped\"\n\
         [deflection]\nlag = {{ value = \"60 µs\", source = \"log\" }}\ndamping = {{ value = \"{damping} 1\", source = \"log\" }}\n"
    ))
}

/// The beam at `times` by small steps of the equations of motion, and the energy brought by then.
fn integrated(asked: &MotionBlock, gun: &Machine, times: &[f64]) -> Vec<(DVec2, f64)> {
    let w = 2.0 * gun.damping / gun.lag.unwrap();
    let limit = gun.slew.unwrap() * 60e3;
    let (mut at, mut rate, mut power, mut energy) = (DVec2::ZERO, DVec2::ZERO, 0.0, 0.0);
    let (mut found, mut next) = (Vec::new(), 0);
    for stretch in stretches(asked).iter().filter(|s| s.takes > 0.0) {
        let count = (stretch.takes / 2e-8).ceil();
        let step = stretch.takes / count;
        for n in 0..count as u32 {
            let command = |t: f64| stretch.from.lerp(stretch.to, t / stretch.takes);
            let pull = |at: DVec2, rate: DVec2, t: f64| {
                w * w * (command(t) - at) - 2.0 * gun.damping * w * rate
            };
            // the midpoint rule
            let t = f64::from(n) * step;
            let before = (at, energy);
            let half = rate + 0.5 * step * pull(at, rate, t);
            let middle = at + 0.5 * step * rate;
            rate += step * pull(middle, half, t + 0.5 * step);
            at += step * half;
            let climb = |p: f64| ((stretch.power - p) / gun.settling.unwrap()).clamp(-limit, limit);
            let half = power + 0.5 * step * climb(power);
            power += step * climb(half);
            energy += step * half;
            while next < times.len() && times[next] <= stretch.time + t + step {
                let share = (times[next] - stretch.time - t) / step;
                let energy = before.1 + share * (energy - before.1);
                found.push((before.0.lerp(at, share), energy));
                next += 1;
            }
        }
    }
    found.resize(times.len(), (at, energy));
    found
}

#[test]
fn the_beam_is_that_of_the_equations_of_motion() {
    for damping in [0.3, 1.0, 2.5] {
        let (asked, gun) = (hatch(), dynamic(damping));
        let drawn = follow(&asked, &gun, 60e3).motion;
        drawn.sanity_check().unwrap();
        let times: Vec<f64> = (0..drawn.len()).map(|n| drawn.time(n)).collect();
        let mut energy = 0.0;
        for (n, (at, wanted)) in integrated(&asked, &gun, &times).into_iter().enumerate() {
            if n > 0 {
                energy += drawn.power[n] * (times[n] - times[n - 1]);
            }
            let here = drawn.position[n].truncate();
            assert!(here.distance(at) < 1e-4, "{damping} {n}: {here} for {at}");
            assert!(
                (energy - wanted).abs() < 2e-5,
                "{damping} {n}: {energy} for {wanted}"
            );
        }
        // and between the samples, to the tolerance of straight pieces
        let middle: Vec<f64> = times.windows(2).map(|t| 0.5 * (t[0] + t[1])).collect();
        for (n, (at, _)) in integrated(&asked, &gun, &middle).into_iter().enumerate() {
            let here = drawn.position[n]
                .lerp(drawn.position[n + 1], 0.5)
                .truncate();
            assert!(here.distance(at) < 1.1e-3, "{damping} {n}: {here} for {at}");
        }
    }
}

proptest! {
    /// A line that is cut in two is drawn as it was whole.
    #[test]
    fn cutting_a_line_moves_nothing(share in 0.01..0.99_f64, damping in 0.2..3.0_f64) {
        let gun = dynamic(damping);
        let line = [[0.0, 0.0, 0.0, 0.0], [1e-3, 1.5, 0.4, 300.0], [2e-3, 1.5, 1.4, 300.0]];
        let cut = [line[0], [share * 1e-3, share * 1.5, share * 0.4, 300.0], line[1], line[2]];
        let [whole, cut] = [&line[..], &cut[..]].map(|points| follow(&motion(points), &gun, 60e3));
        let last = |m: &MotionBlock| m.position[m.len() - 1];
        prop_assert!(last(&whole.motion).distance(last(&cut.motion)) < 1e-9);
        let energy = |m: &MotionBlock| (1..m.len()).map(|n| m.power[n] * (m.time(n) - m.time(n - 1))).sum::<f64>();
        prop_assert!((energy(&whole.motion) - energy(&cut.motion)).abs() < 1e-7);
    }
}

/// Of a gun of which nothing is known the path is drawn as planned.
#[test]
fn a_gun_without_figures_draws_the_plan() {
    let drawn = follow(&hatch(), &gun(""), 60e3);
    assert_eq!(drawn.motion, hatch());
    assert_eq!(
        (drawn.beside.0, drawn.behind, drawn.waited),
        (0.0, 0.0, 0.0)
    );
}

#[test]
fn corners_are_cut_and_the_place_is_told() {
    let corner = motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [2e-3, 2.0, 0.0, 300.0],
        [4e-3, 2.0, 2.0, 300.0],
    ]);
    let drawn = follow(&corner, &dynamic(1.0), 60e3);
    // critically damped, lag 2/w, speed v: with s = w t after the corner x lacks v/w (2 + s) e^-s and y has v/w (s - 2 + (2 + s) e^-s);
    // the nearer of the two lines is as far as the lesser of both
    let lag = 60e-6;
    let lack = |s: f64| 1000.0 * lag / 2.0 * (2.0 + s) * (-s).exp();
    let rise = |s: f64| 1000.0 * lag / 2.0 * (s - 2.0) + lack(s);
    let most = (0..10_000)
        .map(|n| f64::from(n) * 1e-3)
        .map(|s| lack(s).min(rise(s)));
    let most = most.fold(0.0, f64::max);
    assert!(
        (drawn.beside.0 - most).abs() < 1e-3 && most > 0.005,
        "{} {most}",
        drawn.beside.0
    );
    let [x, y] = drawn.beside.1;
    assert!((x - 2.0).abs() < 0.05 && y.abs() < 0.05, "{x} {y}");
    assert!((drawn.behind - 0.06).abs() < 1e-3, "{}", drawn.behind);
}

/// A jump takes its time, the later lines come later; where the job gave it longer, nothing is added.
#[test]
fn jumps_take_their_time() {
    let gun = gun("[deflection]\njump = { value = \"200 µs\", source = \"log\" }");
    let drawn = follow(&hatch(), &gun, 60e3);
    let end = drawn.motion.time(drawn.motion.len() - 1);
    assert!((drawn.waited - 2e-4).abs() < 1e-12 && (end - 5.2e-3).abs() < 1e-12);
    let slow = motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [2e-3, 2.0, 0.0, 300.0],
        [3e-3, 0.0, 0.1, 0.0],
        [5e-3, 2.0, 0.1, 300.0],
    ]);
    assert_eq!(follow(&slow, &gun, 60e3).waited, 0.0);
}

/// A jump that the job gives time is ordered to its end at once, however it is cut, and waited out there: no beam is late at the next line.
/// Dark ways as slow as the line lead into it.
#[test]
fn jumps_are_ordered_at_once() {
    let machine = gun("[deflection]\nlag = { value = \"10 µs\", source = \"log\" }");
    let rows = |between: &[[f64; 4]]| {
        let mut rows = vec![[0.0, 0.0, 0.0, 0.0], [2e-3, 2.0, 0.0, 300.0]];
        rows.extend(between);
        rows.push([4.1e-3, 2.0, 0.1, 300.0]);
        motion(&rows)
    };
    let whole = follow(&rows(&[[2.1e-3, 0.0, 0.1, 0.0]]), &machine, 60e3);
    assert!((whole.behind - 0.01).abs() < 1e-3, "{}", whole.behind);
    let cut = rows(&[[2.04e-3, 1.2, 0.04, 0.0], [2.1e-3, 0.0, 0.1, 0.0]]);
    assert!((follow(&cut, &machine, 60e3).behind - whole.behind).abs() < 1e-9);
    // what leads into the line is drawn as it is asked for: the beam is as far behind as on the line
    let led = rows(&[[2e-3, -0.1, 0.1, 0.0], [2.1e-3, 0.0, 0.1, 0.0]]);
    let led = follow(&led, &machine, 60e3);
    let motion = led.motion;
    let begins = (0..motion.len()).find(|&n| motion.time(n) >= 2.1e-3 - 1e-12);
    let at = motion.position[begins.unwrap()];
    assert!((at.x + 0.01).abs() < 1e-3, "{at}");
}

/// What a climb leaves out is the triangle under it; a beam that is blanked is ready, one that stays on heats the jump.
#[test]
fn the_current_climbs() {
    let line = motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [2e-3, 2.0, 0.0, 300.0],
        [3e-3, 0.0, 0.1, 0.0],
        [5e-3, 2.0, 0.1, 300.0],
    ]);
    let energy = |between: &str| {
        let gun = gun(&format!(
            "[current]\nslew = {{ value = \"10 mA/ms\", source = \"log\" }}\nbetween = \"{between}\""
        ));
        let drawn = follow(&line, &gun, 60e3);
        assert_eq!(drawn.unreached.0, 0);
        let motion = drawn.motion;
        (1..motion.len())
            .map(|n| motion.power[n] * (motion.time(n) - motion.time(n - 1)))
            .sum::<f64>()
    };
    assert!((energy("blanked") - 1.2).abs() < 1e-9);
    assert!((energy("on") - 1.5).abs() < 1e-9);
    // 5 mA in half a millisecond, up and down once more: what the second climb lacks the fall has brought
    let triangle = 0.5 * 300.0 * 5e-4;
    assert!(
        (energy("ramped") - (1.2 - triangle)).abs() < 1e-6,
        "{}",
        energy("ramped")
    );
    let short =
        gun("[current]\nslew = { value = \"1 mA/ms\", source = \"log\" }\nbetween = \"ramped\"");
    let drawn = follow(&line, &short, 60e3);
    assert_eq!(drawn.unreached, (2, Some([2.0, 0.0])));
}

/// Heat that a climb lacks at the beginning of a line, and what a fall brings to the jump after it, are told as such.
#[test]
fn heat_where_none_is_asked_for_is_told() {
    let lines = motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [2e-3, 2.0, 0.0, 300.0],
        [3e-3, 0.0, 0.1, 0.0],
        [5e-3, 2.0, 0.1, 300.0],
    ]);
    let of = |between: &str| {
        let gun = gun(&format!(
            "[current]\nslew = {{ value = \"10 mA/ms\", source = \"log\" }}\nbetween = \"{between}\""
        ));
        follow(&lines, &gun, 60e3)
    };
    let (asked, triangle) = (1.2, 0.5 * 300.0 * 5e-4);
    let ramped = of("ramped");
    assert!(
        (ramped.share(&ramped.stray) - triangle / asked).abs() < 1e-9,
        "{ramped:?}"
    );
    // the beam is ordered to the next line at once, and falls there
    assert_eq!(ramped.stray.first, Some([0.0, 0.1]));
    assert!((ramped.stray.time - 4.75e-4).abs() < 4e-5 && ramped.stray.stretches == 1);
    // but for the last twentieth of each climb
    assert!(
        (ramped.share(&ramped.off) - 2.0 * triangle / asked).abs() < 1e-3,
        "{ramped:?}"
    );
    assert_eq!(
        (ramped.off.stretches, ramped.off.first),
        (2, Some([0.0, 0.0]))
    );
    let on = of("on");
    assert!((on.share(&on.stray) - 0.25).abs() < 1e-9 && on.off.stretches == 0);
    let blanked = of("blanked");
    assert_eq!((blanked.stray.stretches, blanked.off.stretches), (0, 0));
}

/// A supply that is too slow to come down draws too much, which is no better than too little.
#[test]
fn a_current_that_stays_too_high_is_told_too() {
    let gun = |slew: &str| {
        gun(&format!(
            "[current]\nslew = {{ value = \"{slew}\", source = \"log\" }}\nbetween = \"blanked\""
        ))
    };
    // 5 and 1 mA in one go, 2 ms each
    let line = motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [2e-3, 2.0, 0.0, 300.0],
        [4e-3, 4.0, 0.0, 60.0],
    ]);
    let unreached = |slew: &str| follow(&line, &gun(slew), 60e3).unreached;
    assert_eq!(unreached("10 mA/ms").0, 0);
    assert_eq!(unreached("1 mA/ms"), (1, Some([4.0, 0.0])));
}

/// The spot is as wide as the gun's file says for the power.
#[test]
fn spots_widen_with_the_power() {
    let gun = gun(
        "[[spot]]\npower = { value = \"200 W\", source = \"log\" }\nwidth = { value = \"100 %\", source = \"log\" }\n\
         [[spot]]\npower = { value = \"400 W\", source = \"log\" }\nwidth = { value = \"120 %\", source = \"log\" }",
    );
    let drawn = follow(&hatch(), &gun, 60e3).motion;
    assert!((drawn.spot[1] - 0.44).abs() < 1e-12 && (drawn.spot[4] - 0.4).abs() < 1e-12);
    for (power, factor) in [(0.0, 1.0), (300.0, 1.1), (400.0, 1.2), (1000.0, 1.2)] {
        assert!((gun.widening(power) - factor).abs() < 1e-12, "{power}");
    }
}

/// A deflection that nobody knows follows at once, also at the moments in between that the current asks for.
#[test]
fn a_beam_without_lag_is_on_its_line_at_every_moment() {
    let slow = gun(
        "[current]\nslew = { value = \"5 mA/ms\", source = \"log\" }\nbandwidth = { value = \"1 kHz\", source = \"log\" }\nbetween = \"ramped\"\n",
    );
    let drawn = follow(
        &motion(&[[0.0, 2.0, 1.0, 0.0], [2e-3, 6.0, 4.0, 600.0]]),
        &slow,
        60e3,
    )
    .motion;
    assert!(drawn.position.len() > 4, "steps in between");
    for (n, at) in drawn.position.iter().enumerate() {
        let share = drawn.times.at(n) / 2e-3;
        let should = DVec2::new(2.0, 1.0) + share * DVec2::new(4.0, 3.0);
        assert!(at.truncate().distance(should) < 1e-9, "{at} at {share}");
    }
}

/// Each jump that is shorter than the deflection needs is waited for, and what follows comes as much later.
#[test]
fn what_follows_a_jump_comes_later_by_what_it_waits() {
    let asked = motion(&[
        [0.0, 0.0, 0.0, 0.0],
        [1e-3, 1.0, 0.0, 300.0],
        [1e-3, 0.0, 1.0, 0.0],
        [2e-3, 1.0, 1.0, 300.0],
        [2e-3, 0.0, 2.0, 0.0],
        [3e-3, 1.0, 2.0, 300.0],
    ]);
    let machine = gun("[deflection]\njump = { value = \"200 µs\", source = \"log\" }\n");
    let drawn = follow(&asked, &machine, 60e3);
    assert!((drawn.waited - 4e-4).abs() < 1e-12);
    let times: Vec<f64> = (0..drawn.motion.position.len())
        .map(|n| drawn.motion.times.at(n))
        .collect();
    assert!(times.is_sorted(), "{times:?}");
    assert!((times.last().unwrap() - 3.4e-3).abs() < 1e-12);
    // the second line begins after its wait
    let begin = drawn
        .motion
        .position
        .iter()
        .rposition(|p| p.y == 1.0 && p.x == 0.0)
        .unwrap();
    assert!((times[begin] - 1.2e-3).abs() < 1e-12, "{times:?}");
}

/// `count` lines of 2.9 mm, 0.1 mm apart, one way and back at `speed` mm/s, the last at 500; joined with `between` W.
fn zigzag(count: u32, speed: f64, between: f64) -> MotionBlock {
    let ends = [0.05, 2.95];
    let (mut time, mut points) = (0.0, vec![[0.0, ends[0], 0.0, 0.0]]);
    for n in 0..count {
        let y = 0.1 * f64::from(n);
        let side = (n + 1) as usize % 2;
        time += 2.9 / if n + 1 == count { 500.0 } else { speed };
        points.push([time, ends[side], y, 300.0]);
        if n + 1 < count {
            time += 0.1 / speed;
            points.push([time, ends[side], y + 0.1, between]);
        }
    }
    motion(&points)
}

fn lagging() -> Machine {
    gun("[deflection]\nlag = { value = \"20 µs\", source = \"log\" }")
}

/// At 30 m/s the beam is 0.6 mm behind: it turns 0.27 mm before each corner, more than half its spot of 0.4 mm. The corner before the
/// slow line is drawn by that one's beginning.
#[test]
fn corners_that_the_beam_does_not_come_to_are_lines_cut_short() {
    let drawn = follow(&zigzag(20, 30e3, 300.0), &lagging(), 60e3);
    assert_eq!(drawn.short.lines, 18, "{:?}", drawn.short);
    let turned = drawn.motion.position.iter().map(|p| p.x);
    let turned = turned.fold(0.0, f64::max);
    // the last line goes to its end
    let fast = drawn.motion.position.iter().filter(|p| p.y < 1.7);
    let turned = turned.min(fast.map(|p| p.x).fold(0.0, f64::max));
    assert!((turned - 2.682).abs() < 2e-3, "{turned}");
    assert!(
        (drawn.short.farthest - 0.27).abs() < 0.01,
        "{:?}",
        drawn.short
    );
    assert_eq!(
        (drawn.short.first, drawn.short.spot),
        (Some([2.95, 0.0]), 0.4)
    );
    // 8 m/s: 0.16 mm behind
    let slow = follow(&zigzag(20, 8e3, 300.0), &lagging(), 60e3);
    assert_eq!(slow.short.lines, 0, "{:?}", slow.short);
    // with the beam off at the ends it is all but the last
    let parted = follow(&zigzag(20, 30e3, 0.0), &lagging(), 60e3);
    assert_eq!(parted.short.lines, 19, "{:?}", parted.short);
}

/// A circle of chords is no row of corners: the beam comes to each of them, a little inside. A line that is cut where it goes straight
/// on has no corner at all, and one that goes back on itself has.
#[test]
fn only_corners_that_are_left_out_count() {
    let circle = |radius: f64, speed: f64| {
        let at = |n: u32| {
            let turn = std::f64::consts::TAU * f64::from(n) / 90.0;
            let time = radius * turn / speed;
            [time, radius * turn.cos(), radius * turn.sin(), 300.0]
        };
        let mut points: Vec<[f64; 4]> = (0..=90).map(at).collect();
        // goes on until the beam has come to the end
        points.push([points[90][0] + 1e-3, radius, 0.0, 300.0]);
        follow(&motion(&points), &lagging(), 60e3).short
    };
    assert_eq!(circle(5.0, 30e3).lines, 0);
    // one that is drawn 0.29 mm inside is one place, not ninety
    assert_eq!(circle(0.8, 60e3).lines, 1);
    let line = |ends: [f64; 3]| {
        let [a, b, c] = ends;
        let speed = 30e3;
        let first = (b - a).abs() / speed;
        let points = [
            [0.0, a, 0.0, 0.0],
            [first, b, 0.0, 300.0],
            [first + (c - b).abs() / speed, c, 0.0, 300.0],
            [1.0, c, 0.0, 300.0],
        ];
        follow(&motion(&points), &lagging(), 60e3).short.lines
    };
    assert_eq!([line([0.0, 3.0, 6.0]), line([0.0, 3.0, 0.0])], [0, 1]);
}
