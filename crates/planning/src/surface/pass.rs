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

    /// Length, mm.
    pub fn length(&self) -> f64 {
        let steps = self.points.windows(2);
        steps.map(|w| w[0].position.distance(w[1].position)).sum()
    }
}
