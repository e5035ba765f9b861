//! What is filled, and how its passes are named.

use meltpath_geometry::{Plane, Region};
use meltpath_toolpath::PassId;

use crate::error::PlanError;

/// A layer to fill: the regions to cover, allowance included.
#[derive(Debug, Clone, Copy)]
pub struct FillLayer<'a> {
    /// Counted from 1.
    pub number: u32,
    /// Where the regions lie: the plane on which the wire's tip travels.
    pub plane: &'a Plane,
    /// What to cover, in the plane's coordinates.
    pub regions: &'a [Region],
}

/// Names passes so that identifiers survive re-planning of other layers: part, layer and position in the layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PassIds {
    /// Part, counted from 0.
    pub part: u32,
}

impl PassIds {
    const PARTS: u32 = 1 << 4;
    const LAYERS: u32 = 1 << 14;
    const PASSES: usize = 1 << 14;

    /// The identifier of pass `index` of a layer.
    ///
    /// # Errors
    /// [`PlanError::TooMany`] beyond 16 parts, 16383 layers or 16384 passes a layer.
    pub fn id(self, layer: u32, index: usize) -> Result<PassId, PlanError> {
        if self.part >= Self::PARTS || layer >= Self::LAYERS || index >= Self::PASSES {
            return Err(PlanError::TooMany {
                part: self.part,
                layer,
                passes: index + 1,
            });
        }
        Ok(PassId(self.part << 28 | layer << 14 | index as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_layer_of_too_many_passes_says_how_many_it_has() {
        let ids = PassIds { part: 1 };
        assert_eq!(ids.id(2, 5), Ok(PassId(1 << 28 | 2 << 14 | 5)));
        let Err(PlanError::TooMany { passes, .. }) = ids.id(2, 20_000) else {
            panic!("20001 passes");
        };
        assert_eq!(passes, 20_001);
    }
}
