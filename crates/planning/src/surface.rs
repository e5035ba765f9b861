//! Passes on surfaces in space: on a piece of a parametric surface, or on a mesh, by parallel planes, by a constant parameter or at
//! a constant distance; how the torch is held along them, and how evenly they lie. The surface is that of a wall one bead thick.
//! Source: Campocasso 2017, § III.

mod base;
mod closing;
mod error;
mod field;
mod fronts;
mod layers;
mod measure;
mod pace;
mod pass;
mod patch;
mod spiral;
mod torch;

pub use base::Base;
pub use closing::{Opening, without_narrow};
pub use error::SurfaceError;
pub use field::{Field, FieldError};
pub use fronts::{MeshPasses, plan_mesh};
pub use layers::paced_layers;
pub use measure::{
    Distribution, Evenness, Extreme, distribution, evenness, nearest_spacing, tilts,
};
pub use pace::Pace;
pub use pass::{SurfacePass, SurfacePoint};
pub use patch::{Parameter, Patch, plan_patch};
pub use spiral::{SpiralError, wound};
pub use torch::{Torch, TorchRule, axes_along, torch_axes};

use meltpath_geometry::math::DVec3;

/// How passes follow one another on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfaceStrategy {
    /// Parallel planes, evenly spaced along a direction: the passes lie farther apart where the surface leans (eq. 2 of the source).
    Planes {
        /// Along which the planes follow one another; of any length but zero.
        direction: DVec3,
    },
    /// Lines of one parameter of the surface, spaced so that the widest place of a pass has the distance that is asked for. They lie
    /// closer elsewhere. Meshes have no parameter.
    Parameter,
    /// At the asked distance from the pass before. On a patch, from the point of the same other parameter (eq. 3 of the source); on a
    /// mesh, from the nearest point.
    Distance,
}

/// What is asked of passes on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSettings {
    /// How passes follow one another.
    pub strategy: SurfaceStrategy,
    /// Distance between passes, mm.
    pub spacing: f64,
    /// How far the polyline of a pass may lie beside its curve, mm.
    pub chord_error: f64,
}

/// Most passes of one plan: what takes more has a spacing that no bead has.
const MOST_PASSES: usize = 16_383;

impl SurfaceSettings {
    fn check(&self) -> Result<(), SurfaceError> {
        let above = |name: &'static str, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(SurfaceError::Setting { name, value })
            }
        };
        above("the distance between passes", self.spacing)?;
        above("the chord error", self.chord_error)?;
        match self.strategy {
            SurfaceStrategy::Planes { direction } => {
                above("the length of the direction", direction.length())
            }
            SurfaceStrategy::Parameter | SurfaceStrategy::Distance => Ok(()),
        }
    }
}
