//! Units of a representation: ISO 10303-41 named units through the representation's context.

use meltpath_base::Reporter;

use super::StepError;
use super::entity::Entity;

/// What one unit of the file is here, and how exact its writer was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Units {
    /// Millimetres for one unit of length.
    pub(super) length: f64,
    /// Radians for one unit of plane angle.
    pub(super) angle: f64,
    /// Distance within which points are one, mm.
    pub(super) uncertainty: f64,
}

/// Conversion units may be defined by other conversion units; no real file goes deeper.
const DEPTH: usize = 8;

/// Reads the units that a representation context assigns. `context` is a
/// `GLOBAL_UNIT_ASSIGNED_CONTEXT`, nearly always part of a complex instance.
pub(super) fn read(context: Entity<'_>, reporter: &Reporter) -> Result<Units, StepError> {
    let mut length = None;
    let mut angle = None;
    if let Some(assigned) = context.exact("GLOBAL_UNIT_ASSIGNED_CONTEXT") {
        // a simple instance inherits identifier and type of the context
        let attribute = if assigned.is_complex() { 0 } else { 2 };
        for unit in assigned.references(attribute)? {
            if unit.has("LENGTH_UNIT") {
                length = Some(1000.0 * factor(unit, DEPTH)?);
            } else if unit.has("PLANE_ANGLE_UNIT") {
                angle = Some(factor(unit, DEPTH)?);
            }
        }
    }
    if length.is_none() {
        reporter.warn(
            "step-no-length-unit",
            format!(
                "{} assigns no unit of length; millimetres were taken",
                context.place()
            ),
            "check the part's size, or export it again with units",
        );
    }
    let length = length.unwrap_or(1.0);
    let mut uncertainty = 1e-5;
    if let Some(assigned) = context.exact("GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT") {
        let attribute = if assigned.is_complex() { 0 } else { 2 };
        for measure in assigned.references(attribute)? {
            let value = measure
                .part("MEASURE_WITH_UNIT", 0)
                .and_then(|m| m.real(0).ok());
            if let Some(value) = value.filter(|v| v.is_finite()) {
                uncertainty = (value * length).clamp(1e-7, 1e-2);
            }
        }
    }
    Ok(Units {
        length,
        angle: angle.unwrap_or(1.0),
        uncertainty,
    })
}

/// Metres or radians for one of this unit.
fn factor(unit: Entity<'_>, depth: usize) -> Result<f64, StepError> {
    if let Some(si) = unit.exact("SI_UNIT") {
        // a simple SI_UNIT inherits the dimensions
        let skip = usize::from(!si.is_complex());
        return match si.enumeration(skip) {
            None => Ok(1.0),
            Some(prefix) => prefix_factor(prefix)
                .ok_or_else(|| si.wrong(skip, "a prefix of the SI, such as .MILLI.")),
        };
    }
    if let Some(converted) = unit.exact("CONVERSION_BASED_UNIT") {
        if depth == 0 {
            return Err(unit.cyclic());
        }
        // in a simple instance name and factor follow the inherited dimensions
        let attribute = if converted.is_complex() { 1 } else { 2 };
        let measure = converted.reference(attribute)?;
        let Some(measure) = measure.part("MEASURE_WITH_UNIT", 0) else {
            return Err(converted.wrong(attribute, "a measure with unit"));
        };
        return Ok(measure.positive(0)? * factor(measure.reference(1)?, depth - 1)?);
    }
    Err(unit.unsupported("a unit", "export the part in millimetres, inches or metres"))
}

fn prefix_factor(prefix: &str) -> Option<f64> {
    let power = match prefix {
        "EXA" => 18,
        "PETA" => 15,
        "TERA" => 12,
        "GIGA" => 9,
        "MEGA" => 6,
        "KILO" => 3,
        "HECTO" => 2,
        "DECA" => 1,
        "DECI" => -1,
        "CENTI" => -2,
        "MILLI" => -3,
        "MICRO" => -6,
        "NANO" => -9,
        "PICO" => -12,
        "FEMTO" => -15,
        "ATTO" => -18,
        _ => return None,
    };
    Some(10f64.powi(power))
}
