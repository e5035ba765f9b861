//! The values of track and positioner that are tried where a way is chosen wide.

use std::f64::consts::TAU;

use crate::cell::{Cell, External};

/// Steps of track (mm) and positioner (rad).
pub(super) const STEPS: [f64; 3] = [250.0, TAU / 18.0, TAU / 12.0];
/// Between key places so far apart the axes may go two steps, mm.
pub(super) const LONG: f64 = 80.0;

/// Steps of track and positioner from where they rest.
pub(super) type Cube = [i16; 3];

/// The values that are tried.
pub(super) struct Grid {
    pub(super) rest: External,
    low: Cube,
    high: Cube,
}

impl Grid {
    pub(super) fn of(cell: &Cell, External(mut rest): External) -> Self {
        for (i, value) in rest.iter_mut().enumerate() {
            // an axis may rest at its very end, where no way shall be
            if let Some([low, high]) = cell.external_room(i) {
                *value = value.clamp(low, high);
            }
        }
        let rest = External(rest);
        let ends = |up: bool| -> Cube {
            std::array::from_fn(|i| {
                let Some(room) = cell.external_room(i) else {
                    return 0;
                };
                let [low, high] = room.map(|limit| (limit - rest.0[i]) / STEPS[i]);
                // what is far beyond is come to by stepping on, not by beginning there
                let step = if up {
                    (high + 1e-9).floor()
                } else {
                    (low - 1e-9).ceil()
                };
                step.clamp(-1000.0, 1000.0) as i16
            })
        };
        Grid {
            rest,
            low: ends(false),
            high: ends(true),
        }
    }

    pub(super) fn value(&self, cube: Cube) -> External {
        External(std::array::from_fn(|i| {
            self.rest.0[i] + STEPS[i] * f64::from(cube[i])
        }))
    }

    /// Where a run may begin: within half a turn of rest.
    pub(super) fn all(&self) -> Vec<Cube> {
        let range = |i: usize| {
            let most = match i {
                0 => i16::MAX,
                _ => (0.5 * TAU / STEPS[i]).round() as i16,
            };
            self.low[i].max(-most)..=self.high[i].min(most)
        };
        range(0)
            .flat_map(|a| range(1).flat_map(move |b| range(2).map(move |c| [a, b, c])))
            .collect()
    }

    /// A step or none along each axis; more where the way between is long.
    pub(super) fn beside(&self, cube: Cube, gone: f64) -> impl Iterator<Item = Cube> + '_ {
        let turned = if gone < LONG { 1 } else { 2 };
        let most = [1 + (gone / STEPS[0]) as i16, turned, turned];
        let range = move |i: usize| {
            let [low, high] = [cube[i] - most[i], cube[i] + most[i]];
            low.max(self.low[i])..=high.min(self.high[i])
        };
        range(0).flat_map(move |a| range(1).flat_map(move |b| range(2).map(move |c| [a, b, c])))
    }
}

#[cfg(test)]
mod tests {
    use meltpath_data::{find, robots};

    use super::*;
    use crate::cell;

    /// Verdicts ask for room at every limit: no axis is led along its very end because it rests there.
    #[test]
    fn axes_that_rest_at_their_end_are_led_off_it() {
        let text = find(robots::ALL, "abb-irb2600-12-185").unwrap().text;
        let (arm, _) = text.split_once("\n[table]").unwrap();
        let cell = cell::read(&format!(
            "{arm}\n[positioner]\nsource = \"test\"\naxes = [{{ position = [\"1200 mm\", \"0 mm\", \"700 mm\"], axis = [1, 0, 0] }}]\nlow = [\"0 deg\"]\nhigh = [\"90 deg\"]\n"
        ))
        .unwrap();
        let rest = cell.at_rest().external();
        assert_eq!(rest.0[1], 0.0);
        let grid = Grid::of(&cell, rest);
        let all = grid.all();
        assert!(all.len() > 3);
        for cube in all {
            let value = grid.value(cube).0[1];
            assert!((2_f64.to_radians()..=88_f64.to_radians()).contains(&value));
        }
    }
}
