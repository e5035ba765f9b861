//! A bead levels on what it lands on: equilibrium of the molten zone, solved as the pool moves on.
//!
//! The surface z of the melt minimises
//!
//! > E = ∫ ½ φ² + ½ ℓ² |∇φ|²,   φ = z + k·r²,
//!
//! over the molten zone, above the solid it lies on, with the volume that was fed. r is the distance to the line the
//! pool's centre has travelled since the arc start and k = 4h/w² = 6A/w³ the curvature of the bead on a plate, so that:
//!
//! - on a plate φ is constant: the bead is the parabola of the process map, with round ends;
//! - on its own kind it adds a constant thickness between its free edges: a wall;
//! - beside a bead it fills the valley and wets the neighbour over the length ℓ: a fillet.
//!
//! ℓ is the one number that is not in the process map; it is identified on the carpets of Rouchon 2022, table 4.3
//! (single layers of four beads), never on the walls. Free edges stand at 0.9 of the half width, as measured on the thin
//! wall (thesis §4.4). The thesis puts the edges of thick walls at the whole half width, by hypothesis; with that, the edge
//! beads of the raster wall would lie 16.7 mm from the contact tube at layer 25, where it measured 12 to 15 mm for all
//! beads (15.2 mm with 0.9). A height map holds one height per place: an edge that crosses a cell is kept as a covered
//! share of the cell over its foot.
//!
//! Assumptions: no remelting below the surface found by the pool; the whole pool is at one pressure; it freezes as it is
//! when the trailing end passes, or when the arc stops. Source of the frame: Rouchon 2022, §2.1.3, §4.4 and its
//! perspective of a numerical capillary equilibrium; the functional is ours.

mod handover;
mod relaxing;

use meltpath_geometry::math::DVec2;
use meltpath_geometry::workpiece::HeightMap;
use serde::{Deserialize, Serialize};

use super::Station;

/// Parameters of the levelling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Levelling {
    /// Where a free edge stands, over half the width of the bead on a plate: the width of a wall of single beads over that
    /// of its first (Rouchon 2022, §4.4: 0.9).
    pub wall_ratio: f64,
    /// Length ℓ over which the melt wets a neighbour, mm, from the carpets of table 4.3.
    pub wetting_length: f64,
    /// Drop below the ground under the centre line, in bead heights, from which ground does not support the melt:
    /// more than the valleys between beads, less than the flank of a crest (0.81 at 0.9 of its width).
    pub support: f64,
    /// Drop, in bead heights, that the melt does not run down: the bead hangs over.
    pub cliff: f64,
    /// Travel between two solutions, mm.
    pub step: f64,
    /// Largest move of a column in one sweep of the relaxation, in bead heights, at which the melt is in balance where the wetting
    /// length spans two and a half cells; by the square less on finer grids.
    pub settled: f64,
}

impl Default for Levelling {
    fn default() -> Self {
        Levelling {
            wall_ratio: 0.9,
            wetting_length: 1.25,
            support: 0.5,
            cliff: 2.0,
            step: 0.3,
            settled: 0.017,
        }
    }
}

/// The bead being laid, at the pool's present place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LocalBead {
    /// Half the width on a plate, mm.
    pub(crate) half_width: f64,
    /// Height on a plate, mm.
    pub(crate) height: f64,
    /// Length of the molten zone behind the centre, mm.
    pub(crate) rear: f64,
}

/// A cell crossed by a free edge: `cover` of it is wall, the rest stands at `foot`.
#[derive(Debug, Clone, Copy)]
struct EdgeCell {
    cover: f64,
    foot: f64,
}

/// What pulls the surface of a column: its four neighbours' slots and their weights; the weight of the level; the sum of all
/// weights. Weights are over that sum, times the over-relaxation.
#[derive(Debug, Clone, Copy)]
struct Pull {
    near: [u32; 4],
    weight: [f64; 4],
    level: f64,
    sum: f64,
}

const NONE: u32 = u32::MAX;
/// Least share of a cell that is kept as wall.
const LEAST_COVER: f64 = 0.02;
/// What the trailing end left in a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Frozen {
    /// The cell.
    pub(crate) cell: usize,
    /// Solid below and surface above, mm.
    pub(crate) floor: f64,
    pub(crate) top: f64,
    /// Share of the cell that the metal covers.
    pub(crate) cover: f64,
}

/// What one step saw.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct StepReport {
    /// The bead hangs out by more than a quarter of its width.
    pub(crate) hangs: bool,
    /// Volume that found no cell at all, mm³.
    pub(crate) lost: f64,
}

/// The molten zone: the cells it holds, as columns.
#[derive(Debug, Default)]
pub(crate) struct MoltenZone {
    slot_of: Vec<u32>,
    edge_of: Vec<u32>,
    edges: Vec<EdgeCell>,
    cell: Vec<u32>,
    distance: Vec<f64>,
    station: Vec<f64>,
    psi: Vec<f64>,
    floor: Vec<f64>,
    top: Vec<f64>,
    cover: Vec<f64>,
    foot: Vec<f64>,
    /// While it relaxes: φ of the surface and of the solid below, what pulls, and the columns without melt.
    phi: Vec<f64>,
    bed: Vec<f64>,
    pulls: Vec<Pull>,
    dry: Vec<u32>,
    /// The slots as they are swept, and those of the second colour while they are sorted out.
    order: Vec<u32>,
    other: Vec<u32>,
    /// Columns with metal that froze since the last step began.
    pub(crate) frozen: Vec<Frozen>,
    /// φ of the pool, mm: equals the height of its crest on a plate.
    level: f64,
}

impl MoltenZone {
    pub(crate) fn new(map: &HeightMap) -> Self {
        MoltenZone {
            slot_of: vec![NONE; map.z.len()],
            edge_of: vec![NONE; map.z.len()],
            ..MoltenZone::default()
        }
    }

    /// Surface under a cell before this bead: the solid where the cell is molten.
    fn ground(&self, map: &HeightMap, i: usize) -> f64 {
        match self.slot_of[i] {
            NONE => map.z[i],
            slot => {
                let s = slot as usize;
                self.cover[s] * self.floor[s] + (1.0 - self.cover[s]) * self.foot[s]
            }
        }
    }

    /// The same at a point, bilinear between cell centres, the plate outside the map.
    pub(crate) fn ground_at(&self, map: &HeightMap, p: DVec2) -> f64 {
        map.height_of(p, |i| self.ground(map, i))
    }

    /// Moves the pool's centre from `from` to `to`, adds `volume` mm³ and finds the new surface.
    pub(crate) fn step(
        &mut self,
        map: &mut HeightMap,
        model: &Levelling,
        bead: &LocalBead,
        from: &Station,
        to: &Station,
        volume: f64,
    ) -> StepReport {
        self.frozen.clear();
        self.reheat(map, to, bead);
        self.retire(to.travelled - bead.rear);
        let reference = self.ground_at(map, to.centre);
        if self.cell.is_empty() {
            self.level = reference - to.rise;
        }
        let side = bead.half_width * to.heading.perp();
        let reach = bead.half_width * model.wall_ratio;
        let void = |p: DVec2| reference - self.ground_at(map, p) > model.cliff * bead.height;
        let hangs = void(to.centre + 0.5 * side) || void(to.centre - 0.5 * side);
        // melt with too little to stand on runs down the cliff instead of piling up
        let overfull = self.level - (reference - to.rise) > 2.5 * bead.height;
        let cliff = if overfull { f64::INFINITY } else { model.cliff };
        self.touch(
            map,
            model,
            bead,
            (from, to),
            (reference, reach, cliff * bead.height),
        );
        let lost = if self.cell.is_empty() {
            let cliff = f64::INFINITY;
            self.touch(
                map,
                model,
                bead,
                (from, to),
                (reference, bead.half_width, cliff),
            );
            if self.cell.is_empty() { volume } else { 0.0 }
        } else {
            0.0
        };
        if lost == 0.0 {
            self.relax(map, model, bead, volume);
        }
        StepReport { hangs, lost }
    }

    /// Takes in the cells that the pool reaches on its way, and tells those it holds their nearer distance.
    fn touch(
        &mut self,
        map: &HeightMap,
        model: &Levelling,
        bead: &LocalBead,
        (from, to): (&Station, &Station),
        (reference, reach, cliff): (f64, f64, f64),
    ) {
        let k = bead.height / (bead.half_width * bead.half_width);
        let way = to.centre - from.centre;
        let way2 = way.length_squared();
        let margin = DVec2::splat(bead.half_width.max(reach) + map.cell);
        let (columns, rows) = map.cells_within(
            from.centre.min(to.centre) - margin,
            from.centre.max(to.centre) + margin,
        );
        for iy in rows {
            for ix in columns.clone() {
                let p = map.centre(ix, iy);
                let t = if way2 > 0.0 {
                    ((p - from.centre).dot(way) / way2).clamp(0.0, 1.0)
                } else {
                    1.0
                };
                let off = p - (from.centre + t * way);
                let distance = off.length();
                if distance > bead.half_width + map.cell {
                    continue;
                }
                let i = iy * map.nx + ix;
                let slot = self.slot_of[i];
                let station = from.travelled + t * (to.travelled - from.travelled);
                let lift = from.rise + t * (to.rise - from.rise);
                if slot != NONE && self.distance[slot as usize] <= distance {
                    continue;
                }
                let edge = self.edge_of[i];
                let standing = if slot != NONE {
                    self.floor[slot as usize]
                } else if edge != NONE {
                    let e = self.edges[edge as usize];
                    (map.z[i] - (1.0 - e.cover) * e.foot) / e.cover
                } else {
                    map.z[i]
                };
                let drop = (reference - to.rise) - (standing - lift);
                let cover = if drop <= model.support * bead.height {
                    f64::from(u8::from(distance <= bead.half_width))
                } else if drop > cliff {
                    0.0
                } else {
                    // width of the cell across the edge: exact for edges along the axes
                    let across = map.cell * (off.x.abs() + off.y.abs()) / distance.max(1e-300);
                    let across = if distance > 0.0 { across } else { map.cell };
                    ((reach - distance) / across + 0.5).clamp(0.0, 1.0)
                };
                if cover < LEAST_COVER {
                    continue;
                }
                let s = if slot == NONE {
                    self.take(map, i)
                } else {
                    slot as usize
                };
                self.widen(s, cover);
                self.distance[s] = distance;
                self.station[s] = station;
                self.psi[s] = k * distance * distance - lift;
            }
        }
    }

    /// A new slot for cell `i`, holding no melt yet.
    fn take(&mut self, map: &HeightMap, i: usize) -> usize {
        let s = self.cell.len();
        let (cover, foot) = match self.edge_of[i] {
            NONE => (0.0, map.z[i]),
            edge => {
                let e = self.edges[edge as usize];
                (e.cover, e.foot)
            }
        };
        let standing = if cover > 0.0 {
            (map.z[i] - (1.0 - cover) * foot) / cover
        } else {
            map.z[i]
        };
        self.slot_of[i] = s as u32;
        self.cell.push(i as u32);
        self.distance.push(f64::INFINITY);
        self.station.push(0.0);
        self.psi.push(0.0);
        self.floor.push(standing);
        self.top.push(standing);
        self.cover.push(cover);
        self.foot.push(foot);
        s
    }

    /// Lets the wall cover at least `cover` of the cell, keeping the volumes of metal and of melt.
    fn widen(&mut self, s: usize, cover: f64) {
        let old = self.cover[s];
        if cover <= old {
            return;
        }
        let (rest, foot) = (1.0 - cover, self.foot[s]);
        let mean = |top: f64| old * top + (1.0 - old) * foot;
        self.floor[s] = (mean(self.floor[s]) - rest * foot) / cover;
        self.top[s] = (mean(self.top[s]) - rest * foot) / cover;
        self.cover[s] = cover;
    }

    /// What is about to freeze but lies near the pool's centre stays molten as long as what is there: where the bead
    /// turns back on itself.
    fn reheat(&mut self, map: &HeightMap, to: &Station, bead: &LocalBead) {
        let stale = to.travelled - bead.rear;
        let reach = bead.half_width * bead.half_width;
        for s in 0..self.cell.len() {
            if self.station[s] < stale {
                let i = self.cell[s] as usize;
                let p = map.centre(i % map.nx, i / map.nx);
                if p.distance_squared(to.centre) <= reach {
                    self.station[s] = to.travelled;
                }
            }
        }
    }

    /// Freezes what the trailing end has passed, across the bead at once: cells nearest to stations before `until`.
    fn retire(&mut self, until: f64) {
        let mut kept = 0;
        for s in 0..self.cell.len() {
            let i = self.cell[s] as usize;
            if self.station[s] < until {
                self.freeze(s, i);
                continue;
            }
            if kept != s {
                self.cell[kept] = self.cell[s];
                self.distance[kept] = self.distance[s];
                self.station[kept] = self.station[s];
                self.psi[kept] = self.psi[s];
                self.floor[kept] = self.floor[s];
                self.top[kept] = self.top[s];
                self.cover[kept] = self.cover[s];
                self.foot[kept] = self.foot[s];
            }
            self.slot_of[i] = kept as u32;
            kept += 1;
        }
        self.cell.truncate(kept);
        self.distance.truncate(kept);
        self.station.truncate(kept);
        self.psi.truncate(kept);
        self.floor.truncate(kept);
        self.top.truncate(kept);
        self.cover.truncate(kept);
        self.foot.truncate(kept);
    }

    fn freeze(&mut self, s: usize, i: usize) {
        self.slot_of[i] = NONE;
        if self.top[s] > self.floor[s] {
            self.frozen.push(Frozen {
                cell: i,
                floor: self.floor[s],
                top: self.top[s],
                cover: self.cover[s],
            });
        }
        let entry = EdgeCell {
            cover: self.cover[s],
            foot: self.foot[s],
        };
        match (self.edge_of[i], entry.cover < 1.0) {
            (NONE, true) => {
                self.edge_of[i] = self.edges.len() as u32;
                self.edges.push(entry);
            }
            (edge, true) => self.edges[edge as usize] = entry,
            // a full cell needs no record; the old one, if any, is left unused
            (_, false) => self.edge_of[i] = NONE,
        }
    }

    /// The arc stops: everything freezes as it is.
    pub(crate) fn freeze_all(&mut self) {
        self.retire(f64::INFINITY);
    }
}

#[cfg(test)]
mod tests;
