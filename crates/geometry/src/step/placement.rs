//! Points, directions and placements (ISO 10303-42, clause 4.4).

use super::StepError;
use super::entity::Entity;
use super::units::Units;
use crate::brep::Frame;
use crate::math::{DAffine3, DMat3, DVec3};

/// A `CARTESIAN_POINT`, mm; a missing third coordinate is 0.
pub(super) fn point(entity: Entity<'_>, units: &Units) -> Result<DVec3, StepError> {
    if entity.keyword() != "CARTESIAN_POINT" {
        return Err(entity.unsupported(
            "a point",
            "export the part again without construction geometry",
        ));
    }
    let c = triple(entity)? * units.length;
    if c.abs().max_element() > FARTHEST {
        return Err(entity.degenerate("the point is more than 1000 km away"));
    }
    Ok(c)
}

/// Farthest coordinate that a part may have, mm.
const FARTHEST: f64 = 1e9;

fn triple(entity: Entity<'_>) -> Result<DVec3, StepError> {
    let c = entity.list(1)?.reals()?;
    if c.is_empty() || c.len() > 3 {
        return Err(entity.wrong(1, "a list of one to three numbers"));
    }
    let at = |i: usize| c.get(i).copied().unwrap_or(0.0);
    Ok(DVec3::new(at(0), at(1), at(2)))
}

/// A `DIRECTION`, unit.
pub(super) fn direction(entity: Entity<'_>) -> Result<DVec3, StepError> {
    triple(entity)?
        .try_normalize()
        .ok_or_else(|| entity.degenerate("the direction has no length"))
}

/// A `VECTOR`, mm.
pub(super) fn vector(entity: Entity<'_>, units: &Units) -> Result<DVec3, StepError> {
    let magnitude = entity.real(2)?;
    if magnitude == 0.0 {
        return Err(entity.degenerate("the vector has no length"));
    }
    Ok(direction(entity.reference(1)?)? * magnitude * units.length)
}

/// An `AXIS2_PLACEMENT_3D` or `AXIS1_PLACEMENT`.
pub(super) fn frame(entity: Entity<'_>, units: &Units) -> Result<Frame, StepError> {
    if !matches!(entity.keyword(), "AXIS2_PLACEMENT_3D" | "AXIS1_PLACEMENT") {
        return Err(entity.unsupported("a placement", "export the part as AP214"));
    }
    let origin = point(entity.reference(1)?, units)?;
    let z = entity.optional(2)?.map_or(Ok(DVec3::Z), direction)?;
    let x = if entity.keyword() == "AXIS2_PLACEMENT_3D" {
        entity.optional(3)?.map(direction).transpose()?
    } else {
        None
    };
    let x = x.unwrap_or_else(|| {
        // the standard's default: the x axis, or the y axis where z runs along x
        if z.cross(DVec3::X).length() > 1e-9 {
            DVec3::X
        } else {
            DVec3::Y
        }
    });
    Frame::new(origin, z, x).ok_or_else(|| entity.degenerate("the placement has no axis"))
}

/// A placement or a `CARTESIAN_TRANSFORMATION_OPERATOR_3D` as a transform.
pub(super) fn transform(entity: Entity<'_>, units: &Units) -> Result<DAffine3, StepError> {
    if !entity
        .keyword()
        .starts_with("CARTESIAN_TRANSFORMATION_OPERATOR")
    {
        return Ok(frame(entity, units)?.to_affine());
    }
    if entity.is_complex() {
        return Err(entity.unsupported("a transformation", "export the part as AP214"));
    }
    // axis1, axis2, origin, scale, axis3 follow one name, or that of the item and name and
    // description of the functionally defined transformation
    let first = if entity.attributes() >= 8 { 3 } else { 1 };
    let axis = |i: usize| entity.optional(first + i)?.map(direction).transpose();
    let origin = point(entity.reference(first + 2)?, units)?;
    let scale = entity.real(first + 3).unwrap_or(1.0);
    let z = axis(4)?.unwrap_or(DVec3::Z);
    let x = axis(0)?.unwrap_or_else(|| {
        if z.cross(DVec3::X).length() > 1e-9 {
            DVec3::X
        } else {
            DVec3::Y
        }
    });
    let frame = Frame::new(origin, z, x)
        .ok_or_else(|| entity.degenerate("the transformation has no axis"))?;
    // the second axis may be given the other way round: that is a mirror
    let y = match axis(1)? {
        Some(y) if y.dot(frame.y) < 0.0 => -frame.y,
        _ => frame.y,
    };
    let degenerate = !scale.is_finite() || scale.abs() < 1e-12;
    if degenerate {
        return Err(entity.degenerate("the transformation scales to nothing"));
    }
    Ok(DAffine3::from_mat3_translation(
        DMat3::from_cols(frame.x, y, frame.z) * scale,
        origin,
    ))
}
