//! The hatch of a job: its values from the table, the passes by planning, the beam's path by the gun.

use meltpath_base::quantity::Positive;
use meltpath_base::{Length, Provenance, Ratio, Reporter, Speed, Time};
use meltpath_geometry::Region;
use meltpath_gun::Gun;
use meltpath_gun::drive::{Drive, DriveError, drive};
use meltpath_gun::focus::{FocusCalibration, FocusError};
use meltpath_planning::powder::modulation::{Modulation, Ramp};
use meltpath_planning::powder::{self, Modulated, Pattern};
use meltpath_thermal::beam::{BeamError, BeamPath};

use super::region::Below;
use crate::job::ebm::{HatchStrategy, HatchTable, ModulationTable};

/// Greatest distance between an arc and the lines in its place, mm: far below a voxel.
const CHORD_ERROR: f64 = 2e-3;

/// Why a region cannot be hatched.
#[derive(Debug, thiserror::Error)]
pub enum HatchError {
    /// Planning.
    #[error(transparent)]
    Plan(#[from] powder::HatchError),
    /// The gun.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// The beam.
    #[error(transparent)]
    Beam(#[from] BeamError),
}

/// Less energy near powder, from the job's table, for a hatch that brings `nominal` J/mm³ on what lies `below`.
pub fn modulated(
    table: &ModulationTable,
    nominal: f64,
    below: &Below,
    r: &mut Provenance,
) -> Modulated {
    let start = Modulation::STARTING;
    let why = "a starting value to be tuned: those of Béraud 2016 are lost";
    let mut ramp = |name: &str, least: Option<f64>, length: Option<f64>, default: Ramp| Ramp {
        least: r
            .written_or(
                &format!("modulation.{name}"),
                least.map(Ratio),
                Ratio(default.least),
                why,
            )
            .0,
        length: r
            .written_or(
                &format!("modulation.{name}_length"),
                length.map(Length),
                Length(default.length),
                "powder is felt 1 to 2 mm away (Béraud 2016, section 2.2.1.1)",
            )
            .0,
    };
    let share = |v: Option<Positive<Ratio>>| v.map(|v| v.0.0);
    let length = |v: Option<Positive<Length>>| v.map(|v| v.0.0);
    Modulated {
        law: Modulation {
            nominal,
            across: ramp(
                "across",
                share(table.across),
                length(table.across_length),
                start.across,
            ),
            along: ramp(
                "along",
                share(table.along),
                length(table.along_length),
                start.along,
            ),
        },
        below: below.regions(),
    }
}

/// A hatch with every value resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Hatch {
    /// What is planned.
    pub plan: powder::Hatch,
    /// How the gun follows it.
    pub drive: Drive,
    /// The gun.
    pub gun: Gun,
}

impl Hatch {
    /// The hatch of a job's table for layers `layer` mm thick, not modulated; every value is recorded with its origin.
    ///
    /// # Errors
    /// [`FocusError`] of a focus current that is not calibrated.
    pub fn resolve(
        table: &HatchTable,
        layer: f64,
        focus: &FocusCalibration,
        r: &mut Provenance,
    ) -> Result<Self, FocusError> {
        let thesis = "Béraud 2016, table 3.3.2";
        let mm = |v: f64| Length(v);
        r.written_or(
            "hatch.strategy",
            Some(format!("{:?}", table.strategy).to_lowercase()),
            String::new(),
            "",
        );
        let spacing = table.spacing.map(|s| s.0);
        let spacing = r.written_or(
            "hatch.spacing",
            spacing,
            mm(0.125),
            "49 J/mm³ at the thesis' beam (erratum E22)",
        );
        let angle = table.angle;
        let angle = r.written_or("hatch.angle", angle, meltpath_base::Angle(0.0), "along x");
        let turn = r.written_or(
            "hatch.turn",
            table.turn,
            meltpath_base::Angle(std::f64::consts::FRAC_PI_2),
            "crossed layers: what one leaves cold the next one crosses",
        );
        let contours = r.written_or("hatch.contours", table.contours, 0, "lines alone");
        let overrun = r.written_or(
            "hatch.overrun",
            table.overrun.map(|o| o.0),
            mm(0.0),
            "up to the contour",
        );
        let island = table.island.map(|s| s.0);
        let island = r.written_or(
            "hatch.island",
            island,
            mm(2.0),
            "of the order of what stays hot behind the beam",
        );
        let speed = table.speed.map(|s| s.0);
        let speed = r.written_or("hatch.speed", speed, Speed(980.0), thesis).0;
        let dwell = r.written_or(
            "hatch.dwell",
            table.dwell.map(|d| d.0),
            Time(spacing.0 / speed),
            "what a line at that speed spends on the spacing",
        );
        let jump = table.jump.map(|j| j.0.0);
        let jump = jump.map_or(f64::INFINITY, |v| {
            r.written_or("hatch.jump", Some(Speed(v)), Speed(v), "").0
        });
        let voltage = table.voltage.map(|v| v.0);
        let voltage = r.written_or(
            "hatch.voltage",
            voltage,
            meltpath_base::Voltage(60e3),
            thesis,
        );
        let current = table.current.map(|v| v.0);
        let current = r.written_or(
            "hatch.current",
            current,
            meltpath_base::Current(5e-3),
            thesis,
        );
        let coil = r.written_or(
            "hatch.focus",
            table.focus,
            meltpath_base::Current(4e-3),
            thesis,
        );
        Ok(Hatch {
            plan: powder::Hatch {
                pattern: pattern(table.strategy),
                spacing: spacing.0,
                angles: [angle.0, turn.0],
                contours,
                overrun: overrun.0,
                island: island.0,
                speed,
                dwell: dwell.0,
                power: voltage.0 * current.0,
                layer,
                chord_error: CHORD_ERROR,
                modulation: None,
            },
            drive: Drive {
                spot: focus.diameter(coil.0)?,
                jump,
                chord_error: CHORD_ERROR,
            },
            gun: Gun {
                voltage: voltage.0,
                focus: focus.clone(),
                coil: coil.0,
            },
        })
    }

    /// The same beam and distances with straight lines, not modulated.
    #[must_use]
    pub fn of_lines(&self) -> Self {
        Hatch {
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
