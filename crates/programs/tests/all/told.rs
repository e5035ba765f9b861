//! What a reading tells of its moves, one after the other.

use meltpath_geometry::math::DVec3;
use meltpath_programs::{Control, Reading};
use meltpath_toolpath::{Channel, Move};

/// A move as a toolpath and its program tell it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Told {
    pub(crate) shape: Move,
    pub(crate) to: DVec3,
    pub(crate) axis: DVec3,
    pub(crate) speed: Option<f64>,
    pub(crate) wire_feed: Option<f64>,
    pub(crate) burns: bool,
    pub(crate) layer: u32,
    pub(crate) pass: u32,
    pub(crate) control: Control,
}

/// Every move that is no wait, in order.
pub(crate) fn motions(reading: &Reading) -> Vec<Told> {
    let moves = reading.toolpath.passes();
    let moves = moves.flat_map(|p| (0..p.move_count()).map(move |i| (p, i)));
    let told = moves.zip(&reading.controls).map(|((p, i), control)| Told {
        shape: p.move_at(i),
        to: p.points[i + 1],
        axis: p.axis(i + 1).unwrap(),
        speed: p.value(Channel::Speed, i),
        wire_feed: p.value(Channel::WireFeed, i),
        burns: p.head.role.deposits(),
        layer: p.layer,
        pass: p.head.id.0,
        control: *control,
    });
    told.filter(|t| !matches!(t.shape, Move::Spot { .. }))
        .collect()
}
