//! How long the steps of the levels may be: by how hot each is.

use super::conduct::PlaneStep;
use super::tile::Class;
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

/// No step of the coarsest level is longer, s.
pub(super) const LONGEST: f64 = 3e-4;
/// Nor than so many of the finest: so far ahead the beam is looked for.
pub(super) const TICKS: u32 = 16;
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
        let fresh = material.relative_density(material.start);
        // beside dense metal a powder cell conducts by the harmonic mean but stores only its own share
        let [a, b] = material.powder_conduction();
        let share = a + b * fresh;
        let contrast = (2.0 * share / (share + 1.0) / fresh).max(1.0);
        let mut worst = curve.diffusivity_solid * contrast;
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

/// Steps of slow tiles in ticks of `step` s, at most `limit` s: those that cost least.
pub(super) fn slow_ticks(own: &[(f64, f64)], quick: u32, step: f64, limit: f64) -> u32 {
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
    use super::slow_ticks;

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
