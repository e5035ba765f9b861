//! How long the steps of the levels may be: by how hot each is.
//!
//! Steps come in pairs. Both give what flows in half of the pair; between them others see a tile as it was earlier, where Euler's
//! method is still stable: with steps `ρ` times its longest one, `1/ρ` of what the first step gave. Of an amplitude that flows let fall
//! at the rate `λ`, a pair of `Δt` leaves `1 - z + z²/4ρ`, `z = λΔt`. `ρ = 1` are two of Euler's steps; `ρ = 3/2` is the
//! Runge-Kutta-Legendre method of two stages (Meyer, Balsara, Aslam 2014, Journal of Computational Physics 257, 594): half as many
//! steps again in a time would be needed without it. Conduction sees what was `(ρ - 1/2)` of Euler's longest step ago, so the finest
//! level's quick tiles, where the beam is, keep `ρ = 1`.

use super::conduct::PlaneStep;
use super::tile::{Class, Half};
use crate::material::Material;
use crate::material::enthalpy::Enthalpy;

/// Temperatures at which diffusivities are read, K.
const EVERY: f64 = 10.0;
/// What a level may grow hotter before it is looked at again, K.
const MARGIN: f64 = 300.0;
/// As hot as this the finest level is taken to be from the beginning, K.
const POOL: f64 = 2800.0;
/// Share of the stable step that is taken.
const SAFE: f64 = 0.95;
/// `ρ` of all tiles but the finest level's quick ones.
pub(super) const OF_PAIR: f64 = 1.5;

/// No step of the coarsest level is longer, s.
pub(super) const LONGEST: f64 = 3e-4;
/// Nor than so many of the finest.
pub(super) const TICKS: u32 = 16;
/// Steps of a pair.
pub(super) const PAIR: u32 = 2;
/// Those of a level in the order of their steps.
pub(super) const CLASSES: [Class; 2] = [Class::Slow, Class::Quick];

/// How the tiles of one class of a level go on.
#[derive(Debug, Clone, Default)]
pub(super) struct Rate {
    /// s.
    pub(super) step: f64,
    /// The same in steps of the finest level's quick tiles, a power of two.
    pub(super) ticks: u32,
    pub(super) planes: Vec<PlaneStep>,
    /// Of what the first step of a pair gives, the share that others see before the second.
    pub(super) seen: f32,
}

impl Rate {
    /// Which step of a pair begins, `tick` of the shortest steps after all levels were at the same time.
    pub(super) fn half(&self, tick: u32) -> Half {
        if tick.is_multiple_of(PAIR * self.ticks) {
            Half::First
        } else {
            Half::Second
        }
    }
}

/// Largest diffusivities of the laws up to a temperature.
#[derive(Debug, Clone)]
pub(super) struct Pace {
    start: f64,
    /// mm²/s, every so many kelvins from the start.
    largest: Vec<f64>,
    /// The hottest that the finest level was, K.
    pub(super) hottest: f64,
    /// The longest step that it took, s.
    pub(super) longest: f64,
}

impl Pace {
    pub(super) fn new(material: &Material, curve: &Enthalpy) -> Self {
        let mut worst = curve.diffusivity_solid * material.powder_contrast();
        let mut largest = vec![worst];
        while worst < curve.diffusivity_max && largest.len() < 1000 {
            let kelvin = material.start + EVERY * largest.len() as f64;
            worst = worst.max(material.conductivity(kelvin) / material.heat_capacity(kelvin));
            largest.push(worst);
        }
        Pace {
            start: material.start,
            largest,
            hottest: POOL,
            longest: 0.0,
        }
    }

    /// The longest stable step of cells of this edge and height (mm) that are `kelvin` hot, s.
    pub(super) fn stable(&self, kelvin: f64, edge: f64, height: f64) -> f64 {
        let n = ((kelvin + MARGIN - self.start) / EVERY).max(0.0).ceil() as usize;
        let worst = self.largest[n.min(self.largest.len() - 1)];
        SAFE / (2.0 * worst * (2.0 * edge.powi(-2) + height.powi(-2)))
    }
}

/// Steps of each level's slow and quick tiles in ticks of `step` s, coarsest first, all powers of two. `stable` are the longest steps of
/// each level's hottest tiles, `own` what each tile costs a step and its own longest one, no step is longer than `longest`, s.
///
/// Shorter ticks may fit the others better and cost less. But highest temperatures move by some kelvins with the tick, and would do so
/// from one drawing to a next that hardly differs.
pub(super) fn ladder(
    step: f64,
    stable: &[f64],
    own: &[Vec<(f64, f64)>],
    longest: f64,
) -> Vec<[u32; 2]> {
    let finest = stable.len() - 1;
    let mut quick = vec![1_u32; stable.len()];
    for n in (0..finest).rev() {
        let before = quick[n + 1];
        quick[n] = before;
        while step * f64::from(2 * quick[n]) <= stable[n] && quick[n] < 4 * before {
            quick[n] *= 2;
        }
    }
    let slow = |n: usize| {
        let limit = match n {
            0 => longest,
            _ => (step * f64::from(quick[n - 1])).min(longest),
        };
        slow_ticks(&own[n], quick[n], step, limit * (1.0 + 1e-9))
    };
    (0..stable.len()).map(|n| [slow(n), quick[n]]).collect()
}

/// Steps of slow tiles in ticks of `step` s, at most `limit` s: those that cost least.
fn slow_ticks(own: &[(f64, f64)], quick: u32, step: f64, limit: f64) -> u32 {
    let cost = |ticks: u32| -> f64 {
        let of = |(cells, longest): &(f64, f64)| {
            let bears = *longest >= step * f64::from(ticks);
            cells / f64::from(if bears { ticks } else { quick })
        };
        own.iter().map(of).sum()
    };
    let mut best = quick;
    let mut ticks = 2 * quick;
    while step * f64::from(ticks) <= limit {
        if cost(ticks) < cost(best) {
            best = ticks;
        }
        ticks *= 2;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// No step is longer than its level's hottest tile bears, and each is a power of two of the next shorter one.
        #[test]
        fn ladders_are_stable(
            most in 1e-6..1e-5_f64,
            stable in prop::collection::vec(1.0..40.0_f64, 1..5),
            own in prop::collection::vec(prop::collection::vec((1.0..8.0_f64, 1.0..200.0_f64), 0..9), 5),
        ) {
            let longest = 16.0 * most;
            let mut stable: Vec<f64> = stable.iter().map(|s| (s * most).min(longest)).collect();
            stable.sort_by(|a, b| b.total_cmp(a));
            stable.push(most);
            let own: Vec<Vec<(f64, f64)>> = own[..stable.len()]
                .iter()
                .map(|of| of.iter().map(|(cells, s)| (*cells, s * most)).collect())
                .collect();
            let ladder = ladder(most, &stable, &own, longest);
            let mut shorter = ladder.concat();
            for (n, [slow, quick]) in ladder.iter().enumerate() {
                prop_assert!(most * f64::from(*quick) <= stable[n] * (1.0 + 1e-9));
                prop_assert!(most * f64::from(*slow) <= longest * (1.0 + 1e-6));
            }
            shorter.reverse();
            for pair in shorter.windows(2) {
                prop_assert!(pair[1].is_multiple_of(pair[0]) && (pair[1] / pair[0]).is_power_of_two(), "{:?}", ladder);
            }
        }
    }

    /// A tile that bears four ticks and one that bears none but the quick one's: the first goes slow, as slow as it may.
    #[test]
    fn slow_tiles_take_the_steps_that_cost_least() {
        let own = [(6.0, 4.5e-6), (6.0, 0.0)];
        assert_eq!(slow_ticks(&own, 1, 1e-6, 16e-6), 4);
        assert_eq!(slow_ticks(&own, 1, 1e-6, 2e-6), 2);
        assert_eq!(slow_ticks(&own, 8, 1e-6, 16e-6), 8);
        // many that bear two ticks count for more than one that bears eight
        let own = [(6.0, 8e-6), (60.0, 2e-6)];
        assert_eq!(slow_ticks(&own, 1, 1e-6, 16e-6), 2);
        // those that sleep cost nothing, and ask for nothing
        assert_eq!(slow_ticks(&[(0.0, 8e-6), (6.0, 2e-6)], 1, 1e-6, 16e-6), 2);
    }
}
