//! A toolpath: passes in order of execution, with the profiles they follow.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::pass::Pass;

/// The values a pass follows where no channel says otherwise.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Name for people, such as `contour`.
    pub name: String,
    /// Travel speed, mm/s.
    pub speed: f64,
    /// Programmed wire feed speed, mm/s; 0 without wire.
    pub wire_feed: f64,
    /// Beam power, W; 0 without beam.
    pub power: f64,
    /// Expected width of a single bead, mm; 0 where it has none.
    pub width: f64,
    /// Expected height of a single bead, mm; 0 where it has none.
    pub height: f64,
}

/// Passes in order of execution. The tree Build > Part > Layer is an index over their tags.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Toolpath {
    /// The profiles that passes refer to.
    pub profiles: Vec<Profile>,
    /// The passes, first executed first.
    pub passes: Vec<Pass>,
}

impl Toolpath {
    /// Indices of the passes of each (part, layer), in order of execution.
    pub fn by_layer(&self) -> BTreeMap<(u32, u32), Vec<usize>> {
        let mut index = BTreeMap::<_, Vec<usize>>::new();
        for (i, pass) in self.passes.iter().enumerate() {
            index
                .entry((pass.tag.part, pass.tag.layer))
                .or_default()
                .push(i);
        }
        index
    }

    /// Total length of the depositing passes, mm.
    pub fn deposited_length(&self) -> f64 {
        self.passes
            .iter()
            .filter(|p| p.role != crate::Role::Travel)
            .map(Pass::length)
            .sum()
    }
}
