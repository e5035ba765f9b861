//! Surface entities (ISO 10303-42, clause 4.4) into [`Surface`].

use std::sync::Arc;

use super::StepError;
use super::curves::{curve, expand, implied, knots_of};
use super::entity::Entity;
use super::placement::{frame, point, vector};
use super::units::Units;
use crate::brep::nurbs::NurbsSurface;
use crate::brep::{Surface, TorusSheet};
use crate::math::DVec3;

/// Surfaces of surfaces are not nested deeper than this.
const DEPTH: usize = 6;

/// Reads any surface.
pub(super) fn surface(entity: Entity<'_>, units: &Units) -> Result<Surface, StepError> {
    nested(entity, units, DEPTH)
}

fn nested(entity: Entity<'_>, units: &Units, depth: usize) -> Result<Surface, StepError> {
    if depth == 0 {
        return Err(entity.cyclic());
    }
    if entity.has("B_SPLINE_SURFACE") || entity.has("B_SPLINE_SURFACE_WITH_KNOTS") {
        return spline(entity, units).map(Surface::Nurbs);
    }
    let placed = || frame(entity.reference(1)?, units);
    match entity.keyword() {
        "PLANE" => Ok(Surface::Plane(placed()?)),
        "CYLINDRICAL_SURFACE" => Ok(Surface::Cylinder {
            frame: placed()?,
            radius: entity.positive(2)? * units.length,
        }),
        "CONICAL_SURFACE" => {
            let radius = entity.real(2)? * units.length;
            let half_angle = entity.real(3)? * units.angle;
            if radius < 0.0 {
                return Err(entity.wrong(2, "a number of 0 or more"));
            }
            let steep = half_angle.abs() >= std::f64::consts::FRAC_PI_2 - 1e-9;
            if steep {
                return Err(entity.degenerate(
                    "the cone is as flat as a plane: its half angle is not below 90°",
                ));
            }
            if half_angle.abs() < 1e-12 {
                if radius == 0.0 {
                    return Err(entity.degenerate("the cone has neither radius nor angle"));
                }
                return Ok(Surface::Cylinder {
                    frame: placed()?,
                    radius,
                });
            }
            Ok(Surface::Cone {
                frame: placed()?,
                radius,
                half_angle,
            })
        }
        "SPHERICAL_SURFACE" => Ok(Surface::Sphere {
            frame: placed()?,
            radius: entity.positive(2)? * units.length,
        }),
        "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
            let outer = entity.keyword() == "TOROIDAL_SURFACE" || entity.flag(4)?;
            let minor = entity.positive(3)? * units.length;
            let mut major = entity.positive(2)? * units.length;
            // radii equal but for rounding: the tube touches the axis
            if (major - minor).abs() < 1e-9 * minor {
                major = minor;
            }
            Ok(Surface::Torus {
                frame: placed()?,
                major,
                minor,
                sheet: if outer {
                    TorusSheet::Outer
                } else {
                    TorusSheet::Inner
                },
            })
        }
        "BEZIER_SURFACE" | "UNIFORM_SURFACE" | "QUASI_UNIFORM_SURFACE" => {
            spline(entity, units).map(Surface::Nurbs)
        }
        "SURFACE_OF_REVOLUTION" => Ok(Surface::Revolution {
            profile: curve(entity.reference(1)?, units)?.into_bounded(),
            frame: frame(entity.reference(2)?, units)?,
        }),
        "SURFACE_OF_LINEAR_EXTRUSION" => Ok(Surface::Extrusion {
            profile: curve(entity.reference(1)?, units)?.into_bounded(),
            direction: vector(entity.reference(2)?, units)?,
        }),
        "OFFSET_SURFACE" => Ok(Surface::Offset {
            base: Arc::new(nested(entity.reference(1)?, units, depth - 1)?),
            distance: entity.real(2)? * units.length,
        }),
        // the face's own edges trim more tightly than the rectangle
        "RECTANGULAR_TRIMMED_SURFACE" => {
            if !(entity.flag(6)? && entity.flag(7)?) {
                return Err(entity.unsupported(
                    "a surface trimmed against its sense",
                    "export the part as AP214 with faces trimmed by edges",
                ));
            }
            nested(entity.reference(1)?, units, depth - 1)
        }
        _ => Err(entity.unsupported(
            "a surface",
            "export the part as AP214 with solids, its surfaces analytic or B-spline",
        )),
    }
}

fn spline(entity: Entity<'_>, units: &Units) -> Result<NurbsSurface, StepError> {
    let Some(body) = entity.part("B_SPLINE_SURFACE", 1) else {
        return Err(entity.unsupported("a surface", "export the part again"));
    };
    let degrees = [body.count(0)?, body.count(1)?];
    let points: Result<Vec<Vec<DVec3>>, StepError> = body
        .list(2)?
        .lists()?
        .into_iter()
        .map(|row| {
            row.references()?
                .into_iter()
                .map(|p| point(p, units))
                .collect()
        })
        .collect();
    let points = points?;
    let rows = points.len();
    let columns = points.first().map_or(0, Vec::len);
    let weights = match entity.exact("RATIONAL_B_SPLINE_SURFACE") {
        Some(rational) => {
            let rows: Result<Vec<Vec<f64>>, _> = rational
                .list(0)?
                .lists()?
                .iter()
                .map(super::entity::List::reals)
                .collect();
            rows?.concat()
        }
        None => Vec::new(),
    };
    // name, two degrees, points, form, three flags
    let knots = match knots_of(entity, "B_SPLINE_SURFACE_WITH_KNOTS", 8) {
        Some(e) => [expand(e, 0, 2)?, expand(e, 1, 3)?],
        None => [
            implied(entity, degrees[0], rows)?,
            implied(entity, degrees[1], columns)?,
        ],
    };
    NurbsSurface::new(degrees, knots, points, weights).map_err(|e| entity.degenerate(e.to_string()))
}
