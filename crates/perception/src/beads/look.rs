//! How finely a cloud is looked through.

/// How clouds are looked through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Points so near the plate are the plate, mm.
    pub near: f64,
    /// Distance between sections, mm.
    pub every: f64,
}
