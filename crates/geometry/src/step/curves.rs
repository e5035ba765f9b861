//! Curve entities (ISO 10303-42, clause 4.4) into [`Curve`].

use std::sync::Arc;

use super::StepError;
use super::entity::Entity;
use super::placement::{direction, frame, point, vector};
use super::units::Units;
use crate::brep::nurbs::NurbsCurve;
use crate::brep::{Curve, CurvePiece};

/// Curves of curves are not nested deeper than this.
const DEPTH: usize = 12;

/// A curve and, where the file trims it, its parameters at start and end.
#[derive(Debug, Clone)]
pub(super) struct Trimmed {
    pub(super) curve: Arc<Curve>,
    pub(super) range: Option<[f64; 2]>,
}

impl Trimmed {
    /// The curve alone, cut to its trims so that its domain is bounded by them.
    pub(super) fn into_bounded(self) -> Arc<Curve> {
        match self.range {
            Some([from, to]) => Arc::new(Curve::Composite(vec![CurvePiece {
                curve: self.curve,
                from,
                to,
            }])),
            None => self.curve,
        }
    }
}

/// Reads any curve.
pub(super) fn curve(entity: Entity<'_>, units: &Units) -> Result<Trimmed, StepError> {
    nested(entity, units, DEPTH)
}

fn nested(entity: Entity<'_>, units: &Units, depth: usize) -> Result<Trimmed, StepError> {
    if depth == 0 {
        return Err(entity.cyclic());
    }
    let whole = |curve: Curve| {
        Ok(Trimmed {
            curve: Arc::new(curve),
            range: None,
        })
    };
    if entity.has("B_SPLINE_CURVE") || entity.has("B_SPLINE_CURVE_WITH_KNOTS") {
        return whole(Curve::Nurbs(spline(entity, units)?));
    }
    match entity.keyword() {
        "LINE" => whole(Curve::Line {
            origin: point(entity.reference(1)?, units)?,
            direction: vector(entity.reference(2)?, units)?,
        }),
        "CIRCLE" => whole(Curve::Circle {
            frame: frame(entity.reference(1)?, units)?,
            radius: entity.positive(2)? * units.length,
        }),
        "ELLIPSE" => whole(Curve::Ellipse {
            frame: frame(entity.reference(1)?, units)?,
            semi_axes: [
                entity.positive(2)? * units.length,
                entity.positive(3)? * units.length,
            ],
        }),
        "HYPERBOLA" => whole(Curve::Hyperbola {
            frame: frame(entity.reference(1)?, units)?,
            semi_axes: [
                entity.positive(2)? * units.length,
                entity.positive(3)? * units.length,
            ],
        }),
        "PARABOLA" => whole(Curve::Parabola {
            frame: frame(entity.reference(1)?, units)?,
            focal: entity.positive(2)? * units.length,
        }),
        "BEZIER_CURVE" | "UNIFORM_CURVE" | "QUASI_UNIFORM_CURVE" => {
            whole(Curve::Nurbs(spline(entity, units)?))
        }
        "POLYLINE" => {
            let points: Result<Vec<_>, _> = entity
                .references(1)?
                .into_iter()
                .map(|p| point(p, units))
                .collect();
            let spline =
                NurbsCurve::polyline(points?).map_err(|e| entity.degenerate(e.to_string()))?;
            whole(Curve::Nurbs(spline))
        }
        "OFFSET_CURVE_3D" => {
            let basis = nested(entity.reference(1)?, units, depth - 1)?.into_bounded();
            whole(Curve::Offset {
                basis,
                distance: entity.real(2)? * units.length,
                direction: direction(entity.reference(4)?)?,
            })
        }
        // the curve in space is the master here; the curves on surfaces are found again by projection
        "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" | "BOUNDED_SURFACE_CURVE" => {
            nested(entity.reference(1)?, units, depth - 1)
        }
        "TRIMMED_CURVE" => trimmed(entity, units, depth),
        "COMPOSITE_CURVE" => {
            let mut pieces = Vec::new();
            for segment in entity.references(1)? {
                let part = nested(segment.reference(2)?, units, depth - 1)?;
                let [from, to] = part.range.unwrap_or_else(|| part.curve.domain());
                if !from.is_finite() || !to.is_finite() || from == to {
                    return Err(segment.degenerate("a piece of a composite curve has no ends"));
                }
                let (from, to) = if segment.flag(1)? {
                    (from, to)
                } else {
                    (to, from)
                };
                pieces.push(CurvePiece {
                    curve: part.curve,
                    from,
                    to,
                });
            }
            if pieces.is_empty() {
                return Err(entity.degenerate("a composite curve without pieces"));
            }
            whole(Curve::Composite(pieces))
        }
        _ => Err(entity.unsupported(
            "a curve",
            "export the part as AP214 with the curves of its edges in space",
        )),
    }
}

fn trimmed(entity: Entity<'_>, units: &Units, depth: usize) -> Result<Trimmed, StepError> {
    let basis = nested(entity.reference(1)?, units, depth - 1)?.into_bounded();
    let trim = |attribute: usize| -> Result<f64, StepError> {
        let list = entity.list(attribute)?;
        if let Some(value) = list.some_number() {
            let angular = matches!(*basis, Curve::Circle { .. } | Curve::Ellipse { .. });
            return Ok(if angular { value * units.angle } else { value });
        }
        let points = list.some_references()?;
        let Some(&at) = points.first() else {
            return Err(entity.wrong(attribute, "a parameter or a point"));
        };
        Ok(basis.nearest(point(at, units)?))
    };
    let (from, mut to) = (trim(2)?, trim(3)?);
    let forward = entity.flag(4)?;
    if let Some(period) = basis.period(units.uncertainty) {
        if forward && to <= from {
            to += period * ((from - to) / period).floor() + period;
        } else if !forward && to >= from {
            to -= period * ((to - from) / period).floor() + period;
        }
    }
    if from == to || !from.is_finite() || !to.is_finite() {
        return Err(entity.degenerate("the trimmed curve has no length"));
    }
    Ok(Trimmed {
        curve: basis,
        range: Some([from, to]),
    })
}

/// Most control points of one spline, and highest repetition of one knot: above any real part.
const MOST: usize = 10_000_000;

fn spline(entity: Entity<'_>, units: &Units) -> Result<NurbsCurve, StepError> {
    // a simple instance carries the name before the spline's own attributes
    let Some(body) = entity.part("B_SPLINE_CURVE", 1) else {
        return Err(entity.unsupported("a curve", "export the part again"));
    };
    let degree = body.count(0)?;
    let points: Result<Vec<_>, _> = body
        .references(1)?
        .into_iter()
        .map(|p| point(p, units))
        .collect();
    let points = points?;
    let weights = match entity.exact("RATIONAL_B_SPLINE_CURVE") {
        Some(rational) => rational.list(0)?.reals()?,
        None => Vec::new(),
    };
    // name, degree, points, form, two flags
    let knots = match knots_of(entity, "B_SPLINE_CURVE_WITH_KNOTS", 6) {
        Some(e) => expand(e, 0, 1)?,
        None => implied(entity, degree, points.len())?,
    };
    NurbsCurve::new(degree, knots, points, weights).map_err(|e| entity.degenerate(e.to_string()))
}

/// Where an entity writes its knots: in its part `kind`, or behind `before` attributes where it is one part; none where it has none.
pub(super) fn knots_of<'a>(entity: Entity<'a>, kind: &str, before: usize) -> Option<Entity<'a>> {
    if entity.is_complex() {
        return entity.exact(kind);
    }
    entity.has(kind).then(|| entity.part("", before))?
}

/// Knots written as values (attribute `values`) and multiplicities (attribute `counts`).
pub(super) fn expand(
    entity: Entity<'_>,
    counts: usize,
    values: usize,
) -> Result<Vec<f64>, StepError> {
    let multiplicities = entity.list(counts)?.counts()?;
    let distinct = entity.list(values)?.reals()?;
    let total = multiplicities
        .iter()
        .try_fold(0usize, |n, &m| n.checked_add(m));
    if multiplicities.len() != distinct.len() || total.is_none_or(|n| n > MOST) {
        return Err(entity.wrong(counts, "one multiplicity for each knot"));
    }
    Ok(distinct
        .iter()
        .zip(&multiplicities)
        .flat_map(|(&k, &m)| std::iter::repeat_n(k, m))
        .collect())
}

/// Knots of the forms that do not write them (ISO 10303-42: uniform, quasi-uniform, Bézier).
pub(super) fn implied(
    entity: Entity<'_>,
    degree: usize,
    points: usize,
) -> Result<Vec<f64>, StepError> {
    if degree == 0 || points <= degree {
        return Err(entity.degenerate("fewer control points than the degree needs"));
    }
    let named = |word: &str| {
        ["_CURVE", "_SURFACE"]
            .iter()
            .any(|kind| entity.has(&format!("{word}{kind}")))
    };
    if named("QUASI_UNIFORM") {
        let mut knots = vec![0.0; degree];
        knots.extend((0..=points - degree).map(|i| i as f64));
        knots.extend(std::iter::repeat_n((points - degree) as f64, degree));
        return Ok(knots);
    }
    if named("UNIFORM") {
        return Ok((0..=points + degree)
            .map(|i| i as f64 - degree as f64)
            .collect());
    }
    if named("BEZIER") {
        if !(points - 1).is_multiple_of(degree) {
            return Err(entity.degenerate("control points do not make whole Bézier pieces"));
        }
        let pieces = (points - 1) / degree;
        let mut knots = vec![0.0];
        knots.extend((0..=pieces).flat_map(|i| std::iter::repeat_n(i as f64, degree)));
        knots.push(pieces as f64);
        return Ok(knots);
    }
    Err(entity.unsupported("a B-spline without knots", "export the part again"))
}
