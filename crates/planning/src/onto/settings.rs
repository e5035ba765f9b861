//! What is asked of layers on a body.

use meltpath_geometry::Mesh;

use crate::fill::{FillSettings, Paces};

/// What is asked of layers on a body.
#[derive(Debug, Clone, Copy)]
pub struct OntoSettings<'a> {
    /// How layers are filled.
    pub fill: &'a FillSettings,
    /// Metal beyond the part aside, mm.
    pub side: f64,
    /// Metal over the part, away from the body, mm.
    pub over: f64,
    /// Distance from the rims of a layer beyond which its height is looked at, mm.
    pub inside: f64,
    /// How far the polyline of a bead may lie beside its curve, mm.
    pub chord_error: f64,
    /// Layers after this one are left out.
    pub count: Option<u32>,
    /// Layers go from the body to the top of the part; nothing for layers at one distance from the body.
    pub top: Option<ToTop<'a>>,
}

/// Layers that go from a body to the top of a part: so many everywhere, thicker where there is more between the two, and laid the slower.
#[derive(Debug, Clone, Copy)]
pub struct ToTop<'a> {
    /// The top, showing away from the body; nothing for what of the part looks away from the body.
    pub sheet: Option<&'a Mesh>,
    /// The speed of the passes' profile, and how much slower and faster a bead may be laid for the thickness of its layer.
    pub paces: Paces,
    /// The slowest and the fastest speed that beads are known of, mm/s: none is laid beyond them, whatever its fill asks for besides.
    pub known: [f64; 2],
}

impl ToTop<'_> {
    /// Thickness of the thinnest and the thickest layer that can be laid where one grows to `grown` at the speed of the profile, mm.
    pub fn able(&self, grown: f64) -> [f64; 2] {
        [self.paces.fastest, self.paces.slowest].map(|share| grown / share)
    }

    /// The same of all layers, which grow to `heights`, mm.
    pub(super) fn able_of(&self, heights: &[f64]) -> [f64; 2] {
        let each = heights.iter().map(|grown| self.able(*grown));
        each.fold([0.0, f64::INFINITY], |[thin, thick], [least, most]| {
            [f64::max(thin, least), f64::min(thick, most)]
        })
    }
}
