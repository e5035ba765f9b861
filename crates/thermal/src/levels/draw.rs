//! Draws a beam path on the levels.

use meltpath_base::Observer;

use super::pace::PAIR;
use super::sharing::beside;
use super::tile::{N, PLANE, Tile};
use super::watching::Watching;
use super::{Levels, LevelsError};
use crate::beam::{Beam, BeamPath};
use crate::grid::between;
use crate::grid::sample::Sample;
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
        self.watching = Watching {
            places: inside,
            every: watch.every,
            samples: std::mem::take(&mut self.watching.samples),
            due: self.time,
        };
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

    /// Tells the temperatures that are watched, where it is time to.
    pub(super) fn look(&mut self) {
        let Watching { every, due, .. } = self.watching;
        if self.watching.places.is_empty() || self.time < due - 1e-12 {
            return;
        }
        self.watching.due += every * ((self.time - due) / every).floor().max(0.0) + every;
        let told = self.watching.places.iter().map(|place| Sample {
            place: *place,
            time: self.time,
            value: self.kelvin_at(*place).unwrap_or(f64::NAN),
        });
        let told: Vec<Sample> = told.collect();
        self.watching.samples.extend(told);
    }

    /// Temperature at a place, K, the build plane at z = 0; straight between the centres of cells, of planes, and from the middle
    /// of the uppermost one to its face. `None` outside.
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
            .at(&self.curve, f64::from(tile.skin.theta[cell]));
        Some(kelvin.max(face))
    }

    /// The tile that a level has at a place, and which of its columns.
    fn cell_of_level(&self, n: usize, at: [f64; 2]) -> Option<(&Tile, usize)> {
        let (level, size) = (&self.levels[n], self.tree.size(n));
        let at = at.map(|d| d / level.edge);
        if at.iter().any(|a| *a < 0.0) {
            return None;
        }
        let [i, j] = at.map(|a| a as usize);
        if i / N >= size[0] || j / N >= size[1] {
            return None;
        }
        let index = level.index[j / N * size[0] + i / N];
        let tile = level.tiles.get(index as usize)?;
        Some((tile, j % N * N + i % N))
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
