//! What several files need: the beams, charts and material of the heat room's tests, and the ground that paths are judged on.

#[path = "../../../thermal/tests/all/support.rs"]
mod heat;

use meltpath_melt_strategy::bed::{Body, Reading};
use meltpath_thermal::beam::Beam;
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
    }
}
