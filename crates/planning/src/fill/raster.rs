//! Raster: parallel beads, each with its own arc start.

use meltpath_geometry::math::DVec2;

use crate::fill::lined::Flat;
use crate::fill::lines::Span;
use crate::fill::settings::{FillSettings, LineDirection, LineOrder};

/// The beads of a raster.
pub(crate) fn raster(
    flat: &Flat,
    order: LineOrder,
    direction: LineDirection,
    layer: u32,
    settings: &FillSettings,
) -> Vec<Vec<DVec2>> {
    let lines = &flat.lines;
    let mut sequence: Vec<usize> = (0..lines.len()).collect();
    if order == LineOrder::CentreOut {
        // distance from the middle in half lines; of two equal ones the lower first
        sequence.sort_by_key(|&i| (2 * i + 1).abs_diff(lines.len()));
    }
    let back = DVec2::from_angle(flat.angle);
    let mut beads = Vec::new();
    for i in sequence {
        let forwards = match direction {
            LineDirection::OneWay => true,
            LineDirection::AlternatePerBead => beads.len() % 2 == 0,
            LineDirection::AlternatePerLayer => layer % 2 == 1,
        };
        let mut line: Vec<Span> = lines[i].clone();
        line.retain(|s| s.length() + 1e-9 >= settings.shortest_bead);
        if !forwards {
            line.reverse();
        }
        for span in line {
            let ends = if forwards { [0, 1] } else { [1, 0] };
            beads.push(ends.map(|e| back.rotate(span.point(e))).to_vec());
        }
    }
    beads
}
