//! The surfaces through the middles of layers that follow a body, as far as the part reaches.

use meltpath_geometry::Mesh;
use meltpath_geometry::distance::Distance;
use meltpath_geometry::level::{Sampled, piece};
use meltpath_geometry::math::DVec3;

use super::error::OntoError;
use super::settings::OntoSettings;
use super::shape::Shape;

/// Cells of the grid on which layers are found, along a stepover.
const CELLS: f64 = 3.0;

/// A part and its body, with the distance from the body about what grows.
pub(super) struct Growing<'a> {
    pub(super) body: Shape,
    part: Shape,
    /// What grows, as it lies half of the least layer over the body.
    foot: Distance,
    level: f64,
    sampled: Sampled,
    settings: OntoSettings<'a>,
}

impl<'a> Growing<'a> {
    /// Finds where the part reaches out of the body by more than half of `height`, the height of its first layer, mm.
    pub(super) fn new(
        part: &Mesh,
        body: &Mesh,
        height: f64,
        settings: OntoSettings<'a>,
    ) -> Result<Self, OntoError> {
        let (low, high) = part.bounds().unwrap_or_default();
        let reach = part.vertices.clone();
        let (part, body) = (Shape::new(part), Shape::new(body));
        touching(&reach, &body, height)?;
        let cell = (settings.fill.stepover / CELLS).min(height);
        let room = settings.side.max(settings.over).max(0.0) + 2.0 * cell;
        let from_body = |p: DVec3| body.distance(p);
        let around = (low - DVec3::splat(room), high + DVec3::splat(room));
        let mut sampled = Sampled::new(around, cell, from_body)?;
        // most of a body is not grown on: there the part is as far as the body
        let grows = |p: DVec3, d: f64| {
            d > 0.25 * height && {
                let beyond = part.distance(p);
                beyond < cell && d - beyond > 0.4 * height
            }
        };
        sampled.keep(grows, room);
        let level = 0.5 * height;
        let foot = piece(&sampled.surface(level, from_body), |p| part.distance(p));
        if foot.triangles.is_empty() {
            let reach = reach.iter().map(|p| body.distance(*p)).fold(0.0, f64::max);
            return Err(OntoError::Nothing { reach, height });
        }
        Ok(Growing {
            foot: Distance::new(&foot),
            body,
            part,
            level,
            sampled,
            settings,
        })
    }

    /// One surface for each layer through its middle, from the body on, showing away from it. Layers are as high as `heights` says, the
    /// last one repeats.
    pub(super) fn sheets(&self, heights: &[f64]) -> Vec<Mesh> {
        let mut sheets = Vec::new();
        let mut bottom = 0.0;
        let all = heights
            .iter()
            .chain(std::iter::repeat(heights.last().unwrap_or(&0.0)));
        for height in all.take(self.settings.count.map_or(usize::MAX, |n| n as usize)) {
            let middle = bottom + 0.5 * height;
            if *height <= 0.0 || middle > self.sampled.greatest() {
                break;
            }
            let whole = self.sampled.surface(middle, |p| self.body.distance(p));
            let sheet = piece(&whole, |p| self.outside(p));
            if sheet.triangles.is_empty() {
                break;
            }
            sheets.push(sheet);
            bottom += height;
        }
        sheets
    }

    /// How far a point lies outside of what is laid, mm: the part, raised by what is to lie over it, with its allowance.
    fn outside(&self, p: DVec3) -> f64 {
        let OntoSettings { side, over, .. } = self.settings;
        let Some(foot) = self.body.near.foot(p) else {
            return f64::INFINITY;
        };
        let lowered = (foot.distance - over).max(self.level.min(foot.distance));
        let Some(part) = self.part.near.foot(foot.point + lowered * foot.outward) else {
            return f64::INFINITY;
        };
        if side <= 0.0 {
            return part.distance;
        }
        // aside, not over what faces away from the body
        let aside = 1.0 - part.outward.dot(foot.outward).powi(2);
        let beyond = part.distance - side * aside.max(0.0).sqrt();
        // metal beyond the part is laid around what grows, not all over the body that the part leaves as it is
        let below = self.foot.foot(foot.point + self.level * foot.outward);
        let beside = below.map_or(f64::INFINITY, |b| b.distance.abs());
        beyond.max(beside - side)
    }
}

/// Whether the part begins on the body, to within half a layer.
fn touching(part: &[DVec3], body: &Shape, height: f64) -> Result<(), OntoError> {
    let vertices = part.iter().map(|&p| (body.distance(p), p));
    let nearest = vertices.min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((gap, at)) if gap > 0.5 * height => Err(OntoError::Apart { gap, at }),
        _ => Ok(()),
    }
}
