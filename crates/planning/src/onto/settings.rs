//! What is asked of layers on a body.

use crate::fill::FillSettings;

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
}
