//! A report with invented but plausible numbers: a thin wall and a ring on a plate, 25 layers. Shared by the
//! example, the tests and the bench, so that what is looked at is what is tested.

#![allow(
    dead_code,
    reason = "tests, example and bench each take what they need"
)]
#![allow(
    clippy::unwrap_used,
    reason = "the scene is built here and makes sense"
)]

use std::collections::BTreeMap;

use meltpath_base::{
    Check, Fact, Limit, Measure, Origin, Place, Provenance, Resolved, Verdict, Warning,
};
use meltpath_geometry::Pose;
use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::shapes::cuboid;
use meltpath_report::html::{Report, Section};
use meltpath_report::plot::{Aspect, Mark, Plot, histogram};
use meltpath_report::scene::machine::{Axis as MachineAxis, Body, Joint, JointMotion, Machine};
use meltpath_report::scene::{
    Grid, HeightLayers, LineSet, Polyline, Scalar, Scene, Stroke, Surface, Visibility,
};
use meltpath_report::sheet::{OperatorSheet, Setting};
use meltpath_report::table::{Cell, Table};

pub(crate) const LAYERS: u32 = 25;
const GROWTH: f64 = 1.65;

/// The paths of a layer: a wall of 150 mm and a ring of Ø 60 mm, points `step` mm apart.
fn paths(layer: u32, step: f64) -> [Vec<DVec3>; 2] {
    let z = f64::from(layer - 1) * GROWTH;
    let along = |n: usize| (0..=n).map(move |i| i as f64 / n as f64);
    let wall: Vec<DVec3> = along((150.0 / step) as usize)
        .map(|t| {
            DVec3::new(
                30.0 + 150.0 * if layer % 2 == 1 { t } else { 1.0 - t },
                50.0,
                z,
            )
        })
        .collect();
    let ring = along((188.5 / step) as usize)
        .map(|t| {
            let a = std::f64::consts::TAU * t + 0.4 * f64::from(layer);
            DVec3::new(240.0 + 30.0 * a.cos(), 50.0 + 30.0 * a.sin(), z)
        })
        .collect();
    [wall, ring]
}

/// Programmed beads and the travels between them, `step` mm between points.
pub(crate) fn lines(step: f64) -> [LineSet; 2] {
    let mut points = Vec::new();
    let mut polylines = Vec::new();
    let mut speed = Vec::new();
    let mut time = Vec::new();
    let mut travel = Vec::new();
    let mut travels = Vec::new();
    let mut clock = 0.0;
    for layer in 1..=LAYERS {
        for path in paths(layer, step) {
            if let (Some(&from), Some(&to)) = (points.last(), path.first()) {
                let lift = DVec3::Z * 20.0;
                travels.push(Polyline {
                    first: travel.len(),
                    layer,
                });
                travel.extend([from, from + lift, to + lift, to]);
            }
            polylines.push(Polyline {
                first: points.len(),
                layer,
            });
            let n = path.len() as f64;
            for (i, p) in path.into_iter().enumerate() {
                let from_end = (i as f64).min(n - 1.0 - i as f64) * step;
                let v = 12.5 * (1.0 - 0.75 * (-from_end / 1.5).exp());
                clock += step / v;
                points.push(p);
                speed.push(v as f32);
                time.push(clock as f32);
            }
        }
    }
    let beads = LineSet {
        name: "simulated path".to_owned(),
        points,
        polylines,
        scalars: vec![
            Scalar::new("travel speed", "mm/s", speed),
            Scalar::new("time", "s", time),
        ],
        stroke: Stroke::Bead(1.2),
        visibility: Visibility::Shown,
    };
    let moves = LineSet {
        name: "travels".to_owned(),
        points: travel,
        polylines: travels,
        scalars: vec![],
        stroke: Stroke::Hairline,
        visibility: Visibility::Hidden,
    };
    [beads, moves]
}

/// Height and height error of every cell after a layer.
pub(crate) fn surface(grid: &Grid, layer: u32) -> [Vec<f64>; 2] {
    let n = f64::from(layer);
    let cells = (0..grid.nx * grid.ny).map(|i| {
        let p = grid.origin + grid.cell * DVec2::new((i % grid.nx) as f64, (i / grid.nx) as f64);
        let x = p.x.clamp(30.0, 180.0);
        let to_wall = p.distance(DVec2::new(x, 50.0));
        let to_ring = (p.distance(DVec2::new(240.0, 50.0)) - 30.0).abs();
        let off = to_wall.min(to_ring);
        let half = 3.4 + 0.25 * (1.0 - (-n / 4.0).exp());
        if off > half {
            return (0.0, f64::NAN);
        }
        let end = if to_wall < to_ring {
            (x - 30.0).min(180.0 - x)
        } else {
            99.0
        };
        let sag = 0.9 * (1.0 - (-n / 3.0).exp()) * (-end / 6.0).exp();
        let ripple = 0.15 * (0.35 * p.x + 0.9 * n).sin();
        let crown = 1.9 * (1.0 - (off / half).powi(2)).sqrt().min(1.0);
        let z = (n - 1.0) * GROWTH - sag + ripple + crown;
        (z, z - n * GROWTH)
    });
    let (heights, errors) = cells.unzip();
    [heights, errors]
}

pub(crate) fn grid(cell: f64) -> Grid {
    Grid {
        origin: DVec2::splat(0.5 * cell),
        cell,
        nx: (300.0 / cell) as usize,
        ny: (100.0 / cell) as usize,
    }
}

fn heights() -> HeightLayers {
    let grid = grid(1.0);
    let error = Scalar::new("height error", "mm", vec![]).diverging(1.5);
    let mut layers = HeightLayers::new("predicted surface", grid, LAYERS as usize)
        .unwrap()
        .with_scalar(error);
    layers.opacity = 0.5;
    for layer in 1..=LAYERS {
        let [z, error] = surface(&grid, layer);
        layers.push(layer, &z, &[&error]).unwrap();
    }
    layers
}

/// The finished part: a box for the wall.
fn part() -> Surface {
    Surface {
        name: "finished part".to_owned(),
        mesh: cuboid(DVec3::new(30.0, 48.0, 0.0), DVec3::new(180.0, 52.0, 40.0)),
        scalars: vec![],
        opacity: 0.35,
        visibility: Visibility::Hidden,
    }
}

fn verdict() -> Verdict {
    let judge =
        |id: &str, title: &str, value: Measure, limit| Check::judge(id, title, value, limit);
    let mm = |v, s| Measure::new(v, s, "mm");
    Verdict {
        checks: vec![
            judge("lack", "Metal lacking in the finished part", Measure::new(0.31, 0.9, "%"), Limit::AtMost(0.5))
                .remedy("measure the height of the first five layers: it halves the uncertainty of the growth model"),
            judge("excess", "Metal beyond part and allowance", Measure::new(1.8, 0.4, "%"), Limit::AtMost(5.0)),
            judge("stock", "Least machining stock", mm(0.62, 0.18), Limit::AtLeast(0.5))
                .at(Place::at([30.4, 48.0, 36.2]))
                .remedy("lengthen the passes by 3 mm at both ends"),
            judge("height-error", "Height error of the last layer", mm(0.42, 0.15), Limit::AtMost(1.0)),
            judge("ctwd-min", "Contact-tube distance", mm(5.61, 1.5), Limit::AtLeast(8.0))
                .at(Place { position: Some([104.0, 50.0, 36.3]), ..Place::layer(22) })
                .remedy("raise the layer height to 1.65 mm, or scan and correct every five layers"),
            judge("arc-starts", "Arc starts on one place", Measure::exact(2.0, ""), Limit::AtMost(3.0)),
            Check::not_checked("reach", "Reach of the robot", "no kinematic model of the cell in this version"),
            Check::not_checked("collision", "Collision of torch and part", "no torch model in this version"),
        ],
        facts: vec![
            Fact::new("wire", "Wire", Measure::new(0.98, 0.06, "kg"), "159 m of X90-IG"),
            Fact::new("time-arc", "Arc on", Measure::exact(11.2, "min"), ""),
            Fact::new("time-total", "Whole build", Measure::exact(37.667, "min"), ""),
            Fact::new("energy", "Energy", Measure::exact(1.9, "MJ"), ""),
            Fact::new("volume", "Deposited", Measure::exact(124.9, "cm³"), ""),
            Fact::new("beads", "Beads", Measure::exact(50.0, ""), ""),
            Fact::new("height", "Height", mm(41.3, 0.6), ""),
        ],
        warnings: vec![
            Warning {
                code: "mesh-repaired".to_owned(),
                message: "2 duplicate triangles of flange.stl were removed".to_owned(),
                place: Some(Place::at([12.0, 3.5, 0.0])),
                remedy: None,
            },
            Warning {
                code: "overhang".to_owned(),
                message: "layer 7 hangs over layer 6 by 2.1 mm on 3 % of its outline".to_owned(),
                place: Some(Place::layer(7)),
                remedy: Some("turn the part, or ask for tilted passes".to_owned()),
            },
        ],
    }
}

fn sections() -> Vec<Section> {
    let [height, distance] = growth();
    vec![
        Section::new(
            "Growth",
            "What the metal does layer by layer, from the simulated motion.",
            vec![height, distance, wall_section()],
            vec![layer_table()],
        ),
        Section::new("Motion", "", speeds(), vec![]),
    ]
}

fn growth() -> [Plot; 2] {
    let layers = || (1..=LAYERS).map(f64::from);
    let line = |name: &str, f: &dyn Fn(f64) -> f64| Mark::Line {
        name: name.to_owned(),
        points: layers().map(|n| DVec2::new(n, f(n))).collect(),
    };
    let height = Plot::new("Height after each layer", ["layer", ""], ["height", "mm"])
        .band(
            "± one standard uncertainty",
            layers()
                .map(|n| DVec2::new(n, 1.65 * n - 0.3 - 0.06 * n))
                .collect(),
            layers()
                .map(|n| DVec2::new(n, 1.65 * n + 0.3 + 0.06 * n))
                .collect(),
        )
        .with(line("predicted", &|n| 1.65 * n))
        .with(line("planned", &|n| 1.2 * n))
        .caption("The wall grows faster than the torch climbs.");
    let ctwd = Plot::new("Contact-tube distance", ["layer", ""], ["distance", "mm"])
        .with(line("wall", &|n| 15.0 - 0.45 * (n - 1.0)))
        .with(line("ring", &|n| 15.0 - 0.31 * (n - 1.0)))
        .dots(
            "measured",
            vec![
                DVec2::new(1.0, 15.0),
                DVec2::new(5.0, 12.6),
                DVec2::new(22.0, 5.5),
            ],
        )
        .limit("limit", 8.0);
    [height, ctwd]
}

fn speeds() -> Vec<Plot> {
    let speed: Vec<DVec2> = (0..40_000)
        .map(|i| {
            let t = f64::from(i) * 0.008;
            let v = if t % 13.0 > 12.2 {
                f64::NAN
            } else {
                12.5 * (1.0 - (-(t % 13.0) * 3.0).exp())
            };
            DVec2::new(t, v)
        })
        .collect();
    let values: Vec<f64> = speed.iter().map(|p| p.y).filter(|v| *v > 11.0).collect();
    let speed = Plot::new(
        "Travel speed while the arc is on",
        ["time", "s"],
        ["speed", "mm/s"],
    )
    .line("simulated", speed)
    .limit("programmed", 12.5);
    let spread = Plot::new("Spread of the speed", ["speed", "mm/s"], ["samples", ""])
        .bars("samples", histogram(&values, 24));
    vec![speed, spread]
}

fn wall_section() -> Plot {
    let arc = |from: f64, to: f64, r: f64, z: f64| {
        (0..=40).map(move |i| {
            let a = from + (to - from) * f64::from(i) / 40.0;
            DVec2::new(r * a.cos(), z + r * a.sin())
        })
    };
    let outline: Vec<DVec2> = [DVec2::new(-3.6, 0.0), DVec2::new(3.6, 0.0)]
        .into_iter()
        .chain(arc(0.0, std::f64::consts::PI, 3.6, 38.0))
        .collect();
    let mut section = Plot::new(
        "Section of the wall at x = 105 mm",
        ["y", "mm"],
        ["z", "mm"],
    )
    .with(Mark::Area {
        name: "predicted metal".to_owned(),
        outline,
    })
    .line(
        "finished part",
        [[-2.0, 0.0], [-2.0, 40.0], [2.0, 40.0], [2.0, 0.0]]
            .map(DVec2::from)
            .to_vec(),
    );
    section.aspect = Aspect::Equal;
    section
}

fn layer_table() -> Table {
    let mut table = Table::new(
        "Layers",
        &[
            "layer",
            "height (mm)",
            "flatness (mm)",
            "arc on",
            "pause",
            "remark",
        ],
    );
    table.rows = (1..=LAYERS)
        .step_by(4)
        .map(|n| {
            let remark = if n == 21 {
                Cell::text("contact-tube distance below 8 mm from layer 17")
            } else {
                Cell::Empty
            };
            vec![
                Cell::Number(f64::from(n)),
                Cell::Fixed(1.65 * f64::from(n), 2),
                Cell::Fixed(0.31 + 0.01 * f64::from(n), 2),
                Cell::Duration(26.9),
                Cell::Duration(60.0),
                remark,
            ]
        })
        .collect();
    table
}

fn sheet() -> OperatorSheet {
    let mut order = Table::new(
        "Order",
        &["step", "what", "layers", "arc on", "pause after"],
    );
    order.rows = [
        ("wall, from −x to +x, then back", "1 to 25, odd"),
        ("ring, counter-clockwise", "1 to 25"),
    ]
    .iter()
    .enumerate()
    .map(|(i, (what, layers))| {
        vec![
            Cell::Number((i + 1) as f64),
            Cell::text(what),
            Cell::text(layers),
            Cell::Duration(13.4),
            Cell::Duration(60.0),
        ]
    })
    .collect();
    let words = |list: &[&str]| list.iter().map(|&s| s.to_owned()).collect();
    OperatorSheet {
        settings: vec![
            Setting::new("Wire", "X90-IG Ø 1.0 mm", ""),
            Setting::new("Gas", "M14, 15 L/min", "pre-flow 0.5 s"),
            Setting::new("Source mode", "CMT", "line 1 of the panel"),
            Setting::new("Wire feed", "8.0 m/min", "expect 17.2 V, 165 A"),
            Setting::new("Travel speed", "0.75 m/min", "in the program"),
            Setting::new(
                "Contact-tube distance",
                "15 mm",
                "on the plate, first layer",
            ),
            Setting::new("User frame", "3", "corner of the plate"),
            Setting::new("Tool frame", "1", "torch, checked this week"),
        ],
        before: words(&[
            "Plate 300 × 100 × 12 mm clamped at four points and cleaned",
            "Contact tube new, nozzle clean",
            "Program WALL_RING.LS on the controller; override 100 %",
        ]),
        order,
        during: words(&[
            "After layer 5: measure the height at the middle of the wall; expected 8.3 ± 0.6 mm",
            "Stop if the contact-tube distance falls below 8 mm (expected at layer 17)",
        ]),
    }
}

fn provenance() -> Provenance {
    let mut p = Provenance {
        inputs: BTreeMap::from([
            (
                "wall.toml".to_owned(),
                "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad".to_owned(),
            ),
            (
                "wall.step".to_owned(),
                "cb8379ac2098aa165029e3938a51da0bcecfc008fd6795f401178647f96c5b34".to_owned(),
            ),
        ]),
        meltpath: "0.1.0".to_owned(),
        ..Provenance::new()
    };
    p.parameter(
        "waam.bead.wire_feed",
        &Resolved::new("8 m/min", Origin::Job),
    );
    p.parameter(
        "layers.height",
        &Resolved::new(
            "1.2 mm",
            Origin::Computed("60 % of the bead height".to_owned()),
        ),
    );
    p.parameter(
        "machine.smoothing",
        &Resolved::new(
            0.5,
            Origin::Default("the value identified on the cell".to_owned()),
        )
        .with_sigma(0.02),
    );
    p.model("motion of the controller", "Rouchon 2022, section 3.3.1");
    p.model("cumulative deposition", "Rouchon 2022, section 3.5");
    p
}

/// A torch on a slide that swings over the build, in the time of the beads.
fn machine(beads: &LineSet) -> Machine {
    let body = |name: &str, carrier, at: DVec3, joint, mesh| Body {
        name: name.to_owned(),
        carrier,
        carrier_from_body: Pose {
            position: at,
            ..Pose::IDENTITY
        },
        joint,
        mesh,
    };
    let joint = |axis, motion, along| {
        Some(Joint {
            axis,
            motion,
            along,
        })
    };
    let wide = DVec3::new(20.0, 20.0, 200.0);
    let clock = &beads.scalars[1].values;
    let moments: Vec<usize> = (0..=250).map(|i| (clock.len() - 1) * i / 250).collect();
    let times: Vec<f64> = moments.iter().map(|&i| f64::from(clock[i])).collect();
    let layer = |i: &usize| {
        let after = beads.polylines.partition_point(|p| p.first <= *i);
        beads.polylines[after - 1].layer
    };
    let axis = |name: &str, value: &dyn Fn(f64) -> f64| MachineAxis {
        name: name.to_owned(),
        values: times.iter().map(|&t| value(t)).collect(),
    };
    Machine {
        name: "slide".to_owned(),
        bodies: vec![
            body(
                "table",
                None,
                DVec3::ZERO,
                joint(1, JointMotion::Turns, DVec3::Z),
                cuboid(
                    DVec3::new(-120.0, -90.0, -20.0),
                    DVec3::new(120.0, 90.0, -5.0),
                ),
            ),
            body(
                "torch",
                None,
                DVec3::new(0.0, 0.0, 60.0),
                joint(0, JointMotion::Slides, DVec3::X),
                cuboid(
                    -0.5 * wide + 100.0 * DVec3::Z,
                    0.5 * wide + 100.0 * DVec3::Z,
                ),
            ),
        ],
        holder: Some(0),
        holder_from_part: Pose::IDENTITY,
        axes: vec![
            axis("slide", &|t| 60.0 * (t / 400.0).sin()),
            axis("table", &|t| 0.5 * (t / 900.0).sin()),
        ],
        layers: moments.iter().map(layer).collect(),
        times,
    }
}

/// The scene, with `step` mm between the points of the paths.
pub(crate) fn scene(step: f64) -> Scene {
    let lines = lines(step);
    Scene {
        machine: Some(machine(&lines[0])),
        lines: lines.to_vec(),
        surfaces: vec![part()],
        heights: Some(heights()),
    }
}

/// The whole report.
pub(crate) fn report(step: f64) -> Report {
    Report {
        title: "Thin wall and ring".to_owned(),
        subtitle: "wall.step · wire-arc · X90-IG Ø 1.0 mm · M14 · CMT · 25 layers".to_owned(),
        verdict: verdict(),
        scene: Some(scene(step)),
        sections: sections(),
        sheet: Some(sheet()),
        provenance: provenance(),
    }
}
