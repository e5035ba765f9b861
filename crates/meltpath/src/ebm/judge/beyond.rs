//! What of a section lies beyond the field that the solver keeps round the path: no heat gets there that melts.

use meltpath_geometry::Region;
use meltpath_geometry::math::DVec2;
use meltpath_geometry::raster::{Grid as Raster, rasterise};
use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::grid::Grid;

use crate::ebm::plan::region::{Below, Contour};

/// Most cells in which areas are counted: 0.1 % of a round section.
const MOST: f64 = 4e6;

/// Cells of the area of `far` mm².
pub(super) fn cells_beyond(grid: &Grid, far: f64) -> usize {
    (far / (grid.edge[0] * grid.edge[1])).round() as usize
}

/// Area that lies deeper than `inside` in the contour, within the part where there is one, over metal where `below` is told, and beyond
/// the edges of `grid`, mm².
pub(super) fn area_beyond(
    grid: &Grid,
    contour: &Contour,
    inside: f64,
    part: Option<&Rectangle>,
    below: Option<&Below>,
) -> f64 {
    let edges = Rectangle {
        low: [grid.origin.x, grid.origin.y],
        high: [0, 1].map(|a| grid.origin.to_array()[a] + grid.cells[a] as f64 * grid.edge[a]),
    };
    counted(
        contour,
        inside,
        part,
        below,
        (Some(&edges), grid.edge[0].min(grid.edge[1])),
    )
}

/// Area of the contour, within the part where there is one, mm².
pub(super) fn area_within(contour: &Contour, part: Option<&Rectangle>) -> f64 {
    match part {
        None => contour.region().area(),
        Some(_) => counted(contour, 0.0, part, None, (None, 0.0)),
    }
}

/// Area that lies deeper than `inside` in the contour, within the part, over metal and beyond `kept` where these are told, in cells no
/// finer than `finest`, mm².
fn counted(
    contour: &Contour,
    inside: f64,
    part: Option<&Rectangle>,
    below: Option<&Below>,
    (kept, finest): (Option<&Rectangle>, f64),
) -> f64 {
    let beyond = |point: [f64; 2]| kept.is_none_or(|kept| kept.depth(point) < 0.0);
    let [low, high] = contour.bounds();
    let wanted = Rectangle {
        low: [0, 1].map(|a| part.map_or(low[a], |p| p.low[a].max(low[a]))),
        high: [0, 1].map(|a| part.map_or(high[a], |p| p.high[a].min(high[a]))),
    };
    let size = [0, 1].map(|a| wanted.high[a] - wanted.low[a]);
    let covered = kept.is_some_and(|k| k.depth(wanted.low).min(k.depth(wanted.high)) >= 0.0);
    if covered || size[0].min(size[1]).is_nan() || size[0].min(size[1]) <= 0.0 {
        return 0.0;
    }
    let cell = finest.max((size[0] * size[1] / MOST).sqrt());
    let raster = Raster {
        origin: DVec2::from_array(wanted.low) + 0.5 * cell,
        cell,
        nx: (size[0] / cell).ceil() as usize,
        ny: (size[1] / cell).ceil() as usize,
    };
    let section = rasterise(&[contour.region()], &raster);
    let metal: Option<Vec<Region>> = below.and_then(Below::regions);
    let metal = metal.map(|areas| rasterise(&areas, &raster));
    let counts = |&(ix, iy): &(usize, usize)| {
        let centre = (raster.origin + DVec2::new(ix as f64, iy as f64) * cell).to_array();
        beyond(centre)
            && wanted.depth(centre) > 0.0
            && metal.as_ref().is_none_or(|m| m.contains(ix, iy))
            && (inside <= 0.0 || contour.depth(centre) > inside)
    };
    section.cells().filter(counts).count() as f64 * cell * cell
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;

    #[test]
    fn what_the_field_leaves_out_is_counted() {
        let edge = DVec3::new(0.05, 0.05, 0.1);
        let grid = Grid::covering(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.1), edge);
        let grid = grid.unwrap();
        // a strip of 3 by 40 mm, of which 2 by 2 mm are kept
        let strip = Contour::rectangle([3.0, 40.0]);
        let far = area_beyond(&grid, &strip, 0.0, None, None);
        assert!((far - 116.0).abs() < 0.2, "{far}");
        assert_eq!(cells_beyond(&grid, 116.0), 46_400);
        let part = Rectangle {
            low: [-1.5, 0.0],
            high: [1.5, 2.0],
        };
        let far = area_beyond(&grid, &strip, 0.0, Some(&part), None);
        assert!((far - 4.0).abs() < 0.1, "{far}");
        // over metal that lies under one half alone, and over powder
        let half = Contour::new(vec![[0.0, -30.0], [9.0, -30.0], [9.0, 30.0], [0.0, 30.0]]);
        let far = area_beyond(&grid, &strip, 0.0, None, Some(&Below::Areas(vec![half])));
        assert!((far - 58.0).abs() < 0.2, "{far}");
        let powder = Below::Areas(Vec::new());
        assert_eq!(area_beyond(&grid, &strip, 0.0, None, Some(&powder)), 0.0);
        assert_eq!(
            area_beyond(&grid, &strip, 0.0, None, Some(&Below::Metal)),
            area_beyond(&grid, &strip, 0.0, None, None)
        );
        let deep = area_beyond(&grid, &strip, 0.5, None, None);
        assert!((deep - 2.0 * 37.0).abs() < 0.3, "{deep}");
        // within the field nothing is left out
        assert_eq!(
            area_beyond(&grid, &Contour::rectangle([2.0, 2.0]), 0.0, None, None),
            0.0
        );
    }
}
