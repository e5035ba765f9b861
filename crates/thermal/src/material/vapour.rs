//! Vapour over a melt: what leaves it into the gas around, with how much heat, and how hard it pushes back.
//!
//! Saturation by Clausius and Clapeyron, each component with its activity; the flux by Hertz, Knudsen and Langmuir, less what comes
//! back through the layer of collisions over the surface: C. J. Knight, AIAA Journal 17, 1979, 519; S. I. Anisimov, Soviet Physics
//! JETP 27, 1968, 182. The surface is taken as rich in each component as the melt below.

/// Molar gas constant, J/(mol·K).
const GAS_CONSTANT: f64 = 8.314_462_618;
/// Pressure at which boiling points are given, Pa.
const ATMOSPHERE: f64 = 101_325.0;
/// Heats of a vapour of atoms, at constant pressure over constant volume.
const ADIABATIC: f64 = 5.0 / 3.0;

/// One component of the melt.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Its name.
    pub name: String,
    /// Its share of the atoms.
    pub share: f64,
    /// Boiling point of the pure component at atmospheric pressure, K.
    pub boiling: f64,
    /// Latent heat of evaporation, J/kg.
    pub latent: f64,
    /// Molar mass of the vapour, kg/mol.
    pub molar_mass: f64,
    /// Partial molar excess energy in the melt, J/mol, the same at all temperatures: the activity coefficient is `exp(E/RT)`.
    pub excess: f64,
}

impl Component {
    /// Pressure of its saturated vapour over the melt, Pa.
    fn saturation(&self, kelvin: f64) -> f64 {
        let per_kelvin = self.latent * self.molar_mass / GAS_CONSTANT;
        let pure = ATMOSPHERE * (per_kelvin * (1.0 / self.boiling - 1.0 / kelvin)).exp();
        self.share * (self.excess / (GAS_CONSTANT * kelvin)).exp() * pure
    }
}

/// What evaporates from a melt.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaporation {
    /// Its components, the main one first; at most [`Evaporation::MOST`].
    pub components: Vec<Component>,
    /// Share of the emitted vapour that does not come back, whatever the gas around, in place of that of [`Jump::between`].
    pub net_fraction: Option<f64>,
}

impl Evaporation {
    /// Most components.
    pub const MOST: usize = 4;

    /// Pressure of the saturated vapour at `kelvin`, Pa.
    pub fn saturation(&self, kelvin: f64) -> f64 {
        self.components.iter().map(|c| c.saturation(kelvin)).sum()
    }

    /// Share of each component in the mass of the melt.
    pub fn by_mass(&self) -> Vec<f64> {
        let masses = self.components.iter().map(|c| c.share * c.molar_mass);
        let all: f64 = masses.clone().sum();
        masses.map(|mass| mass / all).collect()
    }

    /// Mass of each component that leaves a surface of `kelvin` into a gas at `ambient` Pa, kg/(mm²·s).
    pub fn mass(&self, kelvin: f64, ambient: f64) -> [f64; Self::MOST] {
        let leaves = self
            .net_fraction
            .unwrap_or_else(|| Jump::between(self.saturation(kelvin), ambient).leaves());
        let mut mass = [0.0; Self::MOST];
        for (mass, c) in mass.iter_mut().zip(&self.components) {
            let molecules = c.molar_mass / (2.0 * std::f64::consts::PI * GAS_CONSTANT * kelvin);
            *mass = 1e-6 * leaves * c.saturation(kelvin) * molecules.sqrt();
        }
        mass
    }

    /// Heat carried away at a surface of `kelvin` into a gas at `ambient` Pa, W/mm².
    ///
    /// ```
    /// # let text = meltpath_data::materials::TI6AL4V_EBM.text;
    /// # let alloy = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
    /// let vapour = alloy.evaporation.unwrap();
    /// // near the boiling point a vacuum takes some 400 W from every square millimetre, a gas at 1 bar not half of that
    /// let vacuum = vapour.flux(3560.0, 0.2);
    /// assert!((300.0..600.0).contains(&vacuum), "{vacuum}");
    /// assert!(vapour.flux(3560.0, 1e5) < 0.5 * vacuum);
    /// ```
    pub fn flux(&self, kelvin: f64, ambient: f64) -> f64 {
        let mass = self.mass(kelvin, ambient);
        let heats = mass.iter().zip(&self.components);
        heats.map(|(mass, c)| mass * c.latent).sum()
    }

    /// By how much vapour presses harder on a surface of `kelvin` than the gas around, at `ambient` Pa, does, Pa.
    ///
    /// ```
    /// # let text = meltpath_data::materials::TI6AL4V_EBM.text;
    /// # let alloy = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
    /// let vapour = alloy.evaporation.unwrap();
    /// let share = vapour.recoil(3000.0, 0.2) / vapour.saturation(3000.0);
    /// assert!((share - 0.55).abs() < 0.01, "{share}");
    /// ```
    pub fn recoil(&self, kelvin: f64, ambient: f64) -> f64 {
        let saturation = self.saturation(kelvin);
        if saturation <= ambient {
            return 0.0;
        }
        let jump = Jump::between(saturation, ambient);
        let flow = 1.0 + ADIABATIC * jump.mach * jump.mach;
        (saturation * jump.pressure * flow - ambient).max(0.0)
    }
}

/// State of the vapour behind the layer of collisions over the surface, as shares of the saturated state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Speed over that of sound.
    pub mach: f64,
    /// Pressure.
    pub pressure: f64,
    /// Temperature.
    pub temperature: f64,
}

impl Jump {
    /// Behind the layer vapour flows off at `mach`, 0 to 1.
    fn at(mach: f64) -> Self {
        let m = mach * (0.5 * ADIABATIC).sqrt();
        let root_pi = std::f64::consts::PI.sqrt();
        let slip = root_pi * (ADIABATIC - 1.0) / (ADIABATIC + 1.0) * 0.5 * m;
        let root = (1.0 + slip * slip).sqrt() - slip;
        let temperature = root * root;
        let back = (m * m).exp() * libm::erfc(m);
        let density = ((m * m + 0.5) * back - m / root_pi) / root
            + 0.5 * (1.0 - root_pi * m * back) / temperature;
        Jump {
            mach,
            pressure: density * temperature,
            temperature,
        }
    }

    /// Between a surface of this `saturation` and a gas at `ambient`, Pa: vapour flows off as fast as brings it to the pressure of
    /// the gas, at most at the speed of sound. Below saturation nothing flows; diffusion through the gas is left out.
    pub fn between(saturation: f64, ambient: f64) -> Self {
        let (mut slow, mut fast) = (0.0, 1.0);
        if saturation <= ambient {
            return Self::at(slow);
        }
        if saturation * Self::at(fast).pressure >= ambient {
            return Self::at(fast);
        }
        for _ in 0..50 {
            let mach = 0.5 * (slow + fast);
            if saturation * Self::at(mach).pressure > ambient {
                slow = mach;
            } else {
                fast = mach;
            }
        }
        Self::at(slow)
    }

    /// Share of what the surface emits that does not come back.
    pub fn leaves(&self) -> f64 {
        let sound = (2.0 * std::f64::consts::PI * ADIABATIC).sqrt();
        sound * self.mach * self.pressure / self.temperature.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::CELSIUS;
    use crate::material::tests::titanium;

    /// Knight 1979 at the speed of sound: 0.669 of the temperature, 0.31 of the density, 0.21 of the pressure, 18 % come back.
    #[test]
    fn a_sonic_flow_is_that_of_knight() {
        let sonic = Jump::between(1e5, 0.2);
        assert_eq!(sonic.mach, 1.0);
        assert!((sonic.temperature - 0.669).abs() < 1e-3, "{sonic:?}");
        assert!((sonic.pressure - 0.206).abs() < 1e-3, "{sonic:?}");
        assert!((sonic.leaves() - 0.816).abs() < 2e-3, "{sonic:?}");
        let still = Jump::at(0.0);
        assert!((still.pressure - 1.0).abs() < 1e-12 && still.leaves() == 0.0);
    }

    /// Under a gas nothing leaves before saturation reaches its pressure; from five times that on as much as in a vacuum.
    #[test]
    fn a_gas_holds_the_vapour_down_until_saturation_passes_it() {
        assert_eq!(Jump::between(0.99e5, 1e5).leaves(), 0.0);
        let shares: Vec<f64> = [1.1, 1.5, 2.0, 3.0]
            .map(|times| Jump::between(times * 1e5, 1e5).leaves())
            .to_vec();
        assert!(shares.windows(2).all(|w| w[0] < w[1] + 1e-12), "{shares:?}");
        assert!((0.05..0.2).contains(&shares[0]), "{shares:?}");
        // just below the speed of sound half a percent more leaves than at it
        let sonic = Jump::between(5e5, 1e5).leaves();
        assert!((sonic - 0.816).abs() < 2e-3 && sonic > shares[3], "{sonic}");
        // the flow takes the vapour to the pressure of the gas
        let jump = Jump::between(2e5, 1e5);
        assert!((2e5 * jump.pressure / 1e5 - 1.0).abs() < 1e-9);
    }

    /// What leaves grows without a jump from nothing, where saturation reaches the gas' pressure, to a vacuum's, where the flow reaches
    /// the speed of sound; a law that leaves everything or nothing jumps.
    #[test]
    fn what_leaves_into_a_gas_has_no_jump() {
        let alloy = titanium().evaporation.unwrap();
        for gas in [0.2, 1e3, 1e5] {
            let mut before = Jump::between(0.9 * gas, gas);
            assert_eq!(before.leaves(), 0.0);
            for n in 0..4000 {
                let jump = Jump::between(gas * (0.9 + 1.5e-3 * f64::from(n)), gas);
                assert!(
                    (jump.leaves() - before.leaves()).abs() < 2e-2,
                    "{gas}: {jump:?}"
                );
                assert!(jump.mach >= before.mach, "{gas}: {jump:?}");
                before = jump;
            }
            assert!((before.leaves() - 0.816).abs() < 2e-3 && before.mach == 1.0);
        }
        // heat and mass of the alloy: none below the gas' pressure, a vacuum's far above it
        let boils = |gas: f64| {
            (2000..6000)
                .map(f64::from)
                .find(|k| alloy.saturation(*k) > gas)
        };
        let kelvin = boils(1e5).unwrap();
        assert_eq!(alloy.flux(kelvin - 1.0, 1e5), 0.0);
        assert_eq!(alloy.recoil(kelvin - 1.0, 1e5), 0.0);
        assert!(alloy.flux(kelvin - 1.0, 0.2) > 100.0);
        let hot = boils(5e5).unwrap();
        assert!((alloy.flux(hot, 1e5) / alloy.flux(hot, 0.2) - 1.0).abs() < 0.01);
    }

    /// Choi et al. 2017: an activity coefficient of 0.044 to 0.0495 at 1860 °C; aluminium leaves first by far, though it is a tenth of
    /// the atoms.
    #[test]
    fn aluminium_leaves_with_its_measured_activity() {
        let alloy = titanium();
        let vapour = alloy.evaporation.unwrap();
        let names: Vec<&str> = vapour.components.iter().map(|c| &*c.name).collect();
        assert_eq!(names, ["titanium", "aluminium", "vanadium"]);
        let atoms: f64 = vapour.components.iter().map(|c| c.share).sum();
        assert!((atoms - 1.0).abs() < 1e-12);
        let by_mass = vapour.by_mass();
        assert!((by_mass[1] - 0.06).abs() < 2e-4 && (by_mass[2] - 0.04).abs() < 2e-4);
        let aluminium = &vapour.components[1];
        let kelvin = 1860.0 + CELSIUS;
        let pure = Component {
            share: 1.0,
            excess: 0.0,
            ..aluminium.clone()
        };
        let activity = aluminium.saturation(kelvin) / pure.saturation(kelvin) / aluminium.share;
        assert!((0.044..0.0495).contains(&activity), "{activity}");
        let [titanium, aluminium, ..] = vapour.mass(kelvin, 0.2);
        assert!(aluminium > titanium, "{aluminium} {titanium}");
        // hotter, titanium takes over
        let [titanium, aluminium, ..] = vapour.mass(3000.0, 0.2);
        assert!(titanium > aluminium, "{aluminium} {titanium}");
    }
}
