//! What several files need: the material, charts that are computed once, the bed that beams draw on.
#![allow(dead_code, reason = "the tests of another room share this file")]

use std::sync::OnceLock;

use meltpath_base::Silent;
use meltpath_geometry::math::DVec3;
use meltpath_thermal::beam::{Beam, BeamPath, BeamPoint};
use meltpath_thermal::charts::build::{compute, warm, warm_grounds};
use meltpath_thermal::charts::{ChartSet, ChartSettings};
use meltpath_thermal::criteria::{Classes, Tally};
use meltpath_thermal::grid::Field;
use meltpath_thermal::levels::{BEND, Setup};
use meltpath_thermal::material::file::{Readings, read};
use meltpath_thermal::material::law::Law;
use meltpath_thermal::material::{CELSIUS, Material};
use meltpath_thermal::solver::source::Depth;
use meltpath_thermal::solver::surface::Surface;
use meltpath_thermal::solver::watch::Watch;
use meltpath_thermal::solver::{Face, Faces, State};

/// Ti6Al4V of the thesis.
pub(crate) fn titanium() -> Material {
    titanium_read(Readings::default())
}

/// The same, whose powder is as dense as metal.
pub(crate) fn dense_titanium() -> Material {
    let mut material = titanium();
    material.powder.relative_density = Law::constant(1.0);
    material
}

/// The same, its source read otherwise.
pub(crate) fn titanium_read(readings: Readings) -> Material {
    let text = meltpath_data::materials::TI6AL4V_EBM.text;
    read(text, readings).unwrap()
}

/// Charts of the slow beam, computed once.
pub(crate) fn slow() -> &'static ChartSet {
    static SET: OnceLock<ChartSet> = OnceLock::new();
    SET.get_or_init(|| compute_charts(120.0, 0.551_67, 2800.0))
}

/// The slow beam's charts over warm ground too, computed once.
pub(crate) fn slow_and_warm() -> &'static ChartSet {
    static SET: OnceLock<ChartSet> = OnceLock::new();
    SET.get_or_init(|| {
        let mut set = slow().clone();
        with_warm_ground(&mut set);
        set
    })
}

/// Charts of the inner circle of a strut, computed once.
pub(crate) fn inner() -> &'static ChartSet {
    static SET: OnceLock<ChartSet> = OnceLock::new();
    SET.get_or_init(|| compute_charts(144.0, 0.551_67, 2800.0))
}

/// Charts of the fast beam, computed once.
pub(crate) fn fast() -> &'static ChartSet {
    static SET: OnceLock<ChartSet> = OnceLock::new();
    SET.get_or_init(|| compute_charts(300.0, 0.413_67, 3700.0))
}

/// Charts of a beam of `power` W on `spot` mm that heat to `stop` °C and cool from 2800 °C.
pub(crate) fn compute_charts(power: f64, spot: f64, stop: f64) -> ChartSet {
    let settings = ChartSettings {
        stop: stop + CELSIUS,
        cooling_from: 2800.0 + CELSIUS,
        ..ChartSettings::for_beam(power, spot)
    };
    compute(&settings, &titanium(), &Silent).unwrap()
}

/// The same, over warm ground too.
pub(crate) fn compute_warm_charts(power: f64, spot: f64, stop: f64) -> ChartSet {
    let mut set = compute_charts(power, spot, stop);
    with_warm_ground(&mut set);
    set
}

/// Adds histories over warm ground.
pub(crate) fn with_warm_ground(set: &mut ChartSet) {
    let material = titanium();
    warm(set, &warm_grounds(&material), &material, &Silent).unwrap();
}

/// A beam of `power` W on `spot` mm at the origin and time 0.
pub(crate) fn settings(power: f64, spot: f64) -> BeamPoint {
    BeamPoint::start(power, spot)
}

/// Speed of the thesis at lines 0.125 mm apart, mm/s.
pub(crate) const SPEED: f64 = 980.0;
/// Its lines are this far apart, mm.
pub(crate) const HATCH: f64 = 0.125;

/// The middle of the thesis' rectangle: 4 mm of ten of its lines of 15 mm, the beam off while it is further away.
pub(crate) fn good_body() -> BeamPath {
    let mut points = Vec::new();
    let mut time = 0.0;
    for n in 0..10 {
        let y = (f64::from(n) + 0.5) * HATCH;
        let ends = if n % 2 == 0 { [-2.0, 2.0] } else { [2.0, -2.0] };
        for (x, power) in ends.into_iter().zip([300.0, 0.0]) {
            points.push(BeamPoint {
                time,
                x,
                y,
                ..settings(power, 0.413_67)
            });
            time += if power > 0.0 { 4.0 } else { 11.0 } / SPEED;
        }
    }
    BeamPath::new(points).unwrap()
}

/// Metal under a layer of fresh powder of 50 µm.
pub(crate) fn fresh_layer(c: DVec3) -> State {
    if c.z > -0.05 {
        State::Powder
    } else {
        State::Dense
    }
}

/// The thesis' surroundings: a shield at 300 °C above, everything else at the start temperature.
pub(crate) fn faces(material: &Material) -> Faces {
    Faces {
        top: Surface::Radiating {
            surroundings: 300.0 + CELSIUS,
        },
        sides: Face::Imposed(material.start),
        bottom: Face::Imposed(material.start),
    }
}

/// Whole layers of 50 µm on levels of cells: the finest are `cell` mm wide, planes of `heights` mm lie below them.
pub(crate) fn on_levels(
    covered: [[f64; 2]; 2],
    (cell, coarser): (f64, usize),
    heights: Vec<f64>,
) -> Setup {
    let Faces { top, sides, .. } = faces(&titanium());
    Setup {
        covered,
        cell,
        coarser,
        heights,
        layer: 0.05,
        tracked: 0.2,
        top,
        beyond: sides,
        step: 1.0,
        focus: None,
        bend: BEND,
    }
}

/// Nothing is watched.
pub(crate) fn nothing() -> Watch {
    Watch {
        places: Vec::new(),
        every: 1.0,
    }
}

/// Metal under a field of `size` mm, powder beside.
pub(crate) fn ground(size: [f64; 2]) -> impl Fn([f64; 2]) -> State {
    move |[x, y]| {
        if (-0.1..size[0] + 0.1).contains(&x) && (-0.1..size[1] + 0.1).contains(&y) {
            State::Dense
        } else {
            State::Powder
        }
    }
}

/// How the thesis' beam heats.
pub(crate) fn beam() -> Beam {
    Beam {
        efficiency: 0.9,
        depth: Depth::Falling { penetration: 0.1 },
    }
}

/// 60 K round what the middle of [`good_body`] reaches: four lines from the first, the period of two lines twice.
pub(crate) fn window_round(field: &Field) -> Classes {
    let any = Classes {
        melting: 0.0,
        window: [0.0, f64::INFINITY],
    };
    let middle = Tally::of(field, &any, |[i, j, k]| {
        let c = field.grid.centre(i, j, k);
        k + 1 == field.grid.planes() && c.x.abs() < 1.0 && (0.5..1.0).contains(&c.y)
    });
    Classes::calibrated(titanium().liquidus, middle.mean, 60.0)
}

/// A circle of a strut at 470 mm/s and `power` W, closed by 0.4 mm.
pub(crate) fn circle(radius: f64, power: f64) -> BeamPath {
    let turn = std::f64::consts::TAU + 0.4 / radius;
    let corners: Vec<[f64; 2]> = (0..=90)
        .map(|n| turn * f64::from(n) / 90.0)
        .map(|a| [radius * a.cos(), radius * a.sin()])
        .collect();
    BeamPath::along(&corners, 470.0, settings(power, 0.551_67)).unwrap()
}
