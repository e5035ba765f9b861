//! Where beads came out uneven.

use meltpath_deposition::workpiece::{Laid, LaidPoint};
use meltpath_geometry::math::DVec3;

/// A stretch where a bead is thicker or thinner than meant, or the metal under it nearer or farther: a step, a tent or a hole.
#[derive(Debug)]
pub(crate) struct Uneven {
    /// The worst place: the surface on the bead's axis, mm.
    pub(crate) position: DVec3,
    /// How far it is off there, mm.
    pub(crate) excess: f64,
    /// Length of the stretch, mm, to the record step.
    pub(crate) length: f64,
    /// Bead, counted from 0.
    pub(crate) bead: u32,
}

/// Stretches where the thickness differs by more than `limit` mm from the mean of all beads: tents, where more, and holes.
pub(crate) fn uneven(laid: &Laid, limit: f64) -> Vec<Uneven> {
    let count = laid.path.len().max(1) as f64;
    let mean = laid.path.iter().map(|p| p.thickness).sum::<f64>() / count;
    stretches(laid, limit, |p| p.thickness - mean)
}

/// Stretches where the contact tube was farther than `limit` mm from the distance `nominal`: the bead fell into a hole, where more, or
/// met a step.
pub(crate) fn astray(laid: &Laid, nominal: f64, limit: f64) -> Vec<Uneven> {
    stretches(laid, limit, |p| p.ctwd - nominal)
}

fn stretches(laid: &Laid, limit: f64, excess: impl Fn(&LaidPoint) -> f64) -> Vec<Uneven> {
    let mut found: Vec<Uneven> = Vec::new();
    let mut before: Option<(&LaidPoint, f64)> = None;
    for p in &laid.path {
        let now = excess(p);
        let joined = before.filter(|(b, e)| b.bead == p.bead && e * now > 0.0 && e.abs() > limit);
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
