//! A bead that was divided, and why.

use meltpath_base::{Fact, Measure, Place};
use meltpath_geometry::math::DVec3;
use meltpath_robot::posture::{Bound, WayEnd};

use crate::waam::drive::axes::shown;

/// A bead that ends at a place and begins anew there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Division {
    /// Its layer, from 1.
    pub(in crate::waam) layer: u32,
    /// Its number in the layer, from 1; that of the one that begins anew is the next.
    pub(in crate::waam) bead: u32,
    /// How far along it, mm.
    pub(in crate::waam) at: f64,
    /// The wire's tip in the part, mm.
    pub(in crate::waam) position: DVec3,
    /// What ends the way before.
    pub(in crate::waam) end: WayEnd,
}

/// Beads that were divided, and why.
pub(in crate::waam) fn fact(divided: &[Division]) -> Option<Fact> {
    let told = |d: &Division| {
        format!(
            "bead {} of layer {} ends at {:.0} mm of its way and goes on as bead {}: {}",
            d.bead,
            d.layer,
            d.at,
            d.bead + 1,
            why(&d.end)
        )
    };
    let first = divided.first()?;
    let words: Vec<String> = divided.iter().map(told).collect();
    let fact = Fact::new(
        "divided-beads",
        "beads that end and begin anew, as no single way of the arm holds them",
        Measure::exact(words.len() as f64, ""),
        &shown(&words),
    );
    Some(fact.at(Place {
        position: Some(first.position.to_array()),
        layer: Some(first.layer),
        bead: Some(first.bead),
        ..Place::default()
    }))
}

/// What keeps a way from going on.
fn why(end: &WayEnd) -> String {
    let bound = match end.near {
        Bound::Limit(joint, at, _) => {
            let at = at.to_degrees();
            format!("joint {} reaches its limit of {at:.0} deg", joint + 1)
        }
        Bound::Wrist(room) => format!(
            "the axes of the wrist come in line ({:.1} deg from it)",
            room.to_degrees()
        ),
        Bound::Elbow(room) => format!(
            "the arm is stretched ({:.1} deg from it)",
            room.to_degrees()
        ),
        Bound::Shoulder(room) => {
            format!("the wrist comes over the first axis ({room:.0} mm from it)")
        }
    };
    format!("{:.0} mm farther on {bound}", end.behind)
}
