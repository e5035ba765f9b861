//! The reference solver as judge of a beam path: how large a share of the metal meets the aim, and by how much that share
//! moves when cell, step or power do.
//!
//! A share of voxels in a window of 60 K hangs on the tail of a distribution; one that moves by more than [`CONVERGED`] with
//! half the cell, half the step or 5 % of the power is told as not converged (specification ebm, section 2.14 and part 4.4).

use meltpath_base::Observer;
use meltpath_geometry::math::DVec3;

use crate::beam::{Beam, BeamPath};
use crate::grid::{Field, Grid};
use crate::material::{CELSIUS, Material};
use crate::run::{RunError, draw};
use crate::solver::{Face, Faces, Solver, SolverError, State};
use crate::surface::Surface;

/// Largest change of a share that is called converged.
pub const CONVERGED: f64 = 0.05;
/// Change of the power that a share must bear.
pub const POWER: f64 = 0.05;
/// Temperature of the heat shield above the build plane, K (Béraud 2016, section 3.2.2.1).
const SHIELD: f64 = 300.0 + CELSIUS;
/// Metal or powder below and beside the path, mm (Béraud 2016, section 3.2.2.1).
const MARGIN: f64 = 0.5;

/// What is drawn on.
#[derive(Debug, Clone)]
pub struct Body<'a> {
    /// The material.
    pub material: &'a Material,
    /// Beam to heat.
    pub beam: &'a Beam,
    /// Thickness of a layer, mm.
    pub layer: f64,
    /// How often the path is drawn, each on a fresh layer.
    pub layers: u32,
    /// What lies under the first layer.
    pub ground: State,
}

/// Cell, longest step and power of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Edge of a cell in the plane, mm.
    pub cell: f64,
    /// Planes of cells in a layer.
    pub planes: u32,
    /// Longest step, s; shorter where stability asks for it.
    pub step: f64,
    /// Factor on the beam's power.
    pub power: f64,
}

/// One run of the judge and how it differs from the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variant {
    /// As asked.
    Base,
    /// Half the cell in all directions, with the shorter step that it needs.
    HalfCell,
    /// Half the step.
    HalfStep,
    /// Less power.
    LessPower,
    /// More power.
    MorePower,
}

impl Variant {
    /// All, the one as asked first.
    pub const ALL: [Variant; 5] = [
        Variant::Base,
        Variant::HalfCell,
        Variant::HalfStep,
        Variant::LessPower,
        Variant::MorePower,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Variant::Base => "as asked",
            Variant::HalfCell => "half the cell",
            Variant::HalfStep => "half the step",
            Variant::LessPower => "5 % less power",
            Variant::MorePower => "5 % more power",
        }
    }
}

impl Resolution {
    /// The resolution of a variant of this one; `step` is the step that this one really took, s.
    #[must_use]
    pub fn of(&self, variant: Variant, step: f64) -> Self {
        match variant {
            Variant::Base => *self,
            Variant::HalfCell => Resolution {
                cell: 0.5 * self.cell,
                planes: 2 * self.planes,
                ..*self
            },
            Variant::HalfStep => Resolution {
                step: 0.5 * step,
                ..*self
            },
            Variant::LessPower => Resolution {
                power: self.power * (1.0 - POWER),
                ..*self
            },
            Variant::MorePower => Resolution {
                power: self.power * (1.0 + POWER),
                ..*self
            },
        }
    }
}

/// What a run gave.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Highest temperatures of the last layer, K.
    pub highest: Field,
    /// The step taken, s.
    pub step: f64,
    /// What the solver lost of the heat, as a share of what the beam brought.
    pub residual: f64,
    /// Updates of cells.
    pub updates: u64,
}

/// Draws `path` on `body`, from the start temperature, with margins of 0.5 mm.
///
/// # Errors
/// [`RunError`].
pub fn judge(
    body: &Body<'_>,
    path: &BeamPath,
    resolution: &Resolution,
    observer: &dyn Observer,
) -> Result<Drawn, RunError> {
    let mut low = DVec3::new(f64::INFINITY, f64::INFINITY, 0.0);
    let mut high = DVec3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0);
    for w in path.points().windows(2).filter(|w| w[0].on) {
        for p in w {
            low = low.min(DVec3::new(p.x, p.y, 0.0));
            high = high.max(DVec3::new(p.x, p.y, 0.0));
        }
    }
    let margin = DVec3::new(MARGIN, MARGIN, 0.0);
    let height = body.layer / f64::from(resolution.planes.max(1));
    // whole layers, so that the powder of the first one ends on a plane of cells
    let depth = ((MARGIN / body.layer - 1e-6).ceil() * body.layer).max(body.layer);
    let edge = DVec3::new(resolution.cell, resolution.cell, height);
    let grid = Grid::covering((low - margin).with_z(-depth), high + margin, edge)
        .map_err(SolverError::from)?;
    let material = body.material;
    let faces = Faces {
        top: Surface::Radiating {
            surroundings: SHIELD,
        },
        sides: Face::Imposed(material.start),
        bottom: Face::Imposed(material.start),
    };
    let mut solver = Solver::<f32>::new(grid, material.clone(), faces)?;
    solver.set_state(|c| {
        if c.z > -body.layer {
            State::Powder
        } else {
            body.ground
        }
    });
    let beam = Beam {
        efficiency: body.beam.efficiency * resolution.power,
        ..body.beam.clone()
    };
    let step = resolution.step.min(solver.stable_step());
    let mut updates = 0;
    for layer in 0..body.layers.max(1) {
        if layer > 0 {
            solver.add_layer(body.layer)?;
            solver.freeze_below(depth);
        }
        draw(&mut solver, path, &beam, step, &mut [], observer)?;
        let planes = solver
            .grid()
            .planes()
            .min((depth / height).round() as usize);
        let cells = solver.grid().cells;
        let steps = ((path.end() - path.begin()) / step).ceil();
        updates += (cells[0] * cells[1] * planes) as u64 * steps as u64;
    }
    Ok(Drawn {
        residual: solver.ledger().residual(solver.stored()),
        highest: solver.highest_temperature(),
        step,
        updates,
    })
}

/// A share as asked and with each change.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// The share as asked.
    pub value: f64,
    /// Changes of it, in the order of the variants after the first.
    pub changes: Vec<(Variant, f64)>,
}

impl Share {
    /// The largest change, whichever way.
    pub fn spread(&self) -> f64 {
        self.changes
            .iter()
            .map(|(_, c)| c.abs())
            .fold(0.0, f64::max)
    }

    /// Whether no change moves it by more than [`CONVERGED`].
    pub fn converged(&self) -> bool {
        self.spread() <= CONVERGED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_that_moves_by_more_than_five_points_is_not_converged() {
        let share = |change: f64| Share {
            value: 0.5,
            changes: vec![(Variant::HalfCell, 0.01), (Variant::LessPower, -change)],
        };
        assert!(share(0.049).converged());
        assert!(!share(0.051).converged());
        assert!((share(0.3).spread() - 0.3).abs() < 1e-12);
    }

    #[test]
    fn variants_change_one_thing_each() {
        let base = Resolution {
            cell: 0.06,
            planes: 1,
            step: 4e-6,
            power: 1.0,
        };
        assert_eq!(base.of(Variant::HalfCell, 3e-6).planes, 2);
        // half of the step that was taken, which stability may have shortened
        assert_eq!(base.of(Variant::HalfStep, 3e-6).step, 1.5e-6);
        assert_eq!(base.of(Variant::MorePower, 3e-6).power, 1.05);
    }
}
