//! What layers are level sets of: the distance from the body, or the share of the way from the body to the top of the part.
//!
//! The share of a point is its distance from the body over the sum of its distances from body and top: exactly 0 on the one and 1 on
//! the other, without an equation to solve on a grid. It grows along the body's normal on the body, along the top's normal on the top,
//! and along a mean of both between them. Between parallel faces it is the distance; between planes that lean its level sets are planes
//! through the line in which they meet.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::math::DVec3;

use super::shape::Shape;

/// Steps after which a level that is not found is given up.
const STEPS: u32 = 30;
/// How near to a level is on it, mm.
const NEAR: f64 = 1e-7;
/// How near to a level is on it where a kink keeps steps from coming nearer, mm.
const NEAR_A_KINK: f64 = 1e-3;
/// Body and top that are together closer than this have nothing between them, mm.
const TOUCHING: f64 = 1e-6;

/// What layers are level sets of.
pub(super) struct Field {
    pub(super) body: Shape,
    /// With it layers go from the body to the top.
    pub(super) top: Option<Top>,
}

/// A place in a layer, on the bottom and on the top of it.
pub(super) struct Across {
    pub(super) bottom: DVec3,
    pub(super) top: DVec3,
    /// Unit direction from one to the other.
    pub(super) growth: DVec3,
}

impl Field {
    /// The places below and above a point of a layer that lies between two levels.
    pub(super) fn across(&self, p: DVec3, [bottom, top]: [f64; 2]) -> Option<Across> {
        if let Some(ends) = &self.top {
            let from = ends.between(&self.body, p)?;
            let along = |level: f64| ends.level(&self.body, (p, &from), level);
            return Some(Across {
                bottom: along(bottom)?,
                top: along(top)?,
                growth: from.growth,
            });
        }
        let foot = self.body.near.foot(p)?;
        let growth = foot.outward;
        Some(Across {
            bottom: foot.point + bottom * growth,
            top: foot.point + top * growth,
            growth,
        })
    }
}

/// The top of a part, raised by what is to lie over it. Beyond its rims it goes on along its tangent.
pub(super) struct Top {
    near: Distance,
    over: f64,
}

/// A point between body and top.
pub(super) struct Between {
    /// Its share of the way, 0 on the body and 1 on the top.
    pub(super) share: f64,
    /// Unit direction in which the share grows.
    pub(super) growth: DVec3,
    /// How far the whole way would be at the rate of growth here, mm: a layer is so thick over the share that it takes.
    pub(super) whole: f64,
}

impl Top {
    /// Of a sheet that shows away from the body, raised by `over`, mm.
    pub(super) fn new(sheet: &Mesh, over: f64) -> Self {
        Top {
            near: Distance::new(sheet),
            over,
        }
    }

    /// How far a point lies above the top that is not raised, mm.
    pub(super) fn above(&self, p: DVec3) -> f64 {
        self.near
            .foot_beyond(p)
            .map_or(f64::INFINITY, |f| f.distance)
    }

    /// How far body and top are apart for a point that is `from_body` mm over the body: as the part has it, and raised, mm.
    pub(super) fn apart(&self, p: DVec3, from_body: f64) -> [f64; 2] {
        let part = from_body - self.above(p);
        [part, part + self.over]
    }

    /// The share of a point that is `from_body` mm over the body; not a number where body and top touch.
    pub(super) fn share(&self, p: DVec3, from_body: f64) -> f64 {
        let [_, apart] = self.apart(p, from_body);
        if apart > TOUCHING {
            from_body / apart
        } else {
            f64::NAN
        }
    }

    /// Where a point lies; `None` where body and top touch or show against each other.
    pub(super) fn between(&self, body: &Shape, p: DVec3) -> Option<Between> {
        let (foot, top) = (body.near.foot(p)?, self.near.foot_beyond(p)?);
        let below = self.over - top.distance;
        let apart = foot.distance + below;
        let way = below * foot.outward + foot.distance * top.outward;
        let rate = way.length() / (apart * apart);
        (apart > TOUCHING && rate > 0.0).then(|| Between {
            share: foot.distance / apart,
            growth: way.normalize_or_zero(),
            whole: 1.0 / rate,
        })
    }

    /// Where the line through a point along its growth has a share; by secants, as the share is all but linear over a layer.
    fn level(&self, body: &Shape, (p, from): (DVec3, &Between), share: f64) -> Option<DVec3> {
        let usual = 1.0 / from.whole;
        let (mut s, mut off, mut rate) = (0.0, from.share - share, usual);
        for _ in 0..STEPS {
            if off.abs() <= NEAR * usual {
                break;
            }
            let next = s - off / rate;
            let at = p + next * from.growth;
            let there = self.share(at, body.distance(at)) - share;
            let secant = (there - off) / (next - s);
            // a kink may turn a secant around
            rate = if secant > 0.1 * usual { secant } else { usual };
            (s, off) = (next, there);
        }
        (off.abs() <= NEAR_A_KINK * usual).then(|| p + s * from.growth)
    }
}
