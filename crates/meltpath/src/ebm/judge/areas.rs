//! Areas that melt outside a contour and in its holes, by parts of cells: a row of cells is not counted whole where the edge of the
//! pool, or the contour, goes through it.

use meltpath_geometry::boolean::{PlanarError, difference};
use meltpath_geometry::math::DVec2;
use meltpath_geometry::offset::{Join, inset, outset};
use meltpath_melt_strategy::part::Rectangle;
use meltpath_thermal::grid::Field;

use crate::ebm::plan::region::Contour;

/// A cell is looked at in so many parts each way.
const PARTS: usize = 4;
/// Most points in which a hole is looked at.
const MOST: f64 = 4e4;
/// Points that lie just as far as the rim are not beyond it, wherever the part lies, mm.
const ROUNDING: f64 = 1e-6;

/// Metal that is molten outside the contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outside {
    /// Area beyond the rim, as a share of the section's.
    pub share: f64,
    /// Greatest distance from the contour, mm.
    pub farthest: f64,
}

/// What is to stay free of metal within the outline of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hollow {
    /// A hole.
    Hole,
    /// A gap of the outline, open to the outside, so narrow that all of it lies within the rim.
    Gap,
}

/// A hole of the region, or a narrow gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hole {
    /// Which of both.
    pub kind: Hollow,
    /// Share of it that melts.
    pub share: f64,
    /// Its middle, mm.
    pub middle: [f64; 2],
}

/// The top plane of a field of highest temperatures.
struct Plane<'a> {
    field: &'a Field,
    top: usize,
    melting: f64,
}

impl<'a> Plane<'a> {
    fn of(field: &'a Field, melting: f64) -> Self {
        let top = field.grid.planes() - 1;
        Plane {
            field,
            top,
            melting,
        }
    }

    fn centre(&self, i: usize, j: usize) -> [f64; 2] {
        let c = self.field.grid.centre(i, j, self.top);
        [c.x, c.y]
    }

    /// Whether it melts at a place, straight between the middles of cells; beyond the field nothing does.
    fn melts(&self, point: [f64; 2]) -> bool {
        let grid = &self.field.grid;
        let origin = [grid.origin.x, grid.origin.y];
        let at = [0, 1].map(|a| (point[a] - origin[a]) / grid.edge[a]);
        if [0, 1]
            .iter()
            .any(|&a| at[a] < 0.0 || at[a] > grid.cells[a] as f64)
        {
            return false;
        }
        let near = |a: usize| {
            let x = (at[a] - 0.5).clamp(0.0, (grid.cells[a] - 1) as f64);
            let low = (x as usize).min(grid.cells[a].saturating_sub(2));
            (low, (low + 1).min(grid.cells[a] - 1), x - low as f64)
        };
        let ((i, east, x), (j, north, y)) = (near(0), near(1));
        let of = |i: usize, j: usize| self.field.at(i, j, self.top);
        let row = |j: usize| (1.0 - x) * of(i, j) + x * of(east, j);
        (1.0 - y) * row(j) + y * row(north) >= self.melting
    }

    /// Whether all of a cell and of those round it melt, or none does.
    fn evenly(&self, i: usize, j: usize) -> Option<bool> {
        let [nx, ny] = self.field.grid.cells;
        let melts = |i: usize, j: usize| self.field.at(i, j, self.top) >= self.melting;
        let own = melts(i, j);
        let mut round = (i.saturating_sub(1)..=(i + 1).min(nx - 1))
            .flat_map(|i| (j.saturating_sub(1)..=(j + 1).min(ny - 1)).map(move |j| (i, j)));
        round.all(|(i, j)| melts(i, j) == own).then_some(own)
    }
}

/// Middles of the parts of a cell.
fn parts(centre: [f64; 2], edge: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    (0..PARTS * PARTS).map(move |n| {
        let way =
            |k: usize, a: usize| centre[a] + edge[a] * ((k as f64 + 0.5) / PARTS as f64 - 0.5);
        [way(n % PARTS, 0), way(n / PARTS, 1)]
    })
}

/// What melts outside the contour, beyond `rim` mm of it or nearer, in the judged part; `section` is the area inside, mm².
pub(in crate::ebm) fn outside(
    highest: &Field,
    melting: f64,
    contour: &Contour,
    rim: f64,
    part: Option<&Rectangle>,
    section: f64,
) -> Outside {
    let plane = Plane::of(highest, melting);
    let [nx, ny] = highest.grid.cells;
    let edge = [highest.grid.edge[0], highest.grid.edge[1]];
    // as far as the corners of a cell are from its middle
    let corner = 0.5 * edge[0].hypot(edge[1]);
    let (mut area, mut farthest) = (0.0, 0.0_f64);
    let within = |point: [f64; 2]| part.is_none_or(|part| part.depth(point) > 0.0);
    for n in 0..nx * ny {
        let (i, j) = (n % nx, n / nx);
        let evenly = plane.evenly(i, j);
        if evenly == Some(false) {
            continue;
        }
        let centre = plane.centre(i, j);
        let away = -contour.depth(centre);
        if away < -corner {
            continue;
        }
        // deep in the pool nothing is farthest, and a cell is counted whole
        let deep = evenly.is_some() && away > rim + corner && within(centre);
        if deep && away + corner < farthest {
            area += edge[0] * edge[1];
            continue;
        }
        for point in parts(centre, edge).filter(|p| within(*p)) {
            if evenly.is_none() && !plane.melts(point) {
                continue;
            }
            let away = -contour.depth(point);
            farthest = farthest.max(away);
            if away > rim + ROUNDING {
                area += edge[0] * edge[1] / (PARTS * PARTS) as f64;
            }
        }
    }
    Outside {
        share: area / section,
        farthest,
    }
}

/// Gaps that are narrower than this in the mean are roundings of the outline, mm.
const NARROWEST: f64 = 5e-3;
/// Corners are prolonged so many rims at most: what is cut off of sharper ones lies outside of the section.
const MITER: f64 = 4.0;

/// The holes of a contour, and the gaps of its outline that close where it grows by `rim` mm and shrinks back: what melts in them lies
/// within the rim, and nothing else counts it.
pub(in crate::ebm) fn hollows(contour: &Contour, rim: f64) -> Vec<(Hollow, Contour)> {
    let holes = contour.holes().map(|hole| (Hollow::Hole, hole));
    let mut found: Vec<_> = holes.collect();
    // an outline that is no region has no gaps that could be told
    found.extend(gaps(contour, rim).unwrap_or_default());
    found
}

fn gaps(contour: &Contour, rim: f64) -> Result<Vec<(Hollow, Contour)>, PlanarError> {
    if rim <= 0.0 {
        return Ok(Vec::new());
    }
    let join = Join::Miter { limit: MITER };
    let section = [contour.region()];
    let closed = inset(&outset(&section, rim, join)?, rim, join)?;
    let mut filled = section.to_vec();
    filled.extend(contour.holes().map(|hole| hole.region()));
    let gaps = difference(&closed, &filled)?.into_iter().filter(|gap| {
        let round: f64 = gap.rings().map(|ring| perimeter(ring)).sum();
        2.0 * gap.area() > NARROWEST * round
    });
    let gaps = gaps.map(|gap| (Hollow::Gap, Contour::of(&gap)));
    Ok(gaps.collect())
}

fn perimeter(ring: &[DVec2]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| a.distance(*b)).sum()
}

/// The hole or gap of a contour of which most melts, in the judged part; `None` where none lies there.
pub(in crate::ebm) fn fullest_hole(
    highest: &Field,
    melting: f64,
    hollows: &[(Hollow, Contour)],
    part: Option<&Rectangle>,
) -> Option<Hole> {
    let plane = Plane::of(highest, melting);
    let finest = highest.grid.edge[0].min(highest.grid.edge[1]) / PARTS as f64;
    let holes = hollows.iter().filter_map(|(kind, hole)| {
        let [low, high] = hole.bounds();
        let size = [0, 1].map(|a| high[a] - low[a]);
        // a narrow hole in at least as many parts as a cell
        let step = finest
            .min(size[0].min(size[1]) / PARTS as f64)
            .max((size[0] * size[1] / MOST).sqrt());
        let count = size.map(|s| (s / step).ceil().max(1.0) as usize);
        let (mut all, mut molten, mut middle) = (0_u32, 0_u32, [0.0; 2]);
        for n in 0..count[0] * count[1] {
            let at = [n % count[0], n / count[0]];
            let point = [0, 1].map(|a| low[a] + (at[a] as f64 + 0.5) * size[a] / count[a] as f64);
            let judged = part.is_none_or(|part| part.depth(point) > 0.0);
            if judged && hole.depth(point) > 0.0 {
                all += 1;
                molten += u32::from(plane.melts(point));
                middle = [0, 1].map(|a| middle[a] + point[a]);
            }
        }
        (all > 0).then(|| Hole {
            kind: *kind,
            share: f64::from(molten) / f64::from(all),
            middle: middle.map(|sum| sum / f64::from(all)),
        })
    });
    holes.max_by(|a, b| a.share.total_cmp(&b.share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use meltpath_geometry::math::DVec3;
    use meltpath_thermal::grid::Grid;

    /// Temperatures that fall evenly with the distance from the origin along x, by 1000 K a millimetre from 2600 K.
    fn wedge(cell: f64) -> Field {
        let edge = DVec3::new(cell, cell, 0.1);
        let grid = Grid::covering(DVec3::new(-2.0, -1.5, 0.0), DVec3::new(2.0, 1.5, 0.1), edge);
        let grid = grid.unwrap();
        let values = (0..grid.len())
            .map(|n| grid.centre(n % grid.cells[0], n / grid.cells[0], 0))
            .map(|c| (2600.0 - 1000.0 * c.x.abs()) as f32)
            .collect();
        Field { grid, values }
    }

    /// A strip of 0.06 mm: 0.6 mm each side melt, so that 0.47 mm lie beyond the rim; whatever the cells.
    #[test]
    fn what_melts_beside_a_strip_narrower_than_cells_is_counted_by_parts_of_cells() {
        let strip = Contour::rectangle([0.06, 2.0]);
        for cell in [0.03, 0.06, 0.1] {
            let found = outside(&wedge(cell), 2000.0, &strip, 0.1, None, 0.12);
            // beyond its ends, too, where the field ends 0.5 mm away
            let beyond = 2.0 * 3.0 * 0.6 - 2.0 * 2.0 * 0.13;
            let ends = 2.0 * (2.0 * 0.13 * 0.1);
            let share = (beyond - ends) / 0.12;
            assert!(
                (found.share / share - 1.0).abs() < 0.04,
                "{cell}: {found:?} {share}"
            );
        }
        let found = outside(
            &wedge(0.03),
            2000.0,
            &Contour::rectangle([0.06, 9.0]),
            0.1,
            None,
            0.54,
        );
        assert!((found.farthest - 0.57).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn the_hole_of_which_most_melts_is_told_with_its_place() {
        let slot = |x: f64| vec![[x, -0.5], [x + 0.2, -0.5], [x + 0.2, 0.5], [x, 0.5]];
        let plate = Contour::rectangle([3.6, 2.8]);
        let fullest = |contour: &Contour, part: Option<&Rectangle>| {
            fullest_hole(&wedge(0.05), 2000.0, &hollows(contour, 0.1), part)
        };
        assert_eq!(fullest(&plate, None), None);
        let plate = plate.with_holes(vec![slot(1.2), slot(0.55), slot(-1.0)]);
        let found = fullest(&plate, None).unwrap();
        assert!((found.share - 0.25).abs() < 0.05, "{found:?}");
        assert!((found.middle[0] - 0.65).abs() < 0.01 && found.middle[1].abs() < 0.01);
        let left = Rectangle {
            low: [-2.0, -2.0],
            high: [0.0, 2.0],
        };
        let found = fullest(&plate, Some(&left)).unwrap();
        assert!(found.share < 0.01 && (found.middle[0] + 0.9).abs() < 0.01);
        // beyond what is kept nothing melts
        let far = Contour::rectangle([30.0, 30.0]).with_holes(vec![slot(9.0)]);
        assert_eq!(fullest(&far, None).unwrap().share, 0.0);
    }

    /// A slit in from the edge is as much a hollow as a hole of the same shape; corners, wide gaps and round ones are none.
    #[test]
    fn a_narrow_gap_of_the_outline_counts_like_a_hole() {
        let notched = |half: f64| {
            Contour::new(vec![
                [-1.5, -1.0],
                [1.5, -1.0],
                [1.5, 1.0],
                [half, 1.0],
                [half, 0.0],
                [-half, 0.0],
                [-half, 1.0],
                [-1.5, 1.0],
            ])
        };
        let slit = hollows(&notched(0.06), 0.1);
        assert!(slit.len() == 1 && slit[0].0 == Hollow::Gap, "{slit:?}");
        assert!((slit[0].1.region().area() - 0.12).abs() < 1e-3);
        let found = fullest_hole(&wedge(0.05), 2000.0, &slit, None).unwrap();
        assert!(found.share > 0.99 && found.kind == Hollow::Gap);
        assert!(found.middle[0].abs() < 0.01 && (found.middle[1] - 0.5).abs() < 0.01);
        // what lies farther than the rim from any contour counts as molten outside
        assert_eq!(hollows(&notched(0.11), 0.1), []);
        assert_eq!(hollows(&notched(0.06), 0.0), []);
        let round: Vec<[f64; 2]> = (0..200)
            .map(|n| std::f64::consts::TAU * f64::from(n) / 200.0)
            .map(|a| (1.0 + 0.2 * (5.0 * a).cos()) * DVec2::new(a.cos(), a.sin()))
            .map(|p| p.to_array())
            .collect();
        assert_eq!(hollows(&Contour::new(round), 0.1), []);
    }
}
