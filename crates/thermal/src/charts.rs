//! Charts: the temperature history of a point near a beam at rest, against its depth, its distance from the beam and the
//! share of powder around it, for one setting of the beam.
//!
//! Béraud 2016, sections 3.2.1 and 3.2.2.2 ("abaques"): a moving beam is a beam at rest for a moment, then displaced.
//! Histories are kept in the enthalpy `g` of [`crate::material::enthalpy`] instead of the temperature: `g` goes on rising through
//! the phase change, so that no plateau has to be counted in time steps.

pub mod between;
pub mod build;
pub mod file;
pub mod neighbourhood;
pub mod rates;
pub mod simulation;

use serde::{Deserialize, Serialize};

use crate::solver::source::Depth;

/// Points of a heating curve, evenly spaced in enthalpy from nothing to its end.
pub(crate) const HEATING_POINTS: usize = 129;
/// Points of a cooling curve, evenly spaced in enthalpy from its beginning to its end.
pub(crate) const COOLING_POINTS: usize = 513;

/// What a set of charts was computed for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChartSettings {
    /// Power of the beam, W.
    pub power: f64,
    /// Diameter φ of its spot, mm.
    pub spot: f64,
    /// Share of the beam power that becomes heat.
    pub efficiency: f64,
    /// How the heat is spread below the surface.
    pub depth: Depth,
    /// Thickness of a powder layer, mm.
    pub layer: f64,
    /// Heating ends when the hottest point has this temperature, K, or when it has gone on for 10 ms.
    pub stop: f64,
    /// Cooling begins with the field in which the hottest point has this temperature, K: a smaller pool than at `stop`,
    /// since the pool that a moving beam leaves is smaller than that of a beam that has rested until then.
    pub cooling_from: f64,
    /// Cooling ends when no point is hotter than this, K.
    pub cold: f64,
    /// Edge of the solver's cells, and spacing of the charts in distance and depth, mm.
    pub cell: f64,
    /// Radius of the heated zone, mm (0.7 φ in the thesis).
    pub radius: f64,
    /// Depth of the heated zone, mm (3.5 times the penetration in the thesis).
    pub reach: f64,
    /// Temperature of what the build plane radiates to, K.
    pub surroundings: f64,
}

impl ChartSettings {
    /// The thesis' choices for a beam of `power` W on a spot of `spot` mm: heated zone of 1.4 φ across and 3.5 times the penetration of 0.1 mm deep,
    /// layers of 50 µm, spacing 25 µm, shield at 300 °C, heating up to 2800 °C, cooling from there down to 800 °C. Fast
    /// tracks at 300 W pass 3300 °C, and a chart cannot tell what lies above its end (erratum E10): raise `stop` for them.
    ///
    /// ```
    /// use meltpath_thermal::charts::ChartSettings;
    /// let settings = ChartSettings::for_beam(300.0, 0.41367);
    /// assert!((settings.heat() - 270.0).abs() < 1e-9);
    /// assert!((settings.radius - 0.2896).abs() < 1e-4);
    /// ```
    pub fn for_beam(power: f64, spot: f64) -> Self {
        let penetration = 0.1;
        ChartSettings {
            power,
            spot,
            efficiency: 0.9,
            depth: Depth::Falling { penetration },
            layer: 0.05,
            stop: 2800.0 + crate::material::CELSIUS,
            cooling_from: 2800.0 + crate::material::CELSIUS,
            cold: 800.0 + crate::material::CELSIUS,
            cell: 0.025,
            radius: 0.7 * spot,
            reach: 3.5 * penetration,
            surroundings: 300.0 + crate::material::CELSIUS,
        }
    }

    /// Heat that enters the metal, W.
    pub fn heat(&self) -> f64 {
        self.efficiency * self.power
    }

    /// Whether a beam of `power` W on a spot of `spot` mm is the one the charts are for, to a millionth.
    pub fn serves(&self, power: f64, spot: f64) -> bool {
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
        same(self.power, power) && same(self.spot, spot)
    }
}

/// Time to reach an enthalpy under a beam at rest; evenly spaced in enthalpy.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatingCurve {
    /// Enthalpy when the beam goes off, J/mm³.
    pub end: f32,
    /// Times at which `end · i/(n − 1)` is passed, s.
    pub times: Vec<f32>,
}

impl HeatingCurve {
    /// When enthalpy `g` is passed, s; the end of the curve above its end.
    pub fn time(&self, g: f64) -> f64 {
        let last = self.times.len() - 1;
        let x =
            (g / f64::from(self.end.max(f32::MIN_POSITIVE)) * last as f64).clamp(0.0, last as f64);
        let i = (x as usize).min(last - 1);
        let (a, b) = (f64::from(self.times[i]), f64::from(self.times[i + 1]));
        a + (x - i as f64) * (b - a)
    }
}

/// Cooling after the beam went off; evenly spaced in enthalpy.
#[derive(Debug, Clone, PartialEq)]
pub struct CoolingCurve {
    /// Enthalpies at its beginning and its end, J/mm³. Below the surface the first rise is left out.
    pub from: f32,
    /// See `from`.
    pub to: f32,
    /// Times since its beginning at which `from + (to − from) · i/(n − 1)` is passed, s.
    pub times: Vec<f32>,
}

impl CoolingCurve {
    /// Enthalpy lost per second at `g`, J/(mm³·s). Beyond either end the rate there in proportion to `g`, as of a body
    /// that cools towards the start temperature (docs/theory/sources.md, charts).
    pub fn rate(&self, g: f64) -> f64 {
        let (from, to) = (f64::from(self.from), f64::from(self.to));
        let last = self.times.len() - 1;
        let per_bin = (from - to) / last as f64;
        if per_bin <= 0.0 {
            return 0.0;
        }
        // rates of whole bins stand for their middles
        let bin = |i: usize| {
            per_bin / f64::from((self.times[i + 1] - self.times[i]).max(f32::MIN_POSITIVE))
        };
        let x = (from - g) / per_bin - 0.5;
        if x <= 0.0 {
            return bin(0) * g / (from - 0.5 * per_bin);
        }
        if x >= (last - 1) as f64 {
            return bin(last - 1) * g / (to + 0.5 * per_bin);
        }
        let i = x as usize;
        bin(i) + (x - i as f64) * (bin(i + 1) - bin(i))
    }
}

/// Histories over one arrangement of powder and metal.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Share of powder in the heated zone.
    pub powder_share: f64,
    /// Heating, depth by depth, distances within.
    pub heating: Vec<HeatingCurve>,
    /// Cooling on the axis of the beam, depth by depth.
    pub cooling: Vec<CoolingCurve>,
}

/// Histories over ground that earlier lines have warmed.
#[derive(Debug, Clone, PartialEq)]
pub struct WarmGround {
    /// Temperature of the ground at the start, and of the block's faces, K.
    pub temperature: f64,
    /// Its enthalpy above the start temperature, J/mm³; that of the histories is counted from here.
    pub enthalpy: f64,
    /// By rising share of powder, the same shares as over cold ground.
    pub charts: Vec<Chart>,
}

/// The charts of one setting of the beam.
#[derive(Debug, Clone, PartialEq)]
pub struct ChartSet {
    /// What they were computed for.
    pub settings: ChartSettings,
    /// Name of the material.
    pub material: String,
    /// Tells materials apart whose laws differ: see [`crate::material::enthalpy::Enthalpy::fingerprint`].
    pub fingerprint: u32,
    /// Depths below the build plane, mm, evenly spaced.
    pub depths: Vec<f64>,
    /// Distances from the axis of the beam, mm, evenly spaced from 0.
    pub distances: Vec<f64>,
    /// By rising share of powder.
    pub charts: Vec<Chart>,
    /// By rising temperature; needed where the simulation remembers what earlier lines left.
    pub warm: Vec<WarmGround>,
}

impl ChartSet {
    /// The heating curve of a chart at grid point (`depth`, `distance`).
    pub fn heating<'a>(&self, chart: &'a Chart, depth: usize, distance: usize) -> &'a HeatingCurve {
        &chart.heating[depth * self.distances.len() + distance]
    }
}

/// Why charts cannot be used for a path.
#[derive(Debug, thiserror::Error)]
pub enum ChartError {
    /// No set for a setting on the path.
    #[error(
        "there is no chart for {power:.1} W on {:.1} µm at {time:.6} s of the path (there are: {known}): compute one, it takes about a minute", spot * 1e3
    )]
    Missing {
        /// Power, W.
        power: f64,
        /// Diameter of the spot, mm.
        spot: f64,
        /// When the path asks for it, s.
        time: f64,
        /// The settings there are charts for.
        known: String,
    },
    /// Charts of another material.
    #[error(
        "the charts were computed for {found} with other laws than {wanted}: compute them again"
    )]
    Material {
        /// The charts' material.
        found: String,
        /// The material asked for.
        wanted: String,
    },
}
