//! Sets the steps of all levels, and which tiles take the longer ones.

use super::pace::{CLASSES, LONGEST, OF_PAIR, Rate, TICKS, ladder};
use super::step::planes;
use super::tile::{Class, PLANE, Shown, Tile};
use super::{Level, Levels};

impl Levels {
    /// No step of a level will be longer, s: a pair of them is how far ahead the beam is looked for.
    pub(super) fn ahead(&self) -> f64 {
        let step = match self.pace.longest {
            0.0 => self.setup.step,
            longest => longest,
        };
        LONGEST.min(step * f64::from(TICKS))
    }

    /// Sets the steps of all levels, none longer than `longest` s: the quick tiles' of the finest at most as long as is stable and asked
    /// for, the others powers of two longer. Tiles that the beam does not hit and that bear a longer step than their level's hottest go
    /// slow.
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
            let limit = if n == finest { limit } else { OF_PAIR * limit };
            stable.push(limit.min(longest));
        }
        let own: Vec<_> = self.levels.iter().map(|l| self.own_steps(l)).collect();
        let step = self.setup.step.min(stable[finest]);
        let ladder = ladder(step, &stable, &own, longest);
        self.pace.longest = self.pace.longest.max(step);
        for (n, (level, own)) in self.levels.iter_mut().zip(own).enumerate() {
            let rate = |class: Class| {
                let ticks = ladder[n][class as usize];
                let step = step * f64::from(ticks);
                Rate {
                    step,
                    ticks,
                    seen: match (n == finest, class) {
                        (true, Class::Quick) => 1.0,
                        _ => (1.0 / OF_PAIR) as f32,
                    },
                    planes: planes(&self.setup, step),
                }
            };
            level.rates = CLASSES.map(rate);
            let [slow, quick] = [0, 1].map(|c| &level.rates[c]);
            for ((_, own), shown) in own.into_iter().zip(&mut level.shown) {
                shown.class = if own >= slow.step && slow.ticks > quick.ticks {
                    Class::Slow
                } else {
                    Class::Quick
                };
            }
        }
    }

    /// What each tile of a level costs a step, and its longest stable step, s; none where the beam hits.
    fn own_steps(&self, level: &Level) -> Vec<(f64, f64)> {
        let of = |(tile, shown): (&Tile, &Shown)| {
            let heights = self.setup.heights[tile.planes()].iter().copied();
            let height = heights.fold(f64::INFINITY, f64::min);
            let kelvin = self.curve.temperature(f64::from(tile.warmth));
            // the beam heats planes near the top alone
            let longest = if shown.hit && tile.planes().end == self.setup.heights.len() {
                0.0
            } else {
                OF_PAIR * self.pace.stable(kelvin, level.edge, height)
            };
            let cells = tile.enthalpy.len() / PLANE;
            (if shown.asleep { 0.0 } else { cells as f64 }, longest)
        };
        level.tiles.iter().zip(&level.shown).map(of).collect()
    }
}
