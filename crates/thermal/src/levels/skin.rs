//! How hot the build plane itself is: cells tell the mean over their height, and under a beam the surface is hotter.
//!
//! By [`Depth::lift`](crate::solver::source::Depth::lift), with the heat that arrived on each uppermost cell during its step and what it
//! gives to the one below; less a third of the cell of what vapour takes from a surface as hot as that. Powder that has not melted
//! is as hot as its cell.

use crate::material::Material;
use crate::material::enthalpy::Enthalpy;
use crate::numeric::vector::CellLoop;
use crate::solver::surface::Surface;

/// Share of the metal's conductivity below which a cell counts as powder, as hot as its surface.
const CONDUCTS: f32 = 0.9;
/// Hottest surface that is tabled, K.
const HOTTEST: f64 = 9000.0;
const ENTRIES: usize = 4096;

/// What the surface of a tile's uppermost cells knows.
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    /// Heat that arrived since the last look, J/mm².
    pub(crate) arrived: Vec<f32>,
    /// Whether any did.
    pub(crate) lit: bool,
    /// `θ` of the surface at the last look, before vapour took its share, and the highest so far; W/mm.
    pub(crate) theta: Vec<f32>,
    pub(crate) peak: Vec<f32>,
}

impl Skin {
    /// Of a tile of `cells` columns.
    pub(crate) fn new(cells: usize) -> Self {
        Skin {
            arrived: vec![0.0; cells],
            lit: false,
            theta: vec![0.0; cells],
            peak: vec![0.0; cells],
        }
    }

    /// The highest begin anew.
    pub(crate) fn begin_anew(&mut self) {
        self.peak.fill(0.0);
    }
}

/// What of a cell makes its surface hotter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lift {
    /// [`Depth::lift`](crate::solver::source::Depth::lift) over the step that the heat arrived in, mm/s.
    pub(crate) per_heat: f32,
    /// Share of the difference from the cell below.
    pub(crate) below: f32,
}

/// Looks at the surface of a tile.
pub(crate) struct LookAtSkin<'a> {
    pub(crate) skin: &'a mut Skin,
    pub(crate) lift: Lift,
    /// `θ` of the uppermost cells, and of those below.
    pub(crate) theta: [&'a [f32]; 2],
    /// Shares of the metal's conductivity of the uppermost cells.
    pub(crate) share: &'a [f32],
}

impl CellLoop for LookAtSkin<'_> {
    #[inline(always)]
    fn run(self) {
        let LookAtSkin {
            skin,
            lift,
            theta: [top, below],
            share,
        } = self;
        let cells = top.len();
        let (arrived, face, peak) = (
            &skin.arrived[..cells],
            &mut skin.theta[..cells],
            &mut skin.peak[..cells],
        );
        let (below, share) = (&below[..cells], &share[..cells]);
        for n in 0..cells {
            let hotter = lift.per_heat * arrived[n] + lift.below * (top[n] - below[n]);
            let hotter = if share[n] < CONDUCTS || hotter < 0.0 {
                0.0
            } else {
                hotter
            };
            let theta = top[n] + hotter;
            face[n] = theta;
            peak[n] = if theta > peak[n] { theta } else { peak[n] };
        }
        skin.arrived.fill(0.0);
        skin.lit = false;
    }
}

/// Temperature of a surface by its `θ`, less what vapour takes.
#[derive(Debug, Clone)]
pub(crate) struct Temperatures {
    theta: Vec<f64>,
    kelvin: Vec<f64>,
}

impl Temperatures {
    /// For uppermost cells of `height` mm.
    pub(crate) fn new(
        surface: &Surface,
        material: &Material,
        curve: &Enthalpy,
        height: f64,
    ) -> Self {
        let ambient = match surface {
            Surface::Evaporating { ambient, .. } => Some(*ambient),
            _ => None,
        };
        let law = ambient.zip(material.evaporation.as_ref());
        let step = (HOTTEST - material.liquidus) / ENTRIES as f64;
        let kelvin: Vec<f64> = (0..=ENTRIES)
            .map(|n| material.liquidus + n as f64 * step)
            .collect();
        let of = |kelvin: &f64| {
            let flux = law.map_or(0.0, |(ambient, law)| law.flux(*kelvin, ambient));
            curve.kirchhoff_at(*kelvin) + flux * height / 3.0
        };
        Temperatures {
            theta: kelvin.iter().map(of).collect(),
            kelvin,
        }
    }

    /// Temperature, K.
    pub(crate) fn at(&self, curve: &Enthalpy, theta: f64) -> f64 {
        if theta <= self.theta[0] {
            return curve.of_kirchhoff(theta).min(self.kelvin[0]);
        }
        let last = ENTRIES;
        let n = self.theta.partition_point(|t| *t <= theta).clamp(1, last);
        let share = (theta - self.theta[n - 1]) / (self.theta[n] - self.theta[n - 1]);
        self.kelvin[n - 1] + share.min(1.0) * (self.kelvin[n] - self.kelvin[n - 1])
    }
}
