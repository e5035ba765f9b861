//! A pass on a surface, point by point.

use meltpath_geometry::math::DVec3;

/// One point of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Where, mm.
    pub position: DVec3,
    /// Unit normal of the surface.
    pub normal: DVec3,
    /// Unit direction along the surface in which the wall grows here: the way on which the distance between passes is measured.
    pub growth: DVec3,
    /// The point of the pass before, or of the base, that the strategy laid it from, mm; `None` where there is nothing.
    pub from: Option<DVec3>,
}

impl SurfacePoint {
    /// Distance from the point that it was laid from, mm.
    pub fn spacing(&self) -> Option<f64> {
        Some(self.position.distance(self.from?))
    }

    /// The point that lies a share of the way to another, straight.
    #[must_use]
    pub fn towards(&self, other: &SurfacePoint, share: f64) -> SurfacePoint {
        let unit = |a: DVec3, b: DVec3| a.lerp(b, share).normalize_or(a);
        SurfacePoint {
            position: self.position.lerp(other.position, share),
            normal: unit(self.normal, other.normal),
            growth: unit(self.growth, other.growth),
            from: self.from.zip(other.from).map(|(a, b)| a.lerp(b, share)),
        }
    }
}

/// One uninterrupted pass.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePass {
    /// Its number counted from the base, from 1; pieces of a pass that holes or ends of the surface interrupt share it.
    pub number: u32,
    /// Its points; a closed pass repeats its first point at the end.
    pub points: Vec<SurfacePoint>,
}

impl SurfacePass {
    /// Whether it ends where it starts.
    pub fn is_closed(&self) -> bool {
        let ends = self.points.first().zip(self.points.last());
        self.points.len() > 2 && ends.is_some_and(|(a, b)| a.position == b.position)
    }

    /// Whether it goes on from another: it begins where that ends, on the same place.
    pub fn goes_on_from(&self, before: &SurfacePass) -> bool {
        let ends = before.points.last().zip(self.points.first());
        ends.is_some_and(|(end, begin)| {
            end.position == begin.position && end.from.is_some() && end.from == begin.from
        })
    }

    /// The unit direction of travel at a point, by its neighbours; around the end of a closed pass. Zero where there is none.
    pub fn travel(&self, i: usize) -> DVec3 {
        let (points, closed) = (&self.points, self.is_closed());
        let last = points.len().saturating_sub(1);
        let before = match i {
            0 if closed => last - 1,
            _ => i.saturating_sub(1),
        };
        let after = match i {
            _ if i == last && closed => 1,
            _ => (i + 1).min(last),
        };
        let ends = points.get(before).zip(points.get(after));
        ends.map_or(DVec3::ZERO, |(a, b)| {
            (b.position - a.position).normalize_or_zero()
        })
    }

    /// The same with points in between, so that no move is longer than `longest` mm.
    #[must_use]
    pub fn divided(&self, longest: f64) -> SurfacePass {
        let mut points: Vec<SurfacePoint> = self.points.first().copied().into_iter().collect();
        for pair in self.points.windows(2) {
            let pieces = pair[0].position.distance(pair[1].position) / longest;
            let pieces = pieces.ceil().clamp(1.0, 1e5) as u32;
            let share = |k: u32| f64::from(k) / f64::from(pieces);
            points.extend((1..pieces).map(|k| pair[0].towards(&pair[1], share(k))));
            points.push(pair[1]);
        }
        SurfacePass {
            number: self.number,
            points,
        }
    }

    /// Length, mm.
    pub fn length(&self) -> f64 {
        let steps = self.points.windows(2);
        steps.map(|w| w[0].position.distance(w[1].position)).sum()
    }
}
