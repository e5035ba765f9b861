//! Energy modulation: less energy where powder conducts badly, so that overhangs do not overheat.
//!
//! Béraud 2016, section 2.4.2. The shape of the ramps and their parameters are lost; ours
//! (docs/theory/sources.md, energy near powder) stand in their place.

/// A factor that grows from `least` at powder to 1 at a distance, and stays there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// Factor at contact with powder.
    pub least: f64,
    /// Distance from which nothing is taken off, mm.
    pub length: f64,
}

impl Ramp {
    /// The factor at `distance` mm from powder.
    pub fn at(&self, distance: f64) -> f64 {
        self.least + (1.0 - self.least) * distance.clamp(0.0, self.length) / self.length
    }
}

/// How energy is modulated round powder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modulation {
    /// Energy per volume far from powder, J/mm³.
    pub nominal: f64,
    /// In the plane, for each axis.
    pub across: Ramp,
    /// Along the build direction.
    pub along: Ramp,
}

impl Modulation {
    /// Nominal 49 J/mm³ (the thesis' optimum); ramps of 0.8 and 0.6 over 1 mm, starting values to be tuned.
    #[cfg(test)]
    pub(crate) const STARTING: Modulation = Modulation {
        nominal: 49.0,
        across: Ramp {
            least: 0.8,
            length: 1.0,
        },
        along: Ramp {
            least: 0.6,
            length: 1.0,
        },
    };

    /// Energy per volume, J/mm³, at distances to powder along x, y and z, mm (eq. 2.4.1).
    pub fn energy(&self, distances: [f64; 3]) -> f64 {
        let [x, y, z] = distances;
        self.nominal * self.across.at(x) * self.across.at(y) * self.along.at(z)
    }
}

/// Energy per volume of a hatch, J/mm³: power (W) over speed (mm/s), spacing and layer (mm) (eq. 2.4.2).
///
/// ```
/// let q = meltpath_planning::powder::modulation::hatch_energy(60e3 * 5e-3, 980.0, 0.125, 0.05);
/// assert!((q - 48.98).abs() < 0.01);
/// ```
pub fn hatch_energy(power: f64, speed: f64, spacing: f64, layer: f64) -> f64 {
    power / (speed * spacing * layer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ebm_a07_energy_of_the_thesis_hatch() {
        let q = hatch_energy(300.0, 980.0, 0.125, 0.05);
        assert!((q / 48.98 - 1.0).abs() < 1e-3, "{q}");
    }

    proptest! {
        #[test]
        fn ebm_a11_ramps(a in 0.0..3.0_f64, b in 0.0..3.0_f64) {
            let m = Modulation::STARTING;
            for ramp in [m.across, m.along] {
                prop_assert_eq!(ramp.at(0.0), ramp.least);
                prop_assert_eq!(ramp.at(ramp.length), 1.0);
                prop_assert!(ramp.at(a.max(b)) >= ramp.at(a.min(b)));
            }
            prop_assert_eq!(m.energy([5.0, 5.0, 5.0]), m.nominal);
        }
    }
}
