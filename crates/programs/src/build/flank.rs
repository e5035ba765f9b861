//! Layers that stand on a flank: between their beads the tool stays beyond all metal along the torch, where going up could lead through a part
//! above.

use std::collections::BTreeMap;

use meltpath_geometry::math::DVec3;
use meltpath_toolpath::{Layer, Toolpath};

/// A layer whose torch leans by more than 45° from the vertical stands on a flank, its cosine.
const LEANS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Its torch points in one direction: the mean of unit vectors is so long at least.
const ONE: f64 = 0.9;
/// Layers whose directions lie within 20° of each other are one flank's, its cosine.
const SAME: f64 = 0.939_692_620_785_908_4;

/// The flanks of a toolpath, and the metal so far.
pub(super) struct Flanks {
    /// The direction out of its flank of each layer that stands on one.
    ways: BTreeMap<u32, DVec3>,
    /// The box of each layer's beads so far, mm.
    boxes: BTreeMap<u32, (DVec3, DVec3)>,
    /// What beads grow over their paths at most, mm.
    growth: f64,
}

impl Flanks {
    pub(super) fn of(toolpath: &Toolpath) -> Self {
        let layers = toolpath.layers.iter();
        let ways = layers.filter_map(|layer| Some((layer.number, way(layer)?)));
        Flanks {
            ways: ways.collect(),
            boxes: BTreeMap::new(),
            growth: 0.0,
        }
    }

    /// The direction out of the flank that a layer stands on; nothing where it does not.
    pub(super) fn way(&self, layer: u32) -> Option<DVec3> {
        self.ways.get(&layer).copied()
    }

    /// Notes a bead of a layer, which grows so far over its path.
    pub(super) fn lay(&mut self, layer: u32, places: impl Iterator<Item = DVec3>, growth: f64) {
        if self.ways.is_empty() {
            return;
        }
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = self.boxes.entry(layer).or_insert(none);
        for p in places {
            *low = low.min(p);
            *high = high.max(p);
        }
        self.growth = self.growth.max(growth);
    }

    /// How far all metal so far reaches along a direction, mm.
    pub(super) fn level(&self, way: DVec3) -> f64 {
        let reach = |(low, high): &(DVec3, DVec3)| (*low * way).max(*high * way).element_sum();
        let reaches = self.boxes.values().map(reach);
        reaches.fold(f64::NEG_INFINITY, f64::max) + self.growth
    }
}

/// Whether two directions are those of one flank.
pub(super) fn same(a: DVec3, b: DVec3) -> bool {
    a.dot(b) > SAME
}

/// The mean direction of the torch over a layer's beads, where it is one direction that leans.
fn way(layer: &Layer) -> Option<DVec3> {
    let beads = layer.passes().filter(|pass| pass.head.role.deposits());
    let axes = beads.flat_map(|pass| (0..pass.points.len()).map(move |i| pass.axis(i)));
    let (mut sum, mut count) = (DVec3::ZERO, 0_u32);
    for axis in axes {
        sum += axis?.normalize_or_zero();
        count += 1;
    }
    let mean = sum / f64::from(count.max(1));
    let way = mean.normalize_or_zero();
    (mean.length() > ONE && way.z < LEANS).then_some(way)
}
