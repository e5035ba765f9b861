//! What leaves the build plane as vapour, by the temperature of the surface itself: under a beam it is hotter than the cells below it.
//!
//! [`Depth::lift`](crate::solver::source::Depth::lift) tells how much hotter it would be if nothing left. Of what leaves, the surface is
//! colder by `v h/3` in `θ`, so that the flux `v` follows from the `θ` before vapour took its share: one table. A surface that is taken
//! as hot as its cell loses several times too little on planes as high as a layer.

use crate::material::Material;
use crate::material::enthalpy::{Enthalpy, Formulas};
use crate::material::vapour::Evaporation;
use crate::numeric::real::Real;
use crate::solver::kernel::warm;
use meltpath_numerics::vector::Loop;

const ENTRIES: usize = 4096;
/// Cells that loops take together.
const LANES: usize = 64;
/// Share of the metal's conductivity below which a cell counts as powder, as hot as its surface.
const CONDUCTS: f64 = 0.9;
/// How far above the boiling point of its main component a surface is tabled, K; beyond, the flux goes on along a line.
const ABOVE_BOILING: f64 = 1000.0;
/// Part of the enthalpy at the solidus over which `θ` is differentiated.
const NUDGE: f64 = 0.01;

/// What of the uppermost cells makes their surface hotter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lift<R> {
    /// [`Depth::lift`](crate::solver::source::Depth::lift) over the step that the heat arrived in, mm/s.
    pub(crate) per_heat: R,
    /// Share of the difference from the cell below.
    pub(crate) below: R,
}

impl<R: Real> Lift<R> {
    /// Of planes of `height` mm on planes of `under` mm, over a step of `step` s in which heat arrives with this `lift`, mm.
    pub(crate) fn new(lift: f64, step: f64, [height, under]: [f64; 2]) -> Self {
        Lift {
            per_heat: R::of(lift / step),
            below: R::of(height / (3.0 * (height + under))),
        }
    }

    /// How much higher `θ` is on the surface of a cell of this `θ` before vapour takes its share, W/mm: with the heat that arrived,
    /// J/mm², `θ` of the cell `below`, and the cell's share of the metal's conductivity.
    #[inline(always)]
    pub(crate) fn of(&self, arrived: R, theta: R, below: R, share: R) -> R {
        let hotter = self.per_heat * arrived + self.below * (theta - below);
        if share < R::of(CONDUCTS) {
            R::ZERO
        } else {
            hotter.larger(R::ZERO)
        }
    }
}

/// What lies on and under the cells of a build plane; as many values as cells each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Around<'a, R> {
    pub(crate) lift: Lift<R>,
    /// Heat that arrived during the step, J/mm².
    pub(crate) arrived: &'a [R],
    /// `θ` of the cells below, W/mm.
    pub(crate) below: &'a [R],
}

/// Against the `θ` that the surface would have if nothing left: what leaves, and how hot the surface is.
#[derive(Debug, Clone)]
pub(crate) struct BeforeVapour {
    /// W/mm.
    pub(crate) theta: Vec<f64>,
    pub(crate) kelvin: Vec<f64>,
    /// What vapour takes, W/mm².
    pub(crate) flux: Vec<f64>,
}

impl BeforeVapour {
    /// Over uppermost cells of `height` mm, from the liquidus to `hottest` K.
    pub(crate) fn new(
        law: Option<(&Evaporation, f64)>,
        material: &Material,
        curve: &Enthalpy,
        [height, hottest]: [f64; 2],
    ) -> Self {
        let step = (hottest - material.liquidus) / ENTRIES as f64;
        let kelvin: Vec<f64> = (0..=ENTRIES)
            .map(|n| material.liquidus + n as f64 * step)
            .collect();
        let flux = |k: &f64| law.map_or(0.0, |(law, ambient)| law.flux(*k, ambient));
        let flux: Vec<f64> = kelvin.iter().map(flux).collect();
        let of = |(k, flux): (&f64, &f64)| curve.kirchhoff_at(*k) + flux * height / 3.0;
        BeforeVapour {
            theta: kelvin.iter().zip(&flux).map(of).collect(),
            kelvin,
            flux,
        }
    }

    /// Where `theta` stands: the entry that it lies behind, and the share of the way to the next.
    pub(crate) fn place(&self, theta: f64) -> (usize, f64) {
        let n = self.theta.partition_point(|t| *t <= theta);
        let n = n.clamp(1, ENTRIES) - 1;
        let [before, after] = [self.theta[n], self.theta[n + 1]];
        (n, (theta - before) / (after - before))
    }

    /// Temperature of the surface whose `θ` is `theta` before vapour takes its share, K.
    pub(crate) fn temperature(&self, curve: &Enthalpy, theta: f64) -> f64 {
        if theta <= self.theta[0] {
            return curve.of_kirchhoff(theta).min(self.kelvin[0]);
        }
        let (n, share) = self.place(theta);
        self.kelvin[n] + share.min(1.0) * (self.kelvin[n + 1] - self.kelvin[n])
    }
}

/// What vapour takes, tabled.
#[derive(Debug, Clone)]
pub(crate) struct Steam<R> {
    /// `θ` before vapour from which on anything evaporates, W/mm.
    first: R,
    per_entry: R,
    /// What evaporation takes, `a + b θ` in W/mm², entry by entry.
    flux: Vec<[R; 2]>,
    /// Mass of each component that leaves with a joule, kg.
    mass: Vec<[f64; Evaporation::MOST]>,
}

impl<R: Real> Steam<R> {
    /// Of a law into a gas at `ambient` Pa, over uppermost cells of `height` mm; none where nothing evaporates.
    pub(crate) fn new(
        law: Option<(&Evaporation, f64)>,
        material: &Material,
        curve: &Enthalpy,
        height: f64,
    ) -> Option<Self> {
        let (law, ambient) = law?;
        let boiling = law.components.first()?.boiling;
        let hottest = boiling.max(material.liquidus) + ABOVE_BOILING;
        let of = BeforeVapour::new(Some((law, ambient)), material, curve, [height, hottest]);
        let first = of.theta[0];
        let step = (of.theta[ENTRIES] - first) / ENTRIES as f64;
        let at = |i: usize| first + step * i as f64;
        let place = |i: usize| {
            let (n, share) = of.place(at(i));
            let between = |values: &[f64]| values[n] + share * (values[n + 1] - values[n]);
            [between(&of.flux), between(&of.kelvin)]
        };
        let places: Vec<[f64; 2]> = (0..=ENTRIES).map(place).collect();
        let line = |(i, ends): (usize, &[[f64; 2]])| {
            let slope = (ends[1][0] - ends[0][0]) / step;
            [ends[0][0] - slope * at(i), slope].map(R::of)
        };
        let per_joule = |[_, kelvin]: &[f64; 2]| {
            let flux = law.flux(*kelvin, ambient).max(f64::MIN_POSITIVE);
            law.mass(*kelvin, ambient).map(|mass| mass / flux)
        };
        Some(Steam {
            first: R::of(first),
            per_entry: R::of(1.0 / step),
            flux: places.windows(2).enumerate().map(line).collect(),
            mass: places.iter().map(per_joule).collect(),
        })
    }
}

/// Takes what evaporates from the cells of a build plane.
pub(crate) struct Evaporate<'a, R> {
    pub(crate) steam: &'a Steam<R>,
    pub(crate) formulas: &'a Formulas<R>,
    /// The step over the height of the cells, s/mm.
    pub(crate) share: R,
    pub(crate) around: Around<'a, R>,
    pub(crate) enthalpy: &'a mut [R],
    pub(crate) density: &'a mut [R],
    /// What left, J/mm³ of the cells, and the mass of each component with it.
    pub(crate) evaporated: &'a mut f64,
    pub(crate) vapour: &'a mut [f64; Evaporation::MOST],
}

impl<R: Real> Loop for Evaporate<'_, R> {
    #[inline(always)]
    fn run(mut self) {
        let (groups, rest) = std::mem::take(&mut self.enthalpy).as_chunks_mut::<LANES>();
        let (of_density, density_rest) = std::mem::take(&mut self.density).as_chunks_mut();
        let (arrived, arrived_rest) = self.around.arrived.as_chunks();
        let (below, below_rest) = self.around.below.as_chunks();
        for ((g, r), around) in groups
            .iter_mut()
            .zip(of_density)
            .zip(arrived.iter().zip(below))
        {
            self.group(g, r, around);
        }
        if !rest.is_empty() {
            // what is left of the group is no cell, too cold to evaporate
            let (mut g, mut r) = ([R::ZERO; LANES], [R::ONE; LANES]);
            let (mut a, mut b) = ([R::ZERO; LANES], [R::ZERO; LANES]);
            g[..rest.len()].copy_from_slice(rest);
            r[..rest.len()].copy_from_slice(density_rest);
            a[..rest.len()].copy_from_slice(arrived_rest);
            b[..rest.len()].copy_from_slice(below_rest);
            self.group(&mut g, &mut r, (&a, &b));
            rest.copy_from_slice(&g[..rest.len()]);
            density_rest.copy_from_slice(&r[..rest.len()]);
        }
    }
}

impl<R: Real> Evaporate<'_, R> {
    #[inline(always)]
    fn group(
        &mut self,
        g: &mut [R; LANES],
        r: &mut [R; LANES],
        (arrived, below): (&[R; LANES], &[R; LANES]),
    ) {
        let f = self.formulas;
        let mut may = 0_u32;
        for i in 0..LANES {
            may |= u32::from(g[i] > f.solidus()) | u32::from(arrived[i] > R::ZERO);
        }
        // most cells are cold
        if may == 0 {
            return;
        }
        let first = self.steam.first;
        let (mut theta, mut face) = ([R::ZERO; LANES], [R::ZERO; LANES]);
        f.kirchhoff_of_all(g, &mut theta);
        let (mut hot, mut powder) = (0_u32, 0_u32);
        for i in 0..LANES {
            let lift = self.around.lift;
            face[i] = theta[i] + lift.of(arrived[i], theta[i], below[i], f.conduction(r[i]));
            hot |= u32::from(face[i] > first);
            powder |= u32::from(r[i] < R::ONE);
        }
        if hot == 0 {
            return;
        }
        let (heat, entry) = self.over(g, &theta, &face);
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
                (g[i], r[i]) = warm(f, g[i], r[i], -heat[i]);
            } else {
                g[i] += -heat[i];
            }
        }
    }

    /// Heat that each cell loses, J/mm³, and the entry of the table that its surface stands at; implicit, so that a step never
    /// overshoots. Zero where nothing evaporates.
    #[inline(always)]
    fn over(
        &self,
        g: &[R; LANES],
        theta: &[R; LANES],
        face: &[R; LANES],
    ) -> ([R; LANES], [u32; LANES]) {
        let steam = self.steam;
        let nudge = R::of(NUDGE) * self.formulas.solidus();
        let (mut colder, mut theta_colder) = ([R::ZERO; LANES], [R::ZERO; LANES]);
        for i in 0..LANES {
            colder[i] = g[i] - nudge;
        }
        self.formulas.kirchhoff_of_all(&colder, &mut theta_colder);
        let (mut entry, mut line) = ([0_u32; LANES], [[R::ZERO; LANES]; 2]);
        for i in 0..LANES {
            let place = (face[i].larger(steam.first) - steam.first) * steam.per_entry;
            entry[i] = place.whole().min(ENTRIES as u32 - 1);
        }
        for i in 0..LANES {
            [line[0][i], line[1][i]] = steam.flux[entry[i] as usize];
        }
        let mut heat = [R::ZERO; LANES];
        for i in 0..LANES {
            let [a, b] = [line[0][i], line[1][i]];
            let follows = if face[i] > theta[i] {
                R::ONE + self.around.lift.below
            } else {
                R::ONE
            };
            let slope = b * follows * (theta[i] - theta_colder[i]) / nudge;
            let lost = self.share * (a + b * face[i]) / (R::ONE + self.share * slope);
            heat[i] = if face[i] > steam.first { lost } else { R::ZERO };
        }
        (heat, entry)
    }
}
