//! Draws a beam path on the levels.

use meltpath_base::Observer;

use super::pace::PAIR;
use super::sharing::beside;
use super::tile::{N, PLANE, Shown, Tile};
use super::watching::Watching;
use super::{Level, Levels, LevelsError};
use crate::beam::{Beam, BeamPath};
use crate::grid::between;
use crate::grid::sample::Sample;
use crate::solver::Face;
use crate::solver::source::Spot;
use crate::solver::watch::Watch;

/// Stages in which progress is told.
const STAGES: u64 = 1000;
/// How long what the last line heats may grow hotter after the path's end, s.
const AFTER: f64 = 1e-3;

impl Levels {
    /// Draws `path`, the beam midway of each step of the finest level, or midway of each stretch where it jumps or is switched
    /// within; tells temperatures where and when `watch` asks for them. Returns the places that lie outside.
    ///
    /// # Errors
    /// [`LevelsError`]: a path outside what is covered, cancellation.
    pub fn draw(
        &mut self,
        path: &BeamPath,
        beam: &Beam,
        watch: &Watch,
        observer: &dyn Observer,
    ) -> Result<Vec<[f64; 3]>, LevelsError> {
        let (inside, outside): (Vec<[f64; 3]>, Vec<[f64; 3]>) = watch
            .places
            .iter()
            .copied()
            .partition(|place| self.kelvin_at(*place).is_some());
        let duration = path.end() - path.begin() + AFTER;
        let told = std::mem::take(&mut self.watching.samples);
        self.watching = Watching::new(inside, watch.every, self.time, told);
        observer.stage("draw the beam path", STAGES);
        beside(|| self.follow(path, beam, duration, observer))?;
        self.write_down();
        self.watching.places.clear();
        Ok(outside)
    }

    /// Goes along `path` for `duration` s.
    fn follow(
        &mut self,
        path: &BeamPath,
        beam: &Beam,
        duration: f64,
        observer: &dyn Observer,
    ) -> Result<(), LevelsError> {
        let mut told = 0;
        while self.time < duration * (1.0 - 1e-9) {
            observer.check()?;
            let stage = (self.time / duration * STAGES as f64) as u64;
            observer.advance(stage - told);
            told = stage;
            let from = path.begin() + self.time;
            let ahead = self.ahead();
            let look = f64::from(PAIR) * ahead;
            self.cut(&coming(path, beam, from, look), look);
            self.set_pace(ahead);
            let mut heat = |levels: &mut Levels, dt: f64| {
                let now = path.begin() + levels.time;
                for (share, point) in path.stretches(now, now + dt) {
                    let spot = beam.spot(&point);
                    let power = share * spot.power;
                    levels.heat(&Spot { power, ..spot }, dt)?;
                }
                Ok(())
            };
            self.advance_pair(&mut heat)?;
            self.count();
        }
        Ok(())
    }

    /// Tells the temperatures that are watched, where it is time to; `ticks` of the shortest steps have gone since all levels were at the
    /// same time. Where tiles take longer steps it is told once they have ended theirs: straight between two steps.
    pub(super) fn look(&mut self, ticks: u32) {
        if self.watching.places.is_empty() {
            return;
        }
        let now = self.time;
        let due = now >= self.watching.due - 1e-12;
        let all = ticks.is_multiple_of(PAIR * self.levels[0].rates[0].ticks);
        for p in 0..self.watching.places.len() {
            let place = self.watching.places[p];
            let step = self.steps_at(place);
            if due {
                self.watching.pending[p].push(self.watching.samples.len());
                self.watching.samples.push(Sample {
                    place,
                    time: now,
                    value: f64::NAN,
                });
            }
            let waits = !self.watching.pending[p].is_empty();
            if !(ticks.is_multiple_of(step) && (waits || step > 1) || all) {
                continue;
            }
            let kelvin = self.kelvin_at(place).unwrap_or(f64::NAN);
            let [then, before] = self.watching.known[p];
            for n in std::mem::take(&mut self.watching.pending[p]) {
                let time = self.watching.samples[n].time;
                self.watching.samples[n].value = if time < now && before.is_finite() {
                    before + (kelvin - before) * (time - then) / (now - then)
                } else {
                    kelvin
                };
            }
            self.watching.known[p] = [now, kelvin];
        }
        if due {
            let Watching { every, due, .. } = self.watching;
            self.watching.due += every * ((now - due) / every).floor().max(0.0) + every;
        }
    }

    /// Ticks of the longest step that a tile takes which holds a place.
    fn steps_at(&self, [x, y, z]: [f64; 3]) -> u32 {
        let (lower, upper, _) = between(&self.depths, &self.setup.heights, -z);
        let origin = self.matter.frame.origin;
        let at = [x - origin[0], y - origin[1]];
        let of = |(n, level): (usize, &Level)| {
            let (tile, shown) = self.tile_of_level(n, at)?;
            let planes = tile.planes();
            let holds = planes.contains(&lower) || planes.contains(&upper);
            holds.then(|| level.rates[shown.class as usize].ticks)
        };
        let levels = self.levels.iter().enumerate();
        levels.filter_map(of).max().unwrap_or(1)
    }

    /// Temperature at a place, K, the build plane at z = 0; straight between the centres of cells, of planes, and from the middle
    /// of the uppermost one to its face, and of the lowest one to the one that is held. `None` outside.
    fn kelvin_at(&self, [x, y, z]: [f64; 3]) -> Option<f64> {
        let heights = &self.setup.heights;
        let depth = -z;
        if depth < -1e-9 || depth > self.depths[0] + heights[0] {
            return None;
        }
        let (lower, upper, share) = between(&self.depths, heights, depth);
        let origin = self.matter.frame.origin;
        let at = [x - origin[0], y - origin[1]];
        let top = heights.len() - 1;
        let middle = self.in_plane(at, upper)?;
        let half = 0.5 * heights[top];
        if depth < half && heights.len() > 1 {
            // from the middle of the uppermost cell to its face
            let face = self.in_plane_by(at, top, Self::surface_of_level)?;
            let share = (depth / half).max(0.0);
            return Some(share * middle + (1.0 - share) * face);
        }
        let below = depth - self.depths[0] - 0.5 * heights[0];
        if let (Face::Imposed(held), true) = (self.setup.beyond, below > 0.0) {
            // from the middle of the lowest cell to its face, which is held
            let share = (below / (0.5 * heights[0])).min(1.0);
            return Some((1.0 - share) * middle + share * held);
        }
        Some((1.0 - share) * middle + share * self.in_plane(at, lower)?)
    }

    /// Temperature of a plane at a place from the corner of all cells, K: straight between the four centres round it, of the finest cells
    /// that there are at the place; where one of the four is coarser, of the cell that holds its centre.
    fn in_plane(&self, at: [f64; 2], plane: usize) -> Option<f64> {
        self.in_plane_by(at, plane, Self::of_level)
    }

    /// The same of what `tell` says of the cells of a level.
    fn in_plane_by(
        &self,
        at: [f64; 2],
        plane: usize,
        tell: fn(&Self, usize, [f64; 2], usize) -> Option<f64>,
    ) -> Option<f64> {
        let finest = |at: [f64; 2]| {
            let mut levels = 0..self.levels.len();
            levels.find_map(|n| Some((n, tell(self, n, at, plane)?)))
        };
        let (level, own) = finest(at)?;
        let edge = self.levels[level].edge;
        let from = at.map(|d| (d / edge - 0.5).floor());
        let mut sum = 0.0;
        for corner in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]] {
            let centre = [0, 1].map(|a| (from[a] + corner[a] + 0.5) * edge);
            let weights = [0, 1].map(|a| 1.0 - (at[a] - centre[a]).abs() / edge);
            let there = tell(self, level, centre, plane);
            let there = there.or_else(|| finest(centre).map(|(_, kelvin)| kelvin));
            sum += weights[0] * weights[1] * there.unwrap_or(own);
        }
        Some(sum)
    }

    /// Temperature of the cell that a level has of this plane at a place, K.
    fn of_level(&self, n: usize, at: [f64; 2], plane: usize) -> Option<f64> {
        let (tile, cell) = self.cell_of_level(n, at)?;
        let plane = tile.planes().contains(&plane).then(|| plane - tile.base)?;
        let g = tile.enthalpy[plane * PLANE + cell];
        Some(self.curve.temperature(f64::from(g)))
    }

    /// Temperature of the build plane over the uppermost cell, `plane`, that a level has at a place, K.
    fn surface_of_level(&self, n: usize, at: [f64; 2], plane: usize) -> Option<f64> {
        let kelvin = self.of_level(n, at, plane)?;
        let (tile, cell) = self.cell_of_level(n, at)?;
        let face = self
            .surface
            .temperature(&self.curve, f64::from(tile.skin.theta[cell]));
        Some(kelvin.max(face))
    }

    /// The tile that a level has at a place, and which of its columns.
    fn cell_of_level(&self, n: usize, at: [f64; 2]) -> Option<(&Tile, usize)> {
        let (tile, _) = self.tile_of_level(n, at)?;
        let [i, j] = at.map(|d| (d / self.levels[n].edge) as usize);
        Some((tile, j % N * N + i % N))
    }

    /// The tile that a level has at a place from the corner of all cells, and what others see of it.
    fn tile_of_level(&self, n: usize, at: [f64; 2]) -> Option<(&Tile, &Shown)> {
        let (level, size) = (&self.levels[n], self.tree.size(n));
        let at = at.map(|d| d / level.edge);
        if at.iter().any(|a| *a < 0.0) {
            return None;
        }
        let [i, j] = at.map(|a| a as usize);
        if i / N >= size[0] || j / N >= size[1] {
            return None;
        }
        let index = level.index[j / N * size[0] + i / N] as usize;
        Some((level.tiles.get(index)?, level.shown.get(index)?))
    }
}

/// Where the beam is in the next `time` seconds, often enough that no tile is missed.
fn coming(path: &BeamPath, beam: &Beam, from: f64, time: f64) -> Vec<Spot> {
    const LOOKS: u32 = 16;
    let part = time / f64::from(LOOKS);
    (0..LOOKS)
        .flat_map(|n| {
            let begin = from + f64::from(n) * part;
            path.stretches(begin, begin + part)
        })
        .map(|(_, point)| beam.spot(&point))
        .filter(|spot| spot.power > 0.0)
        .collect()
}
