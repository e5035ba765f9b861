//! The thin wall and the raster wall of Rouchon 2022, §4.3, driven by the robot's motion and fed by the source's answer to
//! the contact tube distance: jobs as in `examples/`, without their part files.
use std::path::Path;

use meltpath::job::{Job, parse};
use meltpath::waam::deposit::simulate::{Build, Simulation, simulate};
use meltpath::waam::settings::{Settings, resolve};
use meltpath_base::{Reporter, Silent};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;
use meltpath_robot::Pacing;
use meltpath_robot::command::{Command, Smoothing, Source};
use meltpath_toolpath::{Weave, WeaveShape};

const LENGTH: f64 = 150.0;
const LIFT: DVec3 = DVec3::new(0.0, 0.0, 20.0);

fn settings(example: &str) -> Settings {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../examples/{example}"));
    let text = std::fs::read_to_string(path.join("job.toml")).unwrap();
    let Ok(Job::Waam(job)) = parse(&text) else {
        panic!("{example} is a wire-arc job");
    };
    resolve(&job, &path, &Reporter::new()).unwrap()
}

/// Beads along x at each `y`, direction alternating per layer, `rise` mm a layer.
fn wall(s: &Settings, beads: &[f64], layers: u32, rise: f64) -> Simulation {
    woven_wall(s, beads, layers, rise, None)
}

/// The same, woven.
fn woven_wall(
    s: &Settings,
    beads: &[f64],
    layers: u32,
    rise: f64,
    weave: Option<Weave>,
) -> Simulation {
    let (mut commands, mut layer_of_command) = (Vec::new(), Vec::new());
    let feed = s.feed_factor() * s.bead.wire_feed;
    for layer in 1..=layers {
        for y in beads {
            let z = rise * f64::from(layer - 1);
            let (a, b) = (DVec3::new(0.0, *y, z), DVec3::new(LENGTH, *y, z));
            let (from, to) = if layer % 2 == 1 { (a, b) } else { (b, a) };
            for (target, speed, arc) in [
                (from + LIFT, 200.0, false),
                (from, 50.0, false),
                (to, s.bead.travel_speed, true),
                (to + LIFT, 50.0, false),
            ] {
                let id = commands.len() as u32;
                let mut line = Command::line(id, target, speed, Smoothing::Fine);
                if arc {
                    line.source = Source::On { wire_feed: feed };
                }
                commands.push(line);
                layer_of_command.push(layer);
            }
        }
    }
    let side = 25.0;
    let (low, high) = (beads[0] - side, beads[beads.len() - 1] + side);
    let map = HeightMap::new(
        DVec2::new(-side, low),
        DVec2::new(LENGTH + side, high),
        s.cell_size,
        0.0,
    );
    let woven: Vec<u32> = (0..commands.len()).map(|c| u32::from(c % 4 == 2)).collect();
    let build = Build {
        cell: None,
        joint_moves: &[],
        start: Pose::at(commands[0].target),
        commands: &commands,
        layer_of_command,
        bead_of_command: &[],
        weave_of_command: &woven,
        weaves: weave.as_slice(),
        layers: &[],
        controller: &s.controller,
        pacing: &Pacing::OWN,
        map: map.unwrap(),
        bead: s.bead_model,
        pool: s.pool,
        settings: s.deposit,
        columns: None,
    };
    simulate(build, &Reporter::new(), &Silent).unwrap()
}

/// Mean contact tube distance over the middle 60 % of bead number `bead` (in order of time).
fn distance(simulation: &Simulation, bead: usize) -> f64 {
    let command = (4 * bead + 2) as u32;
    let samples = &simulation.samples;
    let inside: Vec<f64> = simulation
        .ctwd
        .iter()
        .filter(|p| {
            let after = samples.partition_point(|s| s.time < p.at.time);
            let s = &samples[after.min(samples.len() - 1)];
            let x = s.position.x / LENGTH;
            s.command == command && x > 0.2 && x < 0.8
        })
        .map(|p| p.at.distance)
        .collect();
    assert!(inside.len() > 50, "{}", inside.len());
    inside.iter().sum::<f64>() / inside.len() as f64
}

#[test]
fn waam_wall_thin_brings_the_contact_tube_within_5_5_mm() {
    let s = settings("thin-wall");
    let simulation = wall(&s, &[0.0], 25, 1.2);
    // growth as the source counts it: what the distance lost, over the layers below
    let near = distance(&simulation, 21);
    let growth = (s.ctwd + 21.0 * 1.2 - near) / 21.0;
    assert!((growth - 1.65).abs() < 0.1, "{growth}");
    assert!((near - 5.5).abs() < 1.5, "{near}");
    // the thesis: 15 to 12 mm over the first five layers
    let fifth = distance(&simulation, 4);
    assert!((fifth - 12.0).abs() < 1.0, "{fifth}");
    // wire feed of table 4.4, m/min: 10.10 in the first layer, 8.13 in layer 22 at 5.47 mm; ours is still 6.8 mm away there
    let feed = |layer: usize| {
        let l = &simulation.layers[layer - 1];
        l.wire / l.arc_time * 0.06
    };
    assert!((feed(1) - 10.10).abs() < 0.01, "{}", feed(1));
    assert!((feed(22) - 8.13).abs() < 0.45, "{}", feed(22));
}

#[test]
fn waam_wall_raster_keeps_12_mm_and_its_edges_settle() {
    let s = settings("raster-wall");
    let beads: Vec<f64> = (0..6).map(|i| 4.62 * (f64::from(i) - 2.5)).collect();
    let simulation = wall(&s, &beads, 25, 1.85);
    let layer = |n: usize| -> Vec<f64> {
        (0..6)
            .map(|b| distance(&simulation, 6 * (n - 1) + b))
            .collect()
    };
    let last = layer(25);
    assert!(last.iter().all(|d| *d > 12.0), "{last:?}");
    let inner = |d: &[f64]| 0.5 * (d[2] + d[3]);
    let growth = (inner(&layer(5)) - inner(&last)) / 20.0 + 1.85;
    assert!((1.9..=2.1).contains(&growth), "{growth}");
    // the low edges get more wire: they go on sagging, ever less (the thesis sees no more of it after layer 5)
    let sag: Vec<f64> = [5, 10, 15, 20, 25]
        .map(layer)
        .iter()
        .map(|d| d[0] - inner(d))
        .collect();
    let more: Vec<f64> = sag.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(more.windows(2).all(|w| w[1] < w[0]), "{sag:?}");
    assert!(more[3] < 0.4 && sag[4] < 4.2, "{sag:?}");
}

#[test]
fn what_the_source_feeds_is_what_is_laid() {
    let s = settings("thin-wall");
    let simulation = wall(&s, &[0.0], 8, 1.2);
    let deposit = &simulation.deposit;
    let fed: f64 = simulation.layers.iter().map(|l| l.wire).sum();
    assert!((fed / deposit.wire - 1.0).abs() < 1e-9);
    let volume = fed * s.bead_model.wire_section * s.bead_model.efficiency;
    assert!((deposit.map.volume() / volume - 1.0).abs() < 1e-6);
    // less than what the program asks for: the tube has come nearer
    let asked = 8.0 * LENGTH / s.bead.travel_speed * s.feed_factor() * s.bead.wire_feed;
    assert!(fed < 0.99 * asked && fed > 0.9 * asked, "{fed} {asked}");
}

/// Width of a single bead above 0.2 mm and its greatest height, mean over the middle of its length.
fn section(simulation: &Simulation) -> (f64, f64) {
    let map = &simulation.deposit.map;
    let (mut width, mut height, mut count) = (0.0, 0.0, 0.0);
    for ix in 0..map.nx {
        if !(0.3..0.7).contains(&(map.centre(ix, 0).x / LENGTH)) {
            continue;
        }
        let column = (0..map.ny).map(|iy| map.z[map.index(ix, iy)]);
        width += map.cell * column.clone().filter(|z| *z > 0.2).count() as f64;
        height += column.fold(0.0, f64::max);
        count += 1.0;
    }
    (width / count, height / count)
}

/// Metal goes where the woven torch goes: as much of it, wider and lower, the wider the farther the torch swings.
#[test]
fn woven_beads_are_wider_and_lower_by_the_same_metal() {
    let s = settings("thin-wall");
    let straight = wall(&s, &[0.0], 1, 1.2);
    let plain = section(&straight);
    let sections = [1.5, 3.0, 4.5].map(|amplitude| {
        let weave = Weave {
            shape: WeaveShape::Sine,
            frequency: 2.0,
            amplitude,
            dwell: [0.0; 2],
        };
        let woven = woven_wall(&s, &[0.0], 1, 1.2, Some(weave));
        let laid = woven.deposit.volume / straight.deposit.volume;
        assert!((laid - 1.0).abs() < 1e-3, "{amplitude}: {laid}");
        assert_eq!(woven.deposit.beside, 0.0);
        section(&woven)
    });
    let told = format!("{plain:?}: {sections:?}");
    assert!(
        sections.is_sorted_by(|a, b| a.0 < b.0 && a.1 > b.1),
        "{told}"
    );
    let [.., far] = sections;
    assert!(far.0 > plain.0 + 1.0 && far.1 < plain.1, "{told}");
}
