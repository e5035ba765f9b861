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
    steam: Option<Steam<R>>,
    pub(crate) none: bool,
}

#[derive(Debug, Clone)]
struct Steam<R> {
    /// `g` from which on anything evaporates, and up to which it is tabled.
    range: [R; 2],
    per_entry: R,
    /// What evaporation takes, `a + b g` in W/mm², entry by entry.
    flux: Vec<[R; 2]>,
    /// Mass of each component that leaves with a joule, kg.
    mass: Vec<[f64; Evaporation::MOST]>,
}

/// Cells of the highest plane that lose heat during a step.
pub(crate) struct BuildPlane<'a, R> {
    pub(crate) formulas: &'a Formulas<R>,
    pub(crate) level: Level,
    /// The step, s.
    pub(crate) passed: f64,
    /// Of the cells, mm.
    pub(crate) height: f64,
    /// Of a cell, mm².
    pub(crate) area: f64,
    /// J/mm³ of dense metal.
    pub(crate) enthalpy: &'a mut [R],
    pub(crate) density: &'a mut [R],
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

    /// Takes what the build plane radiates and evaporates, and writes it down.
    pub(crate) fn take(&self, mut plane: BuildPlane<'_, R>, ledger: &mut Ledger) {
        self.radiate(&mut plane, ledger);
        self.evaporate(&mut plane, ledger);
    }

    /// Takes what it radiates.
    pub(crate) fn radiate(&self, plane: &mut BuildPlane<'_, R>, ledger: &mut Ledger) {
        let mut radiated = 0.0;
        plane.level.run(Radiate {
            losses: self,
            formulas: plane.formulas,
            share: R::of(plane.passed / plane.height),
            enthalpy: plane.enthalpy,
            density: plane.density,
            radiated: &mut radiated,
        });
        ledger.radiated += radiated * plane.area * plane.height;
    }

    /// Takes what evaporates.
    pub(crate) fn evaporate(&self, plane: &mut BuildPlane<'_, R>, ledger: &mut Ledger) {
        let Some(steam) = &self.steam else {
            return;
        };
        let (mut evaporated, mut vapour) = (0.0, [0.0; Evaporation::MOST]);
        plane.level.run(Evaporate {
            steam,
            formulas: plane.formulas,
            share: R::of(plane.passed / plane.height),
            enthalpy: plane.enthalpy,
            density: plane.density,
            evaporated: &mut evaporated,
            vapour: &mut vapour,
        });
        let volume = plane.area * plane.height;
        ledger.evaporated += evaporated * volume;
        for (sum, mass) in ledger.vapour.iter_mut().zip(vapour) {
            *sum += mass * volume;
        }
    }
}

impl<R: Real> Steam<R> {
    fn new(law: &Evaporation, ambient: f64, curve: &Enthalpy) -> Self {
        // nothing evaporates below the liquidus
        let first = curve.at_liquidus;
        let step = (curve.of(6000.0) - first) / ENTRIES as f64;
        let g = |i: usize| first + step * i as f64;
        let kelvins: Vec<f64> = (0..=ENTRIES).map(|i| curve.temperature(g(i))).collect();
        let fluxes: Vec<f64> = kelvins.iter().map(|k| law.flux(*k, ambient)).collect();
        let line = |(i, flux): (usize, &[f64])| {
            let slope = (flux[1] - flux[0]) / step;
            [flux[0] - slope * g(i), slope].map(R::of)
        };
        let per_joule = |kelvin: &f64| {
            let flux = law.flux(*kelvin, ambient).max(f64::MIN_POSITIVE);
            law.mass(*kelvin, ambient).map(|mass| mass / flux)
        };
        Steam {
            range: [g(0), g(ENTRIES)].map(R::of),
            per_entry: R::of(1.0 / step),
            flux: fluxes.windows(2).enumerate().map(line).collect(),
            mass: kelvins.iter().map(per_joule).collect(),
        }
    }

    /// Heat that each cell loses, J/mm³, with `share = dt/height`, and the entry of the table that it stands at; implicit, so that a
    /// step never overshoots. Zero where nothing evaporates.
    #[inline(always)]
    fn over(&self, g: &[R; LANES], share: R) -> ([R; LANES], [u32; LANES]) {
        let [first, last] = self.range;
        let (mut entry, mut line) = ([0_u32; LANES], [[R::ZERO; LANES]; 2]);
        for i in 0..LANES {
            let place = (g[i].larger(first) - first) * self.per_entry;
            entry[i] = place.whole().min(ENTRIES as u32 - 1);
        }
        for i in 0..LANES {
            [line[0][i], line[1][i]] = self.flux[entry[i] as usize];
        }
        let mut heat = [R::ZERO; LANES];
        for i in 0..LANES {
            let [a, b] = [line[0][i], line[1][i]];
            let lost = share * (a + b * g[i].smaller(last)) / (R::ONE + share * b);
            heat[i] = if g[i] > first { lost } else { R::ZERO };
        }
        (heat, entry)
    }
}

const LANES: usize = 64;

struct Evaporate<'a, R> {
    steam: &'a Steam<R>,
    formulas: &'a Formulas<R>,
    share: R,
    enthalpy: &'a mut [R],
    density: &'a mut [R],
    evaporated: &'a mut f64,
    vapour: &'a mut [f64; Evaporation::MOST],
}

impl<R: Real> CellLoop for Evaporate<'_, R> {
    #[inline(always)]
    fn run(mut self) {
        let (groups, rest) = std::mem::take(&mut self.enthalpy).as_chunks_mut::<LANES>();
        let (of_density, density_rest) = std::mem::take(&mut self.density).as_chunks_mut();
        for (g, r) in groups.iter_mut().zip(of_density) {
            self.group(g, r);
        }
        if !rest.is_empty() {
            // what is left of the group is no cell, too cold to evaporate
            let (mut g, mut r) = ([R::ZERO; LANES], [R::ONE; LANES]);
            g[..rest.len()].copy_from_slice(rest);
            r[..rest.len()].copy_from_slice(density_rest);
            self.group(&mut g, &mut r);
            rest.copy_from_slice(&g[..rest.len()]);
            density_rest.copy_from_slice(&r[..rest.len()]);
        }
    }
}

impl<R: Real> Evaporate<'_, R> {
    #[inline(always)]
    fn group(&mut self, g: &mut [R; LANES], r: &mut [R; LANES]) {
        let first = self.steam.range[0];
        let (mut hot, mut powder) = (0_u32, 0_u32);
        for i in 0..LANES {
            hot |= u32::from(g[i] > first);
            powder |= u32::from(r[i] < R::ONE);
        }
        // most cells are cold
        if hot == 0 {
            return;
        }
        let (heat, entry) = self.steam.over(g, self.share);
        let mut sums = [0.0_f64; LANES];
        for i in 0..LANES {
            sums[i] = heat[i].wide();
        }
        let add = |sum: &mut [f64; Evaporation::MOST], i: usize| {
            let mass = &self.steam.mass[entry[i] as usize];
            for c in 0..Evaporation::MOST {
                sum[c] += sums[i] * mass[c];
            }
        };
        // sums that do not wait for each other, in a fixed order
        let (mut even, mut odd) = (*self.vapour, [0.0; Evaporation::MOST]);
        for i in (0..LANES).step_by(2) {
            add(&mut even, i);
            add(&mut odd, i + 1);
        }
        for c in 0..Evaporation::MOST {
            self.vapour[c] = even[c] + odd[c];
        }
        *self.evaporated += sums.iter().sum::<f64>();
        if powder == 0 {
            for i in 0..LANES {
                g[i] += -heat[i];
            }
            return;
        }
        for i in (0..LANES).filter(|&i| heat[i] > R::ZERO) {
            if r[i] < R::ONE {
                (g[i], r[i]) = warm(self.formulas, g[i], r[i], -heat[i]);
            } else {
                g[i] += -heat[i];
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
