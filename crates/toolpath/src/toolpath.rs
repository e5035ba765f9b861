//! A toolpath: the passes of a build in order of execution, layer by layer, with the profiles they follow.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::layer::Layer;
use crate::pass::Pass;
use crate::vocabulary::Weave;

/// The settings of a bead or a beam: what a pass follows where no channel says otherwise. 0 where it says nothing.
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
    /// Diameter of the beam's spot, mm; 0 without beam.
    pub spot: f64,
    /// Dwell at the end of each move, s.
    pub dwell: f64,
    /// Expected width of a single bead or melted line, mm; 0 where it has none.
    pub width: f64,
    /// Expected height of a single bead, mm; 0 where it has none.
    pub height: f64,
}

/// The passes of a build in order of execution: layers in order, in each layer passes in order. The tree
/// Build > Part > Layer > Entity > Bead is an index over their tags.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Toolpath {
    /// Name of the build; empty where it has none.
    pub build: String,
    /// Names of parts, by the part of their passes.
    pub parts: BTreeMap<u32, String>,
    /// The profiles that passes refer to.
    pub profiles: Vec<Profile>,
    /// The weaves that events refer to, from 1.
    pub weaves: Vec<Weave>,
    /// The layers, first executed first.
    pub layers: Vec<Layer>,
}

impl Toolpath {
    /// All passes in order of execution.
    pub fn passes(&self) -> impl DoubleEndedIterator<Item = Pass<'_>> {
        self.layers.iter().flat_map(Layer::passes)
    }

    /// Number of passes.
    pub fn pass_count(&self) -> usize {
        self.layers.iter().map(Layer::len).sum()
    }

    /// Total length of the depositing passes, mm.
    pub fn deposited_length(&self) -> f64 {
        let laid = self.passes().filter(|p| p.head.role.deposits());
        laid.map(|p| p.length()).sum()
    }
}
