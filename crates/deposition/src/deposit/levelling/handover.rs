//! What a molten zone takes from a surface that was read elsewhere, and what it hands over to a zone in another frame.

use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::{Column, HeightMap};

use super::{EdgeCell, Levelling, LocalBead, MoltenZone, NONE};
use crate::deposit::Station;

impl MoltenZone {
    /// Books a column that was read: its height, and its foot where an edge crosses it.
    pub(crate) fn book(&mut self, map: &mut HeightMap, i: usize, column: &Column) {
        map.z[i] = column.cover * column.top + (1.0 - column.cover) * column.foot;
        if column.cover < 1.0 {
            self.edge_of[i] = self.edges.len() as u32;
            self.edges.push(EdgeCell {
                cover: column.cover,
                foot: column.foot,
            });
        }
    }

    /// Goes on with a pool of another zone: its melt of `volume` mm³ lies along `trail`, with the `surface` that it had.
    pub(crate) fn resume(
        &mut self,
        map: &mut HeightMap,
        (model, bead): (&Levelling, &LocalBead),
        trail: &[Station],
        surface: impl Fn(DVec2, f64) -> Option<f64>,
        (volume, level): (f64, f64),
    ) {
        self.level = level;
        for w in trail.windows(2) {
            let (from, to) = (&w[0], &w[1]);
            let reference = self.ground_at(map, to.centre);
            let reach = bead.half_width * model.wall_ratio;
            let cliff = model.cliff * bead.height;
            self.touch(map, model, bead, (from, to), (reference, reach, cliff));
        }
        for s in 0..self.cell.len() {
            let i = self.cell[s] as usize;
            let p = map.centre(i % map.nx, i / map.nx);
            let floor = self.floor[s];
            self.top[s] = surface(p, floor).map_or(floor, |z| z.max(floor));
        }
        if !self.cell.is_empty() {
            self.close(volume / (map.cell * map.cell));
        }
        self.show(map);
    }

    /// Melt in the zone, mm³, and its level.
    pub(crate) fn melt(&self, map: &HeightMap) -> (f64, f64) {
        (self.held() * map.cell * map.cell, self.level)
    }

    /// Whether there is no molten column.
    pub(crate) fn is_empty(&self) -> bool {
        self.cell.is_empty()
    }

    /// Surface of the melt at a point, between the centres of the molten cells about it; `None` where there is none.
    pub(crate) fn surface_at(&self, map: &HeightMap, p: DVec2) -> Option<f64> {
        let g = (p - map.origin) / map.cell;
        let low = g.floor();
        let t = g - low;
        let (mut sum, mut weight) = (0.0, 0.0);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let at = low + DVec2::new(dx, dy);
            if at.x < 0.0 || at.y < 0.0 || at.x >= map.nx as f64 || at.y >= map.ny as f64 {
                continue;
            }
            let slot = self.slot_of[map.index(at.x as usize, at.y as usize)];
            let w = (1.0 - (t.x - dx).abs()) * (1.0 - (t.y - dy).abs());
            if slot != NONE && w > 0.0 {
                sum += w * self.top[slot as usize];
                weight += w;
            }
        }
        (weight > 0.0).then(|| sum / weight)
    }
}
