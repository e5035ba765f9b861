//! Enthalpy and Kirchhoff integrals of a material, and the short formulas the cell loops use in their place.
//!
//! With `g = ∫ ρ c_p dT` (J/mm³ of dense material, latent heat included, zero at the start temperature) and
//! `θ = ∫ k dT` (W/mm) the heat equation of a cell whose relative density is `r` reads `r ∂g/∂t = ∇·(c ∇θ) + S`,
//! with `c` the powder's share of the conductivity. The only law a cell needs in every step is then `θ(g)`, and no
//! step can jump over the latent heat.

use crate::material::Material;
use crate::material::law::straight_pieces;
use crate::numeric::real::Real;
use meltpath_numerics::halving;

const SOLID_ORDER: usize = 4;
const LIQUID_ORDER: usize = 5;
const MELTING_PIECES: usize = 8;
/// Corners of the powder's conductivity between fresh and dense.
pub(crate) const BENDS: usize = 4;
/// Cells whose sums over all pieces of melting are kept in registers; divides the number of cells that are asked for together.
const TOGETHER: usize = 16;
/// Where the tables end, K: above the boiling points of the metals in use; beyond, laws go on in straight lines.
const CEILING: f64 = 4500.0;
/// How far below the start temperature they begin, K.
pub const BELOW: f64 = 100.0;

/// Why no enthalpy curve can be made of a material.
#[derive(Debug, thiserror::Error)]
pub enum CurveError {
    /// A law gives a value that no material has.
    #[error(
        "at {celsius:.0} °C the laws of {material} give heat capacity {capacity:.3e} J/(mm³·K) and conductivity {conductivity:.3e} W/(mm·K): both must be above zero up to {ceiling:.0} °C"
    )]
    Law {
        /// Name of the material.
        material: String,
        /// Where, °C.
        celsius: f64,
        /// Heat capacity there.
        capacity: f64,
        /// Conductivity there.
        conductivity: f64,
        /// Temperature up to which the laws are needed, °C.
        ceiling: f64,
    },
    /// The short formulas do not follow the laws.
    #[error(
        "the laws of {material} are too rough for the solver's formulas: they miss by {error:.2} K near {celsius:.0} °C, 2 K are allowed; give smoother laws"
    )]
    Fit {
        /// Name of the material.
        material: String,
        /// Largest error, K.
        error: f64,
        /// Where, °C.
        celsius: f64,
    },
}

/// Tables of `g(T)` and `θ(T)`, and of the heat taken by powder on first heating.
#[derive(Debug, Clone)]
pub struct Enthalpy {
    kelvin: Vec<f64>,
    dense: Vec<f64>,
    kirchhoff: Vec<f64>,
    /// `∫ r dg` along first heating: what powder takes.
    powder: Vec<f64>,
    capacity_last: f64,
    conductivity_last: f64,
    /// `g` at the solidus.
    pub at_solidus: f64,
    /// `g` at the liquidus.
    pub at_liquidus: f64,
    /// Largest diffusivity `dθ/dg` anywhere, mm²/s.
    pub diffusivity_max: f64,
    /// The same below the solidus, mm²/s.
    pub diffusivity_solid: f64,
    formulas: Formulas<f64>,
    /// Largest difference between formulas and tables, K.
    pub fit_error: f64,
}

/// A function of `g` in a form without tables or branches, so that loops over cells run in vector registers:
/// a polynomial for the solid, straight pieces for melting, a polynomial for the liquid.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piecewise<R> {
    solidus: R,
    liquidus: R,
    ceiling: R,
    at_zero: R,
    solid: [R; SOLID_ORDER],
    knots: [R; MELTING_PIECES],
    bends: [R; MELTING_PIECES],
    liquid: [R; LIQUID_ORDER],
    beyond: R,
}

impl<R: Real> Piecewise<R> {
    /// The value for any `g`.
    #[inline(always)]
    pub(crate) fn at(&self, g: R) -> R {
        let in_melting = g.smaller(self.liquidus);
        let over = g.larger(self.liquidus).smaller(self.ceiling) - self.liquidus;
        let mut value = self.solid(g.smaller(self.solidus));
        for (knot, bend) in self.knots.iter().zip(&self.bends) {
            value += *bend * (in_melting - *knot).larger(R::ZERO);
        }
        value += polynomial(&self.liquid, over);
        value + self.beyond * (g - self.ceiling).larger(R::ZERO)
    }

    /// The values for many `g`, one term after the other, so that each is a loop over vector registers.
    #[inline(always)]
    pub(crate) fn of_all<const N: usize>(&self, g: &[R; N], out: &mut [R; N]) {
        let mut melting = 0_u32;
        for i in 0..N {
            melting |= u32::from(g[i] > self.solidus);
            out[i] = self.solid(g[i].smaller(self.solidus));
        }
        if melting == 0 {
            return;
        }
        const { assert!(N.is_multiple_of(TOGETHER)) };
        // a register's worth of cells at a time: sums stay in it over all pieces
        let knots = self.knots;
        let bends = self.bends;
        for (g, out) in g
            .as_chunks::<TOGETHER>()
            .0
            .iter()
            .zip(out.as_chunks_mut::<TOGETHER>().0)
        {
            let (mut below, mut sum) = ([R::ZERO; TOGETHER], *out);
            for i in 0..TOGETHER {
                below[i] = g[i].smaller(self.liquidus);
            }
            for n in 0..MELTING_PIECES {
                for i in 0..TOGETHER {
                    sum[i] += bends[n] * (below[i] - knots[n]).larger(R::ZERO);
                }
            }
            *out = sum;
        }
        for i in 0..N {
            let over = g[i].larger(self.liquidus).smaller(self.ceiling) - self.liquidus;
            out[i] += polynomial(&self.liquid, over);
            out[i] += self.beyond * (g[i] - self.ceiling).larger(R::ZERO);
        }
    }

    /// The value for `g` not above the solidus.
    #[inline(always)]
    pub(crate) fn solid(&self, g: R) -> R {
        self.at_zero + polynomial(&self.solid, g)
    }

    fn cast<Q: Real>(&self) -> Piecewise<Q> {
        let one = |x: R| Q::of(x.wide());
        Piecewise {
            solidus: one(self.solidus),
            liquidus: one(self.liquidus),
            ceiling: one(self.ceiling),
            at_zero: one(self.at_zero),
            solid: self.solid.map(one),
            knots: self.knots.map(one),
            bends: self.bends.map(one),
            liquid: self.liquid.map(one),
            beyond: one(self.beyond),
        }
    }
}

/// The laws of a material as the cell loops use them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Formulas<R> {
    kirchhoff: Piecewise<R>,
    start_density: R,
    density: [R; SOLID_ORDER],
    conduction: [R; 2],
    /// Where the slope of the conduction changes, and by how much.
    bends: [[R; 2]; BENDS],
}

impl<R: Real> Formulas<R> {
    /// `θ` of a cell that may be anything, W/mm.
    #[inline(always)]
    pub(crate) fn kirchhoff(&self, g: R) -> R {
        self.kirchhoff.at(g)
    }

    /// `θ` of many cells, W/mm.
    #[inline(always)]
    pub(crate) fn kirchhoff_of_all<const N: usize>(&self, g: &[R; N], out: &mut [R; N]) {
        self.kirchhoff.of_all(g, out);
    }

    /// `θ` of a cell that is not above the solidus, W/mm.
    #[inline(always)]
    pub(crate) fn kirchhoff_solid(&self, g: R) -> R {
        self.kirchhoff.solid(g)
    }

    /// Relative density of powder heated for the first time to `g`.
    #[inline(always)]
    pub(crate) fn relative_density(&self, g: R) -> R {
        let x = g.larger(R::ZERO).smaller(self.kirchhoff.solidus);
        let fitted = (self.start_density + polynomial(&self.density, x)).smaller(R::ONE);
        if g < self.kirchhoff.solidus {
            fitted
        } else {
            R::ONE
        }
    }

    /// Share of the dense conductivity at relative density `r`.
    #[inline(always)]
    pub(crate) fn conduction(&self, r: R) -> R {
        let mut share = self.conduction[0] + self.conduction[1] * r;
        for [knot, bend] in self.bends {
            share += bend * (r - knot).larger(R::ZERO);
        }
        share
    }

    /// `g` at the solidus, J/mm³.
    #[inline(always)]
    pub(crate) fn solidus(&self) -> R {
        self.kirchhoff.solidus
    }

    fn cast<Q: Real>(&self) -> Formulas<Q> {
        let one = |x: R| Q::of(x.wide());
        Formulas {
            kirchhoff: self.kirchhoff.cast(),
            start_density: one(self.start_density),
            density: self.density.map(one),
            conduction: self.conduction.map(one),
            bends: self.bends.map(|bend| bend.map(one)),
        }
    }
}

/// `x (c₀ + c₁ x + …)`.
#[inline(always)]
fn polynomial<R: Real, const N: usize>(coefficients: &[R; N], x: R) -> R {
    let mut sum = R::ZERO;
    for c in coefficients.iter().rev() {
        sum = sum * x + *c;
    }
    sum * x
}

/// Coefficients of `Σ cᵢ x^(i+1)` through `f(x)` at the Chebyshev points of `[a, b]`; `f(0) = 0`.
fn fit<const N: usize>(a: f64, b: f64, f: impl Fn(f64) -> f64) -> [f64; N] {
    let x: [f64; N] = std::array::from_fn(|i| {
        let angle = std::f64::consts::PI * (i as f64 + 0.5) / N as f64;
        0.5 * (a + b) + 0.5 * (b - a) * angle.cos()
    });
    // Newton's divided differences of f(x)/x, then expanded
    let mut divided: [f64; N] = x.map(|x| f(x) / x);
    for order in 1..N {
        for i in (order..N).rev() {
            divided[i] = (divided[i] - divided[i - 1]) / (x[i] - x[i - order]);
        }
    }
    let mut out = [0.0; N];
    for i in (0..N).rev() {
        for j in (0..N).rev() {
            let shifted = if j > 0 { out[j - 1] } else { 0.0 };
            out[j] = shifted - x[i] * out[j];
        }
        out[0] += divided[i];
    }
    out
}

/// Up to where the curve is tabled, K.
fn ceiling(material: &Material) -> f64 {
    CEILING.max(material.liquidus + 500.0)
}

/// The temperatures of the table, K: at most half a kelvin apart, and on every corner of the laws.
fn table_temperatures(material: &Material, ceiling: f64) -> Vec<f64> {
    let corners = [
        material.start - BELOW,
        material.start,
        material.solidus,
        0.5 * (material.solidus + material.liquidus),
        material.liquidus,
        ceiling,
    ];
    let mut kelvin = vec![corners[0]];
    for pair in corners.windows(2) {
        let pieces = ((pair[1] - pair[0]) / 0.5).ceil().clamp(1.0, 20_000.0);
        kelvin.extend(
            (1..=pieces as usize).map(|i| pair[0] + (pair[1] - pair[0]) * i as f64 / pieces),
        );
    }
    kelvin
}

impl Enthalpy {
    /// The curves of `material`.
    ///
    /// # Errors
    /// [`CurveError`] where a law is not positive or too rough.
    pub fn new(material: &Material) -> Result<Self, CurveError> {
        let ceiling = ceiling(material);
        let kelvin = table_temperatures(material, ceiling);
        for &t in &kelvin {
            let (capacity, conductivity) = (material.heat_capacity(t), material.conductivity(t));
            if !(capacity > 0.0
                && conductivity > 0.0
                && capacity.is_finite()
                && conductivity.is_finite())
            {
                return Err(CurveError::Law {
                    material: material.name.clone(),
                    celsius: t - crate::material::CELSIUS,
                    capacity,
                    conductivity,
                    ceiling: ceiling - crate::material::CELSIUS,
                });
            }
        }
        let mut sums = [vec![0.0], vec![0.0], vec![0.0]];
        let [mut diffusivity_max, mut diffusivity_solid] = [0.0_f64; 2];
        for pair in kelvin.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            // two-point Gauss: never on a corner, where a law may jump
            let points =
                [0.5 - 0.5 / 3.0_f64.sqrt(), 0.5 + 0.5 / 3.0_f64.sqrt()].map(|s| a + s * (b - a));
            let mean = |f: &dyn Fn(f64) -> f64| 0.5 * (f(points[0]) + f(points[1])) * (b - a);
            let dense = mean(&|t| material.heat_capacity(t));
            let kirchhoff = mean(&|t| material.conductivity(t));
            let powder = mean(&|t| {
                material.relative_density(t.max(material.start)) * material.heat_capacity(t)
            });
            diffusivity_max = diffusivity_max.max(kirchhoff / dense);
            if b <= material.solidus {
                diffusivity_solid = diffusivity_max;
            }
            for (sum, part) in sums.iter_mut().zip([dense, kirchhoff, powder]) {
                sum.push(sum[sum.len() - 1] + part);
            }
        }
        let start = kelvin.partition_point(|&t| t < material.start - 1e-9);
        for sum in &mut sums {
            let zero = sum[start];
            for value in sum {
                *value -= zero;
            }
        }
        let [dense, kirchhoff, powder] = sums;
        let mut curve = Enthalpy {
            capacity_last: material.heat_capacity(ceiling),
            conductivity_last: material.conductivity(ceiling),
            at_solidus: 0.0,
            at_liquidus: 0.0,
            diffusivity_max,
            diffusivity_solid,
            formulas: Formulas {
                kirchhoff: Piecewise {
                    solidus: 0.0,
                    liquidus: 0.0,
                    ceiling: 0.0,
                    at_zero: 0.0,
                    solid: [0.0; SOLID_ORDER],
                    knots: [0.0; MELTING_PIECES],
                    bends: [0.0; MELTING_PIECES],
                    liquid: [0.0; LIQUID_ORDER],
                    beyond: 0.0,
                },
                start_density: 0.0,
                density: [0.0; SOLID_ORDER],
                conduction: [0.0, 1.0],
                bends: [[0.0; 2]; BENDS],
            },
            fit_error: 0.0,
            kelvin,
            dense,
            kirchhoff,
            powder,
        };
        curve.at_solidus = curve.of(material.solidus);
        curve.at_liquidus = curve.of(material.liquidus);
        curve.formulas = curve.short_formulas(material);
        let (error, kelvin) = curve.worst_fit(material);
        curve.fit_error = error;
        if error > 2.0 {
            return Err(CurveError::Fit {
                material: material.name.clone(),
                error,
                celsius: kelvin - crate::material::CELSIUS,
            });
        }
        Ok(curve)
    }

    fn short_formulas(&self, material: &Material) -> Formulas<f64> {
        let start_density = material.relative_density(material.start);
        let density = fit::<SOLID_ORDER>(0.0, self.at_solidus, |g| {
            // just below the solidus, where the law ends and the jump to dense stands apart
            let kelvin = self.temperature(g).min(material.solidus - 1e-6);
            material.relative_density(kelvin) - start_density
        });
        let (conduction, bends) = straight_pieces(&material.powder_conduction());
        Formulas {
            kirchhoff: self.piecewise(
                material,
                |kelvin| self.kirchhoff_at(kelvin),
                self.conductivity_last,
            ),
            start_density,
            density,
            conduction,
            bends,
        }
    }

    /// Short form of a function of temperature; `slope` is its slope at the end of the tables, per kelvin.
    pub(crate) fn piecewise(
        &self,
        material: &Material,
        value: impl Fn(f64) -> f64,
        slope: f64,
    ) -> Piecewise<f64> {
        let (gs, gl) = (self.at_solidus, self.at_liquidus);
        let g_ceiling = self.dense[self.dense.len() - 1];
        let at_zero = value(material.start);
        let of_g = |g: f64| value(self.temperature(g));
        let solid = fit::<SOLID_ORDER>(self.dense[0], gs, |g| of_g(g) - at_zero);
        let at_liquidus = of_g(gl);
        let liquid = fit::<LIQUID_ORDER>(0.0, g_ceiling - gl, |x| of_g(gl + x) - at_liquidus);
        // short pieces where a triangular bump bends the curve most: near solidus and liquidus
        let shares = [0.0, 0.065, 0.17, 0.315, 0.5, 0.685, 0.83, 0.935, 1.0];
        let width = material.liquidus - material.solidus;
        let knots = shares.map(|share| self.of(material.solidus + width * share));
        let mut bends = [0.0; MELTING_PIECES];
        let mut slope_before = 0.0;
        let mut low = at_zero + polynomial(&solid, gs);
        for i in 0..MELTING_PIECES {
            let high = of_g(knots[i + 1]);
            let slope = (high - low) / (knots[i + 1] - knots[i]);
            bends[i] = slope - slope_before;
            slope_before = slope;
            low = high;
        }
        Piecewise {
            solidus: gs,
            liquidus: gl,
            ceiling: g_ceiling,
            at_zero,
            solid,
            knots: std::array::from_fn(|i| knots[i]),
            bends,
            liquid,
            beyond: slope / self.capacity_last,
        }
    }

    fn worst_fit(&self, material: &Material) -> (f64, f64) {
        let mut worst = (0.0, material.start);
        for (i, &t) in self.kelvin.iter().enumerate() {
            let error = (self.formulas.kirchhoff(self.dense[i]) - self.kirchhoff[i]).abs()
                / material.conductivity(t);
            if error > worst.0 {
                worst = (error, t);
            }
        }
        worst
    }

    /// A short form in precision `R`.
    pub(crate) fn in_precision<R: Real>(form: &Piecewise<f64>) -> Piecewise<R> {
        form.cast()
    }

    /// The formulas for the cell loops in precision `R`.
    pub(crate) fn formulas<R: Real>(&self) -> Formulas<R> {
        self.formulas.cast()
    }

    fn interpolate(from: &[f64], to: &[f64], x: f64, slope_beyond: f64) -> f64 {
        let last = from.len() - 1;
        if x >= from[last] {
            return to[last] + (x - from[last]) * slope_beyond;
        }
        let i = from.partition_point(|&f| f <= x).clamp(1, last);
        to[i - 1] + (x - from[i - 1]) * (to[i] - to[i - 1]) / (from[i] - from[i - 1])
    }

    /// A number that differs between materials whose laws differ: the checksum of the tables.
    pub fn fingerprint(&self) -> u32 {
        let mut sum = crc32fast::Hasher::new();
        for table in [&self.dense, &self.kirchhoff, &self.powder] {
            for value in table {
                sum.update(&value.to_le_bytes());
            }
        }
        sum.finalize()
    }

    /// Enthalpy `g` of dense material at `kelvin`, J/mm³.
    pub fn of(&self, kelvin: f64) -> f64 {
        Self::interpolate(&self.kelvin, &self.dense, kelvin, self.capacity_last)
    }

    /// Temperature at enthalpy `g`, K.
    ///
    /// ```
    /// # let text = meltpath_data::materials::TI6AL4V_EBM.text;
    /// # let titanium = meltpath_thermal::material::file::read(text, Default::default()).unwrap();
    /// let curve = meltpath_thermal::material::enthalpy::Enthalpy::new(&titanium).unwrap();
    /// let g = curve.of(2000.0);
    /// assert!((curve.temperature(g) - 2000.0).abs() < 1e-9);
    /// // 750 to 1665 °C with the latent heat: 1.086 MJ/kg, about 4.6 J/mm³
    /// assert!((curve.at_liquidus - 4.6).abs() < 0.1);
    /// ```
    pub fn temperature(&self, g: f64) -> f64 {
        Self::interpolate(&self.dense, &self.kelvin, g, 1.0 / self.capacity_last)
    }

    /// `θ = ∫ k dT` from the start temperature to `kelvin`, W/mm.
    pub fn kirchhoff_at(&self, kelvin: f64) -> f64 {
        Self::interpolate(
            &self.kelvin,
            &self.kirchhoff,
            kelvin,
            self.conductivity_last,
        )
    }

    /// Temperature whose `θ` this is, K.
    pub fn of_kirchhoff(&self, theta: f64) -> f64 {
        let slope = 1.0 / self.conductivity_last;
        Self::interpolate(&self.kirchhoff, &self.kelvin, theta, slope)
    }

    /// Heat in a unit volume of relative density `r` at enthalpy `g`, counted from fresh powder at the start temperature
    /// along the way it came: first heating to the temperature whose relative density is `r`, then back, J/mm³.
    pub(crate) fn stored(&self, g: f64, r: f64) -> f64 {
        let highest = self.highest(r);
        let first = Self::interpolate(&self.dense, &self.powder, highest, 1.0);
        first + r * (g - highest)
    }

    /// Enthalpy at which fresh powder grows as dense as `r`, J/mm³.
    pub(crate) fn highest(&self, r: f64) -> f64 {
        if r >= 1.0 {
            return self.at_solidus;
        }
        // the relative density grows with g: bisect for where it is r
        let dense = |g: f64| self.formulas.relative_density(g) >= r;
        halving::root([0.0, self.at_solidus], 60, dense)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::tests::titanium;

    #[test]
    fn formulas_follow_the_tables() {
        let material = titanium();
        let curve = Enthalpy::new(&material).unwrap();
        assert!(curve.fit_error < 1.0, "{}", curve.fit_error);
        for celsius in [750.0, 900.0, 1300.0, 1604.0] {
            let kelvin = celsius + 273.15;
            let fitted = curve.formulas.relative_density(curve.of(kelvin));
            assert!(
                (fitted - material.relative_density(kelvin)).abs() < 1e-4,
                "{celsius}: {fitted}"
            );
        }
    }

    #[test]
    fn constant_laws_are_exact() {
        let material = Material::constant(0.02, 3e-3, 300.0);
        let curve = Enthalpy::new(&material).unwrap();
        for kelvin in [300.0, 900.0, 1305.0, 3000.0, 9000.0] {
            let g = curve.of(kelvin);
            assert!((g - 3e-3 * (kelvin - 300.0)).abs() < 1e-9);
            assert!((curve.formulas.kirchhoff(g) - 0.02 * (kelvin - 300.0)).abs() < 1e-7);
        }
    }

    #[test]
    fn powder_stores_less_on_the_way_up() {
        let material = titanium();
        let curve = Enthalpy::new(&material).unwrap();
        let top = curve.at_solidus;
        let share = curve.stored(top, 1.0) / top;
        // mean of a relative density that rises from 0.62 to 1
        assert!(share > 0.80 && share < 0.83, "{share}");
        assert!(curve.stored(0.0, 0.62).abs() < 1e-6);
    }
}
