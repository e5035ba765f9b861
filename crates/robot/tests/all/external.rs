//! Programs held with track and positioner free: every axis in step, within limits, the torch down where a table can turn it so.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::time::Instant;

use meltpath_base::Silent;
use meltpath_data::{find, robots};
use meltpath_geometry::Pose;
use meltpath_geometry::math::DVec3;
use meltpath_robot::cell::{self, Cell, Stance, Values};
use meltpath_robot::command::Kind;
use meltpath_robot::kinematics::numeric::distance;
use meltpath_robot::posture::{
    Axes, Because, Follower, Held, NotHeld, Rotation, Sample, Task, Why, hold, turned_back,
};
use meltpath_robot::{Command, Smoothing, Source};

static ANY: BTreeMap<Option<u32>, Stance> = BTreeMap::new();

/// A shipped arm with tables added to its file.
fn with(name: &str, tables: &str) -> Cell {
    let text = find(robots::ALL, name).unwrap().text;
    let text = text.split_once("\n[table]").map_or(text, |(arm, _)| arm);
    cell::read(&format!("{text}\n{tables}")).unwrap()
}

/// Beads through points with the torch's axis at each.
fn beads(points: &[(DVec3, DVec3)]) -> (Pose, Vec<Command>) {
    let pose = |(p, axis): (DVec3, DVec3)| Pose::of_tool(p, axis.normalize(), 0.0);
    let lines = points[1..].iter().zip(0..);
    let commands = lines.map(|(p, id)| Command {
        source: Source::On { wire_feed: 130.0 },
        orientation: pose(*p).orientation,
        ..Command::line(id, p.0, 12.5, Smoothing::Fine)
    });
    (pose(points[0]), commands.collect())
}

fn task<'a>(cell: &'a Cell, program: &'a (Pose, Vec<Command>), axes: Axes<'a>) -> Task<'a> {
    Task {
        cell,
        values: cell.at_rest(),
        axes,
        start: program.0,
        commands: &program.1,
        rotation: Rotation::Free,
        configurations: &ANY,
    }
}

fn free(cell: &Cell, program: &(Pose, Vec<Command>)) -> Result<Held, NotHeld> {
    hold(&task(cell, program, Axes::Free), &Silent)
}

/// Follows a held program: the tip where it was asked and as it was asked but for its turn, no jump of any axis, all within limits.
fn followed(cell: &Cell, program: &(Pose, Vec<Command>), held: &Held) -> Vec<Sample> {
    let task = task(cell, program, Axes::Free);
    let mut samples = Vec::new();
    for chain in &held.chains {
        let mut follower = Follower::new(&task, chain);
        while let Some(sample) = follower.next_sample().unwrap() {
            samples.push(sample);
        }
    }
    for pair in samples.windows(2) {
        let steps = (0..6).map(|i| (pair[1].joints[i] - pair[0].joints[i]).abs());
        assert!(steps.fold(0.0, f64::max) <= 0.1);
    }
    for s in &samples {
        let tip = cell
            .frames(&Values::of(s.joints, s.external))
            .part_from_wire_tip();
        let [off, turned] = distance(tip, s.tip);
        assert!(off < 1e-7 && turned < 1e-7, "{off:e} {turned:e}");
        assert!(cell.arm.margin(s.joints).0 >= 0.0 && cell.beyond(s.external).is_none());
    }
    for c in &program.1 {
        let end = samples
            .iter()
            .find(|s| s.tip.position.distance(c.target) < 1e-9);
        let axis = |o: meltpath_geometry::math::DQuat| o * DVec3::Z;
        assert!(axis(end.unwrap().tip.orientation).distance(axis(c.orientation)) < 1e-9);
    }
    samples
}

fn told(what: &str, cell: &Cell, held: &Held, since: Instant) {
    let m = &held.margins;
    let lean = m.lean.unwrap();
    println!(
        "{what} on {}: {:.2} s, lean {:.2} deg at most, {:.2} in the mean, fastest axis {} at {:.1} %, limit {:.1} deg, wrist {:.1} deg",
        cell.name,
        since.elapsed().as_secs_f64(),
        lean.greatest.value.to_degrees(),
        lean.mean().to_degrees(),
        m.speed.unwrap().joint + 1,
        100.0 * m.speed.unwrap().value,
        m.limit.unwrap().value.to_degrees(),
        m.wrist.unwrap().value.to_degrees(),
    );
}

/// Passes round a tube that bends by `bend` over a radius of 150 mm, the torch along the tube.
fn tube(radius: f64, bend: f64, passes: u32, chords: u32) -> Vec<(DVec3, DVec3)> {
    let pass = |k: u32| {
        let phi = bend * f64::from(k) / f64::from(passes - 1);
        let (s, c) = phi.sin_cos();
        let centre = DVec3::new(150.0 * (1.0 - c), 0.0, 150.0 * s);
        let (along, out) = (DVec3::new(s, 0.0, c), DVec3::new(c, 0.0, -s));
        (0..=chords).map(move |i| {
            let (s, c) = (TAU * f64::from(i) / f64::from(chords)).sin_cos();
            (centre + radius * (c * out + s * DVec3::Y), along)
        })
    };
    (0..passes).flat_map(pass).collect()
}

#[test]
fn multiaxis_ma7_a_bent_tube_is_built_torch_down_on_two_axes() {
    let cell = with("fanuc-arcmate-120ic", "");
    let program = beads(&tube(40.0, FRAC_PI_2, 30, 48));
    let since = Instant::now();
    let held = free(&cell, &program).unwrap();
    told("a bent tube", &cell, &held, since);
    followed(&cell, &program, &held);
    let lean = held.margins.lean.unwrap();
    assert!(lean.greatest.value < 2.0_f64.to_radians(), "{lean:?}");
    assert!(held.margins.speed.unwrap().value < 1.0);
    // on a table that stands the torch leans as the tube does
    let standing = hold(&task(&cell, &program, Axes::Standing), &Silent);
    if let Ok(standing) = standing {
        assert!(standing.margins.lean.unwrap().greatest.value > 1.5);
    }
    assert_eq!(free(&cell, &program).unwrap(), held);
}

const ROLLER: &str = r#"
[positioner]
source = "test"
axes = [{ position = ["1200 mm", "0 mm", "700 mm"], axis = [1, 0, 0] }]
low = ["-1000 deg"]
high = ["1000 deg"]
speed = ["120 deg/s"]
"#;

/// Beads round a bar that lies level: the table rolls it under a torch that stays down.
/// Rings on a cone that opens by `angle`, one over the other, all laid the same way round; the moves over between them.
fn cone(angle: f64, rings: u32) -> ((Pose, Vec<Command>), BTreeSet<u32>) {
    let at = |k: u32, i: u32| {
        // each begins a third of a turn farther
        let (s, c) = (TAU * (f64::from(i) / 48.0 + f64::from(k) / 3.0)).sin_cos();
        let up = 2.0 * f64::from(k);
        let out = DVec3::new(c, s, 0.0);
        let axis = angle.cos() * DVec3::Z - angle.sin() * out;
        ((30.0 + up * angle.tan()) * out + up * DVec3::Z, axis)
    };
    let mut points = vec![(at(0, 0), Source::Off)];
    let mut over = BTreeSet::new();
    for k in 0..rings {
        if k > 0 {
            let above = |(p, axis): (DVec3, DVec3)| ((p + 40.0 * DVec3::Z, axis), Source::Off);
            points.push(above(at(k - 1, 48)));
            over.insert(points.len() as u32 - 1);
            points.push(above(at(k, 0)));
            points.push((at(k, 0), Source::Off));
        }
        points.extend((1..=48).map(|i| (at(k, i), Source::On { wire_feed: 130.0 })));
    }
    let places: Vec<(DVec3, DVec3)> = points.iter().map(|p| p.0).collect();
    let (start, mut commands) = beads(&places);
    for (command, (_, source)) in commands.iter_mut().zip(&points[1..]) {
        command.source = *source;
    }
    ((start, commands), over)
}

/// A table that turns by two turns and a bit holds the torch down along each ring where it may turn back in the air between: without, it leans
/// as far as the cone where it has turns no more.
#[test]
fn a_table_turns_back_in_the_air() {
    let mut cell = with("fanuc-arcmate-120ic", "");
    let limits = &mut cell.positioner.as_mut().unwrap().joints[1].limits;
    (limits.low, limits.high) = (-1.2 * TAU, 1.2 * TAU);
    let angle = 30.0_f64.to_radians();
    let (program, over) = cone(angle, 4);
    let straight = free(&cell, &program).unwrap();
    let leans = |held: &Held| held.margins.lean.unwrap().greatest.value.to_degrees();
    assert!(leans(&straight) > 20.0, "{}", leans(&straight));
    let task = self::task(&cell, &program, Axes::Free);
    let changes = turned_back(&task, &over, &Silent).unwrap();
    assert!(!changes.is_empty() && changes.len() <= 3, "{changes:?}");
    let known = |c: &meltpath_robot::posture::Change| {
        over.contains(&c.command) && c.why == Because::TurnedBack
    };
    assert!(changes.iter().all(known), "{changes:?}");
    let mut back = program.clone();
    for change in &changes {
        back.1[change.command as usize].kind = Kind::Joint(None);
    }
    let held = free(&cell, &back).unwrap();
    assert!(leans(&held) < 8.0, "{}", leans(&held));
    // a table that turns on and on needs none
    let limits = &mut cell.positioner.as_mut().unwrap().joints[1].limits;
    (limits.low, limits.high) = (-20.0 * TAU, 20.0 * TAU);
    let task = self::task(&cell, &program, Axes::Free);
    assert_eq!(turned_back(&task, &over, &Silent).unwrap(), []);
    assert!(leans(&free(&cell, &program).unwrap()) < 8.0);
}

#[test]
fn a_bar_is_clad_on_one_axis() {
    let cell = with("abb-irb2600-12-185", ROLLER);
    let round = |k: u32| {
        (0..=60).map(move |i| {
            let (s, c) = (TAU * f64::from(i) / 60.0).sin_cos();
            let out = DVec3::new(0.0, s, c);
            (60.0 * out + 5.0 * f64::from(k) * DVec3::X, out)
        })
    };
    let program = beads(&(0..2).flat_map(round).collect::<Vec<_>>());
    let since = Instant::now();
    let held = free(&cell, &program).unwrap();
    told("a clad bar", &cell, &held, since);
    let samples = followed(&cell, &program, &held);
    assert!(held.margins.lean.unwrap().greatest.value < 3.0_f64.to_radians());
    let turned = samples.iter().map(|s| s.external.0[1]);
    let most = turned.clone().fold(f64::NEG_INFINITY, f64::max);
    let least = turned.fold(f64::INFINITY, f64::min);
    assert!(most - least > TAU, "{least} {most}");
}

/// A wall of a cylinder on a turntable, farther out than the arm reaches on its far side.
#[test]
fn a_wide_cylinder_is_laid_on_a_turntable() {
    let table = ROLLER
        .replace("[1, 0, 0]", "[0, 0, 1]")
        .replace("1200 mm", "1500 mm");
    let cell = with("abb-irb2600-12-185", &table);
    let at = |i: u32| {
        let (s, c) = (TAU * f64::from(i) / 90.0).sin_cos();
        (DVec3::new(600.0 * c, 600.0 * s, 0.0), DVec3::Z)
    };
    let program = beads(&(0..=180).map(at).collect::<Vec<_>>());
    let standing = hold(&task(&cell, &program, Axes::Standing), &Silent).unwrap_err();
    assert!(matches!(standing.why, Why::Unreachable(_)), "{standing:?}");
    let since = Instant::now();
    let held = free(&cell, &program).unwrap();
    told("a wide cylinder", &cell, &held, since);
    followed(&cell, &program, &held);
    // with limits that do not let it turn once the far side is told
    let narrow = table.replace("1000 deg", "20 deg");
    let cell = with("abb-irb2600-12-185", &narrow);
    let not = free(&cell, &program).unwrap_err();
    assert!(
        matches!(not.why, Why::Unreachable(_) | Why::Change),
        "{not:?}"
    );
    assert!(not.position.length() > 599.0, "{not:?}");
}

/// A wall of nearly five metres in pieces, from a track beside it.
#[test]
fn a_long_wall_is_laid_from_a_track() {
    let track = |half: &str| {
        format!(
            "[track]\nsource = \"test\"\naxis = [0, 1, 0]\nlow = \"-{half}\"\nhigh = \"{half}\"\nspeed = \"1 m/s\"\n[table]\nposition = [\"1100 mm\", \"0 mm\", \"300 mm\"]\n"
        )
    };
    let cell = with("abb-irb2600-12-185", &track("1500 mm"));
    let along = |z: f64, y: f64| (DVec3::new(0.0, 2.4 * y, z), DVec3::Z);
    let there = (0..=20).map(|i| along(0.0, -1000.0 + 100.0 * f64::from(i)));
    let back = (0..=20).map(|i| along(2.0, 1000.0 - 100.0 * f64::from(i)));
    let program = beads(&there.chain(back).collect::<Vec<_>>());
    let standing = hold(&task(&cell, &program, Axes::Standing), &Silent)
        .err()
        .unwrap();
    assert!(matches!(standing.why, Why::Unreachable(_)), "{standing:?}");
    let since = Instant::now();
    let held = free(&cell, &program).unwrap();
    told("a long wall", &cell, &held, since);
    let samples = followed(&cell, &program, &held);
    let far = samples
        .iter()
        .map(|s| s.external.0[0].abs())
        .fold(0.0, f64::max);
    assert!(far > 200.0 && far <= 1500.0, "{far}");
    // one move of the whole length goes in step, too
    let program = beads(&[along(0.0, -1000.0), along(0.0, 1000.0)]);
    followed(&cell, &program, &free(&cell, &program).unwrap());
    let short = with("abb-irb2600-12-185", &track("50 mm"));
    assert!(matches!(
        free(&short, &program).unwrap_err().why,
        Why::Unreachable(_)
    ));
}

/// A hundred thousand points round a bend: table and arm keep within their speeds; how long it takes is printed.
#[test]
#[ignore = "takes half a minute"]
fn a_hundred_thousand_points() {
    let cell = with("fanuc-arcmate-120ic", "");
    let round = tube(80.0, 0.5 * PI, 200, 500);
    let program = beads(&round);
    // the arm alone does not reach round the bend
    let standing = hold(&task(&cell, &program, Axes::Standing), &Silent);
    assert!(standing.is_err(), "{:?}", standing.map(|h| h.margins));
    let since = Instant::now();
    let held = hold(&task(&cell, &program, Axes::Free), &Silent).unwrap();
    told("free", &cell, &held, since);
    let fastest = held.margins.speed.unwrap().value;
    assert!(fastest <= 1.0, "{fastest}");
}

/// Most memory that this process held, MiB, where the system tells it.
fn most_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// A wall laid to and fro, the arm alone with the torch's rotation free; time and memory are printed. Run by itself.
fn points_of_a_wall(layers: u32, chords: u32) {
    let cell = with("fanuc-arcmate-120ic", "");
    let layer = |k: u32| {
        (0..=chords).map(move |i| {
            let share = f64::from(i) / f64::from(chords);
            let x = if k.is_multiple_of(2) {
                share
            } else {
                1.0 - share
            };
            let wave = 20.0 * (8.0 * x).sin();
            let place = DVec3::new(300.0 * (x - 0.5), wave, 0.2 * f64::from(k));
            (place, DVec3::Z)
        })
    };
    let points: Vec<_> = (0..layers).flat_map(layer).collect();
    let program = beads(&points);
    let before = most_memory();
    let since = Instant::now();
    let held = hold(&task(&cell, &program, Axes::Standing), &Silent).unwrap();
    let taken = since.elapsed().as_secs_f64();
    let least = held.margins.limit.unwrap().value;
    assert!(least > 0.0, "{least}");
    println!(
        "{} points: {taken:.1} s, {before:?} to {:?} MiB",
        points.len(),
        most_memory()
    );
}

#[test]
#[ignore = "takes some seconds"]
fn a_hundred_thousand_points_of_a_wall() {
    points_of_a_wall(100, 999);
}

#[test]
#[ignore = "takes a minute"]
fn a_million_points_of_a_wall() {
    points_of_a_wall(1000, 999);
}
