//! Bodies that are built to be measured, drawn with charts: struts, walls, hatched blocks.
//!
//! Béraud 2016: struts of two circles (section 3.3.1), walls of one line a layer (section 3.2.2.1.3). Efficiency and beam
//! diameter are corrected from their measured sizes by [`crate::calibration::fit`].

use meltpath_base::{Observer, Quiet};
use meltpath_geometry::math::DVec3;
use rayon::prelude::*;

use crate::beam::{BeamError, BeamPath, BeamPoint};
use crate::charts::build::{BuildError, compute};
use crate::charts::simulation::{ChartSimulation, ChartSimulationError, Settings};
use crate::charts::{ChartSet, ChartSettings};
use crate::criteria::as_built::strut as cylinder;
use crate::grid::{Field, Grid};
use crate::material::{CELSIUS, Material};
use crate::solver::State;

/// Edge of a voxel in the plane, mm.
const VOXEL: f64 = 0.04;
/// Powder beyond what is drawn, mm.
const MARGIN: f64 = 0.7;
/// Power from which charts must tell temperatures above 2800 °C apart, W.
const STRONG: f64 = 200.0;

/// A beam at its calibrated width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamSetting {
    /// Power, W.
    pub power: f64,
    /// Diameter of the spot, mm.
    pub spot: f64,
}

/// A body and how it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Coupon {
    /// Concentric circles in powder: its diameter is measured.
    Strut {
        /// Radius and beam of each circle, drawn in this order, mm.
        circles: Vec<(f64, BeamSetting)>,
        /// Speed, mm/s.
        speed: f64,
        /// How far each circle is drawn beyond its beginning, mm.
        overlap: f64,
    },
    /// One line a layer in powder: its thickness is measured, without stuck grains.
    Wall {
        /// The beam.
        beam: BeamSetting,
        /// Speed, mm/s.
        speed: f64,
    },
    /// Parallel lines over metal: the share of pores in the last layer is measured.
    Block {
        /// The beam.
        beam: BeamSetting,
        /// Speed, mm/s.
        speed: f64,
        /// Distance of lines, mm.
        spacing: f64,
    },
}

/// What charts and voxels need besides the coupon.
#[derive(Debug, Clone)]
pub struct Bench<'a> {
    /// The material.
    pub material: &'a Material,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// Layers drawn.
    pub layers: u32,
    /// Spacing of the charts, mm.
    pub spacing: f64,
}

/// What is not known well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamGuess {
    /// Share of the power that becomes heat.
    pub efficiency: f64,
    /// Factor on the calibrated diameter.
    pub width: f64,
}

meltpath_base::passes_on! {
    /// Why a coupon has no size.
    pub enum CouponError {
        /// Its charts.
        Charts(BuildError),
        /// Its simulation.
        Simulation(ChartSimulationError),
        /// Its path.
        Beam(BeamError),
    }
}

impl Coupon {
    /// The beams it is drawn with.
    pub fn beams(&self) -> Vec<BeamSetting> {
        match self {
            Coupon::Strut { circles, .. } => circles.iter().map(|c| c.1).collect(),
            Coupon::Wall { beam, .. } | Coupon::Block { beam, .. } => vec![*beam],
        }
    }

    /// What is drawn in each layer, and half the extent of the voxels needed round it, mm.
    fn paths(&self, guess: BeamGuess) -> Result<(Vec<BeamPath>, f64), BeamError> {
        let start = |b: &BeamSetting| BeamPoint::start(b.power, guess.width * b.spot);
        match self {
            Coupon::Strut {
                circles,
                speed,
                overlap,
            } => {
                let mut paths = Vec::new();
                let mut widest = 0.0_f64;
                for (radius, beam) in circles {
                    let turn = std::f64::consts::TAU + overlap / radius;
                    let corners: Vec<[f64; 2]> = (0..=90)
                        .map(|n| turn * f64::from(n) / 90.0)
                        .map(|a| [radius * a.cos(), radius * a.sin()])
                        .collect();
                    paths.push(BeamPath::along(&corners, *speed, start(beam))?);
                    widest = widest.max(*radius);
                }
                Ok((paths, widest))
            }
            // at an angle to the voxels, so that its thickness does not come in whole voxels
            Coupon::Wall { beam, speed } => {
                let end = [1.5 * WALL[0], 1.5 * WALL[1]];
                let corners = [end.map(|v| -v), end];
                let path = BeamPath::along(&corners, *speed, start(beam))?;
                Ok((vec![path], end[0]))
            }
            Coupon::Block {
                beam,
                speed,
                spacing,
            } => {
                let half = BLOCK + MARGIN;
                let lines = (2.0 * half / spacing).floor() as i32;
                let corners: Vec<[f64; 2]> = (0..=lines)
                    .flat_map(|n| {
                        let y = (f64::from(n) - 0.5 * f64::from(lines)) * spacing;
                        let ends = [[-half, y], [half, y]];
                        if n % 2 == 0 { ends } else { [ends[1], ends[0]] }
                    })
                    .collect();
                let path = BeamPath::along(&corners, *speed, start(beam))?;
                Ok((vec![path], half))
            }
        }
    }

    /// Its size as built: diameter or thickness, mm; share of pores of a block.
    ///
    /// # Errors
    /// [`CouponError`].
    pub fn size(
        &self,
        bench: &Bench<'_>,
        guess: BeamGuess,
        charts: &mut Charts,
        observer: &dyn Observer,
    ) -> Result<f64, CouponError> {
        let sets = charts.of(bench, &self.beams(), guess, observer)?;
        self.drawn(bench, guess, sets, observer)
    }

    /// Its size as built with charts of its beams.
    fn drawn(
        &self,
        bench: &Bench<'_>,
        guess: BeamGuess,
        sets: Vec<ChartSet>,
        observer: &dyn Observer,
    ) -> Result<f64, CouponError> {
        let (paths, extent) = self.paths(guess)?;
        let half = extent + MARGIN;
        let reach = sets.iter().map(|s| s.settings.reach).fold(0.0, f64::max);
        let grid = Grid::covering(
            DVec3::new(-half, -half, -reach),
            DVec3::new(half, half, 0.0),
            DVec3::new(VOXEL, VOXEL, bench.layer),
        )
        .map_err(ChartSimulationError::from)?;
        let material = bench.material;
        let mut simulation =
            ChartSimulation::new(&grid, material.clone(), sets, Settings::of(material))?;
        let ground = if matches!(self, Coupon::Block { .. }) {
            State::Dense
        } else {
            State::Powder
        };
        simulation.set_state(|c| {
            if c.z > -bench.layer {
                State::Powder
            } else {
                ground
            }
        });
        for layer in 0..bench.layers {
            if layer > 0 {
                simulation.add_layer();
            }
            for path in &paths {
                simulation.draw(path, &[], &mut |_, _| (), &Quiet(observer))?;
            }
        }
        let metal = simulation.metal();
        let planes = metal.grid.planes();
        let built = planes.saturating_sub(bench.layers as usize)..planes;
        Ok(match self {
            Coupon::Strut { .. } => cylinder(&metal, built).map_or(0.0, |s| s.diameter),
            Coupon::Wall { .. } => thickness(&metal, built),
            Coupon::Block { .. } => {
                pores(&metal) * (1.0 - material.relative_density(material.start))
            }
        })
    }
}

/// The size of each of `coupons` as built, drawn side by side.
///
/// # Errors
/// [`CouponError`].
pub fn sizes(
    coupons: &[&Coupon],
    bench: &Bench<'_>,
    guess: BeamGuess,
    charts: &mut Charts,
    observer: &dyn Observer,
) -> Result<Vec<f64>, CouponError> {
    let with = |coupon: &&Coupon| charts.of(bench, &coupon.beams(), guess, observer);
    let sets = coupons.iter().map(with).collect::<Result<Vec<_>, _>>()?;
    let drawn = coupons.par_iter().zip(sets);
    drawn
        .map(|(coupon, sets)| coupon.drawn(bench, guess, sets, observer))
        .collect()
}

/// Direction of a wall: three voxels along x for one along y.
const WALL: [f64; 2] = [0.948_683_298_050_513_8, 0.316_227_766_016_837_94];
/// Half the edge of the square of a block that is looked at, mm.
const BLOCK: f64 = 0.5;

/// Thickness of a wall along [`WALL`]: its area over its middle 1.6 mm, mm.
fn thickness(metal: &Field, planes: std::ops::Range<usize>) -> f64 {
    let half = 0.8;
    let grid = &metal.grid;
    let [nx, ny] = grid.cells;
    let count = planes.len() as f64;
    let mut area = 0.0;
    for k in planes {
        for j in 0..ny {
            for i in 0..nx {
                let c = grid.centre(i, j, k);
                if (c.x * WALL[0] + c.y * WALL[1]).abs() < half && metal.at(i, j, k) >= 0.5 {
                    area += grid.edge[0] * grid.edge[1];
                }
            }
        }
    }
    area / (2.0 * half * count)
}

/// Share of the last layer that is not metal, in the middle of a block.
fn pores(metal: &Field) -> f64 {
    let grid = &metal.grid;
    let [nx, ny] = grid.cells;
    let top = grid.planes() - 1;
    let (mut all, mut powder) = (0.0, 0.0);
    for n in 0..nx * ny {
        let c = grid.centre(n % nx, n / nx, top);
        if c.x.abs() < BLOCK && c.y.abs() < BLOCK {
            all += 1.0;
            powder += f64::from(metal.at(n % nx, n / nx, top) < 0.5);
        }
    }
    powder / all
}

/// Charts already computed, by beam and guess.
#[derive(Debug, Default)]
pub struct Charts {
    known: Vec<(BeamSetting, BeamGuess, ChartSet)>,
}

impl Charts {
    fn of(
        &mut self,
        bench: &Bench<'_>,
        beams: &[BeamSetting],
        guess: BeamGuess,
        observer: &dyn Observer,
    ) -> Result<Vec<ChartSet>, CouponError> {
        let mut sets = Vec::new();
        for (n, beam) in beams.iter().enumerate() {
            if beams[..n].contains(beam) {
                continue;
            }
            let known = self
                .known
                .iter()
                .position(|(b, g, _)| b == beam && *g == guess);
            if let Some(known) = known {
                sets.push(self.known[known].2.clone());
                continue;
            }
            let thesis = ChartSettings::for_beam(beam.power, guess.width * beam.spot);
            let strong = beam.power > STRONG;
            let settings = ChartSettings {
                efficiency: guess.efficiency,
                layer: bench.layer,
                cell: bench.spacing,
                stop: if strong {
                    3700.0 + CELSIUS
                } else {
                    thesis.stop
                },
                ..thesis
            };
            let set = compute(&settings, bench.material, observer)?;
            self.known.push((*beam, guess, set.clone()));
            sets.push(set);
        }
        Ok(sets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_at_an_angle_has_its_thickness() {
        let grid = Grid::covering(
            DVec3::new(-2.0, -2.0, -0.1),
            DVec3::new(2.0, 2.0, 0.0),
            DVec3::new(0.04, 0.04, 0.05),
        )
        .unwrap();
        let [nx, ny] = grid.cells;
        for wanted in [0.3, 0.31, 0.52] {
            let values = (0..grid.len())
                .map(|n| {
                    let c = grid.centre(n % nx, n / nx % ny, n / (nx * ny));
                    let across = c.y * WALL[0] - c.x * WALL[1];
                    f32::from(u8::from(across.abs() < 0.5 * wanted))
                })
                .collect();
            let field = Field {
                grid: grid.clone(),
                values,
            };
            let found = thickness(&field, 0..2);
            assert!((found - wanted).abs() < 0.012, "{wanted}: {found}");
        }
    }
}
