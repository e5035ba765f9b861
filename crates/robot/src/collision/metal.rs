//! Metal as columns or as solid bodies, and how near a segment comes to any of them.

use std::sync::Arc;

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::workpiece::HeightMap;

use super::distance::Bounds;
use super::form::Form;
use super::solids::Solids;

/// Columns that are nearer by less are as far but for rounding, mm.
const SAME: f64 = 1e-10;

/// Metal as it stands at some time.
#[derive(Debug, Clone)]
pub struct Metal(Kind);

#[derive(Debug, Clone)]
enum Kind {
    /// Laid from above, layer by layer: down to the plate.
    Columns(Columns),
    /// Laid from any side: what is there up to a time.
    Solids(Arc<Solids>, u32),
}

impl Metal {
    /// The metal of a height map in columns about `side` mm wide.
    pub fn of(map: &HeightMap, side: f64) -> Self {
        Metal(Kind::Columns(Columns::of(map, side)))
    }

    /// What of solid bodies is there at a time.
    pub fn until(solids: &Arc<Solids>, time: u32) -> Self {
        Metal(Kind::Solids(Arc::clone(solids), time))
    }

    /// The distance of a body from the metal, mm, where it is less than `most`; else no less than `most`. Columns go down to `foot`.
    pub(super) fn distance(&self, form: &Form<'_>, most: f64, foot: f64) -> f64 {
        form.nearest_piece(most, |form, most| match &self.0 {
            Kind::Columns(columns) => columns.distance(form, most, foot),
            Kind::Solids(solids, time) => solids.distance(form, *time, most),
        })
    }
}

/// Columns over a plate, each as high as the highest metal on it: coarse ones over fine ones.
///
/// Structure: level 0 has one column for each square of cells, each further level one for four of the level before.
#[derive(Debug, Clone, PartialEq)]
struct Columns {
    /// The least corner, mm.
    origin: DVec2,
    /// Side of a column of level 0, mm.
    cell: f64,
    levels: Vec<Level>,
}

#[derive(Debug, Clone, PartialEq)]
struct Level {
    nx: usize,
    ny: usize,
    z: Vec<f32>,
}

impl Level {
    /// Columns of `side` x `side` of what `height` tells of `nx` x `ny`.
    fn of(nx: usize, ny: usize, side: usize, height: impl Fn(usize, usize) -> f32) -> Self {
        let (columns, rows) = (nx.div_ceil(side), ny.div_ceil(side));
        let mut z = vec![f32::NEG_INFINITY; columns * rows];
        for iy in 0..ny {
            for ix in 0..nx {
                let column = &mut z[iy / side * columns + ix / side];
                *column = column.max(height(ix, iy));
            }
        }
        Level {
            nx: columns,
            ny: rows,
            z,
        }
    }
}

impl Columns {
    /// The metal of a height map in columns about `side` mm wide.
    fn of(map: &HeightMap, side: f64) -> Self {
        let cells = ((side / map.cell).round() as usize).max(1);
        // rounding up: a column is never lower than its metal
        let height = |ix: usize, iy: usize| (map.z[map.index(ix, iy)] as f32).next_up();
        let mut levels = vec![Level::of(map.nx, map.ny, cells, height)];
        while let Some(last) = levels.last()
            && last.z.len() > 1
        {
            let next = Level::of(last.nx, last.ny, 2, |ix, iy| last.z[iy * last.nx + ix]);
            levels.push(next);
        }
        Columns {
            origin: map.origin - DVec2::splat(0.5 * map.cell),
            cell: cells as f64 * map.cell,
            levels,
        }
    }

    /// The distance of a body from the metal down to `foot`, mm, where it is less than `most`; else no less than `most`.
    fn distance(&self, form: &Form<'_>, most: f64, foot: f64) -> f64 {
        match self.levels.len().checked_sub(1) {
            Some(top) => match self.column(top, (0, 0), foot) {
                Some(all) => self.below((form, foot), most, top, (0, 0), form.nearly_to(all, most)),
                None => most,
            },
            None => most,
        }
    }

    /// The column of a level at a place down to `foot`; nothing beyond the plate.
    fn column(&self, level: usize, (ix, iy): (usize, usize), foot: f64) -> Option<Bounds> {
        let of = &self.levels[level];
        if ix >= of.nx || iy >= of.ny {
            return None;
        }
        let side = self.cell * (1_u64 << level) as f64;
        let corner = self.origin + side * DVec2::new(ix as f64, iy as f64);
        let top = f64::from(of.z[iy * of.nx + ix]);
        Some(Bounds {
            low: corner.extend(foot),
            high: DVec3::new(corner.x + side, corner.y + side, top.max(foot)),
        })
    }

    /// The distance from what stands within a column, whose own is `least` or more.
    fn below(
        &self,
        (form, foot): (&Form<'_>, f64),
        most: f64,
        level: usize,
        (ix, iy): (usize, usize),
        least: f64,
    ) -> f64 {
        // of many columns as far, such as those under a nozzle, one is looked at
        if least >= most - SAME {
            return most;
        }
        if level == 0 && form.is_exact() {
            return least;
        }
        if level == 0 {
            let exact = self.column(0, (ix, iy), foot).map(|c| form.to_box(c, most));
            return exact.map_or(most, |exact| most.min(exact));
        }
        let child = |x: usize, y: usize| {
            let place = (2 * ix + x, 2 * iy + y);
            let column = self.column(level - 1, place, foot);
            let least = column.map_or(f64::INFINITY, |bounds| match form.at_least_to(&bounds) {
                far if far >= most => far,
                _ => form.nearly_to(bounds, most),
            });
            (place, least)
        };
        // the nearest first: the others are then often too far
        let mut children = [child(0, 0), child(1, 0), child(0, 1), child(1, 1)];
        children.sort_by(|a, b| a.1.total_cmp(&b.1));
        children.into_iter().fold(most, |most, (place, least)| {
            self.below((form, foot), most, level - 1, place, least)
        })
    }
}

#[cfg(test)]
mod tests {
    use meltpath_numerics::random::Random;

    use super::super::distance::Segment;
    use super::super::round::{Ends, Round};
    use super::*;

    /// Against every cell's own column.
    #[test]
    fn the_nearest_column_is_found() {
        let mut random = Random::new(11);
        let mut map = HeightMap::new(DVec2::new(-20.0, -5.0), DVec2::new(23.0, 31.0), 1.0, 0.0)
            .unwrap_or_else(|e| panic!("{e}"));
        for z in &mut map.z {
            *z = random.between(0.0, 12.0);
        }
        let metal = Metal::of(&map, 1.0);
        for _ in 0..300 {
            let mut point = |low: f64| {
                DVec3::new(
                    random.between(-40.0, 40.0),
                    random.between(-40.0, 40.0),
                    random.between(low, 60.0),
                )
            };
            let segment = Segment {
                a: point(-9.0),
                b: point(-9.0),
            };
            let mut wanted = f64::INFINITY;
            for iy in 0..map.ny {
                for ix in 0..map.nx {
                    let centre = map.centre(ix, iy);
                    let bounds = Bounds {
                        low: (centre - DVec2::splat(0.5)).extend(f64::NEG_INFINITY),
                        high: (centre + DVec2::splat(0.5)).extend(map.z[map.index(ix, iy)]),
                    };
                    wanted = wanted.min(bounds.to_segment(&segment));
                }
            }
            let thin = Form::Round(Round {
                line: segment,
                radius: 0.0,
                ends: Ends::Round,
            });
            let found = metal.distance(&thin, 1e9, f64::NEG_INFINITY);
            assert!((found - wanted).abs() < 1e-5, "{found} {wanted}");
            let half = metal.distance(&thin, 0.5 * wanted, f64::NEG_INFINITY);
            assert!(half >= 0.5 * wanted);
            // a line that is wholly under the foot is as far from it as it lies under it, or farther
            let under = segment.a.z.max(segment.b.z) + 1.5;
            if under < 0.0 {
                assert!(metal.distance(&thin, 1e9, under) >= 1.5 - 1e-9);
            }
        }
    }
}
