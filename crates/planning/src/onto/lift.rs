//! Beads of a layer that was laid out in a plane, brought back between the layer below and their own top.

use meltpath_geometry::math::{DVec2, DVec3};
use meltpath_geometry::sheet::thinned;
use meltpath_toolpath::{Channel, Pass, Role};

use rayon::prelude::*;

use super::field::Field;
use super::laid_out::LaidOut;
use crate::fill::Coverage;
use crate::surface::{Pace, SurfacePass, SurfacePoint};

/// Steps along a bead in which it is brought back, mm, before points that say nothing of its course are left out.
const STEP: f64 = 0.5;
/// A bead's course is that of its foot and of a point so far along the torch, mm: the torch turns evenly between points that stay.
const LEVER: f64 = 15.0;

/// One bead.
#[derive(Debug, Clone, PartialEq)]
pub struct OntoBead {
    /// Where it lies; its number is that of its layer.
    pub pass: SurfacePass,
    /// What it is for.
    pub role: Role,
    /// Travel speed of each of its moves, mm/s; `None` is the bead's own.
    pub speeds: Vec<Option<f64>>,
}

/// A place on the top of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TopPlace {
    /// Where the top is planned, mm.
    pub position: DVec3,
    /// Unit vector away from the body.
    pub growth: DVec3,
}

/// How a layer is brought back.
pub(super) struct Lift<'a> {
    pub(super) layer: &'a LaidOut,
    pub(super) field: &'a Field,
    /// The levels of its bottom and its top.
    pub(super) levels: [f64; 2],
    pub(super) chord_error: f64,
    /// How speeds follow its thickness; nothing of a layer that is evenly thick.
    pub(super) pace: Option<Pace>,
}

impl Lift<'_> {
    /// The place on the layer of a point of the plane.
    fn place(&self, p: DVec3, region: u32) -> Option<DVec3> {
        let piece = self.layer.pieces.get(region as usize)?;
        piece.flat.lift(p.truncate() - piece.shift)
    }

    /// A bead; `None` of less than two points.
    pub(super) fn bead(&self, pass: Pass<'_>) -> Option<OntoBead> {
        let mut course = vec![*pass.points.first()?];
        let mut speeds = Vec::new();
        for i in 0..pass.move_count() {
            let (from, to) = (pass.points[i], pass.points[i + 1]);
            let arc = pass.arc(i);
            let steps = (pass.move_length(i) / STEP).ceil().max(1.0) as u32;
            for k in 1..=steps {
                let share = f64::from(k) / f64::from(steps);
                course.push(match &arc {
                    _ if k == steps => to,
                    Some(arc) => arc.at(share),
                    None => from.lerp(to, share),
                });
                speeds.push(pass.value(Channel::Speed, i));
            }
        }
        let all: Option<Vec<SurfacePoint>> = course
            .par_iter()
            .map(|p| self.point(*p, pass.head.entity))
            .collect();
        let mut points = all?;
        if let (true, Some(&first)) = (pass.is_closed(), points.first()) {
            points.pop();
            points.push(first);
        }
        if let Some(pace) = &self.pace {
            speeds = pace.speeds(&points, &speeds);
        }
        let (points, speeds) = self.thinned(&points, &speeds);
        let mut bead = SurfacePass {
            number: self.layer.number,
            points,
        };
        let across = |i: usize| {
            let growth = bead.points[i].growth;
            bead.travel(i).cross(growth).normalize_or_zero()
        };
        let normals: Vec<DVec3> = (0..bead.points.len()).map(across).collect();
        for (point, normal) in bead.points.iter_mut().zip(normals) {
            point.normal = normal;
        }
        (bead.points.len() > 1).then_some(OntoBead {
            pass: bead,
            role: pass.head.role,
            speeds,
        })
    }

    /// The point of a bead over a point of the plane; the way across it is not known yet.
    fn point(&self, p: DVec3, region: u32) -> Option<SurfacePoint> {
        let across = self.field.across(self.place(p, region)?, self.levels)?;
        Some(SurfacePoint {
            position: across.top,
            normal: DVec3::ZERO,
            growth: across.growth,
            from: Some(across.bottom),
        })
    }

    /// The top over a point of the plane.
    pub(super) fn top(&self, p: DVec2, region: u32) -> Option<TopPlace> {
        let point = self.point(p.extend(0.0), region)?;
        Some(TopPlace {
            position: point.position,
            growth: point.growth,
        })
    }

    /// Without the points that say nothing of the course, the torch or the speed.
    fn thinned(
        &self,
        points: &[SurfacePoint],
        speeds: &[Option<f64>],
    ) -> (Vec<SurfacePoint>, Vec<Option<f64>>) {
        let ends = |end: &dyn Fn(&SurfacePoint) -> DVec3| -> Vec<bool> {
            let line: Vec<DVec3> = points.iter().map(end).collect();
            thinned(&line, 0.5 * self.chord_error)
        };
        let feet = ends(&|p| p.from.unwrap_or(p.position));
        let tubes = ends(&|p| p.position + LEVER * p.growth);
        let mut kept = (Vec::new(), Vec::new());
        for (i, point) in points.iter().enumerate() {
            let paced = i > 0 && i < speeds.len() && speeds[i - 1] != speeds[i];
            if feet[i] || tubes[i] || paced {
                kept.0.push(*point);
                if i > 0 {
                    kept.1.push(speeds[i - 1]);
                }
            }
        }
        kept
    }

    /// Coverage with the places of gaps on the layer.
    pub(super) fn coverage(&self, mut all: Vec<Coverage>) -> Vec<Coverage> {
        for covered in &mut all {
            let region = covered.region;
            for gap in &mut covered.gaps {
                gap.place = self.place(gap.place, region).unwrap_or(gap.place);
            }
        }
        all
    }
}
