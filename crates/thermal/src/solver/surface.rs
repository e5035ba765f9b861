//! Heat that leaves through the build plane: radiation to the shield and, where wanted, evaporation.

use crate::material::Material;
use crate::material::enthalpy::{Enthalpy, Formulas, Piecewise};
use crate::material::vapour::Evaporation;
use crate::numeric::real::Real;
use crate::numeric::vector::{CellLoop, Level};
use crate::solver::kernel::warm;
use crate::solver::ledger::Ledger;

/// Stefan-Boltzmann constant, W/(mm²·K⁴).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-14;
const ENTRIES: usize = 4096;

/// What the build plane sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surface {
    /// Nothing leaves.
    Insulated,
    /// Radiation to surroundings at this temperature, K.
    Radiating {
        /// Temperature of the surroundings, K.
        surroundings: f64,
    },
    /// Radiation, and evaporation by the law of the material where it has one.
    Evaporating {
        /// Temperature of the surroundings, K.
        surroundings: f64,
        /// Pressure of the gas around, Pa.
        ambient: f64,
    },
}

/// Losses against enthalpy: radiation of a black surface in the form of the cell loops, evaporation in a table.
#[derive(Debug, Clone)]
pub(crate) struct Losses<R> {
    black: Piecewise<R>,
    emissivity: [R; 2],
    steam: Option<Steam>,
    pub(crate) none: bool,
}

#[derive(Debug, Clone)]
struct Steam {
    first: f64,
    per_entry: f64,
    flux: Vec<f64>,
    /// Mass of each component that leaves with a joule, kg, entry by entry.
    mass: Vec<[f64; Evaporation::MOST]>,
}

impl<R: Real> Losses<R> {
    pub(crate) fn new(surface: &Surface, material: &Material, curve: &Enthalpy) -> Self {
        let (surroundings, ambient, none) = match *surface {
            Surface::Insulated => (0.0, None, true),
            Surface::Radiating { surroundings } => (surroundings, None, false),
            Surface::Evaporating {
                surroundings,
                ambient,
            } => (surroundings, Some(ambient), false),
        };
        let law = material.evaporation.as_ref();
        let black = curve.piecewise(
            material,
            |kelvin| STEFAN_BOLTZMANN * (kelvin.powi(4) - surroundings.powi(4)),
            4.0 * STEFAN_BOLTZMANN * 4500.0_f64.powi(3),
        );
        Losses {
            black: Enthalpy::in_precision(&black),
            emissivity: [
                R::of(material.emissivity),
                R::of(material.powder.emissivity),
            ],
            steam: ambient
                .zip(law)
                .map(|(ambient, law)| Steam::new(law, ambient, curve)),
            none,
        }
    }

    /// Takes what the top plane, of cells `height` mm high over `area` mm², radiates and evaporates during `dt` from its cells, and
    /// writes it down.
    pub(crate) fn take(
        &self,
        f: &Formulas<R>,
        level: Level,
        [dt, height, area]: [f64; 3],
        [enthalpy, density]: [&mut [R]; 2],
        ledger: &mut Ledger,
    ) {
        let mut radiated = 0.0;
        level.run(Radiate {
            losses: self,
            formulas: f,
            share: R::of(dt / height),
            enthalpy,
            density,
            radiated: &mut radiated,
        });
        let volume = area * height;
        ledger.radiated += radiated * volume;
        let Some(steam) = &self.steam else {
            return;
        };
        let (mut evaporated, mut vapour) = (0.0, [0.0; Evaporation::MOST]);
        level.run(Evaporate {
            steam,
            formulas: f,
            share: dt / height,
            enthalpy,
            density,
            evaporated: &mut evaporated,
            vapour: &mut vapour,
        });
        ledger.evaporated += evaporated * volume;
        for (sum, mass) in ledger.vapour.iter_mut().zip(vapour) {
            *sum += mass * volume;
        }
    }
}

impl Steam {
    fn new(law: &Evaporation, ambient: f64, curve: &Enthalpy) -> Self {
        // nothing evaporates below the liquidus
        let first = curve.at_liquidus;
        let step = (curve.of(6000.0) - first) / ENTRIES as f64;
        let at = |i: usize| curve.temperature(first + step * i as f64);
        let kelvins: Vec<f64> = (0..=ENTRIES).map(at).collect();
        let per_joule = |kelvin: &f64| {
            let flux = law.flux(*kelvin, ambient).max(f64::MIN_POSITIVE);
            law.mass(*kelvin, ambient).map(|mass| mass / flux)
        };
        Steam {
            first,
            per_entry: 1.0 / step,
            flux: kelvins.iter().map(|k| law.flux(*k, ambient)).collect(),
            mass: kelvins.iter().map(per_joule).collect(),
        }
    }

    /// Heat carried away, J/mm³, with `share = dt/height`, and the mass of each component that leaves with a joule, kg; implicit, so
    /// that a step never overshoots.
    #[inline(always)]
    fn over(&self, g: f64, share: f64) -> (f64, &[f64; Evaporation::MOST]) {
        let place = ((g - self.first) * self.per_entry).clamp(0.0, ENTRIES as f64 - 1e-9);
        let i = place as usize;
        let rise = self.flux[i + 1] - self.flux[i];
        let flux = self.flux[i] + (place - i as f64) * rise;
        let heat = share * flux / (1.0 + share * rise * self.per_entry);
        (heat, &self.mass[i])
    }
}

const LANES: usize = 64;

struct Evaporate<'a, R> {
    steam: &'a Steam,
    formulas: &'a Formulas<R>,
    share: f64,
    enthalpy: &'a mut [R],
    density: &'a mut [R],
    evaporated: &'a mut f64,
    vapour: &'a mut [f64; Evaporation::MOST],
}

impl<R: Real> CellLoop for Evaporate<'_, R> {
    #[inline(always)]
    fn run(self) {
        let first = R::of(self.steam.first);
        let groups = self.enthalpy.chunks_mut(LANES);
        for (g, r) in groups.zip(self.density.chunks_mut(LANES)) {
            // most cells are cold
            if g.iter().fold(0_u32, |any, g| any | u32::from(*g > first)) == 0 {
                continue;
            }
            for (g, r) in g.iter_mut().zip(r).filter(|(g, _)| **g > first) {
                let (heat, per_joule) = self.steam.over(g.wide(), self.share);
                *self.evaporated += heat;
                for (sum, mass) in self.vapour.iter_mut().zip(per_joule) {
                    *sum += heat * mass;
                }
                if *r < R::ONE {
                    (*g, *r) = warm(self.formulas, *g, *r, R::of(-heat));
                } else {
                    *g += R::of(-heat);
                }
            }
        }
    }
}

struct Radiate<'a, R> {
    losses: &'a Losses<R>,
    formulas: &'a Formulas<R>,
    share: R,
    enthalpy: &'a mut [R],
    density: &'a mut [R],
    radiated: &'a mut f64,
}

impl<R: Real> CellLoop for Radiate<'_, R> {
    #[inline(always)]
    fn run(self) {
        let (black, f) = (self.losses.black, *self.formulas);
        let [dense, powder] = self.losses.emissivity.map(|e| e * self.share);
        // sums by lane, in a fixed order
        let mut sums = [0.0_f64; LANES];
        let (groups, rest) = self.enthalpy.as_chunks_mut::<LANES>();
        let (of_density, density_rest) = self.density.as_chunks_mut::<LANES>();
        for (g, r) in groups.iter_mut().zip(of_density) {
            radiate(&black, &f, [dense, powder], g, r, &mut sums);
        }
        if !rest.is_empty() {
            // at the start temperature nothing radiates that would be counted: what is left of the group is no cell
            let (mut g, mut r) = ([R::ZERO; LANES], [R::ONE; LANES]);
            g[..rest.len()].copy_from_slice(rest);
            r[..rest.len()].copy_from_slice(density_rest);
            let mut of_rest = [0.0; LANES];
            radiate(&black, &f, [dense, powder], &mut g, &mut r, &mut of_rest);
            rest.copy_from_slice(&g[..rest.len()]);
            density_rest.copy_from_slice(&r[..rest.len()]);
            for (sum, heat) in sums.iter_mut().zip(&of_rest[..rest.len()]) {
                *sum += heat;
            }
        }
        *self.radiated = sums.iter().sum();
    }
}

/// What a group of cells radiates, with shares of the black surface's for metal and powder; added to the sums by lane.
#[inline(always)]
fn radiate<R: Real>(
    black: &Piecewise<R>,
    f: &Formulas<R>,
    [dense, powder]: [R; 2],
    g: &mut [R; LANES],
    r: &mut [R; LANES],
    sums: &mut [f64; LANES],
) {
    let mut heat = [R::ZERO; LANES];
    let powdery = r.iter().fold(0_u32, |any, r| any | u32::from(*r < R::ONE));
    black.of_all(g, &mut heat);
    if powdery == 0 {
        for lane in 0..LANES {
            heat[lane] = dense * heat[lane];
            g[lane] += -heat[lane];
        }
    } else {
        let mut gains = 0_u32;
        for lane in 0..LANES {
            heat[lane] = heat[lane] * if r[lane] < R::ONE { powder } else { dense };
            gains |= u32::from(heat[lane] < R::ZERO);
        }
        // what cools grows no denser
        if gains == 0 {
            for lane in 0..LANES {
                g[lane] += -(heat[lane] / r[lane]);
            }
        } else {
            for lane in 0..LANES {
                (g[lane], r[lane]) = warm(f, g[lane], r[lane], -heat[lane]);
            }
        }
    }
    for (sum, heat) in sums.iter_mut().zip(&heat) {
        *sum += heat.wide();
    }
}
