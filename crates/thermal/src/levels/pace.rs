//! How long the steps of the levels may be: by how hot each is.

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
