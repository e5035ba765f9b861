//! The surface of the molten zone: relaxed towards balance, its volume closed exactly.

use meltpath_geometry::workpiece::HeightMap;
use meltpath_numerics::halving::halve;

use super::{Levelling, LocalBead, MoltenZone, NONE, Pull};

/// Over-relaxation: measured best of 1.2 to 1.8 on cells of 0.25 to 0.5 mm; the level, found anew before each sweep, asks for less
/// than the best of a field of given values.
const OMEGA: f64 = 1.4;
/// Sweeps at most: five times what the finest cells needed.
const MOST_SWEEPS: usize = 400;

impl Pull {
    /// Sum of the neighbours' φ by their weights.
    fn of(&self, phi: &[f64]) -> f64 {
        let term = |k: usize| self.weight[k] * phi[self.near[k] as usize];
        (term(0) + term(1)) + (term(2) + term(3))
    }
}

impl MoltenZone {
    /// Finds the neighbours of each slot, and how strongly they pull: cells come and go at every step.
    ///
    /// A cell that froze and melts again by a later stretch of the bead measures its distance from there; the distances
    /// of neighbours then jump, and φ is not one field across them: they do not pull each other.
    ///
    /// Columns are swept as the fields of a chessboard, first one colour, then the other: none of a colour waits for another.
    fn meet(&mut self, map: &HeightMap, coupling: f64) {
        let jump = 1.5 * map.cell;
        let columns = map.nx as u32;
        let cells = self.slot_of.len();
        self.pulls.clear();
        self.order.clear();
        self.other.clear();
        for s in 0..self.cell.len() {
            let i = self.cell[s] as usize;
            let ix = self.cell[s] % columns;
            let parity = ix + self.cell[s] / columns;
            if parity.is_multiple_of(2) {
                self.order.push(s as u32);
            } else {
                self.other.push(s as u32);
            }
            let (own, distance) = (self.cover[s], self.distance[s]);
            // without a neighbour a slot stands beside itself, and pulls nothing
            let mut pull = Pull {
                near: [s as u32; 4],
                weight: [0.0; 4],
                level: 0.0,
                sum: 0.0,
            };
            let mut look = |side: usize, there: bool, i: usize| {
                let slot = if there { self.slot_of[i] } else { NONE };
                if slot == NONE {
                    return;
                }
                let t = slot as usize;
                if (self.distance[t] - distance).abs() <= jump {
                    pull.near[side] = slot;
                    pull.weight[side] = coupling * own.min(self.cover[t]);
                }
            };
            look(0, ix > 0, i.wrapping_sub(1));
            look(1, ix + 1 < columns, i + 1);
            look(2, i >= map.nx, i.wrapping_sub(map.nx));
            look(3, i + map.nx < cells, i + map.nx);
            pull.sum = own + pull.weight.iter().sum::<f64>();
            let share = OMEGA / pull.sum;
            for weight in &mut pull.weight {
                *weight *= share;
            }
            pull.level = share * own;
            self.pulls.push(pull);
        }
        self.order.append(&mut self.other);
    }

    /// Adds `volume` and relaxes: projected over-relaxation on φ at the level that balances the melt, until no column moves any
    /// more; then the volume is closed exactly.
    pub(super) fn relax(
        &mut self,
        map: &mut HeightMap,
        model: &Levelling,
        bead: &LocalBead,
        volume: f64,
    ) {
        let coupling = (model.wetting_length / map.cell).powi(2);
        let before = self.held();
        let target = before + volume / (map.cell * map.cell);
        if before == 0.0 {
            self.pour(target);
        }
        self.meet(map, coupling);
        self.phi.clear();
        self.phi
            .extend(self.top.iter().zip(&self.psi).map(|(t, p)| t + p));
        self.bed.clear();
        self.bed
            .extend(self.floor.iter().zip(&self.psi).map(|(f, p)| f + p));
        self.foresee(target);
        // on finer cells each sweep carries less far
        let coarse = (model.wetting_length / (2.5 * map.cell)).max(1.0);
        let still = model.settled * bead.height / (coarse * coarse);
        for _ in 0..MOST_SWEEPS {
            self.lift(target);
            let first = self.sweep();
            if first.max(self.sweep()) <= still {
                break;
            }
        }
        for s in 0..self.cell.len() {
            self.top[s] = if self.phi[s] > self.bed[s] {
                (self.phi[s] - self.psi[s]).max(self.floor[s])
            } else {
                self.floor[s]
            };
        }
        self.close(target);
        self.show(map);
    }

    /// Begins where the melt will stand: its neighbours bend it away from the level as they did before, columns that the pool has
    /// just reached stand at the level, and that is where all of it holds `target`.
    fn foresee(&mut self, target: f64) {
        for (phi, bed) in self.phi.iter_mut().zip(&self.bed) {
            *phi = if *phi > *bed { *phi - self.level } else { 0.0 };
        }
        // the melt grows with the level, by pieces of straight lines: Newton's steps end
        for _ in 0..20 {
            let (mut have, mut wet) = (0.0, 0.0);
            for ((bend, bed), cover) in self.phi.iter().zip(&self.bed).zip(&self.cover) {
                let thick = self.level + bend - bed;
                if thick > 0.0 {
                    have += cover * thick;
                    wet += cover;
                }
            }
            if wet == 0.0 {
                break;
            }
            let shift = (target - have) / wet;
            self.level += shift;
            if shift.abs() <= 1e-6 {
                break;
            }
        }
        for (phi, bed) in self.phi.iter_mut().zip(&self.bed) {
            *phi = (*phi + self.level).max(*bed);
        }
    }

    /// Shifts the wet surface towards holding `target` (where that dries columns it holds a little more), and sets the level
    /// at which it is in balance as a whole: φ summed over the wet cells, plus what the dry ones beside them pull. (What wet
    /// ones pull among themselves sums to nothing.)
    fn lift(&mut self, target: f64) {
        let (mut have, mut wet) = (0.0, 0.0);
        for ((phi, bed), cover) in self.phi.iter().zip(&self.bed).zip(&self.cover) {
            let thick = phi - bed;
            have += cover * thick;
            wet += if thick > 0.0 { *cover } else { 0.0 };
        }
        if wet == 0.0 {
            return;
        }
        let shift = (target - have) / wet;
        let (mut sum, mut wet) = (0.0, 0.0);
        self.dry.clear();
        for s in 0..self.cell.len() {
            let (phi, bed, cover) = (self.phi[s], self.bed[s], self.cover[s]);
            let lifted = phi + shift;
            if phi > bed && lifted > bed {
                self.phi[s] = lifted;
                wet += cover;
                sum += cover * lifted;
            } else {
                self.phi[s] = bed;
                self.dry.push(s as u32);
            }
        }
        for s in &self.dry {
            let pull = &self.pulls[*s as usize];
            for (weight, t) in pull.weight.iter().zip(pull.near) {
                let t = t as usize;
                if self.phi[t] > self.bed[t] {
                    sum += weight / OMEGA * pull.sum * (self.phi[t] - self.phi[*s as usize]);
                }
            }
        }
        if wet > 0.0 {
            self.level = sum / wet;
        }
    }

    /// One pass over all columns, each to where its neighbours and the level pull it, and beyond by the over-relaxation. By how much
    /// it moved a column at most, mm.
    fn sweep(&mut self) -> f64 {
        let mut most = 0.0_f64;
        for s in &self.order {
            let s = *s as usize;
            let pull = &self.pulls[s];
            let own = (1.0 - OMEGA) * self.phi[s] + pull.level * self.level;
            let stands = (own + pull.of(&self.phi)).max(self.bed[s]);
            most = most.max((stands - self.phi[s]).abs());
            self.phi[s] = stands;
        }
        most
    }

    /// Writes the surface of the melt into the map.
    pub(super) fn show(&self, map: &mut HeightMap) {
        for s in 0..self.cell.len() {
            let c = self.cover[s];
            map.z[self.cell[s] as usize] = c * self.top[s] + (1.0 - c) * self.foot[s];
        }
    }

    /// Melt in the zone: thickness summed over covered cells, mm.
    pub(super) fn held(&self) -> f64 {
        (0..self.cell.len())
            .map(|s| self.cover[s] * (self.top[s] - self.floor[s]))
            .sum()
    }

    /// First melt of a pool: level φ over the ground, no wetting.
    fn pour(&mut self, target: f64) {
        let n = self.cell.len();
        let ground = |s: usize| self.floor[s] + self.psi[s];
        let lo = (0..n).map(ground).fold(f64::INFINITY, f64::min);
        let least = self.cover.iter().copied().fold(1.0, f64::min);
        let filled = |level: f64| -> f64 {
            let columns = (0..n).map(|s| self.cover[s] * (level - ground(s)).max(0.0));
            columns.sum()
        };
        let [_, hi] = halve([lo, lo + target / least], 100, |level| {
            filled(level) > target
        });
        self.level = hi;
        for s in 0..n {
            self.top[s] = self.floor[s].max(hi - self.psi[s]);
        }
    }

    /// Shifts the wet surface until the zone holds `target`, mm of melt summed over covered cells.
    pub(super) fn close(&mut self, target: f64) {
        let n = self.cell.len();
        for _ in 0..60 {
            let (mut have, mut wet) = (0.0, 0.0);
            for s in 0..n {
                let thick = self.top[s] - self.floor[s];
                if thick > 0.0 {
                    have += self.cover[s] * thick;
                    wet += self.cover[s];
                }
            }
            let lack = target - have;
            if lack.abs() <= 1e-13 * target {
                return;
            }
            if wet == 0.0 {
                self.pour(target);
                continue;
            }
            let shift = lack / wet;
            for s in 0..n {
                if self.top[s] > self.floor[s] {
                    self.top[s] = (self.top[s] + shift).max(self.floor[s]);
                }
            }
        }
    }
}
