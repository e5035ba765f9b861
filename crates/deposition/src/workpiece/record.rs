//! What laying in space tells: along the path, where metal hung free, and where beads came out uneven.

use meltpath_geometry::math::DVec3;
use meltpath_geometry::workpiece::Voxels;
use serde::{Deserialize, Serialize};

/// What lies under a bead's axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Support {
    /// Metal, under the middle half of the bead's width at least.
    Metal,
    /// Metal under the axis, none within reach under a quarter of the width beside it.
    Partial,
    /// No metal within reach of the arc: the bead hangs free.
    None,
}

/// A place on the path of a bead.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LaidPoint {
    /// Tool point, mm, part frame.
    pub tool: DVec3,
    /// Unit torch axis, from the part to the torch.
    pub axis: DVec3,
    /// Time, s.
    pub time: f64,
    /// Command being executed.
    pub command: u32,
    /// Bead, counted from 0.
    pub bead: u32,
    /// Contact tube to the metal that this bead finds, along the axis, mm.
    pub ctwd: f64,
    /// Wire fed here over what the program asks for at the reference distance.
    pub feed: f64,
    /// Surface left on the bead's axis, mm.
    pub crest: DVec3,
    /// Thickness laid there along the torch axis, mm.
    pub thickness: f64,
    /// What carries the bead here.
    pub support: Support,
}

/// A stretch of bead without metal under it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Loose {
    /// Where it begins: the bead's axis, mm.
    pub position: DVec3,
    /// Its length, mm.
    pub length: f64,
    /// Bead, counted from 0.
    pub bead: u32,
    /// Command being executed.
    pub command: u32,
    /// What little there is: partial or none.
    pub support: Support,
}

/// A stretch where a bead is thicker or thinner than meant, or the metal under it nearer or farther: a step, a tent or a hole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uneven {
    /// The worst place: the surface on the bead's axis, mm.
    pub position: DVec3,
    /// How far it is off there, mm.
    pub excess: f64,
    /// Length of the stretch, mm, to the record step.
    pub length: f64,
    /// Bead, counted from 0.
    pub bead: u32,
}

/// What has been laid.
#[derive(Debug, Clone, PartialEq)]
pub struct Laid {
    /// All metal: what was there, and the beads.
    pub voxels: Voxels,
    /// Wire fed, mm: with the source's answer to the contact tube distance, where there is one.
    pub wire: f64,
    /// Metal laid, mm³: efficiency times wire section times wire.
    pub volume: f64,
    /// Metal for which there was no room in the box of voxels or in memory, mm³: not in `voxels`.
    pub beside: f64,
    /// Metal laid over places without metal within reach, mm³.
    pub loose_volume: f64,
    /// Stretches of bead without metal under them.
    pub loose: Vec<Loose>,
    /// Places along the beads, in order of time.
    pub path: Vec<LaidPoint>,
    /// Number of beads.
    pub beads: u32,
}

impl Laid {
    /// Stretches where the thickness differs by more than `limit` mm from the mean of all beads: tents, where more, and holes.
    pub fn uneven(&self, limit: f64) -> Vec<Uneven> {
        let count = self.path.len().max(1) as f64;
        let mean = self.path.iter().map(|p| p.thickness).sum::<f64>() / count;
        self.stretches(limit, |p| p.thickness - mean)
    }

    /// Stretches where the contact tube was farther than `limit` mm from the distance `nominal`: the bead fell into a hole, where more, or
    /// met a step.
    pub fn astray(&self, nominal: f64, limit: f64) -> Vec<Uneven> {
        self.stretches(limit, |p| p.ctwd - nominal)
    }

    fn stretches(&self, limit: f64, excess: impl Fn(&LaidPoint) -> f64) -> Vec<Uneven> {
        let mut found: Vec<Uneven> = Vec::new();
        let mut before: Option<(&LaidPoint, f64)> = None;
        for p in &self.path {
            let now = excess(p);
            let joined =
                before.filter(|(b, e)| b.bead == p.bead && e * now > 0.0 && e.abs() > limit);
            match (now.abs() > limit, joined, found.last_mut()) {
                (true, Some((b, _)), Some(last)) => {
                    last.length += b.crest.distance(p.crest);
                    if now.abs() > last.excess.abs() {
                        (last.excess, last.position) = (now, p.crest);
                    }
                }
                (true, ..) => found.push(Uneven {
                    position: p.crest,
                    excess: now,
                    length: 0.0,
                    bead: p.bead,
                }),
                (false, ..) => {}
            }
            before = Some((p, now));
        }
        found
    }
}
