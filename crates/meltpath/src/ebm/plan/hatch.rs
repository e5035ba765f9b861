//! The hatch of a job: its values from the table, the passes by planning, the beam's path by the gun.

use meltpath_base::settings::{Problem, Setting};
use meltpath_base::{Length, Provenance, Ratio, Reporter, Time};
use meltpath_geometry::Region;
use meltpath_gun::Gun;
use meltpath_gun::drive::{Drive, DriveError, drive};
use meltpath_gun::focus::{FocusCalibration, FocusError};
use meltpath_planning::powder::modulation::{Modulation, Ramp};
use meltpath_planning::powder::{self, Modulated, Pattern, Turns};
use meltpath_thermal::beam::{BeamError, BeamPath};

use crate::ebm::plan::region::Below;
use crate::job::ebm::{EbmJob, HatchStrategy, HatchTable, ModulationTable};

/// Greatest distance between an arc and the lines in its place, mm: far below a voxel.
const CHORD_ERROR: f64 = 2e-3;

meltpath_base::passes_on! {
    /// Why a region cannot be hatched.
    pub enum HatchError {
        /// Planning.
        Plan(powder::HatchError),
        /// The gun.
        Drive(DriveError),
        /// The beam.
        Beam(BeamError),
    }
}

impl HatchError {
    /// In the table of the hatch.
    pub(in crate::ebm) fn in_hatch(&self, job: &EbmJob) -> Problem {
        match (self, job.hatch.as_ref()) {
            (HatchError::Plan(powder::HatchError::Spacing { .. }), Some(table)) => {
                self.told(&table.spacing.name, &table.spacing)
            }
            _ => self.told("[hatch]", &job.hatch),
        }
    }

    /// At the key `name` that asked for it, in its words.
    pub(in crate::ebm) fn told<T>(&self, name: &str, key: &Setting<T>) -> Problem {
        key.problem(format!("{name}: {self}"))
    }
}

/// Less energy near powder, from the job's table, for a hatch that brings `nominal` J/mm³.
pub fn law(table: &ModulationTable, nominal: f64) -> Modulation {
    let ramp = |least: Ratio, length: Length| Ramp {
        least: least.0,
        length: length.0,
    };
    Modulation {
        nominal,
        across: ramp(*table.across, *table.across_length),
        along: ramp(*table.along, *table.along_length),
    }
}

/// A hatch with every value resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamHatch {
    /// What is planned, not modulated.
    pub plan: powder::Hatch,
    /// Less energy near powder.
    pub law: Option<Modulation>,
    /// How the gun follows it.
    pub drive: Drive,
    /// The gun.
    pub gun: Gun,
}

impl BeamHatch {
    /// The hatch of a job's table for layers `layer` mm thick, not modulated.
    ///
    /// # Errors
    /// [`FocusError`] of a focus current that is not calibrated.
    pub fn of(
        table: &HatchTable,
        layer: f64,
        focus: &FocusCalibration,
        r: &mut Provenance,
    ) -> Result<Self, FocusError> {
        let on_spacing = Time(table.spacing.0 / table.speed.0);
        let gun = Gun {
            voltage: table.voltage.0,
            focus: focus.clone(),
            coil: table.focus.0,
        };
        Ok(BeamHatch {
            plan: powder::Hatch {
                pattern: pattern(*table.strategy),
                turns: Turns::Joined,
                spacing: table.spacing.0,
                angles: [table.angle.0, table.turn.0],
                contours: *table.contours,
                overrun: table.overrun.0,
                island: table.island.0,
                speed: table.speed.0,
                dwell: table.dwell.or_computed(r, on_spacing).0,
                power: gun.power(table.current.0),
                spot: focus.diameter(gun.coil)?,
                layer,
                chord_error: CHORD_ERROR,
                modulation: None,
            },
            law: None,
            drive: Drive {
                jump: table.jump.map_or(f64::INFINITY, |v| v.0),
                chord_error: CHORD_ERROR,
            },
            gun,
        })
    }

    /// The same with less energy near the powder that lies `below`, where the job asks for it.
    #[must_use]
    pub fn on(&self, below: &Below) -> Self {
        let mut hatch = self.clone();
        hatch.plan.modulation = self.law.map(|law| Modulated {
            law,
            below: below.regions(),
        });
        hatch
    }

    /// The same beam and distances with straight lines, not modulated.
    #[must_use]
    pub fn of_lines(&self) -> Self {
        BeamHatch {
            plan: self.plan.of_lines(),
            ..self.clone()
        }
    }

    /// The same beam and distances with another strategy.
    #[must_use]
    pub fn with(&self, strategy: HatchStrategy) -> Self {
        let mut other = self.clone();
        other.plan.pattern = pattern(strategy);
        other
    }

    /// The beam's path over areas of layer `number` (from 1), one after the other, beginning at time 0.
    ///
    /// # Errors
    /// [`HatchError`].
    pub fn path(
        &self,
        regions: &[Region],
        number: u32,
        reporter: &Reporter,
    ) -> Result<BeamPath, HatchError> {
        let toolpath = self.plan.toolpath(regions, number, reporter)?;
        let motion = drive(&toolpath, self.drive, 0.0)?;
        Ok(BeamPath::of(&[motion])?)
    }
}

/// What planning calls a strategy.
pub fn pattern(strategy: HatchStrategy) -> Pattern {
    match strategy {
        HatchStrategy::Lines => Pattern::Lines,
        HatchStrategy::OneWay => Pattern::OneWay,
        HatchStrategy::Contours => Pattern::Contours,
        HatchStrategy::Spiral => Pattern::Spiral,
        HatchStrategy::Islands => Pattern::Islands,
        HatchStrategy::Spots => Pattern::Spots,
        HatchStrategy::Modulated => Pattern::Modulated,
    }
}
