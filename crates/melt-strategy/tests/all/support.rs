//! What several files need: the beams, charts and material of the heat room's tests, and the ground that paths are judged on.

#[path = "../../../thermal/tests/all/support.rs"]
mod heat;

use meltpath_base::Silent;
use meltpath_melt_strategy::bed::{Body, Domain, Reading, Resolution};
use meltpath_melt_strategy::judgement::judge;
use meltpath_thermal::beam::{Beam, BeamPath};
use meltpath_thermal::grid::Field;
use meltpath_thermal::material::Material;
use meltpath_thermal::solver::State;

pub(crate) use heat::*;

/// Fresh powder on metal.
pub(crate) fn on_metal<'a>(material: &'a Material, beam: &'a Beam) -> Body<'a> {
    Body {
        material,
        beam,
        layer: 0.05,
        reading: Reading::LayerMean,
        ground: &|_| State::Dense,
        surface: faces(material).top,
        beyond: faces(material).bottom,
        between: None,
        kept: None,
    }
}

/// Lines along x from `low` to `high` mm whose half length `half` gives; 980 mm/s, 60 kV, 5 mA, focus 4 mA.
pub(crate) fn serpentine(low: f64, high: f64, half: impl Fn(f64) -> f64) -> BeamPath {
    let lines = ((high - low) / HATCH).round() as usize;
    let corners: Vec<[f64; 2]> = (0..lines)
        .flat_map(|n| {
            let y = low + (n as f64 + 0.5) * HATCH;
            let ends = [[-half(y), y], [half(y), y]];
            if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
        })
        .collect();
    BeamPath::along(&corners, SPEED, settings(300.0, 0.413_67)).unwrap()
}

/// Half the width of the thesis' triangle at height `y`, mm.
pub(crate) fn side(y: f64) -> f64 {
    8.75 * (1.0 - y / 7.5)
}

/// Highest temperatures of a path on metal, on the reference solver.
pub(crate) fn on_solver(path: &BeamPath, cell: f64, planes: u32) -> Field {
    let material = titanium();
    let beam = beam();
    let body = on_metal(&material, &beam);
    let resolution = Resolution {
        cell,
        planes,
        step: 4e-6,
        domain: Domain::NARROW,
        power: 1.0,
    };
    judge(&body, &[], path, &resolution, &Silent)
        .unwrap()
        .highest
}
