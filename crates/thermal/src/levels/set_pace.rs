//! Sets the steps of all levels, and which tiles take the longer ones.

use super::pace::{LONGEST, Rate, TICKS, slow_ticks};
use super::step::planes;
use super::tile::{Class, PLANE, Shown, Tile};
use super::{Level, Levels};

impl Levels {
    /// How far ahead the beam is looked for, s: as long as no level's step will be longer.
    pub(super) fn ahead(&self) -> f64 {
        let step = match self.pace.longest {
            0.0 => self.setup.step,
            longest => longest,
        };
        LONGEST.min(step * f64::from(TICKS))
    }

    /// Sets the steps of all levels, none longer than `longest` s: the quick tiles' of the finest as long as is stable and asked for, the
    /// others a power of two longer. Tiles that the beam does not reach and that bear a longer step than their level's hottest go slow.
    pub(super) fn set_pace(&mut self, longest: f64) {
        let finest = self.setup.coarser;
        let height = self
            .setup
            .heights
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        let mut stable = Vec::new();
        for (n, level) in self.levels.iter().enumerate() {
            let warmth = level.tiles.iter().map(|t| t.warmth).fold(0.0, f32::max);
            let mut kelvin = self.curve.temperature(f64::from(warmth));
            if n == finest {
                self.pace.hottest = self.pace.hottest.max(kelvin);
                kelvin = self.pace.hottest;
            }
            let limit = self.pace.stable(kelvin, level.edge, height);
            stable.push(limit.min(longest));
        }
        let step = self.setup.step.min(stable[finest]);
        self.pace.longest = self.pace.longest.max(step);
        let mut quick = vec![1_u32; finest + 1];
        for n in (0..finest).rev() {
            let before = quick[n + 1];
            quick[n] = before;
            while step * f64::from(2 * quick[n]) <= stable[n] && quick[n] < 4 * before {
                quick[n] *= 2;
            }
        }
        for n in 0..=finest {
            let limit = match n {
                0 => longest,
                _ => (step * f64::from(quick[n - 1])).min(longest),
            };
            let own = self.own_steps(&self.levels[n]);
            let slow = slow_ticks(&own, quick[n], step, limit * (1.0 + 1e-9));
            let rate = |ticks: u32| Rate {
                step: step * f64::from(ticks),
                ticks,
                planes: planes(&self.setup, step * f64::from(ticks)),
            };
            let rates = [rate(slow), rate(quick[n])];
            let level = &mut self.levels[n];
            for ((_, own), shown) in own.into_iter().zip(&mut level.shown) {
                shown.class = if own >= rates[0].step && slow > quick[n] {
                    Class::Slow
                } else {
                    Class::Quick
                };
            }
            level.rates = rates;
        }
    }

    /// What each tile of a level costs a step, and its longest stable step, s; none is where the beam reaches.
    fn own_steps(&self, level: &Level) -> Vec<(f64, f64)> {
        let of = |(tile, shown): (&Tile, &Shown)| {
            let heights = self.setup.heights[tile.planes()].iter().copied();
            let height = heights.fold(f64::INFINITY, f64::min);
            let kelvin = self.curve.temperature(f64::from(tile.warmth));
            // the beam heats planes near the top alone
            let longest = if shown.lit && tile.planes().end == self.setup.heights.len() {
                0.0
            } else {
                self.pace.stable(kelvin, level.edge, height)
            };
            let cells = tile.enthalpy.len() / PLANE;
            (if shown.asleep { 0.0 } else { cells as f64 }, longest)
        };
        level.tiles.iter().zip(&level.shown).map(of).collect()
    }
}
