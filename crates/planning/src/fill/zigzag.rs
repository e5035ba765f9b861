//! Zigzag: parallel beads joined at alternate ends along the boundary, cell by cell where holes break the lines.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::{Region, Ring};

use crate::fill::lined::Flat;
use crate::fill::lines::{Span, cells};
use crate::fill::outline::{Room, length};
use crate::fill::settings::FillSettings;
use crate::fill::turning_points::link;

/// The beads of a zigzag. `entry` picks the first cell's corner: bit 0 right instead of left, bit 1 top instead of bottom.
pub(crate) fn zigzag(flat: &Flat, entry: u32, settings: &FillSettings) -> Vec<Vec<DVec2>> {
    let links = &flat.links;
    let rings: Vec<&Ring> = flat.centres.iter().flat_map(Region::rings).collect();
    let mut left: Vec<Vec<Span>> = cells(&flat.lines);
    let mut beads: Vec<Vec<DVec2>> = Vec::new();
    let mut first = true;
    while !left.is_empty() {
        // the cell and the corner of it nearest to the end of the last bead
        let end = beads.last().and_then(|b| b.last().copied());
        let mut choice = (f64::INFINITY, 0, entry);
        for (i, cell) in left.iter().enumerate() {
            for corner in 0..4 {
                let start = corner_of(cell, corner);
                let away = match end {
                    Some(end) => end.distance(start),
                    // the first cell: the one that reaches farthest into the entry corner
                    None if corner == entry => {
                        let s = |bit: u32| if entry & bit == 0 { 1.0 } else { -1.0 };
                        start.x * s(1) + start.y * s(2)
                    }
                    None => continue,
                };
                if away < choice.0 {
                    choice = (away, i, corner);
                }
            }
        }
        let (away, index, corner) = choice;
        let cell = left.swap_remove(index);
        let mut pieces = run(&cell, corner, &rings, links, settings).into_iter();
        let next = pieces.next().unwrap_or_default();
        match (beads.last_mut(), end) {
            (Some(last), Some(end))
                if !first
                    && away <= settings.longest_link
                    && next
                        .first()
                        .is_some_and(|&p| links.has_way(end, p, 0.2 * settings.width)) =>
            {
                last.extend(next);
            }
            _ => beads.push(next),
        }
        beads.extend(pieces);
        first = false;
    }
    let back = DVec2::from_angle(flat.angle);
    beads.retain(|b| length(b) + 1e-9 >= settings.shortest_bead);
    for p in beads.iter_mut().flatten() {
        *p = back.rotate(*p);
    }
    beads
}

fn corner_of(cell: &[Span], corner: u32) -> DVec2 {
    let span = if corner & 2 == 0 {
        cell.first()
    } else {
        cell.last()
    };
    span.map_or(DVec2::ZERO, |s| s.point((corner & 1) as usize))
}

/// The zigzag through one cell from a corner; several beads where a link would be too long.
fn run(
    cell: &[Span],
    corner: u32,
    rings: &[&Ring],
    links: &Room,
    settings: &FillSettings,
) -> Vec<Vec<DVec2>> {
    let mut from = (corner & 1) as usize;
    let order: Vec<&Span> = if corner & 2 == 0 {
        cell.iter().collect()
    } else {
        cell.iter().rev().collect()
    };
    let mut beads: Vec<Vec<DVec2>> = vec![Vec::new()];
    let mut before: Option<(&Span, usize)> = None;
    for span in order {
        if let Some((last, end)) = before {
            match link((last, end), (span, from), rings, links, settings) {
                Some(way) => beads.last_mut().into_iter().for_each(|b| b.extend(&way)),
                None => beads.push(Vec::new()),
            }
        }
        if let Some(bead) = beads.last_mut() {
            bead.push(span.point(from));
            bead.push(span.point(1 - from));
        }
        before = Some((span, 1 - from));
        from = 1 - from;
    }
    beads
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fill::lines::Crossing;

    /// Turning points lie a share of a stepover inside the contour.
    #[test]
    fn the_reversal_is_told_in_stepovers() {
        let settings = FillSettings {
            reversal: 0.6,
            ..FillSettings::new(3.0, 2.0)
        };
        assert!((settings.reversal_distance() - 1.2).abs() < 1e-12);
    }
    #[test]
    fn corners_of_a_cell_are_counted_from_the_lower_left() {
        let span = |y: f64| Span {
            y,
            ends: [-1.0, 1.0].map(|x| Crossing {
                x,
                ring: 0,
                edge: 0,
            }),
        };
        let cell = [span(0.0), span(3.0)];
        let corners = [0, 1, 2, 3].map(|k| corner_of(&cell, k).to_array());
        assert_eq!(corners, [[-1.0, 0.0], [1.0, 0.0], [-1.0, 3.0], [1.0, 3.0]]);
    }
}
