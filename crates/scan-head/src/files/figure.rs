//! Figures of data files: a number with its unit and its source, and the units they may have.

use meltpath_base::quantity::{self, QuantityError, Unit};
use serde::Deserialize;

/// Why a head's file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HeadFileError {
    /// Its form.
    #[error("{0}")]
    Form(String),
    /// A value.
    #[error("{place}: {source}")]
    Value {
        /// Table and key.
        place: String,
        /// What is wrong with it.
        source: QuantityError,
    },
}

/// A number of a data file: value with unit, and who says so.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Number and unit.
    pub value: String,
    /// One standard deviation, with its unit, where known.
    pub uncertainty: Option<String>,
    /// Who says so, or why it was chosen.
    pub source: String,
    /// Page of the source.
    pub page: Option<String>,
}

const fn unit(symbol: &'static str, factor: f64) -> Unit {
    Unit::new(symbol, factor)
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

pub(super) const HERTZ: &[Unit] = &[unit("Hz", 1.0), unit("kHz", 1e3)];

pub(super) const LENGTH: &[Unit] = &[unit("mm", 1.0), unit("µm", 1e-3), unit("nm", 1e-6)];

pub(super) const ANGLE: &[Unit] = &[unit("deg", DEGREE), unit("rad", 1.0)];

pub(super) const ANGULAR_SPEED: &[Unit] = &[unit("deg/s", DEGREE), unit("rad/s", 1.0)];

pub(super) const TIME: &[Unit] = &[unit("s", 1.0), unit("ms", 1e-3), unit("µs", 1e-6)];

pub(super) const RESISTANCE: &[Unit] = &[unit("Ω", 1.0)];

pub(super) const INDUCTANCE: &[Unit] = &[unit("µH", 1e-6), unit("H", 1.0)];

pub(super) const TORQUE_CONSTANT: &[Unit] = &[unit("N·m/A", 1.0)];

pub(super) const BACK_EMF: &[Unit] = &[unit("V·s/rad", 1.0)];

pub(super) const INERTIA: &[Unit] = &[unit("kg·m²", 1.0), unit("g·cm²", 1e-7)];

pub(super) const VISCOUS: &[Unit] = &[unit("N·m·s/rad", 1.0)];

pub(super) const STIFFNESS: &[Unit] = &[unit("N·m/rad", 1.0)];

pub(super) const TORQUE: &[Unit] = &[unit("N·m", 1.0), unit("µN·m", 1e-6)];

pub(super) const NONE: &[Unit] = &[unit("1", 1.0)];

pub(super) const CURRENT_GAIN: &[Unit] = &[unit("V/A", 1.0)];

pub(super) const SPEED_GAIN: &[Unit] = &[unit("A·s/deg", 1.0)];

pub(super) const RATE: &[Unit] = &[unit("1/s", 1.0)];

pub(super) const SPEED: &[Unit] = &[unit("mm/s", 1.0), unit("m/s", 1e3)];

pub(super) const POWER: &[Unit] = &[unit("W", 1.0)];

pub(super) const VOLTAGE: &[Unit] = &[unit("V", 1.0)];

pub(super) const CURRENT: &[Unit] = &[unit("A", 1.0)];

/// Reads figures of one table and says which one is wrong.
pub(super) struct Reading<'a> {
    pub(super) table: &'a str,
}

impl Reading<'_> {
    pub(super) fn get(
        &self,
        key: &'static str,
        figure: &Figure,
        units: &[Unit],
    ) -> Result<f64, HeadFileError> {
        let failed = |source| HeadFileError::Value {
            place: format!("{}.{key}", self.table),
            source,
        };
        if let Some(u) = &figure.uncertainty {
            quantity::parse(u, key, units).map_err(failed)?;
        }
        quantity::parse(&figure.value, key, units).map_err(failed)
    }
}

macro_rules! read {
    ($reading:expr, $table:expr, $key:ident, $units:expr) => {
        $reading.get(stringify!($key), &$table.$key, $units)?
    };
}
pub(super) use read;
