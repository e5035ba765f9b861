//! Layer heights: constant or per layer, the last layer adapted so that the target top is reached
//! (Rouchon 2022, § 1.2.3.1: parallel planes).

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The most layers accepted: beyond, the height is a mistake of unit.
const MOST_LAYERS: f64 = 1e6;

/// How thick layers are, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum LayerHeight {
    /// The same for every layer.
    Constant(f64),
    /// One value per layer from the bottom; the last value serves all further layers.
    PerLayer(Vec<f64>),
}

/// What the last layer does to reach the target top.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LastLayer {
    /// Between half and one and a half times its nominal height, so that the top is met exactly.
    #[default]
    Adapted,
    /// Its nominal height: the top is met or passed.
    Full,
}

/// One layer between two heights along the build direction, mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LayerSpan {
    /// Lower side.
    pub bottom: f64,
    /// Upper side.
    pub top: f64,
}

impl LayerSpan {
    /// Thickness, mm.
    pub fn height(&self) -> f64 {
        self.top - self.bottom
    }

    /// The height at a fraction of the thickness: 0 is the bottom, 0.5 mid-height, 1 the top.
    pub fn at(&self, fraction: f64) -> f64 {
        self.bottom + fraction * (self.top - self.bottom)
    }
}

/// Why layers could not be laid out.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum HeightsError {
    /// A layer height is not a positive number.
    #[error("layer {layer}: the height {height} mm must be a positive number")]
    Height {
        /// Layer, counted from 1.
        layer: usize,
        /// The value given, mm.
        height: f64,
    },
    /// No layer height was given.
    #[error("the list of layer heights is empty: give at least one")]
    Empty,
    /// Nothing lies between bottom and top.
    #[error(
        "no layer fits between {bottom} mm and {top} mm: the part has no height along the build direction"
    )]
    Extent {
        /// Bottom, mm.
        bottom: f64,
        /// Top, mm.
        top: f64,
    },
    /// An absurd number of layers.
    #[error(
        "a layer height of {height} mm makes {count:.0} layers over {extent} mm (at most {MOST_LAYERS:.0}): check the units"
    )]
    TooMany {
        /// Layer height, mm.
        height: f64,
        /// Height to cover, mm.
        extent: f64,
        /// Layers that this makes.
        count: f64,
    },
}

/// Layers from `bottom` up to `top` (mm along the build direction), joined without gaps.
///
/// With [`LastLayer::Adapted`] the last layer ends exactly at `top`: a remainder below half a layer goes to
/// the layer before it, a larger one makes a thinner last layer. A part lower than half a layer gets one layer.
///
/// ```
/// use meltpath_geometry::section::{LastLayer, LayerHeight, layers};
/// let made = layers(0.0, 10.3, &LayerHeight::Constant(2.0), LastLayer::Adapted).unwrap();
/// assert_eq!(made.len(), 5);
/// assert_eq!((made[4].bottom, made[4].top), (8.0, 10.3));
/// ```
///
/// # Errors
/// Heights that are not positive, no extent, or more than a million layers.
pub fn layers(
    bottom: f64,
    top: f64,
    height: &LayerHeight,
    last: LastLayer,
) -> Result<Vec<LayerSpan>, HeightsError> {
    let extent = top - bottom;
    if !(extent.is_finite() && extent > 0.0) {
        return Err(HeightsError::Extent { bottom, top });
    }
    let list = match height {
        LayerHeight::Constant(h) => std::slice::from_ref(h),
        LayerHeight::PerLayer(list) => list,
    };
    let Some(&steady) = list.last() else {
        return Err(HeightsError::Empty);
    };
    if let Some(layer) = list.iter().position(|h| !(h.is_finite() && *h > 0.0)) {
        return Err(HeightsError::Height {
            layer: layer + 1,
            height: list[layer],
        });
    }
    if extent / steady > MOST_LAYERS {
        return Err(HeightsError::TooMany {
            height: steady,
            extent,
            count: extent / steady,
        });
    }
    let mut made: Vec<LayerSpan> = Vec::new();
    let mut lower = bottom;
    loop {
        let n = made.len();
        let nominal = list.get(n).copied().unwrap_or(steady);
        let rest = top - lower;
        // rounding must not add a layer of nothing
        if rest <= 1e-9 * extent {
            break;
        }
        if last == LastLayer::Adapted && rest < 0.5 * nominal {
            match made.last_mut() {
                Some(before) => before.top = top,
                None => made.push(LayerSpan { bottom: lower, top }),
            }
            break;
        }
        let upper = if n < list.len() {
            lower + nominal
        } else {
            // multiples, not sums: the thousandth layer carries no rounding of the others
            let base: f64 = list.iter().sum();
            bottom + base + (n + 1 - list.len()) as f64 * steady
        };
        if upper >= top {
            let upper = match last {
                LastLayer::Adapted => top,
                LastLayer::Full => upper,
            };
            made.push(LayerSpan {
                bottom: lower,
                top: upper,
            });
            break;
        }
        made.push(LayerSpan {
            bottom: lower,
            top: upper,
        });
        lower = upper;
    }
    if let (LastLayer::Adapted, Some(end)) = (last, made.last_mut()) {
        end.top = top;
    }
    Ok(made)
}
