//! What the items of a scene share: fields over their points, whether they are shown, what can be wrong with them.

use meltpath_geometry::math::DVec3;

use crate::colour::ColourMap;

/// Highest layer number that the view can tell apart.
pub const MAX_LAYER: u32 = 0x7fff;

/// Why a scene cannot be shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SceneError {
    /// A column does not have one value per element.
    #[error("{what} has {found} values where {expected} are needed: one per {element}")]
    Count {
        /// The column.
        what: String,
        /// Number of elements.
        expected: usize,
        /// Number of values given.
        found: usize,
        /// What a value belongs to.
        element: &'static str,
    },
    /// A point has an infinite or undefined coordinate.
    #[error("point {index} of \"{what}\" is not finite: remove it before showing")]
    Point {
        /// Name of the set.
        what: String,
        /// Index of the point.
        index: usize,
    },
    /// A triangle or polyline refers to a point that is not there, or polylines are out of order.
    #[error(
        "element {index} of \"{what}\" begins or lies at a point that does not exist or is out of order"
    )]
    Index {
        /// Name of the set.
        what: String,
        /// Index of the triangle or polyline.
        index: usize,
    },
    /// More layers than the view can tell apart.
    #[error("layer {layer} of \"{what}\": the view tells layers 0 to {MAX_LAYER} apart")]
    Layer {
        /// Name of the set.
        what: String,
        /// The layer given.
        layer: u32,
    },
    /// The cell size or the counts of a grid make no sense.
    #[error(
        "grid of {nx} x {ny} cells of {cell} mm: both counts and the cell size must be positive"
    )]
    Grid {
        /// Cells along x.
        nx: usize,
        /// Cells along y.
        ny: usize,
        /// Cell size as given, mm.
        cell: String,
    },
}

/// Whether an item is shown when the page opens; a person can change it there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Visibility {
    /// Shown at first.
    #[default]
    Shown,
    /// Hidden at first.
    Hidden,
    /// Shown at first, but not while a film shows a moment before the end.
    Finished,
}

impl Visibility {
    /// Whether it is shown when the page opens.
    pub fn at_first(self) -> bool {
        self != Visibility::Hidden
    }
}

/// A named field over the points of an item.
#[derive(Debug, Clone, PartialEq)]
pub struct Scalar {
    /// Name, such as `speed`.
    pub name: String,
    /// Unit as written for people; empty when the value has none.
    pub unit: String,
    /// One value per point; NaN where there is none.
    pub values: Vec<f32>,
    /// Ends of the colour scale; values beyond take the end colours. The range of the values when absent.
    pub range: Option<[f64; 2]>,
    /// Which colours.
    pub map: ColourMap,
}

impl Scalar {
    /// A sequential scalar over the range of its values.
    pub fn new(name: &str, unit: &str, values: Vec<f32>) -> Self {
        Scalar {
            name: name.to_owned(),
            unit: unit.to_owned(),
            values,
            range: None,
            map: ColourMap::Sequential,
        }
    }

    /// The same scalar with blue-to-red colours over `-limit..limit`.
    #[must_use]
    pub fn diverging(self, limit: f64) -> Self {
        Scalar {
            range: Some([-limit.abs(), limit.abs()]),
            map: ColourMap::Diverging,
            ..self
        }
    }
}

pub(super) fn check_points(what: &str, points: &[DVec3]) -> Result<(), SceneError> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(index) => Err(SceneError::Point {
            what: what.to_owned(),
            index,
        }),
        None => Ok(()),
    }
}

pub(super) fn check_scalars(
    what: &str,
    scalars: &[Scalar],
    expected: usize,
) -> Result<(), SceneError> {
    match scalars.iter().find(|s| s.values.len() != expected) {
        Some(s) => Err(SceneError::Count {
            what: format!("\"{}\" of \"{what}\"", s.name),
            expected,
            found: s.values.len(),
            element: "point",
        }),
        None => Ok(()),
    }
}
