//! The direction of parallel lines: given, or the one with the fewest lines and cells.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use meltpath_geometry::Region;

use crate::fill::lines::{Rim, cells, spans};
use crate::fill::outline::{edges, turned};
use crate::fill::settings::FillSettings;

/// A new cell costs an arc start or a link: as much as this many lines.
const CELL_IN_LINES: f64 = 4.0;

/// The angle of lines that turn from layer to layer, rad.
pub(crate) fn turning(first: f64, step: f64, layer: u32) -> f64 {
    (first + step * f64::from(layer.saturating_sub(1))).rem_euclid(PI)
}

/// The angle of the lines, rad, that suits the possible centres of beads best.
pub(crate) fn best(centres: &[Region], settings: &FillSettings) -> f64 {
    // directions of edges, by their length, in steps of 3°; each with the exact angle of its longest edge
    let mut lengths = BTreeMap::<u32, (f64, f64, f64)>::new();
    for (a, b) in centres.iter().flat_map(Region::rings).flat_map(edges) {
        let e = b - a;
        let length = e.length();
        let angle = (e.to_angle() + 1e-9).rem_euclid(PI) - 1e-9;
        let entry = lengths
            .entry((angle.max(0.0) * 60.0 / PI).round() as u32 % 60)
            .or_default();
        entry.0 += length;
        if length > entry.1 {
            (entry.1, entry.2) = (length, angle);
        }
    }
    let mut common: Vec<_> = lengths.into_values().collect();
    common.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.total_cmp(&b.2)));
    let candidates = common.iter().take(6).map(|&(_, _, angle)| angle).chain([
        0.0,
        0.25 * PI,
        0.5 * PI,
        0.75 * PI,
    ]);
    let mut best = (f64::INFINITY, 0.0);
    for angle in candidates {
        let lines = spans(&turned(centres, -angle), Rim::Boundary, settings);
        let count: usize = lines.iter().map(Vec::len).sum();
        if count == 0 {
            continue;
        }
        let cost = count as f64 + CELL_IN_LINES * cells(&lines).len() as f64;
        if cost < best.0 - 1e-9 {
            best = (cost, angle);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec2;

    #[test]
    fn of_directions_as_good_the_first_is_kept() {
        let corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]];
        let square = Region {
            outer: corners.map(DVec2::from_array).to_vec(),
            holes: Vec::new(),
        };
        assert_eq!(best(&[square], &FillSettings::new(4.0, 3.0)), 0.0);
    }

    #[test]
    fn lines_follow_the_longest_of_edges_that_run_alike() {
        // two long edges within a degree of each other, the longer one turned by 20°
        let turned = |degrees: f64, by: f64| DVec2::from_angle(f64::to_radians(degrees)) * by;
        let [a, b] = [turned(20.0, 60.0), turned(20.0, 60.0) + turned(110.0, 9.0)];
        let corners = vec![DVec2::ZERO, a, b, b - turned(20.8, 40.0)];
        let region = Region {
            outer: corners,
            holes: Vec::new(),
        };
        let found = best(&[region], &FillSettings::new(4.0, 3.0));
        assert!((found.to_degrees() - 20.0).abs() < 1e-9, "{found}");
    }
}
