//! How closely a mesh follows its solid.

/// How closely a mesh follows its solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Largest distance between a triangle or its sides and the surface, mm.
    pub chord: f64,
    /// Largest turn between neighbouring chords along an edge or a line of a surface, rad.
    pub angle: f64,
}

impl Default for Tolerance {
    /// 0.01 mm and 20°.
    fn default() -> Self {
        Self {
            chord: 0.01,
            angle: 20f64.to_radians(),
        }
    }
}
