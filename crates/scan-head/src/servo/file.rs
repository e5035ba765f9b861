//! Controllers of a head's axes as a file: what `tune` exports and a whole job runs with.
//!
//! JSON. Each axis carries the motor that its controller was made for, so that the file says what it may be used on.

use meltpath_control::export::Exported;
use serde::{Deserialize, Serialize};

use crate::axis::control::{
    AngleUnit, CascadeGains, Controller, CurrentGains, FeedForward, SampledController, SampledForm,
};
use crate::axis::error::AxisError;
use crate::axis::galvanometer::Galvanometer;
use crate::head::scan_head::ScanHead;

/// Version of the layout.
pub const SCHEMA: &str = "meltpath-axis-controllers/1";

/// Why controllers of a file cannot run a head.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControllerFileError {
    /// A version that this program does not know.
    #[error("its schema is \"{found}\"; \"{SCHEMA}\" is known: export it again")]
    Schema {
        /// What it says.
        found: String,
    },
    /// No controller for an axis.
    #[error("it has no controller for the {axis} axis, only for {known}: tune that axis too")]
    Missing {
        /// `x` or `y`.
        axis: char,
        /// Those that are there.
        known: String,
    },
    /// A head whose motors are not known.
    #[error("the {axis} axis of the head takes no controller: {source}")]
    Motor {
        /// Which axis.
        axis: char,
        /// Why.
        source: AxisError,
    },
    /// Made for another sampling.
    #[error(
        "its controller of the {axis} axis runs every {found:.4} µs, the head samples every {wanted:.4} µs: export at the head's rate or a whole fraction of it"
    )]
    Period {
        /// Which axis.
        axis: char,
        /// The file's, µs.
        found: f64,
        /// The head's, µs.
        wanted: f64,
    },
}

/// The law of one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum StoredLaw {
    /// Three loops with feed-forward.
    Cascade {
        /// The gains.
        gains: CascadeGains,
    },
    /// A sampled controller from error angle to current set-point, as exported.
    Exported {
        /// The controller.
        export: Exported,
        /// The unit of angles at its input.
        unit: AngleUnit,
        /// Current regulator.
        current: CurrentGains,
        /// Feed-forward of current.
        feed_forward: FeedForward,
    },
}

/// The controller of one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisController {
    /// `x`, `y` or `z`.
    pub axis: char,
    /// How it was made, for people.
    pub design: String,
    /// The motor it was made for.
    pub motor: Galvanometer,
    /// The law.
    pub law: StoredLaw,
}

/// Controllers of a head.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerFile {
    /// [`SCHEMA`].
    pub schema: String,
    /// The head that they were made for.
    pub head: String,
    /// One entry an axis.
    pub axes: Vec<AxisController>,
}

/// Largest relative difference of a parameter between the motor of a file and that of a head that is none.
const SAME: f64 = 1e-3;

impl ControllerFile {
    /// Refuses a layout that this program does not know.
    ///
    /// # Errors
    /// [`ControllerFileError::Schema`].
    pub fn check(&self) -> Result<(), ControllerFileError> {
        if self.schema == SCHEMA {
            return Ok(());
        }
        let found = self.schema.clone();
        Err(ControllerFileError::Schema { found })
    }

    /// Puts the controllers of X and Y, and of Z where there is one, into a head. Returns the axes whose motor differs from the
    /// one that the controller was made for.
    ///
    /// # Errors
    /// [`ControllerFileError`]; the head is left as it was then.
    pub fn apply(&self, head: &mut ScanHead) -> Result<Vec<char>, ControllerFileError> {
        self.check()?;
        let mut others = Vec::new();
        let mut laws = Vec::new();
        for (letter, axis) in ['x', 'y'].into_iter().zip(&head.mirrors) {
            let found = self.axes.iter().find(|a| a.axis == letter).ok_or_else(|| {
                ControllerFileError::Missing {
                    axis: letter,
                    known: self.known(),
                }
            })?;
            laws.push(found.controller(head.period)?);
            let own = axis.motor().map_err(|source| ControllerFileError::Motor {
                axis: letter,
                source,
            })?;
            if !same(&found.motor, &own.motor) {
                others.push(letter);
            }
        }
        if let Some((axis, _)) = &mut head.focus
            && let Some(axis) = axis.driven_mut()
            && let Some(found) = self.axes.iter().find(|a| a.axis == 'z')
        {
            let law = found.controller(head.period)?;
            if !same(&found.motor, &axis.motor) {
                others.push('z');
            }
            axis.controller = law;
        }
        for (axis, law) in head.driven_mirrors().zip(laws) {
            axis.controller = law;
        }
        Ok(others)
    }

    fn known(&self) -> String {
        let letters: Vec<String> = self.axes.iter().map(|a| a.axis.to_string()).collect();
        if letters.is_empty() {
            "none".to_owned()
        } else {
            letters.join(", ")
        }
    }
}

impl AxisController {
    /// The law, ready for an axis sampled every `period` s.
    ///
    /// # Errors
    /// [`ControllerFileError::Period`].
    pub fn controller(&self, period: f64) -> Result<Controller, ControllerFileError> {
        match &self.law {
            StoredLaw::Cascade { gains } => Ok(Controller::Cascade(*gains)),
            StoredLaw::Exported {
                export,
                unit,
                current,
                feed_forward,
            } => {
                let every = (export.period / period).round();
                if every < 1.0 || (every * period / export.period - 1.0).abs() > 1e-6 {
                    return Err(ControllerFileError::Period {
                        axis: self.axis,
                        found: 1e6 * export.period,
                        wanted: 1e6 * period,
                    });
                }
                Ok(Controller::Sampled(SampledController {
                    form: SampledForm::Exported(export.clone()),
                    unit: *unit,
                    every: every as u32,
                    current: *current,
                    feed_forward: *feed_forward,
                }))
            }
        }
    }
}

/// Whether two motors are one in what a controller relies on.
fn same(one: &Galvanometer, other: &Galvanometer) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= SAME * a.abs().max(b.abs());
    let (a, b) = (one, other);
    let base = close(a.resistance, b.resistance)
        && close(a.inductance, b.inductance)
        && close(a.torque_constant, b.torque_constant)
        && close(a.inertia, b.inertia)
        && close(a.viscous, b.viscous);
    let modes = a.modes.len() == b.modes.len()
        && a.modes
            .iter()
            .zip(&b.modes)
            .all(|(m, n)| close(m.omega, n.omega) && close(m.damping, n.damping));
    base && modes
}
