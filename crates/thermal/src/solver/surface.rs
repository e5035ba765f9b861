//! Heat that leaves through the build plane: radiation to the shield and, where wanted, evaporation.

use crate::material::Material;
use crate::material::enthalpy::{Enthalpy, Formulas, Piecewise};
use crate::material::vapour::Evaporation;
use crate::numeric::real::Real;
use crate::solver::kernel::warm;
use crate::solver::ledger::Ledger;
use crate::solver::steam::{Around, Evaporate, Steam};
use meltpath_numerics::vector::{Level, Loop};

/// Stefan-Boltzmann constant, W/(mm²·K⁴).
const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-14;

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
    /// What makes their surface hotter than they are.
    pub(crate) around: Around<'a, R>,
}

impl Surface {
    /// The law by which vapour leaves, and the pressure of the gas around, Pa; none where nothing evaporates.
    pub(crate) fn evaporates<'a>(&self, material: &'a Material) -> Option<(&'a Evaporation, f64)> {
        match self {
            Surface::Evaporating { ambient, .. } => {
                Some((material.evaporation.as_ref()?, *ambient))
            }
            _ => None,
        }
    }
}

impl<R: Real> Losses<R> {
    /// Of uppermost cells of `height` mm.
    pub(crate) fn new(
        surface: &Surface,
        material: &Material,
        curve: &Enthalpy,
        height: f64,
    ) -> Self {
        let (surroundings, none) = match *surface {
            Surface::Insulated => (0.0, true),
            Surface::Radiating { surroundings } | Surface::Evaporating { surroundings, .. } => {
                (surroundings, false)
            }
        };
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
            steam: Steam::new(surface.evaporates(material), material, curve, height),
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
            around: plane.around,
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

const LANES: usize = 64;

struct Radiate<'a, R> {
    losses: &'a Losses<R>,
    formulas: &'a Formulas<R>,
    share: R,
    enthalpy: &'a mut [R],
    density: &'a mut [R],
    radiated: &'a mut f64,
}

impl<R: Real> Loop for Radiate<'_, R> {
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
